//! Empirical expressions for what no effect explains: found where something foreign is hidden, absent where nothing is
//! or a catalogue effect is.

use furuta_ident::diagnose::{Outcome, Request, Verdict, diagnose};
use furuta_ident::recording::Recording;
use furuta_ident::report;
use furuta_model::effects::TERMS;
use furuta_model::simulate::trajectory;
use furuta_model::{Effect, Plant, Rig, State};

const PERIOD: f64 = 4e-3;

fn qube() -> Rig {
    Rig::builtin("qube-servo-2").expect("built in")
}

fn term(id: &str, coefficient: f64, on: f64, word: &str) -> Effect<f64> {
    let place = TERMS.iter().position(|t| t.word == word).expect(word);
    Effect::new(id, &[coefficient, on, place as f64]).expect("valid")
}

/// What the encoders of a rig with `hidden` show under three commands, the pendulum hanging.
fn recordings(hidden: &[Effect<f64>]) -> Vec<Recording> {
    let mut rig = qube();
    // The data sheet is not quite right.
    rig.params.arm.inertia *= 1.05;
    rig.params.motor.torque_constant *= 0.97;
    let plant: Plant<f64> = Plant::new(&rig.params, hidden).expect("valid");
    [(1.3, 0.8), (1.7, -0.5), (0.9, 1.1)]
        .into_iter()
        .enumerate()
        .map(|(i, (fast, slow))| {
            let u: Vec<f64> = (0..2000)
                .map(|k| {
                    let t = f64::from(k) * PERIOD;
                    2.5 * (t * (2.0 + fast * t)).sin() + 2.0 * (slow * 2.1 * t).sin()
                })
                .collect();
            let states = trajectory(&plant, plant.rest(State::hanging()), &u, PERIOD, 1, |_| {
                true
            })
            .expect("stays finite");
            let mut samples = Vec::new();
            for (k, (u, x)) in u.iter().zip(&states).enumerate() {
                let [theta, alpha] = rig.sensors.quantised([x.theta, x.alpha]);
                samples.push([k as f64 * PERIOD, *u, theta, alpha]);
            }
            let name = format!("run-{i}.csv");
            Recording::from_samples(&name, samples).expect("clean").0
        })
        .collect()
}

fn diagnosed(recordings: &[Recording]) -> Outcome {
    let rig = qube();
    let request = Request {
        recordings,
        rig: &rig,
        verify: &[],
    };
    diagnose(&request, &|_| ()).expect("can be diagnosed")
}

/// A drag of the hinge that grows with the arm's speed is in no catalogue: its law is found, its size too, and the rig
/// file runs it.
#[test]
fn a_foreign_torque_is_imitated_and_stays_unexplained() {
    let hidden = -2.4e-5;
    let seen = recordings(&[term("custom.1", hidden, 1.0, "alpha_dot*abs(theta_dot)")]);
    let outcome = diagnosed(&seen);
    let d = &outcome.diagnosis;
    assert_eq!(d.verdict, Verdict::Unexplained, "{}", d.to_json());
    let custom = d.custom.as_ref().expect("an expression");
    assert_eq!(custom.terms.len(), 1, "{custom:?}");
    let found = &custom.terms[0];
    assert_eq!(found.id, "custom.1");
    assert_eq!(found.on, "pendulum");
    assert!(
        found.expression.ends_with("*alpha_dot*abs(theta_dot)"),
        "{found:?}"
    );
    let c = &found.parameters["coefficient"];
    assert!((c.value / hidden - 1.0).abs() < 0.02, "{c:?}");
    assert_eq!(c.unit, "N m/(rad2/s2)");
    // What is left is the encoders' noise: a tenth of what there was, in squares a hundredth.
    assert!(custom.held_out_gain > 0.9, "{custom:?}");
    assert!(custom.with.alpha < 0.3 * custom.without.alpha);
    assert!(d.held_out.as_ref().expect("three runs").augmented == custom.with);

    // The rig file holds it, marked as what it is, and predicts what the search has not seen.
    let text = outcome.repaired.to_toml();
    assert!(
        text.contains(
            "[effects.\"custom.1\"]   # Empirical term, fitted to recordings: no law of physics"
        ),
        "{text}"
    );
    let rig = Rig::from_toml(&text).expect("readable");
    assert_eq!(rig, outcome.repaired);
    let request = Request {
        recordings: &seen,
        rig: &rig,
        verify: &[],
    };
    let again = diagnose(&request, &|_| ())
        .expect("can be diagnosed")
        .diagnosis;
    assert_eq!(again.verdict, Verdict::NoGap, "{}", again.to_json());

    // The answer survives the JSON, and the page says that it is no law.
    let json = d.to_json();
    let back = furuta_ident::diagnose::Diagnosis::from_json(&json).expect("readable");
    assert_eq!(
        back.custom.map(|c| c.torques()),
        Some(vec![format!("pendulum: {}", found.expression)])
    );
    let page = report::html(d, &outcome.curves);
    assert!(page.contains("no law") && page.contains("alpha_dot*abs(theta_dot)"));
}

