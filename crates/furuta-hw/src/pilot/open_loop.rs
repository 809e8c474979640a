//! Drives the motor with a test signal, whatever the rig does.

use furuta_ctrl::estimators::{Belief, Estimator, Measurement as Sampled, Observer};
use furuta_log::Mode;
use furuta_model::Rig;
use furuta_model::signals::{Centring, Excitation};

use super::{Decision, Measurement, Pilot};

/// Bandwidth of the observer behind the logged speeds (rad/s): fast against the mechanics, slow against the counts.
const BANDWIDTH: f64 = 120.0;

/// Drives the motor with a test signal.
#[derive(Clone, Debug)]
pub struct OpenLoop {
    excitation: Excitation,
    centring: Option<Centring>,
    command_limit: f64,
    observer: Observer<f64>,
}

impl OpenLoop {
    /// A test signal for a rig with this sampling period (s); its voltage is clipped at the rig's command limit.
    #[must_use]
    pub fn new(rig: &Rig, period: f64, excitation: Excitation) -> Self {
        let observer = Observer::new(rig.plant(), period, BANDWIDTH);
        Self {
            excitation,
            centring: None,
            command_limit: rig.params.motor.command_limit,
            observer,
        }
    }

    /// The same, with a pull of the arm towards its middle beside the signal, if any. The log's reference is then the
    /// signal in the arm's unit.
    #[must_use]
    pub fn centred(self, centring: Option<Centring>) -> Self {
        Self { centring, ..self }
    }

    /// In words, for the log.
    #[must_use]
    pub fn describe(&self) -> String {
        match &self.centring {
            None => format!("open loop: {}", self.excitation),
            Some(pull) => format!("{}; {pull}", self.excitation),
        }
    }
}

impl Pilot for OpenLoop {
    type State = OpenLoopState;

    fn start(&self) -> OpenLoopState {
        OpenLoopState(self.observer.start())
    }

    fn process(&self, state: &mut OpenLoopState, m: &Measurement) -> Decision {
        let sampled = Sampled {
            theta: m.theta,
            alpha: m.alpha,
            held: m.held,
            periods: m.periods,
        };
        let x = self.observer.update(&mut state.0, &sampled).now;
        let excitation = self.excitation.volts(m.t);
        let (volts, reference) = match &self.centring {
            None => (excitation, 0.0),
            Some(pull) => (pull.volts(excitation, m.theta), pull.reference(excitation)),
        };
        Decision {
            volts: volts.clamp(-self.command_limit, self.command_limit),
            theta_dot: x.theta_dot,
            alpha_dot: x.alpha_dot,
            reference,
            mode: Mode::Excite,
            fault: None,
        }
    }
}

/// What an [`OpenLoop`] remembers.
#[derive(Clone, Debug)]
pub struct OpenLoopState(Belief<f64>);
