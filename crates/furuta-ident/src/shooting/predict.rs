//! Predicting the samples of a window from the state at its start.
//!
//! A delay is not simulated: with a free initial state, a command that is late by `d` moves the whole response by `d`,
//! so whole samples are taken from the command's index and the rest from a cubic between two predicted samples. The
//! plant's clock goes as the rig's, so that a moment is the same beside a delay.
//!
//! States are counted from the zeros of the recording's encoders; the plant sees the true angles.

use furuta_model::{Plant, PlantState, Scalar, State, Twist};

use super::data::{Run, Window};
use super::model::Observed;
use super::start::{Before, Rotor, Start};

/// How many past commands a lag remembers: half a second at 500 Hz and more.
const PAST: usize = 256;
/// For this time before a window the motion is simulated where a drive gives way, s: from how the window before says
/// that it stood, or from what is measured there.
const LEAD: f64 = 0.15;

/// After this many time constants nothing is left of what an inner state remembered.
const FORGOTTEN: f64 = 8.0;

/// One predicted sample.
pub(super) struct Predicted<S> {
    /// Which one.
    pub(super) sample: usize,
    /// What the encoders read, `[theta, alpha]`, rad.
    pub(super) y: [S; 2],
    /// Time (s) and true state a sample before.
    pub(super) t: f64,
    pub(super) before: State<S>,
    /// Voltage at the motor, V.
    pub(super) volts: f64,
}

/// What is done with each predicted sample: a closure, or a type where the compiler must be told to inline.
pub(super) trait Each<S> {
    /// Called for one sample after the other.
    fn see(&mut self, p: Predicted<S>);
}

impl<S, F: FnMut(Predicted<S>)> Each<S> for F {
    #[inline(always)]
    fn see(&mut self, p: Predicted<S>) {
        self(p);
    }
}

/// The state with its angles counted from elsewhere: `by` is added to `[theta, alpha]`.
#[inline(always)]
fn shifted<S: Scalar>(x: State<S>, by: [S; 2]) -> State<S> {
    State::new(x.theta + by[0], x.alpha + by[1], x.theta_dot, x.alpha_dot)
}

/// Runs the plant over a window from its start and lets `each` see each predicted sample. `s` may be any state of the
/// plant.
#[inline(always)]
pub(super) fn predict<S: Scalar<Real = f64>>(
    seen: &Observed<S>,
    s: &mut PlantState<S>,
    run: &Run,
    w: &Window,
    from: &Start<S>,
    each: &mut impl Each<S>,
) {
    if run.is_uneven() {
        predict_uneven(seen, s, run, w, from, each);
        return;
    }
    let (plant, late, h) = (
        seen.plant_in(run.recording),
        seen.late_in(run.recording).total(),
        run.h,
    );
    let zero = seen.zero(run.recording);
    // Whole samples; what is left lies between -0.1 and 0.9 of a sample.
    let samples = (late.value() / h + 0.1).floor().max(0.0);
    let rest = (late - S::from_f64(samples * h)).scale(1.0 / h);
    let samples = samples as usize;
    // One loop for what leads in and the window: the step is compiled into it.
    let first = begin(seen, s, run, w.start, samples, from);
    for k in first..w.start + w.len {
        if k == w.start {
            arrive(seen, s, run, (first, k), from.x);
        }
        let (t, start, before) = (s.t.value(), s.x, plant.seen(s));
        plant.step(s, S::from_f64(run.command(k, samples)), h);
        if k < w.start {
            continue;
        }
        let now = plant.seen(s);
        let theta = earlier(
            before.theta,
            before.theta_dot,
            now.theta,
            now.theta_dot,
            rest,
            h,
        );
        let alpha = earlier(
            before.alpha,
            before.alpha_dot,
            now.alpha,
            now.alpha_dot,
            rest,
            h,
        );
        each.see(Predicted {
            sample: k + 1,
            y: plant.reading_from([theta, alpha], zero, moment(run, k + 1)),
            t,
            before: start,
            volts: s.voltage.value(),
        });
    }
}

/// When a sample is read: the recording, and the time in it, s.
#[inline(always)]
fn moment<S: Scalar<Real = f64>>(run: &Run, sample: usize) -> (usize, S) {
    (run.recording, S::from_f64(run.time(sample)))
}

