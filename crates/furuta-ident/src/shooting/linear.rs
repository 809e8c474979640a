//! A window about its start: what is left at each sample, and how that follows the start and the numbers of a model.

use furuta_model::vectors::{Vectorised, in_vectors};
use furuta_model::{Jet, PlantState, State};
use nalgebra::{DMatrix, Matrix4};

use super::data::{Data, Run, Window};
use super::model::{Observed, Pass};
use super::predict::{Each, Predicted, predict};
use super::slopes::Slopes;
use super::start::Start;

/// A window linearised about its start and a plant.
#[derive(Clone, Debug)]
pub(crate) struct Linear {
    /// The sum of the squares of what is left.
    pub(super) cost: f64,
    /// Predicted less measured angles over the noise, `theta` and `alpha` of one sample after the other.
    pub(super) left: Vec<f64>,
    /// How they follow.
    pub(crate) slopes: Slopes,
}

/// A window linearised, step by step.
#[derive(Clone, Debug)]
pub(crate) struct Course {
    pub(crate) steps: Vec<Step>,
    /// How the angles after each step follow.
    pub(crate) slopes: Slopes,
}

/// One step of a window's course.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    /// Time at its start by the rig's clock, and how long it is, s.
    pub(crate) t: f64,
    pub(crate) h: f64,
    /// True state at its start.
    pub(crate) x: State<f64>,
    /// That state's slope with respect to the window's initial state.
    pub(crate) transition: Matrix4<f64>,
    /// When it is read after the step, s.
    pub(crate) read: f64,
    /// The two angles then, rad.
    pub(crate) y: [f64; 2],
    /// Roots of their weights over the noise.
    pub(crate) weight: [f64; 2],
    /// Measured less predicted angles after the step, rad.
    pub(crate) left: [f64; 2],
    /// Voltage at the motor at the step's end, V.
    pub(crate) volts: f64,
}

impl Linear {
    /// Room for a window with `width` variables.
    pub(super) fn room(w: &Window, width: usize) -> Self {
        Self {
            cost: 0.0,
            left: vec![0.0; 2 * w.len],
            slopes: Slopes::new(width, w.len),
        }
    }

    /// Takes up what a pass finds, and where they are asked for its steps. Those of a window come one after the other,
    /// the first one first; `s` may be any state of the plant.
    pub(super) fn take<const N: usize>(
        &mut self,
        seen: &Observed<Jet<f64, N>>,
        s: &mut PlantState<Jet<f64, N>>,
        data: &Data,
        (w, start): (&Window, &Start),
        pass: Pass,
        steps: Option<&mut Vec<Step>>,
    ) {
        let run = &data.runs[w.run];
        in_vectors::<Jet<f64, N>, _>(OnePass {
            seen,
            s,
            w,
            start: start.variables(pass),
            recorder: Recorder {
                run,
                noise: data.noise,
                first: pass.first,
                rows: 0,
                out: self,
                steps,
            },
        });
        if !self.cost.is_finite() {
            self.cost = f64::INFINITY;
        }
    }

    /// Half the slope of the cost with respect to each variable.
    pub(super) fn gradient(&self) -> Vec<f64> {
        self.slopes.times(0, &self.left)
    }

    /// The parts of the gradient from blocks of this many samples.
    pub(super) fn gradients(&self, samples: usize) -> Vec<Vec<f64>> {
        (self.left.chunks(2 * samples).enumerate())
            .map(|(k, left)| self.slopes.times(2 * samples * k, left))
            .collect()
    }

    /// The Gauss-Newton matrix of all variables.
    pub(super) fn matrix(&self) -> DMatrix<f64> {
        in_vectors::<Jet<f64, 4>, _>(&self.slopes)
    }
}

/// A pass over a window, for [`in_vectors`].
struct OnePass<'a, const N: usize> {
    seen: &'a Observed<Jet<f64, N>>,
    s: &'a mut PlantState<Jet<f64, N>>,
    w: &'a Window,
    start: Start<Jet<f64, N>>,
    recorder: Recorder<'a>,
}

impl<const N: usize> Vectorised for OnePass<'_, N> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let run = self.recorder.run;
        predict(
            self.seen,
            self.s,
            run,
            self.w,
            &self.start,
            &mut self.recorder,
        );
    }
}

/// Writes down what a pass predicts.
struct Recorder<'a> {
    run: &'a Run,
    noise: [f64; 2],
    /// The variable of its first derivative.
    first: usize,
    /// How many angles have been seen.
    rows: usize,
    out: &'a mut Linear,
    steps: Option<&'a mut Vec<Step>>,
}

impl<const N: usize> Each<Jet<f64, N>> for Recorder<'_> {
    #[inline(always)]
    fn see(&mut self, p: Predicted<Jet<f64, N>>) {
        let out = &mut *self.out;
        let mut weight = [0.0; 2];
        for (c, y) in p.y.iter().enumerate() {
            weight[c] = self.run.weight[p.sample][c] / self.noise[c];
            out.slopes.put(self.rows + c, self.first, &y.d, weight[c]);
        }
        if self.first == 0 {
            let measured = self.run.y[p.sample];
            for (c, y) in p.y.iter().enumerate() {
                let r = (y.v - measured[c]) * weight[c];
                out.cost += r * r;
                out.left[self.rows + c] = r;
            }
        }
        if let Some(steps) = &mut self.steps {
            let (x, measured) = (p.before.to_array(), self.run.y[p.sample]);
            steps.push(Step {
                t: p.t,
                read: self.run.time(p.sample),
                h: self.run.interval(p.sample - 1),
                x: p.before.map(|v| v.v),
                transition: Matrix4::from_fn(|r, c| x[r].d[c]),
                y: [p.y[0].v, p.y[1].v],
                weight,
                left: [measured[0] - p.y[0].v, measured[1] - p.y[1].v],
                volts: p.volts,
            });
        }
        self.rows += 2;
    }
}
