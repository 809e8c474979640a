//! How surely a control system swings a rig up that is not quite as its file says.

use crate::supervised::{Run, Supervised};
use furuta_ctrl::supervisor::{Fault, Mode, Supervisor};
use furuta_ctrl::{Config, ConfigError, Site, wrap};
use furuta_model::params::RANGES;
use furuta_model::signals::random::uniform;
use furuta_model::{Effect, EffectError, Params, PlantError, Rig, State};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A study: a rig, what controls it, and how far what is drawn may be from the file.
#[derive(Clone, Debug)]
pub struct Study {
    /// The rig as its file says; the control system knows no other.
    pub rig: Rig,
    /// The control system.
    pub config: Config,
    /// Sample period, s.
    pub period: f64,
    /// How many rigs are drawn.
    pub draws: usize,
    /// Other draws for another seed.
    pub seed: u64,
    /// Each physical parameter is uniform within this share of its value either way.
    pub spread: f64,
    /// Largest dry friction of the arm, of the torque that the command limit gives; uniform from 0.
    pub arm_friction: f64,
    /// Largest dry friction of the hinge, of the weight's moment; uniform from 0.
    pub hinge_friction: f64,
    /// An attempt ends after this time, s.
    pub patience: f64,
}

/// A run counts as up once the pendulum has been balanced for so long without a break, s.
pub const SETTLED: f64 = 3.0;
/// Furthest from upright at the end of that, rad.
pub const UPRIGHT: f64 = 0.2;
/// The push, once it is up: a jump of the pendulum's speed, in units of its small-angle frequency. Left alone it would
/// fall at once.
pub const PUSH: f64 = 1.0;

/// One attempt.
#[derive(Copy, Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Attempt {
    /// When balancing began that lasted, s.
    pub up: Option<f64>,
    /// From when on the pendulum stayed within [`UPRIGHT`] of upright, s; what balancing, which begins well before, is
    /// not: comparable with an optimum's.
    pub arrived: Option<f64>,
    /// How long it then took until it was up again after a push, s; 0 where it was not let fall.
    pub up_again: Option<f64>,
    /// Catches that did not hold, before the first that did.
    pub dropped: u32,
    /// Largest arm angle, rad.
    pub arm: f64,
    /// Largest jump of the command at a catch, of twice the command limit.
    pub jump: f64,
    /// Why it ended early.
    pub fault: Option<Fault>,
}

