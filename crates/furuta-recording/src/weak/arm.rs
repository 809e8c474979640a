//! The arm's equation: what moves the arm, as a sum of what it needs. Inertia and the pendulum's pull are the rate of
//! one momentum, `(J + m c² sin²(alpha)) theta' - m L c cos(alpha) alpha'`, so that no acceleration is needed.

use furuta_model::params::Coefficients;

use super::super::Recording;
use super::super::regression::Regression;
use super::{SLOW, over};

/// Half the width of the bump, s: short against what a command makes an arm do, long against a count.
const HALF: f64 = 0.06;

/// Inertia, the pendulum's pull as the sheet has it (N m), damping, dry friction, a spring, each with a coefficient of
/// one sign; a constant, and the command's rate of change.
pub(crate) const TERMS: usize = 7;
pub(crate) const ONE_SIDED: usize = 5;
/// What there is where the command is on time.
pub(crate) const ON_TIME: [usize; 6] = [0, 1, 2, 3, 4, 5];
/// Places of those that are looked at.
pub(crate) const INERTIA: usize = 0;
pub(crate) const PULL: usize = 1;
pub(crate) const DAMPING: usize = 2;
/// By how many seconds the command is written after it acts: `u + late du/dt` is what acts at that moment.
pub(crate) const LATE: usize = 6;

/// The command, which acts `delay` s after it is written, regressed on what the arm needs.
pub(crate) fn regression(
    recording: &Recording,
    c: &Coefficients<f64>,
    delay: f64,
) -> Regression<TERMS> {
    let mut regression = Regression::default();
    let late = (delay / recording.sample_period).round() as usize;
    over(recording, HALF, |window, bump| {
        let (mut x, mut y) = ([0.0; TERMS], 0.0);
        let [middle, centre] = window.at(bump.len() / 2);
        for (j, w) in bump.iter().enumerate() {
            let ([theta, alpha], [arm, _]) = (window.at(j), window.speeds(j));
            let sin = alpha.sin();
            x[INERTIA] += w.curvature * (theta - middle);
            x[PULL] -= w.curvature * c.coupling * (sin - centre.sin())
                + w.slope * c.swing * sin * sin * arm;
            x[DAMPING] -= w.slope * (theta - middle);
            x[3] += w.phi * (arm / SLOW).tanh();
            x[4] += w.phi * theta;
            x[5] += w.phi;
            // Held from one sample to the next.
            let acts = (window.first + j).saturating_sub(late);
            let held = [acts.saturating_sub(1), acts]
                .map(|k| recording.u.get(k).copied().unwrap_or_default());
            let mean = 0.5 * (held[0] + held[1]);
            y += w.phi * mean;
            x[LATE] += w.slope * mean;
        }
        regression.add(x, y);
    });
    regression
}

/// A command whose second derivative is in proportion to it, but for this share of its squares, is one sine.
const ONE_SINE: f64 = 0.05;

/// Whether the command is a single sine about a constant.
pub(crate) fn is_one_sine(recording: &Recording) -> bool {
    let mut regression = Regression::<2>::default();
    over(recording, HALF, |window, bump| {
        let (mut x, mut y) = ([0.0; 2], 0.0);
        for (j, w) in bump.iter().enumerate() {
            let u = recording.u.get(window.first + j).copied();
            let u = u.unwrap_or_default();
            x[0] += w.phi * u;
            x[1] += w.phi;
            y += w.curvature * u;
        }
        regression.add(x, y);
    });
    let law = regression.solve(super::CORRELATED);
    law.is_some_and(|law| law.left < ONE_SINE && law.coefficients[0].value < 0.0)
}
