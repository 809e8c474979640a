//! One window: its initial state, a nuisance that is solved for, and how its predictions depend on that state and on
//! the parameters.

use furuta_model::vectors::{Vectorised, in_vectors};
use furuta_model::{Jet, PlantState, State};
use nalgebra::{Cholesky, Matrix4, Vector4};

use super::data::{Data, Run, Window};
use super::model::{Model, Observed};
use super::predict::{self, Before, Each, Predicted, predict, some};
use crate::least_squares::{LeastSquares, Rules, minimise};

/// Squared weighted residuals of one window, their gradient and Gauss-Newton matrix with respect to `N` variables.
#[derive(Clone, Debug)]
pub(super) struct WindowNormal<const N: usize> {
    pub(super) cost: f64,
    pub(super) gradient: [f64; N],
    pub(super) matrix: [[f64; N]; N],
    /// The gradient's parts, block by block, where they were asked for.
    pub(super) blocks: Vec<[f64; N]>,
}

/// What is known of a window's start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Start {
    /// The state, which is free.
    pub(crate) x: State<f64>,
    /// How a rig with a drive stood some time before.
    pub(crate) before: Option<Before>,
}

impl Start {
    fn known(&self) -> (State<f64>, Option<&Before>) {
        (self.x, self.before.as_ref())
    }
}

/// The state as the first four independent variables.
fn variable<const N: usize>(x: State<f64>) -> State<Jet<f64, N>> {
    let values = x.to_array();
    State::from(std::array::from_fn(|i| Jet::variable(values[i], i)))
}

/// Linearises a window about `x0` and the plant given. The first four of the `N` variables are the initial state's. The
/// gradient is kept in blocks of `block` samples as well, if there are any.
pub(super) fn normal<const N: usize>(
    seen: &Observed<Jet<f64, N>>,
    s: &mut PlantState<Jet<f64, N>>,
    data: &Data,
    w: &Window,
    start: &Start,
    block: Option<usize>,
) -> WindowNormal<N> {
    let linearised = Linearised {
        seen,
        s,
        data,
        run: &data.runs[w.run],
        w,
        x0: variable(start.x),
        before: start.before.as_ref(),
        block,
    };
    let mut out = in_vectors::<Jet<f64, N>, _>(linearised);
    if !out.cost.is_finite() {
        out.cost = f64::INFINITY;
    }
    out
}

/// What [`normal`] does, for [`in_vectors`].
struct Linearised<'a, const N: usize> {
    seen: &'a Observed<Jet<f64, N>>,
    s: &'a mut PlantState<Jet<f64, N>>,
    data: &'a Data,
    run: &'a Run,
    w: &'a Window,
    x0: State<Jet<f64, N>>,
    before: Option<&'a Before>,
    block: Option<usize>,
}

impl<const N: usize> Vectorised for Linearised<'_, N> {
    type Output = WindowNormal<N>;

    #[inline(always)]
    fn call(self) -> WindowNormal<N> {
        let mut sums = Sums {
            run: self.run,
            noise: self.data.noise,
            normal: WindowNormal {
                cost: 0.0,
                gradient: [0.0; N],
                matrix: [[0.0; N]; N],
                blocks: Vec::new(),
            },
            block: self.block,
            samples: 0,
        };
        let from = (self.x0, self.before);
        predict(self.seen, self.s, self.run, self.w, from, &mut sums);
        sums.total()
    }
}

/// The sums over the samples of a window.
struct Sums<'a, const N: usize> {
    run: &'a Run,
    noise: [f64; 2],
    /// Its gradient is that of the block that is being added up.
    normal: WindowNormal<N>,
    /// Samples of a block; `None`: the window is one.
    block: Option<usize>,
    /// How many of them have been seen.
    samples: usize,
}

impl<const N: usize> Each<Jet<f64, N>> for Sums<'_, N> {
    #[inline(always)]
    fn see(&mut self, p: Predicted<Jet<f64, N>>) {
        let out = &mut self.normal;
        for (c, y) in p.y.iter().enumerate() {
            let weight = self.run.weight[p.sample][c] / self.noise[c];
            let r = (y.v - self.run.y[p.sample][c]) * weight;
            let mut d = y.d;
            for d in &mut d {
                *d *= weight;
            }
            out.cost += r * r;
            for a in 0..N {
                out.gradient[a] += d[a] * r;
                for b in 0..N {
                    out.matrix[a][b] += d[a] * d[b];
                }
            }
        }
        self.samples += 1;
        if Some(self.samples) == self.block {
            self.end_block();
        }
    }
}

