//! Model predictive control: the linear-quadratic regulator with limits that it knows of.

mod active_set;
mod design;
mod late;
mod memory;
mod preview;
mod rows;
mod settings;

pub use active_set::Outcome;
pub use design::Bounds;
pub use memory::{MpcState, Report};
pub use rows::Rows;
pub(super) use self::settings::SPEC;
pub(crate) use self::settings::counts_delay_once;

use self::active_set::Problem;
use self::late::Late;
use self::preview::Preview;
use super::{Controller, LinearLaw, StateFeedback};
use crate::real::{Real, command, is_finite, wrap};
use crate::reference::Ahead;
use furuta_model::State;

/// Moves within the horizon.
pub const MOVES: usize = 12;
/// What is limited: the command (at all cost), the pendulum's angle, the arm's angle (at a price), the command's
/// changes (at all cost).
pub const LIMITED: usize = 4;
/// The commands that are remembered: what a delay may span.
pub const PAST: usize = 32;

/// The regulator's command where the prediction keeps all limits, else the first of the commands that cost least among
/// those that do.
///
/// Minimises the cost of the [`dlqr`](crate::design::dlqr) with weights `Q`, `R` over `u = -K e + v`, the moves `v`
/// being constant over [`MOVES`] stretches of the horizon and zero afterwards
/// ([`Prediction`](crate::design::Prediction)), such that at each stretch's start `|u|` is within the command limit and
/// at its end the pendulum and the arm are within theirs. As the moves' cost is `w'w`, this is the point nearest to
/// `w = 0` that keeps the limits. The command's are kept in any case; an angle beyond its limit costs in proportion to
/// how far (an exact penalty: where the limit can be kept, it is).
///
/// Three things can be added, each of which changes nothing where it is left out. Between the stretches' starts, and
/// from the last command to the first, the command changes by at most [`Mpc::step`] a sample, at all cost; with the
/// command's limit that is always possible. A reference that is known ahead ([`Controller::update_ahead`]) is followed
/// by the cheapest commands, about which the moves are counted. And a command may act later than the state is known
/// ([`Mpc::with_delay`]): those under way are states of the controller, [`PAST`] at most.
///
/// Solved to rounding by a dual active-set method that starts from the active limits of the sample before (see
/// [`Outcome`] for how a sample may end, and [`MpcState::report`]). One sample takes some `5 * MOVES²` multiplications
/// where the active limits stay as they were, about as many again for each change of them, at most `iterations`
/// changes, and `16 * MOVES` where the regulator keeps the limits: then the command is the regulator's, to the bit. A
/// reference that moves within the horizon takes 100 multiplications more for each of its samples. Whatever becomes of
/// the problem, the command is within its limit and no farther from the last one than `step`; a state that is not a
/// number gives 0.
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
    /// Rows of command, pendulum, arm and the command's changes, each at `M` times: the scaled value is
    /// `free e + forced w`.
    pub rows: [Rows<T, M>; LIMITED],
    /// Volts of the first command for a unit of the first move.
    pub first: T,
    /// Largest number of changes of the active limits in each sample.
    pub iterations: usize,
    /// Largest command either way, V.
    pub command_limit: T,
    /// Largest change of the command in a sample, V; infinite where any is allowed.
    pub step: T,
    /// Whether [`Controller::update_ahead`] makes use of the reference's course.
    pub looks_ahead: bool,
    preview: Preview<T, M>,
    /// `None`: the command acts at the time of the state.
    late: Option<Late<T>>,
    /// What a limit may be missed by, as a part of the numbers at hand: rounding.
    pub precision: T,
}

/// What is asked of the moves in one sample.
#[derive(Copy, Clone, Debug)]
struct Asked<T, const M: usize> {
    /// Values of the rows without moves.
    rows: [[T; M]; LIMITED],
    /// The command without moves, V.
    command: T,
}

impl<T: Real, const M: usize> Mpc<T, M> {
    /// The error, the pendulum's the short way round.
    fn error(x: &State<T>, reference: &State<T>) -> [T; 4] {
        let e = *x - *reference;
        [e.theta, wrap(e.alpha), e.theta_dot, e.alpha_dot]
    }

