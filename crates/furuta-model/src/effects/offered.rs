//! Whether a diagnosis looks for an effect unasked.

/// Whether a diagnosis looks for an effect unasked.
///
/// Each effect that is looked for costs time, and is one more that a sound rig can be accused of. Those that few rigs
/// have, or that recordings of angles and volts seldom tell from others, are looked for where the user suspects
/// them: `furuta diagnose --candidate ID` ([`super::ON_REQUEST`]).
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Offered {
    /// Always.
    Always,
    /// Not unasked, and why.
    OnRequest(&'static str),
}

impl Offered {
    /// Whether it is looked for without being asked for.
    ///
    /// ```
    /// let offered = |id| furuta_model::effects::spec(id).expect("in the catalogue").offered;
    /// assert!(offered("arm.coulomb").is_always());
    /// assert!(!offered("arm.stop").is_always());
    /// ```
    #[must_use]
    pub const fn is_always(self) -> bool {
        matches!(self, Self::Always)
    }

    /// Why it is not looked for unasked; empty where it is.
    ///
    /// ```
    /// let offered = furuta_model::effects::spec("arm.stop").expect("in the catalogue").offered;
    /// assert!(offered.why().contains("reached"));
    /// ```
    #[must_use]
    pub const fn why(self) -> &'static str {
        match self {
            Self::Always => "",
            Self::OnRequest(why) => why,
        }
    }
}
