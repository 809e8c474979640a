//! Whatever a file holds, reading it takes bounded memory and time, and a mistake is one short line.

use std::collections::BTreeMap;
use std::io::Cursor;

use furuta_recording::{Limits, NoticeKind, Recording, RecordingError};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Compression, WriteOptions};

fn told(error: &RecordingError) -> String {
    let text = error.to_string();
    assert!(text.len() < 1000, "{} bytes", text.len());
    assert!(text.chars().all(furuta_input::is_printable), "{text:?}");
    text
}

fn refused_csv(bytes: &[u8]) -> String {
    told(&Recording::from_csv("run.csv", bytes).expect_err("must be refused"))
}

fn refused_mcap(bytes: &[u8]) -> String {
    told(&Recording::from_mcap("run.mcap", bytes).expect_err("must be refused"))
}

/// A log with these messages, and this metadata.
fn log(messages: &[String], metadata: BTreeMap<String, String>) -> Vec<u8> {
    let mut writer = WriteOptions::new()
        .compression(Some(Compression::Lz4))
        .chunk_size(None)
        .create(Cursor::new(Vec::new()))
        .unwrap();
    writer
        .write_metadata(&Metadata {
            name: "furuta".into(),
            metadata,
        })
        .unwrap();
    let channel_id = writer
        .add_channel(0, furuta_log::TOPIC, "json", &BTreeMap::new())
        .unwrap();
    for message in messages {
        let header = MessageHeader {
            channel_id,
            sequence: 0,
            log_time: 0,
            publish_time: 0,
        };
        writer
            .write_to_known_channel(&header, message.as_bytes())
            .unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

fn sample(further: &str) -> String {
    let record = serde_json::to_string(&furuta_log::Record::default()).unwrap();
    record.strip_suffix('}').unwrap().to_owned() + further + "}"
}

#[test]
fn old_line_ends_are_read() {
    let rows: String = (0..30)
        .map(|k| format!("{},0,0,3.1\r", 0.1 * f64::from(k)))
        .collect();
    let (recording, _) = Recording::from_csv(
        "run.csv",
        format!("# mac\rt,u,theta,alpha\r{rows}").as_bytes(),
    )
    .unwrap();
    assert_eq!(
        (recording.len(), &recording.comments[..]),
        (30, &["mac".to_owned()][..])
    );
}

#[test]
fn a_line_has_an_end_and_a_header_few_columns() {
    let long = "x".repeat(2 << 20);
    let text = refused_csv(format!("t,u,theta,alpha\n0,0,0,{long}\n").as_bytes());
    assert!(
        text.contains("row 2: the line is longer than 1048576 bytes"),
        "{text}"
    );
    let names: String = (0..100_000).map(|k| format!(",c{k}")).collect();
    let text = refused_csv(format!("t,u,theta,alpha{names}\n").as_bytes());
    assert!(
        text.contains("100004 columns or entries; at most 1000"),
        "{text}"
    );
    // Their names are looked through in no time, and few of them are quoted.
    let text = refused_csv(format!("t,u,theta{names}\n").as_bytes());
    assert!(
        text.contains("no column `alpha`") && !text.contains("c50"),
        "{text}"
    );
    let text = refused_csv(b"t,u,theta,alpha\n0,0,0,3\n1,0,0,\0\0\0\n");
    assert!(text.contains("row 3: a zero byte"), "{text}");
}

#[test]
fn what_is_quoted_cannot_reach_a_terminal() {
    let text = refused_csv("t,u,theta,alpha\n0,0,0,\u{1b}]0;mine\u{7}\n".as_bytes());
    assert!(
        text.contains("`\\u{1b}]0;mine\\u{7}` is not a number"),
        "{text}"
    );
    let text = refused_csv(format!("t,u,theta,alpha\n0,0,0,{}\n", "y".repeat(5000)).as_bytes());
    assert!(text.contains(&("y".repeat(80) + "...")), "{text}");
    refused_csv("t,u,theta,\u{1b}[31m\n".as_bytes());
    let text = refused_csv(b"t,u,theta,alpha\n1e300,0,0,3\n0,0,0,3\n1,0,0,3\n");
    assert!(text.contains("from 1e300 s to 0 s"), "{text}");
}

#[test]
fn memory_has_a_limit() {
    let rows: String = (0..1000).map(|k| format!("{k},0,0,3\n")).collect();
    let path = std::env::temp_dir().join(format!("furuta-bounded-{}.csv", std::process::id()));
    std::fs::write(&path, format!("t,u,theta,alpha\n{rows}")).unwrap();
    let within = |limits: &Limits| Recording::salvage_within(&path, limits);
    assert!(within(&Limits::default()).is_ok());
    let few = Limits {
        memory: 30_000,
        ..Limits::default()
    };
    let text = told(&within(&few).unwrap_err());
    assert!(text.contains("more than 30000 bytes of memory"), "{text}");
    let short = Limits {
        file: 1000,
        ..Limits::default()
    };
    let text = told(&within(&short).unwrap_err());
    assert!(
        text.contains("at most 1000 are read of a recording"),
        "{text}"
    );
    std::fs::remove_file(path).unwrap();
}

#[test]
fn three_hundred_thousand_keys_are_too_many() {
    let keys: String = (0..300_000).map(|k| format!(",\"k{k}\":1")).collect();
    let text = refused_mcap(&log(&[sample(&keys)], BTreeMap::new()));
    assert!(text.contains("at most 1000"), "{text}");
    // One in each message.
    let messages: Vec<String> = (0..2000).map(|k| sample(&format!(",\"k{k}\":1"))).collect();
    let text = refused_mcap(&log(&messages, BTreeMap::new()));
    assert!(text.contains("at most 1000"), "{text}");
    let entries = (0..300_000)
        .map(|k| (k.to_string(), String::new()))
        .collect();
    let text = refused_mcap(&log(&[sample("")], entries));
    assert!(text.contains("300000 entries"), "{text}");
}

/// A chunk of a gigabyte of blanks is some megabytes in the file.
#[test]
fn a_chunk_is_unpacked_within_limits() {
    let bomb = log(&[" ".repeat(200 << 20)], BTreeMap::new());
    assert!(bomb.len() < 4 << 20);
    let text = refused_mcap(&bomb);
    assert!(text.contains("at most 67108864 are unpacked"), "{text}");
    // One that says it is small.
    let mut lying = bomb;
    let chunk = lying.windows(3).position(|w| w == b"lz4").unwrap() - 4 - 4 - 8;
    lying[chunk..chunk + 8].copy_from_slice(&1000_u64.to_le_bytes());
    let text = refused_mcap(&lying);
    assert!(
        text.contains("not of the 1000 bytes that it declares"),
        "{text}"
    );
    // A record of four gigabytes, where there are a hundred bytes.
    let mut record = mcap::MAGIC.to_vec();
    record.push(0x05);
    record.extend_from_slice(&(4_u64 << 30).to_le_bytes());
    record.extend_from_slice(&[0; 100]);
    refused_mcap(&record);
}

#[test]
fn many_notes_of_one_kind_are_one() {
    let mut text = "t,u,theta,alpha\n".to_owned();
    let mut t = 0.0;
    for k in 0..4000 {
        t += if k % 60 == 0 || k % 60 == 3 {
            0.05
        } else {
            0.002
        };
        text += &format!(
            "{t},{},{},{}\n",
            (0.1 * f64::from(k)).sin(),
            0.001 * f64::from(k),
            3.1
        );
    }
    let (_, notices) =
        Recording::from_csv("run.csv", text.as_bytes()).unwrap_or_else(|e| panic!("{e}"));
    let mut kinds: Vec<_> = notices
        .iter()
        .map(|n| core::mem::discriminant(&n.kind))
        .collect();
    let all = kinds.len();
    kinds.dedup();
    assert_eq!(kinds.len(), all, "{notices:?}");
    assert!(
        notices
            .iter()
            .any(|n| matches!(&n.kind, NoticeKind::Gaps { rows } if rows.len() > 100))
    );
    assert!(all < 8, "{notices:?}");
}
