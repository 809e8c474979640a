//! From a table of numbers to a recording: time stamps, repeated rows, turns of the angles.

use core::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::Range;
use std::path::Path;

use super::spikes::spikes;
use super::{Notice, NoticeKind, Recording, RecordingError, Table, Values, clipped, convention};

/// An interval may differ from the sample period by this fraction of it and still count as jitter. Time stamps in whole
/// milliseconds need 0.2 at 400 Hz and 0.33 at 667 Hz.
pub const JITTER_TOLERATED: f64 = 0.35;
/// An interval longer than this many sample periods is a gap: at least one sample is missing.
pub const GAP_FACTOR: f64 = 1.5;
/// A recording in which a larger share of the intervals is a gap or irregular is refused: it has no sample period.
pub const IRREGULAR_SHARE: f64 = 0.05;
/// A segment between gaps needs this many samples to be of use.
pub const MIN_SEGMENT: usize = 20;

/// Two intervals at least, or there is no rate to speak of.
const MIN_ROWS: usize = 3;
/// Where the intervals scatter, one this many times as long as their mean is a gap.
pub const UNEVEN_GAP: f64 = 3.0;
/// Jitter below this fraction of the period is rounding and not told.
const JITTER_MENTIONED: f64 = 0.02;
/// Up to this number, gaps are described one by one; more of them together.
const GAPS_LISTED: usize = 5;
/// Shortest recording that is not called short, s: several swings of the pendulum.
const DURATION_ADVISED: f64 = 2.0;
/// No pendulum of the bench turns faster: a change beyond this speed, rad/s, and beyond [`JUMP`], rad, is no motion.
const SPEED_POSSIBLE: f64 = 200.0;
const JUMP: f64 = 0.6;
/// More spikes than this share of the rows are no glitches: each ends the stretch over which is predicted.
const SPIKES_SHARE: f64 = 0.01;
/// Values within one turn and this much, rad, are taken as recorded modulo a turn where they jump by a turn.
const TURN_SLACK: f64 = 0.05;

pub(super) fn check(mut table: Table) -> Result<(Recording, Vec<Notice>), RecordingError> {
    let mut notices = Vec::new();
    let repeated = drop_repeated_rows(&mut table);
    if !repeated.is_empty() {
        notices.push(NoticeKind::DuplicatedRows { rows: repeated });
    }
    if table.t.len() < MIN_ROWS {
        return Err(RecordingError::TooFewRows {
            file: table.file,
            rows: table.t.len(),
            required: MIN_ROWS,
        });
    }
    time_goes_forward(&table)?;
    let spikes = standing_out(&table, &mut notices);
    let timing = Timing::of(&table, &spikes, &mut notices)?;

    notices.extend(convention::time_unit(timing.period));
    for (column, values) in [("theta", &mut table.theta), ("alpha", &mut table.alpha)] {
        match convention::coarse(column, values) {
            Some(suspicion) => notices.push(suspicion),
            None => unwrap_turns(column, values, &table.rows, &timing, &mut notices),
        }
    }

    let Table {
        file,
        t,
        u,
        theta,
        alpha,
        theta_dot,
        alpha_dot,
        extra,
        rig,
        metadata,
        comments,
        ..
    } = table;
    let name = Path::new(&file)
        .file_name()
        .map_or_else(|| file.clone(), |name| name.to_string_lossy().into_owned());
    let Timing {
        period: sample_period,
        segments,
    } = timing;
    let recording = Recording {
        name,
        t,
        u,
        theta,
        alpha,
        theta_dot,
        alpha_dot,
        extra,
        sample_period,
        segments,
        rig,
        metadata,
        comments,
    };
    content(&recording, &mut notices);
    Ok((
        recording,
        notices
            .into_iter()
            .map(|kind| Notice {
                file: file.clone(),
                kind,
            })
            .collect(),
    ))
}

