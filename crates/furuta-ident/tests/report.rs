//! The report of a made-up diagnosis: what it must show, and that it stands alone. The page is left in the target
//! folder's `tmp`, to look at.

use std::collections::BTreeMap;

use furuta_ident::diagnose::result::{
    CandidateEvidence, Channel, Curves, Diagnosis, Estimate, GapBar, GapShare, HeldOut,
    MissingTorque, NamedEffect, ParameterEstimate, RunCurves, Shape, TorqueByState, TorqueInTime,
    Verdict, VerificationRow,
};
use furuta_ident::report::{self, html};
use furuta_model::{Effect, Plant, Rig, State};

const PERIOD: f64 = 0.004;

/// A QUBE with a cable and friction, predicted by the rig file, by one with more damping, and by one with the cable.
fn curves(rig: &Rig, samples: usize, window: usize, names: &[&str]) -> Vec<RunCurves> {
    let spring = Effect::new("arm.spring", &[8.6e-4, -0.5]).unwrap();
    let friction = Effect::new("arm.coulomb", &[1.2e-4]).unwrap();
    let plant = |effects: &[Effect<f64>], damping: f64| -> Plant<f64> {
        let mut rig = rig.clone();
        rig.params.arm.viscous *= damping;
        rig.effects.extend(effects.iter().copied());
        rig.plant()
    };
    let truth = plant(&[spring, friction], 0.8);
    let models = [plant(&[], 1.0), plant(&[], 0.85), plant(&[spring], 0.82)];
    names
        .iter()
        .enumerate()
        .map(|(n, name)| {
            let mut run = RunCurves {
                name: (*name).into(),
                held_out: n == 2,
                ..RunCurves::default()
            };
            let mut state = truth.rest(State::new(0.0, std::f64::consts::PI, 0.0, 0.0));
            let mut predicted: Vec<_> = models.iter().map(|model| model.rest(state.x)).collect();
            for k in 0..samples {
                let t = k as f64 * PERIOD;
                if k % window == 0 {
                    predicted = models.iter().map(|model| model.rest(state.x)).collect();
                    run.restarts.push(k);
                }
                let u = 1.5 * ((1.0 + n as f64) * (9.0 - 0.6 * t) * t).sin();
                run.t.push(t);
                run.u.push(u);
                let noise = 0.0015 * (((k * 7919) % 101) as f64 / 50.0 - 1.0);
                for (c, angle) in [state.x.theta, state.x.alpha].into_iter().enumerate() {
                    run.measured[c].push(angle + noise);
                }
                for (series, model) in [&mut run.nominal, &mut run.recalibrated, &mut run.augmented]
                    .into_iter()
                    .zip(&predicted)
                {
                    for (c, angle) in [model.x.theta, model.x.alpha].into_iter().enumerate() {
                        series[c].push(angle);
                    }
                }
                truth.step(&mut state, u, PERIOD);
                for (model, state) in models.iter().zip(&mut predicted) {
                    model.step(state, u, PERIOD);
                }
            }
            run
        })
        .collect()
}

fn rms(run: &RunCurves, model: &[Vec<f64>; 2], channel: usize) -> f64 {
    let squares = run.measured[channel]
        .iter()
        .zip(&model[channel])
        .map(|(a, b)| (a - b) * (a - b));
    (squares.sum::<f64>() / run.t.len() as f64).sqrt()
}

