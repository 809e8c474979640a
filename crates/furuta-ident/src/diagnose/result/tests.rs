use std::collections::BTreeMap;

use super::*;

fn spring() -> Diagnosis {
    let mut diagnosis = Diagnosis::new(Verdict::MissingEffects);
    diagnosis.effects.push(NamedEffect {
        id: "arm.spring".into(),
        name: "Spring on the arm".into(),
        parameters: BTreeMap::from([
            (
                "stiffness".into(),
                Estimate {
                    value: 8.6e-4,
                    std: 1e-5,
                    word: None,
                    unit: "N m/rad".into(),
                },
            ),
            (
                "rest".into(),
                Estimate {
                    value: -0.5,
                    std: f64::INFINITY,
                    word: None,
                    unit: "rad".into(),
                },
            ),
        ]),
        delta_bic: 812.4,
        held_out_gain: f64::NAN,
        confusable_with: vec!["arm.cable".into()],
    });
    diagnosis.gap.recalibrated = [0.46, 0.023].into();
    diagnosis.gap.augmented = [0.06, 0.02].into();
    diagnosis.location.push(GapShare {
        run: "a.csv".into(),
        channel: Channel::Theta,
        condition: "all".into(),
        share_of_gap: 0.8,
    });
    diagnosis.seconds = 3.1;
    diagnosis
}

/// The keys of the contract, spelt out: renaming a field must fail here.
#[test]
fn json_has_the_keys_of_the_contract() {
    let json: serde_json::Value = serde_json::from_str(&spring().to_json()).unwrap();
    assert_eq!(json["schema"], 1);
    assert_eq!(json["verdict"], "missing_effects");
    assert_eq!(json["effects"][0]["id"], "arm.spring");
    assert_eq!(
        json["effects"][0]["parameters"]["stiffness"]["value"],
        8.6e-4
    );
    assert_eq!(
        json["effects"][0]["parameters"]["stiffness"]["unit"],
        "N m/rad"
    );
    assert_eq!(json["effects"][0]["delta_bic"], 812.4);
    assert_eq!(json["effects"][0]["confusable_with"][0], "arm.cable");
    assert_eq!(json["gap"]["unit"], "rad");
    for model in ["nominal", "recalibrated", "augmented", "noise_floor"] {
        assert!(
            json["gap"][model]
                .as_object()
                .unwrap()
                .contains_key("theta"),
            "{model}"
        );
    }
    assert_eq!(json["gap"]["recalibrated"]["theta"], 0.46);
    assert_eq!(json["where"][0]["channel"], "theta");
    assert_eq!(json["where"][0]["share_of_gap"], 0.8);
    for key in ["parameters", "held_out", "next_experiment", "seconds"] {
        assert!(json.as_object().unwrap().contains_key(key), "{key}");
    }
}

#[test]
fn numbers_that_are_not_finite_become_null_and_come_back_as_nan() {
    let json = spring().to_json();
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(value["effects"][0]["parameters"]["rest"]["std"].is_null());
    assert!(value["effects"][0]["held_out_gain"].is_null());
    assert!(value["gap"]["nominal"]["theta"].is_null());
    let back = Diagnosis::from_json(&json).unwrap();
    assert!(back.gap.nominal.theta.is_nan());
    assert_eq!(back.to_json(), json);
}

#[test]
fn sentence_names_the_effect_and_the_larger_change() {
    let sentence = spring().sentence();
    assert_eq!(
        sentence,
        "Missing from the model: spring on the arm; with it added, the prediction error of the arm falls from 0.46 to \
         0.060 rad."
    );
}

/// The headline is of data kept apart where there are such. It says so when they are predicted worse, and never that
/// an error falls from 0.0011 to 0.0011. Where one angle's error rises, that of the other does not hide it.
#[test]
fn the_change_on_data_kept_apart_falls_rises_or_stays() {
    for (before, after, said) in [
        (
            [0.0026, 0.5],
            [0.12, 0.6],
            "pendulum rises from 0.50 to 0.60 rad, and that of the arm rises from 0.0026 to 0.12",
        ),
        (
            [0.100, 0.02],
            [0.090, 0.2],
            "arm falls from 0.10 to 0.090 rad, but that of the pendulum rises from 0.020 to 0.20",
        ),
        ([0.02, 0.100], [0.2, 0.1001], "arm rises from 0.020 to 0.20"),
        ([0.5, 0.0026], [0.1, 0.0026], "arm falls from 0.50 to 0.10"),
        ([0.001_12, 0.5], [0.001_06, 0.5], "arm stays at 0.0011"),
    ] {
        let mut diagnosis = spring();
        diagnosis.held_out = Some(HeldOut {
            recalibrated: before.into(),
            augmented: after.into(),
            noise_floor: Channels::UNKNOWN,
        });
        let sentence = diagnosis.sentence();
        let end = format!("on data kept apart the prediction error of the {said} rad.");
        assert!(sentence.ends_with(&end), "{sentence}");
    }
}

