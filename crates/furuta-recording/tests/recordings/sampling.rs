//! Time stamps: repeated, going back, with gaps, with jitter.

use furuta_recording::{NoticeKind, RecordingError};

use super::{PERIOD, SAMPLES, csv, read, refused, swing};

#[test]
fn time_that_goes_backwards_or_stands_still_is_refused() {
    let mut rows = swing();
    rows[300][0] = rows[290][0];
    let (error, message) = refused(&csv(&rows));
    assert!(
        matches!(error, RecordingError::TimeBackwards { row: 302, .. }),
        "{message}"
    );
    assert!(
        message.contains("row 302, column t: time goes backwards, from 1.196 s to 1.16 s"),
        "{message}"
    );
    rows[300][0] = rows[299][0];
    assert!(matches!(
        refused(&csv(&rows)).0,
        RecordingError::TimeStandsStill { row: 302, .. }
    ));
}

#[test]
fn repeated_rows_are_dropped_with_their_numbers() {
    let mut rows = swing();
    rows.insert(10, rows[9]);
    rows.insert(10, rows[9]);
    let (recording, notices) = read(&csv(&rows)).unwrap();
    assert_eq!(recording.len(), SAMPLES);
    assert_eq!(notices, [NoticeKind::DuplicatedRows { rows: vec![12, 13] }]);
    assert_eq!(
        notices[0].to_string(),
        "rows 12, 13 repeat the row before: dropped"
    );
}

#[test]
fn gaps_divide_the_recording() {
    let mut rows = swing();
    rows.drain(400..450);
    let (recording, notices) = read(&csv(&rows)).unwrap();
    assert_eq!(recording.segments, [0..400, 400..950]);
    assert!(
        matches!(notices[..], [NoticeKind::Gap { row: 402, from, to }] if from == 1.596 && to == 1.8),
        "{notices:?}"
    );
    assert!(
        (recording.sample_period - PERIOD).abs() < 1e-9,
        "a gap must not stretch the period"
    );
    let parts = recording.continuous_parts();
    assert_eq!(
        parts
            .iter()
            .map(|part| (part.name.as_str(), part.len()))
            .collect::<Vec<_>>(),
        [("run.csv[1]", 400), ("run.csv[2]", 550)]
    );
    assert_eq!(parts[1].alpha[0], recording.alpha[400]);

    rows.drain(405..410);
    let (recording, notices) = read(&csv(&rows)).unwrap();
    assert_eq!(recording.segments, [0..400, 405..945]);
    assert!(
        notices.contains(&NoticeKind::ShortSegments {
            rows: vec![402],
            samples: 5
        }),
        "{notices:?}"
    );
}

#[test]
fn jitter_is_tolerated_up_to_the_stated_fraction() {
    // Time stamps in whole milliseconds at 400 Hz: 2, 3, 2, 3 ms.
    let mut rows = swing();
    for (k, row) in rows.iter_mut().enumerate() {
        row[0] = (k as f64 * 2.5).floor() / 1000.0;
    }
    let (recording, notices) = read(&csv(&rows)).unwrap();
    assert!(
        (recording.sample_period - 0.0025).abs() < 1e-5,
        "{}",
        recording.sample_period
    );
    assert_eq!(recording.segments.len(), 1);
    assert!(
        notices.iter().any(|notice| matches!(notice,
        NoticeKind::Jitter { largest, .. } if (largest - 0.2).abs() < 0.01)),
        "{notices:?}"
    );

    // One late sample: an interval too long, then one too short.
    let mut rows = swing();
    rows[100][0] += 0.4 * PERIOD;
    let (recording, notices) = read(&csv(&rows)).unwrap();
    assert_eq!(notices.len(), 2, "{notices:?}"); // and the one-sample segment between
    assert!(
        matches!(&notices[0], NoticeKind::IrregularIntervals { rows, .. } if rows == &[102, 103])
    );
    assert_eq!(recording.segments, [0..100, 101..SAMPLES]);

    // A clock that jitters by half a period: its time stamps are used as they are.
    let mut rows = swing();
    for (k, row) in rows.iter_mut().enumerate() {
        row[0] += 0.45 * PERIOD * (k as f64 * 2.0).sin();
    }
    let (recording, notices) = read(&csv(&rows)).unwrap();
    let uneven = |n: &NoticeKind| matches!(n, NoticeKind::UnevenTime { .. });
    assert!(notices.iter().any(uneven), "{notices:?}");
    assert!(recording.is_uneven());
    assert_eq!(
        recording.segments.as_slice(),
        std::slice::from_ref(&(0..SAMPLES))
    );
    assert!(
        recording
            .t
            .iter()
            .zip(&rows)
            .all(|(t, row)| (t - row[0]).abs() < 1e-6)
    );

    // No rate at all.
    let mut rows = swing();
    for (k, row) in rows.iter_mut().enumerate() {
        row[0] += (k / 10) as f64 * 20.0 * PERIOD;
    }
    let (error, message) = refused(&csv(&rows));
    assert!(
        matches!(error, RecordingError::IrregularTime { .. }),
        "{message}"
    );
    assert!(message.contains("record at a fixed rate"), "{message}");
}

/// A sample that a glitch put elsewhere stays in the recording, which is divided there.
#[test]
fn a_spike_divides_the_recording() {
    let mut rows = swing();
    rows[400][2] += 0.2;
    let (recording, notices) = read(&csv(&rows)).unwrap();
    assert!(
        matches!(&notices[0], NoticeKind::Spikes { column: "theta", rows, .. } if rows == &[402]),
        "{notices:?}"
    );
    assert!(
        notices[0]
            .to_string()
            .contains("row 402: theta stands out from both neighbours by 0.20"),
        "{}",
        notices[0]
    );
    assert!(!notices.iter().any(NoticeKind::is_suspicion), "{notices:?}");
    assert_eq!(recording.segments, [0..400, 401..SAMPLES]);
    assert_eq!(notices.len(), 1, "{notices:?}");
    assert!((recording.theta[400] - rows[400][2]).abs() < 1e-6);

    // In one row of fifty it is no glitch.
    for row in rows.iter_mut().step_by(50) {
        row[3] += 0.3;
    }
    let (_, notices) = read(&csv(&rows)).unwrap();
    assert!(
        notices
            .iter()
            .any(|n| n.is_suspicion() && n.column() == Some("alpha")),
        "{notices:?}"
    );
}
