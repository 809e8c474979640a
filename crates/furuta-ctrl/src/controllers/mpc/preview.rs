//! What a reference that is known ahead adds to the prediction.
//!
//! With the error `e = x - r` a moving reference is a disturbance that is known: `e[k+1] = A e[k] + B u[k] + d[k]`. Of
//! all commands without limits the cheapest are `u = -K e - f[k]`,
//!
//! ```text
//! f[k] = S B' l[k],    l[k] = P d[k] + (A - BK)' l[k+1],    S = 1/(R + B'PB)
//! ```
//!
//! (M. Tomizuka, *Optimal continuous finite preview problem*, IEEE TAC 20, 1975; in discrete time by completing the
//! square). About them the moves cost `w'w` as before. What they lead to, the errors at the stretches' ends, needs no
//! `f[k]` to be kept: with the solution of `X = (A - BK) X (A - BK)' + B S B'` and `m[k] = (A - BK)' l[k]`,
//!
//! ```text
//! e[k] = z[k] - X m[k],    z[k+1] = (A - BK) z[k] + (I - X P) d[k]
//! ```
//!
//! so one pass back through the horizon gives `f` and `m` where they are needed, one forward pass the errors.

use super::LIMITED;
use super::rows::Rows;
use crate::design::Regulator;
use crate::real::{Real, c, wrap};
use crate::reference::Ahead;
use furuta_model::State;
use nalgebra::{SMatrix, SVector};

/// The numbers of a prediction with a known reference.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Preview<T, const M: usize> {
    /// `A - B K`.
    closed: [[T; 4]; 4],
    /// `P`: from the error `e` on, the regulator's cost is `e'Pe`.
    cost: [[T; 4]; 4],
    /// `X`.
    spread: [[T; 4]; 4],
    /// `S B'`.
    act: [T; 4],
    /// What a reference with a speed needs beyond it: columns of `A - I` of the speeds.
    moving: [[T; 2]; 4],
    /// Samples to each stretch's end.
    ends: [u32; M],
}

/// What the reference's course adds to numbers without moves.
#[derive(Copy, Clone, Debug)]
pub(super) struct Course<T, const M: usize> {
    /// To the command at each stretch's start, V.
    pub(super) command: [T; M],
    /// To the pendulum's angle at each stretch's end, rad.
    pub(super) pendulum: [T; M],
    /// To the arm's, rad.
    pub(super) arm: [T; M],
}

impl<const M: usize> Preview<f64, M> {
    pub(super) fn new(
        a: &SMatrix<f64, 4, 4>,
        b: &SVector<f64, 4>,
        r: f64,
        regulator: &Regulator<f64, 4, 1>,
        ends: &[usize; M],
    ) -> Self {
        let price = 1.0 / (r + (b.transpose() * regulator.cost * b)[0]);
        let closed = regulator.closed_loop;
        // Doubling: the sum of F^k Q F'^k, twice as many terms in each step.
        let (mut spread, mut power) = (b * b.transpose() * price, closed);
        for _ in 0..60 {
            let more = power * spread * power.transpose();
            spread += more;
            let squared = power * power;
            power = squared;
        }
        let rows = |m: &SMatrix<f64, 4, 4>| {
            core::array::from_fn(|i| core::array::from_fn(|j| m[(i, j)]))
        };
        let beyond = a - SMatrix::<f64, 4, 4>::identity();
        Self {
            closed: rows(&closed),
            cost: rows(&regulator.cost),
            spread: rows(&spread),
            act: core::array::from_fn(|i| price * b[i]),
            moving: core::array::from_fn(|i| [beyond[(i, 2)], beyond[(i, 3)]]),
            ends: ends.map(|end| u32::try_from(end).unwrap_or(u32::MAX)),
        }
    }

    pub(super) fn cast<T: Real>(&self) -> Preview<T, M> {
        Preview {
            closed: self.closed.map(|row| row.map(c)),
            cost: self.cost.map(|row| row.map(c)),
            spread: self.spread.map(|row| row.map(c)),
            act: self.act.map(c),
            moving: self.moving.map(|row| row.map(c)),
            ends: self.ends,
        }
    }
}

