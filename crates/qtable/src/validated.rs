//! Deserialization that ends in a check.

/// Declares a struct that serde reads only in a valid state.
///
/// The struct has `fn restore(self) -> Result<Self, Error>`, which checks what was read and
/// rebuilds what is not stored. Its constructors end in the same check.
macro_rules! validated {
    (
        $(#[$meta:meta])*
        $visibility:vis struct $name:ident {
            $($(#[$field_meta:meta])* $field_visibility:vis $field:ident: $type:ty,)*
        }
    ) => {
        $(#[$meta])*
        #[cfg_attr(feature = "serde", derive(serde::Serialize))]
        $visibility struct $name {
            $($(#[$field_meta])* $field_visibility $field: $type,)*
        }

        #[cfg(feature = "serde")]
        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                #[derive(serde::Deserialize)]
                struct Stored {
                    $($(#[$field_meta])* $field: $type,)*
                }
                let Stored { $($field),* } = Stored::deserialize(deserializer)?;
                Self { $($field),* }.restore().map_err(serde::de::Error::custom)
            }
        }
    };
}

pub(crate) use validated;
