//! Whether the columns of a row are of one moment.
//!
//! With a rate of change beside what acts, an equation of motion in its weak form tells moments apart to some
//! hundredths of a row.

use furuta_model::Rig;

use super::regression::Estimate;
use super::shown::Shown;
use super::weak::pendulum::{self, APART};
use super::weak::{CORRELATED, arm};
use super::{NoticeKind, Recording};

/// Standard deviations that a time must be away from zero to be spoken of. On the sound recordings that were tried and
/// hang, a command is never later than half of that.
const SIGNIFICANT: f64 = 8.0;
/// A logger that writes what it read a row before is late by one row, less what a motor lags; by more than a few rows
/// no logger is, and no rate of change tells.
const ROWS: core::ops::Range<f64> = 0.4..3.5;
/// A column that was written a row later is late by whole rows within this; an encoder on the motor's side of a drive
/// that gives way is late by any time.
const NOT_WHOLE: f64 = 0.1;
/// Standard deviations within which a time is known.
const KNOWN: f64 = 4.0;
/// The command's rate differs from what the arm needs by this share of its squares at least: under a single sine all
/// are sums of a sine and a cosine, and what little friction adds to that is taken for a law.
const DIFFERS: f64 = 0.05;
/// Share of the command that the arm's equation, and of the pendulum's motion that the pendulum's leaves at most.
const COMMAND_LEFT: f64 = 0.3;
const MOTION_LEFT: f64 = 0.02;

/// Suspects a command that is written in a later row than the one from which on it acts: no rig answers before it is
/// told. A delay, a lag and late encoders are the other way.
pub(super) fn late(recording: &Recording, rig: &Rig) -> Shown {
    let told = || {
        let regression = arm::regression(recording, &rig.params.coefficients(), 0.0);
        let needs = regression.solve(CORRELATED)?;
        let differs = regression.independent(arm::LATE) > DIFFERS;
        (differs && needs.left < COMMAND_LEFT).then_some(needs)
    };
    let Some(needs) = recording.hangs().then(told).flatten() else {
        return Shown::Neither;
    };
    let rows = in_rows(needs.coefficients[arm::LATE], recording.sample_period);
    let kind = NoticeKind::LateCommandSuspected { rows: rows.value };
    shown(rows, is_late(rows), kind)
}

/// Suspects angles that were read in different rows. Of a pendulum that is balanced, its controller's limit cycle
/// passes for a law with another moment.
pub(super) fn skew(recording: &Recording) -> Shown {
    let law = || {
        pendulum::regression(recording, 1.0, 0.0)
            .only(APART)
            .solve(CORRELATED)
    };
    let law = recording.hangs().then(law).flatten();
    let Some(law) = law.filter(|law| law.left < MOTION_LEFT) else {
        return Shown::Neither;
    };
    let [coupling, skew] = [pendulum::COUPLING, APART.len() - 1].map(|i| law.coefficients[i]);
    let rows = in_rows(skew, -coupling.value * recording.sample_period);
    let size = Estimate {
        value: rows.value.abs(),
        ..rows
    };
    let is_whole = (rows.value - rows.value.round()).abs() < NOT_WHOLE;
    let kind = NoticeKind::SkewSuspected { rows: rows.value };
    shown(size, is_late(size) && is_whole, kind)
}

/// Right where it cannot be later than what is accused.
fn shown(rows: Estimate, is_wrong: bool, kind: NoticeKind) -> Shown {
    if is_wrong {
        Shown::Wrong(kind)
    } else if rows.value + KNOWN * rows.std < ROWS.start {
        Shown::Right
    } else {
        Shown::Neither
    }
}

fn in_rows(time: Estimate, row: f64) -> Estimate {
    Estimate {
        value: time.value / row,
        std: time.std / row.abs(),
        worst: time.worst / row.abs(),
    }
}

fn is_late(rows: Estimate) -> bool {
    ROWS.contains(&rows.value) && rows.sign(0.0, SIGNIFICANT).is_some()
}