impl<T: Real, const M: usize> Preview<T, M> {
    /// What the reference's course does from `from` samples ahead on; `None` where it stays as it is.
    pub(super) fn course(
        &self,
        gain: &[T; 4],
        reference: &impl Ahead<T>,
        from: u32,
    ) -> Option<Course<T, M>> {
        let at = |k: u32| reference.at(from.saturating_add(k));
        let start = at(0);
        let mut moves = false;
        let mut course = Course {
            command: [T::ZERO; M],
            pendulum: [T::ZERO; M],
            arm: [T::ZERO; M],
        };
        // Back: `f` at the starts, `X m` at the ends.
        let mut spread = [[T::ZERO; 4]; M];
        let mut m = [T::ZERO; 4];
        let mut begins = self.ends;
        begins.rotate_right(1);
        if let Some(first) = begins.first_mut() {
            *first = 0;
        }
        let stretches = begins.iter().zip(&self.ends);
        let places = course.command.iter_mut().zip(&mut spread);
        for ((begin, end), (command, spread)) in stretches.zip(places).rev() {
            *spread = times(&self.spread, &m);
            let mut next = at(*end);
            let mut l = m;
            for k in (*begin..*end).rev() {
                let now = at(k);
                let d = self.change(&now, &next);
                moves |= d.iter().any(|d| *d != T::ZERO);
                if moves {
                    l = plus(&m, &times(&self.cost, &d));
                    m = transposed(&self.closed, &l);
                }
                next = now;
            }
            *command = -dot(&self.act, &l);
        }
        if !moves {
            return None;
        }
        // Forward: the errors.
        let mut z = times(&self.spread, &m);
        let mut error = [T::ZERO; 4];
        let stretches = begins.iter().zip(&self.ends).zip(&spread);
        let angles = course.pendulum.iter_mut().zip(&mut course.arm);
        for (((begin, end), spread), (command, (pendulum, arm))) in
            stretches.zip(course.command.iter_mut().zip(angles))
        {
            *command -= dot(gain, &error);
            let mut now = at(*begin);
            for k in *begin..*end {
                let next = at(k.saturating_add(1));
                let d = self.change(&now, &next);
                let back = times(&self.spread, &times(&self.cost, &d));
                z = plus(&times(&self.closed, &z), &minus(&d, &back));
                now = next;
            }
            error = minus(&z, spread);
            *pendulum = error[1] + wrap(now.alpha - start.alpha);
            *arm = error[0] + (now.theta - start.theta);
        }
        Some(course)
    }

    /// `d`: by how much the reference `next` lies behind where the reference `now` leads to. Angles are taken to be
    /// kept without a command, as they are where the reference rests.
    fn change(&self, now: &State<T>, next: &State<T>) -> [T; 4] {
        let left = *now - *next;
        let mut d = [left.theta, wrap(left.alpha), left.theta_dot, left.alpha_dot];
        for (d, [arm, pendulum]) in d.iter_mut().zip(&self.moving) {
            *d += *arm * now.theta_dot + *pendulum * now.alpha_dot;
        }
        d
    }
}

impl<T: Real, const M: usize> Course<T, M> {
    /// Adds it to the rows' values without moves.
    pub(super) fn add_to(&self, asked: &mut [[T; M]; LIMITED], rows: &[Rows<T, M>; LIMITED]) {
        let mut rate = self.command;
        for (rate, before) in rate.iter_mut().skip(1).zip(&self.command) {
            *rate -= *before;
        }
        let added = [&self.command, &self.pendulum, &self.arm, &rate];
        for ((asked, rows), added) in asked.iter_mut().zip(rows).zip(added) {
            if rows.is_limited() {
                for ((asked, scale), added) in asked.iter_mut().zip(&rows.scale).zip(added) {
                    *asked += *scale * *added;
                }
            }
        }
    }
}

fn dot<T: Real>(a: &[T; 4], b: &[T; 4]) -> T {
    (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])
}

/// `m x`.
pub(super) fn times<T: Real>(m: &[[T; 4]; 4], x: &[T; 4]) -> [T; 4] {
    core::array::from_fn(|i| dot(&m[i], x))
}

/// `m' x`.
fn transposed<T: Real>(m: &[[T; 4]; 4], x: &[T; 4]) -> [T; 4] {
    core::array::from_fn(|j| dot(&[m[0][j], m[1][j], m[2][j], m[3][j]], x))
}

pub(super) fn plus<T: Real>(a: &[T; 4], b: &[T; 4]) -> [T; 4] {
    core::array::from_fn(|i| a[i] + b[i])
}

fn minus<T: Real>(a: &[T; 4], b: &[T; 4]) -> [T; 4] {
    core::array::from_fn(|i| a[i] - b[i])
}
