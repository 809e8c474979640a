//! One sample period: the stretches between times at which something is known to jump, and RK4 over a smooth one.

use super::drive::{Bodies, Moment};
use super::friction::{Balance, turns};
use super::{EVENTS, MAX_DELAY_SAMPLES, Plant, PlantState};
use crate::effects::{Acts, Clock, Law};
use crate::integrate::{Field, Fixed, Length, Stage, Variable, rk4};
use crate::scalar::Scalar;
use crate::state::State;

/// What makes a stretch between known times more than one smooth step.
const FLOWS: Acts = Acts::DRY_FRICTION.and(MORE_THAN_SLIDING);

/// What makes it more than sliding.
const MORE_THAN_SLIDING: Acts = Acts::MEMORY
    .and(Acts::DRIVE)
    .and(Acts::CONTACT)
    .and(Acts::INNER);

/// With any of these, a whole sample period is more than sliding.
const UNLIKE_SLIDING: Acts = Acts::DELAY
    .and(Acts::JUMPS)
    .and(Acts::SPEED_LIMIT)
    .and(MORE_THAN_SLIDING);

/// What lies between the command and what drives the arm.
const COMMAND: Acts = Acts::LAG
    .and(Acts::VOLTAGE)
    .and(Acts::SPEED_LIMIT)
    .and(Acts::RESONANCE);

/// What drives the arm over a stretch.
pub(super) struct Driven<S> {
    /// At its start, middle and end.
    pub(super) volts: [S; 3],
    /// [`PlantState::voltage`] and [`PlantState::ringing`] at its end.
    pub(super) voltage: S,
    pub(super) ringing: [S; 2],
}

/// Whether the equations of motion are compiled into each stage of the integrator, as the usual step has them, so that
/// a caller compiled for vectors compiles them so.
const INLINED: bool = true;
/// Or called: one copy of them, where events are looked for.
const CALLED: bool = false;

impl<S: Scalar> Plant<S> {
    /// Advances by `h` seconds under the command `u` (V), held meanwhile: one step of the classical Runge-Kutta method,
    /// cut where the equations jump.
    #[inline(always)]
    pub fn step(&self, s: &mut PlantState<S>, u: S, h: S::Real) {
        // In lanes there are none: `Plant::new` sees to it.
        if S::LANES == 1 && self.acts.touches(EVENTS) {
            if self.only_twists() {
                self.twist_on(s, u, h);
            } else if self.acts.touches(UNLIKE_SLIDING) || !self.slide::<_, INLINED>(s, u, Fixed(h))
            {
                self.step_through_events(s, u, h);
            }
        } else {
            self.smooth::<_, INLINED>(s, u, Fixed(h));
        }
        if S::LANES == 1 && self.acts.includes(Acts::SENSOR_DELAY) {
            self.remember_reading(s, h);
        }
    }

    #[inline(never)]
    fn step_through_events(&self, s: &mut PlantState<S>, u: S, h: S::Real) {
        if !self.acts.includes(Acts::DELAY) {
            self.stretch(s, u, Fixed(h));
            return;
        }
        s.commands.push(u);
        // The older command still acts for `first` seconds of this step.
        let (samples, first) = split(self.delay, h);
        let (older, newer) = (s.commands.ago(samples + 1), s.commands.ago(samples));
        if older == newer {
            self.stretch(s, newer, Fixed(h));
            return;
        }
        if first.real() > S::Real::ZERO {
            self.stretch(s, older, Variable(first));
        }
        self.stretch(s, newer, Variable(S::from_real(h) - first));
    }

    /// A stretch with one command, cut where an effect jumps at a known time.
    fn stretch<H: Length<S>>(&self, s: &mut PlantState<S>, u: S, h: H) {
        if !self.acts.includes(Acts::JUMPS) {
            self.flow_or_smooth(s, u, h);
            return;
        }
        let end = s.t + h.of(S::ONE);
        let mut cut = false;
        while let Some(edge) = self.jump_before(s, end) {
            self.flow_or_smooth(s, u, Variable(edge - s.t));
            // Exactly there, or rounding would find the same edge again.
            s.t = edge;
            cut = true;
        }
        if cut {
            if end.real() > s.t.real() {
                self.flow_or_smooth(s, u, Variable(end - s.t));
            }
        } else {
            self.flow_or_smooth(s, u, h);
        }
    }

    /// The first jump after now and before `end`.
    fn jump_before(&self, s: &PlantState<S>, end: S) -> Option<S> {
        self.effects
            .iter()
            .filter_map(|e| e.jump_after(s.run, s.t))
            .filter(|edge| edge.real() < end.real())
            .reduce(|a, b| if b.real() < a.real() { b } else { a })
    }

    /// A call, for `stretch` has three of them.
    #[inline(never)]
    fn flow_or_smooth<H: Length<S>>(&self, s: &mut PlantState<S>, u: S, h: H) {
        if self.acts.includes(Acts::SPEED_LIMIT) {
            self.within_speed(s, u, h);
        } else {
            self.at_any_speed(s, u, h);
        }
    }

