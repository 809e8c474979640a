//! Whether the columns of a row are of one moment.
//!
//! With a rate of change beside what acts, an equation of motion in its weak form tells moments apart to some hundredths
//! of a row.

use furuta_model::Rig;

use super::weak::pendulum::{self, APART};
use super::weak::{CORRELATED, arm};
use super::{NoticeKind, Recording};

/// Standard deviations that a time must be away from zero to be spoken of. On the sound recordings that were tried, where
/// the pendulum hangs, none is further than half of that from zero on the side of what is accused.
const SIGNIFICANT: f64 = 8.0;
/// A logger that writes what it read a row before is late by one row, less what a motor lags.
const ROWS: f64 = 0.4;
/// Share of the command that the arm's equation, and of the pendulum's motion that the pendulum's leaves at most.
const COMMAND_LEFT: f64 = 0.3;
const MOTION_LEFT: f64 = 0.02;

/// Suspects a command that is written in a later row than the one from which on it acts: no rig answers before it is
/// told. A delay, a lag and late encoders are the other way.
pub(super) fn late(recording: &Recording, rig: &Rig) -> Option<NoticeKind> {
    if !recording.hangs() {
        return None;
    }
    let needs = arm::regression(recording, &rig.params.coefficients(), 0.0).solve(CORRELATED)?;
    let late = needs.coefficients[arm::LATE];
    let rows = late.value / recording.sample_period;
    let is_told = needs.left < COMMAND_LEFT && late.sign(0.0, SIGNIFICANT).is_some();
    (is_told && rows > ROWS).then_some(NoticeKind::LateCommandSuspected { rows })
}

/// Suspects angles that were read in different rows. Of a pendulum that is balanced, its controller's limit cycle passes
/// for a law with another moment.
pub(super) fn skew(recording: &Recording) -> Option<NoticeKind> {
    if !recording.hangs() {
        return None;
    }
    let law = pendulum::regression(recording, 1.0, 0.0).only(APART);
    let law = law.solve(CORRELATED)?;
    let [coupling, skew] = [pendulum::COUPLING, APART.len() - 1].map(|i| law.coefficients[i]);
    let rows = -skew.value / coupling.value / recording.sample_period;
    let is_told = law.left < MOTION_LEFT && skew.sign(0.0, SIGNIFICANT).is_some();
    (is_told && rows.abs() > ROWS).then_some(NoticeKind::SkewSuspected { rows })
}
