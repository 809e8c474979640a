//! A calibration of eight parameters on 20 s at 500 Hz, from a sheet that is off: target 0.5 s on two cores.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use furuta_ident::calibrate::{Options, calibrate, plan};
use furuta_ident::recording::Recording;
use furuta_ident::validate::validate;
use furuta_model::{Effect, Plant, Rig, State};

/// A rig with dry friction, and 20 s of it under a sweep.
fn case() -> (Rig, Recording) {
    let mut rig = Rig::builtin("qube-servo-2").expect("built in");
    rig.params.arm.viscous = 4e-4;
    rig.params.pendulum.viscous = 3e-5;
    let friction = Effect::new("arm.coulomb", &[6e-4]).expect("valid");
    rig.effects.push(friction);
    let plant: Plant<f64> = rig.plant();
    let mut state = plant.rest(State::hanging());
    let mut samples = Vec::new();
    for k in 0..10_000 {
        let t = f64::from(k) * 0.002;
        let s = t % 10.0;
        let u = 3.0 * (2.0 * s + 1.2 * s * s).sin();
        let [theta, alpha] = rig.sensors.quantised(plant.measure(&state));
        samples.push([t, u, theta, alpha]);
        plant.step(&mut state, u, 0.002);
    }
    let recording = Recording::from_samples("bench", samples)
        .expect("a valid recording")
        .0;
    // The sheet that is to be mended.
    rig.params.arm.inertia *= 1.2;
    rig.params.motor.torque_constant *= 0.8;
    rig.params.pendulum.viscous *= 1.2;
    (rig, recording)
}

fn benches(c: &mut Criterion) {
    let (rig, recording) = case();
    let recordings = [recording];
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
    let options = Options {
        free: eight.map(str::to_owned).to_vec(),
        ..Options::default()
    };
    let mut group = c.benchmark_group("calibrate");
    group.sample_size(10);
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
