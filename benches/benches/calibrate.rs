//! Calibrations of six and of eight parameters on 20 s at 500 Hz, from sheets that are off.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use furuta_ident::calibrate::{Options, calibrate, plan};
use furuta_ident::recording::Recording;
use furuta_ident::validate::validate;
use furuta_model::{Effect, Plant, Rig, State};

/// A rig whose friction is known.
fn damped() -> Rig {
    let mut rig = Rig::builtin("qube-servo-2").expect("built in");
    rig.params.arm.viscous = 4e-4;
    rig.params.pendulum.viscous = 3e-5;
    rig
}

/// 20 s of a rig under a sweep, the angles as `read` says.
fn recorded(rig: &Rig, read: impl Fn([f64; 2]) -> [f64; 2]) -> Recording {
    let plant: Plant<f64> = rig.plant();
    let mut state = plant.rest(State::hanging());
    let mut samples = Vec::new();
    for k in 0..10_000 {
        let t = f64::from(k) * 0.002;
        let s = t % 10.0;
        let u = 3.0 * (2.0 * s + 1.2 * s * s).sin();
        let [theta, alpha] = read(plant.measure(&state));
        samples.push([t, u, theta, alpha]);
        plant.step(&mut state, u, 0.002);
    }
    Recording::from_samples("bench", samples)
        .expect("a valid recording")
        .0
}

/// Six parameters, exact angles, and the sheet that is to be mended, as beside other packages (`py/bench`).
fn exact() -> (Rig, Recording, Options) {
    let mut rig = damped();
    let recording = recorded(&rig, |angles| angles);
    let p = &mut rig.params;
    p.arm.inertia *= 1.2;
    p.arm.viscous *= 0.7;
    p.motor.torque_constant *= 0.8;
    p.pendulum.inertia *= 1.1;
    p.pendulum.viscous *= 1.5;
    p.arm.length *= 1.05;
    let six = [
        "arm.inertia",
        "arm.viscous",
        "motor.torque_constant",
        "pendulum.inertia",
        "pendulum.viscous",
        "arm.length",
    ];
    (rig, recording, asking_for(&six))
}

/// Eight parameters of a rig with dry friction, angles in counts.
fn with_friction() -> (Rig, Recording, Options) {
    let mut rig = damped();
    let friction = Effect::new("arm.coulomb", &[6e-4]).expect("valid");
    rig.effects.push(friction);
    let recording = recorded(&rig, |angles| rig.sensors.quantised(angles));
    rig.params.arm.inertia *= 1.2;
    rig.params.motor.torque_constant *= 0.8;
    rig.params.pendulum.viscous *= 1.2;
    let eight = [
        "motor.torque_constant",
        "arm.inertia",
        "arm.viscous",
        "pendulum.inertia",
        "pendulum.inertia_transverse",
        "pendulum.viscous",
        "arm.length",
        "arm.coulomb.torque",
    ];
    (rig, recording, asking_for(&eight))
}

fn asking_for(keys: &[&str]) -> Options {
    Options {
        free: keys.iter().map(|key| (*key).to_owned()).collect(),
        ..Options::default()
    }
}

fn benches(c: &mut Criterion) {
    let mut group = c.benchmark_group("calibrate");
    group.sample_size(10);
    let (rig, recording, options) = exact();
    let recordings = [recording];
    group.bench_function("six parameters, exact angles, 20 s at 500 Hz", |b| {
        b.iter(|| calibrate(black_box(&recordings), &rig, &options).expect("a good recording"));
    });
    let (rig, recording, options) = with_friction();
    let recordings = [recording];
    group.bench_function("eight parameters, 20 s at 500 Hz", |b| {
        b.iter(|| calibrate(black_box(&recordings), &rig, &options).expect("a good recording"));
    });
    group.bench_function("validate, 20 s at 500 Hz", |b| {
        b.iter(|| validate(black_box(&recordings), &rig).expect("a good recording"));
    });
    group.bench_function("plan", |b| {
        b.iter(|| plan(black_box(&rig), &Options::default(), 200.0, 2).expect("a plan"));
    });
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
