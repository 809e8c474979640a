//! Whether the command can be what it is said to be: in the rig's unit, counted in the arm's direction, and of the
//! motor in the rig file.

use furuta_model::{Actuation, Rig};

use super::shown::Shown;
use super::weak::CORRELATED;
use super::weak::arm::{self, DAMPING, INERTIA, ON_TIME, ONE_SIDED, PULL};
use super::{NoticeKind, Recording};

/// Rounding of a command at its limit.
const AT_THE_LIMIT: f64 = 1.01;
/// A sheet's gain may be wrong by this factor, as in a diagnosis; beyond it, unit or motor are others.
const GAIN: f64 = 4.0;
/// A unit is told by the motor's gain within this factor: what a sheet's resistance and constants may be off together.
const NEAR: f64 = 1.6;
/// Standard deviations that what the arm needs must be away from zero to tell the gain. On the recordings of all rigs
/// that were tried, an estimate as sure as that is within 0.45 to 1.7 of the sheet's.
const SIGNIFICANT: f64 = 12.0;
/// Delays of the command that are tried, s.
const DELAYS: [f64; 4] = [0.0, 0.005, 0.01, 0.02];
/// What the arm needs with the wrong sign must leave less than this of the command,
const LEAVES: f64 = 0.3;
/// and this many times less than with the right one.
const BETTER: f64 = 3.0;

/// A unit in which a command may have been written, with its size in the rig's unit and the largest number in it.
type Unit = (&'static str, f64, f64);

fn units(limit: f64) -> [Unit; 9] {
    [
        ("volts of a rig with a larger limit", 1.0, f64::INFINITY),
        ("shares of the limit", limit, 1.0),
        ("per cent of the limit", limit / 100.0, 100.0),
        ("PWM counts of 8 bits", limit / 255.0, 255.0),
        ("PWM counts of 10 bits", limit / 1023.0, 1023.0),
        ("millivolts", 1e-3, 1e3 * limit),
        ("PWM counts of 12 bits", limit / 4095.0, 4095.0),
        ("PWM counts of 15 bits", limit / 32767.0, 32767.0),
        ("PWM counts of 16 bits", limit / 65535.0, 65535.0),
    ]
}

/// Suspects another unit behind a command beyond the rig's limit, and another unit or another motor where the arm
/// answers far more, or far less, than the rig file's would.
pub(super) fn unit(recording: &Recording, rig: &Rig) -> Shown {
    let limit = rig.params.motor.command_limit;
    let largest = recording.u.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
    let gain = Gain::of(recording, rig);
    let possible = units(limit)
        .into_iter()
        .filter(|(_, _, most)| largest <= AT_THE_LIMIT * most);
    let off = |size: f64| {
        gain.as_ref()
            .map_or(f64::NAN, |g| (size / g.factor).ln().abs())
    };
    let nearest = (possible.clone()).min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
    if largest <= AT_THE_LIMIT * limit {
        let Some(gain) = &gain else {
            return Shown::Neither;
        };
        if !gain.is_off() {
            return Shown::Right;
        }
        let is_told = |unit: &Unit| !gain.is_geared && off(unit.1) < NEAR.ln();
        return Shown::Wrong(NoticeKind::MotorGainSuspected {
            factor: gain.factor,
            unit: nearest.filter(is_told).map(|(unit, size, _)| (unit, size)),
            geared: gain.is_geared,
            command: rig.params.motor.actuation.unit(),
        });
    }
    // Where the gain does not show, the smallest full scale that holds the values tells the unit.
    let known = nearest.filter(|unit| off(unit.1) < GAIN.ln());
    let unit = known
        .or_else(|| possible.clone().nth(1))
        .or_else(|| possible.clone().next());
    unit.map_or(Shown::Neither, |(unit, factor, _)| {
        Shown::Wrong(NoticeKind::CommandUnitSuspected {
            largest,
            limit,
            unit,
            factor,
        })
    })
}

/// Suspects a command, or an arm's angle, that is counted the other way: what moves the arm would need a negative
/// inertia, friction or spring.
///
/// A spring's torque is opposite to that of inertia, and below its resonance the larger; so the sign of the
/// acceleration alone says nothing. A controller's answer may take the place of friction and spring; where the inertia
/// shows beside them with the right sign, the command has it.
pub(super) fn sign(recording: &Recording, rig: &Rig) -> Option<NoticeKind> {
    let c = rig.params.coefficients();
    let plain = arm::regression(recording, &c, 0.0)
        .only(ON_TIME)
        .solve(CORRELATED);
    if plain.is_some_and(|s| s.coefficients[INERTIA].sign(0.0, SIGNIFICANT) == Some(1.0)) {
        return None;
    }
    let left = |sign: f64| {
        DELAYS
            .into_iter()
            .map(|delay| arm::regression(recording, &c, delay).only(ON_TIME))
            .map(|needs| needs.left_with_signs(ONE_SIDED, sign))
            .fold(1.0, f64::min)
    };
    let wrong = left(-1.0);
    (wrong < LEAVES && BETTER * wrong < left(1.0)).then_some(NoticeKind::CommandSignSuspected)
}

/// How hard the motor moves the arm.
struct Gain {
    /// Per unit of the column, over what the rig file's motor does per unit of the command.
    factor: f64,
    /// Whether it brakes the arm as much more: a gear multiplies both.
    is_geared: bool,
}

impl Gain {
    /// By the pendulum's pull, whose torque the sheet knows, or else by the arm's inertia, where they show. Under a
    /// single sine, what a spring holds is no other than what an inertia needs.
    fn of(recording: &Recording, rig: &Rig) -> Option<Self> {
        if rig.params.motor.actuation == Actuation::Acceleration
            || recording.is_uneven()
            || !recording.hangs()
            || arm::is_one_sine(recording)
        {
            return None;
        }
        let c = rig.params.coefficients();
        let regression = arm::regression(recording, &c, 0.0);
        let solution = regression.solve(CORRELATED)?;
        let needed = solution.coefficients;
        let shows = |i: usize| needed[i].sign(0.0, SIGNIFICANT) == Some(1.0);
        if solution.left >= LEAVES {
            return None;
        }
        let (i, sheet) = [(PULL, 1.0 / c.drive), (INERTIA, c.arm / c.drive)]
            .into_iter()
            .find(|(i, _)| shows(*i))?;
        let factor = sheet / needed[i].value;
        // What a speed takes of the command: back-EMF, which a gear multiplies, and friction, which it divides; another
        // unit divides both.
        let back_emf = match rig.params.motor.actuation {
            Actuation::Voltage => rig.params.motor.back_emf_constant,
            _ => 0.0,
        };
        let friction = c.arm_damping / c.drive - back_emf;
        let off = |expected: f64| (needed[DAMPING].value / expected).ln().abs();
        let geared = back_emf * factor + friction / factor;
        let is_geared = shows(DAMPING) && off(geared) < off((back_emf + friction) / factor);
        Some(Self { factor, is_geared })
    }

    fn is_off(&self) -> bool {
        !(1.0 / GAIN..GAIN).contains(&self.factor)
    }
}
