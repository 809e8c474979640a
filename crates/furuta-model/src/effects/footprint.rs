//! What an effect leaves in a transfer function.

use crate::transfer::Output;

/// What a transfer function of the hanging rig, which is to say its small motions, shows of an effect.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Footprint {
    /// A form of its own: a spring, a lag, a delay, a resonance. It is that of the effect's hooks, linearised where rig
    /// and arm rest at 0 with the effect's other parameters off; these of its parameters shape it.
    Own(&'static [&'static str]),
    /// The form of another effect (its id), and why.
    Like(&'static str, &'static str),
    /// Nothing but another value of what is refitted anyway, and why.
    Refitted(BaseParameter, &'static str),
    /// A factor on this angle's reading: where it is the output, one with the motor's gain.
    Scale(Output),
    /// Nothing, and why.
    Nothing(&'static str),
}

/// What of a rig is refitted whatever effects are looked for: the combinations of its parameters that the equations of
/// motion contain, over the weight's moment.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum BaseParameter {
    /// The arm's inertia, the pendulum's mass at its end included.
    ArmInertia,
    /// The pendulum's inertia about its hinge.
    PendulumInertia,
    /// Torque per volt.
    MotorGain,
    /// Viscous friction of the arm, the motor's counter-voltage included.
    ArmDamping,
    /// Viscous friction of the hinge.
    PendulumDamping,
}

impl BaseParameter {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::ArmInertia,
        Self::PendulumInertia,
        Self::MotorGain,
        Self::ArmDamping,
        Self::PendulumDamping,
    ];

    /// In words: `arm inertia`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::ArmInertia => "arm inertia",
            Self::PendulumInertia => "pendulum inertia",
            Self::MotorGain => "motor gain",
            Self::ArmDamping => "arm damping",
            Self::PendulumDamping => "pendulum damping",
        }
    }
}

impl core::fmt::Display for BaseParameter {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

const QUASI: &str = "under noise, dry or quadratic friction acts like a damping that depends on the level \
    alone (its describing function): one response shows no more; measure at two levels";

impl Footprint {
    /// Friction on the arm's axis.
    pub(super) const ARM_DAMPING: Self = Self::Refitted(BaseParameter::ArmDamping, QUASI);
    /// Friction in the hinge.
    pub(super) const PENDULUM_DAMPING: Self = Self::Refitted(BaseParameter::PendulumDamping, QUASI);
    /// What takes a part of the command that depends on its size.
    pub(super) const GAIN_BY_LEVEL: Self = Self::Refitted(
        BaseParameter::MotorGain,
        "by its describing function, a gain that depends on the level alone: measure at two levels",
    );
    /// What moves the rest.
    pub(super) const REST: Self =
        Self::Nothing("a constant torque moves the rest, to first order nothing else");
    /// What comes from elsewhere.
    pub(crate) const UNCOMMANDED: Self =
        Self::Nothing("what does not follow the command lowers the coherence, not the response");

    /// The same as seen in the response of this angle over voltage: a factor on a reading is a gain or nothing there.
    ///
    /// ```
    /// use furuta_model::effects::{BaseParameter, Footprint, spec};
    /// use furuta_model::transfer::Output;
    /// let scale = spec("sensor.alpha.scale").expect("in the catalogue").footprint;
    /// assert!(matches!(scale.seen_in(Output::Alpha), Footprint::Refitted(BaseParameter::MotorGain, _)));
    /// assert!(matches!(scale.seen_in(Output::Theta), Footprint::Nothing(_)));
    /// ```
    #[must_use]
    pub const fn seen_in(self, output: Output) -> Self {
        match self {
            Self::Scale(of) => match (of, output) {
                (Output::Theta, Output::Theta) | (Output::Alpha, Output::Alpha) => Self::Refitted(
                    BaseParameter::MotorGain,
                    "the output's scale and the motor's gain are one factor",
                ),
                _ => Self::Nothing("the other angle's reading is not looked at"),
            },
            seen => seen,
        }
    }
}
