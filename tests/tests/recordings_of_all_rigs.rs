//! The checks of recordings over every built-in rig, many ways to drive it and hidden effects: what is sound is never
//! refused, what is wrong is named.

use std::f64::consts::{PI, TAU};

use furuta_ctrl::supervisor::Supervisor;
use furuta_ctrl::{Config, Site};
use furuta_design::supervised::Supervised;
use furuta_ident::Pendulum;
use furuta_ident::recording::{NoticeKind, Recording};
use furuta_ident::selection::{SelectionError, select};
use furuta_model::{Effect, Rig, State};

const PERIOD: f64 = 0.002;

/// `[t, u, theta, alpha]`, the angles in whole counts.
type Row = [f64; 4];

/// A recording as the rig's encoders give it.
struct Made {
    rig: Rig,
    what: String,
    rows: Vec<Row>,
}

fn hertz(rig: &Rig) -> f64 {
    let c = rig.params.coefficients();
    (c.weight / c.pendulum).sqrt() / TAU
}

/// Ten seconds from hanging at rest under `volts(t)`, in parts of the limit.
fn driven(rig: &Rig, volts: impl Fn(f64) -> f64) -> Vec<Row> {
    let plant = rig.plant::<f64>();
    let limit = rig.params.motor.command_limit;
    let mut s = plant.rest(State::hanging());
    (0..5000)
        .map(|k| {
            let t = f64::from(k) * PERIOD;
            let u = (limit * volts(t)).clamp(-limit, limit);
            let [theta, alpha] = rig.sensors.quantised(plant.measure(&s));
            plant.step(&mut s, u, PERIOD);
            [t, u, theta, alpha]
        })
        .collect()
}

/// Under the standard controller, from `start`.
fn controlled(rig: &Rig, start: State<f64>) -> Vec<Row> {
    let supervisor =
        Supervisor::design(&Config::default(), &Site::of(rig, PERIOD)).expect("a design");
    let bench = Supervised::new(&supervisor, rig, PERIOD).expect("a rig");
    let mut run = bench.start(start);
    (0..5000)
        .map(|k| {
            let t = f64::from(k) * PERIOD;
            let target = if t % 4.0 < 2.0 { 0.2 } else { -0.2 };
            let sample = bench.sample(&mut run, target);
            [t, sample.held, sample.reading[0], sample.reading[1]]
        })
        .collect()
}

fn chirp(f: f64, t: f64) -> f64 {
    (TAU * f * (0.3 * t + 0.15 * t * t)).sin()
}

fn multisine(f: f64, t: f64) -> f64 {
    (1..=8)
        .map(|k| {
            let k = f64::from(k);
            0.25 * (TAU * 0.35 * k * f * t + k * k).sin()
        })
        .sum()
}

fn steps(t: f64) -> f64 {
    [0.9, -0.4, 0.2, -1.0, 0.6, -0.7, 1.0, -0.1][(t / 0.45) as usize % 8]
}

/// The rig as it is and with effects hidden in it.
fn rigs() -> Vec<(Rig, &'static str)> {
    let mut all = Vec::new();
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        let c = rig.params.coefficients();
        let typical = |id: &str| {
            let effect = furuta_hw::emulate::hidden_effect(id, &rig.params);
            effect.expect("an effect of the catalogue")
        };
        // With the arm's own resonance at three times the pendulum's frequency.
        let stiff = c.arm * (3.0 * TAU * hertz(&rig)).powi(2);
        let hidden: [(&str, Vec<Effect<f64>>); 5] = [
            ("plain", Vec::new()),
            (
                "stiff spring",
                vec![Effect::new("arm.spring", &[stiff, 0.0]).expect("valid")],
            ),
            (
                "friction",
                vec![typical("arm.coulomb"), typical("pendulum.coulomb")],
            ),
            ("spring on the pendulum", vec![typical("pendulum.spring")]),
            ("tilt", vec![typical("arm.tilt")]),
        ];
        for (what, effects) in hidden {
            all.push((
                Rig {
                    effects,
                    ..rig.clone()
                },
                what,
            ));
        }
    }
    all
}

