//! Shahzad, Munshi, Azam, Khan 2022: the arm of a balanced pendulum is stepped by 0.1 rad, and the pendulum is pushed.
//!
//! Their gain is the LQR of Q = I, R = 1. Fig. 3: one step, simulated. Fig. 5 and 6: steps in both directions, pendulum
//! and arm, simulated and measured; a hand-pushed disturbance is rejected. What was measured is not printed as numbers;
//! in its place stands the nonlinear model with what their rig had: encoders, a voltage limit, dry friction.

use crate::closed_loop::{ClosedLoop, FALLEN, Model, Sample, Sensing};
use furuta_ctrl::controllers::StateFeedback;
use furuta_ctrl::design::{DesignError, Weights, lqr};
use furuta_model::{Actuation, Effect, EffectError, Plant, PlantError, Rig, State, linearize};

/// The arm's step, rad: 5.7 degrees.
pub const STEP: f64 = 0.1;

/// What happens in 10 s from rest.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Task {
    /// Fig. 3: the arm's reference steps once, after a second.
    Step,
    /// Fig. 5 and 6: it steps every second, to 0.1 rad and back.
    Steps,
    /// The pendulum is pushed after a second.
    Push,
}

impl Task {
    /// All of them, in the paper's order.
    pub const ALL: [Self; 3] = [Self::Step, Self::Steps, Self::Push];

    /// The reference at a time (s).
    #[must_use]
    pub fn reference(self, t: f64) -> State<f64> {
        let up = match self {
            Self::Step => t >= 1.0,
            // A little late, for sums of sample periods miss whole seconds by rounding.
            Self::Steps => (t + 1e-9).floor() % 2.0 == 1.0,
            Self::Push => false,
        };
        State::new(if up { STEP } else { 0.0 }, 0.0, 0.0, 0.0)
    }
}

/// On what the controller works.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum On {
    /// The paper's linear model (62) with perfect states.
    Linear,
    /// The nonlinear model with perfect states.
    Nonlinear,
    /// The nonlinear model with encoders of 4096 counts, speeds from them, and Coulomb friction on the arm.
    Rig,
}

impl On {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Linear, Self::Nonlinear, Self::Rig];

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Nonlinear => "nonlinear",
            Self::Rig => "encoders, friction",
        }
    }
}

/// The experiment's settings beyond the paper.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Settings {
    /// Samples per second.
    pub rate: f64,
    /// Coulomb friction on the arm of [`On::Rig`], N m.
    pub friction: f64,
    /// Corner frequency of the speeds' filters of [`On::Rig`], rad/s.
    pub cutoff: f64,
    /// Torque of the push (N m), for 0.1 s.
    pub push: f64,
}

impl Default for Settings {
    /// 1 kHz; 0.002 N m of friction, what 0.016 V of command overcomes; 100 rad/s; 0.06 N m, as 36 gram on the
    /// pendulum's mass.
    fn default() -> Self {
        Self {
            rate: 1000.0,
            friction: 0.002,
            cutoff: 100.0,
            push: 0.06,
        }
    }
}

