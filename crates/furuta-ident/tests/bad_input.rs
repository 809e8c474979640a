//! What breaks a convention is named for what it is, on every recording of the development cases and of the real rig;
//! what is sound is not accused.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use furuta_ident::recording::{NoticeKind, Recording, against_rig};
use furuta_model::Rig;

/// The recordings shared with the project, where they are: `[(rig file, recordings)]`.
fn shared() -> Vec<(PathBuf, Vec<PathBuf>)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let mut folders: Vec<PathBuf> = ["blind/dev", "real"]
        .iter()
        .filter_map(|part| std::fs::read_dir(root.join(part)).ok())
        .flatten()
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.join("rig.toml").exists())
        .collect();
    folders.sort();
    if folders.is_empty() {
        eprintln!("skipped: there is no folder ../shared with recordings");
    }
    folders
        .into_iter()
        .map(|folder| {
            let mut files: Vec<PathBuf> = std::fs::read_dir(&folder)
                .expect("a folder")
                .filter_map(|entry| Some(entry.ok()?.path()))
                .filter(|path| path.extension().is_some_and(|e| e == "csv"))
                .collect();
            files.sort();
            (folder.join("rig.toml"), files)
        })
        .collect()
}

/// The folders in which a pendulum swings: one that is balanced in all recordings shows neither where its angle is
/// counted from nor that an encoder
/// clips, since its motion is a few counts.
fn swinging() -> Vec<(PathBuf, Vec<PathBuf>)> {
    let swings = |file: &PathBuf| {
        let recording = Recording::load(file).expect("sound");
        recording.alpha.iter().any(|alpha| alpha.cos() < 0.5)
    };
    let mut folders = shared();
    folders.retain(|(_, files)| files.iter().any(swings));
    folders
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

const CORRUPTIONS: [Corruption; 11] = [
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
#[test]
fn every_mistake_is_named_on_shared_recordings() {
    let mut found = [0; CORRUPTIONS.len()];
    let mut folders_found = [0; CORRUPTIONS.len()];
    let (mut all, mut folders) = (0, 0);
    for (rig, files) in swinging() {
        let rig = Rig::load(rig.to_str().expect("UTF-8")).expect("a rig file");
        let recordings: Vec<Vec<Row>> = files
            .iter()
            .map(|f| rows(&Recording::load(f).expect("sound")))
            .collect();
        folders += 1;
        all += recordings.len();
        for (i, (what, change, named)) in CORRUPTIONS.iter().enumerate() {
            let mut any = false;
            for (rows, file) in recordings.iter().zip(&files) {
                let changed: Vec<Row> = rows.iter().copied().map(change).collect();
                let kinds = suspicions(&changed, &rig);
                if kinds.iter().any(named) {
                    found[i] += 1;
                    any = true;
                } else {
                    println!("{what} not named: {} {kinds:?}", file.display());
                }
            }
            folders_found[i] += usize::from(any);
        }
    }
    for (i, (what, ..)) in CORRUPTIONS.iter().enumerate() {
        println!(
            "{what:<28} {:>3} of {all} recordings, {:>3} of {folders} rigs",
            found[i], folders_found[i]
        );
    }
    for (i, (what, ..)) in CORRUPTIONS.iter().enumerate() {
        assert_eq!(folders_found[i], folders, "{what}");
    }
}

/// Of all these recordings none is accused of a broken convention: not alone, not together.
#[test]
fn sound_shared_recordings_are_not_accused() {
    for (rig, files) in shared() {
        let rig = Rig::load(rig.to_str().expect("UTF-8")).expect("a rig file");
        let mut recordings = Vec::new();
        for file in &files {
            let (recording, notices) = Recording::load_with_notices(file).expect("sound");
            assert!(
                !notices.iter().any(|n| n.kind.is_suspicion()),
                "{}: {notices:?}",
                file.display()
            );
            recordings.push(recording);
        }
        let notices = against_rig(&recordings, &rig);
        assert!(notices.is_empty(), "{:?}: {notices:?}", files.first());
    }
}

/// Two development cases have two rigs: where their pendulums differ by a quarter or more, it is said.
#[test]
fn recordings_of_two_rigs_are_told_apart() {
    let cases = shared();
    let frequency = |rig: &Rig| {
        let c = rig.params.coefficients();
        (c.weight / c.pendulum).sqrt()
    };
    let (mut apart, mut told) = (0, 0);
    for (a, b) in cases.iter().zip(cases.iter().skip(1)) {
        let rigs =
            [a, b].map(|(rig, _)| Rig::load(rig.to_str().expect("UTF-8")).expect("a rig file"));
        let ratio = frequency(&rigs[0]) / frequency(&rigs[1]);
        if (0.75..1.34).contains(&ratio) {
            continue;
        }
        apart += 1;
        let recordings = [&a.1[0], &b.1[0]].map(|f| Recording::load(f).expect("sound"));
        let kinds: Vec<_> = against_rig(&recordings, &rigs[0])
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
}

/// An encoder that ends within the motion of the arm, or of the pendulum.
#[test]
fn a_clipped_encoder_is_named() {
    for (rig, files) in swinging() {
        let rig = Rig::load(rig.to_str().expect("UTF-8")).expect("a rig file");
        let mut named = [false; 2];
        for file in &files {
            let rows = rows(&Recording::load(file).expect("sound"));
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
                *named |= suspicions(&changed, &rig).iter().any(
                    |k| matches!(k, NoticeKind::ClippedSuspected { column: found, .. } if *found == column),
                );
            }
        }
        println!("{:?}: {named:?}", files.first());
        assert!(named.iter().any(|n| *n), "{:?}", files.first());
    }
}