/// Recordings of one rig: chirp, sums of sines, steps, single sines, balancing, a swing-up.
fn recordings(rig: &Rig, hidden: &str) -> Vec<Made> {
    let f = hertz(rig);
    let mut all: Vec<(String, Vec<Row>)> = vec![
        ("chirp".into(), driven(rig, |t| 0.15 * chirp(f, t))),
        ("multisine".into(), driven(rig, |t| 0.5 * multisine(f, t))),
        ("steps".into(), driven(rig, |t| 0.5 * steps(t))),
        (
            "balance".into(),
            controlled(rig, State::new(0.0, 0.05, 0.0, 0.0)),
        ),
        ("swing-up".into(), controlled(rig, State::hanging())),
    ];
    for part in [0.4, 0.7, 1.3, 1.7, 2.5, 4.0] {
        let sine = driven(rig, |t| 0.3 * (TAU * part * f * t).sin());
        all.push((format!("sine of {:.2} Hz", part * f), sine));
    }
    all.into_iter()
        .map(|(what, rows)| Made {
            rig: Rig {
                effects: Vec::new(),
                ..rig.clone()
            },
            what: format!("{}, {hidden}, {what}", rig.name),
            rows,
        })
        .collect()
}

/// The suspicion that a recording meets, if any.
fn suspicion(rows: &[Row], rig: &Rig) -> Option<NoticeKind> {
    noticed(rows, rig).filter(NoticeKind::is_suspicion)
}

/// The suspicion that a recording meets, or else what is noticed about its counts.
fn noticed(rows: &[Row], rig: &Rig) -> Option<NoticeKind> {
    let read = Recording::from_samples("made", rows.iter().copied()).expect("a recording");
    match select(vec![read], Vec::new(), rig, false, Pendulum::Swings) {
        Ok(selected) => selected.notices.into_iter().map(|n| n.kind).find(|kind| {
            matches!(
                kind,
                NoticeKind::CountsSuspected { .. } | NoticeKind::EitherCountsSuspected { .. }
            )
        }),
        Err(SelectionError::Suspicious(notice)) => Some(notice.kind),
        Err(other) => panic!("{other}"),
    }
}

fn changed(made: &Made, change: impl Fn(Row) -> Row) -> Option<NoticeKind> {
    let rows: Vec<Row> = made.rows.iter().copied().map(change).collect();
    noticed(&rows, &made.rig)
}

fn everything() -> impl Iterator<Item = Made> {
    rigs()
        .into_iter()
        .flat_map(|(rig, hidden)| recordings(&rig, hidden))
}

#[test]
fn sound_recordings_are_never_refused() {
    let (mut count, mut refused) = (0, Vec::new());
    for made in everything() {
        count += 1;
        if let Some(kind) = suspicion(&made.rows, &made.rig) {
            refused.push(format!("{}: {kind}", made.what));
        }
    }
    println!("{} of {count} sound recordings refused", refused.len());
    assert_eq!(count, 4 * 5 * 11);
    assert!(refused.is_empty(), "{}", refused.join("\n"));
}

/// Under a single sine both angles swing at its frequency, which is not the pendulum's, and a spring may turn the sign
/// of the arm's answer.
#[test]
fn single_sines_are_never_refused() {
    let (mut count, mut refused) = (0, Vec::new());
    for (rig, hidden) in rigs() {
        let f = hertz(&rig);
        let known = Rig {
            effects: Vec::new(),
            ..rig.clone()
        };
        for amplitude in [0.03, 0.06, 0.25, 1.0] {
            for part in [0.25, 0.5, 0.8, 1.2, 1.7, 2.0, 2.5, 3.5] {
                count += 1;
                let rows = driven(&rig, |t| amplitude * (TAU * part * f * t).sin());
                if let Some(kind) = suspicion(&rows, &known) {
                    refused.push(format!(
                        "{}, {hidden}, {:.2} Hz: {kind}",
                        rig.name,
                        part * f
                    ));
                }
            }
        }
    }
    println!("{} of {count} single sines refused", refused.len());
    assert!(refused.is_empty(), "{}", refused.join("\n"));
}

