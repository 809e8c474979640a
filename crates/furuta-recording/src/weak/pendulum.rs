//! The pendulum's equation. What the shape of a large swing says about the angle's scale, no difference hides.

use super::super::Recording;
use super::super::regression::{Estimate, Regression};
use super::{CORRELATED, SLOW, over};

/// Half the width of the bump, s: short against a swing, long against a count.
const HALF: f64 = 0.1;

/// Regressors: gravity `sin(alpha)`, coupling `cos(alpha) theta''`, centrifugal `sin cos theta'²`, damping, then what
/// an encoder's offset, a constant torque, a spring, dry friction and a tilted base add; and the rate of the coupling.
pub(crate) const TERMS: usize = 11;
/// Places of those that are looked at.
pub(crate) const GRAVITY: usize = 0;
pub(crate) const COUPLING: usize = 1;
pub(crate) const CENTRIFUGAL: usize = 2;
/// Over the coupling, by how many seconds theta is late against alpha, negative where alpha is.
pub(crate) const SKEW: usize = 10;
/// All that acts, at one moment.
pub(crate) const TOGETHER: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9];
/// The equation where two moments are looked for.
pub(crate) const APART: [usize; 8] = [GRAVITY, COUPLING, CENTRIFUGAL, 3, 4, 5, 7, SKEW];
/// The equation of a level rig with a constant torque.
pub(crate) const PLAIN: [usize; 5] = [GRAVITY, COUPLING, CENTRIFUGAL, 3, 5];
/// The same for swings too small, or an arm too slow, to tell more.
pub(crate) const SMALL: [usize; 4] = [GRAVITY, COUPLING, 3, 5];
/// What is left of it where the arm stands.
pub(crate) const STANDING: [usize; 4] = [GRAVITY, 3, 5, 7];

/// The pendulum's equation over a recording whose alpha is `scale` times the true one, counted from `zero`: terms for
/// the acceleration as recorded.
pub(crate) fn regression(recording: &Recording, scale: f64, zero: f64) -> Regression<TERMS> {
    let mut regression = Regression::default();
    over(recording, HALF, |window, bump| {
        let (mut x, mut y) = ([0.0; TERMS], 0.0);
        let [_, centre] = window.at(bump.len() / 2);
        for (j, w) in bump.iter().enumerate() {
            let ([side, at], [arm, pendulum]) = (window.at(j), window.speeds(j));
            let (sin, cos) = (zero + (at - zero) / scale).sin_cos();
            y += w.curvature * (at - centre);
            x[GRAVITY] += w.phi * sin;
            x[COUPLING] += (w.phi * sin * pendulum / scale - w.slope * cos) * arm;
            x[CENTRIFUGAL] += w.phi * sin * cos * arm * arm;
            x[3] -= w.slope * (at - centre);
            x[4] += w.phi * cos;
            x[5] += w.phi;
            x[6] += w.phi * (at - zero);
            x[7] += w.phi * (pendulum / SLOW).tanh();
            let (side, front) = side.sin_cos();
            x[8] += w.phi * cos * side;
            x[9] += w.phi * cos * (1.0 - front);
            let bent = w.curvature * cos - 2.0 * w.slope * sin * pendulum;
            x[SKEW] += (bent - w.phi * cos * pendulum * pendulum) * arm;
        }
        regression.add(x, y);
    });
    regression
}

/// What a recording shows of the pendulum's equation.
#[derive(Clone, Copy)]
pub(crate) struct Law {
    /// `m g c / (I + m c²)`, 1/s².
    pub(crate) gravity: Estimate,
    /// `m L c / (I + m c²)`.
    pub(crate) coupling: Estimate,
}

impl Law {
    /// `None` where the motion does not tell one term from the others.
    pub(crate) fn by(recording: &Recording) -> Option<Self> {
        let solution = regression(recording, 1.0, 0.0)
            .only(PLAIN)
            .solve(CORRELATED)?;
        let [gravity, coupling, ..] = solution.coefficients;
        Some(Self { gravity, coupling })
    }
}
