//! Multiple shooting: predicting windows from free initial states, and what that says about states and parameters.
//!
//! The recording is cut into windows. Each has its own initial state, a nuisance that is eliminated (Schur complement), so that an
//! unstable plant can be fitted and an early error does not spoil what follows. Sensitivities are exact: the same plant is run on
//! dual numbers.
//!
//! A delay is not simulated: with a free initial state, a command that is late by `d` moves the whole response by `d`, so whole samples are
//! taken from the command's index and the rest from a cubic between two predicted samples.

use furuta_model::{Jet, Plant, PlantState, Scalar, State};
use nalgebra::{Cholesky, DMatrix, DVector, Matrix4, SMatrix, Vector4};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::data::{Data, Run, Window};
use super::hypothesis::{Hypothesis, Nominal};

/// How many past commands a lag remembers: half a second at 500 Hz and more.
const PAST: usize = 256;

/// For so long before a window the motion is followed where a drive has play, s.
const LEAD: f64 = 0.3;
/// The same where it gives way, but has no play: how it is twisted follows from the torques, but for its swinging on.
const LEAD_OF_SPRING: f64 = 0.15;

/// One predicted sample.
struct Predicted<S> {
    /// Which one.
    sample: usize,
    /// What the encoders read, `[theta, alpha]`, rad.
    y: [S; 2],
    /// Time (s) and state a sample before.
    t: f64,
    before: State<S>,
    /// Voltage at the motor, V.
    volts: f64,
}

/// Runs `plant` over a window from `x0` and hands each predicted sample to `each`. `s` may be any state of the plant.
#[inline(always)]
fn predict<S: Scalar<Real = f64>>(
    (plant, s): (&Plant<S>, &mut PlantState<S>),
    late: S,
    run: &Run,
    w: &Window,
    x0: State<S>,
    mut each: impl FnMut(Predicted<S>),
) {
    let h = run.h;
    // Whole samples; what is left lies between -0.1 and 0.9 of a sample.
    let samples = (late.value() / h + 0.1).floor().max(0.0);
    let rest = (late - S::from_f64(samples * h)).scale(1.0 / h);
    let samples = samples as usize;
    enter(plant, s, run, w.start, samples, x0);
    for k in w.start..w.start + w.len {
        let (t, start, before) = (s.t.value(), s.x, plant.seen(s));
        plant.step(s, S::from_f64(run.command(k, samples)), h);
        let now = plant.seen(s);
        let angles = [
            earlier(
                before.theta,
                before.theta_dot,
                now.theta,
                now.theta_dot,
                rest,
                h,
            ),
            earlier(
                before.alpha,
                before.alpha_dot,
                now.alpha,
                now.alpha_dot,
                rest,
                h,
            ),
        ];
        each(Predicted {
            sample: k + 1,
            y: plant.reading(angles),
            t,
            before: start,
            volts: s.voltage.value(),
        });
    }
}

/// Sets the plant to sample `start` of a run with the mechanical state `x0`, its effects remembering what was before; the commands are `late` samples
/// late.
fn enter<S: Scalar<Real = f64>>(
    plant: &Plant<S>,
    s: &mut PlantState<S>,
    run: &Run,
    start: usize,
    late: usize,
    x0: State<S>,
) {
    // How the rotor stands against the arm comes from the motion before.
    let lead = match (plant.has_drive(), plant.has_play()) {
        (true, true) => LEAD,
        (true, false) => LEAD_OF_SPRING,
        (false, _) => 0.0,
    };
    let lead = start.min((lead / run.h).ceil() as usize);
    let first = start - lead;
    let past = run.past(first, late, PAST);
    let measured = |k: usize| {
        let (y, v) = (run.y[k], run.speed[k]);
        State::new(y[0], y[1], v[0], v[1]).map(S::from_f64)
    };
    let at = if lead == 0 { x0 } else { measured(first) };
    plant.enter(s, at, run.t0 + first as f64 * run.h, &past, run.h);
    s.run = run.recording;
    for k in first..start {
        plant.step(s, S::from_f64(run.command(k, late)), run.h);
        // The body that is measured goes where it was; the other follows from the torques and blows between them.
        plant.place(s, if k + 1 < start { measured(k + 1) } else { x0 });
    }
    plant.recall(s, run.way.to(start));
}

