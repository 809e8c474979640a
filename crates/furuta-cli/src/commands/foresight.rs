//! What the model says of a swing-up before it is tried, and what to make of one that failed.

use furuta_hw::{EmulatedRig, Summary, SwingUpBalance, rehearse};
use furuta_log::Mode;
use furuta_model::Rig;

/// A swing-up that the model has not done within this time (s) is not going to succeed.
const PATIENCE: f64 = 15.0;

/// How the swing-up goes on the model.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Foresight {
    rig: String,
    /// Command limit (V).
    limit: f64,
    /// When the pendulum is up for good (s); `None` if not within [`PATIENCE`].
    up: Option<f64>,
}

impl Foresight {
    /// Rehearses on an emulated rig, which is as `rig` says up to what it hides.
    pub(crate) fn of(rig: &Rig, mut emulated: EmulatedRig, pilot: &SwingUpBalance) -> Self {
        Self {
            rig: rig.name.clone(),
            limit: rig.params.motor.command_limit,
            up: rehearse(pilot, &mut emulated, PATIENCE),
        }
    }

    /// What to say before the run, if anything.
    pub(crate) fn warning(&self) -> Option<String> {
        let Self { rig, limit, up } = self;
        up.is_none().then(|| {
            format!(
                "by its model {rig} does not swing up within {PATIENCE} s: friction takes more than {limit} V give. \
                 Start with the pendulum held upright; or, if your rig has less friction than its file says, lower arm.viscous and \
                 pendulum.viscous there (`furuta rigs {rig} --toml` prints a built-in file)"
            )
        })
    }

    /// What to say after a run in which the pendulum was never caught.
    pub(crate) fn explanation(&self, summary: &Summary) -> Option<String> {
        let caught = summary.modes.iter().any(|m| m.mode == Mode::Balance);
        let tried = summary.modes.iter().any(|m| m.mode == Mode::SwingUp);
        if caught || !tried {
            return None;
        }
        Some(match self.up {
            // Said before the run already, at length.
            None => "the pendulum was not caught, as its model says: see the note above".to_owned(),
            Some(t) if t > summary.seconds => format!(
                "the pendulum was not caught yet: its model takes {t:.1} s; give a longer --duration"
            ),
            Some(t) => format!(
                "the pendulum was not caught, though its model takes {t:.1} s: the rig is not as its file says. Record it with \
                 --task multisine and --task steps, each with --log, and ask `furuta diagnose`"
            ),
        })
    }
}
