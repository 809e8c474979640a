//! What is wrong with a simulation asked for.

use crate::plant::PlantError;

/// What is wrong with a simulation asked for, or where it broke off.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// The plant cannot be built, or not be stepped with this period.
    #[error("{0}")]
    Plant(#[from] PlantError),
    /// The same for one rollout of a batch.
    #[error("rollout {rollout}: {error}")]
    Rollout {
        /// Which, from 0.
        rollout: usize,
        /// What is wrong with it.
        error: PlantError,
    },
    /// An initial state that is not finite.
    #[error("the initial {component} = {value} is not a finite number")]
    Start {
        /// Which component: `theta`, `alpha`, `theta_dot`, `alpha_dot`.
        component: &'static str,
        /// What it is.
        value: f64,
    },
    /// A command that is not finite.
    #[error("the command of sample {sample}, {value} V, is not a finite number")]
    Command {
        /// Which, from 0.
        sample: usize,
        /// What it is, V.
        value: f64,
    },
    /// Other than one command a rollout.
    #[error("{given} commands for {rollouts} rollouts: give one each")]
    Commands {
        /// How many were given.
        given: usize,
        /// How many rollouts there are.
        rollouts: usize,
    },
    /// A command of one rollout that is not finite.
    #[error("rollout {rollout}: the command, {value} V, is not a finite number")]
    RolloutCommand {
        /// Which, from 0.
        rollout: usize,
        /// What it is, V.
        value: f64,
    },
    /// A number of steps per sample that is zero.
    #[error("substeps = 0; at least 1 step of the integrator per sample is needed")]
    Substeps,
    /// A batch that keeps nothing.
    #[error("every 0th sample is to be kept; every 1st or more is possible")]
    KeepNothing,
    /// The state grew beyond all numbers.
    #[error(
        "the state is no longer finite after sample {sample}: use a shorter period or more substeps"
    )]
    Diverged {
        /// The sample after which it is not.
        sample: usize,
    },
    /// Whoever watched the progress said to stop.
    #[error("stopped after sample {sample}")]
    Stopped {
        /// The last sample done.
        sample: usize,
    },
}

/// The first component of `x` that is not finite is an error.
pub(super) fn finite_start(x: &crate::State<f64>) -> Result<(), SimulationError> {
    let names = ["theta", "alpha", "theta_dot", "alpha_dot"];
    match names
        .into_iter()
        .zip(x.to_array())
        .find(|(_, v)| !v.is_finite())
    {
        Some((component, value)) => Err(SimulationError::Start { component, value }),
        None => Ok(()),
    }
}

/// The first of the commands that is not finite is an error.
pub(super) fn finite_commands(commands: &[f64]) -> Result<(), SimulationError> {
    match commands.iter().position(|u| !u.is_finite()) {
        Some(sample) => Err(SimulationError::Command {
            sample,
            value: commands[sample],
        }),
        None => Ok(()),
    }
}
