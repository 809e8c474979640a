//! Effects named from a transfer function alone, and a paper's fit held against its own model.

use furuta_ident::frequency::bands::errors;
use furuta_ident::frequency::compare::{Comparison, Measured, compare, own};
use furuta_ident::frequency::first_principles::{Output, of_plant, of_rig};
use furuta_ident::frequency::fong2014::{EDGES, Experiment, published};
use furuta_ident::frequency::{Frf, Transfer};
use furuta_model::effects::Footprint;
use furuta_model::{CATALOGUE, Effect, Plant, Rig};

const BAND: [f64; 2] = [0.1, 23.0];

fn rig() -> Rig {
    Rig::builtin("fong2014-emecs").expect("built in")
}

/// The response of a rig with one effect.
fn with(effect: &str, values: &[f64], output: Output) -> Comparison {
    let rig = rig();
    let effect = Effect::new(effect, values).expect("in range");
    let plant = Plant::new(&rig.params, &[effect]).expect("a plant");
    let g = of_plant(&plant, output).expect("a function");
    compare(&Measured::function(&g, output, BAND).expect("a band"), &rig).expect("a comparison")
}

#[test]
fn the_effect_that_is_there_is_named_with_its_value() {
    // Hanging, a pendulum's spring and its weight are one stiffness; what the data sheet holds fast tells them apart
    // where the arm is looked at.
    for (id, values, output, expected) in [
        ("arm.spring", &[0.004, 0.0][..], Output::Alpha, 0.004),
        ("arm.spring", &[0.004, 0.0], Output::Theta, 0.004),
        ("arm.tilt", &[0.1, 0.0, 0.0], Output::Theta, 0.1),
    ] {
        let found = with(id, values, output);
        let best = &found.explanations[0];
        assert_eq!(best.effects, [id], "{best:?}");
        assert!(best.relative_error < 1e-5, "{id} {}", best.relative_error);
        // Alpha leaves one combination of all parameters open: values stay near the data sheet's, whose are true here.
        assert!(
            (best.values[0].value / expected - 1.0).abs() < 0.02,
            "{:?}",
            best.values
        );
    }
}

/// The linear model used here is the dynamics' own, linearised by dual numbers.
#[test]
fn the_rig_as_given_is_its_linearisation() {
    for output in [Output::Theta, Output::Alpha] {
        let g = of_rig(&rig(), output).expect("a function");
        let measured = Measured::function(&g, output, BAND).expect("a band");
        let found = compare(&measured, &rig()).expect("a comparison");
        assert!(found.as_given_error < 1e-10, "{}", found.as_given_error);
        assert!(found.explanations[0].effects.is_empty());
        assert!(
            found.explanations.iter().all(|e| e.effects.len() < 2),
            "nothing is added to what fits"
        );
    }
}

#[test]
fn lag_and_delay() {
    let g = of_rig(&rig(), Output::Alpha).expect("a function");
    let frequency: Vec<f64> = (0..60)
        .map(|k| 0.1 * 230_f64.powf(f64::from(k) / 59.0))
        .collect();
    let late = Transfer {
        delay: 0.01,
        ..g.clone()
    };
    let measured = |g: &Transfer| Measured {
        frf: Frf::exact(&frequency, |f| g.response(f)),
        ..Measured::function(g, Output::Alpha, BAND).expect("a band")
    };
    let found = compare(&measured(&late), &rig()).expect("a comparison");
    assert_eq!(found.explanations[0].effects, ["motor.delay"]);
    assert!((found.explanations[0].values[0].value - 0.01).abs() < 1e-5);
    // 1 / (0.02 s + 1).
    let product: Vec<f64> = (0..5)
        .map(|i| {
            let d = &g.denominator;
            0.02 * d.get(i).copied().unwrap_or(0.0) + if i > 0 { d[i - 1] } else { 0.0 }
        })
        .collect();
    let lagging = Transfer::new(&g.numerator, &product).expect("proper");
    let found = compare(&measured(&lagging), &rig()).expect("a comparison");
    assert_eq!(found.explanations[0].effects, ["motor.lag"]);
    assert!((found.explanations[0].values[0].value - 0.02).abs() < 1e-4);
}

/// The published fit (29) against the published model (28): of all single effects the arm's spring explains most, and
/// its evidence is strong; a pole at the origin that has moved says just that.
#[test]
fn the_papers_own_fit_asks_for_a_spring() {
    let g = published().expect("in the table");
    let found = compare(
        &Measured::function(&g, Output::Alpha, BAND).expect("a band"),
        &rig(),
    )
    .expect("a comparison");
    let best = found.singles().next().expect("six");
    assert_eq!(best.effects, ["arm.spring"]);
    assert!(best.evidence > 6.0, "{}", best.evidence);
    assert!(found.explanations[0].effects.contains(&"arm.spring"));
    let alone = found.parameters_alone().expect("always tried");
    assert!(best.relative_error < 0.6 * alone.relative_error);
    // But no explanation is complete: the published zeros at +0.49 and -13.3 rad/s are none that a rig with these
    // effects can have.
    assert!(found.explanations[0].relative_error > 0.05);
}