fn missing_spring() -> (Diagnosis, Curves) {
    let rig = Rig::builtin("qube-servo-2").unwrap();
    let names = [
        "chirp-plus-1.csv",
        "chirp-minus-1.csv",
        "<b>steps & \"balance\"</script>.csv",
    ];
    let runs = curves(&rig, 2500, 125, &names);
    let verified = curves(
        &rig,
        2500,
        usize::MAX,
        &["chirp-plus-5.csv", "chirp-minus-5.csv"],
    );
    let mean = |model: fn(&RunCurves) -> &[Vec<f64>; 2]| {
        [0, 1].map(|c| runs.iter().map(|run| rms(run, model(run), c)).sum::<f64>() / 3.0)
    };

    let mut diagnosis = Diagnosis::new(Verdict::MissingEffects);
    diagnosis.gap.horizon = 0.5;
    diagnosis.gap.nominal = mean(|run| &run.nominal).into();
    diagnosis.gap.recalibrated = mean(|run| &run.recalibrated).into();
    diagnosis.gap.augmented = mean(|run| &run.augmented).into();
    diagnosis.gap.noise_floor = [0.0009, 0.0009].into();
    diagnosis.held_out = Some(HeldOut {
        recalibrated: diagnosis.gap.recalibrated,
        augmented: diagnosis.gap.augmented,
        noise_floor: diagnosis.gap.noise_floor,
    });
    let estimate = |value, std, unit: &str| Estimate {
        value,
        std,
        unit: unit.into(),
        word: None,
    };
    diagnosis.effects.push(NamedEffect {
        id: "arm.spring".into(),
        name: furuta_model::effects::spec("arm.spring")
            .unwrap()
            .name
            .into(),
        parameters: BTreeMap::from([
            ("stiffness".into(), estimate(8.6123e-4, 1.1e-5, "N m/rad")),
            ("rest".into(), estimate(-0.5, 0.012, "rad")),
        ]),
        delta_bic: 8124.0,
        held_out_gain: 0.93,
        confusable_with: vec!["arm.cable".into(), "arm.tilt".into()],
    });
    for (name, nominal, fitted, std, unit, identifiable) in [
        ("arm.inertia", 6.18e-5, 5.42e-5, 3e-7, "kg m2", true),
        ("arm.viscous", 0.0015, 0.00121, 4e-6, "N m s/rad", true),
        ("pendulum.mass", 0.024, 0.024, f64::NAN, "kg", false),
        ("pendulum.inertia", 3.328e-5, 3.51e-5, 2e-7, "kg m2", true),
        ("motor.resistance", 8.4, 8.4, f64::NAN, "ohm", false),
    ] {
        diagnosis.parameters.insert(
            name.into(),
            ParameterEstimate {
                nominal,
                fitted,
                std,
                tolerance: 0.3,
                unit: unit.into(),
                identifiable,
                at_bound: false,
            },
        );
    }
    diagnosis.location = vec![
        GapShare {
            run: "chirp-plus-1.csv".into(),
            channel: Channel::Theta,
            condition: "abs(theta - mean) > 0.5 rad".into(),
            share_of_gap: 0.71,
        },
        GapShare {
            run: "all".into(),
            channel: Channel::Alpha,
            condition: "abs(alpha_dot) < 1 rad/s".into(),
            share_of_gap: 0.22,
        },
    ];
    diagnosis.next_experiment = Some(
        "slow arm sweeps over the whole range would separate arm.spring from arm.cable".into(),
    );
    diagnosis.notices =
        vec!["chirp-minus-1.csv: gap before row 402: no samples from 1.6 s to 1.8 s".into()];
    diagnosis.seconds = 3.2;
    for run in &verified {
        for (c, channel) in Channel::ALL.into_iter().enumerate() {
            diagnosis.verification.push(VerificationRow {
                run: run.name.clone(),
                channel,
                nominal: rms(run, &run.nominal, c),
                recalibrated: rms(run, &run.recalibrated, c),
                repaired: rms(run, &run.augmented, c),
            });
        }
    }

    let bar =
        |channel, group: &str, condition: &str, share_of_samples, recalibrated, augmented| GapBar {
            channel,
            group: group.into(),
            condition: condition.into(),
            share_of_samples,
            recalibrated,
            augmented,
        };
    let bars = vec![
        bar(
            Channel::Theta,
            "arm angle",
            "theta < -0.5 rad",
            0.2,
            900.0,
            4.0,
        ),
        bar(
            Channel::Theta,
            "arm angle",
            "abs(theta) < 0.5 rad",
            0.6,
            120.0,
            2.0,
        ),
        bar(
            Channel::Theta,
            "arm angle",
            "theta > 0.5 rad",
            0.2,
            1800.0,
            5.0,
        ),
        bar(
            Channel::Theta,
            "arm speed",
            "abs(theta_dot) < 0.3 rad/s",
            0.1,
            300.0,
            16.0,
        ),
        bar(
            Channel::Theta,
            "arm speed",
            "abs(theta_dot) > 0.3 rad/s",
            0.9,
            340.0,
            3.0,
        ),
        bar(
            Channel::Alpha,
            "pendulum speed",
            "abs(alpha_dot) < 1 rad/s",
            0.5,
            12.0,
            1.4,
        ),
        bar(
            Channel::Alpha,
            "pendulum speed",
            "abs(alpha_dot) > 1 rad/s",
            0.5,
            19.0,
            2.0,
        ),
    ];
    let mut evidence: Vec<_> = [
        ("arm.coulomb", 2210.0),
        ("motor.bias", 890.0),
        ("motor.delay", 150.0),
        ("arm.quadratic", 12.0),
        ("pendulum.coulomb", -7.0),
        ("sensor.alpha.offset", f64::NAN),
    ]
    .map(|(id, delta_bic)| CandidateEvidence {
        id: id.into(),
        delta_bic,
        named: false,
    })
    .into();
    evidence.push(CandidateEvidence {
        id: "arm.spring".into(),
        delta_bic: 8124.0,
        named: true,
    });
    diagnosis.missing_torque.push(MissingTorque {
        axis: Channel::Theta,
        state: "theta".into(),
        shape: Some(Shape::Proportional),
        size: -8.6e-4,
        unit: "N m/rad".into(),
        share_of_gap: 0.93,
    });
    let at: Vec<f64> = (-8..8).map(|k| 0.1 * f64::from(k)).collect();
    let small = vec![1e-6; at.len()];
    let by_state = ["theta", "theta_dot"].map(|state| TorqueByState {
        axis: Channel::Theta,
        state: state.into(),
        unit: "rad".into(),
        recalibrated: at.iter().map(|x| -8.6e-4 * (x + 0.5)).collect(),
        recalibrated_std: small.clone(),
        augmented: small.clone(),
        augmented_std: small.clone(),
        at: at.clone(),
    });
    let swing: Vec<f64> = at.iter().map(|t| 4e-4 * (9.0 * t).sin()).collect();
    let in_time = TorqueInTime {
        run: "chirp<1>.csv".into(),
        recalibrated: [swing.clone(), small.clone()],
        recalibrated_std: [small.clone(), small.clone()],
        // A window that says nothing about the repaired model.
        augmented: [vec![f64::NAN; at.len()], small.clone()],
        augmented_std: [small.clone(), small],
        t: at,
    };
    let curves = Curves {
        rig: rig.name.clone(),
        runs,
        bars,
        evidence,
        verification: verified,
        repaired_rig: Some(rig.to_toml()),
        torque_by_state: by_state.into(),
        torque_in_time: vec![in_time],
    };
    (diagnosis, curves)
}

