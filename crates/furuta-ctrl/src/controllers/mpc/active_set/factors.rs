//! The factors `C_W' = Q R` of the working set: a column more, one less, all anew, and the equations solved with them.

// Several arrays run side by side, and a range whose end is known has no index that could panic.
#![allow(clippy::needless_range_loop)]

use super::{DEPENDENT, Place, Problem, Standing, WorkingSet, price, products, row};
use crate::controllers::mpc::{LIMITED, dot};
use crate::real::Real;

impl<T: Real, const M: usize> WorkingSet<T, M> {
    /// `R'^-1 b` and `R^-1 R'^-1 b`, `b` what the values of the working set's rows exceed their limits by where only
    /// the rows beyond push: the second are the multipliers with which the working set is at its limits.
    pub(super) fn target(&self, problem: &Problem<'_, T, M>) -> ([T; M], [T; M]) {
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
    pub(super) fn back(&self, x: [T; M]) -> [T; M] {
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

    /// The factors anew.
    pub(super) fn renew(&mut self, problem: &Problem<'_, T, M>) {
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
    pub(super) fn append(
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
    pub(super) fn drop_column(&mut self, out: usize) {
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
}
