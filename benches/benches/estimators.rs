//! One update of each estimator, and one command compensated, in both precisions.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use furuta_ctrl::compensation::{self, Compensation, Situation};
use furuta_ctrl::estimators::{self, AnyEstimator, Estimator, Measurement};
use furuta_ctrl::settings::Settings;
use furuta_ctrl::{Real, Site};
use furuta_model::{Effect, Rig, State};

fn update<T: Real>(c: &mut Criterion, rig: &Rig, label: &str, precision: &str) {
    for spec in estimators::CATALOGUE {
        let site = Site::of(rig, 0.002);
        let estimator =
            AnyEstimator::<T>::design(&Settings::new(spec), &site).expect("suits any rig");
        let mut memory = estimator.start();
        let number = T::from_f64;
        let m = Measurement::new(number(0.1), number(0.02), number(0.5));
        c.bench_function(&format!("{}{label}, {precision}", spec.id), |bench| {
            bench.iter(|| estimator.update(&mut memory, black_box(&m)));
        });
    }
}

fn compensate<T: Real>(c: &mut Criterion, rig: &Rig, precision: &str) {
    let settings = Settings::new(&compensation::SPEC);
    let compensation =
        Compensation::<T>::design(&settings, &Site::of(rig, 0.002)).expect("suits any rig");
    let number = T::from_f64;
    let situation = Situation {
        x: State::new(number(0.1), number(0.02), number(0.5), number(-0.3)),
        reference: number(0.1),
        disturbance: number(0.1),
    };
    let name = format!("compensation of friction, spring and dead zone, {precision}");
    c.bench_function(&name, |bench| {
        bench.iter(|| compensation.command(black_box(number(1.0)), &situation));
    });
}

fn all(c: &mut Criterion) {
    let mut rig = Rig::builtin("shahzad2022-srv02").expect("built in");
    update::<f64>(c, &rig, "", "f64");
    update::<f32>(c, &rig, "", "f32");
    let effect = |id, values: &[f64]| Effect::new(id, values).expect("an effect");
    rig.effects = vec![effect("arm.coulomb", &[0.02])];
    update::<f64>(c, &rig, ", with friction", "f64");
    update::<f32>(c, &rig, ", with friction", "f32");
    rig.effects.push(effect("arm.spring", &[0.03, -0.5]));
    rig.effects.push(effect("motor.deadzone", &[0.3]));
    compensate::<f64>(c, &rig, "f64");
    compensate::<f32>(c, &rig, "f32");
}

criterion_group!(benches, all);
criterion_main!(benches);