/// What the catalogue says of an effect's footprint is what its laws do.
#[test]
fn footprints_are_those_of_the_effects_own_laws() {
    let own: Vec<&str> = own().map(|s| s.id).collect();
    let rig = rig();
    for spec in CATALOGUE {
        match spec.footprint {
            Footprint::Own(shown) => {
                let known = |name: &&&str| spec.parameters.iter().any(|p| p.name == **name);
                assert!(
                    !shown.is_empty() && shown.iter().all(|n| known(&n)),
                    "{}",
                    spec.id
                );
            }
            Footprint::Like(other, _) => assert!(own.contains(&other), "{}", spec.id),
            Footprint::Refitted(..) | Footprint::Scale(_) => {}
            Footprint::Nothing(_) => {
                // Where its linearisation is defined, it is the rig's own.
                let values: Vec<f64> = spec
                    .parameters
                    .iter()
                    .map(|p| p.typical(&rig.params))
                    .collect();
                let Ok(effect) = Effect::new(spec.id, &values) else {
                    continue;
                };
                let Ok(plant) = Plant::new(&rig.params, &[effect]) else {
                    continue;
                };
                for output in [Output::Theta, Output::Alpha] {
                    let with = of_plant(&plant, output).expect("a function");
                    let without = of_rig(&rig, output).expect("a function");
                    let frf = Frf::exact(&[0.5, 1.0, 3.0], |f| without.response(f));
                    let apart = errors(&frf, &[0.1, 5.0], |f| with.response(f));
                    assert!(apart.iter().all(|b| b.relative < 1e-3), "{}", spec.id);
                }
            }
        }
    }
}

/// Paper A's experiment, shortened to 60 s: the fit finds the rig's poles within its deviations, and the
/// first-principles model is right within the noise; with a spring hidden, the model is wrong and the fit is not, and
/// `compare` names the spring.
#[test]
fn noise_to_transfer_function() {
    let experiment = Experiment {
        duration: 60.0,
        resolution: 0.12,
        rms: 0.4,
        ..Experiment::default()
    };
    let mut rig = rig();
    let outcome = experiment.run(&rig).expect("it runs");
    let truth = outcome.first_principles.poles().expect("they converge");
    for (p, truth) in outcome.chosen.poles.iter().zip(&truth) {
        // Three deviations, and what a swing of 4 degrees does to the frequency.
        assert!(
            (p.value.re - truth.re).abs() < 3.0 * p.std.re + 0.02,
            "{p:?} {truth}"
        );
        assert!(
            (p.value.im - truth.im).abs() < 3.0 * p.std.im + 0.05,
            "{p:?} {truth}"
        );
    }
    assert_eq!(outcome.chosen.transfer.orders(), [1, 3]);
    assert!(
        (0.7..1.5).contains(&outcome.chosen.chi2),
        "{}",
        outcome.chosen.chi2
    );

    rig.effects
        .push(Effect::new("arm.spring", &[0.02, 0.0]).expect("in range"));
    let outcome = experiment.run(&rig).expect("it runs");
    let slow = |model: usize| outcome.bands[model][0].relative;
    assert!(slow(0) > 3.0 * slow(3), "{} {}", slow(0), slow(3));
    let measured = Measured::response(outcome.frf.clone(), Output::Alpha);
    let found = compare(&measured, &rig).expect("a comparison");
    let best = &found.explanations[0];
    assert_eq!(best.effects, ["arm.spring"], "{best:?}");
    assert!(
        (best.values[0].value / 0.02 - 1.0).abs() < 0.2,
        "{:?}",
        best.values
    );
    let bands = errors(&outcome.frf, &EDGES, |f| outcome.chosen.response(f));
    assert!((bands[0].relative - outcome.bands[3][0].relative).abs() < 1e-12);
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let g = published().expect("in the table");
    let error = Measured::function(&g, Output::Alpha, [2.0, 1.0]).expect_err("no band");
    assert_eq!(
        error.to_string(),
        "a band from 2 to 1 Hz: give two frequencies above 0, the lower one first"
    );
    let mut measured = Measured::function(&g, Output::Alpha, BAND).expect("a band");
    measured.frf.response[5] = nalgebra::Complex::new(0.0, 0.0);
    assert!(
        compare(&measured, &rig())
            .expect_err("a zero")
            .to_string()
            .contains("must be finite and not 0")
    );
    measured.frf = measured.frf.band(0.1, 0.12).expect("lines");
    assert!(
        compare(&measured, &rig())
            .expect_err("too few")
            .to_string()
            .starts_with("the response has ")
    );
}
