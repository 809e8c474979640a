//! Empirical terms: `coefficient term` on one axis, for what no law of the catalogue explains.
//!
//! A term is fitted, not derived: it says what torque the recordings ask for, not why. Each is one entry of [`TERMS`];
//! `custom.1`, `custom.2`, … of one rig add up to an expression. They are no part of [`super::CATALOGUE`]: nothing is
//! hidden behind them, and a search for causes does not name them.

use super::{
    Acts, AtRest, Footprint, Instant, Kind, Law, MAX_PARAMETERS, Offered, ParameterSpec, Spec,
    Typical,
};
use crate::scalar::Scalar;
use arrayvec::ArrayVec;

/// One function of state and voltage that an empirical term can be.
///
/// ```
/// use furuta_model::effects::{Term, TERMS};
/// let drag: &Term = TERMS.iter().find(|t| t.word == "theta_dot*abs(theta_dot)").expect("in the library");
/// assert_eq!(drag.unit, "rad2/s2");
/// ```
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Term {
    /// As in rig files: an expression in `theta`, `alpha` (rad), `theta_dot`, `alpha_dot` (rad/s) and `u`, the voltage
    /// at the motor (V).
    pub word: &'static str,
    /// Its unit; a coefficient is in N m over that.
    pub unit: &'static str,
}

/// What terms are made of, at one moment.
struct Variables<S> {
    theta: S,
    theta_dot: S,
    alpha_dot: S,
    u: S,
    /// Sine and cosine of the arm's angle.
    arm: [S; 2],
    /// Sine and cosine of the pendulum's angle.
    pendulum: [S; 2],
}

/// Writes the library once: words for rig files, units, and values.
macro_rules! terms {
    ($v:ident; $($word:literal [$unit:literal] = $value:expr;)+) => {
        /// The library of which empirical terms are made. The first of each axis are smooth; nothing here jumps, so
        /// nothing chatters.
        pub static TERMS: &[Term] = &[$(Term { word: $word, unit: $unit }),+];

        const WORDS: &[&str] = &[$($word),+];

        /// The value of the term at this place of the library; zero beyond its end.
        #[inline(always)]
        fn value<S: Scalar>(place: usize, $v: &Variables<S>) -> S {
            let mut here = 0;
            $(
                if place == here { return $value; }
                here += 1;
            )+
            let _ = here;
            S::ZERO
        }
    };
}

/// `2 sin cos`.
#[inline(always)]
fn sin_of_double<S: Scalar>([sin, cos]: [S; 2]) -> S {
    let product = sin * cos;
    product + product
}

/// `cos² - sin²`.
#[inline(always)]
fn cos_of_double<S: Scalar>([sin, cos]: [S; 2]) -> S {
    cos * cos - sin * sin
}

