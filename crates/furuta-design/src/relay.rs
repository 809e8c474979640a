//! Tuning of the PID pair by a relay: what a rig's motor is worth is measured in closed loop, not taken from a model.
//!
//! In place of the pendulum's controller a relay commands `d` or `-d` volts by the sign of the pendulum's angle, its
//! hysteresis set against noise (K. J. Åström, T. Hägglund, *Automatic tuning of simple regulators with
//! specifications on phase and amplitude margins*, Automatica 20, 1984). The pendulum then swings at the frequency at
//! which the loop from command to angle turns by half a turn, about upright, by an amplitude that says what the loop's
//! gain is there.
//!
//! Why upright, and why the pendulum's angle: the pair works there, and there alone, so that is the loop whose ultimate
//! gain limits it. The arm's angle over the hanging pendulum would swing as well, but no controller of the catalogue
//! works on that loop. The arm is not held meanwhile: about upright it drifts by what the pendulum's place lets it,
//! with a time constant of seconds, and the experiment takes one to three.
//!
//! An encoder's step is a hysteresis by itself: the angle that it reports changes only where the pendulum has moved by
//! a step. Where the pendulum swings by few steps, the oscillation is slower than an ideal relay's, and the gain that
//! is found smaller; [`Ultimate::phase`] says by how much the loop turns there.

use furuta_ctrl::estimators::{AnyEstimator, Estimator};
use furuta_ctrl::{Config, Site};
use furuta_model::linear_plant::{Amplitudes, Hold, Load, equilibrium, smooth};
use furuta_model::{PlantError, Rig};
use nalgebra::Complex;
use std::f64::consts::{PI, TAU};

use crate::rig_loop::{Law, LoopError, RigLoop};

/// Periods that pass before any is counted.
const SETTLING: usize = 4;
/// Periods that are counted.
const COUNTED: usize = 12;
/// The counted periods' halves may differ by this share.
const STEADY: f64 = 0.1;
/// Share of the command limit that the relay commands if nothing is said.
const AMPLITUDE: f64 = 0.3;
/// Beyond this angle from where it rests the pendulum has fallen, rad.
const FALLEN: f64 = 0.5;
/// Share of the ultimate gain that the pendulum's proportional gain becomes.
const GAIN: f64 = 0.25;
/// Derivative time, in units of one over the pendulum's frequency.
const DERIVATIVE: f64 = 0.6;
/// The arm's triple pole, in units of the pendulum's frequency.
const ARM: f64 = 0.14;

/// A relay experiment.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Relay {
    /// What the relay commands either way, V (or the unit of the rig's command, here and below); `None`: three tenths
    /// of the command limit.
    pub amplitude: Option<f64>,
    /// Angle beyond which it switches, rad; 0: wherever the encoder shows another sign.
    pub hysteresis: f64,
    /// Sample period, s.
    pub period: f64,
    /// The experiment ends after this time at the latest, s.
    pub time_limit: f64,
}

impl Default for Relay {
    /// 500 Hz, no hysteresis, at most 10 s.
    fn default() -> Self {
        Self {
            amplitude: None,
            hysteresis: 0.0,
            period: 0.002,
            time_limit: 10.0,
        }
    }
}

/// What a relay has found.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Ultimate {
    /// Ultimate gain, V/rad: the fundamental of the command over that of the angle.
    pub gain: f64,
    /// Ultimate period, s.
    pub period: f64,
    /// The same gain by the relay's describing function, `4 d / (pi a)`, `a` the angle's amplitude, V/rad.
    pub described: f64,
    /// Phase of the command's fundamental against the angle's with its sign changed, rad: what hysteresis and samples
    /// take; 0 for a relay without either.
    pub phase: f64,
    /// The relay's command, V.
    pub amplitude: f64,
    /// Its hysteresis, rad.
    pub hysteresis: f64,
    /// Largest angle of the pendulum from rest while periods were counted, rad.
    pub lean: f64,
    /// How far the arm went from where it began, rad.
    pub arm: f64,
    /// How long it took, s.
    pub time: f64,
}

/// Gains of the pair, as `kind = "pid"` has them.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Gains {
    /// `[kp, ki, kd]` of the pendulum's angle: V/rad, V/(rad s), V s/rad.
    pub pendulum: [f64; 3],
    /// `[kp, ki, kd]` from the arm's error to the pendulum's angle: rad/rad, 1/s, s.
    pub arm: [f64; 3],
}

