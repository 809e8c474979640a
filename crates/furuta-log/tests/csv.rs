//! A log as CSV and back: no bit of a sample, no character of the metadata, no byte of the file is lost.

use std::collections::BTreeMap;
use std::io::Cursor;

use furuta_log::{
    FIELDS, Log, Metadata, Mode, Record, Timing, is_csv, read_csv, read_from, write_csv,
};
use proptest::prelude::*;

fn csv(log: &Log) -> Vec<u8> {
    let mut csv = Vec::new();
    write_csv(log, &mut csv).expect("memory");
    csv
}

fn mcap(log: &Log) -> Vec<u8> {
    let bytes = log.write_to(Cursor::new(Vec::new())).expect("memory");
    bytes.into_inner()
}

/// Every number of a record by its bits; one NaN for all of them, since neither file tells them apart.
fn bits(r: &Record) -> ([u64; 10], Mode, u32, u8, u32) {
    let numbers = [
        r.t,
        r.u,
        r.theta,
        r.alpha,
        r.theta_dot,
        r.alpha_dot,
        r.reference,
        r.command,
        r.delay,
        r.compute,
    ];
    let one = |x: f64| if x.is_nan() { f64::NAN } else { x }.to_bits();
    (numbers.map(one), r.mode, r.seq, r.status, r.lost)
}

fn same(a: &Log, b: &Log) {
    assert_eq!(a.metadata, b.metadata);
    assert_eq!(a.real_time, b.real_time);
    assert_eq!(a.timing, b.timing);
    let all = |log: &Log| log.records.iter().map(bits).collect::<Vec<_>>();
    assert_eq!(all(a), all(b));
}

/// Any bits at all: subnormal, -0, infinite, NaN.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => any::<u64>().prop_map(f64::from_bits),
        2 => -10.0..10.0_f64,
        1 => prop::sample::select(vec![0.0, -0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MIN_POSITIVE / 3.0,
            1e300, 0.1 + 0.2]),
    ]
}

fn record() -> impl Strategy<Value = Record> {
    let numbers = prop::collection::vec(number(), 9);
    let mode = prop::sample::select(Mode::ALL.to_vec());
    (
        0.0..1e6_f64,
        numbers,
        mode,
        any::<u32>(),
        any::<u8>(),
        any::<u32>(),
    )
        .prop_map(|(t, n, mode, seq, status, lost)| Record {
            t,
            u: n[0],
            theta: n[1],
            alpha: n[2],
            theta_dot: n[3],
            alpha_dot: n[4],
            reference: n[5],
            command: n[6],
            mode,
            seq,
            status,
            lost,
            delay: n[7],
            compute: n[8],
        })
}

/// Lines, quotes, separators, whatever a file may hold.
fn text() -> impl Strategy<Value = String> {
    prop_oneof![
        "[a-z =\"|:#,\n\r\t]{0,40}",
        "([a-z \\[\\]=]{0,12}\n){0,5}",
        ".{0,20}",
    ]
}

fn metadata() -> impl Strategy<Value = Metadata> {
    let key = prop_oneof!["[a-z_]{1,12}", ".{0,8}"].prop_filter("has a field of its own", |key| {
        !["rig", "rig_file", "controller", "software", "units"].contains(&key.as_str())
    });
    let extra = prop::collection::btree_map(key, text(), 0..6);
    (text(), text(), text(), text(), extra).prop_map(
        |(rig, rig_file, controller, software, extra)| Metadata {
            rig,
            rig_file,
            controller,
            software,
            extra,
        },
    )
}

/// How the loop ran, which a log says at its end.
fn timing() -> impl Strategy<Value = Option<Box<Timing>>> {
    prop::option::of(prop::collection::vec((0.0..0.1_f64, 0.0..0.01_f64), 0..20)).prop_map(
        |times| {
            times.map(|times| {
                let mut timing = Timing::new(2_000_000);
                for (wake_up, compute) in times {
                    timing.sample(wake_up, compute);
                }
                Box::new(timing)
            })
        },
    )
}

fn log() -> impl Strategy<Value = Log> {
    let real_time = prop::collection::btree_map("[a-z_]{1,8}", text(), 0..3);
    let records = prop::collection::vec(record(), 1..40);
    (metadata(), records, real_time, timing()).prop_map(|(metadata, records, real_time, timing)| {
        Log {
            metadata: Some(metadata),
            records,
            real_time,
            timing,
            ..Log::default()
        }
    })
}

