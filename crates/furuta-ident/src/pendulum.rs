//! Recordings of a rig whose pendulum is taken off or locked: of the arm alone.

use std::f64::consts::PI;

use furuta_model::params::Coefficients;

use crate::recording::{NoticeKind, Recording};

/// What the pendulum does while a rig is recorded.
///
/// Taken off or locked to the arm, it leaves the arm alone to be looked at: one body, one angle. The first of the
/// equations of motion is left, without its coupling to the second,
///
/// ```text
/// J theta'' = drive u - damping theta' + torques of effects
/// ```
///
/// `J` being `J_a` where the pendulum is off and `J_a + m L_r² + I_a` where it is locked, hanging. Data then show
/// torques in proportion to `J`, which stays the sheet's; what is measured of the pendulum is not looked at.
///
/// ```
/// use furuta_ident::Pendulum;
/// assert_eq!("removed".parse(), Ok(Pendulum::Removed));
/// assert_eq!("off".parse::<Pendulum>().unwrap_err().to_string(), "give swings, removed or locked, not off");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pendulum {
    /// As it is built: it hangs from its hinge and turns.
    #[default]
    Swings,
    /// It is not on the arm.
    Removed,
    /// It hangs and cannot turn against the arm.
    Locked,
}

/// No state of a pendulum has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("give swings, removed or locked, not {0}")]
pub struct UnknownPendulum(String);

impl core::str::FromStr for Pendulum {
    type Err = UnknownPendulum;

    fn from_str(text: &str) -> Result<Self, UnknownPendulum> {
        match text {
            "swings" => Ok(Self::Swings),
            "removed" => Ok(Self::Removed),
            "locked" => Ok(Self::Locked),
            other => Err(UnknownPendulum(other.to_owned())),
        }
    }
}

impl Pendulum {
    /// Whether the arm alone is looked at.
    #[must_use]
    pub const fn is_still(self) -> bool {
        !matches!(self, Self::Swings)
    }

    /// The coefficients of the rig in this state. Beside the arm a body without weight stays where it is: nothing that
    /// acts on the arm may depend on a state that no sample shows.
    pub(crate) fn coefficients(self, c: Coefficients<f64>) -> Coefficients<f64> {
        let (arm, lever) = match self {
            Self::Swings => return c,
            Self::Removed => (c.hub, 0.0),
            Self::Locked => (c.arm, c.lever),
        };
        Coefficients {
            arm,
            hub: arm,
            swing: 0.0,
            coupling: 0.0,
            weight: 0.0,
            lever,
            ..c
        }
    }

    /// What a person should know of a diagnosis in this state.
    pub(crate) const fn notice(self) -> Option<&'static str> {
        match self {
            Self::Swings => None,
            Self::Removed => Some(
                "the pendulum is off, so the arm alone is looked at: its torques are in proportion to the rig file's \
                 arm.inertia",
            ),
            Self::Locked => Some(
                "the pendulum is locked, so the arm alone is looked at: its torques are in proportion to the rig \
                 file's inertia of arm and pendulum about the arm's axis",
            ),
        }
    }

    /// The recording as it is looked at in this state, the pendulum hanging where it is still.
    pub(crate) fn seen(self, mut recording: Recording) -> Recording {
        if self.is_still() {
            recording.alpha.fill(PI);
            recording.alpha_dot = None;
        }
        recording
    }

    /// Whether what was noticed about a recording matters in this state: of a pendulum that is off or locked, its
    /// encoder's readings do not.
    pub(crate) fn matters(self, notice: &NoticeKind) -> bool {
        !self.is_still() || notice.column() != Some("alpha")
    }
}
