//! Rows that join and leave the working set, and what those beyond their limits push.

// Several arrays run side by side, and a range whose end is known has no index that could panic.
#![allow(clippy::needless_range_loop)]

use super::{DEPENDENT, Place, Problem, Standing, WorkingSet, beyond, price, products};
use crate::real::{Real, is_finite};

impl<T: Real, const M: usize> WorkingSet<T, M> {
    fn standing(&self, at: Place) -> Standing {
        let group = self.standing.get(usize::from(at.group));
        let standing = group.and_then(|g| g.get(usize::from(at.row)));
        standing.copied().unwrap_or(Standing::Free)
    }

    pub(super) fn stand(&mut self, at: Place, standing: Standing) {
        let group = self.standing.get_mut(usize::from(at.group));
        if let Some(s) = group.and_then(|g| g.get_mut(usize::from(at.row))) {
            *s = standing;
        }
    }

    /// A row joins the working set, others leaving it if it depends on them; or it ends beyond its limit. `false` where
    /// nothing bounds its multiplier: the limits contradict each other.
    pub(super) fn enter(&mut self, problem: &Problem<'_, T, M>, at: Place, up: bool) -> bool {
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
    pub(super) fn leave(&mut self, problem: &Problem<'_, T, M>, out: usize, standing: Standing) {
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
}
