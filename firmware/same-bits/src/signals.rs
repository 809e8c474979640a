//! The test signals: a host that knows a signal's few numbers knows every voltage that the target commands.

use crate::fingerprint::Fingerprint;
use core::fmt;
use furuta_model::signals::{
    Chirp, Excitation, FreeDecay, Harmonics, Multisine, Noise, Phases, Prbs, Ramp, Signal,
    SignalError, Step, Steps, Sweep,
};

/// Length of each signal, s.
const DURATION: f64 = 10.0;

/// Ramps in and out, s.
const RAMP: f64 = 1.5;

/// One line for each signal, over `count` samples and one at each end.
///
/// # Errors
/// Those of `out`.
pub(crate) fn print(out: &mut impl fmt::Write, count: u32) -> fmt::Result {
    for signal in signals() {
        let excitation = signal
            .and_then(|signal| Excitation::new(signal, DURATION))
            .and_then(|excitation| excitation.faded(RAMP, RAMP))
            .and_then(|excitation| excitation.limited(1.5));
        match excitation {
            Ok(excitation) => {
                let mut sum = Fingerprint::new();
                for k in 0..=count {
                    let t = DURATION * f64::from(k) / f64::from(count);
                    sum.add(excitation.volts(t));
                }
                writeln!(out, "{excitation}: {sum}")?;
            }
            Err(error) => writeln!(out, "refused: {error}")?,
        }
    }
    Ok(())
}

fn signals() -> [Result<Signal, SignalError>; 12] {
    let multisine =
        |harmonics, phases| Multisine::new(1.0, 0.1, 0.2, 6.0, harmonics, phases).map(Signal::from);
    let chirp = |from, to, sweep| Chirp::new(1.3, from, to, DURATION, sweep).map(Signal::from);
    [
        Ok(FreeDecay.into()),
        Step::new(1.7, 2.0).map(Signal::from),
        Steps::new(2.0, 0.1).map(Signal::from),
        Ramp::new(-0.7, 1.1, 7.0).map(Signal::from),
        chirp(8.0, 0.0, Sweep::Linear),
        chirp(0.1, 8.0, Sweep::Logarithmic),
        multisine(Harmonics::Logarithmic(12), Phases::Schroeder),
        multisine(Harmonics::All, Phases::Random(1)),
        Prbs::new(1.0, 7, 0.05, 3).map(Signal::from),
        Prbs::new(1.0, 20, 0.01, 70_000).map(Signal::from),
        Noise::new(1.0, 0.2, 6.0, 1).map(Signal::from),
        Noise::new(1.0, 0.0, 20.0, 2).map(Signal::from),
    ]
}
