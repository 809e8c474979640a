//! A whole diagnosis: two recordings of four seconds at 250 Hz, a spring hidden, the whole catalogue tried.

use std::fmt::Write as _;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use furuta_ident::diagnose::{Request, diagnose};
use furuta_ident::recording::Recording;
use furuta_model::{Effect, Plant, Rig, State};

fn recording(rig: &Rig, plant: &Plant<f64>, phase: f64) -> Recording {
    let mut state = plant.rest(State::hanging());
    let mut csv = String::from("t,u,theta,alpha\n");
    for k in 0..1000 {
        let t = f64::from(k) * 0.004;
        let u = 2.0 * (4.0 * t + 1.5 * t * t + phase).sin();
        let counts: Vec<f64> = plant
            .measure(&state)
            .iter()
            .zip(rig.sensors.resolution())
            .map(|(y, q)| (y / q).round() * q)
            .collect();
        let _ = writeln!(csv, "{t},{u},{},{}", counts[0], counts[1]);
        plant.step(&mut state, u, 0.004);
    }
    Recording::from_csv("bench.csv", csv.as_bytes())
        .expect("a valid recording")
        .0
}

fn whole(c: &mut Criterion) {
    let mut rig = Rig::builtin("qube-servo-2").expect("built in");
    rig.params.arm.viscous = 2e-4;
    rig.params.pendulum.viscous = 2e-5;
    let spring = Effect::new("arm.spring", &[2e-3, 0.2]).expect("valid");
    let plant: Plant<f64> = Plant::new(&rig.params, &[spring]).expect("one effect");
    let recordings = [recording(&rig, &plant, 0.0), recording(&rig, &plant, 2.0)];
    let request = Request {
        recordings: &recordings,
        rig: &rig,
        verify: &[],
    };
    let mut group = c.benchmark_group("diagnose");
    group.sample_size(10);
    group.bench_function("two recordings of 4 s, one effect hidden", |b| {
        b.iter(|| diagnose(black_box(&request), &|_| ()).expect("good recordings"));
    });
    group.finish();
}

criterion_group!(benches, whole);
criterion_main!(benches);
