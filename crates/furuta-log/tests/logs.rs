//! Logs written, cut, damaged and read back.

use std::io::{self, Cursor, Seek, SeekFrom, Write};

use furuta_log::{
    FIELDS, LogError, LogWriter, Metadata, Mode, Notice, Record, TOPIC, read, read_from,
};
use proptest::prelude::*;

const PERIOD: f64 = 0.002;

fn metadata() -> Metadata {
    Metadata {
        rig: "qube-servo-2".into(),
        rig_file: "[rig]\nname = \"qube-servo-2\"\n".into(),
        controller: "lqr".into(),
        software: "test".into(),
        extra: [("note".to_owned(), "windy".to_owned())].into(),
    }
}

fn record(k: u32) -> Record {
    let t = f64::from(k) * PERIOD;
    Record {
        t,
        u: (3.0 * t).sin(),
        theta: 0.1 * t,
        alpha: std::f64::consts::PI + (7.0 * t).cos() / 3.0,
        theta_dot: 0.1,
        alpha_dot: -1.0 / 3.0,
        reference: 0.2,
        command: (3.0 * t + 0.006).sin(),
        mode: if k < 200 {
            Mode::SwingUp
        } else {
            Mode::Balance
        },
        seq: k + 4_000_000_000,
        status: (k % 3) as u8,
        lost: k % 2,
        delay: 1e-4,
        compute: 2e-5,
    }
}

fn log(samples: u32) -> Vec<u8> {
    let mut log = LogWriter::new(Cursor::new(Vec::new()), &metadata()).expect("memory");
    for k in 0..samples {
        log.write(&record(k)).expect("memory");
    }
    assert_eq!(log.written(), u64::from(samples));
    log.finish().expect("memory").into_inner()
}

#[test]
fn read_back_bit_for_bit() {
    let log = read_from(&log(1000)[..]).expect("own log");
    assert_eq!(log.metadata, Some(metadata()));
    assert_eq!(log.records, (0..1000).map(record).collect::<Vec<_>>());
    assert_eq!(log.notice, None);
}

#[test]
fn nan_survives() {
    let mut writer = LogWriter::new(Cursor::new(Vec::new()), &metadata()).expect("memory");
    writer
        .write(&Record {
            theta_dot: f64::NAN,
            ..record(0)
        })
        .expect("memory");
    let log = read_from(&writer.finish().expect("memory").into_inner()[..]).expect("own log");
    assert!(log.records[0].theta_dot.is_nan());
}

/// What a viewer sees: the crate's own reader of summaries and messages, not ours.
#[test]
fn indexed_and_described_for_viewers() {
    let bytes = log(1000);
    let summary = mcap::Summary::read(&bytes)
        .expect("valid")
        .expect("has a summary");
    let stats = summary.stats.expect("statistics");
    assert_eq!(
        (
            stats.message_count,
            stats.channel_count,
            stats.metadata_count
        ),
        (1000, 1, 1)
    );
    assert!(stats.message_end_time - stats.message_start_time == 1_998_000_000);
    // 2 s of data in chunks of 0.1 s.
    assert!(
        (19..=22).contains(&summary.chunk_indexes.len()),
        "{} chunks",
        summary.chunk_indexes.len()
    );
    let message = mcap::MessageStream::new(&bytes)
        .expect("valid")
        .next()
        .expect("a message")
        .expect("valid");
    assert_eq!(
        (
            message.channel.topic.as_str(),
            message.channel.message_encoding.as_str()
        ),
        (TOPIC, "json")
    );
    let schema = message.channel.schema.as_ref().expect("a schema");
    assert_eq!(schema.encoding, "jsonschema");
    let schema: serde_json::Value = serde_json::from_slice(&schema.data).expect("JSON");
    let value: serde_json::Value = serde_json::from_slice(&message.data).expect("JSON");
    for field in FIELDS {
        assert_eq!(schema["properties"][field.name]["type"], field.kind);
        assert!(value.get(field.name).is_some());
    }
}

/// Cut anywhere: every record of every whole chunk is there, nothing else, and the cut is told.
#[test]
fn cut_at_every_byte() {
    let bytes = log(150);
    let whole: Vec<_> = (0..150).map(record).collect();
    let mut counts = Vec::new();
    for len in 1..bytes.len() {
        let log = read_from(&bytes[..len]).unwrap_or_else(|e| panic!("cut at {len}: {e}"));
        assert_eq!(log.records, whole[..log.records.len()]);
        assert!(
            log.notice.is_some(),
            "cut at {len} of {} not told",
            bytes.len()
        );
        if !counts.contains(&log.records.len()) {
            counts.push(log.records.len());
        }
    }
    // Three chunks of 0.1 s (50 samples at 2 ms).
    assert_eq!(counts, [0, 50, 100, 150]);
}

