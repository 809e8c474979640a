//! What an effect is: its parameters, and what to tell a student about it.

use super::acts::Acts;
use super::at_rest::AtRest;
use super::error::EffectError;
use super::footprint::Footprint;
use super::offered::Offered;
use super::own::OwnLaws;
use crate::params::Params;

/// What values a parameter can take.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A real number: a fit varies it.
    Real,
    /// A part of something, from none of it to all of it: a real number whose upper bound can be its value.
    Share,
    /// An angle that a sine or the effect's direction begins at, rad: the effect is the sum of a part at 0 and a part
    /// at a quarter turn.
    Phase,
    /// The arm's angle from which the effect is counted, rad: turning the arm and this angle together changes nothing.
    Rest,
    /// A frequency, Hz: a search looks through a grid as fine as the recordings are long.
    Frequency,
    /// A moment of a run, s: a search looks through all of them.
    Time,
    /// A moment of a run between two samples, s: a search looks through all of them, and no fit improves it.
    Moment,
    /// From one of equal levels to the next: what it does jumps as it grows, level by level. A search looks through all
    /// of them, and no fit improves it.
    Spacing,
    /// The number of a run, from 0.
    Run,
    /// A whole number: a search tries one after the other.
    Whole,
    /// One of these, by name in rig files and by its place in the list elsewhere.
    Choice(&'static [&'static str]),
}

/// How large something is that would be noticed.
#[derive(Copy, Clone, Debug)]
pub enum Typical {
    /// So large on a rig with these parameters.
    Of(fn(&Params<f64>) -> f64),
    /// So large on any rig.
    Is(f64),
}

/// One parameter of an effect.
#[derive(Copy, Clone, Debug)]
pub struct ParameterSpec {
    /// As in rig files and JSON.
    pub name: &'static str,
    /// SI unit (`-`: a pure number).
    pub unit: &'static str,
    /// Which values it can take within the range.
    pub kind: Kind,
    /// The value where a rig file leaves it out; without one it must be given.
    pub default: Option<f64>,
    /// Lower end of the allowed range.
    pub min: f64,
    /// Upper end of the allowed range.
    pub max: f64,
    /// The value at which the effect does nothing (a strength: 0, a gain: 1), or from which this parameter is counted.
    pub off: f64,
    /// A distance from `off` that would be noticed on this rig: the unit in which a search takes its steps.
    pub typical: Typical,
    /// Where a search starts, as multiples of `typical` from `off`.
    pub starts: &'static [f64],
}

impl Kind {
    /// Whether only whole numbers are among its values; of a choice they are places in its list.
    #[must_use]
    pub const fn is_whole(self) -> bool {
        matches!(self, Self::Run | Self::Whole | Self::Choice(_))
    }

    /// Whether it varies continuously, so that a fit can improve it.
    #[must_use]
    pub const fn is_continuous(self) -> bool {
        matches!(
            self,
            Self::Real | Self::Share | Self::Phase | Self::Rest | Self::Frequency | Self::Time
        )
    }

    /// Whether it says how much, not where, when or which.
    #[must_use]
    pub const fn is_amount(self) -> bool {
        matches!(self, Self::Real | Self::Share | Self::Spacing)
    }
}

impl ParameterSpec {
    /// A distance from `off` that would be noticed on a rig with these parameters, in the parameter's unit.
    ///
    /// ```
    /// let rig = furuta_model::Rig::builtin("qube-servo-2").expect("built in");
    /// let rest = &furuta_model::effects::spec("arm.spring").expect("in the catalogue").parameters[1];
    /// assert_eq!(rest.typical(&rig.params), 0.3); // rad
    /// ```
    #[must_use]
    pub fn typical(&self, params: &Params<f64>) -> f64 {
        match self.typical {
            Typical::Of(size) => size(params),
            Typical::Is(size) => size,
        }
    }

    /// The value that `word` stands for, where the parameter is a choice.
    #[must_use]
    pub fn choice(&self, word: &str) -> Option<f64> {
        match self.kind {
            Kind::Choice(words) => {
                let place = words.iter().position(|w| *w == word)?;
                #[allow(clippy::cast_precision_loss)]
                Some(place as f64)
            }
            _ => None,
        }
    }

    /// The word for a value, where the parameter is a choice.
    #[must_use]
    pub fn word(&self, value: f64) -> Option<&'static str> {
        match self.kind {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            Kind::Choice(words) => words.get(value as usize).copied(),
            _ => None,
        }
    }
}

