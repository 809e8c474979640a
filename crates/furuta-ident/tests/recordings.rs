//! Recordings as people really have them: each defect is mended with a notice or refused by name, never silently.

use std::f64::consts::{PI, TAU};

use furuta_ident::recording::{NoticeKind, Recording, RecordingError, Values};
use furuta_model::Sensors;
use proptest::prelude::*;

const PERIOD: f64 = 0.004;
const SAMPLES: usize = 1000;

/// A pendulum hanging and swinging, on an arm that turns: the equation of motion, integrated by small steps, and
/// rounded to encoder counts.
fn swing() -> Vec<[f64; 4]> {
    let sensors = Sensors {
        arm_counts_per_rev: 2048.0,
        pendulum_counts_per_rev: 2048.0,
    };
    let (mut alpha, mut alpha_dot) = (PI + 0.4, 0.0);
    let steps = 20;
    let step = PERIOD / f64::from(steps);
    let mut rows = Vec::new();
    for k in 0..SAMPLES {
        let t = k as f64 * PERIOD;
        let theta = |t: f64| 0.5 * (7.0 * t).sin() + 0.2 * (17.0 * t).sin();
        let theta_ddot = |t: f64| -0.5 * 49.0 * (7.0 * t).sin() - 0.2 * 289.0 * (17.0 * t).sin();
        let [arm, pendulum] = sensors.quantised([theta(t), alpha]);
        rows.push([t, (7.0 * t).cos(), arm, pendulum]);
        for i in 0..steps {
            let now = t + f64::from(i) * step;
            alpha_dot += step
                * (110.0 * f64::sin(alpha) + 0.9 * f64::cos(alpha) * theta_ddot(now)
                    - 0.3 * alpha_dot);
            alpha += step * alpha_dot;
        }
    }
    rows
}

fn csv(rows: &[[f64; 4]]) -> String {
    rows.iter()
        .fold("t,u,theta,alpha\n".into(), |text, [t, u, theta, alpha]| {
            text + &format!("{t:.6},{u:.6},{theta:.7},{alpha:.7}\n")
        })
}

fn read(text: &str) -> Result<(Recording, Vec<NoticeKind>), RecordingError> {
    let (recording, notices) = Recording::from_csv("run.csv", text.as_bytes())?;
    Ok((
        recording,
        notices.into_iter().map(|notice| notice.kind).collect(),
    ))
}

fn refused(text: &str) -> (RecordingError, String) {
    let error = read(text).expect_err("should be refused");
    let message = error.to_string();
    assert!(
        message.starts_with("run.csv: ") && !message.contains('\n'),
        "{message}"
    );
    (error, message)
}

#[test]
fn a_sound_recording_is_read_without_a_word() {
    let rows = swing();
    let (recording, notices) = read(&csv(&rows)).unwrap();
    assert_eq!(notices, []);
    assert_eq!(recording.len(), SAMPLES);
    assert!((recording.sample_period - PERIOD).abs() < 1e-9);
    assert_eq!(recording.segments.len(), 1);
    assert_eq!(recording.segments[0], 0..SAMPLES);
    assert!((recording.alpha[500] - rows[500][3]).abs() < 1e-6);
    assert_eq!(recording.name, "run.csv");
}

#[test]
fn columns_come_in_any_order_with_comments_blank_lines_and_further_columns() {
    let mut text =
        "\u{feff}# bench 2\r\nalpha , note,theta_dot,t,current,u,theta\r\n\r\n".to_owned();
    for (k, [t, u, theta, alpha]) in swing().iter().enumerate() {
        let current = if k == 3 {
            String::new()
        } else {
            format!("{}", 0.5 * u)
        };
        text += &format!("{alpha},\"ok, {k}\",0.25,{t},{current},{u},{theta}\r\n# row {k}\r\n");
    }
    let (recording, notices) = read(&text).unwrap();
    assert_eq!(notices, []);
    assert_eq!(recording.theta_dot.as_ref().unwrap()[7], 0.25);
    assert_eq!(recording.alpha_dot, None);
    assert_eq!(recording.comments[0], "bench 2");
    let names: Vec<_> = recording
        .extra
        .iter()
        .map(|column| column.name.as_str())
        .collect();
    assert_eq!(names, ["note", "current"]);
    let Values::Text(notes) = &recording.extra[0].values else {
        panic!("text")
    };
    assert_eq!(notes[2], "ok, 2");
    let Values::Numbers(current) = &recording.extra[1].values else {
        panic!("numbers")
    };
    assert!(current[3].is_nan() && current[4] == 0.5 * recording.u[4]);
}

