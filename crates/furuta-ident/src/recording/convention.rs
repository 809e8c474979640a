//! Whether a recording keeps to the conventions: seconds, radians, alpha from upright, both angles counted the same way.
//!
//! These are suspicions, never corrections: a wrong guess would turn good data into nonsense.

use super::{NoticeKind, Recording};

/// No encoder of the bench has fewer counts a turn: a resolution coarser than `2 pi` over this is not in radians.
const COUNTS_AT_LEAST: f64 = 150.0;
/// An angle beyond this, rad, would be more than six turns of the cable.
const ANGLE_AT_MOST: f64 = 40.0;

/// Suspects milliseconds or microseconds behind a sample period of half a second and more.
pub(super) fn time_unit(period: f64) -> Option<NoticeKind> {
    let unit = match period {
        p if p >= 200.0 => "microseconds",
        p if p >= 0.5 => "milliseconds",
        _ => return None,
    };
    Some(NoticeKind::TimeUnitSuspected { period, unit })
}

/// Suspects degrees: steps far coarser than any encoder's in radians, or angles of many turns.
pub(super) fn degrees(column: &'static str, values: &[f64]) -> Option<NoticeKind> {
    let largest = values
        .iter()
        .fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let changes = values
        .iter()
        .zip(values.iter().skip(1))
        .map(|(a, b)| (b - a).abs());
    let resolution = changes
        .filter(|&change| change > 0.0)
        .fold(f64::INFINITY, f64::min);
    let coarse = resolution.is_finite()
        && resolution > core::f64::consts::TAU / COUNTS_AT_LEAST
        && largest > core::f64::consts::PI;
    let resolution = if resolution.is_finite() {
        resolution
    } else {
        0.0
    };
    (coarse || largest > ANGLE_AT_MOST).then_some(NoticeKind::DegreesSuspected {
        column,
        resolution,
        largest,
    })
}

/// Time over which the second difference is taken, s: long enough that a count of the encoder does not drown the acceleration, short
/// against a swing.
const DIFFERENCE: f64 = 0.02;
/// Standard deviations that a coefficient must be away from zero to be spoken of; the noise of neighbouring samples is correlated and the
/// friction left out of the regression, so this is far above the usual three.
const SIGNIFICANT: f64 = 12.0;
/// Slowest pendulum of a bench, squared angular frequency in rad^2/s^2 (1.6 m long).
const FREQUENCY_SQUARED_AT_LEAST: f64 = 8.0;
/// Least coupling `m L c / (I + m c^2)` of a rig worth the name.
const COUPLING_AT_LEAST: f64 = 0.1;

/// Suspects alpha counted from hanging, or one angle counted the other way.
///
/// The pendulum obeys `alpha_ddot = a*sin(alpha) + b*cos(alpha)*theta_ddot - c*alpha_dot`, whatever the motor does, with
/// `a = m g c / (I + m c^2) > 0` and `b = m L c / (I + m c^2) > 0`. Counted from hanging, both signs turn; with one angle mirrored, `b` turns.
pub(super) fn signs(recording: &Recording) -> Option<NoticeKind> {
    let lag = (DIFFERENCE / recording.sample_period).round().max(1.0);
    if lag >= recording.len() as f64 {
        return None;
    }
    let (span, lag) = (lag * recording.sample_period, lag as usize);
    let mut regression = Regression::default();
    for segment in &recording.segments {
        let (Some(theta), Some(alpha)) = (
            recording.theta.get(segment.clone()),
            recording.alpha.get(segment.clone()),
        ) else {
            continue;
        };
        for (theta, alpha) in theta.windows(2 * lag + 1).zip(alpha.windows(2 * lag + 1)) {
            let ([t0, t1, t2], [a0, a1, a2]) =
                (ends_and_middle(theta, lag), ends_and_middle(alpha, lag));
            let acceleration = |x0: f64, x1: f64, x2: f64| (x2 - 2.0 * x1 + x0) / (span * span);
            let (sin, cos) = a1.sin_cos();
            regression.add(
                [
                    sin,
                    cos * acceleration(t0, t1, t2),
                    (a2 - a0) / (2.0 * span),
                ],
                acceleration(a0, a1, a2),
            );
        }
    }
    // Neighbouring samples share most of their differences: only one in 2*lag + 1 is independent.
    let [gravity, coupling, _] = regression.solve((2 * lag + 1) as f64)?;
    let sign = |estimate: Estimate, least: f64| {
        (estimate.value.abs() > least && estimate.value.abs() > SIGNIFICANT * estimate.std)
            .then_some(estimate.value.signum())
    };
    match (
        sign(gravity, FREQUENCY_SQUARED_AT_LEAST),
        sign(coupling, COUPLING_AT_LEAST),
    ) {
        (Some(gravity), _) if gravity < 0.0 => Some(NoticeKind::HangingSuspected),
        (Some(_), Some(coupling)) if coupling < 0.0 => Some(NoticeKind::SignSuspected),
        _ => None,
    }
}

fn ends_and_middle(window: &[f64], lag: usize) -> [f64; 3] {
    [0, lag, 2 * lag].map(|k| window.get(k).copied().unwrap_or(0.0))
}

#[derive(Clone, Copy)]
struct Estimate {
    value: f64,
    std: f64,
}

/// Least squares with three regressors, by normal equations.
#[derive(Default)]
struct Regression {
    xx: [[f64; 3]; 3],
    xy: [f64; 3],
    yy: f64,
    count: f64,
}

impl Regression {
    fn add(&mut self, x: [f64; 3], y: f64) {
        for ((row, xy), xi) in self.xx.iter_mut().zip(&mut self.xy).zip(x) {
            for (entry, xj) in row.iter_mut().zip(x) {
                *entry += xi * xj;
            }
            *xy += xi * y;
        }
        self.yy += y * y;
        self.count += 1.0;
    }

    /// Coefficients with standard deviations, where one sample in `correlated` is independent; `None` where the regressors do not differ.
    fn solve(&self, correlated: f64) -> Option<[Estimate; 3]> {
        let [[a, b, c], [_, d, e], [_, _, f]] = self.xx;
        let adjugate = [
            [d * f - e * e, c * e - b * f, b * e - c * d],
            [c * e - b * f, a * f - c * c, b * c - a * e],
            [b * e - c * d, b * c - a * e, a * d - b * b],
        ];
        let determinant = a * (d * f - e * e) + b * (c * e - b * f) + c * (b * e - c * d);
        let independent = self.count / correlated - 3.0;
        if !(determinant > 1e-12 * a * d * f && independent > 10.0) {
            return None;
        }
        let dot = |row: [f64; 3]| {
            row.into_iter()
                .zip(self.xy)
                .map(|(entry, xy)| entry * xy)
                .sum::<f64>()
                / determinant
        };
        let values = adjugate.map(dot);
        let explained: f64 = values
            .into_iter()
            .zip(self.xy)
            .map(|(value, xy)| value * xy)
            .sum();
        let variance = ((self.yy - explained) / correlated / independent).max(0.0);
        let [[p, ..], [_, q, _], [_, _, r]] = adjugate;
        let std = |cofactor: f64| {
            (variance * correlated * cofactor / determinant)
                .max(0.0)
                .sqrt()
        };
        let [x, y, z] = values;
        Some([
            Estimate {
                value: x,
                std: std(p),
            },
            Estimate {
                value: y,
                std: std(q),
            },
            Estimate {
                value: z,
                std: std(r),
            },
        ])
    }
}