/// What a repaired rig file holds is said with its reason: not judged, worse, or numbers that cannot be.
/// What the refitted sheet alone has at a bound is a sign of what is missing, and not the rig file's mistake.
#[test]
fn a_bound_is_said_of_the_model_that_has_it() {
    let at = |model| AtBound {
        model,
        parameter: "arm.length".into(),
        value: 0.167,
        unit: "m".into(),
        reason: "twice as far as a ruler errs".into(),
    };
    let said = |at_bound| {
        let text = crate::report::text(
            &Diagnosis {
                at_bound,
                ..spring()
            },
            "rig.toml",
        );
        [
            "or the rig file is wrong",
            "the parameters alone are refitted",
        ]
        .map(|s| text.contains(s))
    };
    assert_eq!(said(vec![]), [false, false]);
    assert_eq!(said(vec![at(Best::Refitted)]), [false, true]);
    assert_eq!(said(vec![at(Best::Repaired)]), [true, false]);
    assert_eq!(
        said(vec![at(Best::Refitted), at(Best::Repaired)]),
        [true, false]
    );
}

#[test]
fn what_is_written_is_said_with_its_reason() {
    let at = |model| AtBound {
        model,
        parameter: "motor.torque_constant".into(),
        value: 0.0105,
        unit: "N m/A".into(),
        reason: "a quarter of the rig file's".into(),
    };
    let [refitted, repaired] = [Best::Refitted, Best::Repaired].map(at);
    let both = vec![refitted.clone(), repaired.clone()];
    let mut diagnosis = spring();
    assert_eq!(diagnosis.written(), None);
    diagnosis.best = Best::Given;
    let said = |d: &Diagnosis| d.written().expect("not the repaired model");
    assert!(said(&diagnosis).starts_with("Nothing was judged on data kept apart"));
    diagnosis.held_out = Some(HeldOut::default());
    for (best, at_bound, start) in [
        (
            Best::Given,
            vec![],
            "On data kept apart the rig file as given predicts best",
        ),
        (
            Best::Given,
            both.clone(),
            "The fitted models have numbers that cannot be: a repaired rig file holds the rig file as given.",
        ),
        (
            Best::Refitted,
            vec![repaired],
            "The repaired model has numbers that cannot be; on data kept apart the rig file with refitted parameters",
        ),
        (
            Best::Given,
            vec![refitted],
            "The refitted model has numbers that cannot be; on data kept apart the rig file as given predicts best",
        ),
    ] {
        (diagnosis.best, diagnosis.at_bound) = (best, at_bound);
        let said = said(&diagnosis);
        assert!(said.starts_with(start), "{said}");
    }
    diagnosis.at_bound = both;
    assert_eq!(diagnosis.bounds().count(), 1);
    assert!(diagnosis.why_no_limits().is_some());
    let json: serde_json::Value = serde_json::from_str(&diagnosis.to_json()).unwrap();
    assert_eq!(json["at_bound"][1]["model"], "repaired");
    assert_eq!(json["at_bound"][1]["value"], 0.0105);
}

#[test]
fn sentences_exist_without_any_number() {
    for verdict in [
        Verdict::NoGap,
        Verdict::ParametersOnly,
        Verdict::MissingEffects,
        Verdict::Unexplained,
    ] {
        let sentence = Diagnosis::new(verdict).sentence();
        assert!(
            sentence.ends_with('.') && !sentence.contains("NaN"),
            "{sentence}"
        );
    }
}

#[test]
fn significant_digits() {
    assert_eq!(significant(0.060_4, 2), "0.060");
    assert_eq!(significant(-1234.5, 3), "-1234");
    assert_eq!(significant(8.61e-4, 2), "0.00086");
    assert_eq!(significant(8.61e-5, 2), "8.6e-5");
    assert_eq!(significant(0.0, 3), "0");
    assert_eq!(significant(f64::NAN, 3), "unknown");
}
