//! What becomes of an effect in a linear model about a place of rest.

/// How a [`crate::linear_plant::LinearPlant`] takes an effect.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum AtRest {
    /// Exactly: by its slope, as a state, or as a time.
    Slope,
    /// By its slope, which holds in a small range only, and why.
    Local(&'static str),
    /// As friction: by its describing function where a speed is given; else left out, and why.
    Friction(&'static str),
    /// As a voltage map with a kink: by its describing function where a command is given; else left out, and why.
    Kinked(&'static str),
    /// The matrices know nothing of it, and why.
    LeftOut(&'static str),
}

impl AtRest {
    pub(crate) const KINKED: Self = Self::Kinked("its gain depends on the command's size or sign");
    pub(crate) const UNCOMMANDED: Self =
        Self::LeftOut("it follows neither the state nor the command");
    pub(crate) const WITHIN_A_TOOTH: Self =
        Self::Local("as far as the arm stays within a small part of 1/order rad");
    pub(crate) const READING: Self =
        Self::LeftOut("the estimator knows of it and takes it off the readings");
}
