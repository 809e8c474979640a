//! Who decides about the motor.

use furuta_ctrl::estimators::Measurement;
use furuta_ctrl::supervisor::{Mode, Output, Request, Supervisor, SupervisorState};
use furuta_wire::{Hello, Sample};

/// Decides about the motor on the chip.
pub trait Pilot {
    /// The voltage (V) from the tick after this sample on; `None`: the host's.
    fn decide(&mut self, sample: &Sample) -> Option<f32>;
}

/// The host decides, over the wire.
#[derive(Copy, Clone, Debug)]
pub struct HostLed;

impl Pilot for HostLed {
    fn decide(&mut self, _: &Sample) -> Option<f32> {
        None
    }
}

/// The control system of a controller file, on the chip, in single precision. A host that listens sees the samples and
/// what the motor gets; its commands are overruled.
#[derive(Clone, Debug)]
pub struct OnChip {
    supervisor: Supervisor<f32>,
    state: SupervisorState<f32>,
    /// Angles of one count, rad.
    per_count: [f32; 2],
    last: Option<Output<f32>>,
    seq: u32,
}

impl OnChip {
    /// Idle, with the encoders of this rig.
    #[must_use]
    #[allow(clippy::cast_possible_truncation)]
    pub fn new(supervisor: Supervisor<f32>, hello: &Hello) -> Self {
        let per_count = [hello.arm_counts_per_rev, hello.pendulum_counts_per_rev]
            .map(|counts| (core::f64::consts::TAU / counts) as f32);
        Self {
            state: supervisor.start(),
            supervisor,
            per_count,
            last: None,
            seq: 0,
        }
    }

    /// What an operator's button asks for; false where it makes no sense now.
    pub fn request(&mut self, request: Request) -> bool {
        self.state.request(request)
    }

    /// The present mode.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.state.mode()
    }

    /// The last sample's answer.
    #[must_use]
    pub fn last(&self) -> Option<&Output<f32>> {
        self.last.as_ref()
    }

    /// What a sample says, in the control system's terms.
    #[must_use]
    pub fn measurement(&self, sample: &Sample) -> Measurement<f32> {
        Measurement {
            theta: sample.theta.0 as f32 * self.per_count[0],
            alpha: core::f32::consts::PI + sample.alpha.0 as f32 * self.per_count[1],
            held: sample.volts,
            // A tick that came late counts for the periods that it took.
            periods: if self.last.is_some() {
                sample.seq.wrapping_sub(self.seq).max(1)
            } else {
                1
            },
        }
    }
}

impl Pilot for OnChip {
    fn decide(&mut self, sample: &Sample) -> Option<f32> {
        let measurement = self.measurement(sample);
        self.seq = sample.seq;
        let output = self.supervisor.update(&mut self.state, &measurement, 0.0);
        self.last = Some(output);
        Some(output.u)
    }
}
