//! Whether a recording keeps to the conventions: seconds, radians, alpha from upright, both angles counted the same
//! way.
//!
//! These are suspicions, never corrections: a wrong guess would turn good data into nonsense.

use core::f64::consts::PI;

use super::differences::{DIFFERENCE, differences};
use super::regression::{Estimate, Regression};
use super::weak::{CORRELATED, pendulum};
use super::{NoticeKind, Recording};

/// No encoder of the bench has fewer counts a turn: a resolution coarser than `2 pi` over this is not in radians.
const COUNTS_AT_LEAST: f64 = 150.0;
/// An angle beyond this, rad, would be more than six turns of a cable: its unit is questioned.
const ANGLE_AT_MOST: f64 = 40.0;
/// Share that an alpha in degrees, converted, leaves of what it leaves as it is.
const LEFT_IN_RADIANS: f64 = 0.3;

/// Suspects milliseconds or microseconds behind a sample period of half a second and more.
pub(super) fn time_unit(period: f64) -> Option<NoticeKind> {
    let unit = match period {
        p if p >= 200.0 => "microseconds",
        p if p >= 0.5 => "milliseconds",
        _ => return None,
    };
    Some(NoticeKind::TimeUnitSuspected { period, unit })
}

/// Suspects counts or degrees: whole numbers, or steps far coarser than any encoder's in radians.
pub(super) fn coarse(column: &'static str, values: &[f64]) -> Option<NoticeKind> {
    let (resolution, largest) = steps(values);
    let coarse = resolution.is_finite() && resolution > core::f64::consts::TAU / COUNTS_AT_LEAST;
    (coarse && largest > PI).then(|| {
        if values.iter().all(|value| value.fract() == 0.0) {
            NoticeKind::RawCountsSuspected {
                column,
                largest,
                per_turn: None,
            }
        } else {
            NoticeKind::DegreesSuspected {
                column,
                resolution,
                largest,
            }
        }
    })
}

/// Suspects degrees behind angles of many turns in fine steps. An arm, or a pendulum that spins, may really turn so
/// far: so the pendulum's equation
/// decides, which holds in radians alone; and a pendulum that hangs at half a turn.
pub(super) fn degrees(recording: &Recording) -> Vec<NoticeKind> {
    let (theta, alpha) = (&recording.theta, &recording.alpha);
    let suspicion = |column, values: &[f64]| {
        let (resolution, largest) = steps(values);
        NoticeKind::DegreesSuspected {
            column,
            resolution: if resolution.is_finite() {
                resolution
            } else {
                0.0
            },
            largest,
        }
    };
    let mut found = Vec::new();
    let beyond = |values: &[f64]| steps(values).1 > ANGLE_AT_MOST;
    let degrees = PI.recip() * 180.0;
    let law = |scale: f64| {
        let regression = pendulum::regression(recording, scale, 0.0).only(pendulum::PLAIN);
        regression.solve(CORRELATED)
    };
    let in_degrees = beyond(alpha) && {
        let left = |scale: f64| law(scale).map_or(1.0, |law| law.left);
        let about_half_a_turn = alpha.iter().all(|a| (a.abs() - 180.0).abs() < 90.0);
        about_half_a_turn || left(degrees) < LEFT_IN_RADIANS * left(1.0)
    };
    // An arm in degrees moves the pendulum by a sixtieth of what any arm would.
    if beyond(theta) {
        let scale = if in_degrees { degrees } else { 1.0 };
        let weak = law(scale).is_some_and(|law| {
            let [value, std] = {
                let e = law.coefficients[pendulum::COUPLING];
                [e.value / scale, e.std / scale]
            };
            law.left < SWAPPED_LEAVES
                && value > SIGNIFICANT * std
                && value + SIGNIFICANT * std < COUPLING_AT_LEAST
        });
        if weak {
            found.push(suspicion("theta", theta));
        }
    }
    if in_degrees {
        found.push(suspicion("alpha", alpha));
    }
    found
}

/// The smallest change of a column (infinite where nothing changes) and its largest size.
fn steps(values: &[f64]) -> (f64, f64) {
    let largest = values
        .iter()
        .fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let resolution = values
        .iter()
        .zip(values.iter().skip(1))
        .map(|(a, b)| (b - a).abs())
        .filter(|&change| change > 0.0)
        .fold(f64::INFINITY, f64::min);
    (resolution, largest)
}

/// Time over which small or slow motion is differenced, s: three times as long as the usual one, it lowers the noise of
/// an acceleration to a ninth, and still sees a pendulum of 3 Hz.
const LONG_DIFFERENCE: f64 = 0.06;
/// Standard deviations that a coefficient must be away from zero to be spoken of; the noise of neighbouring samples is
/// correlated and the friction left out of the regression, so this is far above the usual three.
const SIGNIFICANT: f64 = 12.0;
/// Slowest pendulum of a bench, squared angular frequency in rad^2/s^2 (1.6 m long).
const FREQUENCY_SQUARED_AT_LEAST: f64 = 8.0;
/// Fastest one, rad^2/s^2 (2.5 cm long). Balanced in a small limit cycle, a coarse encoder and the arm's backlash make
/// every second difference look like a spring far stiffer than any weight.
const FREQUENCY_SQUARED_AT_MOST: f64 = 400.0;
/// Least coupling `m L c / (I + m c^2)` of any real rig.
const COUPLING_AT_LEAST: f64 = 0.1;