#[test]
fn a_missing_column_is_named_with_what_was_found() {
    let (error, message) = refused("t,u,theta\n0,0,0\n");
    assert!(matches!(
        error,
        RecordingError::MissingColumn {
            column: "alpha",
            ..
        }
    ));
    assert!(
        message.contains("found t, u, theta") && message.contains("alpha (rad)"),
        "{message}"
    );
    assert!(
        refused("t;u;theta;alpha\n0;0;0;0\n")
            .1
            .contains("separate the columns by commas")
    );
    assert!(
        refused("0,0,0,3.14\n0.1,0,0,3.14\n")
            .1
            .contains("put the header before it")
    );
    assert!(
        refused("t,u,theta,Alpha [rad]\n0,0,0,3.14\n")
            .1
            .contains("lower case, without units")
    );
    assert!(matches!(
        refused("t,u,theta,alpha,u\n0,0,0,0,0\n").0,
        RecordingError::DuplicateColumn { row: 1, .. }
    ));
}

/// Rows are counted as an editor counts lines: comments and blank lines count.
#[test]
fn a_bad_field_is_refused_with_row_and_column() {
    let text = |field: &str| {
        format!(
            "# a comment\n\nt,u,theta,alpha\n0,0,0,3.1\n# another\n0.1,0,0,{field}\n0.2,0,0,3.1"
        )
    };
    let (error, message) = refused(&text("NaN"));
    assert!(
        matches!(error, RecordingError::NotFinite { row: 6, .. }),
        "{message}"
    );
    assert!(
        message.contains("row 6, column alpha: the value is NaN"),
        "{message}"
    );
    assert!(matches!(
        refused(&text("-inf")).0,
        RecordingError::NotFinite { row: 6, .. }
    ));
    assert!(
        refused(&text("3,1"))
            .1
            .contains("row 6: 5 fields where the header has 4")
    );
    assert!(
        refused(&text(""))
            .1
            .contains("row 6, column alpha: `` is not a number")
    );
    assert!(refused(&text("up")).1.contains("`up` is not a number"));
    assert!(matches!(
        refused(&text("\"3.1")).0,
        RecordingError::OpenQuote { row: 6, .. }
    ));
    // Cut off in the last row.
    assert!(matches!(
        refused("t,u,theta,alpha\n0,0,0,3\n0.1,0").0,
        RecordingError::FieldCount {
            row: 3,
            found: 2,
            ..
        }
    ));
}

#[test]
fn nothing_in_the_file_is_no_recording() {
    assert!(matches!(refused("").0, RecordingError::Empty { .. }));
    assert!(matches!(
        refused("\n# only a comment\n").0,
        RecordingError::Empty { .. }
    ));
    assert!(matches!(
        refused("t,u,theta,alpha\n").0,
        RecordingError::TooFewRows { rows: 0, .. }
    ));
    let error = Recording::from_csv("run.csv", b"t,u,theta,alpha\n0,0,\xff,0\n").unwrap_err();
    assert!(
        matches!(error, RecordingError::NotText { row: 2, .. }),
        "{error}"
    );
}

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

    // No rate at all.
    let mut rows = swing();
    for (k, row) in rows.iter_mut().enumerate() {
        row[0] += 0.45 * PERIOD * (k as f64 * 2.0).sin();
    }
    let (error, message) = refused(&csv(&rows));
    assert!(
        matches!(error, RecordingError::IrregularTime { .. }),
        "{message}"
    );
    assert!(message.contains("record at a fixed rate"), "{message}");
}

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