/// Removes rows that repeat the one before in every column, and returns their row numbers.
fn drop_repeated_rows(table: &mut Table) -> Vec<usize> {
    let same = |values: &[f64], k: usize| {
        let (a, b) = (values.get(k), values.get(k + 1));
        a == b || matches!((a, b), (Some(a), Some(b)) if a.is_nan() && b.is_nan())
    };
    let repeats_next = |k: usize| {
        let numbers = [
            Some(&table.t),
            Some(&table.u),
            Some(&table.theta),
            Some(&table.alpha),
            table.theta_dot.as_ref(),
            table.alpha_dot.as_ref(),
        ];
        numbers.into_iter().flatten().all(|values| same(values, k))
            && table.extra.iter().all(|column| match &column.values {
                Values::Numbers(values) => same(values, k),
                Values::Text(values) => values.get(k) == values.get(k + 1),
            })
    };
    let mut keep = vec![true; table.t.len()];
    for (k, keep) in keep.iter_mut().enumerate().skip(1) {
        *keep = !repeats_next(k - 1);
    }
    let dropped: Vec<usize> = table
        .rows
        .iter()
        .zip(&keep)
        .filter_map(|(&row, &keep)| (!keep).then_some(row))
        .collect();
    if !dropped.is_empty() {
        retain(&mut table.rows, &keep);
        for values in [
            &mut table.t,
            &mut table.u,
            &mut table.theta,
            &mut table.alpha,
        ] {
            retain(values, &keep);
        }
        for values in [&mut table.theta_dot, &mut table.alpha_dot]
            .into_iter()
            .flatten()
        {
            retain(values, &keep);
        }
        for column in &mut table.extra {
            match &mut column.values {
                Values::Numbers(values) => retain(values, &keep),
                Values::Text(values) => retain(values, &keep),
            }
        }
    }
    dropped
}

/// The samples in which an angle stands out as no motion does, unless they are many.
fn standing_out(table: &Table, notices: &mut Vec<NoticeKind>) -> Vec<usize> {
    let mut all = Vec::new();
    for (column, values) in [("theta", &table.theta), ("alpha", &table.alpha)] {
        let Some((places, by)) = spikes(values) else {
            continue;
        };
        if places.len() as f64 > SPIKES_SHARE * values.len() as f64 {
            let rows = places.len();
            notices.push(NoticeKind::ManySpikesSuspected { column, rows, by });
            continue;
        }
        let row = |k: &usize| table.rows.get(*k).copied().unwrap_or(0);
        notices.push(NoticeKind::Spikes {
            column,
            rows: places.iter().map(row).collect(),
            by,
        });
        all.extend(places);
    }
    all.sort_unstable();
    all.dedup();
    all
}

fn retain<T>(values: &mut Vec<T>, keep: &[bool]) {
    let mut keep = keep.iter();
    values.retain(|_| keep.next().copied().unwrap_or(true));
}

fn time_goes_forward(table: &Table) -> Result<(), RecordingError> {
    for (k, (&before, &t)) in table.t.iter().zip(table.t.iter().skip(1)).enumerate() {
        let row = table.rows.get(k + 1).copied().unwrap_or(0);
        if t < before {
            return Err(RecordingError::TimeBackwards {
                file: table.file.clone(),
                row,
                before,
                t,
            });
        }
        if t == before {
            return Err(RecordingError::TimeStandsStill {
                file: table.file.clone(),
                row,
                t,
            });
        }
    }
    Ok(())
}

/// The sample period and the stretches that keep to it.
struct Timing {
    period: f64,
    segments: Vec<Range<usize>>,
}