/// [`predict`] for samples that are not evenly spaced: the plant is driven by the commands at the times of the samples,
/// from the last sample before the window's start as the delay sees it, and read off where each sample falls, the delay
/// before it.
fn predict_uneven<S: Scalar<Real = f64>>(
    seen: &Observed<S>,
    s: &mut PlantState<S>,
    run: &Run,
    w: &Window,
    from: &Start<S>,
    each: &mut impl Each<S>,
) {
    let (plant, late) = (
        seen.plant_in(run.recording),
        seen.late_in(run.recording).total(),
    );
    let zero = seen.zero(run.recording);
    let (mut next, last) = (w.start + 1, w.start + w.len);
    let mut k = first_sample(run, w.start, late.value());
    enter(seen, s, run, k, 0, from);
    while next <= last && k < last {
        let h = run.interval(k);
        let (t, start, before) = (s.t.value(), s.x, plant.seen(s));
        step(plant, s, S::from_f64(run.u[k]), h);
        let now = plant.seen(s);
        k += 1;
        while next <= last && (k == last || run.time(next) - late.value() <= run.time(k)) {
            let back = (S::from_f64(run.time(k) - run.time(next)) + late).scale(1.0 / h);
            let [theta, alpha] = [
                (before.theta, before.theta_dot, now.theta, now.theta_dot),
                (before.alpha, before.alpha_dot, now.alpha, now.alpha_dot),
            ]
            .map(|(y0, v0, y1, v1)| earlier(y0, v0, y1, v1, back, h));
            each.see(Predicted {
                sample: next,
                y: plant.reading_from([theta, alpha], zero, moment(run, next)),
                t,
                before: start,
                volts: s.voltage.value(),
            });
            next += 1;
        }
    }
}

/// The longest step of the integrator where the samples' intervals differ, s: they may be longer than a rate that suits
/// the rig.
const LONGEST: f64 = 0.01;

/// One interval between samples under a held command.
fn step<S: Scalar<Real = f64>>(plant: &Plant<S>, s: &mut PlantState<S>, u: S, h: f64) {
    let parts = (h / LONGEST).ceil().max(1.0);
    for _ in 0..parts as usize {
        advance(plant, s, u, h / parts);
    }
}

/// [`Plant::step`] as a call, for where few steps are made: it is a lot of code for the compiler.
#[inline(never)]
fn advance<S: Scalar<Real = f64>>(plant: &Plant<S>, s: &mut PlantState<S>, u: S, h: f64) {
    plant.step(s, u, h);
}

/// Where a window that starts at sample `start` is entered, of samples that are not evenly spaced: what is read there
/// has happened `late` (s) before.
fn first_sample(run: &Run, start: usize, late: f64) -> usize {
    run.sample_at(run.time(start) - late).min(start)
}

/// The plant at sample `at`, from the start of a window.
fn run_to(
    seen: &Observed<f64>,
    run: &Run,
    w: &Window,
    from: &Start,
    at: usize,
) -> Box<PlantState<f64>> {
    let plant = seen.plant_in(run.recording);
    let mut s = some(plant);
    if run.is_uneven() {
        let late = seen.late_in(run.recording).total();
        let [first, end] = [w.start, at].map(|k| first_sample(run, k, late));
        enter(seen, &mut s, run, first, 0, from);
        for k in first..end {
            step(plant, &mut s, run.u[k], run.interval(k));
        }
        return s;
    }
    let late = (seen.late_in(run.recording).total() / run.h + 0.1)
        .floor()
        .max(0.0) as usize;
    enter(seen, &mut s, run, w.start, late, from);
    for k in w.start..at {
        advance(plant, &mut s, run.command(k, late), run.h);
    }
    s
}

/// The state at the end of a window.
pub(super) fn end(seen: &Observed<f64>, run: &Run, w: &Window, from: &Start) -> State<f64> {
    let s = run_to(seen, run, w, from, w.start + w.len);
    measured(seen, run, &s)
}

/// The state as the recording's encoders count it.
fn measured(seen: &Observed<f64>, run: &Run, s: &PlantState<f64>) -> State<f64> {
    let plant = seen.plant_in(run.recording);
    shifted(plant.seen(s), seen.zero(run.recording).map(|z| -z))
}

/// What the window before says about the time before this one's start.
pub(super) fn before(
    seen: &Observed<f64>,
    run: &Run,
    (w, from): (&Window, &Start),
    next: &Window,
) -> Rotor {
    let plant = seen.plant_in(run.recording);
    let first = next.start - lead(plant, run, next.start);
    let s = run_to(seen, run, w, from, first);
    Rotor::Follows(Before {
        sample: first,
        x: measured(seen, run, &s),
        twist: plant.twist(&s),
    })
}

/// A rotor that rested, turned against the arm by `angle` (rad), where a window is led in from.
pub(super) fn resting(seen: &Observed<f64>, run: &Run, w: &Window, angle: f64) -> Rotor {
    let first = w.start - lead(seen.plant_in(run.recording), run, w.start);
    let x = run.seen(first);
    let twist = Twist {
        angle,
        speed: -x.theta_dot,
    };
    Rotor::Follows(Before {
        sample: first,
        x,
        twist,
    })
}