/// Why a relay has found nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RelayError {
    /// A number outside its range.
    #[error("relay: {name} = {value} {unit} is outside the allowed range ({min}, {max}] {unit}")]
    Range {
        /// What.
        name: &'static str,
        /// As given.
        value: f64,
        /// Not even this.
        min: f64,
        /// At most this.
        max: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// The pendulum fell.
    #[error(
        "relay: with {amplitude} {unit} the pendulum fell after {time:.3} s and {periods} periods: try a larger \
         amplitude, which the encoder's steps disturb less, a smaller hysteresis, or more samples per second"
    )]
    Fell {
        /// The relay's command.
        amplitude: f64,
        /// Its unit.
        unit: &'static str,
        /// When, s.
        time: f64,
        /// Periods seen.
        periods: usize,
    },
    /// Too few periods within the time limit.
    #[error(
        "relay: {periods} of {needed} periods within {limit} s: the amplitude may be too small for the friction, or \
         the hysteresis too wide"
    )]
    Late {
        /// Periods seen.
        periods: usize,
        /// Periods needed.
        needed: usize,
        /// The time limit, s.
        limit: f64,
    },
    /// The periods do not become equal.
    #[error(
        "relay: the periods are {first:.4} s, then {last:.4} s: no steady oscillation; a larger amplitude may help against \
         friction"
    )]
    Unsteady {
        /// Mean of the first half, s.
        first: f64,
        /// Mean of the last half, s.
        last: f64,
    },
    /// There is nothing to find.
    #[error(
        "relay: the loop from command to the pendulum's angle never turns by just half a turn, so a relay does not \
         keep the pendulum swinging (as where the command is the arm's acceleration): design the pair by the model"
    )]
    NoUltimate,
    /// The rig cannot be stepped like this.
    #[error("{0}")]
    Plant(#[from] PlantError),
    /// The gains do not hold this rig.
    #[error(
        "relay: with the gains that it asks for the linear loop grows by {growth:.3} 1/s ({effects}): design the pair \
         by the model, `furuta design pid` without --relay, or take off what the rig file names"
    )]
    Unstable {
        /// The fastest growing pole's real part, 1/s.
        growth: f64,
        /// The rig's effects, or that there are none.
        effects: String,
    },
    /// Nothing rests upright, or there is no linear model.
    #[error("{0}")]
    Loop(#[from] LoopError),
}