/// A catalogue entry.
#[derive(Copy, Clone, Debug)]
pub struct Spec {
    /// Public name: rig files, JSON, Python, reports.
    pub id: &'static str,
    /// Name in words.
    pub name: &'static str,
    /// The physics as a formula.
    pub law: &'static str,
    /// One sentence a student understands.
    pub sentence: &'static str,
    /// How it shows in recorded data.
    pub shows: &'static str,
    /// The experiment that shows it apart from its look-alikes.
    pub experiment: &'static str,
    /// Ids of effects that look alike in data.
    pub look_alikes: &'static [&'static str],
    /// Its parameters.
    pub parameters: &'static [ParameterSpec],
    /// How many of them, from the first, are strengths: the effect does nothing where all of these are zero, or at
    /// their [`ParameterSpec::off`].
    pub strengths: usize,
    /// What it leaves in a transfer function.
    pub footprint: Footprint,
    /// Which hooks it implements.
    pub acts: Acts,
    /// What becomes of it in a linear model about a place of rest.
    pub at_rest: AtRest,
    /// The laws of a user's own hypothesis; none of the catalogue has them.
    pub own: Option<&'static OwnLaws>,
    /// Whether a diagnosis looks for it from the outset.
    pub offered: Offered,
}

impl Spec {
    /// Whether it is a function of the present state and of the motor's voltage alone: it remembers nothing, does not
    /// depend on time ([`Acts::CLOCK`]), and changes neither the command nor the readings. A run with such effects can
    /// be cut into pieces that begin with a state.
    ///
    /// ```
    /// let follows = |id| furuta_model::effects::spec(id).expect("in the catalogue").follows_state();
    /// assert!(follows("arm.coulomb") && follows("motor.ripple"));
    /// assert!(!follows("motor.delay") && !follows("arm.presliding") && !follows("disturbance.vibration"));
    /// assert!(!follows("arm.fading_friction") && !follows("motor.drift"));
    /// ```
    #[must_use]
    pub fn follows_state(&self) -> bool {
        let of_state = Acts::TORQUE
            .and(Acts::DRY_FRICTION)
            .and(Acts::SHAPE)
            .and(Acts::ANGLE)
            .and(Acts::SHAFT)
            .and(Acts::ARM);
        of_state.includes(self.acts)
    }

    /// Whether it depends on the arm's absolute angle, so that it matters where the arm's encoder was zeroed.
    ///
    /// ```
    /// let sees = |id| furuta_model::effects::spec(id).expect("in the catalogue").sees_angle();
    /// assert!(sees("arm.cogging") && sees("sensor.theta.eccentricity"));
    /// assert!(!sees("arm.coulomb") && !sees("disturbance.vibration"));
    /// ```
    #[must_use]
    pub const fn sees_angle(&self) -> bool {
        self.acts.includes(Acts::ANGLE)
    }

    /// Which of its parameters says from where its law is counted: a phase, or an angle of rest.
    ///
    /// ```
    /// let origin = |id| furuta_model::effects::spec(id).expect("in the catalogue").origin();
    /// assert_eq!(origin("arm.cogging"), Some(2)); // amplitude, order, phase
    /// assert_eq!(origin("arm.spring"), Some(1)); // stiffness, rest
    /// assert_eq!(origin("arm.coulomb"), None);
    /// ```
    #[must_use]
    pub fn origin(&self) -> Option<usize> {
        self.parameters
            .iter()
            .position(|p| matches!(p.kind, Kind::Phase | Kind::Rest))
    }

    /// Whether it acts once: at one moment of one run.
    ///
    /// ```
    /// let once = |id| furuta_model::effects::spec(id).expect("in the catalogue").acts_once();
    /// assert!(once("disturbance.kick") && once("sensor.theta.lost_counts"));
    /// assert!(!once("sensor.alpha.offset"));
    /// ```
    #[must_use]
    pub const fn acts_once(&self) -> bool {
        self.acts.touches(Acts::JUMPS.and(Acts::COUNTS))
    }

    /// Whether both are the same entry: of users' own laws the very same text.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        let same_law = match (self.own, other.own) {
            (None, None) => true,
            (Some(a), Some(b)) => core::ptr::eq(a, b),
            _ => false,
        };
        self.id == other.id && same_law
    }

    /// The values in the order of the parameters: those given, defaults for what is left out.
    ///
    /// # Errors
    /// [`EffectError::Missing`] where a parameter that has no default is left out.
    ///
    /// ```
    /// use furuta_model::effects;
    /// let drive = effects::spec("drive.backlash").expect("in the catalogue");
    /// let given = |name: &str| match name {
    ///     "gap" => Some(0.05),
    ///     "motor_share" => Some(0.4),
    ///     _ => None, // encoder = "arm"
    /// };
    /// assert_eq!(drive.values(given)?[..], [0.05, 0.4, 0.0]);
    /// let error = drive.values(|_| None).expect_err("no gap");
    /// assert_eq!(error.to_string(), "drive.backlash lacks gap (rad): give it a value");
    /// # Ok::<(), furuta_model::EffectError>(())
    /// ```
    pub fn values(
        &self,
        given: impl Fn(&str) -> Option<f64>,
    ) -> Result<arrayvec::ArrayVec<f64, { super::MAX_PARAMETERS }>, EffectError> {
        let value = |p: &ParameterSpec| {
            given(p.name).or(p.default).ok_or(EffectError::Missing {
                effect: self.id,
                parameter: p.name,
                unit: p.unit,
            })
        };
        self.parameters.iter().map(value).collect()
    }
}
