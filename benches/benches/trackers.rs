//! One update of each tracking controller in both precisions, and the series of the regulator equation behind them.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use furuta_ctrl::controllers::{self, AnyController, Controller, Design};
use furuta_ctrl::controllers::{LqrSliding, NormalFormSliding, OutputRegulator};
use furuta_ctrl::design::SteadyMotion;
use furuta_ctrl::settings::Settings;
use furuta_ctrl::{Real, Site};
use furuta_model::{Rig, State};

fn update<T: Real, C: Controller<T>>(c: &mut Criterion, name: &str, controller: &C) {
    let number = T::from_f64;
    let x = State::new(number(0.3), number(0.02), number(-1.0), number(0.1));
    let reference = State::new(number(0.0), number(0.01), number(0.0), number(0.03));
    let mut state = controller.start();
    c.bench_function(name, |bench| {
        bench.iter(|| controller.update(&mut state, black_box(&x), &reference, number(0.002)));
    });
}

/// The same settings in both precisions.
fn both<A: Design + Controller<f64>, B: Design + Controller<f32>>(
    c: &mut Criterion,
    name: &str,
    settings: &Settings,
) {
    let rig = Rig::builtin("ramos-velasco").expect("built in");
    let site = Site::of(&rig, 0.002);
    let wide = A::design(settings, &site).expect("suits any rig");
    let narrow = B::design(settings, &site).expect("suits any rig");
    update(c, &format!("{name}, f64"), &wide);
    update(c, &format!("{name}, f32"), &narrow);
}

fn updates(c: &mut Criterion) {
    let settings = |id| controllers::settings(id).expect("listed");
    both::<OutputRegulator<f64>, OutputRegulator<f32>>(
        c,
        "output regulator",
        &settings("output_regulator"),
    );
    both::<NormalFormSliding<f64>, NormalFormSliding<f32>>(
        c,
        "normal form sliding",
        &settings("normal_form_sliding"),
    );
    let layer = settings("lqr_sliding");
    let twisting = layer.with("reaching", &[1.0]).expect("a word");
    both::<LqrSliding<f64>, LqrSliding<f32>>(c, "lqr sliding, layer", &layer);
    both::<LqrSliding<f64>, LqrSliding<f32>>(c, "lqr sliding, super-twisting", &twisting);
}

fn design(c: &mut Criterion) {
    let rig = Rig::builtin("ramos-velasco").expect("built in");
    let coefficients = rig.params.coefficients();
    for order in [3, 5, 7] {
        c.bench_function(&format!("steady motion, order {order}"), |bench| {
            bench.iter(|| SteadyMotion::solve(black_box(&coefficients), 1.0, order));
        });
    }
    let site = Site::of(&rig, 0.002);
    for id in ["output_regulator", "normal_form_sliding", "lqr_sliding"] {
        let settings = controllers::settings(id).expect("listed");
        c.bench_function(&format!("{id} from a controller file"), |bench| {
            bench.iter(|| AnyController::<f64>::design(black_box(&settings), &site));
        });
    }
}

criterion_group!(benches, updates, design);
criterion_main!(benches);
