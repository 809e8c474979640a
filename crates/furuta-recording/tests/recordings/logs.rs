//! Writing and reading again, and logs of runs.

use furuta_recording::{NoticeKind, Recording, RecordingError, Values};

use super::{SAMPLES, read, refused, swing};

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
