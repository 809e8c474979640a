//! Rotor and arm as two bodies, with backlash or a spring between them.

use super::state::{Contact, FIRST_OWN, STATES, Twist};
use super::{MAX_SUBSTEPS, Plant, PlantState};
use crate::dynamics::Angle;
use crate::effects::{Acts, Clock, Drive, Effect, Instant};
use crate::integrate::Vector;
use crate::params::Coefficients;
use crate::scalar::Scalar;
use crate::state::State;
use core::ops::Add;

/// How many steps of the integrator one radian of the coupling's ringing takes: RK4 then shifts it by 2e-4 rad per
/// period.
const STEPS_PER_RADIAN: f64 = 4.0;

/// Torques below this share of the rig's own are rounding.
const NOTHING: f64 = 1e-5;

/// Arm, pendulum and rotor, and the states of effects that have some; or their rates.
#[derive(Copy, Clone, Debug)]
pub(super) struct TwoBody<S> {
    pub(super) x: State<S>,
    pub(super) rotor: [S; 2],
    /// How far a cable that relaxes is stretched, rad; the voltage across the winding's resistance, V.
    /// Behind these two those of users' own laws.
    pub(super) inner: [S; STATES],
    /// Whether the plant has such laws: else their states are not integrated.
    pub(super) own: bool,
}

/// What torques depend on beside the bodies' motion: the time, the voltage at the motor (V), what friction remembers,
/// and the end stop that the arm presses on.
#[derive(Copy, Clone, Debug)]
pub(super) struct Moment<S> {
    pub(super) clock: Clock<S>,
    pub(super) volts: S,
    pub(super) memory: S,
    pub(super) pressed: Contact,
}

impl<S: Scalar> Add for TwoBody<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self {
            x: self.x + o.x,
            rotor: [self.rotor[0] + o.rotor[0], self.rotor[1] + o.rotor[1]],
            inner: self.each_inner(|i, x| x + o.inner[i]),
            own: self.own,
        }
    }
}

impl<S: Scalar> TwoBody<S> {
    /// The inner states that there are through `f`.
    #[inline(always)]
    fn each_inner(&self, f: impl Fn(usize, S) -> S) -> [S; STATES] {
        let mut inner = self.inner;
        for (i, x) in inner.iter_mut().enumerate().take(FIRST_OWN) {
            *x = f(i, *x);
        }
        if self.own {
            for (i, x) in inner.iter_mut().enumerate().skip(FIRST_OWN) {
                *x = f(i, *x);
            }
        }
        inner
    }
}

impl<S: Scalar> Vector<S> for TwoBody<S> {
    #[inline(always)]
    fn each(self, f: impl Fn(S) -> S) -> Self {
        Self {
            x: self.x.map(&f),
            rotor: self.rotor.map(&f),
            inner: self.each_inner(|_, x| f(x)),
            own: self.own,
        }
    }
}

/// Of which bodies the torques are asked.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Bodies {
    /// Rotor, arm and pendulum, the first two as one body.
    Whole,
    /// Arm and pendulum without the rotor.
    Load,
    /// The rotor alone.
    Rotor,
}

impl Bodies {
    /// Whether an effect acts on them.
    #[inline(always)]
    pub(super) fn feel<S: Scalar>(self, effect: &Effect<S>) -> bool {
        match self {
            Self::Whole => true,
            Self::Load => !effect.is_on_shaft(),
            Self::Rotor => effect.is_on_shaft(),
        }
    }
}

/// What turns the rotor: torques beside what it passes on, and the largest torque of dry friction, N m.
#[derive(Copy, Clone, Debug)]
pub(super) struct Shaft<S> {
    pub(super) free: S,
    pub(super) limit: S,
}

impl<S: Scalar> Drive<S> {
    /// This drive with what another effect adds: backlash and spring may come together, and then share the rotor's
    /// inertia of the one that is given last.
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

    /// Whether there is backlash.
    #[inline(always)]
    pub(super) fn loose(&self) -> bool {
        self.gap.real() > S::Real::ZERO
    }

    /// Half the backlash, rad.
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

    /// What acts on the rotor at an angle and speed of its own: motor, damping, and the effects on this side.
    #[inline(always)]
    pub(super) fn shaft(&self, m: &TwoBody<S>, at: Moment<S>) -> Shaft<S> {
        let c = &self.coefficients;
        let effects = self.on_shaft(m, at);
        Shaft {
            free: c.drive * self.acting(m, at.volts) - c.arm_damping * m.rotor[1] + effects.free,
            ..effects
        }
    }

