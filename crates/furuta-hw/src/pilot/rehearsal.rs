//! A run without a wire and without waiting: what would happen if the rig were its model.

use furuta_log::Mode;
use furuta_wire::{Command, MAX_FRAME, Message, encode};

use super::{Measurement, Pilot};
use crate::emulate::EmulatedRig;

/// Time (s) from which on the pilot balances the emulated rig until the end of `seconds`; `None` if it does not balance
/// it then. The rig is left as it then is.
///
/// The rig's own command limit, encoders and effects count; its wire and its clock do not.
///
/// ```
/// use furuta_hw::{EmulatedRig, Emulation, Reference, SwingUpBalance, rehearse};
/// use furuta_model::Rig;
/// let rig = Rig::builtin("shahzad2022-srv02").expect("built in");
/// let mut emulated = EmulatedRig::new(&rig, &Emulation::default())?;
/// let pilot = SwingUpBalance::design(&rig, 0.002, Reference::Constant(0.0))?;
/// let up = rehearse(&pilot, &mut emulated, 5.0);
/// assert!(up.is_some_and(|t| t < 3.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn rehearse<P: Pilot>(pilot: &P, rig: &mut EmulatedRig, seconds: f64) -> Option<f64> {
    let [arm_counts, pendulum_counts] = rig.counts_per_rev();
    let mut state = pilot.start();
    let mut since = None;
    let mut first_t_us = None;
    loop {
        let sample = rig.tick();
        let t_us = sample.t_us - *first_t_us.get_or_insert(sample.t_us);
        let t = t_us as f64 * 1e-6;
        let decision = pilot.process(
            &mut state,
            &Measurement {
                t,
                periods: 1,
                theta: sample.theta.theta(arm_counts),
                alpha: sample.alpha.alpha(pendulum_counts),
                held: f64::from(sample.volts),
            },
        );
        since = match decision.mode {
            Mode::Balance => since.or(Some(t)),
            _ => None,
        };
        if t >= seconds {
            return since;
        }
        let command = Command {
            seq: sample.seq,
            volts: decision.volts as f32,
        };
        // A command always fits into a frame of the largest size.
        let mut buffer = [0; MAX_FRAME];
        rig.receive(encode(&Message::Command(command), &mut buffer).unwrap_or_default());
    }
}
