//! Whether an angle was made from counts with the wrong number of counts per turn.
//!
//! An angle that is off by a factor is no motion of the rig. What shows the factor, whatever the data sheet says of
//! lengths and masses, is the shape of
//! large swings: gravity goes with the sine of the true angle. Small swings show only how far the arm moves the
//! pendulum, which is the ratio of both
//! angles' factors times a length that a sheet may have wrong by some per cent: there only a gross factor is spoken of.

use core::f64::consts::{PI, TAU};

use furuta_model::{Effect, Rig};

use super::regression::{Estimate, Solution};
use super::weak::CORRELATED;
use super::weak::pendulum::{self, CENTRIFUGAL, COUPLING, GRAVITY, PLAIN, SMALL, TOGETHER};
use super::{NoticeKind, Recording};

/// Counts per turn of usual encoders, quadrature included or forgotten.
const USUAL: [f64; 11] = [
    500.0, 512.0, 1000.0, 1024.0, 2000.0, 2048.0, 2500.0, 4000.0, 4096.0, 8192.0, 16384.0,
];
/// Counting one or two edges of four, or four for one.
const QUADRATURE: [f64; 4] = [0.25, 0.5, 2.0, 4.0];
/// Factors beyond this are no encoder's.
const MOST: f64 = 10.0;
/// Share of the squares left by the angle as it is that another scale must leave at most.
const BETTER: f64 = 0.5;
/// Share of the motion that the pendulum's equation leaves at most with the scale that is named.
const EXPLAINED: f64 = 0.02;
/// Independent samples that a judgement needs.
const SAMPLES: f64 = 40.0;
/// The scale that fits best lies as near as this to one that is named.
const NEAR: f64 = 0.003;
/// The smallest step of an angle tells its counts within this.
const LATTICE: f64 = 1e-3;
/// By so much (chi squared) the best scale may explain more than one that is named.
const WITHIN: f64 = 12.0;
/// A data sheet may be wrong by this factor about how far the arm moves the pendulum.
const SHEET: f64 = 1.6;
/// A data sheet may be wrong by this factor about the pendulum's weight over its inertia, which large swings show
/// within this share.
const WEIGHT: f64 = 2.0;
const SHOWN: f64 = 0.25;
/// A factor between the angles is taken for a usual ratio within this.
const RATIO: f64 = 0.1;
/// Gravity as the sheet has it within this factor: the regression tells the coupling from it.
const GRAVITY_KNOWN: f64 = 1.3;
/// Standard deviations that tell the arm's encoder from the pendulum's.
const APART: f64 = 4.0;

/// Counts per turn with which an angle was made, and those that its encoder may have instead.
struct Counts {
    in_rig_file: f64,
    /// As the smallest step of the angle tells; the rig file's where it tells nothing.
    taken: f64,
    known: bool,
}

impl Counts {
    fn of(values: &[f64], in_rig_file: f64) -> Self {
        let step = values
            .iter()
            .zip(values.iter().skip(1))
            .map(|(a, b)| (b - a).abs())
            .filter(|step| *step > 1e-9)
            .fold(f64::INFINITY, f64::min);
        let told = USUAL
            .into_iter()
            .chain([in_rig_file])
            .find(|n| (TAU / step / n - 1.0).abs() < LATTICE);
        Self {
            in_rig_file,
            taken: told.unwrap_or(in_rig_file),
            known: told.is_some(),
        }
    }

    /// The encoder's counts over those taken, quadrature first.
    fn scales(&self) -> Vec<f64> {
        let (rig, taken, known) = (self.in_rig_file, self.taken, self.known);
        let others = USUAL.into_iter().chain([rig]).map(move |n| n / taken);
        // Angles without steps may have been made with any usual counts from an encoder that is the rig file's.
        let unknown = USUAL.into_iter().filter(move |_| !known);
        let mut scales = Vec::new();
        for scale in QUADRATURE
            .into_iter()
            .chain(others)
            .chain(unknown.map(move |n| rig / n))
        {
            let known = |f: &f64| (f / scale - 1.0).abs() < 1e-9;
            let is_new = !scales.iter().chain(&[1.0]).any(known);
            if is_new && (1.0 / MOST..MOST).contains(&scale) {
                scales.push(scale);
            }
        }
        scales
    }

    /// Names a scale.
    fn suspected(&self, column: &'static str, scale: f64, zero: f64) -> NoticeKind {
        let (encoder, taken) = self.pair(scale);
        NoticeKind::CountsSuspected {
            column,
            encoder,
            taken,
            in_rig_file: self.in_rig_file,
            zero,
        }
    }

    /// The encoder's counts and those taken.
    fn pair(&self, scale: f64) -> (f64, f64) {
        let encoder = self.taken * scale;
        let whole = (encoder - encoder.round()).abs() < 1e-6;
        if whole {
            (encoder.round(), self.taken)
        } else {
            (self.in_rig_file, (self.in_rig_file / scale).round())
        }
    }
}

/// Suspects the counts per turn of either encoder.
pub(super) fn counts(recording: &Recording, rig: &Rig) -> Option<NoticeKind> {
    let scaled =
        |e: &Effect<f64>| matches!(e, Effect::SensorAlphaScale(_) | Effect::SensorThetaScale(_));
    if rig.effects.iter().any(scaled) {
        return None; // the rig file knows of it
    }
    shape(recording, rig).or_else(|| coupling(recording, rig))
}

/// What one scale of alpha, counted from one zero, leaves.
struct Tried {
    scale: f64,
    zero: f64,
    solution: Solution<{ TOGETHER.len() }>,
}