/// Beside an effect of the catalogue, the expression holds what is foreign, and the effect keeps its name.
#[test]
fn what_is_named_stays_beside_an_expression() {
    let bias = Effect::new("motor.bias", &[0.15]).expect("valid");
    let drag = term("custom.1", -2.4e-5, 1.0, "alpha_dot*abs(theta_dot)");
    let d = diagnosed(&recordings(&[bias, drag])).diagnosis;
    assert_eq!(d.verdict, Verdict::Unexplained, "{}", d.to_json());
    let names: Vec<_> = d.effects.iter().map(|e| e.id.as_str()).collect();
    assert_eq!(names, ["motor.bias"], "{:?}", d.suspected);
    let custom = d.custom.as_ref().expect("an expression");
    let terms: Vec<_> = custom.terms.iter().map(|t| t.on.as_str()).collect();
    assert_eq!(terms, ["pendulum"], "{custom:?}");
    assert!(
        custom.terms[0]
            .expression
            .ends_with("*alpha_dot*abs(theta_dot)"),
        "{custom:?}"
    );
}

/// A gain that depends on the angle needs no two terms: it is a ripple of the motor that repeats once a turn.
#[test]
fn a_gain_that_depends_on_the_angle_has_a_name() {
    let (sine, cosine): (f64, f64) = (8e-4, -6e-4);
    let seen = recordings(&[
        term("custom.1", sine, 0.0, "u*sin(theta)"),
        term("custom.2", cosine, 0.0, "u*cos(theta)"),
    ]);
    let d = diagnosed(&seen).diagnosis;
    assert_eq!(d.verdict, Verdict::MissingEffects, "{}", d.to_json());
    assert!(d.custom.is_none(), "{:?}", d.custom);
    let ids: Vec<&str> = d.effects.iter().map(|e| e.id.as_str()).collect();
    assert_eq!(ids, ["motor.ripple"]);
    let found = |name: &str| d.effects[0].parameters[name].value;
    assert_eq!(found("order"), 1.0);
    // Five standard deviations of each.
    assert!((found("phase") - cosine.atan2(sine)).abs() < 2e-3);
    let mut rig = qube();
    rig.params.motor.torque_constant *= 0.97;
    let share = sine.hypot(cosine) / rig.params.coefficients().drive;
    assert!((found("amplitude") / share - 1.0).abs() < 2e-3);
}

/// Neither where nothing is hidden nor where the catalogue has a name for it.
#[test]
fn what_is_explained_gets_no_expression() {
    let spring = Effect::new("arm.spring", &[2e-3, 0.2]).expect("valid");
    for (hidden, verdict) in [
        (vec![], Verdict::ParametersOnly),
        (vec![spring], Verdict::MissingEffects),
    ] {
        let outcome = diagnosed(&recordings(&hidden));
        let d = &outcome.diagnosis;
        assert_eq!(d.verdict, verdict, "{}", d.to_json());
        assert!(d.custom.is_none() && !d.to_json().contains("custom"));
        assert!(!outcome.repaired.to_toml().contains("custom"));
    }
}
