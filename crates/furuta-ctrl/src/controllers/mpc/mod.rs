//! Model predictive control: the linear-quadratic regulator with limits that it knows of.

mod active_set;
mod rows;

pub use active_set::Outcome;
pub use rows::Rows;

use self::active_set::{Problem, WorkingSet};
use super::{Controller, Design, StateFeedback, weights};
use crate::design::{DesignError, Prediction, Weights, balance_weights, dlqr};
use crate::error::ConfigError;
use crate::real::{Real, c, command, is_finite, wrap};
use crate::section::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use furuta_model::discretize::zero_order_hold;
use furuta_model::{Linear, State};
use nalgebra::RowSVector;

/// What a controller file may say of it.
pub(super) static SPEC: Spec = Spec {
    id: "mpc",
    sentence: "Model predictive control: that of `lqr` where no limit is near, else the cheapest commands \
        that keep command, pendulum and arm within theirs",
    parameters: &[
        weights::q(
            4,
            "diagonal of the state's weight Q; that of `lqr` if left out",
        ),
        weights::r("weight R of the command; that of `lqr` if left out"),
        ParameterSpec::number(
            "horizon",
            "s",
            0.01,
            20.0,
            "how far it looks ahead; ten times the pendulum's time constant if left out",
        ),
        ParameterSpec::number(
            "pendulum_angle",
            "rad",
            1e-3,
            1.5,
            "how far the pendulum may lean, if that is possible; as it likes if left out",
        ),
        ParameterSpec::number(
            "arm_angle",
            "rad",
            1e-2,
            1e3,
            "how far the arm may be from zero, if that is possible; nine tenths of where the rig file \
             stops a run if left out",
        ),
        ParameterSpec::whole(
            "iterations",
            1.0,
            1000.0,
            100.0,
            "bound of the solver's changes of active limits in each sample, beyond which the command is the \
             solution for the limits considered until then, cut off",
        ),
    ],
};

/// Moves within the horizon.
pub const MOVES: usize = 12;
/// What is limited: the command (at all cost), the pendulum's angle, the arm's angle (at a price).
pub const LIMITED: usize = 3;

/// What a limit may be missed by, in roundings of the numbers at hand.
const ROUNDINGS: f64 = 64.0;
/// Price of an angle beyond its limit by as much again, at each time looked at, in units of the cost of the full
/// command.
const PRICE: f64 = 30.0;
/// The horizon in units of the pendulum's time constant.
const HORIZON: f64 = 10.0;

/// The regulator's command where the prediction keeps all limits, else the first of the commands that cost least among
/// those that do.
///
/// Minimises the cost of the [`dlqr`] with weights `Q`, `R` over `u = -K e + v`, the moves `v` being constant over
/// [`MOVES`] stretches of the horizon and zero afterwards ([`Prediction`]), such that at each stretch's start `|u|` is
/// within the command limit and at its end the pendulum and the arm are within theirs. As the moves' cost is `w'w`,
/// this is the point nearest to `w = 0` that keeps the limits. The command's are kept in any case; an angle beyond its
/// limit costs in proportion to how far (an exact penalty: where the limit can be kept, it is).
///
/// Solved to rounding by a dual active-set method that starts from the active limits of the sample before (see
/// [`Outcome`] for how a sample may end, and [`MpcState::report`]). One sample takes some `5 * MOVES²` multiplications
/// where the active limits stay as they were, about as many again for each change of them, at most `iterations`
/// changes, and `12 * MOVES` where the regulator keeps the limits: then the command is the regulator's, to the bit.
///
/// ```
/// use furuta_ctrl::controllers::{self, Controller, Design, Mpc, StateFeedback};
/// use furuta_ctrl::Site;
/// use furuta_model::{Rig, State};
/// let rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let settings = controllers::settings("mpc").ok_or("no such controller")?.with("pendulum_angle", &[0.05])?;
/// let mpc = Mpc::<f64>::design(&settings, &Site::of(&rig, 0.002))?;
/// let lqr = mpc.surrogate().ok_or("has one")?;
/// let near = State::new(0.01, 0.01, 0.0, 0.0);
/// let upright = State::upright();
/// assert_eq!(mpc.update(&mut mpc.start(), &near, &upright, 0.002), lqr.update(&mut (), &near, &upright, 0.002));
/// // To carry the arm far, the regulator would let the pendulum lean by more than the limit: it is asked for less.
/// let far = State::new(1.5, 0.0, 0.0, 0.0);
/// let u = mpc.update(&mut mpc.start(), &far, &upright, 0.002);
/// let unlimited = lqr.update(&mut (), &far, &upright, 0.002);
/// assert!(u.abs() < 0.9 * unlimited.abs());
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Mpc<T, const M: usize = MOVES> {
    /// The regulator's row `K` in the order of [`State`]: V/rad, V/rad, V s/rad, V s/rad.
    pub gain: [T; 4],
    /// Rows of command, pendulum and arm, each at `M` times: the scaled value is `free e + forced w`.
    pub rows: [Rows<T, M>; LIMITED],
    /// Volts of the first command for a unit of the first move.
    pub first: T,
    /// Largest number of changes of the active limits in each sample.
    pub iterations: usize,
    /// Largest command either way, V.
    pub command_limit: T,
    /// What a limit may be missed by, as a part of the numbers at hand: rounding.
    pub precision: T,
}

