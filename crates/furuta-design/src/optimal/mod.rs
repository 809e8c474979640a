//! Swing-up by optimisation: the voltages that bring a rig up soonest within its limits, and gains to follow them with.
//!
//! Direct multiple shooting: the time `T` is cut into intervals in which the voltage is held; unknown are the states at
//! their ends, the voltages and `T`. Minimised is
//!
//! ```text
//! T / T_p + effort mean (u/u_max)^2      T_p: period of the hanging pendulum's small swings
//! ```
//!
//! such that every interval's motion (RK4 on the nonlinear model of the rig file) ends where the next begins, the first
//! hangs at rest, the last is upright at rest, and voltage, arm angle and both speeds are within their limits. The
//! method is sequential quadratic programming with an exact penalty of the gaps, a trust region and a second-order
//! correction (Nocedal and Wright, *Numerical Optimization*, chapter 18); derivatives are exact (dual numbers), and
//! each sparse quadratic program is solved by Clarabel.
//!
//! There are many local optima, one at least for each number of swings. The search begins from several numbers of
//! swings on a coarse grid, and refines the cheapest that it finds on two finer ones. It does not prove that there is
//! none cheaper.

mod course;
mod gains;
mod iterate;
mod model;
mod subproblem;

use course::{Course, Limits};
use furuta_ctrl::Site;
use furuta_ctrl::design::{DesignError, balance_weights};
use furuta_ctrl::trajectory::{KNOTS, Knot, Trajectory, TrajectoryError, WhenLost};
use furuta_model::linear_plant::{Hold, NoEquilibrium, rigid};
use furuta_model::{PlantError, Rig, State};
use iterate::{CLOSED, Found, search};
use model::Model;
use nalgebra::SVector;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use subproblem::Objective;

/// Numbers of half swings that a search begins from.
const SWINGS: std::ops::RangeInclusive<u32> = 1..=4;
/// Intervals of the coarse grid.
const COARSE: usize = 20;
/// Intervals of the grid that the best of it are refined on.
const MIDDLE: usize = 40;
/// Quadratic programs for each start, for each refinement on the middle grid, and for the last one.
const PROGRAMS: [u32; 3] = [120, 100, 200];
/// How many courses are refined.
const REFINED: usize = 2;
/// A coarse course with larger scaled gaps is none.
const NEARLY: f64 = 1e-2;
/// Scale of the arm, rad: it moves further and faster than the pendulum does.
const ARM: f64 = 3.0;
/// Price of a gap, in units of the cost: above the multipliers of the rigs tried, and not far, lest the steps be short.
const PRICE: f64 = 5.0;
/// Weight of the voltage's changes.
const SMOOTH: f64 = 1e-4;

/// What a swing-up is designed for.
///
/// ```no_run
/// use furuta_design::optimal::SwingUpProblem;
/// let rig = furuta_model::Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
/// let swing_up = SwingUpProblem::new(rig).solve(&|_| ())?;
/// assert!(swing_up.seconds() < 0.7);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct SwingUpProblem {
    /// The rig, with its effects.
    pub rig: Rig,
    /// Share of the command limit that is left to the feedback, 0 to 0.5.
    pub reserve: f64,
    /// Weight of the voltage against the time.
    pub effort: f64,
    /// Largest arm angle either way, rad.
    pub arm_angle: f64,
    /// Largest arm speed, rad/s.
    pub arm_speed: f64,
    /// Largest pendulum speed, rad/s.
    pub pendulum_speed: f64,
    /// Intervals of the grid, 10 to 127.
    pub intervals: usize,
}

/// A swing-up that was found.
#[derive(Clone, Debug)]
pub struct SwingUp {
    /// States at the ends of the intervals.
    pub states: Vec<State<f64>>,
    /// Commands held in the intervals, V.
    pub commands: Vec<f64>,
    /// Length of an interval, s.
    pub interval: f64,
    /// Gains at the states, `[theta, alpha, theta_dot, alpha_dot]`, V/rad and V s/rad.
    pub gains: Vec<[f64; 4]>,
    /// Largest gap between an interval's motion and the next state: rad, speeds over the pendulum's frequency.
    pub gap: f64,
    /// What was minimised.
    pub cost: f64,
    /// Whether the last quadratic program promised to lower that by less than 1e-7: a local optimum.
    pub optimal: bool,
    /// Effects of the rig file that the model leaves out.
    pub left_out: Vec<&'static str>,
}