/// By how many samples a window is led in.
fn lead<S: Scalar<Real = f64>>(plant: &Plant<S>, run: &Run, start: usize) -> usize {
    let seconds = if plant.has_drive() { LEAD } else { 0.0 };
    start.min((seconds / run.h).ceil() as usize)
}

/// Sets the plant to sample `start` of a run as a window starts there, its effects remembering what was before; the
/// commands are `late` samples late.
fn enter<S: Scalar<Real = f64>>(
    seen: &Observed<S>,
    s: &mut PlantState<S>,
    run: &Run,
    start: usize,
    late: usize,
    from: &Start<S>,
) {
    let first = begin(seen, s, run, start, late, from);
    let plant = seen.plant_in(run.recording);
    for k in first..start {
        advance(plant, s, S::from_f64(run.command(k, late)), run.h);
    }
    arrive(seen, s, run, (first, start), from.x);
}

/// Sets the plant to the sample from which the entry at `start` is led in, which is returned; it may be `start` itself.
#[inline(never)]
fn begin<S: Scalar<Real = f64>>(
    seen: &Observed<S>,
    s: &mut PlantState<S>,
    run: &Run,
    start: usize,
    late: usize,
    from: &Start<S>,
) -> usize {
    let plant = seen.plant_in(run.recording);
    let zero = seen.zero(run.recording);
    // How the rotor stands against the arm comes from the motion before.
    let first = start - lead(plant, run, start);
    let before = match from.rotor {
        Rotor::Follows(before) if before.sample == first => Some(before),
        _ => None,
    };
    let x = if first == start {
        from.x
    } else {
        before
            .map_or_else(|| run.seen(first), |b| b.x)
            .map(S::from_f64)
    };
    let at = shifted(x, zero);
    let past = run.past(first, late, PAST);
    plant.enter(s, at, run.time(first), &past, run.h);
    s.t += seen.late_in(run.recording).clock(late as f64 * run.h);
    remember(plant, s, run, first, late, zero);
    s.run = run.recording;
    if let Some(before) = before {
        plant.set_twist(s, before.twist);
        plant.place(s, at);
    }
    first
}

/// Sets a plant that was led in from `first` to the mechanical state `x0` at `start`.
#[inline(never)]
fn arrive<S: Scalar<Real = f64>>(
    seen: &Observed<S>,
    s: &mut PlantState<S>,
    run: &Run,
    (first, start): (usize, usize),
    x0: State<S>,
) {
    let plant = seen.plant_in(run.recording);
    if first < start {
        // How the two bodies stand and turn against each other stays.
        plant.place(s, shifted(x0, seen.zero(run.recording)));
    }
    plant.recall(s, run.reversals.to(start));
}

/// Lets what inner states remember follow the motion before a sample, as it was measured: so much of it that what was
/// before is forgotten.
fn remember<S: Scalar<Real = f64>>(
    plant: &Plant<S>,
    s: &mut PlantState<S>,
    run: &Run,
    to: usize,
    late: usize,
    zero: [S; 2],
) {
    let between = |k: usize| {
        let mean = |a: [f64; 2], b: [f64; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        let angles = mean(run.y[k], run.y[k + 1]);
        let speeds = mean(run.speed[k], run.speed[k + 1]);
        let x = State::new(angles[0], angles[1], speeds[0], speeds[1]);
        shifted(x.map(S::from_f64), zero)
    };
    let (mut from, mut left) = (to, FORGOTTEN);
    while from > 0 && left > 0.0 {
        let k = from - 1;
        let Some(rate) = plant.forgetting(run.time(k), &between(k), run.command(k, late)) else {
            return;
        };
        left -= rate * run.h;
        from = k;
    }
    let past = (from..to).map(|k| (between(k), run.command(k, late)));
    plant.remember(s, past, run.h);
}

/// Some state of the plant, to be used again and again. It is large (what the plant remembers, with its derivatives)
/// and worker threads nest their jobs: not on the stack.
#[inline(never)]
pub(super) fn some<S: Scalar<Real = f64>>(plant: &Plant<S>) -> Box<PlantState<S>> {
    Box::new(plant.rest(State::hanging()))
}

/// The cubic through two samples and their slopes, `e` of a sample before the second.
#[inline(always)]
fn earlier<S: Scalar<Real = f64>>(y0: S, v0: S, y1: S, v1: S, e: S, h: f64) -> S {
    let (p0, p1, fall) = (v0.scale(h), v1.scale(h), y0 - y1);
    let square = fall.scale(3.0) + p1.scale(2.0) + p0;
    let cube = -p1 - p0 - fall.scale(2.0);
    y1 + e * (e * (e * cube + square) - p1)
}
