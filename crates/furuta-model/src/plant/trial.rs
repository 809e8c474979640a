//! A step of the integrator between two events: what rubs, touches and presses stays as it is.

use super::drive::{Moment, TwoBody};
use super::friction::Dry;
use super::regime::Regime;
use super::state::Contact;
use super::step::{Driven, clocks};
use super::{Plant, PlantState};
use crate::effects::{Acts, Clock};
use crate::integrate::{Field, Length, Stage, rk4};
use crate::params::Coefficients;
use crate::scalar::Scalar;
use crate::state::State;
use crate::vectors::{Vectorised, in_vectors};

/// What drives the arm, and the times, at a stretch's start, middle and end.
pub(super) struct Stages<S> {
    pub(super) driven: Driven<S>,
    clocks: [Clock<S>; 3],
}

impl<S: Scalar> Stages<S> {
    /// What torques depend on at one of them.
    #[inline(always)]
    pub(super) fn moment(&self, stage: usize, memory: S, pressed: Contact) -> Moment<S> {
        Moment {
            clock: self.clocks[stage],
            volts: self.driven.volts[stage],
            memory,
            pressed,
        }
    }
}

/// What stays over the step, and where it begins.
struct Between<'a, S: Scalar> {
    plant: &'a Plant<S>,
    s: &'a PlantState<S>,
    stages: &'a Stages<S>,
    /// How both axes rub.
    dry: [Dry; 2],
}

impl<S: Scalar> Between<'_, S> {
    #[inline(always)]
    fn moment(&self, stage: Stage, m: &TwoBody<S>) -> Moment<S> {
        let memory = self.plant.memory_at(self.s, m);
        self.stages.moment(stage as usize, memory, self.s.pressed)
    }
}

/// Rotor and arm as one body.
struct OneBody<'a, S: Scalar>(Between<'a, S>);

impl<S: Scalar> Field<State<S>> for OneBody<'_, S> {
    #[inline(always)]
    fn slope(&self, stage: Stage, x: &State<S>) -> State<S> {
        let Between { plant, s, dry, .. } = self.0;
        let m = TwoBody {
            x: *x,
            rotor: plant.rotor_with(s.contact, x),
            inner: s.inner,
            own: false,
        };
        let (a, _) = plant.whole(&m, self.0.moment(stage, &m)).solve(dry);
        State::new(x.theta_dot, x.alpha_dot, a[0], a[1])
    }
}

/// The same with inner states.
struct WithInner<'a, S: Scalar>(Between<'a, S>);

impl<S: Scalar> Field<TwoBody<S>> for WithInner<'_, S> {
    #[inline(always)]
    fn slope(&self, stage: Stage, m: &TwoBody<S>) -> TwoBody<S> {
        let Between { plant, dry, .. } = self.0;
        let at = self.0.moment(stage, m);
        let (a, _) = plant.whole(m, at).solve(dry);
        TwoBody {
            x: State::new(m.x.theta_dot, m.x.alpha_dot, a[0], a[1]),
            rotor: [m.x.theta_dot, a[0]],
            inner: plant.inner_rates(m, &at),
            own: m.own,
        }
    }
}

/// Rotor and arm apart, with a spring between them or nothing.
struct Apart<'a, S: Scalar> {
    between: Between<'a, S>,
    load: Coefficients<S>,
}

impl<S: Scalar> Field<TwoBody<S>> for Apart<'_, S> {
    #[inline(always)]
    fn slope(&self, stage: Stage, m: &TwoBody<S>) -> TwoBody<S> {
        let Between { plant, s, dry, .. } = self.between;
        let at = self.between.moment(stage, m);
        let passed = plant.spring_torque(m, s.contact);
        let (a, _) = plant
            .carried(&self.load, m, at, passed)
            .solve([Dry::Absent, dry[1]]);
        let (rotor, _) = plant.rotor_acceleration(plant.shaft(m, at), passed, dry[0]);
        TwoBody {
            x: State::new(m.x.theta_dot, m.x.alpha_dot, a[0], a[1]),
            rotor: [m.rotor[1], rotor],
            inner: plant.inner_rates(m, &at),
            own: m.own,
        }
    }
}

/// The step as work that is compiled for vectors.
struct Trial<'a, S: Scalar, H> {
    between: Between<'a, S>,
    h: H,
}

impl<S: Scalar, H: Length<S>> Vectorised for Trial<'_, S, H> {
    type Output = TwoBody<S>;

    #[inline(always)]
    fn call(self) -> TwoBody<S> {
        let Self { between, h } = self;
        let Between { plant, s, .. } = between;
        if !plant.one_body(s.contact) {
            let load = plant.load();
            return rk4(plant.body(s), h, &Apart { between, load });
        }
        if plant.acts.includes(Acts::INNER) {
            let start = TwoBody {
                rotor: plant.rotor_with(s.contact, &s.x),
                ..plant.body(s)
            };
            return rk4(start, h, &WithInner(between));
        }
        let x = rk4(s.x, h, &OneBody(between));
        TwoBody {
            x,
            rotor: plant.rotor_with(s.contact, &x),
            inner: s.inner,
            own: false,
        }
    }
}

impl<S: Scalar> Plant<S> {
    pub(super) fn stages<H: Length<S>>(&self, s: &PlantState<S>, u: S, h: H) -> Stages<S> {
        Stages {
            driven: self.driven(s, u, h),
            clocks: clocks(s, h),
        }
    }

    /// The rotor's angle and speed where it turns with the arm and touches it like this.
    #[inline(always)]
    fn rotor_with(&self, contact: Contact, x: &State<S>) -> [S; 2] {
        let shift = contact.side::<S>() * self.drive.half_gap();
        [x.theta + shift, x.theta_dot]
    }

    /// The state after `h`, the regime kept.
    #[inline(never)]
    pub(super) fn trial<H: Length<S>>(
        &self,
        s: &PlantState<S>,
        regime: &Regime<S>,
        stages: &Stages<S>,
        h: H,
    ) -> TwoBody<S> {
        let between = Between {
            plant: self,
            s,
            stages,
            dry: regime.dry,
        };
        in_vectors::<S, _>(Trial { between, h })
    }
}