/// Some state of the plant, to be used again and again. It is large (what the plant remembers, with its derivatives) and worker threads nest their jobs:
/// not on the stack.
#[inline(never)]
fn some<S: Scalar<Real = f64>>(plant: &Plant<S>) -> Box<PlantState<S>> {
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

/// Squared weighted residuals of one window, their gradient and Gauss-Newton matrix with respect to `N` variables.
#[derive(Clone, Debug)]
pub(crate) struct Normal<const N: usize> {
    pub(crate) cost: f64,
    pub(crate) gradient: [f64; N],
    pub(crate) matrix: [[f64; N]; N],
}

/// Linearises a window about `x0` and the plant given. The first four of the `N` variables are the initial state's.
fn normal<const N: usize>(
    plant: (&Plant<Jet<f64, N>>, &mut PlantState<Jet<f64, N>>),
    late: Jet<f64, N>,
    data: &Data,
    w: &Window,
    x0: State<f64>,
) -> Normal<N> {
    let run = &data.runs[w.run];
    let mut i = 0;
    let x0 = State::from(x0.to_array().map(|v| {
        i += 1;
        Jet::variable(v, i - 1)
    }));
    let linearised = Linearised {
        plant,
        late,
        data,
        run,
        w,
        x0,
    };
    // In the widest vectors that the processor has; the arithmetic, and so every bit, is the same in all. Builds for development spare the compiler
    // two of three versions of the whole model.
    #[cfg(not(debug_assertions))]
    let mut out = pulp::Arch::new().dispatch(linearised);
    #[cfg(debug_assertions)]
    let mut out = linearised.call();
    if !out.cost.is_finite() {
        out.cost = f64::INFINITY;
    }
    out
}

/// What [`normal`] does, for [`pulp::Arch::dispatch`].
struct Linearised<'a, const N: usize> {
    plant: (&'a Plant<Jet<f64, N>>, &'a mut PlantState<Jet<f64, N>>),
    late: Jet<f64, N>,
    data: &'a Data,
    run: &'a Run,
    w: &'a Window,
    x0: State<Jet<f64, N>>,
}

impl<const N: usize> NullaryFnOnce for Linearised<'_, N> {
    type Output = Normal<N>;

    #[inline(always)]
    fn call(self) -> Normal<N> {
        let mut out = Normal {
            cost: 0.0,
            gradient: [0.0; N],
            matrix: [[0.0; N]; N],
        };
        let (run, noise) = (self.run, self.data.noise);
        predict(self.plant, self.late, run, self.w, self.x0, |p| {
            for (c, y) in p.y.iter().enumerate() {
                let weight = run.weight[p.sample][c] / noise[c];
                let r = (y.v - run.y[p.sample][c]) * weight;
                let d = y.d.map(|d| d * weight);
                out.cost += r * r;
                for a in 0..N {
                    out.gradient[a] += d[a] * r;
                    for b in 0..N {
                        out.matrix[a][b] += d[a] * d[b];
                    }
                }
            }
        });
        out
    }
}

/// The cost of a window alone.
fn cost(plant: &Plant<f64>, late: f64, data: &Data, w: &Window, x0: State<f64>) -> f64 {
    let run = &data.runs[w.run];
    let mut cost = 0.0;
    predict((plant, &mut some(plant)), late, run, w, x0, |p| {
        for (c, y) in p.y.iter().enumerate() {
            let r = (y - run.y[p.sample][c]) * run.weight[p.sample][c] / data.noise[c];
            cost += r * r;
        }
    });
    if cost.is_finite() {
        cost
    } else {
        f64::INFINITY
    }
}

/// A plant in the two scalars that the inner problem needs. With more than four derivatives those beyond the initial state's are of the
/// parameters.
pub(crate) struct Inner<const N: usize = 4> {
    plant: Plant<Jet<f64, N>>,
    late: Jet<f64, N>,
    plain: Plant<f64>,
}

impl<const N: usize> Inner<N> {
    pub(super) fn new(h: &Hypothesis, z: &[f64], nominal: &Nominal) -> Self {
        let (plant, late) = h.plant::<N>(z, nominal, 4);
        Self::of(plant, late)
    }

    /// The same for a plant that knows its derivatives, its commands `late` (s).
    pub(crate) fn of(plant: Plant<Jet<f64, N>>, late: Jet<f64, N>) -> Self {
        let plain = plant.cast();
        Self { plant, late, plain }
    }

    /// The plant without derivatives.
    pub(crate) fn plain(&self) -> &Plant<f64> {
        &self.plain
    }

