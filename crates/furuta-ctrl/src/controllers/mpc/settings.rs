//! What a controller file may say of a predictive controller.

use crate::controllers::weights;
use crate::error::ConfigError;
use crate::section::{ParameterSpec, Settings, Spec};

/// Changes of the active limits in a sample, where a file says nothing. No theorem gives a useful bound: that no set of
/// active limits returns makes them finite, not few. What was measured: of 8,000 samples with all limits, from one
/// random state to another, none needs more than 138 (`furuta-design`, `mpc::rates`), and samples of a run are nearer
/// to each other. Nearly half as many again.
const ITERATIONS: f64 = 200.0;

/// What a controller file may say of it.
pub(in crate::controllers) static SPEC: Spec = Spec {
    id: "mpc",
    sentence: "Model predictive control: that of `lqr` where no limit is near, else the cheapest commands \
        that keep command, pendulum and arm within theirs",
    parameters: &[
        weights::q(
            4,
            "diagonal of the state's weight Q; that of `lqr` if left out",
        ),
        weights::r("weight R of the command; that of `lqr` if left out"),
        ParameterSpec::number(
            "horizon",
            "s",
            0.01,
            20.0,
            "how far it looks ahead; ten times the pendulum's time constant if left out",
        ),
        ParameterSpec::number(
            "pendulum_angle",
            "rad",
            1e-3,
            1.5,
            "how far the pendulum may lean, if that is possible; as it likes if left out",
        ),
        ParameterSpec::number(
            "arm_angle",
            "rad",
            1e-2,
            1e3,
            "how far the arm may be from zero, if that is possible; nine tenths of where the rig file \
             stops a run if left out",
        ),
        ParameterSpec::number(
            "command_rate",
            "V/s",
            1e-2,
            1e9,
            "how fast the command may change, kept at all cost; as it likes if left out",
        ),
        ParameterSpec::word(
            "delay",
            &["none", "motor", "sample_and_motor"],
            "how late the command acts after the state that it is given: not at all, since the estimator looks ahead; \
             by the rig file's motor.delay (estimator with predict = false); by a sample and motor.delay (estimator \
             `derivative`)",
        ),
        ParameterSpec::switch(
            "preview",
            false,
            "whether to act before the reference moves, where its course is known",
        ),
        ParameterSpec::whole(
            "iterations",
            1.0,
            1000.0,
            ITERATIONS,
            "bound of the solver's changes of active limits in each sample, beyond which the command is the \
             solution for the limits considered until then, cut off",
        ),
    ],
};


/// Refuses a controller that carries the state over a delay over which the estimator has carried it already.
pub(crate) fn counts_delay_once(
    controller: &Settings,
    estimator: &Settings,
) -> Result<(), ConfigError> {
    if controller.spec().id != SPEC.id {
        return Ok(());
    }
    // An estimator without a model, `derivative`, has no `predict`: its state is that of the sample.
    let has_model = estimator.spec().place("predict").is_some();
    let over_motor = has_model && estimator.numbers("predict") != Some(&[0.0][..]);
    let problem = match controller.word(const { SPEC.parameter("delay").chosen() }) {
        "motor" if over_motor => {
            "delay = \"motor\" and an estimator that looks ahead count motor.delay twice: say predict = false in \
             [estimator], or leave delay out"
        }
        "sample_and_motor" if has_model => {
            "delay = \"sample_and_motor\" and an estimator with a model count the sample twice: choose kind = \
             \"derivative\" in [estimator], or leave delay out"
        }
        _ => return Ok(()),
    };
    Err(ConfigError::Contradiction {
        section: SPEC.id,
        problem,
    })
}