impl<const N: usize> Sums<'_, N> {
    fn end_block(&mut self) {
        let gradient = std::mem::replace(&mut self.normal.gradient, [0.0; N]);
        self.normal.blocks.push(gradient);
        self.samples = 0;
    }

    fn total(mut self) -> WindowNormal<N> {
        if self.block.is_some() {
            if self.samples > 0 {
                self.end_block();
            }
            for block in &self.normal.blocks {
                for (sum, part) in self.normal.gradient.iter_mut().zip(block) {
                    *sum += part;
                }
            }
        }
        self.normal
    }
}

/// The cost of a window alone.
fn cost(seen: &Observed<f64>, data: &Data, w: &Window, start: &Start) -> f64 {
    let run = &data.runs[w.run];
    let mut cost = 0.0;
    let mut add = |p: Predicted<f64>| {
        for (c, y) in p.y.iter().enumerate() {
            let r = (y - run.y[p.sample][c]) * run.weight[p.sample][c] / data.noise[c];
            cost += r * r;
        }
    };
    let from = start.known();
    predict(seen, &mut some(&seen.plant), run, w, from, &mut add);
    if cost.is_finite() {
        cost
    } else {
        f64::INFINITY
    }
}

/// A plant in the two scalars that windows need. With more than four derivatives those beyond the initial state's are
/// of the parameters.
pub(crate) struct Windows<const N: usize = 4> {
    seen: Observed<Jet<f64, N>>,
    plain: Observed<f64>,
}

impl<const N: usize> Windows<N> {
    /// For a model with these numbers.
    pub(crate) fn new(model: &impl Model, z: &[f64]) -> Self {
        Self::of(model.observed(z))
    }

    /// For a plant that knows its derivatives.
    pub(crate) fn of(seen: Observed<Jet<f64, N>>) -> Self {
        let plain = seen.plain();
        Self { seen, plain }
    }

    /// The plant without derivatives.
    pub(crate) fn plain(&self) -> &Observed<f64> {
        &self.plain
    }

    /// A window's course from its start: states, how they depend on it, and what is left of the measurement.
    pub(crate) fn trace(&self, data: &Data, w: &Window, start: &Start) -> Trace<N> {
        let run = &data.runs[w.run];
        let mut s = some(&self.seen.plant);
        let mut steps = Vec::with_capacity(w.len);
        let from = (variable(start.x), start.before.as_ref());
        let mut keep = |p: Predicted<Jet<f64, N>>| {
            let rows = p.before.to_array().map(|v| v.d);
            let weight: [f64; 2] = std::array::from_fn(|c| run.weight[p.sample][c] / data.noise[c]);
            steps.push(Traced {
                t: p.t,
                read: run.time(p.sample),
                h: run.interval(p.sample - 1),
                x: p.before.map(|v| v.v),
                transition: Matrix4::from_fn(|r, c| rows[r][c]),
                y: p.y,
                weight,
                left: std::array::from_fn(|c| run.y[p.sample][c] - p.y[c].v),
                volts: p.volts,
            });
        };
        predict(&self.seen, &mut s, run, w, from, &mut keep);
        Trace { steps }
    }

    /// The predictions of a window from its start.
    pub(crate) fn predictions(&self, data: &Data, w: &Window, start: &Start) -> Vec<[f64; 2]> {
        let mut out = Vec::with_capacity(w.len);
        let run = &data.runs[w.run];
        let mut s = some(&self.plain.plant);
        let mut keep = |p: Predicted<f64>| out.push(p.y);
        predict(&self.plain, &mut s, run, w, start.known(), &mut keep);
        out
    }

    /// The state at the end of a window.
    pub(crate) fn end(&self, data: &Data, w: &Window, start: &Start) -> State<f64> {
        predict::end(&self.plain, &data.runs[w.run], w, start.known())
    }

