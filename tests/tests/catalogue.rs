//! Every effect of the catalogue is all there: simulated, hidden, serialised, documented, found. Adding one takes a
//! file and a line; this test reads the registry and says what a new one lacks.

use std::collections::BTreeSet;

use furuta_hw::emulate::hidden_effect;
use furuta_ident::diagnose::candidates;
use furuta_model::simulate::trajectory;
use furuta_model::{CATALOGUE, Plant, RARE, Rig, Spec, State, effects};

/// The public names: rig files, recordings' metadata and reports out there hold them.
const IDS: [&str; 44] = [
    "arm.coulomb",
    "arm.stribeck",
    "arm.quadratic",
    "arm.load_friction",
    "arm.angle_friction",
    "arm.fading_friction",
    "arm.spring",
    "arm.cable",
    "arm.relaxation",
    "arm.lugre",
    "arm.presliding",
    "arm.cogging",
    "arm.tilt",
    "arm.stop",
    "motor.resolution",
    "motor.deadzone",
    "motor.bias",
    "motor.saturation",
    "motor.lag",
    "motor.delay",
    "motor.asymmetry",
    "motor.drift",
    "motor.inductance",
    "motor.current_limit",
    "motor.ripple",
    "drive.backlash",
    "drive.compliance",
    "pendulum.coulomb",
    "pendulum.quadratic",
    "pendulum.spring",
    "pendulum.bias",
    "pendulum.inertia_transverse",
    "sensor.theta.eccentricity",
    "sensor.alpha.eccentricity",
    "sensor.alpha.offset",
    "sensor.alpha.scale",
    "sensor.theta.scale",
    "sensor.delay",
    "sensor.jitter",
    "sensor.theta.lost_counts",
    "sensor.alpha.lost_counts",
    "disturbance.vibration",
    "disturbance.kick",
    "disturbance.arm_kick",
];

fn spec(id: &str) -> &'static Spec {
    effects::spec(id).unwrap_or_else(|| panic!("{id} is not in the catalogue"))
}

#[test]
fn no_name_is_lost_and_none_is_double() {
    for id in IDS {
        spec(id);
    }
    let all = CATALOGUE.iter().chain(RARE);
    let ids: BTreeSet<_> = all.map(|s| s.id).collect();
    assert_eq!(ids.len(), CATALOGUE.len() + RARE.len());
}

/// Readings of two seconds under a command that swings to either side, as the encoders' angles before they are rounded.
fn readings(rig: &Rig) -> Vec<[f64; 2]> {
    const PERIOD: f64 = 2e-3;
    let plant: Plant<f64> = rig.try_plant().expect("valid");
    let limit = rig.params.motor.command_limit;
    let mut s = plant.rest(State::new(0.1, 3.0, 0.0, 0.0));
    (0..1000)
        .map(|k| {
            let u = 0.8 * limit * (f64::from(k) * 0.02).sin();
            plant.step(&mut s, u, PERIOD);
            plant.measure(&s)
        })
        .collect()
}

fn with(rig: &Rig, spec: &Spec) -> Rig {
    let effect = hidden_effect(spec.id, &rig.params).expect(spec.id);
    Rig {
        effects: vec![effect],
        ..rig.clone()
    }
}

/// At its typical size it shows: somewhere by more than half an encoder count, on every rig. (The finest count is 1.5
/// mrad.)
#[test]
fn each_is_simulated() {
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        let plain = readings(&rig);
        let counts = rig.sensors.resolution();
        for spec in CATALOGUE.iter().chain(RARE) {
            let gap = readings(&with(&rig, spec))
                .iter()
                .zip(&plain)
                .flat_map(|(a, b)| [0, 1].map(|i| (a[i] - b[i]).abs() / counts[i]))
                .fold(0.0, f64::max);
            assert!(gap > 0.5 && gap.is_finite(), "{name}, {}: {gap}", spec.id);
        }
    }
}

/// The same states come from the functions that give whole trajectories.
#[test]
fn each_has_trajectories() {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    for spec in CATALOGUE.iter().chain(RARE) {
        let plant = with(&rig, spec).plant();
        let start = plant.rest(State::hanging());
        let states = trajectory(&plant, start, &[1.0; 100], 2e-3, 1, |_| true).expect(spec.id);
        assert_eq!(states.len(), 101);
    }
}

#[test]
fn each_is_serialised() {
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        for spec in CATALOGUE.iter().chain(RARE) {
            let rig = with(&rig, spec);
            let text = rig.to_toml();
            assert!(text.contains(&format!("[effects.\"{}\"]", spec.id)));
            assert_eq!(Rig::from_toml(&text).expect(spec.id), rig, "{text}");
        }
    }
}

/// `furuta effects` and Python's `catalogue` show these texts as they are; their own tests see to that.
#[test]
fn each_is_documented() {
    for spec in CATALOGUE.iter().chain(RARE) {
        for text in [
            spec.name,
            spec.law,
            spec.sentence,
            spec.shows,
            spec.experiment,
        ] {
            assert!(text.trim().len() > 3, "{}: {text:?}", spec.id);
        }
        assert!(
            spec.sentence.ends_with('.') && spec.sentence.contains(' '),
            "{}: {}",
            spec.id,
            spec.sentence
        );
        assert!(!spec.look_alikes.is_empty(), "{}", spec.id);
        for other in spec.look_alikes {
            assert!(
                *other != spec.id && effects::spec(other).is_some(),
                "{}: {other}",
                spec.id
            );
        }
        let names: BTreeSet<_> = spec.parameters.iter().map(|p| p.name).collect();
        assert!(!names.is_empty() && names.len() == spec.parameters.len());
        for p in spec.parameters {
            assert!(
                !p.unit.is_empty() && p.min < p.max,
                "{}.{}",
                spec.id,
                p.name
            );
            if let Some(default) = p.default {
                assert!((p.min..=p.max).contains(&default), "{}.{}", spec.id, p.name);
            }
        }
    }
}

/// Late encoders look on recorded input and output as a late command does, which stands for both. Others are looked for
/// on request, and say why.
#[test]
fn each_is_offered_to_diagnose() {
    let offered: BTreeSet<_> = candidates().map(|s| s.id).collect();
    for spec in CATALOGUE.iter().chain(RARE) {
        let id = match spec.id {
            "sensor.delay" => "motor.delay",
            id => id,
        };
        let always = spec.offered.is_always();
        assert_eq!(offered.contains(id), always, "{id}");
        assert_eq!(spec.offered.why().is_empty(), always, "{id}");
    }
}
