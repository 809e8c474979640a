//! Whether values are possible for a parameter.

use arrayvec::ArrayString;

use super::error::SettingsError;
use super::spec::{ParameterSpec, Shape, Spec};

impl ParameterSpec {
    /// Whether these values are possible.
    pub(super) fn check(&self, section: &'static str, values: &[f64]) -> Result<(), SettingsError> {
        let Self {
            name,
            unit,
            min,
            max,
            ..
        } = *self;
        let wanted = self.shape.len();
        if values.len() != wanted {
            return Err(SettingsError::Count {
                section,
                name,
                given: values.len(),
                wanted,
            });
        }
        for &value in values {
            if !(value >= min && value <= max) {
                return Err(SettingsError::OutOfRange {
                    section,
                    name,
                    value,
                    min,
                    max,
                    unit,
                });
            }
            let real = matches!(self.shape, Shape::Number | Shape::Numbers(_));
            if !real && libm::floor(value) != value {
                return Err(SettingsError::NotWhole {
                    section,
                    name,
                    value,
                    min,
                    max,
                });
            }
        }
        Ok(())
    }
}

impl Spec {
    /// The mistake of a parameter that the section has not.
    pub(super) fn unknown(&self, name: &str) -> SettingsError {
        let mut kept = ArrayString::new();
        for c in name.chars() {
            if kept.try_push(c).is_err() {
                break;
            }
        }
        SettingsError::Unknown {
            section: self.id,
            name: kept,
            known: self.names(),
        }
    }
}
