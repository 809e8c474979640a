//! One sample of the supervisor in each mode, of the swing-up and of the catch, in both precisions.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use furuta_ctrl::controllers::{Controller, Design, SWING_UP, SwingUp};
use furuta_ctrl::estimators::Measurement;
use furuta_ctrl::settings::Settings;
use furuta_ctrl::supervisor::{Request, Supervisor};
use furuta_ctrl::{Config, Real, Site};
use furuta_model::{Rig, State};

const PERIOD: f64 = 0.002;

fn samples<T: Real>(c: &mut Criterion, precision: &str) {
    let rig = Rig::builtin("fong2014-emecs").expect("built in");
    let site = Site::of(&rig, PERIOD);
    let supervisor = Supervisor::<T>::design(&Config::default(), &site).expect("has a gain");
    let cast = |x: State<f64>| x.map(T::from_f64);
    // Held still at these angles, the supervisor stays in its mode: hanging, or upright.
    for (mode, alpha) in [("swing-up", 3.0), ("balance", 0.0)] {
        let mut state = supervisor.start();
        state.request(Request::Start);
        c.bench_function(
            &format!("supervisor, {mode} sample, {precision}"),
            |bench| {
                bench.iter(|| {
                    let m = Measurement::new(T::ZERO, T::from_f64(black_box(alpha)), T::ZERO);
                    supervisor.update(&mut state, &m, T::ZERO)
                });
            },
        );
    }
    let swing_up = SwingUp::<T>::design(&Settings::new(&SWING_UP), &site).expect("any rig");
    let (x, still) = (cast(State::new(0.1, 2.0, 1.0, -4.0)), State::upright());
    c.bench_function(&format!("swing-up alone, {precision}"), |bench| {
        let mut state = swing_up.start();
        bench.iter(|| swing_up.update(&mut state, black_box(&x), &still, T::from_f64(PERIOD)));
    });
    let x = cast(State::new(0.1, 0.2, 0.0, -1.2));
    c.bench_function(
        &format!("one prediction of the catch, {precision}"),
        |bench| {
            bench.iter(|| supervisor.catch.succeeds(black_box(&x)));
        },
    );
}

fn both(c: &mut Criterion) {
    samples::<f32>(c, "f32");
    samples::<f64>(c, "f64");
}

criterion_group!(benches, both);
criterion_main!(benches);
