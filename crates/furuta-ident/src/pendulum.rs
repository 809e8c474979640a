//! Recordings of a part of a rig: of the arm alone, its pendulum taken off or locked, or of the pendulum alone, its arm
//! held or moving as measured.

use std::borrow::Cow;
use std::f64::consts::PI;

use furuta_model::effects::Acts;
use furuta_model::params::Coefficients;
use furuta_model::{Scalar, Spec};

use crate::arm_motion::acceleration;
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
/// Where the arm is held, the pendulum is alone, a plane one. The second of the equations is left,
///
/// ```text
/// (I_p + m c²) alpha'' = m g c sin(alpha) - damping alpha' + torques of effects
/// ```
///
/// and data show torques in proportion to `m g c`; neither what is measured of the arm nor the command is looked at.
///
/// Where the pendulum is driven by the arm, whatever moves the arm, the second equation is left as well, with what the
/// arm does to the pendulum:
///
/// ```text
/// (I_p + m c²) alpha'' = m L_r c cos(alpha) theta'' + (m c² + I_t - I_a) sin(alpha) cos(alpha) theta'²
///                        + m g c sin(alpha) - damping alpha' + torques of effects
/// ```
///
/// `theta''` is held from sample to sample and is what makes the readings of theta most likely. The command is not
/// looked at, and nothing that moves or holds the arm can be mistaken for a torque on the pendulum.
///
/// ```
/// use furuta_ident::Pendulum;
/// assert_eq!("removed".parse(), Ok(Pendulum::Removed));
/// let error = "off".parse::<Pendulum>().unwrap_err();
/// assert_eq!(error.to_string(), "give swings, removed, locked, alone or driven, not off");
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
    /// It swings, and the arm is held.
    Alone,
    /// It swings, and the arm moves as measured, whatever moves it.
    Driven,
}

/// No state of a pendulum has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("give swings, removed, locked, alone or driven, not {0}")]
pub struct UnknownPendulum(String);

impl core::str::FromStr for Pendulum {
    type Err = UnknownPendulum;

    fn from_str(text: &str) -> Result<Self, UnknownPendulum> {
        match text {
            "swings" => Ok(Self::Swings),
            "removed" => Ok(Self::Removed),
            "locked" => Ok(Self::Locked),
            "alone" => Ok(Self::Alone),
            "driven" => Ok(Self::Driven),
            other => Err(UnknownPendulum(other.to_owned())),
        }
    }
}

/// An arm that is held, or that moves as measured, has this inertia, kg m²: no torque moves it by as much as rounding
/// would.
const UNMOVED: f64 = 1e30;

impl Pendulum {
    /// All states.
    pub const ALL: [Self; 5] = [
        Self::Swings,
        Self::Removed,
        Self::Locked,
        Self::Alone,
        Self::Driven,
    ];