/// Alpha counted from hanging with the wrong counts per turn. Another count by a factor of two is named or at least
/// refused as such by whatever excites the
/// pendulum; 1000 for 1024 only by large swings, and never as anything else.
#[test]
fn wrong_counts_of_the_pendulum_are_named() {
    let mut named = [0; 3];
    let mut wrong = Vec::new();
    let mut count = 0;
    for (rig, hidden) in rigs().into_iter().filter(|(_, hidden)| *hidden == "plain") {
        for made in recordings(&rig, hidden) {
            if !["multisine", "steps", "swing-up"]
                .iter()
                .any(|w| made.what.ends_with(w))
            {
                continue;
            }
            count += 1;
            let counts = made.rig.sensors.pendulum_counts_per_rev;
            for (i, scale) in [0.5, 2.0, 1000.0 / 1024.0].into_iter().enumerate() {
                // An encoder of 2000 is taken for one of 2048, or 2000 are taken for its 2048.
                let taken = if i == 2 && counts == 2000.0 {
                    2048.0
                } else {
                    counts
                };
                let q = TAU / taken;
                let kind = changed(&made, |[t, u, theta, alpha]| {
                    [t, u, theta, PI + ((alpha - PI) * scale / q).round() * q]
                });
                match kind {
                    Some(NoticeKind::CountsSuspected {
                        column: "alpha",
                        encoder,
                        taken,
                        ..
                    }) if (encoder / taken / scale - 1.0).abs() < 0.002 => {
                        named[i] += 1;
                    }
                    Some(NoticeKind::EitherCountsSuspected {
                        pendulum: (encoder, taken),
                        ..
                    }) if (encoder / taken / scale - 1.0).abs() < 0.1 => {
                        named[i] += 1;
                    }
                    None if i == 2 => {}
                    other => wrong.push(format!("{} {scale}: {other:?}", made.what)),
                }
            }
        }
    }
    println!(
        "of {count}: 1/2 {}, 2 {}, 1000/1024 {}",
        named[0], named[1], named[2]
    );
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(named[2] >= count / 2, "{named:?} of {count}");
}

/// A sheet that is wrong by some per cent about the arm's length is no wrong count.
#[test]
fn a_wrong_length_is_no_wrong_count() {
    for (rig, hidden) in rigs() {
        for mut made in recordings(&rig, hidden) {
            if !["multisine", "steps", "swing-up"]
                .iter()
                .any(|w| made.what.ends_with(w))
            {
                continue;
            }
            for factor in [0.97, 1.024, 1.03] {
                made.rig.params.arm.length = rig.params.arm.length * factor;
                let kind = suspicion(&made.rows, &made.rig);
                assert_eq!(kind, None, "{} {factor}", made.what);
            }
        }
    }
}

