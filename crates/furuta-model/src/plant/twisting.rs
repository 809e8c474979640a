//! Steps of rotor and arm with a spring between them, as long as what rubs slides on as it does: the usual case, at
//! little more than the cost of a smooth step. What [`super::events`] does there comes to the same digits.

use super::drive::{Bodies, Moment, TwoBody};
use super::friction::{Dry, turns};
use super::state::{Contact, STATES};
use super::step::{Driven, clocks};
use super::{Plant, PlantState};
use crate::effects::{Acts, Clock};
use crate::integrate::{Field, Fixed, Length, Stage, Vector, rk4};
use crate::params::Coefficients;
use crate::scalar::Scalar;
use crate::state::State;
use core::ops::Add;

/// With any of these, more than a twist has to be followed.
const UNLIKE_TWISTING: Acts = Acts::DELAY
    .and(Acts::JUMPS)
    .and(Acts::SPEED_LIMIT)
    .and(Acts::MEMORY)
    .and(Acts::CONTACT)
    .and(Acts::INNER);

/// Arm, pendulum and rotor; or their rates.
#[derive(Copy, Clone)]
struct Three<S> {
    x: State<S>,
    rotor: [S; 2],
}

impl<S: Scalar> Three<S> {
    /// For what is asked of bodies with inner states as well, of which there are none here.
    #[inline(always)]
    fn without_inner(&self) -> TwoBody<S> {
        TwoBody {
            x: self.x,
            rotor: self.rotor,
            inner: [S::ZERO; STATES],
            own: false,
        }
    }
}

impl<S: Scalar> Add for Three<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self {
            x: self.x + o.x,
            rotor: [self.rotor[0] + o.rotor[0], self.rotor[1] + o.rotor[1]],
        }
    }
}

impl<S: Scalar> Vector<S> for Three<S> {
    #[inline(always)]
    fn each(self, f: impl Fn(S) -> S) -> Self {
        Self {
            x: self.x.map(&f),
            rotor: [f(self.rotor[0]), f(self.rotor[1])],
        }
    }
}

/// The equations of motion with a spring between rotor and arm, and what rubs sliding one way.
struct Twisting<'a, S> {
    plant: &'a Plant<S>,
    load: Coefficients<S>,
    driven: &'a Driven<S>,
    clocks: [Clock<S>; 3],
    /// Of rotor and pendulum.
    dry: [Dry; 2],
}

impl<S: Scalar> Field<Three<S>> for Twisting<'_, S> {
    #[inline(always)]
    fn slope(&self, stage: Stage, m: &Three<S>) -> Three<S> {
        let (i, p) = (stage as usize, self.plant);
        let at = Moment {
            clock: self.clocks[i],
            volts: self.driven.volts[i],
            memory: S::ZERO,
            pressed: Contact::Free,
        };
        let passed = p.spring(m.rotor[0] - m.x.theta, m.rotor[1] - m.x.theta_dot);
        let mut balance = p.balance(
            &self.load,
            at.clock,
            &m.x,
            at.volts,
            at.memory,
            Bodies::Load,
        );
        balance.free[0] += passed;
        let (a, _) = balance.solve([Dry::Absent, self.dry[1]]);
        let (rotor, _) = p.rotor_acceleration(p.shaft(&m.without_inner(), at), passed, self.dry[0]);
        Three {
            x: State::new(m.x.theta_dot, m.x.alpha_dot, a[0], a[1]),
            rotor: [m.rotor[1], rotor],
        }
    }
}

impl<S: Scalar> Plant<S> {
    /// Whether a spring between rotor and arm is all that makes a sample period more than sliding.
    #[inline(always)]
    pub(super) fn only_twists(&self) -> bool {
        self.twists() && !self.drive.loose() && !self.acts.touches(UNLIKE_TWISTING)
    }

    /// A sample period of a plant that [`Plant::only_twists`].
    #[inline(always)]
    pub(super) fn twist_on(&self, s: &mut PlantState<S>, u: S, h: S::Real) {
        let parts = self.substeps(h);
        let part = Length::<S>::part(Fixed(h), parts);
        for _ in 0..parts {
            if !self.slides_on(s, u, part) {
                self.flow_outside(s, u, part);
            }
        }
    }

    /// From event to event, as a call.
    #[inline(never)]
    fn flow_outside<H: Length<S>>(&self, s: &mut PlantState<S>, u: S, h: H) {
        self.flow(s, u, h);
    }

    /// One step in which rotor and pendulum slide on. Where one of them rests or turns, and may stick, nothing is done,
    /// and the answer is `false`.
    #[inline(always)]
    fn slides_on<H: Length<S>>(&self, s: &mut PlantState<S>, u: S, h: H) -> bool {
        let zero = S::Real::ZERO;
        let rubs = self.acts.includes(Acts::DRY_FRICTION);
        let speeds = |m: &Three<S>| [m.rotor[1].real(), m.x.alpha_dot.real()];
        let start = Three {
            x: s.x,
            rotor: s.rotor,
        };
        let before = speeds(&start);
        if rubs && before.contains(&zero) {
            return false;
        }
        let dry = if rubs {
            let way = |speed: S::Real| {
                if speed < zero {
                    Dry::Backward
                } else {
                    Dry::Forward
                }
            };
            before.map(way)
        } else {
            [Dry::Absent; 2]
        };
        let driven = self.driven(s, u, h);
        let field = Twisting {
            plant: self,
            load: self.load(),
            driven: &driven,
            clocks: clocks(s, h),
            dry,
        };
        let end = rk4(start, h, &field);
        let after = speeds(&end);
        if rubs && [0, 1].iter().any(|&i| turns(before[i], after[i])) {
            return false;
        }
        (s.x, s.rotor) = (end.x, end.rotor);
        (s.voltage, s.ringing) = (driven.voltage, driven.ringing);
        s.t += h.of(S::ONE);
        true
    }
}
