//! Laws of the user's own are found as any other, alone and beside an effect of the catalogue, and not named where they
//! are not.
//!
//! The recordings come from an integration written here, of equations written here; the rig's sheet is a few per cent
//! off.

use std::f64::consts::PI;

use crate::common::patient;
use furuta_ident::diagnose::{Options, Outcome, Request, Verdict, diagnose_with};
use furuta_ident::recording::Recording;
use furuta_ident::report;
use furuta_model::effects::own;
use furuta_model::{Effect, Params, Rig, Spec};

const H: f64 = 2e-3;

const BRAKE: &str = r#"
[hypothesis."user.eddy-brake"]
name = "Eddy-current brake at the arm"
arm = "-k*theta_dot/(1 + (theta_dot/v)^2)"
parameters.k = { unit = "N m s/rad", min = 0.0, max = 0.1, typical = 1e-3, strength = true }
parameters.v = { unit = "rad/s", min = 0.3, max = 100.0, typical = 3.0 }
"#;

const MAXWELL: &str = r#"
[hypothesis."user.cable"]
name = "Cable that relaxes"
arm = "-k*z"
state = { name = "z", unit = "rad", rate = "theta_dot - z/tau" }
parameters.k = { unit = "N m/rad", min = 0.0, max = 1.0, typical = 3e-3, strength = true }
parameters.tau = { unit = "s", min = 0.01, max = 100.0, typical = 0.5, starts = [0.2, 1.0] }
"#;

fn offered(text: &str) -> Vec<&'static Spec> {
    own::read(text).expect("valid")
}

/// Torque on the arm (N m) and rate of `z`, of the arm's angle and speed and `z`.
type Hidden = dyn Fn([f64; 3]) -> [f64; 2];

