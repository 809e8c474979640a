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

// Several arrays run side by side, and a range whose end is known has no index that could panic.
#![allow(clippy::needless_range_loop)]

use super::rows::Rows;
use super::{LIMITED, add_rows, dot};
use crate::real::{Real, is_finite};

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

    /// `R'^-1 b` and `R^-1 R'^-1 b`, `b` what the values of the working set's rows exceed their limits by where only
    /// the rows beyond push: the second are the multipliers with which the working set is at its limits.
    fn target(&self, problem: &Problem<'_, T, M>) -> ([T; M], [T; M]) {
        let n = self.count.min(M);
        let mut along = [T::ZERO; M];
        for i in 0..n {
            let mut rest = self.excess(problem, self.members[i], self.signs[i]);
            for j in 0..i {
                rest -= self.triangle[i][j] * along[j];
            }
            along[i] = rest * self.inverse[i];
        }
        (along, self.back(along))
    }

    /// `R^-1 x`.
    fn back(&self, x: [T; M]) -> [T; M] {
        let n = self.count.min(M);
        let mut out = x;
        for i in (0..n).rev() {
            let value = out[i] * self.inverse[i];
            out[i] = value;
            for j in 0..i {
                out[j] -= self.triangle[i][j] * value;
            }
        }
        out
    }

    fn excess(&self, problem: &Problem<'_, T, M>, at: Place, sign: T) -> T {
        let (k, i) = (usize::from(at.group), usize::from(at.row));
        let free = problem.asked.get(k).and_then(|g| g.get(i));
        let reach = problem.rows.get(k).and_then(|g| g.reach.get(i));
        let (Some(free), Some(reach)) = (free, reach) else {
            return T::ZERO;
        };
        let excess = *free - sign * *reach;
        let pushed = self.pushed.get(k).and_then(|g| g.get(i));
        excess + pushed.copied().unwrap_or(T::ZERO)
    }

    fn standing(&self, at: Place) -> Standing {
        let group = self.standing.get(usize::from(at.group));
        let standing = group.and_then(|g| g.get(usize::from(at.row)));
        standing.copied().unwrap_or(Standing::Free)
    }

    fn stand(&mut self, at: Place, standing: Standing) {
        let group = self.standing.get_mut(usize::from(at.group));
        if let Some(s) = group.and_then(|g| g.get_mut(usize::from(at.row))) {
            *s = standing;
        }
    }

    /// The first multiplier that leaves its range on the way to `target`: which, after which share of the way, and
    /// where its row stands then.
    fn blocking(&self, target: &[T; M]) -> Option<(usize, T, Standing)> {
        let n = self.count.min(M);
        let mut inside = true;
        for i in 0..n {
            let target = self.signs[i] * target[i];
            let outside = target < T::ZERO || target > self.prices[i];
            inside &= !outside;
        }
        if inside {
            return None;
        }
        let mut first: Option<(usize, T, Standing)> = None;
        for i in 0..n {
            let (sign, price) = (self.signs[i], self.prices[i]);
            let (now, target) = (sign * self.multipliers[i], sign * target[i]);
            let (end, standing) = if target < T::ZERO {
                (T::ZERO, Standing::Free)
            } else if target > price {
                (price, beyond(sign))
            } else {
                continue;
            };
            let share = ((end - now) / (target - now)).clamp(T::ZERO, T::ONE);
            if first.is_none_or(|(_, before, _)| share < before) {
                first = Some((i, share, standing));
            }
        }
        first
    }

    /// The row that is beyond its limit by most, or no more beyond by most, and whether its multiplier is to rise.
    fn worst(&self, problem: &Problem<'_, T, M>) -> Option<(Place, bool)> {
        let mut all = *problem.asked;
        let mut rooms = [T::ZERO; M];
        let mut size = T::ZERO;
        for (products, along) in self.products.iter().zip(&self.along).take(self.count) {
            size += along.abs();
            for (values, products) in all.iter_mut().zip(products) {
                for i in 0..M {
                    values[i] -= *along * products[i];
                }
            }
        }
        if self.beyond > 0 {
            size += self.push.iter().fold(T::ZERO, |sum, w| sum + w.abs());
            for (values, pushed) in all.iter_mut().zip(&self.pushed) {
                for i in 0..M {
                    values[i] += pushed[i];
                }
            }
        }
        for (rows, values) in problem.rows.iter().zip(&all) {
            for i in 0..M {
                let room = rows.reach[i] - values[i].abs();
                rooms[i] = room.if_less(rooms[i], room, rooms[i]);
            }
            if rows.is_limited() {
                size += rows.reach[0];
            }
        }
        let tolerance = problem.precision * size;
        if self.beyond == 0 && least(&rooms) >= -tolerance {
            return None;
        }
        let mut worst = tolerance;
        let mut found = None;
        let groups = problem.rows.iter().zip(&all).zip(&self.standing);
        for (k, ((rows, values), standing)) in groups.enumerate() {
            if !rows.is_limited() {
                continue;
            }
            for i in 0..M {
                let (over, under) = (values[i] - rows.reach[i], -rows.reach[i] - values[i]);
                let (violation, up) = match standing[i] {
                    Standing::AtUpper | Standing::AtLower => continue,
                    Standing::Free if under > over => (under, false),
                    Standing::Free => (over, true),
                    Standing::AboveUpper => (-over, false),
                    Standing::BelowLower => (-under, true),
                };
                if violation > worst {
                    worst = violation;
                    #[allow(clippy::cast_possible_truncation)] // a few groups, some ten times
                    let at = Place {
                        group: k as u8,
                        row: i as u8,
                    };
                    found = Some((at, up));
                }
            }
        }
        found
    }

    /// A row joins the working set, others leaving it if it depends on them; or it ends beyond its limit. `false` where
    /// nothing bounds its multiplier: the limits contradict each other.
    fn enter(&mut self, problem: &Problem<'_, T, M>, at: Place, up: bool) -> bool {
        let price = price(problem, at);
        let before = self.standing(at);
        let mut multiplier = match before {
            Standing::AboveUpper => price,
            Standing::BelowLower => -price,
            _ => T::ZERO,
        };
        let sign = if up { T::ONE } else { -T::ONE };
        let upper = before == Standing::AboveUpper || (before == Standing::Free && up);
        // What its multiplier may still change by.
        let mut left = price;
        for _ in 0..=M {
            let side = if upper { T::ONE } else { -T::ONE };
            let Some(parts) = self.append(problem, at, side, multiplier) else {
                self.stand(
                    at,
                    if upper {
                        Standing::AtUpper
                    } else {
                        Standing::AtLower
                    },
                );
                if before.is_beyond() {
                    self.count_beyond(problem);
                }
                return true;
            };
            // It depends on the working set: multipliers can be exchanged, the moves staying as they are.
            let exchange = self.back(parts);
            let least = T::from_f64(DEPENDENT) * problem.precision;
            let mut step = left;
            let mut out = None;
            for i in 0..self.count.min(M) {
                let (y, rate) = (
                    self.signs[i] * self.multipliers[i],
                    -self.signs[i] * sign * exchange[i],
                );
                if rate.abs() <= least {
                    continue;
                }
                let (room, standing) = if rate < T::ZERO {
                    (y, Standing::Free)
                } else {
                    (self.prices[i] - y, beyond(self.signs[i]))
                };
                let reach = room / rate.abs();
                if reach < step {
                    step = reach;
                    out = Some((i, standing));
                }
            }
            if !is_finite(step) {
                return false;
            }
            for (y, part) in self.multipliers.iter_mut().zip(&exchange) {
                *y -= sign * step * *part;
            }
            multiplier += sign * step;
            left -= step;
            match out {
                Some((i, standing)) => self.leave(problem, i, standing),
                None => {
                    self.stand(
                        at,
                        match (before, up) {
                            (Standing::Free, true) => Standing::AboveUpper,
                            (Standing::Free, false) => Standing::BelowLower,
                            _ => Standing::Free,
                        },
                    );
                    self.count_beyond(problem);
                    return true;
                }
            }
        }
        false
    }

    /// A member leaves the working set.
    fn leave(&mut self, problem: &Problem<'_, T, M>, out: usize, standing: Standing) {
        if let Some(at) = self.members.get(out) {
            self.stand(*at, standing);
        }
        self.drop_column(out);
        if standing.is_beyond() {
            self.count_beyond(problem);
        }
    }

    /// What the rows beyond their limits push, anew: no rounding of large prices remains.
    fn count_beyond(&mut self, problem: &Problem<'_, T, M>) {
        self.beyond = 0;
        self.push = [T::ZERO; M];
        for (rows, standing) in problem.rows.iter().zip(&self.standing) {
            for ((row, price), standing) in rows.forced.iter().zip(&rows.price).zip(standing) {
                let y = match standing {
                    Standing::AboveUpper => *price,
                    Standing::BelowLower => -*price,
                    _ => continue,
                };
                self.beyond += 1;
                for (push, x) in self.push.iter_mut().zip(row) {
                    *push -= y * *x;
                }
            }
        }
        self.pushed = products(problem, &self.push);
    }

    /// The factors anew.
    fn renew(&mut self, problem: &Problem<'_, T, M>) {
        let (members, signs, multipliers) = (self.members, self.signs, self.multipliers);
        let count = self.count;
        self.count = 0;
        self.age = 0;
        self.multipliers = [T::ZERO; M];
        for ((at, sign), y) in members.iter().zip(signs).zip(multipliers).take(count) {
            if self.append(problem, *at, sign, y).is_some() {
                self.stand(*at, Standing::Free);
            }
        }
    }

    /// A column more of `Q R`; if it depends on the others, none, and its coordinates among the vectors of `Q`.
    fn append(
        &mut self,
        problem: &Problem<'_, T, M>,
        at: Place,
        sign: T,
        multiplier: T,
    ) -> Option<[T; M]> {
        let own = row(problem, at);
        let (mut rest, mut parts) = (*own, [T::ZERO; M]);
        let whole = dot(own, own);
        // Twice is enough, and once where little was taken away (W. Kahan, in B. Parlett, The symmetric eigenvalue
        // problem, 1980, sec. 6.9).
        for _ in 0..2 {
            for (q, part) in self.basis.iter().zip(&mut parts).take(self.count) {
                let share = dot(q, &rest);
                *part += share;
                for (rest, q) in rest.iter_mut().zip(q) {
                    *rest -= share * *q;
                }
            }
            if T::from_f64(2.0) * dot(&rest, &rest) > whole {
                break;
            }
        }
        let length = dot(&rest, &rest).sqrt();
        let least = T::from_f64(DEPENDENT) * problem.precision * whole.sqrt();
        let n = self.count;
        let (Some(q), Some(column)) = (self.basis.get_mut(n), self.triangle.get_mut(n)) else {
            return Some(parts);
        };
        let (Some(diagonal), Some(inverse)) = (parts.get_mut(n), self.inverse.get_mut(n)) else {
            return Some(parts);
        };
        let independent = length > least;
        if !independent {
            return Some(parts);
        }
        *inverse = T::ONE / length;
        *q = rest.map(|x| x * *inverse);
        *diagonal = length;
        *column = parts;
        if let Some(own) = self.products.get_mut(n) {
            *own = products(problem, q);
        }
        if n < M {
            self.members[n] = at;
            self.multipliers[n] = multiplier;
            self.signs[n] = sign;
            self.prices[n] = price(problem, at);
        }
        self.count = n + 1;
        self.age = self.age.saturating_add(1);
        None
    }

    /// `Q R` without column `out`, by rotations.
    fn drop_column(&mut self, out: usize) {
        let n = self.count.min(M);
        if out >= n {
            return;
        }
        for i in out..M.saturating_sub(1) {
            self.members[i] = self.members[i + 1];
            self.multipliers[i] = self.multipliers[i + 1];
            self.signs[i] = self.signs[i + 1];
            self.prices[i] = self.prices[i + 1];
            self.triangle[i] = self.triangle[i + 1];
        }
        if let Some(y) = self.multipliers.get_mut(n - 1) {
            *y = T::ZERO;
        }
        for i in out..M.saturating_sub(1) {
            if i + 1 >= n {
                break;
            }
            let (a, b) = (self.triangle[i][i], self.triangle[i][i + 1]);
            let length = (a * a + b * b).sqrt();
            self.inverse[i] = T::ONE / length;
            let (cos, sin) = (a * self.inverse[i], b * self.inverse[i]);
            let turn = |x: T, y: T| (cos * x + sin * y, cos * y - sin * x);
            for column in self.triangle.iter_mut().take(n - 1).skip(i) {
                (column[i], column[i + 1]) = turn(column[i], column[i + 1]);
            }
            for j in 0..M {
                (self.basis[i][j], self.basis[i + 1][j]) =
                    turn(self.basis[i][j], self.basis[i + 1][j]);
            }
            for k in 0..LIMITED {
                for j in 0..M {
                    (self.products[i][k][j], self.products[i + 1][k][j]) =
                        turn(self.products[i][k][j], self.products[i + 1][k][j]);
                }
            }
        }
        self.count = n - 1;
        self.age = self.age.saturating_add(1);
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

/// The smallest of some numbers, compared four at a time.
fn least<T: Real, const M: usize>(x: &[T; M]) -> T {
    let mut out = [T::from_f64(f64::INFINITY); 4];
    for i in 0..M {
        let before = out[i % 4];
        out[i % 4] = x[i].if_less(before, x[i], before);
    }
    let (a, b) = (out[1].if_less(out[0], out[1], out[0]), out[3].if_less(out[2], out[3], out[2]));
    a.if_less(b, a, b)
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