/// A study that cannot be.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// The control system.
    #[error("{0}")]
    Config(#[from] ConfigError),
    /// A rig as drawn.
    #[error("{0}")]
    Plant(#[from] PlantError),
    /// A friction as drawn.
    #[error("{0}")]
    Effect(#[from] EffectError),
}

impl Study {
    /// 500 Hz, 10 % of every parameter, arm friction up to 5 % of the motor's torque, hinge friction up to 1 % of the
    /// weight's moment, 30 s.
    #[must_use]
    pub fn new(rig: Rig, draws: usize) -> Self {
        Self {
            rig,
            config: Config::default(),
            period: 0.002,
            draws,
            seed: 1,
            spread: 0.1,
            arm_friction: 0.05,
            hinge_friction: 0.01,
            patience: 30.0,
        }
    }

    /// All attempts, on all cores; `progress` hears how many are done.
    ///
    /// # Errors
    /// A control system that this rig cannot have, or a rig as drawn that cannot be.
    ///
    /// ```
    /// use furuta_design::swing_up::Study;
    /// let rig = furuta_model::Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
    /// let attempts = Study::new(rig, 4).run(&|_| ())?;
    /// assert!(attempts.iter().all(|a| a.up.is_some_and(|t| t < 3.0)));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn run(&self, progress: &(dyn Fn(usize) + Sync)) -> Result<Vec<Attempt>, StudyError> {
        self.part(0..self.draws, progress)
    }

    /// The attempts of these draws alone: what [`Study::run`] gives at their places, so that several machines can share
    /// a study.
    ///
    /// # Errors
    /// As [`Study::run`].
    pub fn part(
        &self,
        draws: Range<usize>,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Vec<Attempt>, StudyError> {
        let supervisor = Supervisor::design(&self.config, &Site::of(&self.rig, self.period))?;
        let done = AtomicUsize::new(0);
        draws
            .into_par_iter()
            .map(|i| {
                let attempt = self.attempt(&supervisor, i);
                progress(done.fetch_add(1, Ordering::Relaxed) + 1);
                attempt
            })
            .collect()
    }

    /// The rig of draw `i`, and where it starts: hanging at rest, the arm anywhere within 0.2 rad of its middle.
    ///
    /// # Errors
    /// A friction that cannot be.
    pub fn draw(&self, i: usize) -> Result<(Rig, State<f64>), StudyError> {
        let mut n = 0;
        let mut next = || {
            n += 1;
            uniform(self.seed, 32 * i as u64 + n)
        };
        let values = self.rig.params.to_array();
        let actuation = self.rig.params.motor.actuation;
        let params = Params::from_array(
            actuation,
            std::array::from_fn(|k| {
                let factor = 1.0 + self.spread * (2.0 * next() - 1.0);
                let fixed = matches!(
                    RANGES[k].key,
                    "motor.gear_ratio" | "motor.command_limit" | "environment.gravity"
                );
                let value = if fixed { values[k] } else { values[k] * factor };
                value.min(RANGES[k].max)
            }),
        );
        let k = self.rig.params.coefficients();
        let mut rig = Rig {
            params,
            ..self.rig.clone()
        };
        let stall = k.drive * params.motor.command_limit;
        let torques = [
            ("arm.coulomb", self.arm_friction * stall * next()),
            ("pendulum.coulomb", self.hinge_friction * k.weight * next()),
        ];
        for (id, torque) in torques {
            let friction = Effect::new(id, &[torque])?;
            if friction.validate_for(actuation).is_ok() {
                rig.effects.push(friction);
            }
        }
        let mut start = State::hanging();
        start.theta = 0.4 * next() - 0.2;
        Ok((rig, start))
    }

    fn attempt(&self, supervisor: &Supervisor<f64>, i: usize) -> Result<Attempt, StudyError> {
        let (rig, start) = self.draw(i)?;
        let bench = Supervised::new(supervisor, &rig, self.period)?;
        let mut run = bench.start(start);
        let mut attempt = Attempt {
            up: None,
            arrived: None,
            up_again: None,
            dropped: 0,
            arm: 0.0,
            jump: 0.0,
            fault: None,
        };
        attempt.up = self.until_up(&bench, &mut run, &mut attempt);
        if attempt.up.is_some() {
            let arrived = attempt.arrived;
            let push = PUSH * Site::of(&self.rig, self.period).frequency();
            run.plant.x.alpha_dot += if i.is_multiple_of(2) { push } else { -push };
            let dropped = attempt.dropped;
            attempt.up_again = self.until_up(&bench, &mut run, &mut attempt);
            attempt.dropped = dropped;
            attempt.arrived = arrived;
        }
        Ok(attempt)
    }

    /// Time from now until balancing began that lasted.
    fn until_up(&self, bench: &Supervised<'_>, run: &mut Run, a: &mut Attempt) -> Option<f64> {
        let mut since = (run.memory.mode() == Mode::Balance).then_some(0.0);
        let mut near: Option<f64> = None;
        let samples = (self.patience / self.period) as usize;
        for k in 0..samples {
            let t = k as f64 * self.period;
            let s = bench.sample(run, 0.0);
            a.arm = a.arm.max(s.x.theta.abs());
            near = near.or(Some(t)).filter(|_| wrap(s.x.alpha).abs() < UPRIGHT);
            if s.fault.is_some() {
                a.fault = s.fault;
                return None;
            }
            match (s.output.mode, since) {
                (Mode::Balance, None) => {
                    since = Some(t);
                    let jump = (s.output.u - s.held).abs();
                    a.jump = a.jump.max(0.5 * jump / self.rig.params.motor.command_limit);
                }
                (Mode::SwingUp, Some(_)) => {
                    since = None;
                    a.dropped += 1;
                }
                _ => {}
            }
            let upright = wrap(s.x.alpha).abs() < UPRIGHT;
            if let Some(from) = since.filter(|from| t - from >= SETTLED && upright) {
                a.arrived = near;
                return Some(from);
            }
        }
        None
    }
}

/// What many attempts came to.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Outcome {
    /// How many there were.
    pub attempts: usize,
    /// How many came up and stayed.
    pub up: usize,
    /// How many of these were up again after the push.
    pub up_again: usize,
    /// Time until up, of those that came up: median, 95th of a hundred, longest; s.
    pub time: [f64; 3],
    /// Time until within [`UPRIGHT`] of upright for good, of the same: median, 95th of a hundred, longest; s.
    pub arrival: [f64; 3],
    /// Largest arm angle of an attempt, median, rad.
    pub median_arm: f64,
    /// The same after the push.
    pub time_again: [f64; 3],
    /// Catches that did not hold, per attempt.
    pub dropped: f64,
    /// Largest jump of the command at an attempt's catches, of twice the command limit: median and largest of all
    /// attempts.
    pub jump: [f64; 2],
    /// Largest arm angle in all attempts, rad.
    pub arm: f64,
    /// Attempts that ended in a fault.
    pub faults: usize,
}

impl Outcome {
    /// Of these attempts.
    #[must_use]
    pub fn of(attempts: &[Attempt]) -> Self {
        let times = |f: fn(&Attempt) -> Option<f64>| {
            let mut t: Vec<f64> = attempts.iter().filter_map(f).collect();
            t.sort_by(f64::total_cmp);
            let at = |share: f64| {
                let last = t.len().saturating_sub(1) as f64;
                t.get((share * last).round() as usize)
                    .copied()
                    .unwrap_or(f64::NAN)
            };
            (t.len(), [at(0.5), at(0.95), at(1.0)])
        };
        let (up, time) = times(|a| a.up);
        let (_, arrival) = times(|a| a.arrived);
        let mut arms: Vec<f64> = attempts.iter().map(|a| a.arm).collect();
        arms.sort_by(f64::total_cmp);
        let (up_again, time_again) = times(|a| a.up_again);
        let mut jumps: Vec<f64> = attempts.iter().map(|a| a.jump).collect();
        jumps.sort_by(f64::total_cmp);
        let middle = jumps.get(jumps.len() / 2).copied().unwrap_or(0.0);
        let dropped: f64 = attempts.iter().map(|a| f64::from(a.dropped)).sum();
        Self {
            attempts: attempts.len(),
            up,
            up_again,
            time,
            arrival,
            median_arm: arms.get(arms.len() / 2).copied().unwrap_or(0.0),
            time_again,
            dropped: dropped / attempts.len().max(1) as f64,
            jump: [middle, jumps.last().copied().unwrap_or(0.0)],
            arm: attempts.iter().map(|a| a.arm).fold(0.0, f64::max),
            faults: attempts.iter().filter(|a| a.fault.is_some()).count(),
        }
    }
}
