//! Model predictive control: the linear-quadratic regulator with limits that it knows of.

use super::{Controller, Design, StateFeedback, weights};
use crate::design::{DesignError, Predicted, Prediction, Weights, balance_weights, dlqr, solve};
use crate::error::ConfigError;
use crate::real::{Real, c, command, is_finite, wrap};
use crate::section::{ParameterSpec, Settings, Spec};
use crate::site::Site;
use furuta_model::discretize::zero_order_hold;
use furuta_model::{Linear, State};
use nalgebra::{RowSVector, SMatrix};

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
            30.0,
            "of the solver in each sample; the next sample goes on from there",
        ),
    ],
};

/// Moves within the horizon.
pub const MOVES: usize = 12;
/// What is limited: the command (at all cost), the pendulum's angle, the arm's angle (at a price).
pub const LIMITED: usize = 3;

/// `rho`, once rows have about unit length.
const PENALTY: f64 = 1.0;
/// Over-relaxation: 1 is none, 2 diverges; 1.5 to 1.8 is the rule (Boyd et al. 2011, sec. 3.4.3).
const RELAXATION: f64 = 1.6;
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
/// Solved by a fixed number of steps of ADMM (B. Stellato et al., *OSQP: an operator splitting solver for quadratic
/// programs*, Math. Prog. Comp. 12, 2020; on microcontrollers: K. Nguyen et al., *TinyMPC*, ICRA 2024), its one matrix
/// inverted beforehand; moves and multipliers of the sample before are where the next one starts. One sample takes
/// about `iterations * 7 * MOVES²` multiplications, and none of that where the regulator keeps the limits: then the
/// command is the regulator's, to the bit.
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
    /// `rho`: weight of a step of the multipliers against the moves' cost `w'w / 2`.
    pub penalty: T,
    /// `(I/rho + C'C)^-1`, `C` all rows' `forced`.
    pub inverse: [[T; M]; M],
    /// Volts of the first command for a unit of the first move.
    pub first: T,
    /// Steps in each sample.
    pub iterations: usize,
    /// Largest command either way, V.
    pub command_limit: T,
}

/// One limited number at `M` times, each scaled to a row of about unit length.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Rows<T, const M: usize> {
    /// From the error now.
    pub free: [[T; 4]; M],
    /// From the moves, a row for each time.
    pub forced: [[T; M]; M],
    /// The same, a row for each move: read both ways in every step.
    pub by_move: [[T; M]; M],
    /// What the number itself is multiplied by in each row.
    pub scale: [T; M],
    /// Largest value either way, V or rad; infinite where there is no limit.
    pub limit: T,
    /// Largest multiplier: the price in the rows' units over `rho`; infinite for a limit that is kept at all cost.
    pub price: [T; M],
}

/// Memory of an [`Mpc`].
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct MpcState<T, const M: usize = MOVES> {
    /// Scaled moves.
    pub moves: [T; M],
    /// Scaled multipliers.
    pub multipliers: [[T; M]; LIMITED],
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
        let mut normal = SMatrix::<f64, M, M>::identity() / PENALTY;
        for row in rows.iter().flat_map(|r| r.forced) {
            normal += SMatrix::from_fn(|i, j| row[i] * row[j]);
        }
        let inverse = solve::<f64, M, M>(normal, SMatrix::identity())
            .ok_or(DesignError::NoStabilisingSolution { measure: f64::NAN })?;
        Ok(Self {
            gain: regulator.gain.into(),
            rows,
            penalty: PENALTY,
            inverse: core::array::from_fn(|i| core::array::from_fn(|j| inverse[(i, j)])),
            #[allow(clippy::cast_precision_loss)]
            first: 1.0 / libm::sqrt(prediction.length(0) as f64),
            iterations,
            command_limit: bounds.command,
        })
    }

    /// The same in the target's own precision.
    pub fn cast<T: Real>(&self) -> Mpc<T, M> {
        Mpc {
            gain: self.gain.map(c),
            rows: self.rows.map(|r| r.cast()),
            penalty: c(self.penalty),
            inverse: self.inverse.map(|row| row.map(c)),
            first: c(self.first),
            iterations: self.iterations,
            command_limit: c(self.command_limit),
        }
    }
}

impl<const M: usize> Rows<f64, M> {
    fn new(predicted: &Predicted<4, M>, limit: f64, price: f64) -> Self {
        if !limit.is_finite() {
            return Self {
                free: [[0.0; 4]; M],
                forced: [[0.0; M]; M],
                by_move: [[0.0; M]; M],
                scale: [1.0; M],
                limit,
                price: [0.0; M],
            };
        }
        let lengths = predicted
            .forced
            .map(|row| libm::sqrt(row.iter().map(|x| x * x).sum()));
        let longest = lengths.iter().fold(0.0, |a: f64, b| a.max(*b));
        // What the moves hardly reach, an angle a few samples from now, stays a short row: nothing is gained by
        // insisting.
        let scale = lengths.map(|length| 1.0 / length.max(0.1 * longest));
        let forced: [[f64; M]; M] =
            core::array::from_fn(|i| predicted.forced[i].map(|x| x * scale[i]));
        Self {
            free: core::array::from_fn(|i| predicted.free[i].map(|x| x * scale[i])),
            by_move: core::array::from_fn(|j| forced.map(|row| row[j])),
            forced,
            scale,
            limit,
            price: scale.map(|s| price / (s * PENALTY)),
        }
    }