impl Relay {
    /// The experiment on the nonlinear model of `rig` with its effects and encoders; a command acts from the sample
    /// after the one it is decided at, as in a real loop. The linear model is asked only whether there is anything to
    /// find.
    ///
    /// # Errors
    /// See [`RelayError`].
    ///
    /// ```
    /// use furuta_design::relay::{Relay, ultimate};
    /// use furuta_model::Rig;
    /// let rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
    /// let relay = Relay::default();
    /// let found = relay.run(&rig)?;
    /// // Where the loop turns by what the encoder's steps leave, the linear model has the same gain.
    /// let (gain, period) = ultimate(&rig, relay.period, found.phase)?.ok_or("it has one")?;
    /// assert!((found.gain / gain - 1.0).abs() < 0.03 && (found.period / period - 1.0).abs() < 0.03);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn run(&self, rig: &Rig) -> Result<Ultimate, RelayError> {
        let limit = rig.params.motor.command_limit;
        let unit = rig.params.motor.actuation.unit();
        let amplitude = self.amplitude.unwrap_or(AMPLITUDE * limit);
        let hysteresis = self.hysteresis;
        for (name, value, min, max, unit) in [
            ("amplitude", amplitude, 0.0, limit, unit),
            ("hysteresis", hysteresis, -f64::MIN_POSITIVE, 0.1, "rad"),
            ("period", self.period, 0.0, 0.1, "s"),
            ("time_limit", self.time_limit, 0.0, 600.0, "s"),
        ] {
            if !(value > min && value <= max) {
                let min = min.max(0.0);
                return Err(RelayError::Range {
                    name,
                    value,
                    min,
                    max,
                    unit,
                });
            }
        }
        if ultimate(rig, self.period, 0.0)?.is_none() {
            return Err(RelayError::NoUltimate);
        }
        let plant = rig.try_plant()?;
        plant.check_period(self.period)?;
        let rest = equilibrium(&smooth(&plant), Hold::Arm(0.0)).map_err(LoopError::from)?;
        let mut state = plant.rest(rest.x);
        let (mut held, mut u) = (rest.command, amplitude);
        let mut seen: Vec<[f64; 2]> = Vec::new();
        let mut rises = Vec::new();
        let needed = SETTLING + COUNTED;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let samples = (self.time_limit / self.period) as usize;
        let at = |k: usize| k as f64 * self.period;
        let mut furthest: f64 = 0.0;
        for k in 0..samples {
            let [_, alpha] = rig.sensors.quantised(plant.measure(&state));
            let error = rest.x.alpha - alpha;
            let before = u;
            if error > hysteresis {
                u = amplitude;
            } else if error < -hysteresis {
                u = -amplitude;
            }
            if u > before {
                rises.push(k);
                if rises.len() > needed {
                    break;
                }
            }
            seen.push([u, error]);
            furthest = furthest.max((state.x.theta - rest.x.theta).abs());
            if !(error.abs() < FALLEN) {
                return Err(RelayError::Fell {
                    amplitude,
                    unit,
                    time: at(k),
                    periods: rises.len().saturating_sub(1),
                });
            }
            plant.step(&mut state, held, self.period);
            held = (rest.command + u).clamp(-limit, limit);
        }
        if rises.len() <= needed {
            return Err(RelayError::Late {
                periods: rises.len().saturating_sub(1),
                needed,
                limit: self.time_limit,
            });
        }
        let (from, middle, to) = (
            rises[SETTLING],
            rises[SETTLING + COUNTED / 2],
            rises[needed],
        );
        let half = (COUNTED / 2) as f64;
        let (first, last) = (at(middle - from) / half, at(to - middle) / half);
        if (first - last).abs() > STEADY * first.max(last) {
            return Err(RelayError::Unsteady { first, last });
        }
        let counted = &seen[from..to];
        let n = counted.len() as f64;
        // The fundamental over whole periods: of a sampled linear loop, the ratio is its response there. Hann's window
        // keeps out what drifts meanwhile, the arm and with it the pendulum.
        let turn = TAU * COUNTED as f64 / n;
        let window = |k: usize| 1.0 - (TAU * k as f64 / n).cos();
        let [command, angle] = [0, 1].map(|i| {
            let parts = counted.iter().enumerate();
            let sum: Complex<f64> = parts
                .map(|(k, s)| Complex::from_polar(window(k) * s[i], -turn * k as f64))
                .sum();
            sum * (2.0 / n)
        });
        let lean = counted
            .iter()
            .fold(0.0, |most: f64, s| most.max(s[1].abs()));
        let swing = counted
            .iter()
            .fold([f64::INFINITY, -f64::INFINITY], |[low, high], s| {
                [low.min(s[1]), high.max(s[1])]
            });
        Ok(Ultimate {
            gain: (command / angle).norm(),
            period: at(counted.len()) / COUNTED as f64,
            described: 4.0 * amplitude / (PI * 0.5 * (swing[1] - swing[0])),
            phase: (command / angle).arg(),
            amplitude,
            hysteresis,
            lean,
            arm: furthest,
            time: at(to),
        })
    }
}

