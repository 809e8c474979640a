//! Whether values are possible for a parameter.

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
    pub(super) const fn unknown(&self) -> SettingsError {
        SettingsError::Unknown {
            section: self.id,
            known: self.names(),
        }
    }
}
