//! One update of model predictive control: limits away, limits active from nothing (cold) and from the sample before
//! (warm), in both precisions; the same problem by an interior-point method.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use furuta_ctrl::controllers::{self, Controller, Design, Mpc};
use furuta_ctrl::settings::Settings;
use furuta_ctrl::{Real, Site};
use furuta_design::mpc::InteriorPoint;
use furuta_model::{Rig, State};

/// The arm is to go far, the pendulum may not lean as the regulator would let it.
const FAR: [f64; 4] = [-1.5, 0.01, 0.1, 0.0];

fn updates<T: Real>(c: &mut Criterion, label: &str, mpc: &Mpc<T>) {
    let state = |x: [f64; 4]| State::from(x.map(T::from_f64));
    let (far, near, upright) = (state(FAR), state([0.01, 0.01, 0.0, 0.0]), State::upright());
    let h = T::from_f64(0.002);
    let mut memory = mpc.start();
    c.bench_function(&format!("mpc, no limit near, {label}"), |bench| {
        bench.iter(|| mpc.update(&mut memory, black_box(&near), &upright, h));
    });
    c.bench_function(&format!("mpc, cold, {label}"), |bench| {
        bench.iter(|| mpc.update(&mut mpc.start(), black_box(&far), &upright, h));
    });
    c.bench_function(&format!("mpc, warm, {label}"), |bench| {
        bench.iter(|| mpc.update(&mut memory, black_box(&far), &upright, h));
    });
}

fn mpc(c: &mut Criterion) {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let site = Site::of(&rig, 0.002);
    let settings: Settings = controllers::settings("mpc")
        .and_then(|s| s.with("pendulum_angle", &[0.05]).ok())
        .expect("in range");
    let design = Mpc::<f64>::design(&settings, &site).expect("suits it");
    updates(c, "f64", &design);
    updates(c, "f32", &design.cast::<f32>());
    let exact = InteriorPoint(Mpc::design(&settings, &site).expect("suits it"));
    let mut memory = exact.start();
    c.bench_function("mpc, Clarabel", |bench| {
        bench.iter(|| {
            exact.update(
                &mut memory,
                black_box(&State::from(FAR)),
                &State::upright(),
                0.002,
            )
        });
    });
    c.bench_function("mpc from a controller file", |bench| {
        bench.iter(|| Mpc::<f64>::design(black_box(&settings), &site));
    });
}

criterion_group!(benches, mpc);
criterion_main!(benches);
