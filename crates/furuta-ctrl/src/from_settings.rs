//! How controllers and estimators come from a section of a controller file.

use crate::error::ConfigError;
use crate::section::Settings;
use crate::site::Site;

/// How a controller or an estimator comes from a section of a controller file.
pub trait Design: Sized {
    /// The one with these settings at this site. What is not given is designed from the rig, so that no settings
    /// at all give one that works.
    ///
    /// # Errors
    /// Where the rig allows no such design, or the settings contradict each other.
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError>;
}