proptest! {
    #[test]
    fn from_mcap_to_csv_and_back(log in log()) {
        let read = read_from(&mcap(&log)[..]).expect("own log");
        same(&read, &log);
        let again = read_csv(&csv(&read)).expect("own CSV");
        same(&again, &log);
        same(&read_from(&mcap(&again)[..]).expect("own log"), &log);
    }

    #[test]
    fn from_csv_to_mcap_and_back(log in log()) {
        let first = csv(&log);
        let read = read_from(&mcap(&read_csv(&first).expect("own CSV"))[..]).expect("own log");
        let second = csv(&read);
        prop_assert_eq!(String::from_utf8_lossy(&second), String::from_utf8_lossy(&first));
    }

    #[test]
    fn no_text_makes_the_reader_panic(lines in prop::collection::vec(text(), 0..8)) {
        let _ = read_csv(format!("# furuta log 1\n{}", lines.concat()).as_bytes());
    }
}

#[test]
fn the_same_file_again_where_the_log_says_when_it_began() {
    let extra = BTreeMap::from([(
        furuta_log::STARTED.to_owned(),
        "1763780000123456789".to_owned(),
    )]);
    let records = (0..500).map(|k| Record {
        t: f64::from(k) * 0.002,
        seq: 1000 + k,
        theta: f64::from(k).sin(),
        mode: Mode::Balance,
        ..Record::default()
    });
    let log = Log {
        metadata: Some(Metadata {
            extra,
            ..Metadata::default()
        }),
        records: records.collect(),
        ..Log::default()
    };
    let first = mcap(&log);
    let again = read_csv(&csv(&read_from(&first[..]).expect("own log"))).expect("own CSV");
    assert_eq!(mcap(&again), first);
}

#[test]
fn it_is_a_csv_file_like_any_other() {
    let log = Log {
        metadata: Some(Metadata {
            rig_file: "[rig]\nname = \"bench\"\n\n[arm]\n".into(),
            controller: "LQR".into(),
            ..Metadata::default()
        }),
        records: vec![Record {
            theta: 0.25,
            theta_dot: f64::NAN,
            ..Record::default()
        }],
        ..Log::default()
    };
    let bytes = csv(&log);
    let text = String::from_utf8(bytes.clone()).expect("text");
    assert!(is_csv(&bytes) && !is_csv(b"# furuta log 12\n") && !is_csv(b"t,u\n"));
    assert!(
        text.contains("\n# rig| name = \"bench\"\n# rig| \n# rig| [arm]\n"),
        "{text}"
    );
    assert!(text.contains("\n# controller: LQR\n"), "{text}");
    let names = FIELDS.map(|field| field.name).join(",");
    assert!(
        text.ends_with(&format!("\n{names}\n0,0,0.25,0,,0,0,0,off,0,0,0,0,0\n")),
        "{text}"
    );
    // An editor may have left carriage returns and blank lines.
    let windows = text.replace('\n', "\r\n") + "\r\n";
    same(&read_csv(windows.as_bytes()).expect("the same"), &log);
}

#[test]
fn what_is_no_log_is_refused_with_its_row() {
    let names = FIELDS.map(|field| field.name).join(",");
    for (text, row, says) in [
        ("t,u\n".to_owned(), 1, "a log begins with"),
        ("# furuta log 1\n".into(), 2, "ends before its header"),
        ("# furuta log 1\n# nonsense\n".into(), 2, "neither"),
        (
            "# furuta log 1\nt,u,theta,alpha\n".into(),
            2,
            "the columns of a log",
        ),
        (
            format!("# furuta log 1\n{names}\n1,2\n"),
            3,
            "2 fields, a log has 14",
        ),
        (
            format!("# furuta log 1\n{names}\n0,0,0,x,0,0,0,0,off,0,0,0,0,0\n"),
            3,
            "alpha = `x` is not a number",
        ),
        (
            format!("# furuta log 1\n{names}\n0,0,0,0,0,0,0,0,asleep,0,0,0,0,0\n"),
            3,
            "mode = `asleep`, must be one of off,",
        ),
        (
            format!("# furuta log 1\n{names}\n0,0,0,0,0,0,0,0,off,0,256,0,0,0\n"),
            3,
            "status = `256`",
        ),
    ] {
        let error = read_csv(text.as_bytes()).expect_err(&text);
        assert_eq!(error.row, row, "{error}");
        assert!(error.to_string().contains(says), "{error}");
    }
}
