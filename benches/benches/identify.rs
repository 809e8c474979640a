//! Identification in the frequency domain: the response of three minutes at 1 kHz, a fit to it, a comparison with the
//! rig.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use furuta_ident::frequency::compare::{Measured, compare};
use furuta_ident::frequency::first_principles::Output;
use furuta_ident::frequency::fong2014::{Experiment, published};
use furuta_ident::frequency::{
    Delay, Estimator, Frf, Hold, Request, Settings, Stretch, fit, local, periodic,
};
use furuta_model::Rig;
use furuta_model::signals::random::normal;

fn identify(c: &mut Criterion) {
    let n = 180_000;
    let u: Vec<f64> = (0..n).map(|k| normal(1, k)).collect();
    let mut y = vec![0.0; u.len()];
    for k in 2..u.len() {
        y[k] = 1.98 * y[k - 1] - 0.981 * y[k - 2] + 0.001 * u[k - 1];
    }
    let data = [Stretch {
        u: &u,
        y: &y,
        r: None,
    }];
    for segment in [2_000, 20_000] {
        let settings = Settings::new(segment);
        c.bench_function(
            &format!("frf, 180 s at 1 kHz, segments of {segment}"),
            |b| {
                b.iter(|| Frf::measure(black_box(&data), 0.001, &settings, Estimator::H1));
            },
        );
    }
    c.bench_function("frf, 180 s at 1 kHz, local, 0.05 Hz to 23 Hz", |b| {
        b.iter(|| local::response(black_box(&data), 0.001, 0.05, Some([0.1, 23.0])));
    });
    let repeated: Vec<f64> = (0..u.len()).map(|k| u[k % 20_000]).collect();
    let data = [Stretch {
        u: &repeated,
        y: &y,
        r: None,
    }];
    c.bench_function("frf, 180 s at 1 kHz, periods of 20 s", |b| {
        b.iter(|| periodic::response(black_box(&data), 0.001, 20.0, 1));
    });

    let rig = Rig::builtin("fong2014-emecs").expect("built in");
    let outcome = Experiment::default().run(&rig).expect("it runs");
    let request = Request {
        zeros: 2,
        poles: 4,
        hold: Hold::ZeroOrder(0.001),
        delay: Delay::Known(0.0),
    };
    c.bench_function("fit 2/4 to 459 lines", |b| {
        b.iter(|| fit(black_box(&outcome.frf), &request));
    });
    let g = published().expect("in the table");
    let measured = Measured::function(&g, Output::Alpha, [0.1, 23.0]).expect("a band");
    c.bench_function("compare (29) with its rig", |b| {
        b.iter(|| compare(black_box(&measured), &rig));
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = identify
}
criterion_main!(benches);