/// A recording by its encoders: `[theta, alpha, theta_dot, alpha_dot, z]` in steps of a quarter period.
fn recorded(p: &Params<f64>, hidden: &Hidden, seed: f64) -> Recording {
    let (arm, pendulum, motor) = (&p.arm, &p.pendulum, &p.motor);
    // Moments of inertia about both axes, and what couples them (Fantoni and Lozano, Non-linear Control for
    // Underactuated Mechanical Systems, 2002, chapter 6).
    let j0 = arm.inertia + pendulum.mass * arm.length.powi(2) + pendulum.inertia_axial;
    let j1 = pendulum.inertia + pendulum.mass * pendulum.com.powi(2);
    let swing =
        pendulum.inertia_transverse + pendulum.mass * pendulum.com.powi(2) - pendulum.inertia_axial;
    let coupling = pendulum.mass * arm.length * pendulum.com;
    let weight = pendulum.mass * p.gravity * pendulum.com;
    let rate = |x: &[f64; 5], u: f64| {
        let [theta, alpha, w, v, z] = *x;
        let [torque, z_rate] = hidden([theta, w, z]);
        let (sin, cos) = alpha.sin_cos();
        let current = (u - motor.back_emf_constant * w) / motor.resistance;
        let on_arm = motor.amplifier_gain * motor.torque_constant * current - arm.viscous * w
            + torque
            - 2.0 * swing * sin * cos * w * v
            - coupling * sin * v * v;
        let on_pendulum = weight * sin - pendulum.viscous * v + swing * sin * cos * w * w;
        let (a, b, c) = (j0 + swing * sin * sin, -coupling * cos, j1);
        let d = a * c - b * b;
        let (w_rate, v_rate) = (
            (c * on_arm - b * on_pendulum) / d,
            (a * on_pendulum - b * on_arm) / d,
        );
        [w, v, w_rate, v_rate, z_rate]
    };
    let along = |x: &[f64; 5], k: &[f64; 5], h: f64| -> [f64; 5] {
        std::array::from_fn(|i| x[i] + h * k[i])
    };
    let counts = 2.0 * PI / 2048.0;
    let mut x = [0.0, PI, 0.0, 0.0, 0.0];
    let samples = (0..3000).map(|n| {
        let t = H * f64::from(n);
        let u = 3.0 * (seed * t * (1.0 + 0.8 * t)).sin() + 1.5 * (0.9 * seed * t).sin();
        let now = [
            t,
            u,
            (x[0] / counts).round() * counts,
            (x[1] / counts).round() * counts,
        ];
        for _ in 0..4 {
            let h = H / 4.0;
            let a = rate(&x, u);
            let b = rate(&along(&x, &a, h / 2.0), u);
            let c = rate(&along(&x, &b, h / 2.0), u);
            let d = rate(&along(&x, &c, h), u);
            x = std::array::from_fn(|i| x[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        }
        now
    });
    let samples: Vec<[f64; 4]> = samples.collect();
    Recording::from_samples(&format!("sweep-{seed}"), samples)
        .expect("sound")
        .0
}

/// The rig, and its sheet, which is a few per cent off.
fn rig_and_sheet() -> (Rig, Rig) {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let mut sheet = rig.clone();
    sheet.params.arm.inertia *= 1.04;
    sheet.params.pendulum.inertia *= 0.96;
    // A slender rod's, as the rig's: what a fit refits of one it refits of the other.
    sheet.params.pendulum.inertia_transverse *= 0.96;
    sheet.params.motor.torque_constant *= 0.97;
    sheet.params.arm.viscous *= 1.1;
    (rig, sheet)
}

fn found(hidden: &Hidden, candidates: &[&'static Spec]) -> Outcome {
    let (rig, sheet) = rig_and_sheet();
    let recordings = [3.0, 4.1].map(|seed| recorded(&rig.params, hidden, seed));
    let request = Request {
        recordings: &recordings,
        rig: &sheet,
        verify: &[],
    };
    let options = Options {
        candidates,
        ..patient()
    };
    diagnose_with(&request, options, &|_| ()).expect("sufficient")
}

fn named(outcome: &Outcome) -> Vec<&str> {
    let mut ids: Vec<&str> = outcome
        .diagnosis
        .effects
        .iter()
        .map(|e| e.id.as_str())
        .collect();
    ids.sort_unstable();
    ids
}

/// The value of a named effect's parameter is that of the rig to 15 %, and known as well.
fn near(outcome: &Outcome, id: &str, parameter: &str, wanted: f64) {
    let effects = &outcome.diagnosis.effects;
    let effect = effects.iter().find(|e| e.id == id).expect("named");
    let p = &effect.parameters[parameter];
    let off = (p.value - wanted).abs();
    assert!(
        off < 0.15 * wanted.abs(),
        "{parameter}: {} {wanted}",
        p.value
    );
    assert!(p.std < 0.15 * wanted.abs(), "{parameter}: {}", p.std);
}

fn brake([_, w, _]: [f64; 3]) -> f64 {
    -2e-3 * w / (1.0 + (w / 2.0).powi(2))
}

#[test]
fn a_brake_is_found_alone_and_carried() {
    let outcome = found(&|x| [brake(x), 0.0], &offered(BRAKE));
    assert_eq!(outcome.diagnosis.verdict, Verdict::MissingEffects);
    assert_eq!(named(&outcome), ["user.eddy-brake"]);
    near(&outcome, "user.eddy-brake", "k", 2e-3);
    near(&outcome, "user.eddy-brake", "v", 2.0);
    // The rig file carries it, and says the same to whoever reads it.
    let text = outcome.repaired.to_toml();
    let again = Rig::from_toml(&text).expect("readable");
    assert_eq!(
        (again.effects.len(), again.effects[0].spec().id),
        (1, "user.eddy-brake")
    );
    assert_eq!(again.effects[0], outcome.repaired.effects[0]);
    // Text, JSON and report name it; what the report says to paste is whole.
    let words = report::text(&outcome.diagnosis, "rig.toml");
    assert!(
        words.contains("user.eddy-brake  Eddy-current brake at the arm"),
        "{words}"
    );
    assert!(outcome.diagnosis.to_json().contains("\"user.eddy-brake\""));
    let page = report::html(&outcome.diagnosis, &outcome.curves);
    assert!(page.contains("[hypothesis.&quot;user.eddy-brake&quot;]\nname ="));
    // What the rig file has is not looked for again, and that is said.
    let (rig, _) = rig_and_sheet();
    let recordings = [recorded(&rig.params, &|x| [brake(x), 0.0], 3.0)];
    let request = Request {
        recordings: &recordings,
        rig: &again,
        verify: &[],
    };
    let options = Options {
        candidates: &offered(BRAKE),
        ..patient()
    };
    let outcome = diagnose_with(&request, options, &|_| ()).expect("sufficient");
    assert!(outcome.diagnosis.effects.is_empty());
    let notice = &outcome.diagnosis.notices[0];
    assert!(
        notice.starts_with("candidate user.eddy-brake is in the rig file"),
        "{notice}"
    );
}

#[test]
fn a_brake_is_found_beside_a_spring() {
    let outcome = found(&|x| [brake(x) - 3e-3 * (x[0] - 0.4), 0.0], &offered(BRAKE));
    assert_eq!(named(&outcome), ["arm.spring", "user.eddy-brake"]);
    near(&outcome, "user.eddy-brake", "k", 2e-3);
    near(&outcome, "arm.spring", "stiffness", 3e-3);
}

#[test]
fn a_law_that_is_not_there_is_not_named() {
    let both = [offered(BRAKE), offered(MAXWELL)].concat();
    let outcome = found(&|x| [-3e-3 * (x[0] - 0.4), 0.0], &both);
    assert_eq!(named(&outcome), ["arm.spring"]);
    let outcome = found(&|_| [0.0; 2], &both);
    assert_eq!(outcome.diagnosis.verdict, Verdict::ParametersOnly);
}

#[test]
fn a_law_with_a_state_is_found_as_the_catalogues_is() {
    let (k, tau) = (6e-3, 0.4);
    let relaxes = move |[_, w, z]: [f64; 3]| [-k * z, w - z / tau];
    let own = found(&relaxes, &offered(MAXWELL));
    assert_eq!(named(&own), ["user.cable"]);
    near(&own, "user.cable", "k", k);
    near(&own, "user.cable", "tau", tau);
    let catalogue = [furuta_model::effects::spec("arm.relaxation").expect("an entry")];
    let known = found(&relaxes, &catalogue);
    assert_eq!(named(&known), ["arm.relaxation"]);
    // The same optimum: from other starts, a fit ends within a part of its standard deviations.
    let values = |o: &Outcome| {
        o.repaired
            .effects
            .iter()
            .map(Effect::values)
            .next()
            .expect("one")
    };
    let std = &own.diagnosis.effects[0].parameters;
    for (i, name) in ["k", "tau"].into_iter().enumerate() {
        let apart = (values(&own)[i] - values(&known)[i]).abs();
        assert!(
            apart < 0.1 * std[name].std,
            "{name}: {apart} {}",
            std[name].std
        );
    }
    // A relaxing cable that is offered in both forms is one: what these data cannot tell apart is said.
    let both = found(&relaxes, &[offered(MAXWELL), catalogue.to_vec()].concat());
    let [only] = &both.diagnosis.effects[..] else {
        panic!("{:?}", named(&both));
    };
    let rival = if only.id == "user.cable" {
        "arm.relaxation"
    } else {
        "user.cable"
    };
    assert!(
        only.confusable_with.iter().any(|id| id == rival),
        "{:?}",
        only.confusable_with
    );
}