    /// A stretch in which the arm may be as fast as it will.
    #[inline(never)]
    pub(super) fn at_any_speed<H: Length<S>>(&self, s: &mut PlantState<S>, u: S, h: H) {
        if !self.acts.touches(FLOWS) {
            self.smooth::<_, CALLED>(s, u, h);
            return;
        }
        // Without others `step` has tried that.
        if !self.acts.touches(MORE_THAN_SLIDING)
            && self.acts.touches(UNLIKE_SLIDING)
            && self.slide::<_, CALLED>(s, u, h)
        {
            return;
        }
        let parts = self.parts(s, h.of(S::ONE).real());
        let part = h.part(parts);
        for _ in 0..parts {
            self.flow(s, u, part);
        }
    }

    /// How many steps of the integrator a stretch of `h` seconds from here takes.
    fn parts(&self, s: &PlantState<S>, h: S::Real) -> usize {
        let parts = self.substeps(h);
        if !self.acts.includes(Acts::STATE) {
            return parts;
        }
        let at = Moment {
            clock: Clock {
                run: s.run,
                t: s.t,
                within: s.t,
            },
            volts: s.voltage,
            memory: s.memory,
            pressed: s.pressed,
        };
        parts.max(self.own_steps(&self.body(s), &at, h))
    }

    /// One step in which what dry friction acts on slides on as it does: the usual case, at little more than the cost
    /// of a smooth step. Where an axis rests or turns nothing is done, and the answer is `false`.
    #[inline(always)]
    fn slide<H: Length<S>, const HOW: bool>(&self, s: &mut PlantState<S>, u: S, h: H) -> bool {
        let zero = S::Real::ZERO;
        let before = [s.x.theta_dot.real(), s.x.alpha_dot.real()];
        if before[0] == zero || before[1] == zero {
            return false;
        }
        let driven = self.driven(s, u, h);
        let volts = driven.volts;
        let field = Sliding::<S, HOW> {
            plant: self,
            volts,
            clocks: clocks(s, h),
            backward: before.map(|v| v < zero),
        };
        let x = rk4(s.x, h, &field);
        let after = [x.theta_dot.real(), x.alpha_dot.real()];
        let turns = |i: usize| turns(before[i], after[i]);
        if turns(0) || turns(1) {
            // An axis without friction may turn.
            let limit = self.limit_now(s, field.clocks[0], volts[0]);
            let sticks = |i: usize| turns(i) && limit[i].real() > zero;
            if sticks(0) || sticks(1) {
                return false;
            }
        }
        s.x = x;
        (s.voltage, s.ringing) = (driven.voltage, driven.ringing);
        s.t += h.of(S::ONE);
        true
    }

    /// The largest torques of dry friction, N m.
    #[inline(never)]
    fn limit_now(&self, s: &PlantState<S>, clock: Clock<S>, volts: S) -> [S; 2] {
        self.balance(
            &self.coefficients,
            clock,
            &s.x,
            volts,
            S::ZERO,
            Bodies::Whole,
        )
        .limit
    }

    #[inline(always)]
    fn balance_of_whole<const HOW: bool>(
        &self,
        clock: Clock<S>,
        x: &State<S>,
        volts: S,
    ) -> Balance<S> {
        let (c, of) = (&self.coefficients, Bodies::Whole);
        if HOW == INLINED {
            self.balance(c, clock, x, volts, S::ZERO, of)
        } else {
            self.balance_outside(c, clock, x, volts, S::ZERO, of)
        }
    }

    /// One step without events.
    #[inline(always)]
    fn smooth<H: Length<S>, const HOW: bool>(&self, s: &mut PlantState<S>, u: S, h: H) {
        let driven = self.driven(s, u, h);
        let clocks = clocks(s, h);
        let field = Smooth::<S, HOW> {
            plant: self,
            volts: driven.volts,
            clocks,
        };
        s.x = rk4(s.x, h, &field);
        (s.voltage, s.ringing) = (driven.voltage, driven.ringing);
        s.t += h.of(S::ONE);
    }

    /// What drives the arm over a stretch under the command `u`.
    #[inline(always)]
    pub(super) fn driven<H: Length<S>>(&self, s: &PlantState<S>, u: S, h: H) -> Driven<S> {
        let volts = self.voltages(s, u, h);
        let voltage = volts[Stage::End as usize];
        if !self.acts.includes(Acts::RESONANCE) {
            return Driven {
                volts,
                voltage,
                ringing: s.ringing,
            };
        }
        // Exact for a held command; one that lags is held over each half at its mean.
        let half = h.half().of(S::ONE);
        let mean = |a: S, b: S| (a + b).scale(S::Real::from_f64(0.5));
        let r = &self.resonance;
        let middle = r.after(s.ringing, mean(volts[0], volts[1]), half);
        let ringing = r.after(middle, mean(volts[1], volts[2]), half);
        Driven {
            volts: [s.ringing, middle, ringing].map(|state| r.output(state)),
            voltage,
            ringing,
        }
    }