terms! { v;
    "1" ["1"] = S::ONE;
    "theta" ["rad"] = v.theta;
    "theta^2" ["rad2"] = v.theta * v.theta;
    "theta^3" ["rad3"] = v.theta * v.theta * v.theta;
    "sin(theta)" ["1"] = v.arm[0];
    "cos(theta)" ["1"] = v.arm[1];
    "sin(2*theta)" ["1"] = sin_of_double(v.arm);
    "cos(2*theta)" ["1"] = cos_of_double(v.arm);
    "theta_dot" ["rad/s"] = v.theta_dot;
    "theta_dot^2" ["rad2/s2"] = v.theta_dot * v.theta_dot;
    "theta_dot^3" ["rad3/s3"] = v.theta_dot * v.theta_dot * v.theta_dot;
    "theta_dot*abs(theta_dot)" ["rad2/s2"] = v.theta_dot * v.theta_dot.abs();
    "theta_dot*theta" ["rad2/s"] = v.theta_dot * v.theta;
    "theta_dot*theta^2" ["rad3/s"] = v.theta_dot * v.theta * v.theta;
    "theta_dot*sin(theta)" ["rad/s"] = v.theta_dot * v.arm[0];
    "theta_dot*cos(theta)" ["rad/s"] = v.theta_dot * v.arm[1];
    "theta_dot^2*sin(theta)" ["rad2/s2"] = v.theta_dot * v.theta_dot * v.arm[0];
    "theta_dot^2*cos(theta)" ["rad2/s2"] = v.theta_dot * v.theta_dot * v.arm[1];
    "sin(alpha)" ["1"] = v.pendulum[0];
    "cos(alpha)" ["1"] = v.pendulum[1];
    "sin(2*alpha)" ["1"] = sin_of_double(v.pendulum);
    "cos(2*alpha)" ["1"] = cos_of_double(v.pendulum);
    "alpha_dot" ["rad/s"] = v.alpha_dot;
    "alpha_dot^2" ["rad2/s2"] = v.alpha_dot * v.alpha_dot;
    "alpha_dot^3" ["rad3/s3"] = v.alpha_dot * v.alpha_dot * v.alpha_dot;
    "alpha_dot*abs(alpha_dot)" ["rad2/s2"] = v.alpha_dot * v.alpha_dot.abs();
    "alpha_dot*sin(alpha)" ["rad/s"] = v.alpha_dot * v.pendulum[0];
    "alpha_dot*cos(alpha)" ["rad/s"] = v.alpha_dot * v.pendulum[1];
    "alpha_dot^2*sin(alpha)" ["rad2/s2"] = v.alpha_dot * v.alpha_dot * v.pendulum[0];
    "theta_dot*sin(alpha)" ["rad/s"] = v.theta_dot * v.pendulum[0];
    "theta_dot*cos(alpha)" ["rad/s"] = v.theta_dot * v.pendulum[1];
    "theta_dot*sin(alpha)^2" ["rad/s"] = v.theta_dot * v.pendulum[0] * v.pendulum[0];
    "theta_dot^2*sin(alpha)" ["rad2/s2"] = v.theta_dot * v.theta_dot * v.pendulum[0];
    "theta_dot^2*sin(2*alpha)" ["rad2/s2"] = v.theta_dot * v.theta_dot * sin_of_double(v.pendulum);
    "theta_dot*alpha_dot" ["rad2/s2"] = v.theta_dot * v.alpha_dot;
    "theta_dot*alpha_dot*sin(2*alpha)" ["rad2/s2"] = v.theta_dot * v.alpha_dot * sin_of_double(v.pendulum);
    "theta_dot*abs(alpha_dot)" ["rad2/s2"] = v.theta_dot * v.alpha_dot.abs();
    "alpha_dot*abs(theta_dot)" ["rad2/s2"] = v.alpha_dot * v.theta_dot.abs();
    "u" ["V"] = v.u;
    "u^2" ["V2"] = v.u * v.u;
    "u^3" ["V3"] = v.u * v.u * v.u;
    "u*abs(u)" ["V2"] = v.u * v.u.abs();
    "u*theta" ["V rad"] = v.u * v.theta;
    "u*theta^2" ["V rad2"] = v.u * v.theta * v.theta;
    "u*sin(theta)" ["V"] = v.u * v.arm[0];
    "u*cos(theta)" ["V"] = v.u * v.arm[1];
    "u*theta_dot" ["V rad/s"] = v.u * v.theta_dot;
    "u*abs(theta_dot)" ["V rad/s"] = v.u * v.theta_dot.abs();
    "u*cos(alpha)" ["V"] = v.u * v.pendulum[1];
}

impl Term {
    /// Its value at one moment, in [`Term::unit`].
    ///
    /// ```
    /// use furuta_model::dynamics::Angle;
    /// use furuta_model::effects::{Clock, Instant, TERMS};
    /// use furuta_model::{Rig, State};
    /// let coefficients = Rig::builtin("qube-servo-2").expect("built in").params.coefficients();
    /// let x = State::new(0.5, 3.0, -2.0, 0.0);
    /// let (clock, angle) = (Clock::at(0.0), Angle::of(x.alpha));
    /// let at = Instant { clock, x: &x, angle, coefficients: &coefficients, memory: 0.0, volts: 3.0 };
    /// let value = |word| TERMS.iter().find(|t| t.word == word).map(|t| t.value(&at));
    /// assert_eq!(value("theta_dot*abs(theta_dot)"), Some(-4.0));
    /// assert_eq!(value("u*theta"), Some(1.5));
    /// ```
    #[must_use]
    pub fn value<S: Scalar>(&self, at: &Instant<'_, S>) -> S {
        TERMS
            .iter()
            .position(|t| t == self)
            .map_or(S::ZERO, |place| value(place, &Variables::at(at)))
    }
}

impl<S: Scalar> Variables<S> {
    #[inline(always)]
    fn at(at: &Instant<'_, S>) -> Self {
        let (sin, cos) = at.x.theta.sin_cos();
        Self {
            theta: at.x.theta,
            theta_dot: at.x.theta_dot,
            alpha_dot: at.x.alpha_dot,
            u: at.volts,
            arm: [sin, cos],
            pendulum: [at.angle.sin, at.angle.cos],
        }
    }
}