    /// A window's course from `x0`: states, how they depend on it, and what is left of the measurement.
    pub(crate) fn trace(&self, data: &Data, w: &Window, x0: State<f64>) -> Trace<N> {
        let run = &data.runs[w.run];
        let mut i = 0;
        let x0 = State::from(x0.to_array().map(|v| {
            i += 1;
            Jet::variable(v, i - 1)
        }));
        let mut s = some(&self.plant);
        let mut steps = Vec::with_capacity(w.len);
        predict((&self.plant, &mut s), self.late, run, w, x0, |p| {
            let rows = p.before.to_array().map(|v| v.d);
            let weight: [f64; 2] = std::array::from_fn(|c| run.weight[p.sample][c] / data.noise[c]);
            steps.push(Traced {
                t: p.t,
                x: p.before.map(|v| v.v),
                transition: Matrix4::from_fn(|r, c| rows[r][c]),
                y: p.y,
                weight,
                left: std::array::from_fn(|c| run.y[p.sample][c] - p.y[c].v),
                volts: p.volts,
            });
        });
        Trace { steps }
    }

    /// The predictions of a window from `x0`.
    pub(crate) fn predictions(&self, data: &Data, w: &Window, x0: State<f64>) -> Vec<[f64; 2]> {
        let mut out = Vec::with_capacity(w.len);
        predict(
            (&self.plain, &mut some(&self.plain)),
            self.late.v,
            &data.runs[w.run],
            w,
            x0,
            |p| out.push(p.y),
        );
        out
    }
}

impl Inner {
    /// Improves the initial state by damped Gauss-Newton steps, at most `iterations`; returns state and cost.
    pub(crate) fn solve(
        &self,
        data: &Data,
        w: &Window,
        x0: State<f64>,
        iterations: usize,
    ) -> (State<f64>, f64) {
        let (mut x, mut damping) = (x0, 1e-6);
        let mut s = some(&self.plant);
        let mut n = normal((&self.plant, &mut s), self.late, data, w, x);
        for left in (0..iterations).rev() {
            let Some(step) = damped_step(&n, damping) else {
                break;
            };
            let promised = step.dot(&Vector4::from(n.gradient));
            if promised < 0.01 + 1e-3 * n.cost {
                break;
            }
            let trial = State::from(std::array::from_fn(|i| x.to_array()[i] - step[i]));
            if left == 0 {
                // Nobody needs the derivatives there.
                let c = cost(&self.plain, self.late.v, data, w, trial);
                return if c < n.cost { (trial, c) } else { (x, n.cost) };
            }
            let next = normal((&self.plant, &mut s), self.late, data, w, trial);
            if next.cost < n.cost {
                x = trial;
                n = next;
                damping = (damping * 0.1_f64).max(1e-9);
            } else {
                damping = (damping * 100.0).max(1e-4);
                if damping > 1e6 {
                    break;
                }
            }
        }
        (x, n.cost)
    }

    /// The state at the end of a window.
    pub(crate) fn end(&self, data: &Data, w: &Window, x0: State<f64>) -> State<f64> {
        let run = &data.runs[w.run];
        let late = (self.late.v / run.h + 0.1).floor().max(0.0) as usize;
        let mut s = some(&self.plain);
        enter(&self.plain, &mut s, run, w.start, late, x0);
        for k in w.start..w.start + w.len {
            self.plain.step(&mut s, run.command(k, late), run.h);
        }
        self.plain.seen(&s)
    }

    /// The best of several starts: what smoothing over several widths says, and the state given.
    pub(crate) fn search(
        &self,
        data: &Data,
        w: &Window,
        known: Option<State<f64>>,
    ) -> (State<f64>, f64) {
        let mut best = known.map(|x| self.solve(data, w, x, 10));
        for half in [10, 5, 20] {
            let guess = data.guess(w, half);
            let start = (guess, cost(&self.plain, self.late.v, data, w, guess));
            if best.as_ref().is_none_or(|b| start.1 < 4.0 * b.1) {
                let found = self.solve(data, w, guess, 10);
                if best.as_ref().is_none_or(|b| found.1 < b.1) {
                    best = Some(found);
                }
            }
        }
        best.unwrap_or((data.guess(w, 10), f64::INFINITY))
    }
}

/// A window's course.
pub(crate) struct Trace<const N: usize> {
    pub(crate) steps: Vec<Traced<N>>,
}