    /// In words: `with the pendulum off`.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Swings => "of the whole rig",
            Self::Removed => "with the pendulum off",
            Self::Locked => "with the pendulum locked",
            Self::Alone => "with the arm held",
            Self::Driven => "with the arm moving as measured",
        }
    }

    /// Whether the arm alone is looked at.
    #[must_use]
    pub const fn is_still(self) -> bool {
        matches!(self, Self::Removed | Self::Locked)
    }

    /// Whether the whole rig is looked at, as it is built.
    #[must_use]
    pub const fn is_whole(self) -> bool {
        matches!(self, Self::Swings)
    }

    /// Whether arm and pendulum move each other, or the arm at least the pendulum.
    #[must_use]
    pub const fn is_coupled(self) -> bool {
        matches!(self, Self::Swings | Self::Driven)
    }

    /// Whether each of the angles `[theta, alpha]` is looked at.
    ///
    /// ```
    /// use furuta_ident::Pendulum;
    /// assert_eq!(Pendulum::Removed.looks_at(), [true, false]);
    /// ```
    #[must_use]
    pub const fn looks_at(self) -> [bool; 2] {
        [!matches!(self, Self::Alone), !self.is_still()]
    }

    /// Whether each of the angles `[theta, alpha]` tells of the model. An arm that moves as measured is looked at, but
    /// follows itself.
    ///
    /// ```
    /// use furuta_ident::Pendulum;
    /// assert_eq!(Pendulum::Driven.tells(), [false, true]);
    /// ```
    #[must_use]
    pub const fn tells(self) -> [bool; 2] {
        let [theta, alpha] = self.looks_at();
        [theta && !matches!(self, Self::Driven), alpha]
    }

    /// Whether an effect of the rig file is part of the model in this state. What lies between command and arm, or
    /// delays both encoders alike, is not where the arm moves as measured.
    pub(crate) const fn has(self, spec: &Spec) -> bool {
        let late = spec.acts.touches(Acts::DELAY.and(Acts::SENSOR_DELAY));
        !matches!(self, Self::Driven) || (spec.acts.shows_in(self.tells()) && !late)
    }

    /// The coefficients of the rig in this state. Beside the arm a body without weight stays where it is: nothing that
    /// acts on the arm may depend on a state that no sample shows.
    pub(crate) fn coefficients<S: Scalar>(self, c: Coefficients<S>) -> Coefficients<S> {
        let unmoved = S::from_f64(UNMOVED);
        let (arm, lever) = match self {
            Self::Swings => return c,
            Self::Removed => (c.hub, S::ZERO),
            Self::Locked => (c.arm, c.lever),
            Self::Alone => {
                return Coefficients {
                    arm: unmoved,
                    hub: unmoved,
                    swing: S::ZERO,
                    coupling: S::ZERO,
                    ..c
                };
            }
            Self::Driven => {
                return Coefficients {
                    arm: unmoved,
                    hub: unmoved,
                    // The command is the arm's acceleration.
                    drive: unmoved,
                    ..c
                };
            }
        };
        Coefficients {
            arm,
            hub: arm,
            swing: S::ZERO,
            coupling: S::ZERO,
            weight: S::ZERO,
            lever,
            ..c
        }
    }

    /// What a person should know of what is found in this state.
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
            Self::Alone => Some(
                "the arm is held, so the pendulum alone is looked at: its torques are in proportion to the rig file's \
                 pendulum.mass times pendulum.com",
            ),
            Self::Driven => Some(
                "the arm moves as measured, so the pendulum alone is looked at: its torques are in proportion to the \
                 rig file's pendulum.mass times pendulum.com; nothing is said of arm and motor, and u is the arm's \
                 acceleration, rad/s2",
            ),
        }
    }

    /// The recording as it is looked at in this state, the pendulum hanging where it is still, the arm where it was at
    /// first where it is held, and its acceleration in place of the command where it moves as measured.
    pub(crate) fn seen(self, recording: &Recording) -> Cow<'_, Recording> {
        let mut seen = Cow::Borrowed(recording);
        if self.is_still() {
            let seen = seen.to_mut();
            seen.alpha.fill(PI);
            seen.alpha_dot = None;
        }
        if let (Self::Alone, Some(first)) = (self, recording.theta.first()) {
            let seen = seen.to_mut();
            seen.theta.fill(*first);
            seen.theta_dot = None;
        }
        if self == Self::Driven {
            let r = recording;
            seen.to_mut().u = acceleration(&r.t, &r.theta, &r.segments, r.sample_period);
        }
        seen
    }

    /// Whether what was noticed about a recording matters in this state: what is wrong with a column that is not looked
    /// at does not.
    pub(crate) fn matters(self, notice: &NoticeKind) -> bool {
        let [theta, alpha] = self.looks_at();
        match notice.column() {
            Some("u") => !matches!(self, Self::Alone | Self::Driven),
            Some("theta") => theta,
            Some("alpha") => alpha,
            _ => true,
        }
    }
}
