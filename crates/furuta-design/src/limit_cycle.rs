//! How far a balanced rig wanders when its model lacks an effect, and when the control system knows it.
//!
//! Dry friction and dead zones keep a balanced pendulum from ever coming to rest: the arm sticks, the pendulum leans,
//! the arm breaks loose. What `diagnose` names can be made up for; what no name explains can be observed.

use furuta_ctrl::estimators;
use furuta_ctrl::supervisor::{Mode, Supervisor};
use furuta_ctrl::{Config, ConfigError, Site};
use furuta_model::effects::{Effect, spec};
use furuta_model::{Rig, State};

use crate::supervised::{Sample, Supervised};

/// A control system on a rig with an effect.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Knowing {
    /// The standard one, designed by a rig file without the effect.
    Nothing,
    /// The standard one, designed by a rig file with it.
    TheEffect,
    /// Without it in the rig file, but with the disturbance observer.
    ThatSomethingActs,
}

impl Knowing {
    /// All, in the order of the table.
    pub const ALL: [Self; 3] = [Self::Nothing, Self::TheEffect, Self::ThatSomethingActs];

    /// For tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nothing => "not known",
            Self::TheEffect => "compensated",
            Self::ThatSomethingActs => "disturbance observer",
        }
    }
}

/// What the rig did over the last half of a run.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Wandering {
    /// Half of what the arm swept, rad.
    pub arm: f64,
    /// Half of what the pendulum swept, rad.
    pub pendulum: f64,
    /// Mean distance of the arm from where it was asked to be, with its sign, rad.
    pub offset: f64,
    /// RMS of the command, V.
    pub command: f64,
    /// Share of the time in which it was balanced.
    pub up: f64,
}

/// A rig with `effects` that its file `rig` does not name, balanced from near upright for `duration` seconds by a
/// control system designed by `rig`, or by `known` where it is to know the effects.
///
/// # Errors
/// Where there is no such control system, or a rig that cannot be, or not be stepped with this period.
pub fn run(
    rig: &Rig,
    effects: &[Effect<f64>],
    known: Option<&Rig>,
    knowing: Knowing,
    period: f64,
    duration: f64,
) -> Result<Vec<Sample>, ConfigError> {
    let mut real = rig.clone();
    real.effects.extend_from_slice(effects);
    let designed_by = match knowing {
        Knowing::TheEffect => known.unwrap_or(&real),
        Knowing::Nothing | Knowing::ThatSomethingActs => rig,
    };
    let mut config = Config::default();
    if knowing == Knowing::ThatSomethingActs
        && let Some(settings) = estimators::settings("disturbance_observer")
    {
        config.estimator = settings;
    }
    let supervisor = Supervisor::design(&config, &Site::of(designed_by, period))?;
    let bench = Supervised::new(&supervisor, &real, period)?;
    let mut run = bench.start(State::new(0.0, 0.03, 0.0, 0.0));
    let count = (duration / period).round() as usize;
    Ok((0..count).map(|_| bench.sample(&mut run, 0.0)).collect())
}

impl Wandering {
    /// Over the last half of a run.
    #[must_use]
    pub fn of(samples: &[Sample]) -> Self {
        let half = &samples[samples.len() / 2..];
        let n = half.len().max(1) as f64;
        let mean = |of: &dyn Fn(&Sample) -> f64| half.iter().map(of).sum::<f64>() / n;
        let swept = |angle: &dyn Fn(&State<f64>) -> f64| {
            let (low, high) = half.iter().fold((f64::MAX, f64::MIN), |(low, high), s| {
                (low.min(angle(&s.x)), high.max(angle(&s.x)))
            });
            0.5 * (high - low)
        };
        Self {
            arm: swept(&|x| x.theta),
            pendulum: swept(&|x| furuta_ctrl::wrap(x.alpha)),
            offset: mean(&|s| s.x.theta),
            command: mean(&|s| s.held * s.held).sqrt(),
            up: mean(&|s| f64::from(u8::from(s.output.mode == Mode::Balance))),
        }
    }
}

/// The effect of this id at `share` of the size that would be noticed on this rig; `None` for no such effect.
#[must_use]
pub fn typical(rig: &Rig, id: &str, share: f64) -> Option<Effect<f64>> {
    let spec = spec(id)?;
    let values: Vec<f64> = spec
        .parameters
        .iter()
        .enumerate()
        .map(|(i, p)| {
            if i < spec.strengths {
                p.off + share * p.typical(&rig.params)
            } else {
                p.default.unwrap_or_else(|| p.off + p.typical(&rig.params))
            }
        })
        .collect();
    Effect::new(id, &values).ok()
}