/// Memory of an [`Mpc`].
#[derive(Copy, Clone, Debug)]
pub struct MpcState<T, const M: usize = MOVES> {
    working: WorkingSet<T, M>,
    report: Report,
}

/// How the solver did.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// How the last sample's problem ended.
    pub outcome: Outcome,
    /// Changes of the active limits in the last sample.
    pub changes: usize,
    /// Active limits in the last sample.
    pub active: usize,
    /// Samples so far in which the bound of changes was reached.
    pub bounds: u32,
    /// Samples so far in which there was no solution: a state that is not finite, or numbers beyond reason.
    pub unsound: u32,
}

/// What angles may be, and how the solver works.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Bounds {
    /// Largest command either way, V.
    pub command: f64,
    /// Largest angle of the pendulum from upright, rad; `None`: any.
    pub pendulum: Option<f64>,
    /// Largest angle of the arm from zero, rad; `None`: any.
    pub arm: Option<f64>,
}

impl<const M: usize> Mpc<f64, M> {
    /// For the upright linearisation sampled at `h` (s), looking `horizon` (s) ahead.
    ///
    /// # Errors
    /// Those of [`crate::design::riccati::discrete`].
    pub fn new(
        upright: &Linear,
        h: f64,
        weights: &Weights<f64, 4, 1>,
        horizon: f64,
        bounds: &Bounds,
        iterations: usize,
    ) -> Result<Self, DesignError> {
        let (a, b) = zero_order_hold(&upright.a, &upright.b, h);
        let regulator = dlqr(&a, &b, weights)?;
        // At most a minute's samples: the range of `horizon` over the shortest period of a loop.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let samples = libm::round(horizon / h).clamp(0.0, 1e6) as usize;
        let prediction = Prediction::<4, M>::new(&b, &regulator, samples);
        let any = f64::INFINITY;
        let (pendulum, arm) = (bounds.pendulum.unwrap_or(any), bounds.arm.unwrap_or(any));
        let price = |limit: f64| PRICE * bounds.command * bounds.command / limit;
        let rows = [
            Rows::new(&prediction.command(), bounds.command, any),
            Rows::new(
                &prediction.output(&RowSVector::<f64, 4>::new(0.0, 1.0, 0.0, 0.0)),
                pendulum,
                price(pendulum),
            ),
            Rows::new(
                &prediction.output(&RowSVector::<f64, 4>::new(1.0, 0.0, 0.0, 0.0)),
                arm,
                price(arm),
            ),
        ];
        Ok(Self {
            gain: regulator.gain.into(),
            rows,
            #[allow(clippy::cast_precision_loss)]
            first: 1.0 / libm::sqrt(prediction.length(0) as f64),
            iterations,
            command_limit: bounds.command,
            precision: ROUNDINGS * rounding::<f64>(),
        })
    }

    /// The same in the target's own precision.
    pub fn cast<T: Real>(&self) -> Mpc<T, M> {
        Mpc {
            gain: self.gain.map(c),
            rows: self.rows.map(|r| r.cast()),
            first: c(self.first),
            iterations: self.iterations,
            command_limit: c(self.command_limit),
            precision: c(ROUNDINGS * rounding::<T>()),
        }
    }
}

/// The distance from 1 to the next number.
fn rounding<T: Real>() -> f64 {
    let mut last = 1.0;
    while (T::ONE + c::<T>(0.5 * last)).value() > 1.0 {
        last *= 0.5;
    }
    last
}

impl<T: Real, const M: usize> Mpc<T, M> {
    /// The error, the pendulum's the short way round.
    fn error(x: &State<T>, reference: &State<T>) -> [T; 4] {
        let e = *x - *reference;
        [e.theta, wrap(e.alpha), e.theta_dot, e.alpha_dot]
    }

    /// What the rows are and must be in this state: without moves, at least, at most.
    pub fn problem(&self, x: &State<T>, reference: &State<T>) -> [[[T; M]; 3]; LIMITED] {
        let asked = self.asked(&Self::error(x, reference), reference);
        core::array::from_fn(|k| {
            let reach = self.rows[k].reach;
            [asked[k], reach.map(|x| -x), reach]
        })
    }

