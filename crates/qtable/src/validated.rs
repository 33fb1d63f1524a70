//! Decoding that ends in a check: a type read from a file keeps the promises its constructors make.

/// Implements `Serialize` and `Deserialize` for a type that derives both with
/// `#[serde(remote = "Self")]` and has `fn restore(self) -> Result<Self, E>`, which checks what was
/// read and rebuilds what was not stored.
macro_rules! validated {
    ($type:ident $(<$v:ident: $bound:path>)?) => {
        #[cfg(feature = "serde")]
        impl $(<$v: $bound + serde::Serialize>)? serde::Serialize for $type $(<$v>)? {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                Self::serialize(self, serializer)
            }
        }

        #[cfg(feature = "serde")]
        impl<'de $(, $v: $bound + serde::Deserialize<'de>)?> serde::Deserialize<'de> for $type $(<$v>)? {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                Self::deserialize(deserializer)?.restore().map_err(serde::de::Error::custom)
            }
        }
    };
}

pub(crate) use validated;
