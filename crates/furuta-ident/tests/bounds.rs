//! Numbers that no rig has: they are said to be so, and the model that has them is not written.

use crate::common::{RunSetup, patient, qube, record, sweep};

use furuta_ident::diagnose::result::Best;
use furuta_ident::diagnose::{Outcome, Request, diagnose_with};
use furuta_ident::report;
use furuta_model::Rig;

/// The diagnosis of two sweeps of this rig against a rig file.
fn against(sheet: &Rig, rig: &Rig) -> Outcome {
    let recordings = [(1.5, 0.0), (2.5, 1.0)]
        .map(|(volts, phase)| record("run.csv", rig, RunSetup::default(), sweep(volts, phase)));
    let request = Request {
        recordings: &recordings,
        rig: sheet,
        verify: &[],
    };
    diagnose_with(&request, patient(), &|_| ()).expect("good recordings")
}

/// A rig file whose motor is six times too strong: a fit goes to a quarter of it, and no further.
#[test]
fn a_model_with_a_number_at_its_bound_is_not_written() {
    let rig = qube();
    let mut sheet = rig.clone();
    sheet.params.motor.torque_constant *= 6.0;
    let outcome = against(&sheet, &rig);
    let d = &outcome.diagnosis;
    let key = "motor.torque_constant";
    let bound = 0.25 * sheet.params.motor.torque_constant;
    let refitted = d.at_bound.iter().find(|b| b.parameter == key);
    let refitted = refitted.expect("a quarter is not enough");
    assert_eq!(refitted.model, Best::Refitted, "{:?}", d.at_bound);
    assert!((refitted.value / bound - 1.0).abs() < 1e-6, "{refitted:?}");
    assert!(
        d.at_bound.iter().all(|b| b.model != d.best),
        "{:?} is written: {:?}",
        d.best,
        d.at_bound
    );
    let written = outcome.repaired.params.motor.torque_constant;
    assert!((written / bound - 1.0).abs() > 1e-6, "{written}");
    let text = report::text(d, "rig.toml");
    assert!(text.contains(&refitted.text()), "{text}");
    let json: serde_json::Value = serde_json::from_str(&d.to_json()).expect("JSON");
    assert_eq!(json["at_bound"][0]["model"], "refitted");
    let said = d
        .at_bound
        .iter()
        .any(|b| b.model == Best::Repaired && b.parameter == key);
    assert_eq!(d.parameters[key].at_bound, said);
    // Limits would stand beside those numbers.
    if said {
        assert!(d.limits.is_empty());
        assert!(d.why_no_limits().is_some() || !d.unfinished.is_empty());
    }
}

/// A pendulum on perfect bearings: a damping of 0 is one that can be.
#[test]
fn no_friction_at_all_can_be() {
    let mut rig = qube();
    rig.params.pendulum.viscous = 0.0;
    let outcome = against(&qube(), &rig);
    let d = &outcome.diagnosis;
    assert_eq!(d.at_bound, [], "{:?}", d.parameters["pendulum.viscous"]);
    assert_eq!(d.best, Best::Repaired);
    assert!(outcome.repaired.params.pendulum.viscous < 1e-6);
}
