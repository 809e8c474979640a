//! Signals as tables of their constructor's arguments, for files: what is read is checked as what is built is.

/// Serde's traits for a signal by way of the arguments of its `new`, which its fields are called after.
macro_rules! as_table {
    ($signal:ident { $($field:ident: $kind:ty),* }) => {
        const _: () = {
            #[derive(serde::Serialize, serde::Deserialize)]
            #[serde(deny_unknown_fields)]
            struct Table {
                $($field: $kind),*
            }

            impl serde::Serialize for $signal {
                fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                    Table { $($field: self.$field),* }.serialize(serializer)
                }
            }

            impl<'de> serde::Deserialize<'de> for $signal {
                fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                    let Table { $($field),* } = Table::deserialize(deserializer)?;
                    Self::new($($field),*).map_err(serde::de::Error::custom)
                }
            }
        };
    };
}
