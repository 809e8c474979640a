//! Controller design and one sample of the supervisor.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use furuta_ctrl::design::{Weights, balance, dlqr, lqr};
use furuta_ctrl::estimators::Measurement;
use furuta_ctrl::supervisor::{Request, Supervisor};
use furuta_ctrl::{Config, Site};
use furuta_model::discretize::zero_order_hold;
use furuta_model::{Rig, State, linearize};

fn design(c: &mut Criterion) {
    let rig = Rig::builtin("fong2014-emecs").expect("built in");
    let linear = linearize(&rig.nominal_plant(), State::upright(), 0.0);
    let (a, b) = zero_order_hold(&linear.a, &linear.b, 0.001);
    let weights = Weights::diagonal([1.0; 4], [1.0]);
    c.bench_function("lqr, discrete, n = 4", |bench| {
        bench.iter(|| dlqr(black_box(&a), &b, &weights));
    });
    c.bench_function("lqr, continuous, n = 4", |bench| {
        bench.iter(|| lqr(black_box(&linear.a), &linear.b, &weights));
    });
    c.bench_function("balance gain from parameters", |bench| {
        bench.iter(|| balance(black_box(&rig.params), 0.001));
    });
}

fn supervise(c: &mut Criterion) {
    let rig = Rig::builtin("fong2014-emecs").expect("built in");
    let supervisor =
        Supervisor::<f64>::design(&Config::default(), &Site::of(&rig, 0.001)).expect("has a gain");
    let mut state = supervisor.start();
    state.request(Request::Start);
    c.bench_function("supervisor, swing-up sample", |bench| {
        bench.iter(|| {
            supervisor.update(
                &mut state,
                &Measurement::new(black_box(0.1), black_box(3.0), 0.0),
                0.0,
            )
        });
    });
    let x = State::new(0.1, 0.2, 0.0, -1.2);
    c.bench_function("supervisor, one prediction of the catch", |bench| {
        bench.iter(|| supervisor.catch.succeeds(black_box(&x)));
    });
}

criterion_group!(benches, design, supervise);
criterion_main!(benches);