impl Timing {
    fn of(
        table: &Table,
        spikes: &[usize],
        notices: &mut Vec<NoticeKind>,
    ) -> Result<Self, RecordingError> {
        let intervals: Vec<f64> = table
            .t
            .iter()
            .zip(table.t.iter().skip(1))
            .map(|(before, after)| after - before)
            .collect();
        let period = period(&intervals);
        // A difference of two finite time stamps can overflow; an infinite period fits no interval.
        let deviates = |interval: f64| {
            !period.is_finite() || (interval - period).abs() > JITTER_TOLERATED * period
        };
        let row = |k: usize| table.rows.get(k + 1).copied().unwrap_or(0);

        let where_ = |wanted: &dyn Fn(f64) -> bool| -> Vec<usize> {
            let all = intervals.iter().enumerate();
            all.filter_map(|(k, &interval)| wanted(interval).then_some(k))
                .collect()
        };
        let too_many = |breaks: &[usize]| {
            (breaks.len() > 2 || !period.is_finite())
                && breaks.len() as f64 > IRREGULAR_SHARE * intervals.len() as f64
        };
        let mut breaks = where_(&deviates);
        if too_many(&breaks) && period.is_finite() {
            // A clock that jitters: its time stamps are used as they are, cut at gaps alone.
            let gaps = where_(&|interval| interval > UNEVEN_GAP * period);
            if !too_many(&gaps) {
                notices.push(NoticeKind::UnevenTime {
                    irregular: breaks.len(),
                    intervals: intervals.len(),
                    period: rounded(period),
                });
                breaks = gaps;
            }
        }
        if let Some(&first) = breaks.first()
            && too_many(&breaks)
        {
            return Err(RecordingError::IrregularTime {
                file: table.file.clone(),
                irregular: breaks.len(),
                intervals: intervals.len(),
                percent: 100.0 * JITTER_TOLERATED,
                period: rounded(period),
                interval: rounded(intervals.get(first).copied().unwrap_or(f64::NAN)),
                row: row(first),
            });
        }
        let (gaps, irregular): (Vec<usize>, Vec<usize>) = breaks.iter().partition(|&&k| {
            intervals
                .get(k)
                .is_some_and(|&interval| interval > GAP_FACTOR * period)
        });
        if gaps.len() > GAPS_LISTED {
            notices.push(NoticeKind::Gaps {
                rows: gaps.into_iter().map(row).collect(),
            });
        } else {
            for k in gaps {
                let at = |k: usize| table.t.get(k).copied().unwrap_or(f64::NAN);
                notices.push(NoticeKind::Gap {
                    row: row(k),
                    from: at(k),
                    to: at(k + 1),
                });
            }
        }
        if !irregular.is_empty() {
            notices.push(NoticeKind::IrregularIntervals {
                rows: irregular.into_iter().map(row).collect(),
                period: rounded(period),
            });
        }

        let largest = intervals
            .iter()
            .filter(|&&interval| !deviates(interval))
            .map(|interval| (interval / period - 1.0).abs())
            .fold(0.0, f64::max);
        let told = |notice: &NoticeKind| matches!(notice, NoticeKind::UnevenTime { .. });
        if !notices.iter().any(told) && largest > JITTER_MENTIONED {
            notices.push(NoticeKind::Jitter {
                largest,
                period: rounded(period),
            });
        }
        Ok(Self {
            period,
            segments: segments(table, &breaks, spikes, notices),
        })
    }
}

/// Mean of the intervals that are not gaps. The median, which tells the gaps, would be off where time stamps are
/// rounded to the millisecond (2, 3, 2, 3 ms at 400 Hz).
fn period(intervals: &[f64]) -> f64 {
    let mut sorted = intervals.to_vec();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN);
    let (mut sum, mut count) = (0.0, 0.0);
    for interval in sorted
        .iter()
        .filter(|&&interval| interval < 1.75 * median && interval > 0.25 * median)
    {
        sum += interval;
        count += 1.0;
    }
    sum / count
}

/// The stretches between breaks and samples that stand out.
fn segments(
    table: &Table,
    breaks: &[usize],
    spikes: &[usize],
    notices: &mut Vec<NoticeKind>,
) -> Vec<Range<usize>> {
    let around = spikes.iter().flat_map(|&k| [k.saturating_sub(1), k]);
    let mut breaks: Vec<usize> = breaks.iter().copied().chain(around).collect();
    breaks.sort_unstable();
    breaks.dedup();
    let starts = core::iter::once(0).chain(breaks.iter().map(|k| k + 1));
    let ends = breaks
        .iter()
        .map(|k| k + 1)
        .chain(core::iter::once(table.t.len()));
    let stretches = starts.zip(ends).map(|(start, end)| start..end);
    let is_spike = |range: &Range<usize>| range.len() == 1 && spikes.contains(&range.start);
    let all: Vec<Range<usize>> = stretches.filter(|range| !is_spike(range)).collect();
    let longest = all.iter().map(Range::len).max().unwrap_or(0);
    let (useful, short): (Vec<_>, Vec<_>) = all
        .into_iter()
        .partition(|range| range.len() >= MIN_SEGMENT.min(longest));
    if !short.is_empty() {
        let row = |range: &Range<usize>| table.rows.get(range.start).copied().unwrap_or(0);
        notices.push(NoticeKind::ShortSegments {
            rows: short.iter().map(row).collect(),
            samples: short.iter().map(Range::len).sum(),
        });
    }
    useful
}

