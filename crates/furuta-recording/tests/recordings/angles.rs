//! Angles that wrap or jump, and what makes a recording suspicious or weak.

use std::f64::consts::{PI, TAU};

use furuta_recording::{NoticeKind, Recording};

use super::{csv, read, swing};

#[test]
fn wrapped_angles_are_made_continuous() {
    let rows = swing();
    for (low, what) in [(-PI, "(-pi, pi]"), (0.0, "[0, 2 pi)")] {
        // Centred on the seam, so that the swing crosses it again and again.
        let shift = low - PI;
        let mut wrapped = rows.clone();
        for row in &mut wrapped {
            row[3] = low + (row[3] + shift - low).rem_euclid(TAU);
        }
        let (recording, notices) = read(&csv(&wrapped)).unwrap();
        let jumps = notices.iter().find_map(|notice| match notice {
            NoticeKind::Unwrapped {
                column: "alpha",
                jumps,
                ..
            } => Some(*jumps),
            _ => None,
        });
        assert!(jumps.unwrap() >= 2, "{what}: {notices:?}");
        let offset = recording.alpha[0] - rows[0][3];
        let worst = recording
            .alpha
            .iter()
            .zip(&rows)
            .map(|(got, row)| (got - row[3] - offset).abs())
            .fold(0.0, f64::max);
        assert!(worst < 1e-6, "{what}: {worst}");
    }
    // Hanging, written as -pi and pi by turns: hanging is +pi.
    let mut wrapped = rows.clone();
    for row in &mut wrapped {
        row[3] = row[3].sin().atan2(row[3].cos());
    }
    let (recording, _) = read(&csv(&wrapped)).unwrap();
    assert!(
        recording
            .alpha
            .iter()
            .zip(&rows)
            .all(|(got, row)| (got - row[3]).abs() < 1e-6)
    );
}

#[test]
fn a_jump_that_is_no_turn_is_reported_and_left() {
    let mut rows = swing();
    for row in rows.iter_mut().skip(600) {
        row[2] += 2.0;
    }
    let (recording, notices) = read(&csv(&rows)).unwrap();
    assert!(
        matches!(
            notices[..],
            [NoticeKind::Jump {
                column: "theta",
                row: 602,
                ..
            }]
        ),
        "{notices:?}"
    );
    assert!((recording.theta[600] - rows[600][2]).abs() < 1e-6);
}

/// A balanced pendulum's small limit cycle is faster than any pendulum of a bench swings; what swings about 0 as slowly
/// as one is counted from hanging.
#[test]
fn a_limit_cycle_about_upright_is_not_taken_for_a_hanging_pendulum() {
    let swinging = |speed: f64| {
        let row = |k: i32| {
            let t = 0.002 * f64::from(k);
            [
                t,
                (3.0 * t).sin(),
                0.3 * (3.0 * t).sin(),
                0.03 * (speed * t).sin(),
            ]
        };
        let rows: Vec<_> = (0..4000).map(row).collect();
        let (_, notices) = read(&csv(&rows)).unwrap();
        notices.contains(&NoticeKind::HangingSuspected)
    };
    assert!(swinging(6.0));
    assert!(!swinging(28.0));
}

#[test]
fn broken_conventions_are_suspected() {
    let suspicion = |change: fn([f64; 4]) -> [f64; 4]| {
        let rows: Vec<_> = swing().into_iter().map(change).collect();
        let (_, notices) = read(&csv(&rows)).unwrap();
        notices
            .into_iter()
            .filter(NoticeKind::is_suspicion)
            .collect::<Vec<_>>()
    };
    assert_eq!(suspicion(|row| row), []);
    assert_eq!(
        suspicion(|[t, u, theta, alpha]| [t, u, theta, alpha - PI]),
        [NoticeKind::HangingSuspected]
    );
    assert_eq!(
        suspicion(|[t, u, theta, alpha]| [t, u, theta, -alpha]),
        [NoticeKind::SignSuspected]
    );
    assert_eq!(
        suspicion(|[t, u, theta, alpha]| [t, u, -theta, alpha]),
        [NoticeKind::SignSuspected]
    );
    assert!(matches!(
        suspicion(|[t, u, theta, alpha]| [t, u, theta.to_degrees(), alpha.to_degrees()])[..],
        [
            NoticeKind::DegreesSuspected {
                column: "theta",
                ..
            },
            NoticeKind::DegreesSuspected {
                column: "alpha",
                ..
            }
        ]
    ));
    assert!(matches!(
        suspicion(|[t, u, theta, alpha]| [1000.0 * t, u, theta, alpha])[..],
        [NoticeKind::TimeUnitSuspected {
            unit: "milliseconds",
            ..
        }]
    ));
}

#[test]
fn what_says_little_is_said() {
    let kinds = |rows: Vec<[f64; 4]>| read(&csv(&rows)).unwrap().1;
    assert!(matches!(
        kinds(swing()[..100].to_vec())[..],
        [NoticeKind::TooShort { .. }]
    ));
    let constant = swing()
        .into_iter()
        .map(|[t, _, theta, alpha]| [t, 0.0, theta, alpha])
        .collect();
    assert_eq!(
        kinds(constant),
        [NoticeKind::ConstantCommand { value: 0.0 }]
    );
    let still = swing()
        .into_iter()
        .map(|[t, u, ..]| [t, u, 0.0, PI])
        .collect();
    assert_eq!(kinds(still), [NoticeKind::NoMotion]);
}

/// Real recordings keep to the conventions, and none of them may be suspected.
#[test]
fn sound_recordings_raise_no_suspicion() {
    let examples = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let mut read = 0;
    for rig in ["qube-servo-2", "qube-servo-2-balance"] {
        for file in std::fs::read_dir(examples.join(rig)).expect("a folder") {
            let file = file.expect("readable").path();
            if file.extension().is_some_and(|extension| extension == "csv") {
                let (_, notices) = Recording::load_with_notices(&file).expect("sound");
                assert_eq!(notices, [], "{}", file.display());
                read += 1;
            }
        }
    }
    assert_eq!(read, 12);
}