/// No swing-up was found, or none can be.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SwingUpError {
    /// A setting outside its range.
    #[error("{name} = {value} is outside the allowed range [{min}, {max}]{unit}")]
    Setting {
        /// Which.
        name: &'static str,
        /// What was given.
        value: f64,
        /// Lower end.
        min: f64,
        /// Upper end.
        max: f64,
        /// Unit, after a blank.
        unit: &'static str,
    },
    /// No start led to a motion.
    #[error(
        "no swing-up within {command:.3} {unit} and an arm angle of {arm:.3} rad was found: the best course misses the \
         equations of motion by {gap:.2e} (rad; speeds over the pendulum's frequency); give more command \
         (motor.command_limit), less reserve, or a larger arm angle. `furuta study reach` says how near to upright any \
         command brings the rig"
    )]
    NotFound {
        /// Largest command that was allowed.
        command: f64,
        /// Its unit.
        unit: &'static str,
        /// Largest arm angle, rad.
        arm: f64,
        /// Largest scaled gap of the best course.
        gap: f64,
    },
    /// The rig.
    #[error("{0}")]
    Plant(#[from] PlantError),
    /// Nothing rests upright.
    #[error("{0}")]
    Equilibrium(#[from] NoEquilibrium),
    /// No gain about upright.
    #[error("no gain can be designed: {0}")]
    Gain(#[from] DesignError),
    /// More or larger numbers than a trajectory holds.
    #[error("{0}")]
    Trajectory(#[from] TrajectoryError),
}

impl SwingUpProblem {
    /// A twentieth of the voltage left to the feedback, a little weight on effort, eight tenths of the arm angle (of
    /// the rig file, else a turn), nine tenths of the speeds at which a run is stopped, 100 intervals.
    #[must_use]
    pub fn new(rig: Rig) -> Self {
        let site = Site::of(&rig, 0.002);
        let (frequency, free) = (site.frequency(), site.free_speed());
        let limits = rig.limits;
        Self {
            reserve: 0.05,
            effort: 0.03,
            arm_angle: 0.8 * limits.arm_angle.unwrap_or(std::f64::consts::TAU),
            arm_speed: 0.9 * limits.arm_speed.unwrap_or(1.3 * free),
            pendulum_speed: 0.9 * limits.pendulum_speed.unwrap_or(10.0 * frequency),
            intervals: 100,
            rig,
        }
    }

    /// The fastest one: no reserve, hardly any weight on effort. What others are measured by.
    #[must_use]
    pub fn fastest(rig: Rig) -> Self {
        Self {
            reserve: 0.0,
            effort: 0.01,
            ..Self::new(rig)
        }
    }

    /// How many quadratic programs [`SwingUpProblem::solve`] solves at most: what its progress counts to.
    #[must_use]
    pub fn programs(&self) -> u64 {
        let starts = SWINGS.count() as u64 * self.ends().len() as u64;
        starts * u64::from(PROGRAMS[0])
            + REFINED as u64 * u64::from(PROGRAMS[1])
            + u64::from(PROGRAMS[2])
    }

    /// Upright as it is come to: from one side, or, where effects make a difference, from either.
    fn ends(&self) -> Vec<f64> {
        if self.rig.effects.iter().all(furuta_model::Effect::is_off) {
            vec![0.0]
        } else {
            vec![0.0, std::f64::consts::TAU]
        }
    }

    fn check(&self) -> Result<(), SwingUpError> {
        let settings = [
            ("reserve", self.reserve, 0.0, 0.5, ""),
            ("effort", self.effort, 0.0, 100.0, ""),
            ("arm_angle", self.arm_angle, 0.01, 1e3, " rad"),
            ("arm_speed", self.arm_speed, 0.01, 1e4, " rad/s"),
            ("pendulum_speed", self.pendulum_speed, 0.01, 1e4, " rad/s"),
            (
                "intervals",
                self.intervals as f64,
                10.0,
                (KNOTS - 1) as f64,
                "",
            ),
        ];
        for (name, value, min, max, unit) in settings {
            if !(value >= min && value <= max) {
                return Err(SwingUpError::Setting {
                    name,
                    value,
                    min,
                    max,
                    unit,
                });
            }
        }
        Ok(())
    }

    /// Searches; `progress` hears how many quadratic programs are solved.
    ///
    /// # Errors
    /// [`SwingUpError`].
    pub fn solve(&self, progress: &(dyn Fn(u64) + Sync)) -> Result<SwingUp, SwingUpError> {
        self.check()?;
        let model = Model::of(&self.rig)?;
        let upright = rigid(&self.rig.try_plant()?, Hold::Arm(0.0))?;
        let w = model.frequency;
        let volts = self.rig.params.motor.command_limit;
        let limits = Limits {
            state: [
                self.arm_angle,
                f64::INFINITY,
                self.arm_speed,
                self.pendulum_speed,
            ],
            command: volts * (1.0 - self.reserve),
            time: [0.05 / w, 100.0 / w],
        };
        let objective = Objective {
            haste: 1.0,
            unit: std::f64::consts::TAU / w,
            effort: self.effort,
            smooth: SMOOTH,
            price: PRICE,
            scale: SVector::from([ARM, 1.0, ARM * w, w]),
            command: volts,
        };
        let made = AtomicU64::new(0);
        let tick = || progress(made.fetch_add(1, Ordering::Relaxed) + 1);
        let coarse = COARSE.min(self.intervals);
        let starts: Vec<(u32, f64)> = SWINGS
            .flat_map(|swings| self.ends().into_iter().map(move |end| (swings, end)))
            .collect();
        let mut found: Vec<Found> = starts
            .into_par_iter()
            .map(|(swings, end)| {
                let guess = Course::guess(swings, w, coarse, end);
                search(&model, guess, &limits, &objective, PROGRAMS[0], &tick)
            })
            .collect();
        found.sort_by(|a, b| a.rank(NEARLY).total_cmp(&b.rank(NEARLY)));
        found.truncate(REFINED);
        let middle = MIDDLE.min(self.intervals);
        let mut refined: Vec<Found> = found
            .into_par_iter()
            .map(|f| {
                let course = f.course.on(middle);
                search(&model, course, &limits, &objective, PROGRAMS[1], &tick)
            })
            .collect();
        refined.sort_by(|a, b| a.rank(NEARLY).total_cmp(&b.rank(NEARLY)));
        refined.truncate(1);
        for f in &mut refined {
            let course = f.course.on(self.intervals);
            *f = search(&model, course, &limits, &objective, PROGRAMS[2], &tick);
        }
        let gap = refined.iter().map(|f| f.gap).fold(f64::INFINITY, f64::min);
        let best = refined.into_iter().next();
        let Some(best) = best.filter(|f| f.gap < NEARLY) else {
            return Err(self.not_found(limits.command, gap));
        };
        let best = iterate::close(&model, best, &limits, &objective);
        if !(best.gap < CLOSED) {
            return Err(self.not_found(limits.command, best.gap));
        }
        let gains = gains::gains(
            &model,
            &best.course,
            &upright,
            &balance_weights(&self.rig.params),
        )?;
        Ok(SwingUp {
            states: best.course.x.iter().map(|x| State::from(*x)).collect(),
            commands: best.course.u.clone(),
            interval: best.course.interval(),
            gains: gains.iter().map(|k| [k[0], k[1], k[2], k[3]]).collect(),
            gap: best.gap,
            cost: best.cost,
            optimal: best.arrived,
            left_out: model.left_out.clone(),
        })
    }

    fn not_found(&self, command: f64, gap: f64) -> SwingUpError {
        SwingUpError::NotFound {
            command,
            unit: self.rig.params.motor.actuation.unit(),
            arm: self.arm_angle,
            gap,
        }
    }
}

impl SwingUp {
    /// How long it takes, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.interval * self.commands.len() as f64
    }

    /// Largest arm angle at the ends of the intervals, rad.
    #[must_use]
    pub fn arm(&self) -> f64 {
        self.states
            .iter()
            .map(|x| x.theta.abs())
            .fold(0.0, f64::max)
    }

    /// From when on the pendulum is within `angle` (rad) of upright, s.
    #[must_use]
    pub fn arrival(&self, angle: f64) -> f64 {
        let near = |x: &State<f64>| furuta_ctrl::wrap(x.alpha).abs() < angle;
        let last_far = self.states.iter().rposition(|x| !near(x)).unwrap_or(0);
        self.interval * (last_far + 1) as f64
    }

    /// As a trajectory for a controller file, in single precision.
    ///
    /// # Errors
    /// More points or larger numbers than one can have.
    pub fn trajectory(&self, when_lost: WhenLost) -> Result<Trajectory, TrajectoryError> {
        #[allow(clippy::cast_possible_truncation)]
        let single = |x: f64| x as f32;
        let knots: Vec<Knot> = self
            .states
            .iter()
            .zip(&self.gains)
            .enumerate()
            .map(|(k, (x, gain))| Knot {
                x: x.to_array().map(single),
                u: single(self.commands.get(k).copied().unwrap_or(0.0)),
                gain: gain.map(single),
            })
            .collect();
        Trajectory::new(self.interval, &knots, when_lost)
    }

    /// Simulates the commands alone on the rig's model, steps of at most 0.1 ms: the states at the ends of the
    /// intervals. Independent of the grid's own integrator in its step only.
    ///
    /// # Errors
    /// A rig that cannot be.
    pub fn replayed(&self, rig: &Rig) -> Result<Vec<State<f64>>, PlantError> {
        let model = Model::of(rig)?;
        let mut x = SVector::from(State::<f64>::hanging());
        let mut out = vec![State::from(x)];
        for u in &self.commands {
            x = model.advance_finely(&x, *u, self.interval, 1e-4);
            out.push(State::from(x));
        }
        Ok(out)
    }
}