    /// What the effects on the motor's side do at the rotor's angle and speed.
    #[inline(always)]
    pub(super) fn on_shaft(&self, m: &TwoBody<S>, at: Moment<S>) -> Shaft<S> {
        if self.acts.includes(Acts::SHAFT) {
            return self.of_shaft_effects(m, at);
        }
        Shaft {
            free: S::ZERO,
            limit: S::ZERO,
        }
    }

    #[inline(always)]
    fn of_shaft_effects(&self, m: &TwoBody<S>, at: Moment<S>) -> Shaft<S> {
        let x = State::new(m.rotor[0], m.x.alpha, m.rotor[1], m.x.alpha_dot);
        let at = Instant {
            clock: at.clock,
            x: &x,
            angle: Angle::of(x.alpha),
            coefficients: &self.coefficients,
            memory: at.memory,
            volts: self.acting(m, at.volts),
        };
        let ([mut free, _], [limit, _]) = self.with_effects([S::ZERO; 2], &at, Bodies::Rotor);
        if self.acts.includes(Acts::STATE) {
            free += self.own_torque(&at, Bodies::Rotor, &m.inner)[0];
        }
        Shaft { free, limit }
    }

    /// Torque that a spring passes from rotor to arm, N m; none while they are free.
    #[inline(always)]
    pub(super) fn spring_torque(&self, m: &TwoBody<S>, contact: Contact) -> S {
        let d = &self.drive;
        if !d.elastic() || (d.loose() && contact == Contact::Free) {
            return S::ZERO;
        }
        let twist = m.rotor[0] - m.x.theta - contact.side::<S>() * d.half_gap();
        self.spring(twist, m.rotor[1] - m.x.theta_dot)
    }

    /// The same of a spring that is twisted by this angle (rad), and ever more at this speed (rad/s).
    #[inline(always)]
    pub(super) fn spring(&self, twist: S, speed: S) -> S {
        self.drive.stiffness * twist + self.drive.damping * speed
    }

    /// Torque that rigid flanks pass from rotor to arm while both turn together, N m. The arm's dry `friction` (N m)
    /// acts on the rotor.
    pub(super) fn flank_torque(
        &self,
        m: &TwoBody<S>,
        at: Moment<S>,
        friction: S,
        acceleration: S,
    ) -> S {
        self.shaft(m, at).free + friction - self.rotor_inertia() * acceleration
    }

    /// How the rotor stands and turns against the arm; nothing where both are one body.
    ///
    /// ```
    /// use furuta_model::{Effect, Plant, Rig, State, Twist};
    /// let rig = Rig::builtin("qube-servo-2").expect("built in");
    /// let coupling = Effect::new("drive.compliance", &[0.5, 1e-3, 0.4, 0.0])?;
    /// let plant: Plant<f64> = Plant::new(&rig.params, &[coupling])?;
    /// let mut s = plant.rest(State::hanging());
    /// assert!(plant.twist(&s).angle.abs() < 1e-9);
    /// let ahead = Twist { angle: 0.01, speed: -0.2 };
    /// plant.set_twist(&mut s, ahead);
    /// assert!((plant.twist(&s).angle - ahead.angle).abs() < 1e-15);
    /// plant.step(&mut s, 0.0, 0.002);
    /// assert!(s.x.theta_dot > 0.0); // the spring takes the arm along
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn twist(&self, s: &PlantState<S>) -> Twist {
        Twist {
            angle: (s.rotor[0] - s.x.theta).value(),
            speed: (s.rotor[1] - s.x.theta_dot).value(),
        }
    }

    /// Turns the rotor against the arm, which stays: at most to the end of the backlash where the flanks are rigid. See
    /// [`Plant::twist`].
    pub fn set_twist(&self, s: &mut PlantState<S>, twist: Twist) {
        let half = self.drive.half_gap();
        let angle = S::from_f64(twist.angle);
        // Angles that touch differ from half the backlash by rounding.
        let end = half.scale(S::Real::from_f64(1.0 - 1e-9));
        let beyond = self.drive.loose() && angle.abs().real() >= end.real();
        s.contact = if beyond {
            Contact::of(angle)
        } else {
            Contact::Free
        };
        let rigid = beyond && !self.drive.elastic();
        let (angle, speed) = if rigid {
            (s.contact.side::<S>() * half, S::ZERO)
        } else {
            (angle, S::from_f64(twist.speed))
        };
        s.rotor = [s.x.theta + angle, s.x.theta_dot + speed];
    }

