//! Whether the command can be what it is said to be: volts, counted in the arm's direction.

use furuta_model::Rig;
use furuta_model::State;
use furuta_model::dynamics::{Angle, bias, mass_matrix};

use super::differences::{DIFFERENCE, differences};
use super::regression::Regression;
use super::{NoticeKind, Recording};

/// Rounding of a command at its limit.
const AT_THE_LIMIT: f64 = 1.01;
/// A unit is told by the motor's gain if a command in it would be within this factor of the sheet's.
const GAIN: f64 = 4.0;
/// Smooth direction of the arm's motion, for its friction, rad/s.
const SLOW: f64 = 0.1;
/// Delays of the command that are tried, s.
const DELAYS: [f64; 4] = [0.0, 0.005, 0.01, 0.02];
/// What the arm needs with the wrong sign must leave less than this of the command,
const LEAVES: f64 = 0.3;
/// and this many times less than with the right one.
const BETTER: f64 = 3.0;

/// What the arm needs of the command: inertia, the pendulum's pull, damping, dry friction, a spring, each with a
/// coefficient of one sign; and a constant.
const TERMS: usize = 6;
const ONE_SIDED: usize = 5;

/// Suspects counts of a PWM, millivolts or per cent behind a command beyond the rig's limit.
pub(super) fn unit(recording: &Recording, rig: &Rig) -> Option<NoticeKind> {
    let limit = rig.params.motor.command_limit;
    let largest = recording.u.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
    if largest <= AT_THE_LIMIT * limit {
        return None;
    }
    let units = [
        ("volts of a rig with a larger limit", 1.0, f64::INFINITY),
        ("per cent of the limit", limit / 100.0, 100.0),
        ("PWM counts of 8 bits", limit / 255.0, 255.0),
        ("PWM counts of 10 bits", limit / 1023.0, 1023.0),
        ("millivolts", 1e-3, 1e3 * limit),
        ("PWM counts of 12 bits", limit / 4095.0, 4095.0),
        ("PWM counts of 15 bits", limit / 32767.0, 32767.0),
        ("PWM counts of 16 bits", limit / 65535.0, 65535.0),
    ];
    let possible = units
        .into_iter()
        .filter(|(_, _, most)| largest <= AT_THE_LIMIT * most);
    // The motor's gain, in V per unit of the column, tells the unit; where it does not show, the smallest full scale
    // that holds the values does.
    let factor = volts_per_unit(recording, rig);
    let off = |f: f64| factor.map_or(f64::NAN, |known| (f / known).ln().abs());
    let by_gain = possible
        .clone()
        .filter(|(_, f, _)| off(*f) < GAIN.ln())
        .min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
    let (unit, factor, _) = by_gain
        .or_else(|| possible.clone().nth(1))
        .or_else(|| possible.clone().next())?;
    Some(NoticeKind::CommandUnitSuspected {
        largest,
        limit,
        unit,
        factor,
    })
}

/// Suspects a command, or an arm's angle, that is counted the other way: what moves the arm would need a negative
/// inertia, friction or spring.
///
/// A spring's torque is opposite to that of inertia, and below its resonance the larger; so the sign of the
/// acceleration alone says nothing.
pub(super) fn sign(recording: &Recording, rig: &Rig) -> Option<NoticeKind> {
    let left = |sign: f64| {
        DELAYS
            .into_iter()
            .filter_map(|delay| needs(recording, rig, delay))
            .map(|needs| needs.left_with_signs(ONE_SIDED, sign))
            .fold(1.0, f64::min)
    };
    let wrong = left(-1.0);
    (wrong < LEAVES && BETTER * wrong < left(1.0)).then_some(NoticeKind::CommandSignSuspected)
}

/// Volts for one unit of the column, by the sheet's inertias: from the arm's own or from the pendulum's pull, whichever
/// shows better.
fn volts_per_unit(recording: &Recording, rig: &Rig) -> Option<f64> {
    let needed = needs(recording, rig, 0.0)?.solve(1.0)?.coefficients;
    let c = rig.params.coefficients();
    [(needed[0], c.arm / c.drive), (needed[1], 1.0 / c.drive)]
        .into_iter()
        .filter(|(e, _)| e.value > 0.0)
        .min_by(|(a, _), (b, _)| (a.std / a.value).total_cmp(&(b.std / b.value)))
        .map(|(e, sheet)| sheet / e.value)
}

/// The command regressed on what the arm does.
fn needs(recording: &Recording, rig: &Rig, delay: f64) -> Option<Regression<TERMS>> {
    let c = rig.params.coefficients();
    let mut regression = Regression::<TERMS>::default();
    let h = recording.sample_period;
    let lag = (DIFFERENCE / h).round().max(1.0) as usize;
    let late = (delay / h).round() as usize;
    // A second difference weighs the command before and after by a triangle.
    let command = |k: usize| {
        let (mut sum, mut weights) = (0.0, 0.0);
        for i in k.saturating_sub(lag)..(k + lag).min(recording.len()) {
            let weight = lag as f64 - (i as f64 + 0.5 - k as f64).abs();
            let volts = recording.u.get(i.saturating_sub(late));
            sum += weight * volts.copied().unwrap_or_default();
            weights += weight;
        }
        sum / weights
    };
    let columns = [recording.theta.as_slice(), recording.alpha.as_slice()];
    differences(recording, columns, DIFFERENCE, |[t, a]| {
        let angle = Angle::of(a.angle);
        let x = State::new(t.angle, a.angle, t.speed, a.speed);
        let torque = mass_matrix(&c, angle).times([t.acceleration, a.acceleration])[0];
        let pull = torque - c.arm * t.acceleration + bias(&c, angle, &x)[0];
        let direction = (t.speed / SLOW).tanh();
        regression.add(
            [t.acceleration, pull, t.speed, direction, t.angle, 1.0],
            command(t.index),
        );
    })?;
    Some(regression)
}
