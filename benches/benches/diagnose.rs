//! A whole diagnosis and its parts: two recordings of four seconds at 250 Hz, a spring hidden, the whole catalogue
//! tried.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use furuta_ident::diagnose::{Parts, Request, diagnose};
use furuta_ident::recording::Recording;
use furuta_model::{Effect, Plant, Rig, State};

fn recording(rig: &Rig, plant: &Plant<f64>, phase: f64) -> Recording {
    let mut state = plant.rest(State::hanging());
    let mut samples = Vec::new();
    for k in 0..1000 {
        let t = f64::from(k) * 0.004;
        let u = 2.0 * (4.0 * t + 1.5 * t * t + phase).sin();
        let [theta, alpha] = rig.sensors.quantised(plant.measure(&state));
        samples.push([t, u, theta, alpha]);
        plant.step(&mut state, u, 0.004);
    }
    Recording::from_samples("bench", samples)
        .expect("a valid recording")
        .0
}

/// Two recordings of a rig with a spring that its sheet does not know.
fn case() -> (Rig, [Recording; 2]) {
    let mut rig = Rig::builtin("qube-servo-2").expect("built in");
    rig.params.arm.viscous = 2e-4;
    rig.params.pendulum.viscous = 2e-5;
    let spring = Effect::new("arm.spring", &[2e-3, 0.2]).expect("valid");
    let plant: Plant<f64> = Plant::new(&rig.params, &[spring]).expect("one effect");
    let recordings = [recording(&rig, &plant, 0.0), recording(&rig, &plant, 2.0)];
    (rig, recordings)
}

/// The parts of the engine, over the same recordings.
fn parts(c: &mut Criterion) {
    let (rig, recordings) = case();
    let parts = Parts::new(&recordings, &rig).expect("good recordings");
    let mut group = c.benchmark_group("diagnose");
    group.bench_function("one simulation with sensitivities, 8 s at 250 Hz", |b| {
        b.iter(|| black_box(&parts).sensitivities());
    });
    group.bench_function("one window solved from a guess", |b| {
        b.iter(|| black_box(&parts).solve_window(black_box(5)));
    });
    group.sample_size(20);
    for id in ["arm.spring", "arm.coulomb", "drive.compliance"] {
        group.bench_function(format!("one candidate fitted: {id}"), |b| {
            b.iter(|| black_box(&parts).fit(black_box(id)));
        });
    }
    group.finish();
}

fn whole(c: &mut Criterion) {
    let (rig, recordings) = case();
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

criterion_group!(benches, parts, whole);
criterion_main!(benches);
