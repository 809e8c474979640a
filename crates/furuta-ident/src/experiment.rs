//! Experiments that could be made: a family of test signals, each as strong as a rig bears, and what the encoders would
//! then read.

use core::f64::consts::PI;

use furuta_model::signals::random::normal;
use furuta_model::signals::{
    Chirp, Excitation, FreeDecay, Harmonics, Multisine, Phases, Prbs, Ramp, Signal, SignalError,
    Steps, Sweep,
};
use furuta_model::{Plant, Rig, State};

use crate::recording::Recording;
use crate::shooting::Data;

/// Length of a planned recording, s.
pub(crate) const SECONDS: f64 = 10.0;
/// Where the rig names no limit, the arm stays within this angle, rad: half a turn less a margin for the cable.
const ARM_WITHIN: f64 = 2.5;
/// A signal that is too strong for the rig is halved at most this many times.
pub(crate) const HALVED: usize = 8;
/// Signals are tried as strong as the rig bears, and at this part of that: friction shows at low speed.
pub(crate) const LEVELS: [f64; 2] = [1.0, 0.25];
/// A pendulum that is lifted and let go starts so far from hanging, rad.
const LIFTED: f64 = 1.5;
/// The phases of a multisine are improved from this many starts, as `furuta run` does it.
const RESTARTS: u32 = 8;
/// A test signal but for its size.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    Decay,
    Ramp,
    Steps { hold: f64 },
    Chirp { high: f64, low: f64, sweep: Sweep },
    Multisine { low: f64, high: f64 },
    Prbs { hold: f64 },
}

/// The family, with what each is in words.
pub(crate) const FAMILY: [(&str, Shape); 11] = [
    (
        "free decay: lift the pendulum, let it go, motor at rest",
        Shape::Decay,
    ),
    ("slow ramp of the voltage", Shape::Ramp),
    ("long steps", Shape::Steps { hold: 2.0 }),
    ("steps", Shape::Steps { hold: 0.5 }),
    (
        "slow sine sweep",
        Shape::Chirp {
            high: 0.5,
            low: 0.1,
            sweep: Sweep::Logarithmic,
        },
    ),
    (
        "sweep through the pendulum's resonance",
        Shape::Chirp {
            high: 8.0,
            low: 0.0,
            sweep: Sweep::Linear,
        },
    ),
    (
        "fast sweep",
        Shape::Chirp {
            high: 30.0,
            low: 4.0,
            sweep: Sweep::Linear,
        },
    ),
    (
        "sum of sines",
        Shape::Multisine {
            low: 0.2,
            high: 6.0,
        },
    ),
    (
        "sum of fast sines",
        Shape::Multisine {
            low: 2.0,
            high: 25.0,
        },
    ),
    ("random switching", Shape::Prbs { hold: 0.05 }),
    ("fast random switching", Shape::Prbs { hold: 0.01 }),
];

impl Shape {
    pub(crate) fn excitation(self, amplitude: f64, limit: f64) -> Result<Excitation, SignalError> {
        let signal: Signal = match self {
            Self::Decay => FreeDecay.into(),
            Self::Ramp => Ramp::new(0.0, amplitude, SECONDS)?.into(),
            Self::Steps { hold } => Steps::new(amplitude, hold)?.into(),
            Self::Chirp { high, low, sweep } => {
                Chirp::new(amplitude, high, low, SECONDS, sweep)?.into()
            }
            Self::Multisine { low, high } => {
                let lines = Harmonics::Logarithmic(12);
                let start = Multisine::new(
                    amplitude,
                    1.0 / SECONDS,
                    low,
                    high,
                    lines,
                    Phases::Schroeder,
                )?;
                start.optimised(RESTARTS).0.into()
            }
            Self::Prbs { hold } => Prbs::new(amplitude, 7, hold, 0)?.into(),
        };
        Excitation::new(signal, SECONDS)?.limited(limit)
    }

    /// The largest amplitude, in command limits: a sum of sines has its root mean square as amplitude, and peaks of
    /// twice that.
    pub(crate) fn most(self) -> f64 {
        match self {
            Self::Multisine { .. } => 0.45,
            _ => 1.0,
        }
    }

