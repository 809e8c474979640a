//! Recordings through the built binary: what is sound is converted without loss, what is not gives one clear line and
//! exit code 1.

use crate::common;

use std::path::Path;
use std::process::Output;

use common::{Folder, failure, furuta, swing};

fn convert(input: &Path, output: &Path, more: &[&str]) -> Output {
    furuta(&["convert"])
        .args([input, output])
        .args(more)
        .output()
        .expect("the binary runs")
}

#[test]
fn there_and_back_gives_the_same_file() {
    let folder = Folder::new("recordings-there-and-back");
    let csv = folder.file("run.csv", swing());
    let [mcap, again, first] = ["run.mcap", "again.csv", "first.csv"].map(|name| folder.path(name));
    let output = convert(&csv, &mcap, &[]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(
        text.contains("2000 samples, 7.996 s, columns t, u, theta, alpha, current, lamp"),
        "{text}"
    );
    assert!(convert(&mcap, &again, &[]).status.success());
    let read = |path: &Path| std::fs::read_to_string(path).expect("written");
    assert_eq!(read(&again), read(&csv), "every byte, whoever wrote it");
    // Through our own writer, the order of the columns is the usual one.
    assert!(convert(&csv, &first, &[]).status.success());
    assert!(read(&first).starts_with("# bench 2\nt,u,theta,alpha,current,lamp\n"));
}

/// A run's log: every bit of every sample, and all that it says of its run.
#[test]
fn a_run_is_converted_there_and_back_bit_for_bit() {
    let folder = Folder::new("recordings-run");
    let [log, csv, back, csv_again] =
        ["run.mcap", "run.csv", "back.mcap", "again.csv"].map(|name| folder.path(name));
    let run = furuta(&["run", "--emulated", "shahzad2022-srv02", "--duration", "3"])
        .arg("--log")
        .arg(&log)
        .output()
        .expect("runs");
    assert!(run.status.success(), "{run:?}");
    for (from, to) in [(&log, &csv), (&csv, &back), (&back, &csv_again)] {
        let output = convert(from, to, &[]);
        assert!(output.status.success(), "{output:?}");
    }
    let bytes = |path: &Path| std::fs::read(path).expect("written");
    assert_eq!(bytes(&csv), bytes(&csv_again));
    let [first, second] = [&log, &back].map(|path| furuta_log::read(path).expect("a log"));
    assert!(first.records.len() > 1400);
    assert_eq!(second, first);
    // It can be replayed; and the CSV is a recording like any other.
    let replayed = furuta(&["replay"]).arg(&back).output().expect("runs");
    assert!(replayed.status.success(), "{replayed:?}");
    let recording = furuta_ident::recording::Recording::load(&csv).expect("a recording");
    assert_eq!(recording.len(), first.records.len());
    assert!(
        recording
            .rig
            .is_some_and(|rig| rig.contains("shahzad2022-srv02"))
    );

    // A row that an editor has spoilt is named.
    let text = String::from_utf8(bytes(&csv)).expect("text");
    let spoilt = folder.file("spoilt.csv", text.replacen(",swing-up,", ",sleep,", 1));
    let line = failure(&convert(&spoilt, &back, &["--force"]));
    assert!(
        line.contains("spoilt.csv: row ") && line.contains("`sleep`"),
        "{line}"
    );
}

#[test]
fn json_and_notices() {
    let folder = Folder::new("recordings-json");
    let text = swing();
    let lines: Vec<&str> = text.lines().collect();
    let gap = [&lines[..500], &lines[600..]].concat().join("\n");
    let input = folder.file("gap.csv", gap);
    let output = convert(&input, &folder.path("out.mcap"), &["--json"]);
    assert!(output.status.success());
    let answer: serde_json::Value =
        serde_json::from_slice(&output.stdout).expect("JSON on standard output");
    assert_eq!(answer["samples"], 1900);
    assert_eq!(answer["columns"][3], "alpha");
    assert!(
        answer["notices"][0]
            .as_str()
            .is_some_and(|notice| notice.contains("gap before row 501")),
        "{answer}"
    );
}

#[test]
fn bad_recordings_give_one_clear_line() {
    let folder = Folder::new("recordings-bad");
    let out = folder.path("out.mcap");
    let rows = |last: &str| format!("t,u,theta,alpha\n0,0,0,3.1\n0.1,0,0,3.1\n{last}\n");
    for (name, content, says) in [
        (
            "no-alpha.csv",
            "t,u,theta\n0,0,0\n".to_owned(),
            ["no column `alpha`", "found t, u, theta"],
        ),
        (
            "nan.csv",
            rows("0.2,0,0,NaN"),
            ["row 4, column alpha", "NaN"],
        ),
        (
            "backwards.csv",
            rows("0.05,0,0,3.1"),
            [
                "row 4, column t",
                "time goes backwards, from 0.1 s to 0.05 s",
            ],
        ),
        (
            "empty.csv",
            String::new(),
            ["the file is empty", "t,u,theta,alpha"],
        ),
        ("empty.mcap", String::new(), ["the file is empty", ""]),
        (
            "letter.mcap",
            "Dear Sir or Madam".to_owned(),
            ["not an MCAP file", "furuta run"],
        ),
    ] {
        let message = failure(&convert(&folder.file(name, content), &out, &[]));
        for piece in [name].iter().chain(&says) {
            assert!(message.contains(piece), "{name}: {message}");
        }
        assert!(!out.exists(), "{name}: nothing is written");
    }
    assert!(failure(&convert(&folder.path("absent.csv"), &out, &[])).contains("absent.csv"));
    let sound = folder.file("run.csv", swing());
    assert!(
        failure(&convert(&sound, &folder.path("run.xls"), &[])).contains("ends in .csv or .mcap")
    );
    assert!(failure(&convert(&sound, &sound, &[])).contains("is an input of this command (IN)"));
    assert!(
        failure(&convert(
            &sound,
            &folder.path("no-such-folder/run.csv"),
            &[]
        ))
        .contains("no-such-folder")
    );
}

/// Special files would hang or fill the memory; what a file holds may not steer the terminal.
#[test]
fn what_is_no_recording_is_named() {
    let folder = Folder::new("recordings-special");
    let out = folder.path("out.mcap");
    let said = |input: &Path| failure(&convert(input, &out, &[]));
    let pipe = folder.path("pipe.csv");
    assert!(
        std::process::Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .expect("runs")
            .success()
    );
    assert!(said(&pipe).contains("pipe.csv is a pipe (FIFO), not a recording"));
    let inner = folder.path("folder.csv");
    std::fs::create_dir(&inner).expect("a folder");
    assert!(said(&inner).contains("folder.csv is a directory, not a recording"));
    let zeros = folder.file("zeros.mcap", [0; 5000]);
    assert!(said(&zeros).contains("zeros.mcap is a file of zero bytes, not a recording"));
    let rows = "t,u,theta,alpha\n0,0,0,\u{1b}]0;mine\u{7}\n";
    let line = said(&folder.file("\u{1b}[31m.csv", rows));
    assert!(line.contains("`\\u{1b}]0;mine\\u{7}`"), "{line}");
    assert!(!line.contains('\u{1b}'), "{line:?}");
    let rig = ["simulate", "--rig"];
    let output = furuta(&rig).arg(&inner).output().expect("runs");
    assert!(failure(&output).contains("is a directory, not a rig file"));
    assert!(!out.exists());
}

/// What a killed run had logged is kept, and the failure says so.
#[test]
fn of_a_truncated_log_the_rest_is_kept() {
    let folder = Folder::new("recordings-truncated");
    let whole = folder.path("whole.mcap");
    assert!(
        convert(&folder.file("run.csv", swing()), &whole, &[])
            .status
            .success()
    );
    let bytes = std::fs::read(&whole).expect("written");
    let cut = folder.file("cut.mcap", &bytes[..bytes.len() / 2]);
    let saved = folder.path("saved.csv");
    let message = failure(&convert(&cut, &saved, &[]));
    assert!(
        message.contains("cut.mcap: log was cut off") && message.contains("saved.csv"),
        "{message}"
    );
    let rows = std::fs::read_to_string(&saved)
        .expect("what was read")
        .lines()
        .count();
    assert!(rows > 500, "{rows} rows");
    // Cut before its first sample.
    let stub = folder.file("stub.mcap", &bytes[..100]);
    assert!(failure(&convert(&stub, &folder.path("none.csv"), &[])).contains("record it again"));
}
