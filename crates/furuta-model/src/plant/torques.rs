//! What acts on bodies at one moment: the equations of motion, and what the effects add to them.

use super::Plant;
use super::drive::Bodies;
use super::friction::Balance;
use crate::dynamics::{self, Angle};
use crate::effects::{Acts, Clock, Instant, Law};
use crate::params::Coefficients;
use crate::scalar::Scalar;
use crate::state::State;
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
    /// What laws see of a moment.
    #[inline(always)]
    pub(super) fn instant<'a>(
        &'a self,
        x: &'a State<S>,
        clock: Clock<S>,
        volts: S,
        memory: S,
    ) -> Instant<'a, S> {
        Instant {
            clock,
            x,
            angle: Angle::of(x.alpha),
            coefficients: &self.coefficients,
            memory,
            volts,
        }
    }

    /// Torques and inertia at one moment, with `c` for the body that the arm belongs to, and the effects that these
    /// bodies feel.
    #[inline(always)]
    pub(super) fn balance(
        &self,
        c: &Coefficients<S>,
        clock: Clock<S>,
        x: &State<S>,
        volts: S,
        memory: S,
        of: Bodies,
    ) -> Balance<S> {
        let at = self.instant(x, clock, volts, memory);
        let angle = at.angle;
        let (b, g) = (dynamics::bias(c, angle, x), dynamics::gravity(c, angle));
        let (torque, limit) = self.with_effects(dynamics::torque(c, x, volts), &at, of);
        Balance {
            free: [torque[0] - b[0] - g[0], torque[1] - b[1] - g[1]],
            inverse: dynamics::mass_matrix(c, angle).inverse(),
            limit,
        }
    }

    /// What the effects alone add to the torques on `[arm, pendulum]` at the start of a run, N m.
    pub(crate) fn effect_torques(&self, x: &State<S>, volts: S) -> [S; 2] {
        let at = self.instant(x, Clock::at(S::ZERO), volts, S::ZERO);
        self.with_effects([S::ZERO; 2], &at, Bodies::Whole).0
    }

    /// [`Plant::balance`] as a call, for where events are looked for.
    #[inline(never)]
    pub(super) fn balance_outside(
        &self,
        c: &Coefficients<S>,
        clock: Clock<S>,
        x: &State<S>,
        volts: S,
        memory: S,
        of: Bodies,
    ) -> Balance<S> {
        in_vectors::<S, _>(BalanceOf {
            plant: self,
            coefficients: c,
            clock,
            x,
            volts,
            memory,
            of,
        })
    }

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

/// What [`Plant::balance`] is asked.
struct BalanceOf<'a, S> {
    plant: &'a Plant<S>,
    coefficients: &'a Coefficients<S>,
    clock: Clock<S>,
    x: &'a State<S>,
    volts: S,
    memory: S,
    of: Bodies,
}

impl<S: Scalar> Vectorised for BalanceOf<'_, S> {
    type Output = Balance<S>;

    #[inline(always)]
    fn call(self) -> Balance<S> {
        self.plant.balance(
            self.coefficients,
            self.clock,
            self.x,
            self.volts,
            self.memory,
            self.of,
        )
    }
}