    /// Puts the rotor where it would be if the torque that the arm needs had been passed on for long.
    pub(super) fn engage(&self, s: &mut PlantState<S>) {
        let clock = Clock {
            run: s.run,
            t: s.t,
            within: s.t,
        };
        let c = &self.coefficients;
        let at = Moment {
            clock,
            volts: s.voltage,
            memory: s.memory,
            pressed: s.pressed,
        };
        let speed = [s.x.theta_dot, s.x.alpha_dot];
        let m = TwoBody {
            x: s.x,
            rotor: [s.x.theta, s.x.theta_dot],
            inner: s.inner,
            own: self.acts.includes(Acts::STATE),
        };
        let balance = self.whole(&m, at);
        let (acceleration, friction) = balance.solve(balance.decide(speed, [None; 2]));
        let torque = self.flank_torque(&m, at, friction[0], acceleration[0]);
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

    /// Whether a spring sets the rotor apart from the arm: then it has an angle and a speed of its own.
    pub(crate) fn twists(&self) -> bool {
        self.acts.includes(Acts::DRIVE) && self.drive.elastic()
    }

    /// Whether the arm's encoder sits on the rotor.
    pub(crate) fn sees_rotor(&self) -> bool {
        self.drive.encoder_on_motor
    }

    /// Accelerations of arm, pendulum and rotor (rad/s²) at the run's start with `volts` at the motor, where a spring
    /// without backlash couples rotor and arm and nothing rubs dry. `rotor` is its angle (rad) and its speed (rad/s).
    pub(crate) fn twisted(&self, x: &State<S>, rotor: [S; 2], volts: S) -> [S; 3] {
        let m = TwoBody {
            x: *x,
            rotor,
            inner: [S::ZERO; STATES],
            own: false,
        };
        let at = Moment {
            clock: Clock::at(S::ZERO),
            volts,
            memory: S::ZERO,
            pressed: Contact::Free,
        };
        let passed = self.spring_torque(&m, Contact::Free);
        let balance = self.carried(&self.load(), &m, at, passed);
        let [arm, pendulum] = balance.inverse.times(balance.free);
        let turning = (self.shaft(&m, at).free - passed) / self.rotor_inertia();
        [arm, pendulum, turning]
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
        let inverse = S::Real::ONE / rotor + S::Real::ONE / lightest(&load);
        rate_of(d.stiffness.real(), d.damping.real(), inverse)
    }

    /// The fastest rate of end stops and inner states, 1/s; zero where there are none.
    fn inner_ringing(&self) -> S::Real {
        let mut fastest = S::Real::ZERO;
        let mut add = |rate: S::Real| {
            if fastest < rate {
                fastest = rate;
            }
        };
        if self.end_stop.is_there() {
            let body = if self.drive.elastic() || self.drive.loose() {
                self.load()
            } else {
                self.coefficients
            };
            let (k, d) = (self.end_stop.stiffness.real(), self.end_stop.damping.real());
            add(rate_of(k, d, S::Real::ONE / lightest(&body)));
        }
        for time in [self.relaxation.time_constant, self.winding.time_constant] {
            if time.real() > S::Real::ZERO {
                add(S::Real::ONE / time.real());
            }
        }
        fastest
    }

    /// How many steps of the integrator a stretch of `h` seconds takes; states of users' own laws may need more.
    #[must_use]
    pub fn substeps(&self, h: S::Real) -> usize {
        let (drive, inner) = (self.ringing(), self.inner_ringing());
        let rate = if drive < inner { inner } else { drive };
        steps_for(rate, h)
    }
}

/// How many steps of the integrator follow this rate (1/s) for `h` seconds.
pub(super) fn steps_for<R: Scalar<Real = R> + PartialOrd>(rate: R, h: R) -> usize {
    if rate <= R::ZERO {
        return 1;
    }
    let wanted = libm::ceil((rate * h).value() * STEPS_PER_RADIAN);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let steps = wanted as usize; // saturates; NaN is 0
    steps.clamp(1, MAX_SUBSTEPS)
}

/// The inertia (kg m²) of the arm with the pendulum where they are at their lightest together: where the pendulum's
/// reaction is largest, upright or hanging.
fn lightest<S: Scalar>(c: &Coefficients<S>) -> S::Real {
    let coupling = c.coupling.real();
    c.arm.real() - coupling * coupling / c.pendulum.real()
}

/// The faster rate (1/s) of a spring (N m/rad) and of a damper (N m s/rad) on an inverse inertia (1/(kg m²)).
fn rate_of<R: Scalar<Real = R> + PartialOrd>(stiffness: R, damping: R, inverse: R) -> R {
    let (spring, damper) = ((stiffness * inverse).sqrt(), damping * inverse);
    if spring < damper { damper } else { spring }
}
