//! Recordings with a broken convention, and the name each mistake must be given. Also included by
//! `tests/tests/shared.rs`.

#![allow(dead_code)] // each test file uses some of it

use std::f64::consts::PI;
use std::path::Path;

use furuta_model::Rig;
use furuta_recording::{NoticeKind, Recording, against_rig};

/// A rig's data sheet and its recordings.
pub(crate) struct Case {
    pub(crate) rig: Rig,
    pub(crate) recordings: Vec<Recording>,
}

/// Each folder of `root` that holds a `rig.toml`, in the order of their names, with its recordings.
pub(crate) fn folders(root: &Path) -> Vec<Case> {
    let mut folders: Vec<_> = std::fs::read_dir(root)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.join("rig.toml").exists())
        .collect();
    folders.sort();
    // The checks need samples that are evenly spaced; the kit with a stepper motor has none.
    let cases = folders.iter().map(|folder| case(folder));
    cases
        .filter(|case| !case.recordings.iter().any(Recording::is_uneven))
        .collect()
}

fn case(folder: &Path) -> Case {
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .expect("a folder")
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e == "csv"))
        .collect();
    files.sort();
    let read = |file: &std::path::PathBuf| {
        let (recording, notices) = Recording::load_with_notices(file).expect("sound");
        assert!(
            !notices.iter().any(|n| n.kind.is_suspicion()),
            "{}: {notices:?}",
            file.display()
        );
        recording
    };
    Case {
        rig: Rig::load(&folder.join("rig.toml").to_string_lossy()).expect("a rig file"),
        recordings: files.iter().map(read).collect(),
    }
}

/// Whether the pendulum swings in a recording: one that is balanced in all of them shows neither where its angle is
/// counted from nor that an encoder clips, since its motion is a few counts.
fn swings(case: &&Case) -> bool {
    let mut recordings = case.recordings.iter();
    recordings.any(|recording| recording.alpha.iter().any(|alpha| alpha.cos() < 0.5))
}

type Row = [f64; 4];

fn rows(recording: &Recording) -> Vec<Row> {
    (0..recording.len())
        .map(|k| {
            [
                recording.t[k],
                recording.u[k],
                recording.theta[k],
                recording.alpha[k],
            ]
        })
        .collect()
}

/// Suspicions about rows of numbers read as a recording of this rig.
fn suspicions(rows: &[Row], rig: &Rig) -> Vec<NoticeKind> {
    let mut csv = String::from("t,u,theta,alpha\n");
    for [t, u, theta, alpha] in rows {
        csv += &format!("{t},{u},{theta},{alpha}\n");
    }
    let (recording, notices) =
        Recording::from_csv("changed.csv", csv.as_bytes()).expect("still a recording");
    notices
        .into_iter()
        .chain(against_rig(&[recording], rig))
        .map(|notice| notice.kind)
        .filter(NoticeKind::is_suspicion)
        .collect()
}