    /// What the rows are and must be in this state, after the commands in `memory`: without moves, at least, at most.
    pub fn problem(
        &self,
        memory: &MpcState<T, M>,
        x: &State<T>,
        reference: &impl Ahead<T>,
    ) -> [[[T; M]; 3]; LIMITED] {
        let asked = self.asked(&memory.past, x, reference);
        core::array::from_fn(|k| {
            let reach = self.rows[k].reach;
            [asked.rows[k], reach.map(|x| -x), reach]
        })
    }

    /// The command (V) without moves and without limits: the regulator's, and what the reference's course adds.
    pub fn unlimited(
        &self,
        memory: &MpcState<T, M>,
        x: &State<T>,
        reference: &impl Ahead<T>,
    ) -> T {
        self.asked(&memory.past, x, reference).command
    }

    fn asked(&self, past: &[T; PAST], x: &State<T>, reference: &impl Ahead<T>) -> Asked<T, M> {
        let (ahead, now) = match &self.late {
            None => (0, reference.at(0)),
            Some(late) => (late.acts_in(), reference.at(late.acts_in())),
        };
        let mut e = Self::error(x, &now);
        if let Some(late) = &self.late {
            e = late.carry(e, past);
        }
        // As `StateFeedback::unlimited`, to the bit.
        let [a, b, c, d] = self.gain;
        let mut asked = Asked {
            command: -(a * e[0] + b * e[1] + c * e[2] + d * e[3]),
            rows: {
                let [command, pendulum, arm, changes] = &self.rows;
                [
                    command.asked(&e, T::ZERO),
                    pendulum.asked(&e, now.alpha),
                    arm.asked(&e, now.theta),
                    changes.asked(&e, T::ZERO),
                ]
            },
        };
        if self.looks_ahead
            && let Some(course) = self.preview.course(&self.gain, reference, ahead)
        {
            asked.command += course.command.first().copied().unwrap_or(T::ZERO);
            course.add_to(&mut asked.rows, &self.rows);
        }
        let [.., changes] = &self.rows;
        if changes.is_limited() {
            let scale = changes.scale.first().copied().unwrap_or(T::ZERO);
            if let Some(first) = asked.rows[LIMITED - 1].first_mut() {
                *first -= scale * past[0];
            }
        }
        asked
    }
}

impl<T: Real, const M: usize> Controller<T> for Mpc<T, M> {
    type State = MpcState<T, M>;

    fn start(&self) -> MpcState<T, M> {
        MpcState::after(T::ZERO)
    }

    fn take_over(&self, _: &State<T>, _: &State<T>, u: T) -> MpcState<T, M> {
        MpcState::after(command(u, self.command_limit))
    }

    fn update(&self, state: &mut MpcState<T, M>, x: &State<T>, reference: &State<T>, h: T) -> T {
        self.update_ahead(state, x, reference, h)
    }

    fn update_ahead(
        &self,
        state: &mut MpcState<T, M>,
        x: &State<T>,
        reference: &impl Ahead<T>,
        _: T,
    ) -> T {
        let asked = self.asked(&state.past, x, reference);
        let problem = Problem {
            rows: &self.rows,
            asked: &asked.rows,
            bound: self.iterations,
            precision: self.precision,
        };
        let mut kept = true;
        for (rows, free) in self.rows.iter().zip(&asked.rows) {
            for (free, reach) in free.iter().zip(&rows.reach) {
                kept &= free.abs() <= *reach;
            }
        }
        if kept {
            state.working.clear();
            state.report.ended(Outcome::Regulator, 0, 0);
            return self.limited(state, asked.command);
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
        self.limited(state, asked.command + first)
    }

    /// The regulator, where no limit is near and the command acts at the time of the state.
    fn linear_law(&self) -> Option<LinearLaw<T>> {
        self.late
            .is_none()
            .then_some(LinearLaw::of_states(self.gain))
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