fn keep(name: &str, page: &str) {
    std::fs::write(
        std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name),
        page,
    )
    .unwrap();
}

#[test]
fn the_page_shows_the_diagnosis() {
    let (diagnosis, curves) = missing_spring();
    let page = html(&diagnosis, &curves);
    keep("report.html", &page);
    for piece in [
        "Missing from the model: spring (cable) on the arm; with it added,",
        "pulls the arm back towards one angle", // the catalogue's sentence
        "[effects.&quot;arm.spring&quot;]\nrest = -0.5 ", // to paste
        "\nstiffness = 0.00086123 ",
        "<code>arm.cable</code>, <code>arm.tilt</code>",
        "0.000861",
        "<td class=\"n unknown\">kept</td>",
        "<b>71 %</b> of the arm's gap in chirp-plus-1.csv",
        "slow arm sweeps",
        "On the arm a torque in proportion to the arm&#39;s angle is missing (-0.00086 N m/rad)",
        "theta_dot [rad]",
        "Torque missing on the arm, chirp&lt;1&gt;.csv",
        "no samples from 1.6 s to 1.8 s",
        "chirp-minus-5.csv",
        "id=\"data-runs\"",
        "id=\"data-verified\"",
    ] {
        assert!(page.contains(piece), "{piece}");
    }
    let (written, _script) = page.split_once("\"use strict\"").unwrap();
    assert!(!written.contains("NaN"));
}

