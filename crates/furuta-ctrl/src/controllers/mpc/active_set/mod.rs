//! The point nearest to zero within two-sided limits, some of them at a price: a dual active-set method.
//!
//! Minimises `w'w / 2 + sum_i p_i max(0, c_i w + f_i - h_i, l_i - c_i w - f_i)`. With a multiplier `y_i` for each row
//! (above 0 at its upper limit, below 0 at its lower) the solution is `w = -C'y`, and the dual problem is to maximise a
//! concave quadratic function of `y` within `|y_i| <= p_i`. A price is thus a bound of the multiplier, and needs no
//! slack variable. The range of `y` does not depend on the state: the multipliers of the sample before are where the
//! next one starts from (D. Goldfarb, A. Idnani, *A numerically stable dual method for solving strictly convex
//! quadratic programs*, Math. Prog. 27, 1983; D. Arnstroem, A. Bemporad, D. Axehill, *A dual active-set solver for
//! embedded quadratic programming using recursive LDL' updates*, IEEE TAC 67, 2022).
//!
//! Rows are free (`y = 0`), at a limit (the working set), or beyond one (`|y| = p`). Of the working set `C_W' = Q R` is
//! kept, `Q` orthonormal, from sample to sample: a product `C C'`, whose condition is the square, is not formed, and
//! single precision suffices. Each change of the working set raises the dual function or makes the set smaller, so
//! none occurs twice; rounding could spoil that only within `tolerance`, and the number of changes is bounded.

mod choice;
mod exchange;
mod factors;

use super::rows::Rows;
use super::{LIMITED, add_rows};
use crate::real::Real;

/// Where a row stands.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Standing {
    /// Within its limits.
    Free,
    /// At its upper limit.
    AtUpper,
    /// At its lower limit.
    AtLower,
    /// Above its upper limit, at a price.
    AboveUpper,
    /// Below its lower limit, at a price.
    BelowLower,
}

impl Standing {
    fn is_beyond(self) -> bool {
        matches!(self, Self::AboveUpper | Self::BelowLower)
    }
}

/// How the last sample's problem ended.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The regulator keeps all limits: its command is the solution.
    Regulator,
    /// Solved.
    Solved,
    /// The bound of changes was reached: the moves are the solution for the limits considered until then.
    Bound,
    /// Numbers beyond reason, or limits that contradict each other: no moves, the regulator's command, cut off.
    Unsound,
}

/// A row by its group (command, pendulum, arm) and time.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
struct Place {
    group: u8,
    row: u8,
}

/// What is asked of the moves.
pub(super) struct Problem<'a, T, const M: usize> {
    pub(super) rows: &'a [Rows<T, M>; LIMITED],
    /// Of each group: values without moves.
    pub(super) asked: &'a [[T; M]; LIMITED],
    /// Largest change count.
    pub(super) bound: usize,
    /// Rounding of a unit: what is beyond a limit by less is at it.
    pub(super) precision: T,
}

/// The working set and its multipliers, kept from sample to sample.
#[derive(Copy, Clone, Debug)]
pub(super) struct WorkingSet<T, const M: usize> {
    members: [Place; M],
    /// 1 for a member at its upper limit, -1 at its lower.
    signs: [T; M],
    /// Largest multipliers of the members.
    prices: [T; M],
    /// How many of `members` there are.
    pub(super) count: usize,
    multipliers: [T; M],
    /// Orthonormal vectors `Q'`, the first `count`.
    basis: [[T; M]; M],
    /// Columns of `R`.
    triangle: [[T; M]; M],
    /// One over the diagonal of `R`.
    inverse: [T; M],
    standing: [[Standing; M]; LIMITED],
    /// How many rows are beyond their limits.
    beyond: usize,
    /// What these push: `-sum y_i c_i`.
    push: [T; M],
    /// What that adds to each row.
    pushed: [[T; M]; LIMITED],
    /// All rows' products with each vector of `Q`: what the moves do to a row is told from as many of them as there are
    /// members.
    products: [[[T; M]; LIMITED]; M],
    /// Changes since the factors were made anew.
    age: u32,
    /// Coordinates of the last solution's moves along `-Q`.
    along: [T; M],
    /// Whether these are the last sample's solution.
    solved: bool,
    /// Scaled moves of the last complete step of the solver.
    moves: [T; M],
}

/// After this number of changes the factors are made anew: rounding errors of rotations do not add up.
const AGE: u32 = 256;
/// A row whose part outside of the working set's span is shorter, in roundings, depends on it.
const DEPENDENT: f64 = 1e3;

impl<T: Real, const M: usize> WorkingSet<T, M> {
    pub(super) fn new() -> Self {
        Self {
            members: [Place { group: 0, row: 0 }; M],
            signs: [T::ONE; M],
            prices: [T::ZERO; M],
            count: 0,
            multipliers: [T::ZERO; M],
            basis: [[T::ZERO; M]; M],
            triangle: [[T::ZERO; M]; M],
            inverse: [T::ZERO; M],
            standing: [[Standing::Free; M]; LIMITED],
            beyond: 0,
            push: [T::ZERO; M],
            pushed: [[T::ZERO; M]; LIMITED],
            products: [[[T::ZERO; M]; LIMITED]; M],
            age: 0,
            along: [T::ZERO; M],
            solved: false,
            moves: [T::ZERO; M],
        }
    }