#[test]
fn a_killed_run_keeps_all_but_the_last_tenth_of_a_second() {
    // Keeps what a process has handed to the system when it is killed: the log is never finished or dropped.
    let mut disk = Cursor::new(Vec::new());
    let mut writer = LogWriter::new(&mut disk, &metadata()).expect("memory");
    for k in 0..1020 {
        writer.write(&record(k)).expect("memory");
    }
    std::mem::forget(writer);
    let log = read_from(&disk.get_ref()[..]).expect("own log");
    let until = log.records.last().expect("records").t;
    assert!(2.038 - until <= 0.1 + PERIOD, "only up to {until} s");
    match log.notice {
        Some(Notice::Truncated {
            records,
            until: Some(t),
        }) => assert_eq!((records, t), (log.records.len(), until)),
        other => panic!("{other:?}"),
    }
}

proptest! {
    /// Damage anywhere: never a panic, never a record that was not written.
    #[test]
    fn damaged_bytes(hits in prop::collection::vec((any::<prop::sample::Index>(), 1_u8..), 1..4),
        cut in any::<prop::sample::Index>()) {
        let mut bytes = log(150);
        for (index, xor) in hits {
            let i = index.index(bytes.len());
            bytes[i] ^= xor;
        }
        bytes.truncate(cut.index(bytes.len()) + 1);
        if let Ok(log) = read_from(&bytes[..]) {
            for r in &log.records {
                prop_assert!((0..150).map(record).any(|w| w == *r), "{r:?}");
            }
        }
    }

    #[test]
    fn garbage_behind_the_magic(garbage in prop::collection::vec(any::<u8>(), 0..2000)) {
        let mut bytes = mcap::MAGIC.to_vec();
        bytes.extend(garbage);
        if let Ok(log) = read_from(&bytes[..]) {
            prop_assert!(log.records.is_empty());
        }
    }
}

#[test]
fn what_is_no_log_is_named() {
    assert!(matches!(read_from(&[][..]), Err(LogError::Empty)));
    assert!(matches!(
        read_from(&b"t,u,theta,alpha\n"[..]),
        Err(LogError::NotMcap { .. })
    ));
    assert!(matches!(
        read("no/such/log.mcap"),
        Err(LogError::Open { .. })
    ));
    let mut other = mcap::Writer::new(Cursor::new(Vec::new())).expect("memory");
    let channel = other
        .add_channel(0, "/camera", "json", &Default::default())
        .expect("memory");
    let header = mcap::records::MessageHeader {
        channel_id: channel,
        sequence: 0,
        log_time: 0,
        publish_time: 0,
    };
    other
        .write_to_known_channel(&header, b"{}")
        .expect("memory");
    other.finish().expect("memory");
    match read_from(&other.into_inner().into_inner()[..]) {
        Err(LogError::NoTopic { found }) => assert_eq!(found, ["/camera"]),
        other => panic!("{other:?}"),
    }
}

/// A disk that takes `capacity` bytes.
struct SmallDisk {
    bytes: Cursor<Vec<u8>>,
    capacity: usize,
}

impl Write for SmallDisk {
    fn write(&mut self, buf: &[u8]) -> io::Result<usize> {
        if self.bytes.get_ref().len() + buf.len() > self.capacity {
            return Err(io::Error::from(io::ErrorKind::StorageFull));
        }
        self.bytes.write(buf)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for SmallDisk {
    fn seek(&mut self, pos: SeekFrom) -> io::Result<u64> {
        self.bytes.seek(pos)
    }
}

#[test]
fn a_full_disk_is_an_error_not_a_panic() {
    let disk = SmallDisk {
        bytes: Cursor::new(Vec::new()),
        capacity: 12_000,
    };
    let mut writer = LogWriter::new(disk, &metadata()).expect("room for the metadata");
    let error = (0..5000)
        .map(record)
        .find_map(|r| writer.write(&r).err())
        .expect("the disk is full");
    assert!(matches!(error, LogError::Write(_)), "{error}");
    assert!(
        writer.write(&record(0)).is_err(),
        "no writing after a failure"
    );
    assert!(writer.finish().is_err());
}