    /// What a window from its start says about the time before the next one.
    pub(crate) fn before(
        &self,
        data: &Data,
        from: (&Window, &Start),
        next: &Window,
    ) -> Option<Before> {
        let run = &data.runs[next.run];
        predict::before(&self.plain, run, (from.0, from.1.known()), next)
    }
}

/// A window's course.
pub(crate) struct Trace<const N: usize> {
    pub(crate) steps: Vec<Traced<N>>,
}

/// One step of it.
pub(crate) struct Traced<const N: usize> {
    /// Time at its start by the rig's clock, and how long it is, s.
    pub(crate) t: f64,
    pub(crate) h: f64,
    /// True state at its start.
    pub(crate) x: State<f64>,
    /// That state's slope with respect to the window's initial state.
    pub(crate) transition: Matrix4<f64>,
    /// When it is read after the step, s.
    pub(crate) read: f64,
    /// The two angles then, with all slopes.
    pub(crate) y: [Jet<f64, N>; 2],
    /// Roots of their weights over the noise.
    pub(crate) weight: [f64; 2],
    /// Measured less predicted angles after the step, rad.
    pub(crate) left: [f64; 2],
    /// Voltage at the motor at the step's end, V.
    pub(crate) volts: f64,
}

/// How an initial state is solved for: Gauss-Newton steps with next to no damping, since four states and hundreds of
/// samples leave little doubt.
const RULES: Rules = Rules {
    iterations: 10,
    damping: 1e-6,
    ease: (0.1, 1e-9),
    stiffen: (100.0, 1e-4),
    most: 1e6,
    abandoned: 0.0,
};
/// A step that is predicted to gain less than this plus this share of the cost is not simulated.
const LEAST_STEP: (f64, f64) = (0.01, 1e-3);
/// Half widths of the polynomials that say where a window may start, samples.
const SMOOTHED: [usize; 3] = [10, 5, 20];
/// A start that costs more than this many times the best end is not followed.
const FAR_OFF: f64 = 4.0;

/// A window is linear between two starts where it costs at one, within this share, what its linear form at the other
/// says. Where bodies stick, slide or meet otherwise from one than from the other, the costs differ by far more.
const LINEAR: f64 = 0.1;
/// The initial state of one window as a problem of its own.
struct Initial<'a> {
    windows: &'a Windows,
    data: &'a Data,
    w: &'a Window,
    before: Option<Before>,
    s: std::cell::RefCell<Box<PlantState<Jet<f64, 4>>>>,
}

/// A state, its cost, and the window linearised there if that was asked for.
struct Started {
    x: State<f64>,
    cost: f64,
    normal: Option<WindowNormal<4>>,
}

impl Initial<'_> {
    fn at(&self, x: State<f64>, linearise: bool) -> Started {
        let start = Start {
            x,
            before: self.before,
        };
        if !linearise {
            let cost = cost(&self.windows.plain, self.data, self.w, &start);
            return Started {
                x,
                cost,
                normal: None,
            };
        }
        let s = &mut self.s.borrow_mut();
        let normal = normal(&self.windows.seen, s, self.data, self.w, &start, None);
        Started {
            x,
            cost: normal.cost,
            normal: Some(normal),
        }
    }
}

impl LeastSquares<Started> for Initial<'_> {
    type Linear = WindowNormal<4>;
    type Step = Vector4<f64>;

    fn cost(&self, place: &Started) -> f64 {
        place.cost
    }

    fn linearise(&self, place: &mut Started) -> WindowNormal<4> {
        let known = place.normal.take();
        known.unwrap_or_else(|| self.at(place.x, true).normal.unwrap_or(NOTHING))
    }

    fn step(&self, _: &Started, n: &WindowNormal<4>, damping: f64) -> Option<(Vector4<f64>, f64)> {
        let mut m = Matrix4::from_fn(|a, b| n.matrix[a][b]);
        for i in 0..4 {
            m[(i, i)] += damping * m[(i, i)] + 1e-9;
        }
        let gradient = Vector4::from(n.gradient);
        let step = Cholesky::new(m)?.solve(&gradient);
        Some((step, step.dot(&gradient)))
    }

    fn trial(
        &self,
        place: &Started,
        _: &WindowNormal<4>,
        step: &Vector4<f64>,
        last: bool,
    ) -> Started {
        let x = place.x.to_array();
        self.at(State::from(std::array::from_fn(|i| x[i] - step[i])), !last)
    }

    fn is_worth_a_step(&self, place: &Started, predicted: f64, _: usize) -> bool {
        predicted >= LEAST_STEP.0 + LEAST_STEP.1 * place.cost
    }

    fn reached(&self, _: &mut Started, _: f64, _: usize) -> bool {
        true
    }
}

