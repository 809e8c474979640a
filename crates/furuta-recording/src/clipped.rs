//! Whether an encoder stopped counting while the axis still turned.

use super::differences::{DIFFERENCE, differences};
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
/// The arm went on if the pendulum feels at most this share of the recorded jerks. Held by friction it is 0.94 to 1.1,
/// clipped at 0.2 to 0.6 of the swing -0.2 to 0.8: the tests below measure it on all rigs.
const FELT: f64 = 0.75;
/// The recording tells that share if its standard deviation is at most the distance from there to 1.
const TOLD: f64 = 1.0 - FELT;

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
    let stops = all_stops(recording, values, extremes, count);
    let (at, times) = extremes
        .into_iter()
        .zip(stops.iter().map(Vec::len))
        .find(|(_, times)| *times > 0)?;
    let mut all = stops.concat();
    all.sort_unstable();
    (column != "theta" || felt(recording, &all).is_some_and(|share| share < FELT))
        .then_some(NoticeKind::ClippedSuspected { column, at, times })
}

/// First and last sample of a plateau.
type Stop = [usize; 2];

/// The dead stops at each of the extremes, where there are enough of them.
fn all_stops(
    recording: &Recording,
    values: &[f64],
    extremes: [f64; 2],
    count: f64,
) -> [Vec<Stop>; 2] {
    extremes.map(|extreme| {
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
    })
}

/// The share of the recorded jerks of the arm at these stops that the pendulum feels: 1 where the arm stopped, little
/// where only its encoder did. `None` where the recording does not tell. Within a plateau nothing is known of an arm
/// whose encoder ended.
fn felt(recording: &Recording, stops: &[Stop]) -> Option<f64> {
    // The pendulum's equation, with a coupling of its own for what happens within `lag` of a stop's ends.
    let mut law = Regression::<5>::default();
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
        let [away, near] = if near { [0.0, pull] } else { [pull, 0.0] };
        let swing = sin * cos * arm.speed * arm.speed;
        law.add(
            [sin, pendulum.speed, swing, away, near],
            pendulum.acceleration,
        );
    });
    let [.., away, near] = law.solve((2 * lag + 1) as f64)?.coefficients;
    (near.std < TOLD * away.value.abs()).then_some(near.value / away.value)
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

#[cfg(test)]
mod tests {
    use furuta_model::{Effect, Rig, State};

    use super::*;

    /// A hanging rig under a sine of 1 Hz, whose arm friction holds or whose encoder ends at a share of its swing.
    fn share(mut rig: Rig, friction: f64, clip: f64) -> Option<f64> {
        const PERIOD: f64 = 0.002;
        let volts = 0.3 * rig.params.motor.command_limit;
        let stall = rig.params.coefficients().drive * volts;
        let effect = Effect::new("arm.coulomb", &[friction * stall]).expect("valid");
        rig.effects.clear();
        rig.effects.push(effect);
        let plant = rig.plant::<f64>();
        let mut s = plant.rest(State::hanging());
        let mut samples: Vec<[f64; 4]> = Vec::new();
        for k in 0..5000 {
            let t = f64::from(k) * PERIOD;
            let u = volts * (core::f64::consts::TAU * t).sin();
            let [theta, alpha] = rig.sensors.quantised(plant.measure(&s));
            samples.push([t, u, theta, alpha]);
            plant.step(&mut s, u, PERIOD);
        }
        // The swing has settled by then.
        samples.drain(..1000);
        let range = samples
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], s| {
                [a.min(s[2]), b.max(s[2])]
            });
        let (middle, half) = (0.5 * (range[0] + range[1]), 0.5 * (range[1] - range[0]));
        for sample in &mut samples {
            sample[2] = sample[2].clamp(middle - clip * half, middle + clip * half);
        }
        let (recording, _) = Recording::from_samples("sine", samples).expect("sound");
        let extremes = [middle + clip * half, middle - clip * half];
        let count = core::f64::consts::TAU / rig.sensors.arm_counts_per_rev;
        let stops = all_stops(&recording, &recording.theta, extremes, count);
        let mut all = stops.concat();
        all.sort_unstable();
        if all.is_empty() {
            None
        } else {
            felt(&recording, &all)
        }
    }

    fn shares(friction: &[f64], clip: &[f64]) -> Vec<f64> {
        let rigs = || Rig::VOLTAGE.iter().filter_map(|name| Rig::builtin(name));
        let of = |rig: Rig| {
            let tries = friction
                .iter()
                .flat_map(|f| clip.iter().map(move |c| (*f, *c)));
            tries
                .filter_map(move |(f, c)| share(rig.clone(), f, c))
                .collect::<Vec<_>>()
        };
        rigs().flat_map(of).collect()
    }

    #[test]
    fn an_arm_that_friction_holds_stopped() {
        let all = shares(&[0.3, 0.4, 0.5, 0.6, 0.7, 0.8], &[1.0]);
        println!("{all:.3?}");
        assert!(
            all.len() >= 2 && all.iter().all(|share| *share > FELT),
            "{all:?}"
        );
    }

    #[test]
    fn an_arm_whose_encoder_ends_went_on() {
        let all = shares(&[0.0], &[0.2, 0.4, 0.6]);
        println!("{all:.3?}");
        // One that is clipped at little less than its swing hardly jerks.
        let seen = all.iter().filter(|share| **share < FELT).count();
        assert!(seen >= 6 && seen + 1 >= all.len(), "{all:?}");
    }
}
