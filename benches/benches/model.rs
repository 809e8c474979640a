//! One evaluation of the dynamics and one RK4 step, in single and double precision.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use furuta_model::dynamics::acceleration;
use furuta_model::{Effect, Plant, Rig, Scalar, State};

fn plant<S: Scalar>(effects: &[Effect<S>]) -> Plant<S> {
    let rig = Rig::builtin("fong2014-emecs").expect("built in");
    Plant::new(&rig.params.cast(), effects).expect("few effects")
}

fn derivative<S: Scalar>(c: &mut Criterion, name: &str) {
    let plant = plant::<S>(&[]);
    let x = State::new(0.1, 0.2, -0.3, 0.4).map(S::from_f64);
    let u = S::from_f64(0.5);
    c.bench_function(&format!("derivative {name}"), |b| {
        b.iter(|| acceleration(&plant.coefficients, black_box(&x), black_box(u)));
    });
}

fn step<S: Scalar>(c: &mut Criterion, name: &str, effects: &[Effect<S>]) {
    let plant = plant::<S>(effects);
    let (u, h) = (S::from_f64(0.5), S::Real::from_f64(0.001));
    let start = plant.rest(State::new(0.1, 2.9, -0.3, 0.4).map(S::from_f64));
    // A chain of steps, each from the last: what a simulation does, not what a pipelined loop over one state shows.
    let mut state = start.clone();
    let mut left = 0;
    c.bench_function(&format!("rk4 step {name}"), |b| {
        b.iter(|| {
            if left == 0 {
                (state, left) = (start.clone(), 10_000);
            }
            left -= 1;
            plant.step(&mut state, black_box(u), h);
            state.x.alpha
        });
    });
}

fn model(c: &mut Criterion) {
    derivative::<f32>(c, "f32");
    derivative::<f64>(c, "f64");
    step::<f32>(c, "f32", &[]);
    step::<f64>(c, "f64", &[]);
    let effects = [
        Effect::new("arm.spring", &[1e-3, 0.0]).expect("valid"),
        Effect::new("arm.coulomb", &[5e-3]).expect("valid"),
    ];
    step::<f64>(c, "f64, spring and Coulomb friction", &effects);
}

criterion_group!(benches, model);
criterion_main!(benches);