/// A way to break a recording, and the name it must be given.
type Corruption = (&'static str, fn(Row) -> Row, fn(&NoticeKind) -> bool);

const CORRUPTIONS: [Corruption; 12] = [
    (
        "alpha from hanging",
        |[t, u, theta, alpha]| [t, u, theta, alpha - PI],
        |k| *k == NoticeKind::HangingSuspected,
    ),
    (
        "theta and alpha swapped",
        |[t, u, theta, alpha]| [t, u, alpha, theta],
        |k| matches!(k, NoticeKind::SwappedSuspected { columns } if *columns == ["theta", "alpha"]),
    ),
    (
        "u and theta swapped",
        |[t, u, theta, alpha]| [t, theta, u, alpha],
        |k| {
            matches!(
                k,
                NoticeKind::SwappedSuspected { .. }
                    | NoticeKind::ScaleSuspected { .. }
                    | NoticeKind::Jump { .. }
                    | NoticeKind::DegreesSuspected { .. }
            )
        },
    ),
    (
        "degrees",
        |[t, u, theta, alpha]| [t, u, theta.to_degrees(), alpha.to_degrees()],
        |k| matches!(k, NoticeKind::DegreesSuspected { .. }),
    ),
    (
        "theta in degrees",
        |[t, u, theta, alpha]| [t, u, theta.to_degrees(), alpha],
        |k| {
            matches!(
                k,
                NoticeKind::DegreesSuspected { .. }
                    | NoticeKind::ScaleSuspected { .. }
                    | NoticeKind::Jump { .. }
            )
        },
    ),
    (
        "sign of u",
        |[t, u, theta, alpha]| [t, -u, theta, alpha],
        |k| *k == NoticeKind::CommandSignSuspected,
    ),
    (
        "u as a share of 12 V",
        |[t, u, theta, alpha]| [t, u / 12.0, theta, alpha],
        |k| matches!(k, NoticeKind::MotorGainSuspected { .. }),
    ),
    (
        "sign of alpha",
        |[t, u, theta, alpha]| [t, u, theta, -alpha],
        |k| *k == NoticeKind::SignSuspected,
    ),
    (
        "sign of theta",
        |[t, u, theta, alpha]| [t, u, -theta, alpha],
        |k| {
            matches!(
                k,
                NoticeKind::SignSuspected | NoticeKind::CommandSignSuspected
            )
        },
    ),
    (
        "milliseconds",
        |[t, u, theta, alpha]| [1000.0 * t, u, theta, alpha],
        |k| matches!(k, NoticeKind::TimeUnitSuspected { .. }),
    ),
    (
        "time stamps twice too slow",
        |[t, u, theta, alpha]| [2.0 * t, u, theta, alpha],
        |k| matches!(k, NoticeKind::FrequencySuspected { .. }),
    ),
    (
        "time stamps twice too fast",
        |[t, u, theta, alpha]| [0.5 * t, u, theta, alpha],
        |k| matches!(k, NoticeKind::FrequencySuspected { .. }),
    ),
];

/// Table of every way on every recording (`--nocapture` prints it). A single recording need not show a mistake (one in
/// which the arm hardly moves cannot tell its sign), so a share of them must, and of the runs of one rig together,
/// which is what a diagnosis is given, at least one.
pub(crate) fn every_mistake_is_named(cases: &[Case]) {
    let mut found = [0; CORRUPTIONS.len()];
    let mut rigs_found = [0; CORRUPTIONS.len()];
    let (mut all, mut rigs) = (0, 0);
    for case in cases.iter().filter(swings) {
        rigs += 1;
        all += case.recordings.len();
        for (i, (what, change, named)) in CORRUPTIONS.iter().enumerate() {
            let mut any = false;
            for recording in &case.recordings {
                let changed: Vec<Row> = rows(recording).into_iter().map(change).collect();
                let kinds = suspicions(&changed, &case.rig);
                if kinds.iter().any(named) {
                    found[i] += 1;
                    any = true;
                } else {
                    let rig = &case.rig.name;
                    println!("{what} not named: {rig} {} {kinds:?}", recording.name);
                }
            }
            rigs_found[i] += usize::from(any);
        }
    }
    for (i, (what, ..)) in CORRUPTIONS.iter().enumerate() {
        println!(
            "{what:<28} {:>3} of {all} recordings, {:>3} of {rigs} rigs",
            found[i], rigs_found[i]
        );
    }
    assert!(rigs > 0);
    for (i, (what, ..)) in CORRUPTIONS.iter().enumerate() {
        assert_eq!(rigs_found[i], rigs, "{what}");
    }
}

/// A rig file with the constants of the motor alone, which turns the arm through a gear of 30: said of at least one
/// recording of each rig. That it is a gear, and no unit, shows where the motor brakes the arm.
pub(crate) fn a_gear_left_out_is_named(cases: &[Case]) {
    let (mut named, mut told, mut rigs) = (0, 0, 0);
    for case in cases.iter().filter(swings) {
        rigs += 1;
        let mut rig = case.rig.clone();
        rig.params.motor.torque_constant /= 30.0;
        rig.params.motor.back_emf_constant /= 30.0;
        let of = |recording: &Recording| {
            let notices = against_rig(core::slice::from_ref(recording), &rig);
            notices.into_iter().find_map(|n| match n.kind {
                NoticeKind::MotorGainSuspected { factor, geared, .. } => Some((factor, geared)),
                _ => None,
            })
        };
        let said: Vec<(f64, bool)> = case.recordings.iter().filter_map(of).collect();
        println!("{}: {said:?}", case.rig.name);
        named += usize::from(!said.is_empty());
        told += usize::from(said.iter().any(|(_, geared)| *geared));
    }
    println!("a gear left out is named on {named} of {rigs} rigs, told to be one on {told}");
    assert_eq!(named, rigs);
}

/// Rigs of which at least one recording shows that u, theta or alpha is written a row later. A late command does not
/// show where the motor lags by as much, nor where something is missing that is far larger.
pub(crate) fn late_columns_are_named(cases: &[Case]) -> [Vec<&str>; 3] {
    type Column = (
        &'static str,
        fn(&mut Recording) -> &mut Vec<f64>,
        fn(&NoticeKind) -> bool,
    );
    const COLUMNS: [Column; 3] = [
        (
            "u",
            |r| &mut r.u,
            |k| matches!(k, NoticeKind::LateCommandSuspected { .. }),
        ),
        (
            "theta",
            |r| &mut r.theta,
            |k| matches!(k, NoticeKind::SkewSuspected { rows } if *rows < 0.0),
        ),
        (
            "alpha",
            |r| &mut r.alpha,
            |k| matches!(k, NoticeKind::SkewSuspected { rows } if *rows > 0.0),
        ),
    ];
    COLUMNS.map(|(name, column, is_named)| {
        let (mut named, mut all, mut rigs) = (0, 0, Vec::new());
        for case in cases.iter().filter(swings) {
            let is_told = |recording: &&Recording| {
                let mut late = (*recording).clone();
                let values = column(&mut late);
                values.rotate_right(1);
                values[0] = values[1];
                let notices = against_rig(&[late], &case.rig);
                notices.iter().any(|n| is_named(&n.kind))
            };
            let count = case.recordings.iter().filter(is_told).count();
            all += case.recordings.len();
            named += count;
            if count > 0 {
                rigs.push(case.rig.name.as_str());
            }
        }
        println!(
            "{name} a row late: {named} of {all} recordings, {} rigs",
            rigs.len()
        );
        rigs
    })
}

/// Of all these recordings none is accused of a broken convention: not alone, not together.
pub(crate) fn sound_recordings_are_not_accused(cases: &[Case]) {
    for case in cases {
        let notices = against_rig(&case.recordings, &case.rig);
        assert!(notices.is_empty(), "{}: {notices:?}", case.rig.name);
        for recording in &case.recordings {
            let notices = against_rig(core::slice::from_ref(recording), &case.rig);
            assert!(notices.is_empty(), "{}: {notices:?}", case.rig.name);
        }
    }
}

/// An encoder of the arm that loses a few hundredths of a turn in one of several recordings: none is accused.
pub(crate) fn lost_counts_are_no_other_rig(cases: &[Case]) {
    for case in cases {
        for (i, recording) in case.recordings.iter().enumerate() {
            for share in [0.25, 0.4, 0.6, 0.75] {
                let mut changed = rows(recording);
                let moment = (share * changed.len() as f64) as usize;
                for row in changed.iter_mut().skip(moment) {
                    row[2] += 0.15;
                }
                let mut recordings = case.recordings.clone();
                let (recording, mut notices) =
                    Recording::from_samples("lost", changed).expect("sound");
                recordings[i] = recording;
                notices.retain(|n| n.kind.is_suspicion());
                notices.extend(against_rig(&recordings, &case.rig));
                assert!(notices.is_empty(), "{} {i}: {notices:?}", case.rig.name);
            }
        }
    }
}

/// A recording of each of two rigs whose pendulums swing: where their pendulums differ by a quarter or more, it is
/// said. Returns of how many pairs of neighbours.
pub(crate) fn rigs_are_told_apart(cases: &[Case]) -> usize {
    let frequency = |rig: &Rig| {
        let c = rig.params.coefficients();
        (c.weight / c.pendulum).sqrt()
    };
    let (mut apart, mut told) = (0, 0);
    let cases: Vec<&Case> = cases.iter().filter(swings).collect();
    for pair in cases.windows(2) {
        let ratio = frequency(&pair[0].rig) / frequency(&pair[1].rig);
        if (0.75..1.34).contains(&ratio) {
            continue;
        }
        apart += 1;
        let recordings = [0, 1].map(|i| pair[i].recordings[0].clone());
        let kinds: Vec<_> = against_rig(&recordings, &pair[0].rig)
            .into_iter()
            .map(|n| n.kind)
            .collect();
        told += usize::from(kinds.iter().any(|k| {
            matches!(
                k,
                NoticeKind::OtherRigSuspected { .. } | NoticeKind::FrequencySuspected { .. }
            )
        }));
    }
    println!("{told} of {apart} pairs of rigs told apart");
    assert_eq!(told, apart);
    apart
}

/// An encoder that ends within the motion of the arm, or of the pendulum.
pub(crate) fn a_clipped_encoder_is_named(cases: &[Case]) {
    for case in cases.iter().filter(swings) {
        let mut named = [false; 2];
        for recording in &case.recordings {
            let rows = rows(recording);
            for (c, named) in named.iter_mut().enumerate() {
                let mut sorted: Vec<f64> = rows.iter().map(|r| r[2 + c]).collect();
                sorted.sort_by(f64::total_cmp);
                // A tenth of the samples is beyond what it shows.
                let end = sorted[sorted.len() * 9 / 10];
                let mut changed = rows.clone();
                for row in &mut changed {
                    row[2 + c] = row[2 + c].min(end);
                }
                let column = ["theta", "alpha"][c];
                *named |= suspicions(&changed, &case.rig).iter().any(
                    |k| matches!(k, NoticeKind::ClippedSuspected { column: found, .. } if *found == column),
                );
            }
        }
        println!("{}: {named:?}", case.rig.name);
        assert!(named.iter().any(|n| *n), "{}", case.rig.name);
    }
}
