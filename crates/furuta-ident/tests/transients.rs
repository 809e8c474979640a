//! Effects that act once: kicks, counts that an encoder lost.

use crate::diagnose::{H, qube, run, run_with};
use furuta_ident::diagnose::Verdict;
use furuta_ident::diagnose::result::TorqueInTime;
use furuta_model::{Effect, effects};

/// Counts that an encoder lost in one recording, alone and beside another effect: where, and how many. Unasked,
/// they look like kicks.
#[test]
fn lost_counts_are_named() {
    let time = 3.3015;
    for (id, size, beside) in [
        ("sensor.theta.lost_counts", 0.04, None),
        (
            "sensor.theta.lost_counts",
            -0.06,
            Some(("arm.coulomb", vec![1e-3])),
        ),
    ] {
        let mut hidden = vec![Effect::new(id, &[size, time, 1.0]).expect("valid")];
        let mut ids = vec![id];
        if let Some((other, values)) = &beside {
            hidden.push(Effect::new(other, values).expect("valid"));
            ids.push(other);
        }
        ids.sort_unstable();
        let asked = [effects::spec(id).expect("an entry")];
        let found = run_with(&qube(), &hidden, &asked).diagnosis;
        let mut named: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
        named.sort_unstable();
        assert_eq!(named, ids, "{}", found.sentence());
        assert_eq!(found.verdict, Verdict::MissingEffects);
        let lost = found.effects.iter().find(|e| e.id == id).expect("named");
        let parameters = &lost.parameters;
        // Two samples; a quarter of a count.
        assert!((parameters["time"].value - time).abs() < 2.0 * H);
        assert!((parameters["size"].value - size).abs() < 8e-4, "{lost:?}");
        assert_eq!(parameters["run"].value, 1.0);
    }
}

/// Each acts in a few windows of its own. The others say nothing against the second, whichever it is.
#[test]
fn what_acts_once_is_named_beside_what_acts_once() {
    let kick: (_, &[f64]) = ("disturbance.kick", &[4e-3, 5.1, 0.06, 0.0]);
    let arm_kick: (_, &[f64]) = ("disturbance.arm_kick", &[4e-3, 3.2, 0.12, 1.0]);
    let lost: (_, &[f64]) = ("sensor.alpha.lost_counts", &[0.04, 3.3015, 1.0]);
    for pair in [[arm_kick, kick], [kick, lost]] {
        let hidden = pair.map(|(id, values)| Effect::new(id, values).expect("valid"));
        let found = run(&qube(), &hidden).diagnosis;
        let mut named: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
        named.sort_unstable();
        assert_eq!(named, pair.map(|(id, _)| id), "{}", found.sentence());
        assert_eq!(found.verdict, Verdict::MissingEffects);
    }
}

/// A kick on the arm stands out over time: where it was and as strong.
#[test]
fn the_missing_torque_over_time_shows_the_kick() {
    let rig = qube();
    let (torque, at, duration) = (4e-3, 3.2, 0.12);
    let kick = Effect::new("disturbance.arm_kick", &[torque, at, duration, 1.0]).expect("valid");
    let outcome = run(&rig, &[kick]);
    let [a, b] = outcome.curves.torque_in_time.as_slice() else {
        panic!("two runs");
    };
    let peak = |t: &TorqueInTime| {
        let all = t.t.iter().zip(&t.recalibrated[0]);
        all.fold((0.0, 0.0_f64), |m, (t, v)| {
            if v.abs() > m.1.abs() { (*t, *v) } else { m }
        })
    };
    let (t, v) = peak(b);
    assert!(t > at && t < at + duration, "at {t} s");
    // The course is smooth over 0.06 s: a pulse of twice that reaches most of its height.
    assert!((v / torque - 1.0).abs() < 0.3, "{v} N m");
    assert!(peak(a).1.abs() < 0.1 * v, "{:?}", peak(a));
    let left = b.augmented[0].iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    assert!(left < 0.1 * v, "{left} N m are left");
}
