//! Validation of settings on deserialization.

/// Implements `Deserialize` for settings with a method `check`, which is called on what was read.
macro_rules! checked {
    ($type:ident { $($field:ident: $kind:ty),* $(,)? }) => {
        #[cfg(feature = "serde")]
        impl<'de> serde::Deserialize<'de> for $type {
            fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                #[derive(serde::Deserialize)]
                struct Read {
                    $($field: $kind),*
                }
                let Read { $($field),* } = serde::Deserialize::deserialize(from)?;
                let read = Self { $($field),* };
                read.check().map_err(serde::de::Error::custom)?;
                Ok(read)
            }
        }
    };
    ($type:ident($kind:ty)) => {
        #[cfg(feature = "serde")]
        impl<'de> serde::Deserialize<'de> for $type {
            fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                let read = Self(<$kind as serde::Deserialize>::deserialize(from)?);
                read.check().map_err(serde::de::Error::custom)?;
                Ok(read)
            }
        }
    };
}

pub(crate) use checked;

/// Checks that the quantity called `name` is a size.
pub(crate) fn above_zero(name: &str, value: f64) -> Result<(), String> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(format!("{name} is {value}; it must be finite and above 0"))
}
