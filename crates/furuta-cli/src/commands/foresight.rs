//! What the model says of a swing-up before it is tried, and what to make of one that failed.

use furuta_ctrl::Config;
use furuta_design::rehearsal::{Rehearsal, rehearse as hold};
use furuta_design::upright::{growth, growth_turned};
use furuta_hw::{EmulatedRig, Emulation, Reference, Summary, SwingUpBalance, rehearse};
use furuta_log::Mode;
use furuta_model::effects::AtRest;
use furuta_model::{Rig, State};

/// A swing-up that the model has not done within this time (s) is not going to succeed.
const PATIENCE: f64 = 15.0;

/// How a run goes on the model.
#[derive(Clone, Debug, PartialEq)]
enum Outlook {
    /// The pendulum is up for good after so long (s).
    Up(f64),
    /// Not even a pendulum that is upright stays there.
    DoesNotHold {
        /// Largest real part of the closed loop's poles, where they are known (1/s).
        growth: Option<f64>,
        /// Whether the opposite sign makes it stable.
        is_turned: bool,
        /// How it goes on the nonlinear model.
        told: Rehearsal,
    },
    /// It is not swung up; without friction it is.
    Friction,
    /// It is not swung up, with friction or without.
    NotUp,
}

/// How a run goes on the model, told before and after it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Foresight {
    rig: String,
    /// Command limit (V).
    limit: f64,
    outlook: Outlook,
}

impl Foresight {
    /// Rehearses the control system of a controller file on an emulated rig; `None` where either cannot be had.
    pub(crate) fn of(
        rig: &Rig,
        emulation: &Emulation,
        config: &Config,
        reference: Reference,
    ) -> Option<Self> {
        let trial = Trial {
            emulation,
            config,
            reference,
        };
        Some(Self {
            rig: rig.name.clone(),
            limit: rig.params.motor.command_limit,
            outlook: trial.outlook(rig)?,
        })
    }

    /// What to say before the run, if anything.
    pub(crate) fn warning(&self) -> Option<String> {
        let Self {
            rig,
            limit,
            outlook,
        } = self;
        match outlook {
            Outlook::Up(_) => None,
            Outlook::DoesNotHold {
                growth,
                is_turned,
                told,
            } => {
                let found = match growth.filter(|growth| *growth > 0.0) {
                    Some(growth) => {
                        format!(
                            "the closed loop has a pole at {growth:+.2} 1/s; in simulation, {told}"
                        )
                    }
                    None => format!("in simulation, {told}"),
                };
                let advice = if *is_turned {
                    "with the opposite sign the gain is stable: turn its sign, or see the signs of the rig's angles"
                } else {
                    "correct the controller file, or leave out --controller; `furuta design` gives a gain for a rig"
                };
                Some(format!(
                    "this controller does not hold {rig} upright: {found}; {advice}"
                ))
            }
            Outlook::Friction => Some(format!(
                "by its model {rig} does not swing up within {PATIENCE} s, and without friction it does: \
                 friction takes more than {limit} V give. Start with the pendulum held upright; or, if \
                 your rig has less friction than its file says, lower arm.viscous and pendulum.viscous \
                 there (`furuta rigs {rig} --toml` prints a built-in file)"
            )),
            Outlook::NotUp => Some(format!(
                "by its model {rig} does not swing up within {PATIENCE} s, with its friction or without, \
                 though it is held once upright: see [swing_up] and [limits] of the controller file and \
                 the rig's limits, or start with the pendulum held upright"
            )),
        }
    }

    /// Whether not even a pendulum that is upright stays there.
    pub(crate) fn falls(&self) -> bool {
        matches!(self.outlook, Outlook::DoesNotHold { .. })
    }

    /// What to say after a run in which the pendulum was never caught.
    pub(crate) fn explanation(&self, summary: &Summary) -> Option<String> {
        let caught = summary.modes.iter().any(|m| m.mode == Mode::Balance);
        let tried = summary.modes.iter().any(|m| m.mode == Mode::SwingUp);
        if caught || !tried {
            return None;
        }
        Some(match self.outlook {
            Outlook::Up(t) if t > summary.seconds => format!(
                "the pendulum was not caught yet: its model takes {t:.1} s; give a longer --duration"
            ),
            Outlook::Up(t) => format!(
                "the pendulum was not caught, though its model takes {t:.1} s: the rig is not as its file \
                 says. Record it with --task multisine and --task steps, each with --log, and ask \
                 `furuta diagnose`"
            ),
            // Said before the run already, at length.
            _ => "the pendulum was not caught, as its model says: see the note above".to_owned(),
        })
    }
}

/// What is tried.
struct Trial<'a> {
    emulation: &'a Emulation,
    config: &'a Config,
    reference: Reference,
}

impl Trial<'_> {
    fn outlook(&self, rig: &Rig) -> Option<Outlook> {
        let pilot = self.pilot(rig)?;
        let arm_step = match self.reference {
            Reference::Steps { amplitude, .. } => amplitude,
            Reference::Constant(_) | Reference::Noise(_) => 0.0,
        };
        let told = hold(self.config, rig, self.period(), arm_step).ok()?;
        if told.fell.is_some() {
            let (balance, period) = (&pilot.supervisor().balance, self.period());
            let turned = growth_turned(balance, rig, period);
            return Some(Outlook::DoesNotHold {
                growth: growth(balance, rig, period),
                is_turned: turned.is_some_and(|growth| growth < 0.0),
                told,
            });
        }
        let start = self.emulation.start;
        if let Some(up) = self.rehearse(rig, &pilot, start, PATIENCE)? {
            return Some(Outlook::Up(up));
        }
        let slippery = without_friction(rig);
        let blame = || {
            let pilot = self.pilot(&slippery)?;
            self.rehearse(&slippery, &pilot, start, PATIENCE)?
        };
        Some(match blame() {
            Some(_) => Outlook::Friction,
            None => Outlook::NotUp,
        })
    }

    fn period(&self) -> f64 {
        f64::from(self.emulation.period_us) * 1e-6
    }

    fn pilot(&self, rig: &Rig) -> Option<SwingUpBalance> {
        SwingUpBalance::from_config(self.config, rig, self.period(), self.reference).ok()
    }

    fn rehearse(
        &self,
        rig: &Rig,
        pilot: &SwingUpBalance,
        start: State<f64>,
        seconds: f64,
    ) -> Option<Option<f64>> {
        let emulation = Emulation {
            start,
            ..self.emulation.clone()
        };
        let mut emulated = EmulatedRig::new(rig, &emulation).ok()?;
        Some(rehearse(pilot, &mut emulated, seconds))
    }
}

/// The rig on perfect bearings.
fn without_friction(rig: &Rig) -> Rig {
    let mut rig = rig.clone();
    (rig.params.arm.viscous, rig.params.pendulum.viscous) = (0.0, 0.0);
    rig.effects
        .retain(|effect| !matches!(effect.spec().at_rest, AtRest::Friction(_)));
    rig
}
