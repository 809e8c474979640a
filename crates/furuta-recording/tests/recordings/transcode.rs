//! A CSV file comes back from its log byte for byte, while the samples beside it are those that were converted.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use furuta_recording::{Format, Recording, Transcoded, transcode};
use mcap::records::{AttachmentHeader, Metadata, Record};
use mcap::{Compression, WriteOptions};

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path =
            std::env::temp_dir().join(format!("furuta-transcode-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn convert(from: &Path, to: &Path, format: Format) -> Transcoded {
    transcode(from, to, format).unwrap_or_else(|e| panic!("{e}"))
}

fn csv() -> String {
    let mut text = "# bench 2\nalpha,t,u,theta,lamp\n".to_owned();
    for k in 0..2000 {
        let t = 0.004 * f64::from(k);
        let lamp = ["on", "\"off, now\""][k as usize % 2];
        // Modulo a turn, as some encoders count: the log holds what the file holds.
        let alpha = (3.0 + 2.0 * t) % std::f64::consts::TAU;
        text += &format!("{alpha},{t:.4},{:.3},{},{lamp}\n", (3.0 * t).sin(), 0.1 * t);
    }
    text
}

/// Writes a log again, with something done to each sample.
fn rewritten(log: &Path, change: impl Fn(usize, String) -> String) -> Vec<u8> {
    let bytes = std::fs::read(log).unwrap();
    let mut writer = WriteOptions::new()
        .compression(Some(Compression::Lz4))
        .create(std::io::Cursor::new(Vec::new()))
        .unwrap();
    for record in mcap::read::LinearReader::new(&bytes).unwrap() {
        if let Record::Metadata(Metadata { name, metadata }) = record.unwrap() {
            writer.write_metadata(&Metadata { name, metadata }).unwrap();
        }
    }
    let channel = writer
        .add_channel(0, furuta_log::TOPIC, "json", &BTreeMap::new())
        .unwrap();
    for (k, message) in mcap::MessageStream::new(&bytes).unwrap().enumerate() {
        let message = message.unwrap();
        let header = mcap::records::MessageHeader {
            channel_id: channel,
            sequence: message.sequence,
            log_time: message.log_time,
            publish_time: message.publish_time,
        };
        let text = change(k, String::from_utf8(message.data.to_vec()).unwrap());
        writer
            .write_to_known_channel(&header, text.as_bytes())
            .unwrap();
    }
    let mut source = Vec::new();
    assert!(furuta_log::copy_attachment(&bytes[..], "source.csv", &mut source).unwrap());
    let header = AttachmentHeader {
        log_time: 0,
        create_time: 0,
        name: "source.csv".into(),
        media_type: "text/csv".into(),
    };
    writer
        .start_attachment(source.len() as u64, header)
        .unwrap();
    writer.put_attachment_bytes(&source).unwrap();
    writer.finish_attachment().unwrap();
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

#[test]
fn the_file_comes_back_while_its_samples_are_unchanged() {
    let folder = Folder::new("source");
    let [from, log, back] = ["run.csv", "run.mcap", "back.csv"].map(|name| folder.0.join(name));
    std::fs::write(&from, csv()).unwrap();
    let made = convert(&from, &log, Format::Mcap);
    assert_eq!(made.samples, 2000);
    assert_eq!(made.columns, ["t", "u", "theta", "alpha", "lamp"]);
    assert!((made.seconds - 7.996).abs() < 1e-9);
    let [of_csv, of_log] = [&from, &log].map(|path| Recording::load(path).unwrap());
    assert_eq!(
        (&of_log.alpha, &of_log.u, &of_log.extra),
        (&of_csv.alpha, &of_csv.u, &of_csv.extra)
    );
    assert_eq!(of_log.comments, of_csv.comments);

    let same = convert(&log, &back, Format::Csv);
    assert_eq!(std::fs::read_to_string(&back).unwrap(), csv());
    assert_eq!(
        (same.samples, &same.columns, &same.notices.len()),
        (2000, &made.columns, &made.notices.len())
    );

    // The same samples in a log that another program wrote.
    std::fs::write(&log, rewritten(&log, |_, text| text)).unwrap();
    convert(&log, &back, Format::Csv);
    assert_eq!(std::fs::read_to_string(&back).unwrap(), csv());

    // Others: the file beside them is not theirs any more.
    let changed = |k, text: String| match k {
        7 => text.replacen("\"theta\":", "\"theta\":1", 1),
        _ => text,
    };
    std::fs::write(&log, rewritten(&log, changed)).unwrap();
    convert(&log, &back, Format::Csv);
    assert_ne!(std::fs::read_to_string(&back).unwrap(), csv());
    let found = Recording::load(&back).unwrap();
    assert!((found.theta[7] - of_csv.theta[7]).abs() > 0.5);
    assert_eq!(found.u, of_csv.u);
}
