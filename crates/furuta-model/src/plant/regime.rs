//! What holds between two events: who sticks or slides which way, and the accelerations and torques that follow.

use super::drive::{Bodies, Moment, Shaft, TwoBody};
use super::friction::{Balance, Dry};
use super::state::Contact;
use super::{Plant, PlantState};
use crate::effects::Acts;
use crate::params::Coefficients;
use crate::scalar::Scalar;
use crate::vectors::{Vectorised, in_vectors};

/// What holds until the next event, and how things stand at its start. Dry friction of the arm acts on the rotor where
/// that is a body of its own.
pub(super) struct Regime<S> {
    pub(super) dry: [Dry; 2],
    /// Of arm and pendulum, rad/s².
    pub(super) acceleration: [S; 2],
    /// Of the rotor, rad/s².
    pub(super) rotor: S,
    /// Torques of dry friction and the largest they can be, N m.
    pub(super) friction: [S; 2],
    pub(super) limit: [S; 2],
    /// Torque from rotor to arm.
    pub(super) passed: S,
}

/// How axes rub: as they did, or as their speeds and torques say, with which way axes were just torn loose.
pub(super) enum How {
    Kept([Dry; 2]),
    Decided([Option<Dry>; 2]),
}

impl<S: Scalar> Plant<S> {
    /// What friction remembers once rotor and arm have come to `end`.
    #[inline(always)]
    pub(super) fn memory_at(&self, s: &PlantState<S>, end: &TwoBody<S>) -> S {
        if !self.acts.includes(Acts::MEMORY) {
            return s.memory;
        }
        let way = if self.acts.includes(Acts::DRIVE) {
            end.rotor[0] - s.rotor[0]
        } else {
            end.x.theta - s.x.theta
        };
        self.travelled(s.memory, way)
    }

    /// Speeds at which dry friction rubs: of the rotor where it is a body of its own, else of the arm; of the pendulum.
    #[inline(always)]
    pub(super) fn rubbing(&self, m: &TwoBody<S>, contact: Contact) -> [S; 2] {
        let first = if self.one_body(contact) {
            m.x.theta_dot
        } else {
            m.rotor[1]
        };
        [first, m.x.alpha_dot]
    }

    /// Whether rotor and arm move as one body.
    #[inline(always)]
    pub(super) fn one_body(&self, contact: Contact) -> bool {
        let d = &self.drive;
        !self.acts.includes(Acts::DRIVE) || !d.elastic() && (!d.loose() || contact != Contact::Free)
    }

    /// Torques and inertia of rotor and arm as one body, and of the pendulum. Where a drive sets the rotor apart, it
    /// stands elsewhere than the arm.
    #[inline(always)]
    pub(super) fn whole(&self, m: &TwoBody<S>, at: Moment<S>) -> Balance<S> {
        let c = &self.coefficients;
        let volts = self.acting(m, at.volts);
        let of = if self.acts.includes(Acts::DRIVE.and(Acts::SHAFT)) {
            Bodies::Load
        } else {
            Bodies::Whole
        };
        let mut balance = self.balance_outside(c, at.clock, &m.x, volts, at.memory, of);
        self.attach(&mut balance, m, &at, of);
        if of == Bodies::Whole {
            return balance;
        }
        let shaft = self.on_shaft(m, at);
        balance.free[0] += shaft.free;
        balance.limit[0] += shaft.limit;
        balance
    }

    /// Torques and inertia of arm and pendulum where the rotor passes the torque `passed` (N m) on to them; `load` is
    /// [`Plant::load`].
    #[inline(always)]
    pub(super) fn carried(
        &self,
        load: &Coefficients<S>,
        m: &TwoBody<S>,
        at: Moment<S>,
        passed: S,
    ) -> Balance<S> {
        let of = Bodies::Load;
        let mut balance = self.balance_outside(load, at.clock, &m.x, at.volts, at.memory, of);
        balance.free[0] += passed;
        self.attach(&mut balance, m, &at, of);
        balance
    }

    /// The rotor's acceleration (rad/s²) and the torque of its dry friction (N m) where it slides or is held as given,
    /// and passes the torque `passed` (N m) on.
    #[inline(always)]
    pub(super) fn rotor_acceleration(&self, shaft: Shaft<S>, passed: S, dry: Dry) -> (S, S) {
        let free = shaft.free - passed;
        if dry == Dry::Held {
            return (S::ZERO, -free);
        }
        let friction = -(shaft.limit * dry.direction());
        ((free + friction) / self.rotor_inertia(), friction)
    }

    /// Accelerations of arm, pendulum and rotor, friction, its limits, and the torque from rotor to arm at one stage.
    #[inline(never)]
    pub(super) fn forces(
        &self,
        m: &TwoBody<S>,
        contact: Contact,
        at: Moment<S>,
        how: How,
    ) -> Regime<S> {
        in_vectors::<S, _>(Forces {
            plant: self,
            m,
            contact,
            at,
            how,
        })
    }
}

/// What [`Plant::forces`] is asked.
struct Forces<'a, S> {
    plant: &'a Plant<S>,
    m: &'a TwoBody<S>,
    contact: Contact,
    at: Moment<S>,
    how: How,
}

impl<S: Scalar> Vectorised for Forces<'_, S> {
    type Output = Regime<S>;

    #[inline(always)]
    fn call(self) -> Regime<S> {
        let Self {
            plant,
            m,
            contact,
            at,
            how,
        } = self;
        let speed = plant.rubbing(m, contact);
        if plant.one_body(contact) {
            let balance = plant.whole(m, at);
            let dry = match how {
                How::Kept(dry) => dry,
                How::Decided(broke) => balance.decide(speed, broke),
            };
            let (acceleration, friction) = balance.solve(dry);
            let passed = if plant.acts.includes(Acts::DRIVE) {
                plant.flank_torque(m, at, friction[0], acceleration[0])
            } else {
                S::ZERO
            };
            return Regime {
                dry,
                acceleration,
                rotor: acceleration[0],
                friction,
                limit: balance.limit,
                passed,
            };
        }
        let passed = plant.spring_torque(m, contact);
        let balance = plant.carried(&plant.load(), m, at, passed);
        let shaft = plant.shaft(m, at);
        let dry = match how {
            How::Kept(dry) => dry,
            How::Decided(broke) => [
                decide(speed[0], shaft.free - passed, shaft.limit, broke[0]),
                balance.decide([m.x.theta_dot, speed[1]], [None, broke[1]])[1],
            ],
        };
        let (acceleration, friction) = balance.solve([Dry::Absent, dry[1]]);
        let (rotor, rubs) = plant.rotor_acceleration(shaft, passed, dry[0]);
        Regime {
            dry,
            acceleration,
            rotor,
            friction: [rubs, friction[1]],
            limit: [shaft.limit, balance.limit[1]],
            passed,
        }
    }
}

/// What dry friction of at most `limit` (N m) does to a body that turns with `speed` under the torque `free` (N m).
/// `broke` says which way it was just torn loose.
fn decide<S: Scalar>(speed: S, free: S, limit: S, broke: Option<Dry>) -> Dry {
    let zero = S::Real::ZERO;
    if limit.real() <= zero {
        Dry::Absent
    } else if speed.real() > zero {
        Dry::Forward
    } else if speed.real() < zero {
        Dry::Backward
    } else if let Some(dry) = broke {
        dry
    } else if free.abs().real() <= limit.real() {
        Dry::Held
    } else if free.real() > zero {
        Dry::Forward
    } else {
        Dry::Backward
    }
}
