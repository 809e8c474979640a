//! The numbers given in one section.

use super::error::{MAX_NUMBERS, SettingsError};
use super::spec::{ParameterSpec, Spec};
use arrayvec::ArrayVec;

/// The numbers given in one section. What is not given has its default, or is designed from the rig.
///
/// ```
/// use furuta_ctrl::controllers;
/// let settings = controllers::settings("lqr").ok_or("no such controller")?;
/// let settings = settings.with("gain", &[-1.0, 27.7, -2.0, 3.6])?;
/// assert_eq!(settings.numbers("gain"), Some(&[-1.0, 27.7, -2.0, 3.6][..]));
/// let error = settings.with("gain", &[f64::NAN; 4]).unwrap_err();
/// assert_eq!(error.to_string(), "lqr: gain = NaN is outside the allowed range [-1000000, 1000000] V/rad, V s/rad");
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Settings {
    spec: &'static Spec,
    /// Bit `i`: whether parameter `i` is given.
    pub(crate) given: u32,
    /// The given ones, one after the other.
    pub(crate) numbers: ArrayVec<f64, MAX_NUMBERS>,
}

impl PartialEq for Settings {
    fn eq(&self, other: &Self) -> bool {
        self.spec.id == other.spec.id && self.given == other.given && self.numbers == other.numbers
    }
}

impl Settings {
    /// Nothing given.
    #[must_use]
    pub const fn new(spec: &'static Spec) -> Self {
        Self {
            spec,
            given: 0,
            numbers: ArrayVec::new_const(),
        }
    }

    /// What the section is and takes.
    #[must_use]
    pub const fn spec(&self) -> &'static Spec {
        self.spec
    }

    /// The same with `name` set to these numbers (one for a number, a switch or the place of a word).
    ///
    /// # Errors
    /// No such parameter, another count, or a value outside its range.
    pub fn with(&self, name: &str, values: &[f64]) -> Result<Self, SettingsError> {
        let section = self.spec.id;
        let place = self
            .spec
            .place(name)
            .ok_or_else(|| self.spec.unknown(name))?;
        let parameter = &self.spec.parameters[place];
        parameter.check(section, values)?;
        let mut next = Self::new(self.spec);
        for (i, p) in self.spec.parameters.iter().enumerate() {
            let values = if i == place {
                values
            } else {
                match self.numbers(p.name) {
                    Some(values) => values,
                    None => continue,
                }
            };
            next.given |= 1 << i;
            next.numbers
                .try_extend_from_slice(values)
                .map_err(|_| SettingsError::Full { section })?;
        }
        Ok(next)
    }

    /// The numbers given for `name`.
    #[must_use]
    pub fn numbers(&self, name: &str) -> Option<&[f64]> {
        let place = self.spec.place(name)?;
        if self.given & (1 << place) == 0 {
            return None;
        }
        let start = self.spec.parameters[..place]
            .iter()
            .enumerate()
            .filter(|(i, _)| self.given & (1 << i) != 0)
            .map(|(_, p)| p.shape.len())
            .sum();
        self.numbers
            .get(start..start + self.spec.parameters[place].shape.len())
    }

    /// The parameters that are given, with their numbers.
    pub fn given(&self) -> impl Iterator<Item = (&'static ParameterSpec, &[f64])> {
        self.spec
            .parameters
            .iter()
            .filter_map(|p| Some((p, self.numbers(p.name)?)))
    }
}