/// What the recordings moved stands in the text and on the card: not what they moved by less than its deviation, nor
/// what they cannot show.
#[test]
fn numbers_of_the_sheet_that_moved_are_said() {
    let (mut diagnosis, _) = missing_spring();
    let inertia = "pendulum.inertia";
    let parameter = diagnosis.parameters.get_mut(inertia).expect("given");
    assert_eq!(parameter.change(), "3.33e-5 to 3.51e-5 kg m2, +5 %");
    let text = report::text(&diagnosis, "rig.toml");
    assert!(
        text.contains("  pendulum.inertia             3.33e-5 to 3.51e-5 kg m2, +5 %\n"),
        "{text}"
    );
    assert!(report::card(&diagnosis).contains("3.33e-5 to 3.51e-5 kg m2, +5 %"));
    assert!(!text.contains("motor.resistance  "), "{text}");
    let parameter = diagnosis.parameters.get_mut(inertia).expect("given");
    parameter.fitted = parameter.nominal + 1.5 * parameter.std;
    assert!(!diagnosis.moved().any(|(key, _)| key == inertia));
    let parameter = diagnosis.parameters.get_mut(inertia).expect("given");
    parameter.fitted = 0.0;
    assert!(
        parameter
            .change()
            .ends_with("no body is like that; something else took its place")
    );
}

#[test]
fn the_page_stands_alone_and_is_small() {
    let (diagnosis, curves) = missing_spring();
    let page = html(&diagnosis, &curves);
    for outside in ["http://", "https://", "src=", "@import", "url("] {
        assert!(!page.contains(outside), "{outside}");
    }
    assert!(page.len() < 1_000_000, "{} bytes", page.len());
    // Names come from outside: none may become markup.
    assert!(!page.contains("<b>steps"));
    assert_eq!(page.matches("</script>").count(), 3);
}

#[test]
fn a_page_exists_for_every_verdict_with_nothing_else_known() {
    for verdict in [
        Verdict::NoGap,
        Verdict::ParametersOnly,
        Verdict::MissingEffects,
        Verdict::Unexplained,
    ] {
        let page = html(&Diagnosis::new(verdict), &Curves::default());
        assert!(page.contains(verdict.as_str()) && page.ends_with("</html>\n"));
        for absent in ["<canvas", "<svg", "<table"] {
            assert!(!page.contains(absent), "{verdict}: {absent}");
        }
    }
}

#[test]
fn a_clean_diagnosis_is_a_short_page() {
    let rig = Rig::builtin("qube-servo-2").unwrap();
    let mut diagnosis = Diagnosis::new(Verdict::ParametersOnly);
    diagnosis.gap.nominal = [0.02, 0.03].into();
    diagnosis.gap.recalibrated = [0.001, 0.001].into();
    diagnosis.gap.noise_floor = [0.001, 0.001].into();
    let mut runs = curves(&rig, 1000, 125, &["run.csv"]);
    runs[0].augmented = Default::default();
    let page = html(
        &diagnosis,
        &Curves {
            rig: rig.name,
            runs,
            ..Curves::default()
        },
    );
    keep("report-clean.html", &page);
    assert!(page.contains(
        "with the parameters refitted, the prediction error of the pendulum falls from 0.030 to \
                           0.0010 rad"
    ));
    assert!(
        !page.contains("data-model=\"augmented\"") && !page.contains("What the model is missing")
    );
}

/// Two states of one rig in a table; what a file's name holds is text.
#[test]
fn another_state_has_a_section() {
    use furuta_ident::diagnose::result::{Comparison, Difference};
    let estimate = |value: f64| Estimate {
        value,
        std: 1e-5,
        unit: "N m/rad".into(),
        word: None,
    };
    let mut diagnosis = Diagnosis::new(Verdict::MissingEffects);
    assert!(!html(&diagnosis, &Curves::default()).contains("Another state"));
    let difference = |there: f64, differs| Difference {
        id: "arm.spring".into(),
        parameter: "stiffness".into(),
        here: estimate(2e-3),
        there: estimate(there),
        deviations: 140.0,
        differs,
    };
    diagnosis.comparison = Some(Comparison {
        there: vec!["without <cable>.csv".into()],
        verdict: Verdict::NoGap,
        named: Vec::new(),
        differences: vec![difference(0.0, true), difference(2e-3, false)],
    });
    let page = html(&diagnosis, &Curves::default());
    let section = page
        .split("<h2>Another state of the rig</h2>")
        .nth(1)
        .expect("a section");
    for text in [
        "without &lt;cable&gt;.csv (nothing is named",
        "<b>differs</b>",
        "no difference shows",
        "N m/rad",
        "0.00200 ± ",
    ] {
        assert!(section.contains(text), "{text}: {section}");
    }
    diagnosis
        .comparison
        .as_mut()
        .expect("there")
        .differences
        .clear();
    assert!(html(&diagnosis, &Curves::default()).contains("nothing differs"));
}