/// Through CSV and through MCAP: every number, every column, the rig file and the comments come back.
#[test]
fn writing_loses_nothing() {
    let mut text = "# bench 2\n# rig| [rig]\n# rig| name \
                    = \"bench\"\nt,u,theta,alpha,alpha_dot,current,lamp,status\n"
        .to_owned();
    for (k, [t, u, theta, alpha]) in swing().iter().enumerate() {
        text += &format!(
            "{t},{u},{theta},{alpha},{},{},{},{}\n",
            0.1 * u,
            if k == 5 { f64::NAN } else { u / 3.0 },
            ["on", "off"][k % 2],
            k % 7
        );
    }
    let (recording, _) = read(&text).unwrap();
    assert_eq!(recording.rig.as_deref(), Some("[rig]\nname = \"bench\"\n"));
    let folder = std::env::temp_dir().join(format!("furuta-recordings-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for (write, name) in [
        (
            Recording::write_csv
                as fn(&Recording, std::path::PathBuf) -> Result<(), RecordingError>,
            "again.csv",
        ),
        (Recording::write_mcap, "again.mcap"),
    ] {
        write(&recording, folder.join(name)).unwrap();
        let (mut again, notices) = Recording::load_with_notices(folder.join(name)).unwrap();
        assert_eq!(notices, [], "{name}");
        assert_eq!(again.name, name);
        let named = |recording: &Recording, name: &str| {
            recording
                .extra
                .iter()
                .find(|column| column.name == name)
                .cloned()
                .unwrap()
                .values
        };
        let (Values::Numbers(current), Values::Numbers(before)) =
            (named(&again, "current"), named(&recording, "current"))
        else {
            panic!("numbers")
        };
        assert!(
            current[5].is_nan()
                && current
                    .iter()
                    .zip(&before)
                    .all(|(a, b)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan())
        );
        assert_eq!(named(&again, "lamp"), named(&recording, "lamp"), "{name}");
        assert_eq!(
            named(&again, "status"),
            named(&recording, "status"),
            "{name}"
        );
        assert_eq!(
            again.extra.len(),
            3,
            "{name}: {:?}",
            again
                .extra
                .iter()
                .map(|column| &column.name)
                .collect::<Vec<_>>()
        );
        again.extra = Vec::new();
        let expected = Recording {
            name: name.into(),
            extra: Vec::new(),
            ..recording.clone()
        };
        assert_eq!(again, expected, "{name}");
    }

    // A log cut off is refused, and can be salvaged.
    let whole = std::fs::read(folder.join("again.mcap")).unwrap();
    std::fs::write(folder.join("cut.mcap"), &whole[..whole.len() / 3]).unwrap();
    let error = Recording::load(folder.join("cut.mcap")).unwrap_err();
    assert!(matches!(error, RecordingError::CutOff { .. }), "{error}");
    assert!(
        error.to_string().contains("cut.mcap: log was cut off"),
        "{error}"
    );
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_log_of_a_run_is_read_with_all_its_fields() {
    let metadata = furuta_log::Metadata {
        rig: "bench".into(),
        rig_file: "[rig]\n".into(),
        controller: "lqr".into(),
        ..Default::default()
    };
    let mut log = furuta_log::LogWriter::new(std::io::Cursor::new(Vec::new()), &metadata).unwrap();
    for (k, [t, u, theta, alpha]) in swing()
        .into_iter()
        .enumerate()
        .filter(|(k, _)| !(500..510).contains(k))
    {
        let lost = if k == 510 { 10 } else { 0 };
        let mode = if k < 500 {
            furuta_log::Mode::SwingUp
        } else {
            furuta_log::Mode::Balance
        };
        log.write(&furuta_log::Record {
            t,
            u,
            theta,
            alpha,
            lost,
            mode,
            seq: k as u32,
            delay: f64::NAN,
            ..Default::default()
        })
        .unwrap();
    }
    let bytes = log.finish().unwrap().into_inner();
    let (recording, notices) = Recording::from_mcap("run.mcap", &bytes).unwrap();
    assert_eq!(recording.segments, [0..500, 500..SAMPLES - 10]);
    assert!(
        matches!(notices[0].kind, NoticeKind::Gap { row: 501, .. }),
        "{notices:?}"
    );
    assert_eq!(
        (
            recording.rig.as_deref(),
            recording.metadata["controller"].as_str()
        ),
        (Some("[rig]\n"), "lqr")
    );
    let names: Vec<_> = recording
        .extra
        .iter()
        .map(|column| column.name.as_str())
        .collect();
    assert_eq!(
        names,
        [
            "reference",
            "command",
            "mode",
            "seq",
            "status",
            "lost",
            "delay",
            "compute"
        ]
    );
    assert!(
        matches!(&recording.extra[2].values, Values::Text(mode) if mode[0] == "swing-up" && mode[600] == "balance")
    );

    // A run killed in the middle: what was logged is there.
    let (salvaged, notices) = Recording::from_mcap("run.mcap", &bytes[..bytes.len() / 2]).unwrap();
    assert!(
        matches!(notices[0].kind, NoticeKind::CutOff { .. }),
        "{notices:?}"
    );
    assert!(salvaged.len() > 300 && salvaged.alpha == recording.alpha[..salvaged.len()]);
}

/// A run that ends because an estimate is no number has that estimate in its last sample. Angles, time and command are
/// what a diagnosis reads.
#[test]
fn speeds_that_are_not_known_are_no_mistake() {
    let n = 100;
    type Spoil = fn(&mut furuta_log::Record);
    let log = |spoil: Spoil| {
        let memory = std::io::Cursor::new(Vec::new());
        let mut log = furuta_log::LogWriter::new(memory, &furuta_log::Metadata::default()).unwrap();
        for (k, [t, u, theta, alpha]) in swing().into_iter().take(n).enumerate() {
            let mut record = furuta_log::Record {
                t,
                u,
                theta,
                alpha,
                seq: k as u32,
                ..Default::default()
            };
            if k == n - 1 {
                spoil(&mut record);
            }
            log.write(&record).unwrap();
        }
        Recording::from_mcap("run.mcap", &log.finish().unwrap().into_inner())
    };
    let (ended, _) = log(|r| {
        r.theta_dot = f64::NEG_INFINITY;
        r.alpha_dot = f64::NAN;
    })
    .unwrap();
    let last = |recording: &Recording| {
        let speeds = [&recording.theta_dot, &recording.alpha_dot];
        speeds.map(|speed| speed.as_ref().and_then(|s| s.last().copied()).unwrap())
    };
    assert_eq!(ended.len(), n);
    assert_eq!(last(&ended)[0], f64::NEG_INFINITY);
    assert!(last(&ended)[1].is_nan());

    // And so it stays in either form: NaN is an empty field, or null.
    let mut csv = Vec::new();
    ended.to_csv(&mut csv).unwrap();
    assert!(String::from_utf8_lossy(&csv).contains(",-inf,,"));
    let (again, _) = Recording::from_csv("run.csv", &csv).unwrap();
    let folder = std::env::temp_dir().join(format!("furuta-unknown-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    ended.write_mcap(folder.join("run.mcap")).unwrap();
    let rewritten = Recording::load(folder.join("run.mcap")).unwrap();
    std::fs::remove_dir_all(folder).unwrap();
    for other in [&again, &rewritten] {
        let bits = |recording: &Recording| last(recording).map(f64::to_bits);
        assert_eq!(bits(other), bits(&ended));
        assert_eq!((&other.alpha, &other.u), (&ended.alpha, &ended.u));
    }

    // What is measured or commanded must be known.
    let spoilt: [(&str, Spoil); 3] = [
        ("theta", |r| r.theta = f64::NAN),
        ("alpha", |r| r.alpha = f64::INFINITY),
        ("u", |r| r.u = f64::NAN),
    ];
    for (name, spoil) in spoilt {
        match log(spoil) {
            Err(RecordingError::NotFinite {
                row: 100, column, ..
            }) => assert_eq!(column, name),
            other => panic!("{name}: {other:?}"),
        }
    }
    // A speed that is not there is one thing, one that cannot be read another.
    let text = "t,u,theta,alpha,alpha_dot\n0,0,0,3.1,0\n0.1,0,0,3.1,fast\n";
    assert!(
        refused(text)
            .1
            .contains("row 3, column alpha_dot: `fast` is not a number")
    );
}

#[test]
fn a_column_that_only_shares_a_name_with_the_log_is_not_logged_wrongly() {
    let mut text = "t,u,theta,alpha,status\n".to_owned();
    for [t, u, theta, alpha] in swing() {
        text += &format!("{t},{u},{theta},{alpha},good\n");
    }
    let (recording, _) = read(&text).unwrap();
    let error = recording
        .write_mcap(std::env::temp_dir().join("furuta-never-written.mcap"))
        .unwrap_err();
    assert!(
        matches!(error, RecordingError::NotLoggable { .. }),
        "{error}"
    );
    assert!(error.to_string().contains("column `status`"), "{error}");
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

/// Pieces of CSV, right and wrong, in any order: finds what random bytes would not get to.
fn csv_like() -> impl Strategy<Value = String> {
    let piece = prop_oneof![
        Just("t,u,theta,alpha\n".to_owned()),
        Just("\n".to_owned()),
        Just("\r".to_owned()),
        Just(",".to_owned()),
        Just("\"".to_owned()),
        Just("#".to_owned()),
        Just("nan".to_owned()),
        Just("1e308".to_owned()),
        any::<f64>().prop_map(|value| value.to_string()),
        (any::<i8>(), any::<f64>()).prop_map(|(t, alpha)| format!("{t},1,2,{alpha}\n")),
        (0_u8..50, -7.0..7.0).prop_map(|(t, alpha)| format!("{t},1,2,{alpha}\n")),
    ];
    proptest::collection::vec(piece, 0..60)
        .prop_map(|pieces| "t,u,theta,alpha\n".to_owned() + &pieces.concat())
}

proptest! {
    #[test]
    fn no_bytes_make_the_reader_panic(bytes in proptest::collection::vec(any::<u8>(), 0..2000)) {
        let _ = Recording::from_csv("x.csv", &bytes);
        let _ = Recording::from_mcap("x.mcap", &bytes);
        let _ = Recording::from_mcap("x.mcap", &[b"\x89MCAP0\r\n".as_slice(), &bytes].concat());
    }

    #[test]
    fn no_text_like_csv_makes_the_reader_panic(text in csv_like()) {
        if let Ok((recording, _)) = Recording::from_csv("x.csv", text.as_bytes()) {
            prop_assert!(recording.sample_period > 0.0 && recording.sample_period.is_finite());
            prop_assert!(recording.t.windows(2).all(|pair| pair[0] < pair[1]));
            prop_assert!(recording.segments.iter().all(|segment| segment.end <= recording.len()));
            prop_assert_eq!(recording.continuous_parts().len(), recording.segments.len());
        }
    }

    #[test]
    fn a_damaged_log_does_not_make_the_reader_panic(at in 0_usize..4000, to in any::<u8>(), keep in 0.0..1.0) {
        let (recording, _) = read(&csv(&swing()[..60])).unwrap();
        let path = std::env::temp_dir().join(format!("furuta-damaged-{}-{:?}.mcap", std::process::id(),
            std::thread::current().id()));
        recording.write_mcap(&path).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        let at = at % bytes.len();
        bytes[at] = to;
        let _ = Recording::from_mcap("x.mcap", &bytes);
        bytes.truncate((keep * bytes.len() as f64) as usize);
        let _ = Recording::from_mcap("x.mcap", &bytes);
    }
}
