//! Whether a control system holds a rig upright, tried on the nonlinear model before anything moves.
//!
//! The model has all effects of the rig file, its encoders and its command limit; a command acts from the sample after
//! the one it is decided at.

use furuta_ctrl::supervisor::{Fault, Mode, Supervisor};
use furuta_ctrl::{Config, ConfigError, Site};
use furuta_model::linear_plant::{Hold, equilibrium, smooth};
use furuta_model::{Rig, State};

use crate::supervised::Supervised;

/// How far from rest the pendulum starts, rad: less than any catch allows.
pub const LEAN: f64 = 0.02;
/// It has to be caught within this time, s.
pub const CAUGHT_WITHIN: f64 = 2.0;
/// How long it has to be held, s.
pub const HELD: f64 = 30.0;
/// Samples per second that a control loop may have, Hz.
pub const RATES: core::ops::RangeInclusive<f64> = 1.0..=20_000.0;
/// The arm's reference changes its sign this often, s.
const EVERY: f64 = 2.0;

/// How a rehearsal went.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Rehearsal {
    /// When the pendulum was let go, or was still not caught, s; `None`: it was held to the end.
    pub fell: Option<f64>,
    /// Why the motor was switched off, if it was.
    pub fault: Option<Fault>,
    /// The furthest that the arm and the pendulum were from zero over the last half of the time held, rad.
    pub swept: [f64; 2],
    /// Share of the samples at which the command was at its limit.
    pub at_limit: f64,
}

impl core::fmt::Display for Rehearsal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match (self.fell, self.fault) {
            (None, _) => write!(
                f,
                "held for {HELD} s from {LEAN} rad, in the end arm within {:.3} rad, pendulum within {:.4} rad",
                self.swept[0], self.swept[1]
            ),
            (Some(t), Some(fault)) => {
                write!(f, "from {LEAN} rad it is stopped after {t:.2} s: {fault}")
            }
            (Some(t), None) => write!(f, "from {LEAN} rad it falls within {t:.2} s"),
        }
    }
}

/// Rehearses the control system of `config` on `rig` at this sample period (s): from [`LEAN`] for [`HELD`], the arm
/// asked to be at plus and minus `arm_step` (rad) in turn.
///
/// # Errors
/// A control system that the rig cannot have, or a rig that cannot be stepped like this.
///
/// ```
/// use furuta_ctrl::{Config, controllers};
/// use furuta_design::rehearsal::rehearse;
/// use furuta_model::{Effect, Rig};
/// let mut rig = Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
/// let gain = furuta_ctrl::design::balance(&rig.params, 0.002)?.gain;
/// let fixed = controllers::settings("lqr").ok_or("no lqr")?.with("gain", gain.as_slice())?;
/// let config = Config::with_controller(fixed);
/// assert_eq!(rehearse(&config, &rig, 0.002, 0.0)?.fell, None);
/// // A cable that a gain without it cannot hold against.
/// rig.effects.push(Effect::new("arm.spring", &[0.5, 0.0])?);
/// assert!(rehearse(&config, &rig, 0.002, 0.0)?.fell.is_some());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn rehearse(
    config: &Config,
    rig: &Rig,
    period: f64,
    arm_step: f64,
) -> Result<Rehearsal, ConfigError> {
    let supervisor = Supervisor::design(config, &Site::of(rig, period))?;
    let bench = Supervised::new(&supervisor, rig, period)?;
    let rest = equilibrium(&smooth(&rig.try_plant()?), Hold::Arm(0.0))?;
    let mut run = bench.start(State::new(0.0, rest.x.alpha + LEAN, 0.0, 0.0));
    let count = (HELD / period).round() as usize;
    let mut told = Rehearsal {
        fell: None,
        fault: None,
        swept: [0.0; 2],
        at_limit: 0.0,
    };
    let limit = (1.0 - 1e-9) * rig.params.motor.command_limit;
    let (mut balanced, mut limited) = (false, 0_usize);
    for k in 0..count {
        let t = k as f64 * period;
        let is_up = ((t / EVERY) as usize).is_multiple_of(2);
        let sample = bench.sample(&mut run, if is_up { arm_step } else { -arm_step });
        limited += usize::from(sample.held.abs() >= limit);
        let is_balancing = sample.output.mode == Mode::Balance;
        let late = !balanced && t >= CAUGHT_WITHIN;
        if sample.fault.is_some() || late || (balanced && !is_balancing) {
            told.fell = Some(t);
            told.fault = sample.fault;
            break;
        }
        balanced |= is_balancing;
        if 2 * k >= count {
            let angles = [sample.x.theta, furuta_ctrl::wrap(sample.x.alpha)];
            for (most, angle) in told.swept.iter_mut().zip(angles) {
                *most = angle.abs().max(*most);
            }
        }
    }
    told.at_limit = limited as f64 / count.max(1) as f64;
    Ok(told)
}