    /// The motor's voltage at the start, middle and end of a stretch.
    #[inline(always)]
    fn voltages<H: Length<S>>(&self, s: &PlantState<S>, u: S, h: H) -> [S; 3] {
        let half = h.half().of(S::ONE);
        if !self.acts.touches(COMMAND) {
            return [u; 3];
        }
        if s.at_limit {
            return [S::ZERO; 3];
        }
        let target = self.mapped(s.t + half, u);
        if !self.acts.includes(Acts::LAG) {
            let length = h.of(S::ONE);
            return [self.mapped(s.t, u), target, self.mapped(s.t + length, u)];
        }
        // Exact for a held command, for any time constant: v = target + (v0 - target) e^(-t / time constant).
        let decay = (-(half / self.lag)).exp();
        let middle = (s.voltage - target) * decay;
        [s.voltage, target + middle, target + middle * decay]
    }

    /// The command that acts, on average over a step, after the delay.
    pub(super) fn delayed(&self, s: &PlantState<S>, u: S, h: S::Real) -> S {
        if !self.acts.includes(Acts::DELAY) {
            return u;
        }
        let (samples, first) = split(self.delay, h);
        let (older, newer) = (s.commands.ago(samples + 1), s.commands.ago(samples));
        newer + (older - newer) * first / S::from_real(h)
    }

    fn remember_reading(&self, s: &mut PlantState<S>, h: S::Real) {
        let [theta, alpha] = self.prompt_reading(s);
        let seen = self.seen(s);
        let scale = |speed: S| speed.scale(h);
        s.readings
            .push([theta, alpha, scale(seen.theta_dot), scale(seen.alpha_dot)]);
        s.period = h;
    }

    /// The angles that reach the encoders' output now: a cubic between two samples.
    pub(super) fn late_reading(&self, s: &PlantState<S>) -> [S; 2] {
        let (samples, rest) = split(self.sensor_delay, s.period);
        let (old, new) = (s.readings.ago(samples + 1), s.readings.ago(samples));
        let back = rest / S::from_real(s.period);
        [0, 1].map(|i| {
            let (fall, before, after) = (old[i] - new[i], old[i + 2], new[i + 2]);
            let square = fall.scale(S::Real::from_f64(3.0)) + after + after + before;
            let cube = -(after + before + fall + fall);
            new[i] + back * (back * (back * cube + square) - after)
        })
    }
}

/// The equations of motion without events.
struct Smooth<'a, S, const HOW: bool> {
    plant: &'a Plant<S>,
    volts: [S; 3],
    clocks: [Clock<S>; 3],
}

impl<S: Scalar, const HOW: bool> Field<State<S>> for Smooth<'_, S, HOW> {
    #[inline(always)]
    fn slope(&self, stage: Stage, x: &State<S>) -> State<S> {
        let (i, p) = (stage as usize, self.plant);
        let balance = p.balance_of_whole::<HOW>(self.clocks[i], x, self.volts[i]);
        let a = balance.inverse.times(balance.free);
        State::new(x.theta_dot, x.alpha_dot, a[0], a[1])
    }
}

/// The equations of motion with both axes sliding.
struct Sliding<'a, S, const HOW: bool> {
    plant: &'a Plant<S>,
    volts: [S; 3],
    clocks: [Clock<S>; 3],
    backward: [bool; 2],
}

impl<S: Scalar, const HOW: bool> Field<State<S>> for Sliding<'_, S, HOW> {
    #[inline(always)]
    fn slope(&self, stage: Stage, x: &State<S>) -> State<S> {
        let (i, p) = (stage as usize, self.plant);
        let (clock, volts) = (self.clocks[i], self.volts[i]);
        let b = p.balance_of_whole::<HOW>(clock, x, volts);
        let torque = [0, 1].map(|i| {
            if self.backward[i] {
                b.free[i] + b.limit[i]
            } else {
                b.free[i] - b.limit[i]
            }
        });
        let a = b.inverse.times(torque);
        State::new(x.theta_dot, x.alpha_dot, a[0], a[1])
    }
}

/// The times of a stretch's start, middle and end.
#[inline(always)]
pub(super) fn clocks<S: Scalar, H: Length<S>>(s: &PlantState<S>, h: H) -> [Clock<S>; 3] {
    let within = s.t + h.half().of(S::ONE);
    [s.t, within, s.t + h.of(S::ONE)].map(|t| Clock {
        run: s.run,
        t,
        within,
    })
}

/// A delay as whole samples and the seconds left over.
fn split<S: Scalar>(delay: S, h: S::Real) -> (usize, S) {
    let whole = libm::floor(delay.value() / h.value());
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let samples = (whole as usize).min(MAX_DELAY_SAMPLES + 1); // saturates; NaN is 0
    (
        samples,
        delay - S::from_real(h).scale(S::Real::from_f64(whole)),
    )
}
