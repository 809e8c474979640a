//! Friction's work along the ascent.

use crate::real::{Real, c};
use furuta_model::params::Coefficients;

/// Intervals of the table over `0..=pi`.
const ASCENT: usize = 64;

/// Friction's work (J) from `i pi / 64` to upright along the ascent.
#[derive(Clone, Debug)]
pub(super) struct AscentFriction<T>([T; ASCENT + 1]);

impl<T: Real> AscentFriction<T> {
    /// Friction's work (J) from each angle of the table up to upright, along the ascent that just gets there with the
    /// arm at rest: `dW/dalpha = b_p |alpha'|`, `J alpha'^2 / 2 = W + m g c (1 - cos(alpha))`.
    pub(super) fn new(k: &Coefficients<T>, margin: T) -> Self {
        const STEPS: usize = 8;
        let step = c::<T>(core::f64::consts::PI / (ASCENT * STEPS) as f64);
        // At upright both sides vanish; the ascent leaves along the stable direction alpha' = -rate alpha.
        let half = k.pendulum_damping / (k.pendulum + k.pendulum);
        let rate = half + (half * half + k.weight / k.pendulum).sqrt();
        let mut work = T::ZERO;
        let mut middle = step * c(0.5);
        let mut table = [T::ZERO; ASCENT + 1];
        for (i, entry) in table.iter_mut().enumerate() {
            *entry = work * margin;
            for _ in 0..STEPS {
                let kinetic = work + k.weight * (T::ONE - middle.sin_cos().1);
                let speed = if i == 0 {
                    rate * middle
                } else {
                    (c::<T>(2.0) * kinetic / k.pendulum).sqrt()
                };
                work += k.pendulum_damping * speed * step;
                middle += step;
            }
        }
        Self(table)
    }

    /// The whole table, from upright on.
    pub(super) fn table(&self) -> &[T] {
        &self.0
    }

    /// The work from this distance from upright (rad).
    pub(super) fn from(&self, angle: f64) -> T {
        let share = angle / core::f64::consts::PI;
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss
        )]
        let index = (share * ASCENT as f64 + 0.5) as usize;
        self.0[index.min(ASCENT)]
    }
}