    fn cast<T: Real>(&self) -> Rows<T, M> {
        Rows {
            free: self.free.map(|row| row.map(c)),
            forced: self.forced.map(|row| row.map(c)),
            by_move: self.by_move.map(|row| row.map(c)),
            scale: self.scale.map(c),
            limit: c(self.limit),
            price: self.price.map(c),
        }
    }
}

impl<T: Real, const M: usize> Rows<T, M> {
    /// The values without moves, and the lowest and the highest that they may have, where zero of the number itself is
    /// at `zero`.
    pub fn asked(&self, e: &[T; 4], zero: T) -> [[T; M]; 3] {
        [
            self.free.map(|row| dot(&row, e)),
            self.scale.map(|s| (-self.limit - zero) * s),
            self.scale.map(|s| (self.limit - zero) * s),
        ]
    }
}

impl<T: Real, const M: usize> Mpc<T, M> {
    /// The error, the pendulum's the short way round.
    fn error(x: &State<T>, reference: &State<T>) -> [T; 4] {
        let e = *x - *reference;
        [e.theta, wrap(e.alpha), e.theta_dot, e.alpha_dot]
    }

    /// What the rows are and must be in this state: without moves, at least, at most.
    pub fn problem(&self, x: &State<T>, reference: &State<T>) -> [[[T; M]; 3]; LIMITED] {
        let e = Self::error(x, reference);
        let zeros = [T::ZERO, reference.alpha, reference.theta];
        core::array::from_fn(|k| self.rows[k].asked(&e, zeros[k]))
    }

    /// The solver's steps: moves and multipliers go from where they are towards the solution.
    fn solve(&self, state: &mut MpcState<T, M>, problem: &[[[T; M]; 3]; LIMITED]) {
        let (relaxation, rest) = (c::<T>(RELAXATION), c::<T>(1.0 - RELAXATION));
        let mut before: Option<[[T; M]; LIMITED]> = None;
        for _ in 0..self.iterations {
            let mut inside = [[T::ZERO; M]; LIMITED];
            let mut pull = [T::ZERO; M];
            for (k, rows) in self.rows.iter().enumerate() {
                let [free, lowest, highest] = &problem[k];
                let mut values = *free;
                add_rows(&mut values, &rows.by_move, &state.moves);
                let mut targets = [T::ZERO; M];
                for i in 0..M {
                    let value = match &before {
                        Some(before) => relaxation * values[i] + rest * before[k][i],
                        None => values[i],
                    };
                    let wanted = value + state.multipliers[k][i];
                    let excess = wanted - wanted.clamp(lowest[i], highest[i]);
                    let multiplier = excess.clamp(-rows.price[i], rows.price[i]);
                    state.multipliers[k][i] = multiplier;
                    inside[k][i] = wanted - multiplier;
                    targets[i] = inside[k][i] - free[i] - multiplier;
                }
                add_rows(&mut pull, &rows.forced, &targets);
            }
            // The inverse is symmetric.
            let mut moves = [T::ZERO; M];
            add_rows(&mut moves, &self.inverse, &pull);
            state.moves = moves;
            before = Some(inside);
        }
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
            moves: [T::ZERO; M],
            multipliers: [[T::ZERO; M]; LIMITED],
        }
    }

    fn update(&self, state: &mut MpcState<T, M>, x: &State<T>, reference: &State<T>, _: T) -> T {
        let feedback = self.feedback().unlimited(x, reference);
        let problem = self.problem(x, reference);
        let kept = |[free, lowest, highest]: &[[T; M]; 3]| {
            (0..M).all(|i| free[i] >= lowest[i] && free[i] <= highest[i])
        };
        if problem.iter().all(kept) {
            *state = self.start();
            return command(feedback, self.command_limit);
        }
        self.solve(state, &problem);
        let mut all = state.multipliers.iter().flatten().chain(&state.moves);
        let sound = all.all(|x| is_finite(*x));
        if !sound {
            // A state that is no number, or so far away that numbers do not reach: nothing of it is remembered.
            *state = self.start();
        }
        command(feedback + self.first * state.moves[0], self.command_limit)
    }

    fn surrogate(&self) -> Option<StateFeedback<T>> {
        Some(self.feedback())
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

fn dot<T: Real, const M: usize>(a: &[T; M], b: &[T; M]) -> T {
    a.iter().zip(b).fold(T::ZERO, |sum, (a, b)| sum + *a * *b)
}

/// `out += rows' x`: whole rows at once, where a sum over one row would wait for each addition.
fn add_rows<T: Real, const M: usize>(out: &mut [T; M], rows: &[[T; M]; M], x: &[T; M]) {
    for (row, x) in rows.iter().zip(x) {
        for (out, a) in out.iter_mut().zip(row) {
            *out += *a * *x;
        }
    }
}
