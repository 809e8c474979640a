//! Planned experiments do what was predicted: simulated and calibrated, they give the standard deviations that were
//! predicted.

use crate::common;

use common::qube;
use furuta_ident::calibrate::{CalibrateError, Options, calibrate, plan};
use furuta_ident::recording::Recording;
use furuta_model::Rig;
use furuta_model::signals::{Excitation, Prbs, Signal, Steps};

/// A recording of a test signal at 200 Hz, read by the encoders.
fn made(rig: &Rig, signal: Signal) -> Recording {
    let excitation = Excitation::new(signal, 10.0).expect("ten seconds");
    let run = common::RunSetup {
        rate: 200.0,
        seed: 7,
        ..common::RunSetup::default()
    };
    common::record("planned.csv", rig, run, |t, _| excitation.volts(t))
}

/// `--amplitude` of a planned experiment.
fn amplitude(arguments: &str) -> f64 {
    let mut words = arguments.split(' ').skip_while(|w| *w != "--amplitude");
    words
        .nth(1)
        .and_then(|w| w.parse().ok())
        .expect("an amplitude")
}

#[test]
fn a_plan_keeps_its_promise() {
    let rig = qube();
    let plan = plan(&rig, &Options::default(), 200.0, 2).expect("a plan");
    assert_eq!(plan.sequence[0], 0, "the best alone is the first");
    assert!(
        plan.experiments
            .windows(2)
            .all(|e| e[0].log_det >= e[1].log_det)
    );
    assert!(plan.experiments.len() > 15);
    assert!((plan.experiments[0].efficiency - 1.0).abs() < 1e-12);

    // A telling experiment and the worst that still tells everything, really made: what calibration then says of its
    // own errors is what was predicted.
    let signal = |words: &str, volts: f64| -> Option<Signal> {
        let switching = |hold| Prbs::new(volts, 7, hold, 0).expect("a signal").into();
        let stepping = |hold| Steps::new(volts, hold).expect("a signal").into();
        match words {
            "random switching" => Some(switching(0.05)),
            "fast random switching" => Some(switching(0.01)),
            "steps" => Some(stepping(0.5)),
            "long steps" => Some(stepping(2.0)),
            _ => None,
        }
    };
    let mut makeable = plan
        .experiments
        .iter()
        .filter(|e| e.std.iter().all(|s| *s < 0.1))
        .filter_map(|e| {
            let volts = e
                .arguments
                .contains("--amplitude")
                .then(|| amplitude(&e.arguments))?;
            Some((e, signal(&e.excitation, volts)?))
        });
    let best = makeable.next().expect("a telling signal");
    let worst = makeable.next_back().expect("a worse one");
    assert!(best.0.log_det > worst.0.log_det + 2.0);
    let recordings = [made(&rig, best.1), made(&rig, worst.1)];
    let (best, worst) = (best.0, worst.0);
    let options = Options {
        free: plan.parameters.clone(),
        ..Options::default()
    };
    let mut compared = 0;
    let mut ratios = [Vec::new(), Vec::new()];
    for ((experiment, recording), ratios) in
        [best, worst].into_iter().zip(&recordings).zip(&mut ratios)
    {
        let c = calibrate(std::slice::from_ref(recording), &rig, &options)
            .expect("a planned recording")
            .calibration;
        for (key, predicted) in plan.parameters.iter().zip(&experiment.std) {
            let p = &c.parameters[key];
            // Beyond a tenth, what is known beforehand is part of the prediction, and the fit is no longer linear.
            if !p.std.is_finite() || *predicted > 0.1 {
                ratios.push(None);
                continue;
            }
            let error = (p.fitted - p.nominal).abs();
            assert!(error < 4.0 * p.std, "{key}: {error} with {}", p.std);
            let ratio = p.std / p.fitted.abs() / predicted;
            // Scores of ten seconds know a standard deviation to some ten per cent, and rounding that repeats itself
            // widens it.
            assert!((0.4..2.5).contains(&ratio), "{key}: {ratio}");
            ratios.push(Some(ratio));
            compared += 1;
        }
    }
    assert!(
        compared > plan.parameters.len(),
        "{compared} compared: {ratios:?}"
    );
    for (key, (a, b)) in plan.parameters.iter().zip(ratios[0].iter().zip(&ratios[1])) {
        if let (Some(a), Some(b)) = (a, b) {
            // The predicted ratio of the two is right to a factor of two.
            assert!((0.5..2.0).contains(&(a / b)), "{key}: {}", a / b);
        }
    }
}

#[test]
fn a_plan_says_what_it_cannot_do() {
    let rig = qube();
    let error = |options: &Options, rate| plan(&rig, options, rate, 1).expect_err("no plan");
    assert!(matches!(
        error(&Options::default(), 1.0),
        CalibrateError::OutOfRange { what: "rate", .. }
    ));
    let unknown = Options {
        free: vec!["arm.mass".into()],
        ..Options::default()
    };
    assert!(matches!(
        error(&unknown, 200.0),
        CalibrateError::UnknownParameter { .. }
    ));
}