    /// The same for `furuta run --task` and `furuta simulate --input`.
    pub(crate) fn arguments(self, amplitude: f64) -> String {
        let volts = format!("--amplitude {amplitude} --duration {SECONDS}");
        match self {
            Self::Decay => format!("zero --duration {SECONDS}"),
            Self::Ramp => format!("ramp {volts}"),
            Self::Steps { hold } => format!("steps {volts} --hold {hold}"),
            Self::Chirp { high, low, sweep } => {
                let sweep = match sweep {
                    Sweep::Linear => "linear",
                    Sweep::Logarithmic => "logarithmic",
                };
                format!("chirp {volts} --band {low},{high} --sweep {sweep}")
            }
            Self::Multisine { low, high } => format!("multisine {volts} --band {low},{high}"),
            Self::Prbs { hold } => format!("prbs {volts} --hold {hold}"),
        }
    }

    fn start(self) -> State<f64> {
        match self {
            Self::Decay => State::new(0.0, PI - LIFTED, 0.0, 0.0),
            _ => State::hanging(),
        }
    }
}

/// What the encoders would read of a rig under a test signal, a sample every `h` (s), with `noise` (rad, rounding
/// included); nothing where the motion would leave what can be predicted as a whole.
pub(crate) fn record(
    rig: &Rig,
    shape: Shape,
    excitation: &Excitation,
    h: f64,
    noise: [f64; 2],
) -> Option<Data> {
    let plant: Plant<f64> = Plant::new(&rig.params, &rig.effects).ok()?;
    let resolution = rig.sensors.resolution();
    let within = rig.limits.arm_angle.unwrap_or(ARM_WITHIN);
    let extra: [f64; 2] = std::array::from_fn(|c| {
        (noise[c].powi(2) - resolution[c].powi(2) / 12.0)
            .max(0.0)
            .sqrt()
    });
    let mut x = plant.rest(shape.start());
    let count = (SECONDS / h).round() as usize;
    let (mut t, mut u) = (Vec::new(), Vec::new());
    let mut angles = [Vec::new(), Vec::new()];
    for k in 0..count {
        let y = plant.measure(&x);
        if y.iter().any(|y| !y.is_finite()) || y[0].abs() > within {
            return None;
        }
        let noisy = std::array::from_fn(|c| y[c] + extra[c] * normal(c as u64, k as u64));
        for (angle, read) in angles.iter_mut().zip(rig.sensors.quantised(noisy)) {
            angle.push(read);
        }
        let volts = excitation.volts(k as f64 * h);
        t.push(k as f64 * h);
        u.push(volts);
        plant.step(&mut x, volts, h);
    }
    let [theta, alpha] = angles;
    let recording = Recording {
        name: String::new(),
        t,
        u,
        theta,
        alpha,
        theta_dot: None,
        alpha_dot: None,
        extra: Vec::new(),
        sample_period: h,
        segments: core::iter::once(0..count).collect(),
        rig: None,
        metadata: Default::default(),
        comments: Vec::new(),
    };
    let mut data = Data::new(&[recording], rig);
    data.noise = noise;
    (data.runs.len() == 1 && data.runs[0].hangs()).then_some(data)
}

/// Root mean square.
pub(crate) fn rms(values: &[f64]) -> f64 {
    let sum: f64 = values.iter().map(|v| v * v).sum();
    (sum / values.len().max(1) as f64).sqrt()
}

/// To two significant digits, so that the command line says exactly what was planned.
pub(crate) fn two_digits(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_signal_of_the_family_exists() {
        for (words, shape) in FAMILY {
            let excitation = shape.excitation(1.5, 10.0).expect(words);
            assert!(excitation.check_sample_period(0.002).is_ok(), "{words}");
        }
        assert_eq!(
            Shape::Steps { hold: 0.5 }.arguments(two_digits(1.2345)),
            "steps --amplitude 1.2 --duration 10 --hold 0.5"
        );
    }
}