/// A column that is at half a turn on average, within this (rad), while the other is at zero, is the pendulum's.
const HANGS_WITHIN: f64 = 0.3;
/// A recording that starts with a pendulum at rest starts within this of half a turn, rad.
const RESTS_WITHIN: f64 = 0.02;
/// What another order of the columns must leave unexplained at most, and by which factor less than the order given, to
/// be believed.
const SWAPPED_LEAVES: f64 = 0.3;
const SWAPPED_BETTER: f64 = 3.0;

/// The pendulum's equation, which holds whatever the motor does, as the recording shows it:
/// `alpha_ddot = a*sin(alpha) + b*cos(alpha)*theta_ddot - c*alpha_dot`, with `a = m g c / (I + m c^2) > 0` and
/// `b = m L c / (I + m c^2) > 0`.
#[derive(Clone, Copy, Debug)]
pub(super) struct PendulumLaw {
    /// `a`, 1/s^2.
    pub(super) gravity: Estimate,
    /// `b`.
    pub(super) coupling: Estimate,
    /// Share of `alpha_ddot` that is left, 0 to 1.
    pub(super) left: f64,
}

impl PendulumLaw {
    /// From two columns of a recording, taken as theta and alpha: over the differences that leave least.
    pub(super) fn of(recording: &Recording, theta: &[f64], alpha: &[f64]) -> Option<Self> {
        [DIFFERENCE, LONG_DIFFERENCE]
            .into_iter()
            .filter_map(|span| Self::over(recording, [theta, alpha], span))
            .min_by(|a, b| a.left.total_cmp(&b.left))
    }

    /// The same with a coupling that is known.
    pub(super) fn with_coupling(recording: &Recording, coupling: f64) -> Option<Self> {
        let mut regression = Regression::<2>::default();
        let columns = [recording.theta.as_slice(), recording.alpha.as_slice()];
        let lag = differences(recording, columns, LONG_DIFFERENCE, |[t, a]| {
            let (sin, cos) = a.angle.sin_cos();
            regression.add(
                [sin, a.speed],
                a.acceleration - coupling * cos * t.acceleration,
            );
        })?;
        let solution = regression.solve((2 * lag + 1) as f64)?;
        let [gravity, _] = solution.coefficients;
        Some(Self {
            gravity,
            coupling: Estimate {
                value: coupling,
                std: 0.0,
                worst: 0.0,
            },
            left: solution.left,
        })
    }

    fn over(recording: &Recording, columns: [&[f64]; 2], span: f64) -> Option<Self> {
        let mut regression = Regression::<3>::default();
        let lag = differences(recording, columns, span, |d| {
            let (sin, cos) = d[1].angle.sin_cos();
            regression.add(
                [sin, cos * d[0].acceleration, d[1].speed],
                d[1].acceleration,
            );
        })?;
        // Neighbouring samples share most of their differences: only one in 2*lag + 1 is independent.
        let solution = regression.solve((2 * lag + 1) as f64)?;
        let [gravity, coupling, _] = solution.coefficients;
        Some(Self {
            gravity,
            coupling,
            left: solution.left,
        })
    }

    /// The signs of `a` and `b`, where the recording shows them beyond doubt.
    pub(super) fn signs(&self) -> [Option<f64>; 2] {
        [
            self.gravity.sign(FREQUENCY_SQUARED_AT_LEAST, SIGNIFICANT),
            self.coupling.sign(COUPLING_AT_LEAST, SIGNIFICANT),
        ]
    }
}

/// Suspects swapped columns, alpha counted from hanging, or one angle counted the other way.
///
/// Counted from hanging, both signs of the pendulum's equation turn; with one angle mirrored, that of the coupling.
/// Where two columns are swapped, the equation holds when they are swapped back.
pub(super) fn signs(recording: &Recording) -> Option<NoticeKind> {
    let (u, theta, alpha) = (&recording.u, &recording.theta, &recording.alpha);
    let law = PendulumLaw::of(recording, theta, alpha);
    let left = law.map_or(1.0, |law| law.left);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    // The pendulum hangs in theta's column: it starts there at rest, or it swings there. An arm may stand half a turn
    // away while its pendulum is balanced.
    let hangs = |angle: f64, within: f64| (angle.abs() - PI).abs() < within;
    let first = |values: &[f64]| values.first().copied().unwrap_or_default();
    let starts = hangs(first(theta), RESTS_WITHIN) && first(alpha).abs() < RESTS_WITHIN;
    let swings = || {
        let law = PendulumLaw::of(recording, alpha, theta);
        law.is_some_and(|law| law.signs() == [Some(1.0); 2])
    };
    if hangs(mean(theta), HANGS_WITHIN) && mean(alpha).abs() < HANGS_WITHIN && (starts || swings())
    {
        return Some(NoticeKind::SwappedSuspected {
            columns: ["theta", "alpha"],
        });
    }
    let orders = [
        (["theta", "alpha"], alpha, theta),
        (["u", "theta"], u, alpha),
        (["u", "alpha"], theta, u),
    ];
    for (columns, theta, alpha) in orders {
        let Some(other) = PendulumLaw::of(recording, theta, alpha) else {
            continue;
        };
        if other.signs() == [Some(1.0); 2]
            && other.left < SWAPPED_LEAVES
            && SWAPPED_BETTER * other.left < left
        {
            return Some(NoticeKind::SwappedSuspected { columns });
        }
    }
    match law?.signs() {
        [Some(gravity), _] if gravity < 0.0 => {
            let weight = law.is_some_and(|law| -law.gravity.value <= FREQUENCY_SQUARED_AT_MOST);
            weight.then_some(NoticeKind::HangingSuspected)
        }
        [Some(_), Some(coupling)] if coupling < 0.0 => Some(NoticeKind::SignSuspected),
        _ => None,
    }
}
