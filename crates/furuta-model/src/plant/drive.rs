//! Rotor and arm as two bodies, with play or a spring between them.

use super::state::Contact;
use super::{MAX_SUBSTEPS, Plant, PlantState};
use crate::effects::{Clock, Drive};
use crate::integrate::Vector;
use crate::params::Coefficients;
use crate::scalar::Scalar;
use crate::state::State;
use core::ops::Add;

/// How many steps of the integrator one radian of the coupling's ringing takes: RK4 then shifts it by 2e-4 rad per period.
const STEPS_PER_RADIAN: f64 = 4.0;

/// Torques below this share of the rig's own are rounding.
const NOTHING: f64 = 1e-5;

/// Arm, pendulum and rotor; or their rates.
#[derive(Copy, Clone, Debug)]
pub(super) struct TwoBody<S> {
    pub(super) x: State<S>,
    pub(super) rotor: [S; 2],
}

impl<S: Scalar> Add for TwoBody<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self {
            x: self.x + o.x,
            rotor: [self.rotor[0] + o.rotor[0], self.rotor[1] + o.rotor[1]],
        }
    }
}

impl<S: Scalar> Vector<S> for TwoBody<S> {
    #[inline(always)]
    fn each(self, f: impl Fn(S) -> S) -> Self {
        Self {
            x: self.x.map(&f),
            rotor: self.rotor.map(f),
        }
    }
}

impl<S: Scalar> Drive<S> {
    /// This drive with what another effect adds: play and spring may come together, and then share the rotor's inertia of the one that is given
    /// last.
    pub(super) fn with(self, other: Self) -> Self {
        if other == Self::RIGID {
            return self;
        }
        Self {
            gap: self.gap + other.gap,
            stiffness: self.stiffness + other.stiffness,
            damping: self.damping + other.damping,
            motor_share: other.motor_share,
            encoder_on_motor: self.encoder_on_motor || other.encoder_on_motor,
        }
    }

    /// Whether rotor and arm are coupled by a spring rather than by rigid flanks.
    #[inline(always)]
    pub(super) fn elastic(&self) -> bool {
        self.stiffness.real() > S::Real::ZERO
    }

    /// Whether there is play.
    #[inline(always)]
    pub(super) fn loose(&self) -> bool {
        self.gap.real() > S::Real::ZERO
    }

    /// Half the play, rad.
    #[inline(always)]
    pub(super) fn half_gap(&self) -> S {
        self.gap.scale(S::Real::from_f64(0.5))
    }
}

impl<S: Scalar> Plant<S> {
    /// The rotor's inertia, kg m².
    #[inline(always)]
    pub(super) fn rotor_inertia(&self) -> S {
        self.drive.motor_share * self.coefficients.hub
    }

    /// What the arm and the pendulum are without rotor and motor.
    #[inline(always)]
    pub(super) fn load(&self) -> Coefficients<S> {
        let rotor = self.rotor_inertia();
        Coefficients {
            arm: self.coefficients.arm - rotor,
            hub: self.coefficients.hub - rotor,
            drive: S::ZERO,
            arm_damping: S::ZERO,
            ..self.coefficients
        }
    }

    /// Torque that the motor leaves the rotor, its friction taken off, N m.
    #[inline(always)]
    pub(super) fn shaft_torque(&self, volts: S, speed: S) -> S {
        self.coefficients.drive * volts - self.coefficients.arm_damping * speed
    }

    /// Torque that a spring passes from rotor to arm, N m; none while they are free.
    #[inline(always)]
    pub(super) fn spring_torque(&self, m: &TwoBody<S>, contact: Contact) -> S {
        let d = &self.drive;
        if !d.elastic() || (d.loose() && contact == Contact::Free) {
            return S::ZERO;
        }
        let twist = m.rotor[0] - m.x.theta - contact.side::<S>() * d.half_gap();
        d.stiffness * twist + d.damping * (m.rotor[1] - m.x.theta_dot)
    }

    /// Torque that rigid flanks pass from rotor to arm while both turn together, N m.
    #[inline(always)]
    pub(super) fn flank_torque(&self, volts: S, speed: S, acceleration: S) -> S {
        self.shaft_torque(volts, speed) - self.rotor_inertia() * acceleration
    }

    /// Puts the rotor where it would be if the torque that the arm needs had been passed on for long.
    pub(super) fn engage(&self, s: &mut PlantState<S>) {
        let clock = Clock {
            run: s.run,
            t: s.t,
            within: s.t,
        };
        let c = &self.coefficients;
        let balance = self.balance_outside(c, clock, &s.x, s.voltage, s.memory, None);
        let speed = [s.x.theta_dot, s.x.alpha_dot];
        let (acceleration, _) = balance.solve(balance.decide(speed, [None; 2]));
        let torque = self.flank_torque(s.voltage, s.x.theta_dot, acceleration[0]);
        let d = &self.drive;
        // What rounding leaves of no torque at all does not take the rotor out of the middle.
        let nothing = (c.drive * s.voltage).abs() + c.weight;
        let pushes = torque.abs().real() > nothing.real() * S::Real::from_f64(NOTHING);
        s.contact = if d.loose() && pushes {
            Contact::of(torque)
        } else {
            Contact::Free
        };
        let mut angle = s.x.theta + s.contact.side::<S>() * d.half_gap();
        if d.elastic() && (pushes || !d.loose()) {
            angle += torque / d.stiffness;
        }
        s.rotor = [angle, s.x.theta_dot];
    }

    /// The coupling's own frequency and the highest that can be followed at this sample period, rad/s.
    pub(super) fn coupling_frequency(&self, period: f64) -> (f64, f64) {
        #[allow(clippy::cast_precision_loss)]
        let highest = MAX_SUBSTEPS as f64 / STEPS_PER_RADIAN / period;
        (self.ringing().value(), highest)
    }

    /// The fastest rate of a flexible coupling, 1/s; zero for a rigid one.
    fn ringing(&self) -> S::Real {
        let d = &self.drive;
        if !d.elastic() {
            return S::Real::ZERO;
        }
        let (rotor, load) = (self.rotor_inertia().real(), self.load());
        // Arm and pendulum together are at their lightest where the pendulum's reaction is largest: upright or hanging.
        let coupling = load.coupling.real();
        let arm = load.arm.real() - coupling * coupling / load.pendulum.real();
        let inverse = S::Real::ONE / rotor + S::Real::ONE / arm;
        let spring = (d.stiffness.real() * inverse).sqrt();
        let damper = d.damping.real() * inverse;
        if spring < damper { damper } else { spring }
    }

    /// How many steps of the integrator a stretch of `h` seconds takes.
    #[must_use]
    pub fn substeps(&self, h: S::Real) -> usize {
        if !self.drive.elastic() {
            return 1;
        }
        let wanted = libm::ceil((self.ringing() * h).value() * STEPS_PER_RADIAN);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let steps = wanted as usize; // saturates; NaN is 0
        steps.clamp(1, MAX_SUBSTEPS)
    }
}