/// A window that says nothing.
const NOTHING: WindowNormal<4> = WindowNormal {
    cost: f64::INFINITY,
    gradient: [0.0; 4],
    matrix: [[0.0; 4]; 4],
    blocks: Vec::new(),
};

impl Windows {
    /// Improves the initial state by damped Gauss-Newton steps, at most `iterations`; returns state and cost.
    pub(crate) fn solve(
        &self,
        data: &Data,
        w: &Window,
        start: &Start,
        iterations: usize,
    ) -> (Start, f64) {
        let end = self.solved(data, w, start, iterations);
        (end.start, end.cost)
    }

    fn solved(&self, data: &Data, w: &Window, start: &Start, iterations: usize) -> Solved {
        let initial = Initial {
            windows: self,
            data,
            w,
            before: start.before,
            s: std::cell::RefCell::new(some(&self.seen.plant)),
        };
        let rules = Rules {
            iterations,
            ..RULES
        };
        let (end, normal) = minimise(&initial, initial.at(start.x, true), &rules);
        Solved {
            start: Start { x: end.x, ..*start },
            cost: end.cost,
            normal,
        }
    }

    /// Solves for the start of a window that is not known well: of its first quarter, then of its first half, then of
    /// all of it. Near upright an error at the start is hundreds of times as large at the end of a second, and a step
    /// that is right for the first samples leads the last ones astray.
    fn grown(&self, data: &Data, w: &Window, guess: &Start) -> Solved {
        let mut start = *guess;
        for part in [4, 2] {
            let first = Window {
                len: w.len.div_ceil(part),
                ..*w
            };
            start = self.solved(data, &first, &start, RULES.iterations).start;
        }
        self.solved(data, w, &start, RULES.iterations)
    }

    /// What a window costs from its start.
    pub(crate) fn cost(&self, data: &Data, w: &Window, start: &Start) -> f64 {
        cost(&self.plain, data, w, start)
    }

    /// The best of several starts: what smoothing over several widths says, and the state given.
    pub(crate) fn search(&self, data: &Data, w: &Window, known: Option<&Start>) -> (Start, f64) {
        let before = known.and_then(|k| k.before);
        let at = |x| Start { x, before };
        let mut best = known.map(|x| self.solved(data, w, x, RULES.iterations));
        for half in SMOOTHED {
            let guess = at(data.guess(w, half));
            let may_win = |b: &Solved| b.may_be_beaten(&guess, self.cost(data, w, &guess));
            if best.as_ref().is_none_or(may_win) {
                let found = self.grown(data, w, &guess);
                if best.as_ref().is_none_or(|b| found.cost < b.cost) {
                    best = Some(found);
                }
            }
        }
        best.map_or((at(data.guess(w, SMOOTHED[0])), f64::INFINITY), |b| {
            (b.start, b.cost)
        })
    }
}

/// An initial state that was solved for.
struct Solved {
    start: Start,
    cost: f64,
    /// How the window looks there, unless the steps ran out.
    normal: Option<WindowNormal<4>>,
}

impl Solved {
    /// Whether solving from another start, which costs `begin`, may end elsewhere: not where the window costs there what
    /// its linear form here says, nor where it costs far too much.
    fn may_be_beaten(&self, start: &Start, begin: f64) -> bool {
        let Some(normal) = &self.normal else {
            return begin < FAR_OFF * self.cost;
        };
        let (there, here) = (start.x.to_array(), self.start.x.to_array());
        let by: [f64; 4] = std::array::from_fn(|i| there[i] - here[i]);
        let mut expected = self.cost;
        for (i, row) in normal.matrix.iter().enumerate() {
            expected += 2.0 * normal.gradient[i] * by[i];
            expected += row.iter().zip(by).map(|(m, b)| by[i] * m * b).sum::<f64>();
        }
        begin < FAR_OFF * self.cost && (begin - expected).abs() > LINEAR * expected.abs()
    }
}
