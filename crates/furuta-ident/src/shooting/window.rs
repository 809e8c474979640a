//! One window: its predictions, and how they depend on its start and on the parameters.

use furuta_model::vectors::{Vectorised, in_vectors};
use furuta_model::{Jet, PlantState, State};
use nalgebra::Matrix4;

use super::data::{Data, Run, Window};
use super::model::{Model, Observed};
use super::predict::{self, Each, Predicted, predict, some};
use super::slopes::Slopes;
use super::start::{Rotor, Start};

/// Squared weighted residuals of one window, their gradient and Gauss-Newton matrix with respect to `N` variables.
#[derive(Clone, Debug)]
pub(super) struct WindowNormal<const N: usize> {
    pub(super) cost: f64,
    pub(super) gradient: [f64; N],
    pub(super) matrix: [[f64; N]; N],
    /// The gradient's parts, block by block, where they were asked for.
    pub(super) blocks: Vec<[f64; N]>,
    /// How each sample follows, where that was asked for.
    pub(super) slopes: Option<Slopes>,
}

/// What [`normal`] keeps beside the sums.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Kept {
    /// The gradient in blocks of this many samples.
    pub(super) block: Option<usize>,
    /// The slopes of each sample with respect to this many first variables.
    pub(super) slopes: Option<usize>,
}

/// Linearises a window about its start and the plant given. The first four of the `N` variables are the initial
/// state's.
pub(super) fn normal<const N: usize>(
    seen: &Observed<Jet<f64, N>>,
    s: &mut PlantState<Jet<f64, N>>,
    data: &Data,
    w: &Window,
    start: &Start,
    kept: Kept,
) -> WindowNormal<N> {
    let linearised = Linearised {
        seen,
        s,
        data,
        run: &data.runs[w.run],
        w,
        start: start.variables(),
        kept,
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
    start: Start<Jet<f64, N>>,
    kept: Kept,
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
                slopes: (self.kept.slopes).map(|width| Slopes::new(width, self.w.len)),
            },
            block: self.kept.block,
            samples: 0,
        };
        predict(self.seen, self.s, self.run, self.w, &self.start, &mut sums);
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
            if let Some(slopes) = &mut out.slopes {
                slopes.push(&d);
            }
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
pub(super) fn cost(seen: &Observed<f64>, data: &Data, w: &Window, start: &Start) -> f64 {
    let run = &data.runs[w.run];
    let mut cost = 0.0;
    let mut add = |p: Predicted<f64>| {
        for (c, y) in p.y.iter().enumerate() {
            let r = (y - run.y[p.sample][c]) * run.weight[p.sample][c] / data.noise[c];
            cost += r * r;
        }
    };
    predict(seen, &mut some(&seen.plant), run, w, start, &mut add);
    if cost.is_finite() {
        cost
    } else {
        f64::INFINITY
    }
}

/// A plant in the two scalars that windows need. With more than four derivatives those beyond the initial state's are
/// of the parameters.
pub(crate) struct Windows<const N: usize = 4> {
    pub(super) seen: Observed<Jet<f64, N>>,
    pub(super) plain: Observed<f64>,
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

    /// Whether how the rotor stands at a window's start is inferred from the motion before.
    pub(super) fn infers_rotor(&self) -> bool {
        self.plain.plant.has_drive()
    }

    /// A window's course from its start: states, how they depend on it, and what is left of the measurement.
    pub(crate) fn trace(&self, data: &Data, w: &Window, start: &Start) -> Trace<N> {
        let run = &data.runs[w.run];
        let mut s = some(&self.seen.plant);
        let mut steps = Vec::with_capacity(w.len);
        let start = start.variables();
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
        predict(&self.seen, &mut s, run, w, &start, &mut keep);
        Trace { steps }
    }

    /// The predictions of a window from its start.
    pub(crate) fn predictions(&self, data: &Data, w: &Window, start: &Start) -> Vec<[f64; 2]> {
        let mut out = Vec::with_capacity(w.len);
        let run = &data.runs[w.run];
        let mut s = some(&self.plain.plant);
        let mut keep = |p: Predicted<f64>| out.push(p.y);
        predict(&self.plain, &mut s, run, w, start, &mut keep);
        out
    }

    /// What the encoders read of a window's state at its start, `[theta, alpha]`, rad.
    pub(super) fn reading(&self, data: &Data, w: &Window, x: &State<f64>) -> [f64; 2] {
        let run = &data.runs[w.run];
        let zero = self.plain.zero(run.recording);
        let moment = (run.recording, run.time(w.start));
        let plant = self.plain.plant_in(run.recording);
        plant.reading_from([x.theta + zero[0], x.alpha + zero[1]], zero, moment)
    }

    /// The state at the end of a window.
    pub(crate) fn end(&self, data: &Data, w: &Window, start: &Start) -> State<f64> {
        predict::end(&self.plain, &data.runs[w.run], w, start)
    }

    /// A rotor that rested before a window, turned against the arm by `angle`, rad.
    pub(super) fn resting(&self, data: &Data, w: &Window, angle: f64) -> Rotor {
        predict::resting(&self.plain, &data.runs[w.run], w, angle)
    }

    /// What a window from its start says about the time before the next one.
    pub(crate) fn before(&self, data: &Data, from: (&Window, &Start), next: &Window) -> Rotor {
        predict::before(&self.plain, &data.runs[next.run], from, next)
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
