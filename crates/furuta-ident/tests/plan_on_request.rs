//! Effects that are looked for on request look, in some recordings, as others do. Then both are named as what the data
//! leave open, and the plan has an experiment that tells them apart.

mod common;

use std::f64::consts::TAU;

use common::{RunSetup, qube, record};
use furuta_ident::diagnose::{Diagnosis, Options, Request, diagnose_with};
use furuta_model::{Effect, Rig};

/// An effect, and recordings that hardly tell it from what looks like it: a sine of this amplitude (V) and frequency
/// (Hz), a square wave where it is `square`.
struct Case {
    id: &'static str,
    values: &'static [f64],
    volts: f64,
    frequency: f64,
    square: bool,
}

const CASES: [Case; 9] = [
    // Commands of one size: friction under load is friction.
    case("arm.load_friction", &[0.3], 1.0, 0.7, true),
    // Within a small part of a turn the angle says nothing.
    case(
        "arm.angle_friction",
        &[2e-3, 0.8, 2.0, 0.8],
        0.8,
        1.5,
        false,
    ),
    // Much longer than its time constant, and much shorter.
    case("arm.relaxation", &[5e-3, 5.0], 0.5, 1.0, false),
    case("arm.stop", &[0.3, 0.2, 2e-3, 0.0], 0.6, 0.8, false),
    case("motor.resolution", &[0.1], 1.0, 0.5, false),
    // Where the arm is slow the back-EMF takes little of the voltage.
    case("motor.inductance", &[0.02, 1.0], 0.8, 1.5, true),
    case("motor.current_limit", &[0.003, 1.0], 1.0, 2.0, false),
    // A part of a turn: a scale.
    case("sensor.theta.eccentricity", &[0.1, 0.3], 0.4, 1.0, false),
    case("sensor.alpha.eccentricity", &[0.06, 0.4], 0.4, 1.0, false),
];

const fn case(
    id: &'static str,
    values: &'static [f64],
    volts: f64,
    frequency: f64,
    square: bool,
) -> Case {
    Case {
        id,
        values,
        volts,
        frequency,
        square,
    }
}

/// The diagnosis of two recordings of a rig with this effect, which is asked for, with a plan.
fn planned(case: &Case) -> Diagnosis {
    let sheet = qube();
    let effect = Effect::new(case.id, case.values).expect("valid");
    let rig = Rig {
        effects: vec![effect],
        ..sheet.clone()
    };
    let recordings = [1.0, 0.8].map(|part| {
        let run = RunSetup {
            rate: 250.0,
            seconds: 6.0,
            ..RunSetup::default()
        };
        record("slow.csv", &rig, run, |t, _| {
            let sine = (TAU * case.frequency * part * t).sin();
            let wave = if case.square { sine.signum() } else { sine };
            part * case.volts * wave
        })
    });
    let request = Request {
        recordings: &recordings,
        rig: &sheet,
        verify: &[],
    };
    let options = Options {
        plan: true,
        candidates: &[effect.spec()],
        ..Options::default()
    };
    diagnose_with(&request, options, &|_| ())
        .expect("good recordings")
        .diagnosis
}

#[test]
fn the_plan_tells_apart_what_recordings_confuse() {
    for case in &CASES {
        let d = planned(case);
        let named: Vec<_> = d
            .effects
            .iter()
            .map(|e| (e.id.as_str(), e.confusable_with.clone()))
            .collect();
        println!("{}: {:?} {named:?}", case.id, d.verdict);
        for row in &d.plan {
            println!(
                "    {} {:?} {:.0}",
                row.excitation, row.separates, row.expected_evidence
            );
        }
    }
}