/// One step of it.
pub(crate) struct Traced<const N: usize> {
    /// Time at its start, s.
    pub(crate) t: f64,
    /// State at its start.
    pub(crate) x: State<f64>,
    /// That state's slope with respect to the window's initial state.
    pub(crate) transition: Matrix4<f64>,
    /// The two angles after the step, with all slopes.
    pub(crate) y: [Jet<f64, N>; 2],
    /// Roots of their weights over the noise.
    pub(crate) weight: [f64; 2],
    /// Measured less predicted angles after the step, rad.
    pub(crate) left: [f64; 2],
    /// Voltage at the motor at the step's end, V.
    pub(crate) volts: f64,
}

fn damped_step(n: &Normal<4>, damping: f64) -> Option<Vector4<f64>> {
    let mut m = Matrix4::from_fn(|a, b| n.matrix[a][b]);
    for i in 0..4 {
        m[(i, i)] += damping * m[(i, i)] + 1e-9;
    }
    Cholesky::new(m).map(|c| c.solve(&Vector4::from(n.gradient)))
}

/// Gradient and Gauss-Newton matrix over all windows with the initial states eliminated.
pub(crate) struct Reduced {
    pub(crate) gradient: DVector<f64>,
    pub(crate) matrix: DMatrix<f64>,
    /// Per window: the initial state's step for a step of the parameters, `x -= response * step + own`.
    pub(crate) response: Vec<(SMatrix<f64, 4, { MAX_FREE }>, Vector4<f64>)>,
    /// Per window: the reduced gradient, for statistics that do not trust the noise to be white.
    pub(crate) scores: Vec<DVector<f64>>,
}

/// The longest parameter vector.
pub(crate) const MAX_FREE: usize = 20;

/// Linearises all windows in the parameters; `z` may have up to [`MAX_FREE`] components.
pub(super) fn reduced(
    h: &Hypothesis,
    z: &[f64],
    nominal: &Nominal,
    data: &Data,
    windows: &[Window],
    states: &[State<f64>],
) -> Reduced {
    match z.len() {
        0..=8 => reduced_n::<12>(h, z, nominal, data, windows, states),
        9..=12 => reduced_n::<16>(h, z, nominal, data, windows, states),
        _ => reduced_n::<24>(h, z, nominal, data, windows, states),
    }
}

fn reduced_n<const N: usize>(
    h: &Hypothesis,
    z: &[f64],
    nominal: &Nominal,
    data: &Data,
    windows: &[Window],
    states: &[State<f64>],
) -> Reduced {
    let (plant, late) = h.plant::<N>(z, nominal, 4);
    eliminated((&plant, late), z.len(), data, windows, states)
}

/// Linearises all windows in the `p` parameters that are the independent variables of `plant` after the first four.
pub(crate) fn eliminated<const N: usize>(
    (plant, late): (&Plant<Jet<f64, N>>, Jet<f64, N>),
    p: usize,
    data: &Data,
    windows: &[Window],
    states: &[State<f64>],
) -> Reduced {
    let mut out = Reduced {
        gradient: DVector::zeros(p),
        matrix: DMatrix::zeros(p, p),
        response: Vec::with_capacity(windows.len()),
        scores: Vec::with_capacity(windows.len()),
    };
    // In parallel, and added up in order: the same digits whatever the number of threads.
    let normals: Vec<Normal<N>> = windows
        .par_iter()
        .zip(states)
        .map_init(
            || some(plant),
            |s, (w, x)| normal((plant, s), late, data, w, *x),
        )
        .collect();
    for n in &normals {
        let mut own = Matrix4::from_fn(|a, b| n.matrix[a][b]);
        for i in 0..4 {
            own[(i, i)] += 1e-9 + 1e-9 * own[(i, i)];
        }
        let cross =
            SMatrix::<f64, 4, MAX_FREE>::from_fn(
                |a, b| {
                    if b < p { n.matrix[a][4 + b] } else { 0.0 }
                },
            );
        let gx = Vector4::from_fn(|a, _| n.gradient[a]);
        let Some(own) = own.cholesky().filter(|_| n.cost.is_finite()) else {
            out.response.push((SMatrix::zeros(), Vector4::zeros()));
            out.scores.push(DVector::zeros(p));
            continue;
        };
        let (response, step) = (own.solve(&cross), own.solve(&gx));
        let mut score = DVector::zeros(p);
        for a in 0..p {
            score[a] = n.gradient[4 + a] - cross.column(a).dot(&step);
            for b in 0..p {
                out.matrix[(a, b)] +=
                    n.matrix[4 + a][4 + b] - cross.column(a).dot(&response.column(b));
            }
        }
        out.gradient += &score;
        out.response.push((response, step));
        out.scores.push(score);
    }
    out
}