/// A factor of two on the arm's angle: named as the arm's encoder, or as one of the two where only their ratio shows.
#[test]
fn wrong_counts_of_the_arm_are_named() {
    let (mut count, mut wrong) = (0, Vec::new());
    for (rig, hidden) in rigs().into_iter().filter(|(_, hidden)| *hidden == "plain") {
        for made in recordings(&rig, hidden) {
            if !["multisine", "steps"]
                .iter()
                .any(|w| made.what.ends_with(w))
            {
                continue;
            }
            for scale in [0.5, 2.0] {
                count += 1;
                match changed(&made, |[t, u, theta, alpha]| [t, u, theta * scale, alpha]) {
                    Some(NoticeKind::CountsSuspected {
                        column: "theta",
                        encoder,
                        taken,
                        ..
                    })
                    | Some(NoticeKind::EitherCountsSuspected {
                        arm: (encoder, taken),
                        ..
                    }) if (encoder / taken / scale - 1.0).abs() < 0.1 => {}
                    other => wrong.push(format!("{} {scale}: {other:?}", made.what)),
                }
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "{} of {count}\n{}",
        wrong.len(),
        wrong.join("\n")
    );
}

/// A command that is not in volts is named with its unit.
#[test]
fn a_command_in_another_unit_is_named() {
    for (rig, hidden) in rigs().into_iter().filter(|(_, hidden)| *hidden == "plain") {
        let limit = rig.params.motor.command_limit;
        for made in recordings(&rig, hidden) {
            if !["multisine", "steps"]
                .iter()
                .any(|w| made.what.ends_with(w))
            {
                continue;
            }
            for (unit, per_volt) in [
                ("per cent of the limit", 100.0 / limit),
                ("PWM counts of 8 bits", 255.0 / limit),
                ("PWM counts of 10 bits", 1023.0 / limit),
                ("millivolts", 1000.0),
            ] {
                let kind = changed(&made, |[t, u, theta, alpha]| {
                    [t, (u * per_volt).round(), theta, alpha]
                });
                match kind {
                    Some(NoticeKind::CommandUnitSuspected {
                        unit: found,
                        factor,
                        ..
                    }) => {
                        assert_eq!(found, unit, "{}", made.what);
                        assert!((factor * per_volt - 1.0).abs() < 1e-9);
                    }
                    other => panic!("{} {unit}: {other:?}", made.what),
                }
            }
        }
    }
}

/// An encoder that stops half-way is named with its time, and an arm or a pendulum at rest is not accused.
#[test]
fn an_encoder_that_freezes_is_named() {
    for (rig, hidden) in rigs().into_iter().filter(|(_, hidden)| *hidden == "plain") {
        for made in recordings(&rig, hidden) {
            if !["multisine", "steps"]
                .iter()
                .any(|w| made.what.ends_with(w))
            {
                continue;
            }
            let at = made.rows[2500];
            for (i, column) in ["theta", "alpha"].into_iter().enumerate() {
                let kind = changed(&made, |mut row| {
                    if row[0] >= at[0] {
                        row[2 + i] = at[2 + i];
                    }
                    row
                });
                match kind {
                    Some(NoticeKind::FrozenSuspected {
                        column: found,
                        since,
                        ..
                    }) => {
                        assert_eq!(found, column, "{}", made.what);
                        assert!((since - 5.0).abs() < 0.05, "{}: {since}", made.what);
                    }
                    other => panic!("{} {column}: {other:?}", made.what),
                }
            }
        }
        // The command ends, the arm stands in its friction, the pendulum swings on.
        let mut held = rig.clone();
        let friction = 0.6 * rig.params.coefficients().drive * rig.params.motor.command_limit;
        held.effects
            .push(Effect::new("arm.coulomb", &[friction]).expect("valid"));
        let rows = driven(&held, |t| if t < 3.0 { steps(t) } else { 0.0 });
        assert_eq!(suspicion(&rows, &rig), None, "{}", rig.name);
    }
}

/// Angles in counts and in degrees are named, an arm that really turns far is not.
#[test]
fn counts_and_degrees_are_told_from_turns() {
    for (rig, hidden) in rigs().into_iter().filter(|(_, hidden)| *hidden == "plain") {
        let q = rig.sensors.resolution();
        for made in recordings(&rig, hidden) {
            if !["multisine", "steps"]
                .iter()
                .any(|w| made.what.ends_with(w))
            {
                continue;
            }
            let raw = changed(&made, |[t, u, theta, alpha]| {
                [t, u, (theta / q[0]).round(), ((alpha - PI) / q[1]).round()]
            });
            let Some(kind @ NoticeKind::RawCountsSuspected { .. }) = raw else {
                panic!("{}: {raw:?}", made.what)
            };
            assert!(kind.to_string().contains(&format!("{:.9}", q[0])), "{kind}");
            // By a fine encoder, no step tells.
            let degrees = changed(&made, |[t, u, theta, alpha]| {
                let fine = |x: f64, k: f64| x.to_degrees() + 0.01 * (k * t).sin();
                [t, u, fine(theta, 3.0), fine(alpha, 5.0)]
            });
            assert!(
                matches!(degrees, Some(NoticeKind::DegreesSuspected { .. })),
                "{}: {degrees:?}",
                made.what
            );
        }
        let turning = driven(&rig, |t| 0.5 + 0.3 * chirp(hertz(&rig), t));
        let far = turning.iter().fold(0.0, |m: f64, r| m.max(r[2].abs()));
        println!("{}: the arm turns by {far:.0} rad", rig.name);
        assert_eq!(suspicion(&turning, &rig), None, "{}", rig.name);
    }
}