/// The ultimate gain (V/rad) and period (s) of the loop from command to pendulum's angle by the linear model, one
/// sample of delay included: where it turns by half a turn, less the relay's `phase` (rad, [`Ultimate::phase`]; 0: an
/// ideal relay). `None` where it never does.
///
/// # Errors
/// [`LoopError`].
pub fn ultimate(rig: &Rig, period: f64, phase: f64) -> Result<Option<(f64, f64)>, LoopError> {
    let law = Law::of_states([0.0, 1.0, 0.0, 0.0]);
    let of = RigLoop::new(rig, law, Some(period), &Amplitudes::NONE)?.delayed(period);
    // Turned such that what is looked for is real and below 0.
    let turned = |w: f64| of.response(w) * Complex::from_polar(1.0, phase);
    let slowest = Site::of(rig, period).frequency();
    let (steps, fastest) = (2000, PI / period);
    let at = |k: usize| slowest * (fastest / slowest).powf(k as f64 / steps as f64);
    for k in 0..steps {
        let (mut low, mut high) = (at(k), at(k + 1));
        let (from, to) = (turned(low), turned(high));
        if from.re < 0.0 && to.re < 0.0 && (from.im < 0.0) != (to.im < 0.0) {
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if (turned(middle).im < 0.0) == (from.im < 0.0) {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            return Ok(Some((1.0 / turned(low).norm(), TAU / low)));
        }
    }
    Ok(None)
}

impl Ultimate {
    /// Gains of the pair: a quarter of the ultimate gain, so that it may be four times as large; a derivative time of
    /// 0.6 over the pendulum's frequency; and an arm whose motion, seen from a pendulum that stands where it is asked
    /// to, has a triple pole at 0.14 times that frequency.
    ///
    /// Beside the relay's finding this takes two numbers that a stopwatch and a ruler give: the small-angle frequency
    /// of the hanging pendulum and the arm's length. Neither inertias nor the motor's constants are needed.
    ///
    /// A relay does not feel what holds the arm, slow as that is, and a pair made without it may let the rig fall. So
    /// springs, cables and a tilt that the rig file names are taken off: what pulls the arm by the arm's gains (its
    /// torque over the motor's), what pulls the pendulum with its weight.
    ///
    /// # Errors
    /// [`RelayError::Unstable`] where the linear loop at this sample period (s), the standard estimator in it,
    /// grows all the same.
    ///
    /// ```
    /// use furuta_design::relay::Relay;
    /// use furuta_model::{Effect, Rig};
    /// let mut rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
    /// let relay = Relay::default();
    /// let free = relay.run(&rig)?.gains(&rig, relay.period)?;
    /// rig.effects.push(Effect::new("arm.spring", &[0.02, 0.0])?);
    /// let held = relay.run(&rig)?.gains(&rig, relay.period)?;
    /// // The arm's gains are below 0: further below where a spring has to be pulled.
    /// assert!(held.arm[0] < free.arm[0]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn gains(&self, rig: &Rig, period: f64) -> Result<Gains, RelayError> {
        let plant = rig.try_plant()?;
        let c = plant.coefficients;
        let [on_arm, on_pendulum] = Load::of(&plant, Hold::Arm(0.0))
            .map_err(LoopError::from)?
            .slope;
        let weight = c.weight + on_pendulum[1];
        let frequency = (weight / c.pendulum).sqrt();
        let kp = GAIN * self.gain;
        // A pendulum that leans by a drives the arm by theta'' = -(weight/coupling) a, if it is to stay there.
        let push = -weight / c.coupling;
        let pole = ARM * frequency;
        let mut arm = [3.0 * pole * pole, pole.powi(3), 3.0 * pole].map(|g| g / push);
        // The command is -kp times what the arm's gains make of its angle and speed.
        for (gain, slope) in [(0, on_arm[0]), (2, on_arm[2])] {
            arm[gain] += slope / (c.drive * kp);
        }
        let gains = Gains {
            pendulum: [kp, 0.0, kp * DERIVATIVE / frequency],
            arm,
        };
        let closed = RigLoop::new(rig, gains.law(), Some(period), &Amplitudes::NONE)?;
        // As it is run: the standard estimator looks ahead over a delay.
        let estimator =
            AnyEstimator::<f64>::design(&Config::default().estimator, &Site::of(rig, period));
        let observed = estimator.ok().and_then(|e| closed.observed(e.linear()?));
        let growth = observed.map_or_else(|| closed.growth(), |o| o.growth());
        // What is not a number is no statement.
        if growth < 0.0 {
            return Ok(gains);
        }
        let ids: Vec<_> = rig.effects.iter().map(|e| e.spec().id).collect();
        let effects = match ids.len() {
            0 => "the rig has no effects".to_owned(),
            _ => format!("the rig has {}", ids.join(", ")),
        };
        Err(RelayError::Unstable { growth, effects })
    }
}

impl Gains {
    /// The linear law that the pair is near upright.
    #[must_use]
    pub fn law(&self) -> Law {
        let ([kp, _, kd], [arm_kp, arm_ki, arm_kd]) = (self.pendulum, self.arm);
        Law {
            gain: [kp * arm_kp, kp, kp * arm_kd, kd],
            integral: kp * arm_ki,
        }
    }
}
