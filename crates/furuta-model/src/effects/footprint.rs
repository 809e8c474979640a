//! What an effect leaves in a transfer function.

/// What a transfer function of the hanging rig, which is to say its small motions, shows of an effect.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Footprint {
    /// A form of its own: a spring, a lag, a delay, a resonance. It is that of the effect's hooks, linearised where rig and arm rest at 0 with the effect's
    /// other parameters off; these of its parameters shape it.
    Own(&'static [&'static str]),
    /// The form of another effect (its id), and why.
    Like(&'static str, &'static str),
    /// Nothing but another value of what is refitted anyway (`arm damping`, `pendulum damping`, `motor gain`), and why.
    Refitted(&'static str, &'static str),
    /// A factor on this angle's reading, 0 for theta and 1 for alpha: where it is the output, one with the motor's gain.
    Scale(usize),
    /// Nothing, and why.
    Nothing(&'static str),
}

const QUASI: &str = "under noise, dry or quadratic friction acts like a damping that depends on the level alone (its describing function): one response shows no more; measure at two levels";

impl Footprint {
    /// Friction on the arm's axis.
    pub(super) const ARM_DAMPING: Self = Self::Refitted("arm damping", QUASI);
    /// Friction in the hinge.
    pub(super) const PENDULUM_DAMPING: Self = Self::Refitted("pendulum damping", QUASI);
    /// What takes a part of the command that depends on its size.
    pub(super) const GAIN_BY_LEVEL: Self = Self::Refitted(
        "motor gain",
        "by its describing function, a gain that depends on the level alone: measure at two levels",
    );
    /// What moves the rest.
    pub(super) const REST: Self =
        Self::Nothing("a constant torque moves the rest, to first order nothing else");
    /// What comes from elsewhere.
    pub(super) const UNCOMMANDED: Self =
        Self::Nothing("what does not follow the command lowers the coherence, not the response");

    /// The same as seen in the response of this angle over voltage (0 theta, 1 alpha): a factor on a reading is a gain or nothing there.
    ///
    /// ```
    /// use furuta_model::effects::{Footprint, spec};
    /// let scale = spec("sensor.alpha.scale").expect("in the catalogue").footprint;
    /// assert!(matches!(scale.seen_in(1), Footprint::Refitted("motor gain", _)));
    /// assert!(matches!(scale.seen_in(0), Footprint::Nothing(_)));
    /// ```
    #[must_use]
    pub const fn seen_in(self, output: usize) -> Self {
        match self {
            Self::Scale(of) if of == output => Self::Refitted(
                "motor gain",
                "the output's scale and the motor's gain are one factor",
            ),
            Self::Scale(_) => Self::Nothing("the other angle's reading is not looked at"),
            seen => seen,
        }
    }
}
