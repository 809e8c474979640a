//! What the effects do to bodies at one moment.

use super::Plant;
use super::drive::Bodies;
use crate::effects::{Acts, Instant, Law};
use crate::scalar::Scalar;
use crate::vectors::{Vectorised, in_vectors};

/// The torques on `[arm, pendulum]` with those of the effects that these bodies feel, and the largest torques of dry
/// friction, N m.
struct Torques<'a, 'b, S> {
    plant: &'a Plant<S>,
    torque: [S; 2],
    at: &'a Instant<'b, S>,
    of: Bodies,
}

impl<S: Scalar> Vectorised for Torques<'_, '_, S> {
    type Output = ([S; 2], [S; 2]);

    #[inline(always)]
    fn call(self) -> ([S; 2], [S; 2]) {
        let Self { plant, at, of, .. } = self;
        let mut torque = self.torque;
        if plant.acts.includes(Acts::TORQUE) {
            for e in plant.effects.iter().filter(|e| of.feel(e)) {
                let extra = e.torque(at);
                torque = [torque[0] + extra[0], torque[1] + extra[1]];
            }
        }
        let mut limit = [S::ZERO; 2];
        if plant.acts.includes(Acts::DRY_FRICTION) {
            for e in plant.effects.iter().filter(|e| of.feel(e)) {
                let extra = e.dry_friction(at);
                limit = [limit[0] + extra[0], limit[1] + extra[1]];
            }
        }
        (torque, limit)
    }
}

impl<S: Scalar> Plant<S> {
    /// `torque` and what the effects add to it that these bodies feel, and the largest torques of dry friction, N m.
    #[inline(always)]
    pub(super) fn with_effects(
        &self,
        torque: [S; 2],
        at: &Instant<'_, S>,
        of: Bodies,
    ) -> ([S; 2], [S; 2]) {
        if !self.acts.touches(Acts::TORQUE.and(Acts::DRY_FRICTION)) {
            return (torque, [S::ZERO; 2]);
        }
        let torques = Torques {
            plant: self,
            torque,
            at,
            of,
        };
        // Every effect's law in each stage of the integrator would be a lot of code for the compiler. Lanes need it
        // all the same, or it would not be compiled for the processor's vectors.
        if S::LANES > 1 {
            torques.call()
        } else {
            called(torques)
        }
    }
}

#[inline(never)]
fn called<S: Scalar>(torques: Torques<'_, '_, S>) -> ([S; 2], [S; 2]) {
    in_vectors::<S, _>(torques)
}
