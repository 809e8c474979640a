//! A model in the place of motor, arm and pendulum, for boards that have none.

use core::f32::consts::{PI, TAU};

use furuta_model::{Effect, Params, Plant, PlantError, PlantState, State};
use furuta_wire::{ArmCounts, PendulumCounts};

/// The mechanics of a rig, moved on by a period at each tick, in single precision.
#[derive(Clone, Debug)]
pub struct EmulatedMechanics {
    plant: Plant<f32>,
    state: PlantState<f32>,
    counts_per_rev: [f32; 2],
    period: f32,
}

/// Longest step of the integrator, s.
const MAX_STEP: f32 = 1e-3;

impl EmulatedMechanics {
    /// Hanging at rest.
    ///
    /// # Errors
    /// Parameters or effects that are not possible.
    #[allow(clippy::cast_possible_truncation)]
    pub fn new(
        params: &Params<f64>,
        effects: &[Effect<f64>],
        counts_per_rev: [f64; 2],
        period_us: u32,
    ) -> Result<Self, PlantError> {
        let plant: Plant<f32> = Plant::<f64>::new(params, effects)?.cast();
        Ok(Self {
            state: plant.rest(State::new(0.0, PI, 0.0, 0.0)),
            plant,
            counts_per_rev: counts_per_rev.map(|c| c as f32),
            period: period_us as f32 * 1e-6,
        })
    }

    /// What the encoders say now.
    #[must_use]
    pub fn counts(&self) -> (ArmCounts, PendulumCounts) {
        let [theta, alpha] = self.plant.measure(&self.state);
        let [arm, pendulum] = self.counts_per_rev;
        (
            ArmCounts(nearest(theta * arm / TAU)),
            PendulumCounts(nearest((alpha - PI) * pendulum / TAU)),
        )
    }

    /// One period under this voltage.
    pub fn advance(&mut self, volts: f32) {
        let steps = self.period / MAX_STEP;
        // At least one step; a cast saturates.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let steps = (steps as u32 + u32::from(steps > steps as u32 as f32)).max(1);
        for _ in 0..steps {
            self.plant
                .step(&mut self.state, volts, self.period / steps as f32);
        }
    }

    /// The true state: what no real rig would tell.
    #[must_use]
    pub fn state(&self) -> State<f32> {
        self.state.x
    }
}

/// The nearest whole number; a cast saturates and makes 0 of a NaN.
#[allow(clippy::cast_possible_truncation)]
fn nearest(x: f32) -> i32 {
    (if x < 0.0 { x - 0.5 } else { x + 0.5 }) as i32
}