/// Makes an angle continuous that was recorded modulo a turn. A pendulum that then starts near -pi starts at +pi: which
/// of the two was written is chance where it hangs, and alpha = pi is the convention.
fn unwrap_turns(
    column: &'static str,
    values: &mut [f64],
    rows: &[usize],
    timing: &Timing,
    notices: &mut Vec<NoticeKind>,
) {
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| {
            (low.min(value), high.max(value))
        });
    let within_a_turn = high - low <= TAU + TURN_SLACK;
    let row = |k: usize| rows.get(k).copied().unwrap_or(0);

    let (mut turns, mut jumps, mut first_jump) = (0.0, 0, 0);
    let mut before = values.first().copied().unwrap_or(0.0);
    let mut reported = false;
    for (k, value) in values.iter_mut().enumerate() {
        let change = *value - before;
        before = *value;
        let whole = (change / TAU).round();
        if within_a_turn && whole != 0.0 && (change - whole * TAU).abs() < FRAC_PI_2 {
            turns -= whole;
            jumps += 1;
            if first_jump == 0 {
                first_jump = row(k);
            }
        } else if change.abs() > JUMP.max(SPEED_POSSIBLE * timing.period)
            && !reported
            && timing
                .segments
                .iter()
                .any(|segment| segment.contains(&k) && segment.start != k)
        {
            reported = true;
            notices.push(NoticeKind::Jump {
                column,
                row: row(k),
                by: change,
            });
        }
        *value += turns * TAU;
    }
    if jumps > 0 {
        notices.push(NoticeKind::Unwrapped {
            column,
            row: first_jump,
            jumps,
        });
        if column == "alpha"
            && values
                .first()
                .is_some_and(|&first| (-PI - TURN_SLACK..-FRAC_PI_2).contains(&first))
        {
            for value in values {
                *value += TAU;
            }
        }
    }
}

/// What the recording shows, once it is known to be one.
fn content(recording: &Recording, notices: &mut Vec<NoticeKind>) {
    let duration = recording.duration();
    if duration < DURATION_ADVISED {
        notices.push(NoticeKind::TooShort {
            duration,
            required: DURATION_ADVISED,
        });
    }
    let constant = |values: &[f64]| values.iter().all(|value| Some(value) == values.first());
    if constant(&recording.theta) && constant(&recording.alpha) {
        notices.push(NoticeKind::NoMotion);
    }
    if constant(&recording.u) {
        notices.push(NoticeKind::ConstantCommand {
            // A log's minus zero is zero.
            value: recording.u.first().copied().unwrap_or(0.0) + 0.0,
        });
    }
    for (column, values) in [("theta", &recording.theta), ("alpha", &recording.alpha)] {
        notices.extend(clipped::clipped(recording, column, values));
    }
    let in_degrees = |n: &NoticeKind| matches!(n, NoticeKind::DegreesSuspected { .. });
    if !notices.iter().any(in_degrees) {
        let degrees = convention::degrees(recording);
        if !degrees.is_empty() {
            // Degrees are fast: what looked like a jump is motion.
            notices.retain(|n| !matches!(n, NoticeKind::Jump { .. }));
        }
        notices.extend(degrees);
    }
    if !notices.iter().any(NoticeKind::is_suspicion) {
        notices.extend(convention::signs(recording));
    }
}

/// To six digits, for messages: 0.002000000000001 is not what anybody wants to read.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}