/// The scale of alpha as large swings show it.
fn shape(recording: &Recording, rig: &Rig) -> Option<NoticeKind> {
    let c = rig.params.coefficients();
    let first = recording.alpha.first().copied()?;
    let hanging = PI + ((first - PI) / TAU).round() * TAU;
    let upright = (first / TAU).round() * TAU;
    let attempt = |scale: f64, zero: f64| {
        let regression = pendulum::regression(recording, scale, zero).only(TOGETHER);
        (regression.freedom(CORRELATED) > SAMPLES).then_some(())?;
        let solution = regression.solve(CORRELATED)?;
        Some((
            Tried {
                scale,
                zero,
                solution,
            },
            regression.freedom(CORRELATED),
        ))
    };
    let (as_it_is, freedom) = attempt(1.0, hanging)?;
    // Counted from the other zero, gravity turns round; where the swings are small it takes any value.
    let physical = |t: &Tried| {
        let [gravity, coupling] = [GRAVITY, COUPLING].map(|i| t.solution.coefficients[i]);
        let weight = gravity.value / t.scale * c.pendulum / c.weight;
        let pull = coupling.value / t.scale * c.pendulum / c.coupling;
        (1.0 / WEIGHT..WEIGHT).contains(&weight)
            && gravity.std < SHOWN * gravity.value
            && (1.0 / SHEET..SHEET).contains(&pull)
    };
    let mut best: Option<Tried> = None;
    let counts = Counts::of(&recording.alpha, rig.sensors.pendulum_counts_per_rev);
    for scale in counts.scales() {
        for zero in [hanging, upright] {
            let Some((tried, _)) = attempt(scale, zero) else {
                continue;
            };
            let beats = |b: &Tried| {
                tried.solution.left < b.solution.left * (1.0 - WITHIN / freedom).max(0.0)
            };
            if physical(&tried) && best.as_ref().is_none_or(beats) {
                best = Some(tried);
            }
        }
    }
    let best = best?;
    if best.solution.left > EXPLAINED || best.solution.left > BETTER * as_it_is.solution.left {
        return None;
    }
    // The scale that fits best of all must be this one: an encoder that is off by another factor is for the search.
    let left = |scale: f64| {
        attempt(scale, best.zero).map_or(f64::INFINITY, |(tried, _)| tried.solution.left)
    };
    let nearest = [-1.0, -0.5, 0.5, 1.0]
        .map(|step| left(best.scale * (1.0 + step * NEAR)))
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    if best.solution.left > nearest * (1.0 + WITHIN / freedom) {
        return None;
    }
    Some(counts.suspected("alpha", best.scale, best.zero))
}

/// A gross factor between the angles, as small swings show it.
fn coupling(recording: &Recording, rig: &Rig) -> Option<NoticeKind> {
    let c = rig.params.coefficients();
    let regression = pendulum::regression(recording, 1.0, PI);
    let known = |gravity: Estimate| {
        let ratio = gravity.value * c.pendulum / c.weight;
        (1.0 / GRAVITY_KNOWN..GRAVITY_KNOWN).contains(&ratio)
    };
    let plain = regression
        .only(PLAIN)
        .solve(CORRELATED)
        .map(|s| (s.coefficients[0], s.coefficients[1], s.left));
    let small = regression
        .only(SMALL)
        .solve(CORRELATED)
        .map(|s| (s.coefficients[0], s.coefficients[1], s.left));
    let (_, coupling, left) = plain
        .filter(|s| known(s.0))
        .or(small.filter(|s| known(s.0)))?;
    let ratio = coupling.value * c.pendulum / c.coupling;
    let gross = ratio > SHEET || (0.0..1.0 / SHEET).contains(&ratio);
    let sure = coupling.std < 0.05 * coupling.value
        && left < 2.0 * EXPLAINED
        && regression.freedom(CORRELATED) > SAMPLES;
    if !(gross && sure) {
        return None;
    }
    let [arm, pendulum] = [
        Counts::of(&recording.theta, rig.sensors.arm_counts_per_rev),
        Counts::of(&recording.alpha, rig.sensors.pendulum_counts_per_rev),
    ];
    let nearest = |counts: &Counts, ratio: f64| {
        let off = |f: &f64| (f / ratio).ln().abs();
        counts
            .scales()
            .into_iter()
            .filter(|f| off(f) < RATIO)
            .min_by(|a, b| off(a).total_cmp(&off(b)))
    };
    let (of_arm, of_pendulum) = (nearest(&arm, ratio.recip()), nearest(&pendulum, ratio));
    // The arm's speed squared throws the pendulum outwards: that goes with the square of theta's scale, and with no
    // length.
    let centrifugal = regression.only(PLAIN).solve(CORRELATED).map(|solution| {
        let e = solution.coefficients[CENTRIFUGAL];
        [e.value, e.std].map(|v| v * c.pendulum / c.swing)
    });
    let fits = |expected: f64| {
        centrifugal
            .is_none_or(|[value, std]| (value - expected).abs() < APART * std + RATIO * expected)
    };
    let of_arm = of_arm.filter(|_| fits(ratio * ratio));
    let of_pendulum = of_pendulum.filter(|_| fits(ratio));
    match (of_arm, of_pendulum) {
        (Some(scale), None) => Some(arm.suspected("theta", scale, 0.0)),
        (None, Some(scale)) => Some(pendulum.suspected("alpha", scale, PI)),
        (Some(of_arm), Some(of_pendulum)) => Some(NoticeKind::EitherCountsSuspected {
            ratio,
            arm: arm.pair(of_arm),
            pendulum: pendulum.pair(of_pendulum),
        }),
        (None, None) => None,
    }
}
