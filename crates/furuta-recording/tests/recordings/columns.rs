//! Columns, fields and what is missing.

use furuta_recording::{Recording, RecordingError, Values};

use super::{PERIOD, SAMPLES, csv, read, refused, swing};

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
