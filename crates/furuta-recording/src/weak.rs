//! The pendulum's equation in its weak form: multiplied by a smooth bump and integrated, so that no angle is
//! differentiated twice.
//!
//! A second difference drowns in counts, and lowers the harmonics of a large swing; both hide what the shape of a large
//! swing says about the angle's
//! scale. Integrated by parts, the derivatives act on the bump, which is known exactly.

use super::Recording;
use super::regression::Regression;

/// Half the width of the bump, s: short against a swing, long against a count.
const HALF: f64 = 0.1;
/// The same in samples at least.
const LEAST_HALF: usize = 6;
/// Speeds are differences over this much either way, s.
const SPEED: f64 = 0.006;
/// Speed below which the direction of dry friction is smooth, rad/s.
const SLOW: f64 = 0.1;
/// Bumps over a recording at most; over a longer one they lie further apart.
const BUMPS: usize = 1000;
/// Bumps overlap: one in this many is independent.
pub(super) const CORRELATED: f64 = 2.0;

/// Regressors: gravity `sin(alpha)`, coupling `cos(alpha) theta''`, centrifugal `sin cos theta'²`, damping, then what
/// an encoder's offset, a constant
/// torque, a spring, dry friction and a tilted base add.
pub(super) const TERMS: usize = 10;
/// Places of those that are looked at.
pub(super) const GRAVITY: usize = 0;
pub(super) const COUPLING: usize = 1;
pub(super) const CENTRIFUGAL: usize = 2;
/// The equation of a level rig with a constant torque.
pub(super) const PLAIN: [usize; 5] = [GRAVITY, COUPLING, CENTRIFUGAL, 3, 5];
/// The same for swings too small, or an arm too slow, to tell more.
pub(super) const SMALL: [usize; 4] = [GRAVITY, COUPLING, 3, 5];

/// What is left of it where the arm stands.
pub(super) const STANDING: [usize; 4] = [GRAVITY, 3, 5, 7];

/// The pendulum's equation over a recording whose alpha is `scale` times the true one, counted from `zero`: terms for
/// the acceleration as recorded.
pub(super) fn regression(recording: &Recording, scale: f64, zero: f64) -> Regression<TERMS> {
    let mut regression = Regression::default();
    let h = recording.sample_period;
    let half = ((HALF / h).round() as usize).max(LEAST_HALF);
    let lag = ((SPEED / h).round() as usize).max(1);
    let bump: Vec<[f64; 3]> = (0..=2 * half)
        .map(|j| bump(j as f64 / half as f64 - 1.0, half as f64 * h))
        .collect();
    let reach = half + lag;
    let stride = half.div_ceil(2).max(recording.len() / BUMPS);
    for segment in &recording.segments {
        let (Some(theta), Some(alpha)) = (
            recording.theta.get(segment.clone()),
            recording.alpha.get(segment.clone()),
        ) else {
            continue;
        };
        let windows = theta
            .windows(2 * reach + 1)
            .zip(alpha.windows(2 * reach + 1));
        for (theta, alpha) in windows.step_by(stride) {
            let (mut x, mut y) = ([0.0; TERMS], 0.0);
            for (j, [phi, slope, curvature]) in bump.iter().enumerate() {
                let speed = |values: &[f64]| {
                    let ends = [values.get(j), values.get(j + 2 * lag)];
                    let [before, after] = ends.map(|v| v.copied().unwrap_or_default());
                    (after - before) / (2.0 * lag as f64 * h)
                };
                let at = alpha.get(j + lag).copied().unwrap_or_default();
                let centre = alpha.get(reach).copied().unwrap_or_default();
                let (sin, cos) = (zero + (at - zero) / scale).sin_cos();
                let (arm, pendulum) = (speed(theta), speed(alpha));
                y += curvature * (at - centre);
                x[GRAVITY] += phi * sin;
                x[COUPLING] += (phi * sin * pendulum / scale - slope * cos) * arm;
                x[CENTRIFUGAL] += phi * sin * cos * arm * arm;
                x[3] -= slope * (at - centre);
                x[4] += phi * cos;
                x[5] += phi;
                x[6] += phi * (at - zero);
                x[7] += phi * (pendulum / SLOW).tanh();
                let (side, front) = theta.get(j + lag).map_or((0.0, 1.0), |t| t.sin_cos());
                x[8] += phi * cos * side;
                x[9] += phi * cos * (1.0 - front);
            }
            regression.add(x, y);
        }
    }
    regression
}

/// `(1 - x²)^4` with its first two derivatives by time, `half` s from centre to end.
fn bump(x: f64, half: f64) -> [f64; 3] {
    let inside = (1.0 - x * x).max(0.0);
    [
        inside.powi(4),
        -8.0 * x * inside.powi(3) / half,
        (48.0 * x * x * inside.powi(2) - 8.0 * inside.powi(3)) / (half * half),
    ]
}
