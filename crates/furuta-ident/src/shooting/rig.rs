//! A rig file as it is: nothing of it is fitted but the zeros of the recordings' encoders.

use furuta_model::{Effect, Jet, Plant, Rig};

use super::late::Late;
use super::model::{Layout, Model, Observed, Pass, Prior};
use super::zeros::{zero_bounds, zero_priors, zeros_each};
use crate::pendulum::Pendulum;

/// A rig and the number of recordings that it is compared with.
#[derive(Clone, Copy)]
pub(crate) struct AsGiven<'a> {
    pub(crate) rig: &'a Rig,
    pub(crate) recordings: usize,
    /// What the rig was when it was recorded.
    pub(crate) state: Pendulum,
    /// Whether each recording has zeros of its own.
    pub(crate) own_zeros: bool,
}

impl Model for AsGiven<'_> {
    fn layout(&self) -> Layout {
        Layout {
            shared: 0,
            lead: 0,
            zeros: zeros_each(self.own_zeros),
            recordings: self.recordings,
        }
    }

    fn observed<const N: usize>(&self, z: &[f64], pass: Pass) -> Observed<Jet<f64, N>> {
        let mut late = Late::by(Jet::constant(0.0));
        let mut effects: Vec<Effect<Jet<f64, N>>> = Vec::new();
        let present = self.rig.effects.iter().filter(|e| self.state.has(e.spec()));
        for e in present {
            let e: Effect<Jet<f64, N>> = e.cast();
            if !late.add(&e) {
                effects.push(e);
            }
        }
        let coefficients = self
            .state
            .coefficients(self.rig.params.cast().coefficients());
        let plant = Plant::from_coefficients(coefficients, &effects);
        let mut seen = Observed::from_true_zeros(plant.unwrap_or_else(|_| Plant::unknown()), late);
        seen.free_zeros(&self.layout(), z, pass);
        seen
    }

    fn bounds(&self, _: &[f64]) -> Vec<(f64, f64)> {
        let mut effects = self.rig.effects.iter();
        let sees_angle = effects.any(|e| e.spec().sees_angle());
        zero_bounds(&self.layout(), sees_angle, None)
    }

    fn priors(&self) -> Vec<Option<Prior>> {
        zero_priors(&self.layout(), &self.rig.sensors)
    }
}
