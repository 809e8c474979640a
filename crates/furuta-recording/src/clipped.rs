//! Whether an encoder stopped counting while the axis still turned.

use super::convention::{DIFFERENCE, differences};
use super::regression::Regression;
use super::{NoticeKind, Recording};

/// A plateau at an extreme lasts at least this many samples.
const PLATEAU: usize = 8;
/// The motion over this many counts before a plateau is compared with the motion over as many before those.
const COUNTS: f64 = 6.0;
/// An axis that comes to rest takes 2.4 times as long for the last counts as for as many before them, one whose encoder
/// ends as long.
const SLOWING: f64 = 1.5;
/// At its speed the axis would have gone beyond the plateau by at least this many counts before it came back.
const BEYOND: f64 = 4.0;
/// There are at least this many such plateaus.
const TIMES: usize = 2;
/// What the pendulum's equation leaves with an arm that stopped, over what it leaves with one that went on, at least.
/// Clipped at a tenth to all of its swing it is 1.1 to 3.8, held by friction 0.99 to 1.01.
const BETTER: f64 = 1.05;

/// Suspects an encoder (or a column of fixed range) that ends at a value: motion that stops dead at the largest or
/// smallest value, stays there and leaves it as suddenly, more than once.
///
/// An arm that friction holds at each reversal does that as well; then the pendulum is jerked at each stop.
pub(super) fn clipped(
    recording: &Recording,
    column: &'static str,
    values: &[f64],
) -> Option<NoticeKind> {
    let count = values
        .iter()
        .zip(values.iter().skip(1))
        .map(|(a, b)| (b - a).abs())
        .filter(|s| *s > 1e-9)
        .fold(f64::INFINITY, f64::min);
    if !count.is_finite() {
        return None;
    }
    let extremes = [
        values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        values.iter().copied().fold(f64::INFINITY, f64::min),
    ];
    let stops = extremes.map(|extreme| {
        let segments = recording.segments.iter();
        let of_each = segments.filter_map(|s| Some((s.start, values.get(s.clone())?)));
        let stops: Vec<Stop> = of_each
            .flat_map(|(start, values)| {
                let stops = dead_stops(values, extreme, count);
                stops.into_iter().map(move |stop| stop.map(|k| start + k))
            })
            .collect();
        if stops.len() >= TIMES {
            stops
        } else {
            Vec::new()
        }
    });
    let (at, times) = extremes
        .into_iter()
        .zip(stops.iter().map(Vec::len))
        .find(|(_, times)| *times > 0)?;
    let mut all = stops.concat();
    all.sort_unstable();
    (column != "theta" || went_on(recording, &all)).then_some(NoticeKind::ClippedSuspected {
        column,
        at,
        times,
    })
}

/// First and last sample of a plateau.
type Stop = [usize; 2];

/// Whether the pendulum says that the arm went on at these stops: its equation holds better without the recorded
/// acceleration of the arm at their ends. Within a plateau nothing is known of an arm whose encoder ended.
fn went_on(recording: &Recording, stops: &[Stop]) -> bool {
    let (mut stopped, mut went_on) = (Regression::<3>::default(), Regression::<3>::default());
    let columns = [recording.theta.as_slice(), recording.alpha.as_slice()];
    let lag = (DIFFERENCE / recording.sample_period).round().max(1.0) as usize;
    let mut ahead = stops;
    differences(recording, columns, DIFFERENCE, |[arm, pendulum]| {
        let k = arm.index;
        while let Some(([_, last], rest)) = ahead.split_first()
            && last + lag < k
        {
            ahead = rest;
        }
        let (near, within) = ahead.first().map_or((false, false), |&[first, last]| {
            (first <= k + lag, first + lag < k && k + lag < last)
        });
        if within {
            return;
        }
        let (sin, cos) = pendulum.angle.sin_cos();
        let pull = cos * arm.acceleration;
        let known = if near { 0.0 } else { pull };
        stopped.add([sin, pendulum.speed, pull], pendulum.acceleration);
        went_on.add([sin, pendulum.speed, known], pendulum.acceleration);
    });
    let left = |r: Regression<3>| r.solve((2 * lag + 1) as f64).map_or(1.0, |s| s.left);
    left(stopped) > BETTER * left(went_on)
}

/// Where the motion stops dead at a value and leaves it as suddenly.
fn dead_stops(values: &[f64], extreme: f64, count: f64) -> Vec<Stop> {
    let at = |v: &f64| (v - extreme).abs() < 0.5 * count;
    let (mut k, mut stops) = (0, Vec::new());
    while let Some(first) = values[k..].iter().position(at).map(|i| k + i) {
        // Noise may lead off the plateau by a count or two.
        let near = values[first..]
            .iter()
            .take_while(|v| (**v - extreme).abs() < 2.5 * count)
            .count();
        let length = values[first..first + near]
            .iter()
            .rposition(at)
            .map_or(1, |i| i + 1);
        let last = first + length - 1;
        let arrival = sudden(values[..first].iter().rev(), extreme, count);
        let departure = sudden(values[last + 1..].iter(), extreme, count);
        if let (true, Some(arrival), Some(departure)) = (length >= PLATEAU, arrival, departure) {
            // The way beyond of an axis that turns back evenly within the plateau.
            let beyond = 0.25 * length as f64 * arrival.min(departure);
            if beyond > BEYOND * count {
                stops.push([first, last]);
            }
        }
        k = first + near.max(1);
    }
    stops
}

/// The speed next to a plateau, per sample, where the motion does not slow down towards it; `away` leads away from it.
fn sudden<'a>(away: impl Iterator<Item = &'a f64>, extreme: f64, count: f64) -> Option<f64> {
    let mut passed = None;
    for (k, value) in away.enumerate() {
        let distance = (value - extreme).abs();
        match passed {
            None if distance >= COUNTS * count => passed = Some((k + 1, distance)),
            Some((samples, way)) if distance >= 2.0 * way => {
                let (near, far) = (samples as f64, (k + 1 - samples) as f64);
                return (near < SLOWING * far + 1.0).then_some(way / near);
            }
            _ => {}
        }
    }
    None
}
