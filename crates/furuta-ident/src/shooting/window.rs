//! One window: its predictions, and what they say about its ends.

use furuta_model::{Jet, State};

use super::data::{Data, Window};
use super::model::{Model, Observed, Pass};
use super::passes::NARROW;
use super::predict::{self, Predicted, predict, some};
use super::start::{Rotor, Start};

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

/// A plant in the two scalars that the starts of windows need.
pub(crate) struct Windows {
    pub(super) seen: Observed<Jet<f64, NARROW>>,
    pub(super) plain: Observed<f64>,
}

impl Windows {
    /// For a model with these numbers.
    pub(crate) fn new(model: &impl Model, z: &[f64]) -> Self {
        Self::of(model.observed(z, Pass::FIRST))
    }

    /// For a plant that knows its derivatives.
    pub(crate) fn of(seen: Observed<Jet<f64, NARROW>>) -> Self {
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
