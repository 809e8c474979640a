//! How windows depend on their starts and on many numbers: each is simulated several times, with derivatives with
//! respect to some of the variables at a time.

use furuta_model::{Jet, PlantState};

use super::data::{Data, Window};
use super::linear::{Course, Linear, Step};
use super::model::{Model, Observed, Pass};
use super::predict::some;
use super::start::Start;

/// Derivatives of a wide pass, and of a narrow one. What a pass takes grows with them, next to nothing added: up to 20
/// of them, that is. With 28 the compiler no longer inlines all of it, and a wide pass with narrow ones takes less
/// (`rk4 step` in benches/benches/model.rs). Each width is the whole model compiled anew.
const WIDE: usize = 16;
pub(super) const NARROW: usize = 4;

/// The plants of the passes about the numbers of a model.
pub(crate) struct Passes {
    wide: Vec<Observed<Jet<f64, WIDE>>>,
    narrow: Vec<Observed<Jet<f64, NARROW>>>,
}

/// States of their plants, to be used again and again.
pub(super) struct States {
    wide: Option<Box<PlantState<Jet<f64, WIDE>>>>,
    narrow: Option<Box<PlantState<Jet<f64, NARROW>>>>,
}

impl Passes {
    /// About `z`. Variables are the state at a window's start and the first of the `numbers` that it depends on.
    pub(crate) fn new(model: &impl Model, z: &[f64], numbers: usize) -> Self {
        let (mut wide, mut narrow) = (Vec::new(), Vec::new());
        let (mut first, variables) = (0, 4 + numbers);
        while first < variables {
            let pass = Pass { first };
            if variables - first > 2 * NARROW {
                wide.push(model.observed(z, pass));
                first += WIDE;
            } else {
                narrow.push(model.observed(z, pass));
                first += NARROW;
            }
        }
        Self { wide, narrow }
    }

    pub(super) fn states(&self) -> States {
        States {
            wide: self.wide.first().map(|seen| some(&seen.plant)),
            narrow: self.narrow.first().map(|seen| some(&seen.plant)),
        }
    }

    /// A window linearised about its start.
    pub(super) fn linear(&self, s: &mut States, data: &Data, w: &Window, start: &Start) -> Linear {
        self.through(s, data, (w, start), None)
    }

    /// The same, step by step.
    pub(crate) fn course(&self, data: &Data, w: &Window, start: &Start) -> Course {
        let mut steps = Vec::with_capacity(w.len);
        let linear = self.through(&mut self.states(), data, (w, start), Some(&mut steps));
        Course {
            steps,
            slopes: linear.slopes,
        }
    }

    fn through(
        &self,
        s: &mut States,
        data: &Data,
        at: (&Window, &Start),
        mut steps: Option<&mut Vec<Step>>,
    ) -> Linear {
        let width = WIDE * self.wide.len() + NARROW * self.narrow.len();
        let mut out = Linear::room(at.0, width);
        // The first pass has the steps.
        let mut first = 0;
        if let Some(s) = &mut s.wide {
            for seen in &self.wide {
                out.take(seen, s, data, at, Pass { first }, steps.take());
                first += WIDE;
            }
        }
        if let Some(s) = &mut s.narrow {
            for seen in &self.narrow {
                out.take(seen, s, data, at, Pass { first }, steps.take());
                first += NARROW;
            }
        }
        out
    }
}
