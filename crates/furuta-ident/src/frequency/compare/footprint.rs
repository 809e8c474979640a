//! What each effect of the catalogue leaves in a transfer function.

use super::super::first_principles::Output;

/// What a transfer function of the hanging rig shows of an effect.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Footprint {
    /// A form of its own.
    Own,
    /// The same form as another effect's.
    Like(&'static str, &'static str),
    /// Nothing but another value of a parameter that is refitted anyway (and why).
    Parameter(&'static str, &'static str),
    /// Nothing (and why).
    Nothing(&'static str),
}

/// The effects with a form of their own.
pub const OWN: [&str; 6] = [
    "arm.spring",
    "arm.tilt",
    "pendulum.spring",
    "motor.lag",
    "motor.delay",
    "drive.compliance",
];

const ARM: &str = "arm damping";
const PENDULUM: &str = "pendulum damping";
const GAIN: &str = "motor gain";
const QUASI: &str = "under noise, dry or quadratic friction acts like a damping that depends on the level alone (its describing function): one response shows no more; measure at two levels";
const LEVEL: &str =
    "by its describing function, a gain that depends on the level alone: measure at two levels";

/// What a transfer function shows of this effect of the catalogue; `None` for an id that is not in it.
///
/// ```
/// use furuta_ident::frequency::compare::{Footprint, footprint};
/// use furuta_ident::frequency::first_principles::Output;
/// assert_eq!(footprint("arm.spring", Output::Alpha), Some(Footprint::Own));
/// assert!(matches!(footprint("arm.coulomb", Output::Alpha), Some(Footprint::Parameter("arm damping", _))));
/// assert!(furuta_model::CATALOGUE.iter().all(|s| footprint(s.id, Output::Alpha).is_some()));
/// ```
#[must_use]
pub fn footprint(id: &str, output: Output) -> Option<Footprint> {
    use Footprint::{Like, Nothing, Own, Parameter};
    Some(match id {
        "arm.spring" | "arm.tilt" | "pendulum.spring" | "motor.lag" | "motor.delay"
        | "drive.compliance" => Own,
        "arm.cable" => Like("arm.spring", "about its rest a cable is a spring"),
        "arm.cogging" => Like(
            "arm.spring",
            "about one of its rests it pulls the arm back, order times amplitude per radian",
        ),
        "arm.presliding" => Like(
            "arm.spring",
            "before it slides, friction is a spring; when it slides, a damping",
        ),
        "sensor.delay" => Like("motor.delay", "late is late, before the rig or behind it"),
        "drive.backlash" => Like(
            "drive.compliance",
            "by its describing function, play is a coupling that is softer the smaller the motion",
        ),
        "arm.coulomb" | "arm.stribeck" | "arm.quadratic" => Parameter(ARM, QUASI),
        "pendulum.coulomb" | "pendulum.quadratic" => Parameter(PENDULUM, QUASI),
        "motor.deadzone" | "motor.saturation" => Parameter(GAIN, LEVEL),
        "motor.asymmetry" => Parameter(GAIN, "the mean of both directions' gains is seen"),
        "motor.drift" => Parameter(GAIN, "the mean over the recording is seen"),
        "sensor.alpha.scale" => match output {
            Output::Alpha => Parameter(
                GAIN,
                "the output's scale and the motor's gain are one factor",
            ),
            Output::Theta => Nothing("the pendulum's reading is not looked at"),
        },
        "sensor.theta.scale" => match output {
            Output::Theta => Parameter(
                GAIN,
                "the output's scale and the motor's gain are one factor",
            ),
            Output::Alpha => Nothing("the arm's reading is not looked at"),
        },
        "sensor.alpha.offset" => Nothing("a response is of changes"),
        "motor.bias" | "pendulum.bias" => {
            Nothing("a constant torque moves the rest, to first order nothing else")
        }
        "pendulum.inertia_transverse" => {
            Nothing("it acts with the square of the pendulum's angle from hanging")
        }
        "disturbance.kick" | "disturbance.arm_kick" | "disturbance.vibration" => {
            Nothing("what does not follow the command lowers the coherence, not the response")
        }
        _ => return None,
    })
}
