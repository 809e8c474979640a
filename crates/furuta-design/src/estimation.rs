//! How well estimators know the speeds that no encoder measures, all of them watching the same run.

use furuta_ctrl::estimators::{self, AnyEstimator, Estimator, Measurement};
use furuta_ctrl::settings::Settings;
use furuta_ctrl::supervisor::Supervisor;
use furuta_ctrl::{Config, ConfigError, Site};
use furuta_model::effects::Effect;
use furuta_model::{Rig, State};

use crate::supervised::{Sample, Supervised};

/// How far an estimator was off, RMS.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Errors {
    /// Which estimator.
    pub id: &'static str,
    /// Speed of the arm at the sample, rad/s.
    pub arm_speed: f64,
    /// Speed of the pendulum at the sample, rad/s.
    pub pendulum_speed: f64,
    /// The pendulum's angle where a command given at the sample begins to act, rad.
    pub ahead: f64,
}

/// Left out at the start, s: how fast an estimator finds a state it knows nothing of is not what is asked.
const SETTLING: f64 = 0.25;
/// The arm's reference changes its sign this often, s.
const EVERY: f64 = 2.0;
/// To this angle either way, rad.
const STEP: f64 = 0.3;

/// A run of a rig with `effects` under the standard control system, which knows them: balanced from near upright, the
/// arm asked to be at 0.3 rad to one side and to the other.
///
/// # Errors
/// Where the rig has no such control system.
pub fn record(
    rig: &Rig,
    effects: &[Effect<f64>],
    period: f64,
    duration: f64,
) -> Result<Vec<Sample>, ConfigError> {
    let mut real = rig.clone();
    real.effects.extend_from_slice(effects);
    let supervisor = Supervisor::design(&Config::default(), &Site::of(&real, period))?;
    let bench = Supervised::new(&supervisor, &real, period)?;
    let mut run = bench.start(State::new(0.0, 0.03, 0.0, 0.0));
    let count = (duration / period).round() as usize;
    Ok((0..count)
        .map(|k| {
            let half = (k as f64 * period / EVERY) as usize;
            let target = if half.is_multiple_of(2) { STEP } else { -STEP };
            bench.sample(&mut run, target)
        })
        .collect())
}

/// What every estimator of the catalogue, made for `rig` as its file has it, makes of a run.
///
/// # Errors
/// Where the rig has no such estimator.
pub fn compare(rig: &Rig, samples: &[Sample], period: f64) -> Result<Vec<Errors>, ConfigError> {
    let site = Site::of(rig, period);
    let skip = (SETTLING / period).round() as usize;
    estimators::CATALOGUE
        .iter()
        .map(|spec| {
            let estimator = AnyEstimator::<f64>::design(&Settings::new(spec), &site)?;
            let mut memory = estimator.start();
            let mut sums = [0.0; 3];
            let mut count = 0.0;
            for (k, pair) in samples.windows(2).enumerate() {
                let [at, next] = pair else { continue };
                let [theta, alpha] = at.reading;
                let said = estimator.update(&mut memory, &Measurement::new(theta, alpha, at.held));
                if k < skip {
                    continue;
                }
                let off = [
                    said.now.theta_dot - at.x.theta_dot,
                    said.now.alpha_dot - at.x.alpha_dot,
                    furuta_ctrl::wrap(said.ahead.alpha - next.x.alpha),
                ];
                for (sum, off) in sums.iter_mut().zip(off) {
                    *sum += off * off;
                }
                count += 1.0;
            }
            let [arm_speed, pendulum_speed, ahead] = sums.map(|sum| (sum / count).sqrt());
            Ok(Errors {
                id: spec.id,
                arm_speed,
                pendulum_speed,
                ahead,
            })
        })
        .collect()
}