/// An empirical term: `coefficient term` on one axis.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Custom<S> {
    /// Which of the rig's terms it is, from 0 (`custom.1`).
    place: usize,
    /// Torque per unit of the term, N m over [`Term::unit`].
    pub coefficient: S,
    /// The axis it acts on: 0 arm, 1 pendulum.
    pub on: S,
    /// Which of [`TERMS`] it is.
    pub term: S,
}

macro_rules! specs {
    ($($id:literal: $($others:literal)+;)+) => {
        /// The empirical terms that a rig can have, in the order in which they act.
        pub static EMPIRICAL: &[&Spec] = &[$(&Spec {
            id: $id,
            name: "Empirical term, fitted to recordings: no law of physics",
            law: "coefficient term on one axis, the term an expression in theta, alpha, theta_dot, alpha_dot and u",
            sentence: "Something acts on the rig that no effect of the catalogue explains; this expression \
                imitates it within the motions that were recorded.",
            shows: "What is left of the gap follows the expression; outside the recorded motions it says nothing.",
            experiment: "motions that the fit has not seen: an expression that is no law fails there first",
            look_alikes: &[$($others),+],
            parameters: PARAMETERS,
            strengths: 1,
            footprint: Footprint::Nothing("no law, so none is looked for"),
            acts: Acts::TORQUE.and(Acts::ANGLE),
            at_rest: AtRest::Slope,
            own: None,
            offered: Offered::OnRequest("it is fitted to what remains where no law of physics explains it"),
        }),+];
    };
}

specs! {
    "custom.1": "custom.2" "custom.3" "custom.4";
    "custom.2": "custom.1" "custom.3" "custom.4";
    "custom.3": "custom.1" "custom.2" "custom.4";
    "custom.4": "custom.1" "custom.2" "custom.3";
}

const PARAMETERS: &[ParameterSpec] = &[
    ParameterSpec {
        name: "coefficient",
        unit: "N m/(unit of the term)",
        kind: Kind::Real,
        default: None,
        min: -1e3,
        max: 1e3,
        off: 0.0,
        typical: Typical::Of(|p| 0.1 * super::stall_torque(p)),
        starts: &[0.3],
    },
    ParameterSpec {
        name: "on",
        unit: "-",
        kind: Kind::Choice(&["arm", "pendulum"]),
        default: Some(0.0),
        min: 0.0,
        max: 1.0,
        off: 0.0,
        typical: Typical::Of(|_| 1.0),
        starts: &[0.0, 1.0],
    },
    ParameterSpec {
        name: "term",
        unit: "-",
        kind: Kind::Choice(WORDS),
        default: None,
        min: 0.0,
        #[allow(clippy::cast_precision_loss)]
        max: (WORDS.len() - 1) as f64,
        off: 0.0,
        typical: Typical::Of(|_| 1.0),
        starts: &[0.0],
    },
];

impl<S: Scalar> Custom<S> {
    /// The term `id` with values in the order of its parameters; `None` where that is none of [`EMPIRICAL`].
    pub(super) fn build(id: &str, values: &[S]) -> Option<Self> {
        let mut values = values.iter().copied();
        let mut next = || values.next().unwrap_or(S::ZERO);
        EMPIRICAL.iter().position(|s| s.id == id).map(|place| Self {
            place,
            coefficient: next(),
            on: next(),
            term: next(),
        })
    }

    pub(super) fn spec(&self) -> &'static Spec {
        EMPIRICAL[self.place]
    }

    /// After every effect of the catalogue.
    pub(super) fn rank(&self) -> usize {
        super::NAMED + self.place
    }

    /// The values in the order of the effect's parameter list.
    pub(super) fn values(&self) -> ArrayVec<S, MAX_PARAMETERS> {
        [self.coefficient, self.on, self.term].into_iter().collect()
    }
}

impl<S: Scalar> Law<S> for Custom<S> {
    #[inline(always)]
    fn torque(&self, at: &Instant<'_, S>) -> [S; 2] {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let place = self.term.value() as usize; // saturates; NaN is 0
        let torque = self.coefficient * value(place, &Variables::at(at));
        if self.on.value() > 0.5 {
            [S::ZERO, torque]
        } else {
            [torque, S::ZERO]
        }
    }
}
