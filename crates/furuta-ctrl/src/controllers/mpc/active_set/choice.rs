//! Which limit is next: a multiplier that would leave its range, or a row that is beyond its limit.

// Several arrays run side by side, and a range whose end is known has no index that could panic.
#![allow(clippy::needless_range_loop)]

use super::{Place, Problem, Standing, WorkingSet, beyond};
use crate::real::Real;

impl<T: Real, const M: usize> WorkingSet<T, M> {
    /// The first multiplier that leaves its range on the way to `target`: which, after which share of the way, and
    /// where its row stands then.
    pub(super) fn blocking(&self, target: &[T; M]) -> Option<(usize, T, Standing)> {
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
    pub(super) fn worst(&self, problem: &Problem<'_, T, M>) -> Option<(Place, bool)> {
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
