//! Whether a diagnosis looks for an effect from the outset.

/// Whether a diagnosis looks for an effect from the outset.
///
/// Each effect that is looked for costs time, and is one more that a sound rig can be accused of. Those that few rigs
/// have, or that recordings of angles and volts seldom tell from others, are looked for where the others leave
/// something unexplained, and from the outset where the user suspects them: `furuta diagnose --candidate ID`
/// ([`super::RARE`]).
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Offered {
    /// Always.
    Always,
    /// On request, or where the others leave something; and why.
    OnRequest(&'static str),
    /// Never, since no fit can follow it; and what a diagnosis does instead.
    Never(&'static str),
}

impl Offered {
    /// Whether it is looked for from the outset without being asked for.
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

    /// Its name in JSON.
    ///
    /// ```
    /// let offered = |id| furuta_model::effects::spec(id).expect("in the catalogue").offered.word();
    /// assert_eq!(offered("arm.coulomb"), "always");
    /// assert_eq!(offered("arm.stop"), "on request");
    /// assert_eq!(offered("sensor.jitter"), "never");
    /// ```
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Always => "always",
            Self::OnRequest(_) => "on request",
            Self::Never(_) => "never",
        }
    }

    /// Whether it is looked for where others leave something, or where it is asked for.
    ///
    /// ```
    /// let offered = |id| furuta_model::effects::spec(id).expect("in the catalogue").offered;
    /// assert!(offered("arm.stop").is_on_request());
    /// assert!(!offered("sensor.jitter").is_on_request());
    /// ```
    #[must_use]
    pub const fn is_on_request(self) -> bool {
        matches!(self, Self::OnRequest(_))
    }

    /// Why it is not looked for from the outset; empty where it is.
    ///
    /// ```
    /// let offered = furuta_model::effects::spec("arm.stop").expect("in the catalogue").offered;
    /// assert!(offered.why().contains("reached"));
    /// ```
    #[must_use]
    pub const fn why(self) -> &'static str {
        match self {
            Self::Always => "",
            Self::OnRequest(why) | Self::Never(why) => why,
        }
    }
}
