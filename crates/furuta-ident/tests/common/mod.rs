//! Recordings made by simulation: what the encoders of a rig would read.

#![allow(dead_code)] // each test file uses some of it

use std::time::Duration;

use furuta_ident::diagnose::{Diagnosis, Options, Request, diagnose_with};
use furuta_ident::recording::Recording;
use furuta_model::signals::random::normal;
use furuta_model::{Rig, State};

/// A desk-top rig whose friction is small enough to be told from back-EMF: the QUBE with the damping of a good bearing.
pub(crate) fn qube() -> Rig {
    let mut rig = Rig::builtin("qube-servo-2").expect("built in");
    rig.params.arm.viscous = 4e-4;
    rig.params.pendulum.viscous = 3e-5;
    rig
}

/// How a recording is made.
#[derive(Clone, Copy)]
pub(crate) struct RunSetup {
    /// Samples per second.
    pub(crate) rate: f64,
    /// s.
    pub(crate) seconds: f64,
    /// Where the pendulum starts.
    pub(crate) start: State<f64>,
    /// Noise of the encoders beside rounding, rad.
    pub(crate) noise: f64,
    /// Of the noise.
    pub(crate) seed: u64,
}

impl Default for RunSetup {
    fn default() -> Self {
        Self {
            rate: 500.0,
            seconds: 10.0,
            start: State::hanging(),
            noise: 0.0,
            seed: 0,
        }
    }
}

/// What the rig's encoders read under `volts(t, x)`.
pub(crate) fn record(
    name: &str,
    rig: &Rig,
    run: RunSetup,
    volts: impl Fn(f64, &State<f64>) -> f64,
) -> Recording {
    let plant = rig.plant::<f64>();
    let h = 1.0 / run.rate;
    let mut s = plant.rest(run.start);
    let mut samples = Vec::new();
    for k in 0..(run.seconds * run.rate).round() as u32 {
        let t = f64::from(k) * h;
        let y = plant.measure(&s);
        let u = volts(t, &s.x);
        let noisy = std::array::from_fn(|c| {
            y[c] + run.noise * normal(2 * run.seed + c as u64, u64::from(k))
        });
        let [theta, alpha] = rig.sensors.quantised(noisy);
        samples.push([t, u, theta, alpha]);
        plant.step(&mut s, u, h);
    }
    Recording::from_samples(name, samples)
        .expect("a valid recording")
        .0
}

/// A sweep through the pendulum's resonance and above, with a phase of its own.
pub(crate) fn sweep(amplitude: f64, phase: f64) -> impl Fn(f64, &State<f64>) -> f64 {
    move |t, _| {
        let s = t % 10.0;
        amplitude * (2.0 * s + 1.2 * s * s + phase).sin()
    }
}

/// Options that let a diagnosis end by itself on a machine that is ten times as busy as one that meets the default.
pub(crate) fn patient<'a>() -> Options<'a> {
    Options {
        time_limit: Some(Duration::from_secs(600)),
        ..Options::default()
    }
}

/// What is found in recordings of a rig with this data sheet.
pub(crate) fn diagnosis(recordings: &[Recording], sheet: &Rig) -> Diagnosis {
    let request = Request {
        recordings,
        rig: sheet,
        verify: &[],
    };
    diagnose_with(&request, patient(), &|_| ())
        .expect("good recordings")
        .diagnosis
}

/// The ids that a diagnosis names.
pub(crate) fn names(diagnosis: &Diagnosis) -> Vec<&str> {
    diagnosis.effects.iter().map(|e| e.id.as_str()).collect()
}