    /// The rows' values without moves.
    fn asked(&self, e: &[T; 4], reference: &State<T>) -> [[T; M]; LIMITED] {
        let [command, pendulum, arm] = &self.rows;
        [
            command.asked(e, T::ZERO),
            pendulum.asked(e, reference.alpha),
            arm.asked(e, reference.theta),
        ]
    }
}

impl<T: Real> Design for Mpc<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let weights = weights::given(settings, || balance_weights(site.params))?;
        let horizon = settings
            .number(const { SPEC.parameter("horizon").optional() })
            .unwrap_or(HORIZON / site.frequency());
        let bounds = Bounds {
            command: site.command_limit,
            pendulum: settings.number(const { SPEC.parameter("pendulum_angle").optional() }),
            arm: settings
                .number(const { SPEC.parameter("arm_angle").optional() })
                .or(site.limits.arm_angle.map(|limit| 0.9 * limit)),
        };
        let upright = site.linear()?;
        let designed = Mpc::<f64>::new(
            &upright,
            site.period,
            &weights,
            horizon,
            &bounds,
            settings.whole(const { SPEC.parameter("iterations").settled() }),
        )?;
        Ok(designed.cast())
    }
}

impl<T: Real, const M: usize> Controller<T> for Mpc<T, M> {
    type State = MpcState<T, M>;

    fn start(&self) -> MpcState<T, M> {
        MpcState {
            working: WorkingSet::new(),
            report: Report {
                outcome: Outcome::Regulator,
                changes: 0,
                active: 0,
                bounds: 0,
                unsound: 0,
            },
        }
    }

    fn update(&self, state: &mut MpcState<T, M>, x: &State<T>, reference: &State<T>, _: T) -> T {
        let e = Self::error(x, reference);
        // As `StateFeedback::unlimited`, to the bit.
        let [a, b, c, d] = self.gain;
        let feedback = -(a * e[0] + b * e[1] + c * e[2] + d * e[3]);
        let asked = self.asked(&e, reference);
        let problem = Problem {
            rows: &self.rows,
            asked: &asked,
            bound: self.iterations,
            precision: self.precision,
        };
        let mut kept = true;
        for (rows, free) in self.rows.iter().zip(&asked) {
            for (free, reach) in free.iter().zip(&rows.reach) {
                kept &= free.abs() <= *reach;
            }
        }
        if kept {
            state.working.clear();
            state.report.ended(Outcome::Regulator, 0, 0);
            return command(feedback, self.command_limit);
        }
        let (mut outcome, changes) = state.working.solve(&problem);
        if !state.working.moves().iter().all(|w| is_finite(*w)) {
            outcome = Outcome::Unsound;
        }
        if outcome == Outcome::Unsound {
            // A state that is no number, or so far away that numbers do not reach: nothing of it is remembered.
            state.working.clear();
        }
        state.report.ended(outcome, changes, state.working.count);
        let first = self.first * state.working.first_move();
        command(feedback + first, self.command_limit)
    }

    fn surrogate(&self) -> Option<StateFeedback<T>> {
        Some(self.feedback())
    }
}

impl<T: Real, const M: usize> MpcState<T, M> {
    /// How the solver did in the last sample, and how often it had to give up until now.
    pub fn report(&self) -> Report {
        self.report
    }

    /// Scaled moves `w` of the last sample, in V.
    pub fn moves(&self) -> [T; M] {
        self.working.moves()
    }

    /// Multipliers of the last sample's limits, of command, pendulum and arm at each time: above 0 at an upper limit,
    /// below 0 at a lower one.
    pub fn multipliers(&self, mpc: &Mpc<T, M>) -> [[T; M]; LIMITED] {
        self.working.all_multipliers(&mpc.rows)
    }
}

impl Report {
    fn ended(&mut self, outcome: Outcome, changes: usize, active: usize) {
        self.outcome = outcome;
        self.changes = changes;
        self.active = active;
        let count = match outcome {
            Outcome::Bound => &mut self.bounds,
            Outcome::Unsound => &mut self.unsound,
            Outcome::Regulator | Outcome::Solved => return,
        };
        *count = count.saturating_add(1);
    }
}

impl<T: Real, const M: usize> Mpc<T, M> {
    /// The regulator, as it acts where no limit is near.
    pub fn feedback(&self) -> StateFeedback<T> {
        StateFeedback {
            gain: self.gain,
            command_limit: self.command_limit,
        }
    }
}

/// Four sums side by side: one would wait for each addition.
fn dot<T: Real, const M: usize>(a: &[T; M], b: &[T; M]) -> T {
    let mut sums = [T::ZERO; 4];
    for i in 0..M {
        sums[i % 4] += a[i] * b[i];
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// `out += rows' x`.
fn add_rows<T: Real, const M: usize>(out: &mut [T; M], rows: &[[T; M]; M], x: &[T; M]) {
    for (row, x) in rows.iter().zip(x) {
        for (out, a) in out.iter_mut().zip(row) {
            *out += *a * *x;
        }
    }
}
