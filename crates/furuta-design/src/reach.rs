//! How near to upright any voltage at all brings a hanging pendulum: what no swing-up can better.

use furuta_ctrl::wrap;
use furuta_model::signals::random::normal;
use furuta_model::{Plant, PlantError, Rig, State};
use rayon::prelude::*;

/// A search over voltages that are constant for a while each, by the cross-entropy method: draw many, keep the best,
/// draw about these.
///
/// (R. Rubinstein, *The cross-entropy method for combinatorial and continuous optimization*, 1999.) It knows the model
/// and the future and plays without encoders, delay or friction that was not told; a feedback that does better would be
/// a surprise. What it does not find is not thereby proven to be impossible.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Search {
    /// The arm may not leave this range either way, rad.
    pub arm_range: f64,
    /// How long the pendulum may take, s.
    pub seconds: f64,
    /// For how long a voltage is held, s.
    pub hold: f64,
    /// Searches from different draws.
    pub restarts: u64,
    /// Rounds of each.
    pub rounds: u64,
    /// Courses drawn in a round.
    pub draws: usize,
}

/// What a search found.
#[derive(Clone, Debug, PartialEq)]
pub struct Reach {
    /// Least distance from upright, rad.
    pub nearest: f64,
    /// When it was there, s.
    pub at: f64,
    /// Work that the arm did on the pendulum until then, J.
    pub work: f64,
    /// What of it the hinge's friction took, J.
    pub friction: f64,
    /// What the pendulum needs to rise from hanging to upright, `2 m g c`, J.
    pub needed: f64,
    /// Largest arm angle until then, rad.
    pub arm: f64,
}

/// Sample period, s.
const PERIOD: f64 = 0.002;
/// Near enough that looking for better is idle, rad.
const UP: f64 = 0.02;
/// The share of a round's draws that the next is drawn about.
const BEST: f64 = 0.07;
/// How much of the last round's mean and spread is kept.
const INERTIA: f64 = 0.3;
/// A search ends after this many rounds that have not come nearer by [`NEARER`].
const STUCK: u64 = 40;
/// rad.
const NEARER: f64 = 0.01;
/// Least spread of a voltage, of the limit: below it a search is stuck.
const LEAST_SPREAD: f64 = 0.03;

impl Search {
    /// 2.5 s, voltages held for 20 ms; 4 restarts.
    #[must_use]
    pub fn new(arm_range: f64) -> Self {
        Self {
            arm_range,
            seconds: 2.5,
            hold: 0.02,
            restarts: 4,
            rounds: 200,
            draws: 400,
        }
    }

    /// Looks for the course of voltages within the command limit that comes nearest to upright. Effects of the rig file
    /// act.
    ///
    /// # Errors
    /// A rig that cannot be.
    ///
    /// ```
    /// use furuta_design::reach::Search;
    /// let rig = furuta_model::Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
    /// let quick = Search { restarts: 1, rounds: 10, draws: 50, ..Search::new(3.0) };
    /// assert!(quick.run(&rig, &|_| ())?.nearest < 1.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn run(&self, rig: &Rig, progress: &(dyn Fn(u64) + Sync)) -> Result<Reach, PlantError> {
        let plant = rig.try_plant::<f64>()?;
        plant.check_period(PERIOD)?;
        let mut best: Option<Reach> = None;
        for restart in 0..self.restarts {
            let found = self.once(&plant, rig, restart, progress);
            if best.as_ref().is_none_or(|b| found.nearest < b.nearest) {
                best = Some(found);
            }
            if best.as_ref().is_some_and(|b| b.nearest < UP) {
                break;
            }
        }
        Ok(best.unwrap_or_else(|| self.course(&plant, rig, &[])))
    }

    fn once(
        &self,
        plant: &Plant<f64>,
        rig: &Rig,
        restart: u64,
        progress: &(dyn Fn(u64) + Sync),
    ) -> Reach {
        let n = (self.seconds / self.hold) as usize;
        let keep = ((BEST * self.draws as f64) as usize).max(1);
        let (mut mean, mut spread) = (vec![0.0; n], vec![1.5; n]);
        let mut best = self.course(plant, rig, &mean);
        let mut mark = (0, best.nearest);
        for round in 0..self.rounds {
            let seed = restart * self.rounds + round;
            let mut drawn: Vec<(Reach, Vec<f64>)> = (0..self.draws)
                .into_par_iter()
                .map(|i| {
                    let draw = |k: usize| mean[k] + spread[k] * normal(seed, (i * n + k) as u64);
                    let volts: Vec<f64> = (0..n).map(|k| draw(k).clamp(-2.0, 2.0)).collect();
                    (self.course(plant, rig, &volts), volts)
                })
                .collect();
            drawn.sort_by(|a, b| a.0.nearest.total_cmp(&b.0.nearest));
            drawn.truncate(keep);
            for k in 0..n {
                let column = drawn.iter().map(|(_, volts)| volts[k]);
                let m = column.clone().sum::<f64>() / drawn.len() as f64;
                let variance = column.map(|v| (v - m) * (v - m)).sum::<f64>() / drawn.len() as f64;
                mean[k] = INERTIA * mean[k] + (1.0 - INERTIA) * m;
                spread[k] =
                    (INERTIA * spread[k] + (1.0 - INERTIA) * variance.sqrt()).max(LEAST_SPREAD);
            }
            if let Some((found, _)) = drawn.into_iter().next()
                && found.nearest < best.nearest
            {
                best = found;
            }
            progress(seed + 1);
            if best.nearest < mark.1 - NEARER {
                mark = (round, best.nearest);
            }
            if best.nearest < UP || round - mark.0 >= STUCK {
                break;
            }
        }
        best
    }

    /// What these voltages, in units of the limit, lead to. Once the arm has left its range, nothing counts any more.
    fn course(&self, plant: &Plant<f64>, rig: &Rig, volts: &[f64]) -> Reach {
        let k = rig.params.coefficients();
        let limit = rig.params.motor.command_limit;
        let steps = (self.hold / PERIOD).round().max(1.0) as usize;
        let mut s = plant.rest(State::hanging());
        let (mut work, mut friction, mut arm) = (0.0, 0.0, 0.0_f64);
        let mut reach = Reach {
            nearest: std::f64::consts::PI,
            at: 0.0,
            work,
            friction,
            needed: 2.0 * k.weight,
            arm,
        };
        for (i, u) in volts.iter().enumerate() {
            for j in 0..steps {
                let before = s.x;
                plant.step(&mut s, u.clamp(-1.0, 1.0) * limit, PERIOD);
                let x = s.x;
                arm = arm.max(x.theta.abs());
                if !(arm <= self.arm_range) {
                    return reach;
                }
                let lost = 0.5 * (before.alpha_dot.powi(2) + x.alpha_dot.powi(2));
                friction += k.pendulum_damping * lost * PERIOD;
                let energy = |x: &State<f64>| {
                    0.5 * k.pendulum * x.alpha_dot * x.alpha_dot + k.weight * x.alpha.cos()
                };
                work = energy(&x) + k.weight + friction;
                let distance = wrap(x.alpha).abs();
                if distance < reach.nearest {
                    reach = Reach {
                        nearest: distance,
                        at: (i * steps + j + 1) as f64 * PERIOD,
                        work,
                        friction,
                        arm,
                        ..reach
                    };
                }
            }
        }
        reach
    }
}