    /// Nothing is remembered.
    pub(super) fn clear(&mut self) {
        if self.count > 0 || self.beyond > 0 {
            self.standing = [[Standing::Free; M]; LIMITED];
            self.push = [T::ZERO; M];
            self.pushed = [[T::ZERO; M]; LIMITED];
        }
        self.count = 0;
        self.beyond = 0;
        self.age = 0;
        self.solved = false;
        self.moves = [T::ZERO; M];
    }

    /// `push - Q along`.
    fn along_to_moves(&self) -> [T; M] {
        let mut moves = self.push;
        for (q, along) in self.basis.iter().zip(&self.along).take(self.count) {
            for (w, q) in moves.iter_mut().zip(q) {
                *w -= *along * *q;
            }
        }
        moves
    }

    /// Scaled moves `w = -C'y` of the last sample.
    pub(super) fn moves(&self) -> [T; M] {
        if self.solved {
            self.along_to_moves()
        } else {
            self.moves
        }
    }

    /// The first of them.
    pub(super) fn first_move(&self) -> T {
        if !self.solved {
            return self.moves.first().copied().unwrap_or(T::ZERO);
        }
        let mut first = self.push.first().copied().unwrap_or(T::ZERO);
        for (q, along) in self.basis.iter().zip(&self.along).take(self.count) {
            first -= *along * q.first().copied().unwrap_or(T::ZERO);
        }
        first
    }

    /// From where the working set is to the solution. Returns how it ended and the number of changes.
    pub(super) fn solve(&mut self, problem: &Problem<'_, T, M>) -> (Outcome, usize) {
        self.solved = false;
        self.moves = [T::ZERO; M];
        if self.age > AGE {
            self.renew(problem);
        }
        for changes in 0..problem.bound {
            let (along, target) = self.target(problem);
            if let Some((out, share, standing)) = self.blocking(&target) {
                for (y, target) in self.multipliers.iter_mut().zip(&target) {
                    *y += share * (*target - *y);
                }
                self.leave(problem, out, standing);
                continue;
            }
            self.multipliers = target;
            self.along = along;
            match self.worst(problem) {
                None => {
                    self.solved = true;
                    return (Outcome::Solved, changes);
                }
                Some((place, up)) => {
                    self.moves = self.along_to_moves();
                    if !self.enter(problem, place, up) {
                        return (Outcome::Unsound, changes);
                    }
                }
            }
        }
        (Outcome::Bound, problem.bound)
    }

    /// Multipliers of all rows, of each group in the order of its times.
    pub(super) fn all_multipliers(&self, rows: &[Rows<T, M>; LIMITED]) -> [[T; M]; LIMITED] {
        let mut out = [[T::ZERO; M]; LIMITED];
        for ((out, standing), rows) in out.iter_mut().zip(&self.standing).zip(rows) {
            for ((out, standing), price) in out.iter_mut().zip(standing).zip(&rows.price) {
                *out = match standing {
                    Standing::AboveUpper => *price,
                    Standing::BelowLower => -*price,
                    _ => T::ZERO,
                };
            }
        }
        for (at, y) in self.members.iter().zip(&self.multipliers).take(self.count) {
            let group = out.get_mut(usize::from(at.group));
            if let Some(out) = group.and_then(|g| g.get_mut(usize::from(at.row))) {
                *out = *y;
            }
        }
        out
    }
}

/// Where a row of this sign stands once its multiplier is its price.
fn beyond<T: Real>(sign: T) -> Standing {
    if sign < T::ZERO {
        Standing::BelowLower
    } else {
        Standing::AboveUpper
    }
}

/// `x` times each row.
fn products<T: Real, const M: usize>(
    problem: &Problem<'_, T, M>,
    x: &[T; M],
) -> [[T; M]; LIMITED] {
    let mut out = [[T::ZERO; M]; LIMITED];
    for (out, rows) in out.iter_mut().zip(problem.rows) {
        if rows.is_limited() {
            add_rows(out, &rows.by_move, x);
        }
    }
    out
}

fn row<'a, T: Real, const M: usize>(problem: &Problem<'a, T, M>, at: Place) -> &'a [T; M] {
    let group = problem.rows.get(usize::from(at.group));
    let row = group.and_then(|g| g.forced.get(usize::from(at.row)));
    row.unwrap_or(&problem.rows[0].forced[0])
}

fn price<T: Real, const M: usize>(problem: &Problem<'_, T, M>, at: Place) -> T {
    let group = problem.rows.get(usize::from(at.group));
    let price = group.and_then(|g| g.price.get(usize::from(at.row)));
    price.copied().unwrap_or(T::ZERO)
}
