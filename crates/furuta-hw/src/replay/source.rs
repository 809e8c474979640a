//! From what a log says of itself to the pilot that made it.

use furuta_ctrl::supervisor::Brake;
use furuta_ctrl::{Config, ControllerFile};
use furuta_log::{Log, Metadata};
use furuta_model::{Limits, Rig};
use furuta_wire::Hello;

use super::{ReplayError, ReplayOptions};
use crate::identity;
use crate::pilot::{OpenLoop, Reference, SwingUpBalance, Task};
use crate::provenance::{CONTROLLER_FILE, FORMAT, FORMAT_VERSION, HELLO, SOFTWARE, TASK};
use crate::safety;

/// Periods that a rig may have (us).
const PERIODS: std::ops::RangeInclusive<u32> = 100..=1_000_000;

/// A pilot with all that the loop around it needs.
pub(super) struct Source {
    pub(super) hello: Hello,
    pub(super) limits: Limits,
    pub(super) brake: Brake<f64>,
    pub(super) pilot: AnyPilot,
    pub(super) same_pilot: bool,
}

// One is made per replay: what it takes is no matter.
#[allow(clippy::large_enum_variant)]
pub(super) enum AnyPilot {
    Balance(SwingUpBalance),
    Excite(OpenLoop),
}

impl AnyPilot {
    pub(super) fn describe(&self) -> String {
        match self {
            Self::Balance(pilot) => pilot.describe(),
            Self::Excite(pilot) => pilot.describe(),
        }
    }
}

impl Source {
    pub(super) fn of(log: &Log, options: &ReplayOptions) -> Result<Self, ReplayError> {
        let metadata = log.metadata.as_ref().ok_or(ReplayError::NoMetadata)?;
        if log.records.is_empty() {
            return Err(ReplayError::Empty);
        }
        let text = |key: &'static str| {
            metadata
                .extra
                .get(key)
                .map(String::as_str)
                .ok_or_else(|| older(metadata, key))
        };
        let format = text(FORMAT)?;
        if format != FORMAT_VERSION {
            return Err(ReplayError::Format {
                software: metadata.software.clone(),
                found: format.to_owned(),
            });
        }
        if metadata.software != SOFTWARE && !options.any_version {
            return Err(ReplayError::OtherVersion {
                log: metadata.software.clone(),
            });
        }
        let hello: Hello = serde_json::from_str(text(HELLO)?).map_err(ReplayError::Hello)?;
        if !PERIODS.contains(&hello.period_us) {
            return Err(ReplayError::Period {
                period_us: hello.period_us,
            });
        }
        let task = Task::from_json(text(TASK)?)?;
        let own_rig = Rig::from_toml(&metadata.rig_file).map_err(|e| ReplayError::RigFile {
            cause: e.to_string(),
        })?;
        let own = match (&task, metadata.extra.get(CONTROLLER_FILE)) {
            (Task::Balance { .. }, None) => return Err(older(metadata, CONTROLLER_FILE)),
            (_, None) => None,
            (_, Some(text)) => Some(ControllerFile::from_toml(text)?),
        };

        let rig = options.rig.as_ref().unwrap_or(&own_rig);
        let mismatches = identity::mismatches(&hello, rig);
        if options.rig.is_some() && !options.any_rig && !mismatches.is_empty() {
            return Err(ReplayError::AnotherRig { mismatches });
        }
        let same_controller = match (&options.controller, &own) {
            (None, _) => true,
            (Some(given), Some(own)) => given.config == own.config,
            (Some(_), None) => false,
        };
        // As the session has it.
        let period = f64::from(hello.period_us) * 1e-6;
        let config = options.controller.as_ref().or(own.as_ref());
        let balance = |config: &Config, reference| {
            SwingUpBalance::from_config(config, rig, period, reference).map(AnyPilot::Balance)
        };
        let pilot = match (task, config) {
            (Task::Balance { reference }, Some(file)) => balance(&file.config, reference)?,
            (Task::Balance { .. }, None) => return Err(older(metadata, CONTROLLER_FILE)),
            (
                Task::Excite {
                    excitation,
                    centring,
                },
                None,
            ) => AnyPilot::Excite(OpenLoop::new(rig, period, *excitation).centred(centring)),
            // What a controller would have done about a test signal: bring the pendulum up, the arm at its middle.
            (Task::Excite { .. }, Some(file)) => balance(&file.config, Reference::Constant(0.0))?,
        };
        Ok(Self {
            limits: rig.limits,
            brake: safety::brake(rig, period),
            same_pilot: same_controller && *rig == own_rig,
            hello,
            pilot,
        })
    }
}

fn older(metadata: &Metadata, missing: &'static str) -> ReplayError {
    ReplayError::Older {
        software: metadata.software.clone(),
        missing,
    }
}