/// Why the experiment cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentError {
    /// Weights, command and effort of the experiment are in volts.
    #[error(
        "the rig's motor.kind is \"{actuation}\", its command in {}: this study needs a rig that is commanded in volts \
         (motor.kind = \"voltage\"), such as shahzad2022-srv02",
        actuation.unit()
    )]
    NotVolts {
        /// How the rig is commanded.
        actuation: Actuation,
    },
    /// No gain.
    #[error("{0}")]
    Design(#[from] DesignError),
    /// No plant.
    #[error("{0}")]
    Plant(#[from] PlantError),
    /// A setting outside its range.
    #[error("{0}")]
    Effect(#[from] EffectError),
}

/// The paper's gain (C), computed: the LQR of Q = I, R = 1 on the upright model.
///
/// # Errors
/// Those of [`furuta_ctrl::design::riccati::continuous`].
pub fn gain(rig: &Rig) -> Result<[f64; 4], DesignError> {
    let linear = linearize(&rig.nominal_plant(), State::upright(), 0.0);
    let weights = Weights::diagonal([1.0; 4], [1.0]);
    Ok(lqr(&linear.a, &linear.b, &weights)?.gain.into())
}

/// Ten seconds of a task.
///
/// # Errors
/// A rig or a setting that is not possible.
pub fn run(
    rig: &Rig,
    task: Task,
    on: On,
    settings: &Settings,
) -> Result<Vec<Sample>, ExperimentError> {
    let actuation = rig.params.motor.actuation;
    if actuation != Actuation::Voltage {
        return Err(ExperimentError::NotVolts { actuation });
    }
    let control = StateFeedback {
        gain: gain(rig)?,
        command_limit: rig.params.motor.command_limit,
    };
    let nominal = rig.nominal_plant();
    let push = Effect::new("disturbance.kick", &[settings.push, 1.0, 0.1, 0.0])?;
    let friction = Effect::new("arm.coulomb", &[settings.friction])?;
    let mut effects = Vec::new();
    if task == Task::Push {
        effects.push(push);
    }
    if on == On::Rig {
        effects.push(friction);
    }
    let model = match on {
        On::Linear => Model::Linear(linearize(&nominal, State::upright(), 0.0)),
        On::Nonlinear | On::Rig => Plant::new(&rig.params, &effects)?.into(),
    };
    let period = 1.0 / settings.rate;
    nominal.check_period(period)?;
    let experiment = ClosedLoop {
        plants: vec![(0.0, model)],
        start: State::upright(),
        period,
        substeps: 1,
        duration: 10.0,
        sensing: match on {
            On::Linear | On::Nonlinear => Sensing::Perfect,
            On::Rig => Sensing::Encoders {
                sensors: rig.sensors,
                cutoff: settings.cutoff,
            },
        },
    };
    Ok(experiment.run(&control, |t| task.reference(t)))
}

/// What the issue of a run was, in numbers.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Figures {
    /// Time from the (last) step or push after which the arm stays within 2 % of the step of its reference (of its
    /// largest deflection, where the reference does not step), s; `None` where it does not until the next step or the
    /// end.
    pub settle: Option<f64>,
    /// How far the arm goes beyond the reference, as a part of the step; 0 where the reference does not step.
    pub overshoot: f64,
    /// How far the arm first goes the other way, as a part of the step: a pendulum must be tipped before it can be
    /// carried.
    pub undershoot: f64,
    /// Largest angle of the pendulum from upright, rad.
    pub alpha: f64,
    /// Largest angle of the arm from its reference before the first step or 1 s after a step, rad.
    pub theta: f64,
    /// Largest command, V.
    pub command: f64,
    /// Integral of the command's square, V² s.
    pub effort: f64,
    /// Whether the pendulum stayed up.
    pub up: bool,
}

/// A run's figures.
#[must_use]
pub fn figures(task: Task, samples: &[Sample]) -> Figures {
    let (mut alpha, mut theta, mut command, mut effort) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0);
    let (mut overshoot, mut undershoot) = (0.0_f64, 0.0_f64);
    for pair in samples.windows(2) {
        effort += pair[0].u * pair[0].u * (pair[1].t - pair[0].t);
    }
    for s in samples {
        alpha = alpha.max(s.x.alpha.abs());
        command = command.max(s.u.abs());
        theta = theta.max((s.x.theta - s.reference.theta).abs());
        if s.t >= 1.0 && task == Task::Step {
            overshoot = overshoot.max(s.x.theta / STEP - 1.0);
            undershoot = undershoot.max(-s.x.theta / STEP);
        }
    }
    let band = match task {
        Task::Step | Task::Steps => 0.02 * STEP,
        Task::Push => 0.02 * theta,
    };
    // Steps: the first one, until the second.
    let end = if task == Task::Steps {
        2.0
    } else {
        f64::INFINITY
    };
    let outside = samples
        .iter()
        .filter(|s| s.t >= 1.0 && s.t < end - 1e-9)
        .rfind(|s| (s.x.theta - s.reference.theta).abs() > band);
    let last = samples.last().map_or(0.0, |s| s.t).min(end);
    let settle = outside
        .map_or(Some(0.0), |s| Some(s.t - 1.0))
        .filter(|settle| settle + 1.0 + 0.05 < last);
    Figures {
        settle,
        overshoot,
        undershoot,
        alpha,
        theta,
        command,
        effort,
        up: alpha <= FALLEN,
    }
}
