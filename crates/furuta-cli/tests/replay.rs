//! `furuta replay` as a user starts it, on a run of the emulated rig.

use crate::common;

use std::path::Path;
use std::process::Output;

use common::{Folder, failure, furuta};
use serde_json::Value;

fn replay(log: &Path, more: &[&str]) -> Output {
    furuta(&["replay"])
        .arg(log)
        .args(more)
        .output()
        .expect("the binary runs")
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {output:?}"))
}

#[test]
fn a_run_is_replayed_and_what_was_changed_is_named() {
    let folder = Folder::new("replay");
    let log = folder.path("run.mcap");
    let sliding = folder.file("sliding.toml", "[controller]\nkind = \"lqr_sliding\"\n");
    let run = furuta(&["run", "--emulated", "shahzad2022-srv02", "--duration", "3"])
        .arg("--log")
        .arg(&log)
        .output()
        .expect("runs");
    assert!(run.status.success(), "{run:?}");

    let output = replay(&log, &[]);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    let n = furuta_log::read(&log).expect("a log").records.len();
    assert_eq!(
        text.trim_end(),
        format!(
            "{n} of {n} commands equal, bit for bit, and so are modes, estimates and references"
        )
    );

    // Another controller: a question, so no failure.
    let csv = folder.path("other.csv");
    let csv_name = csv.to_string_lossy();
    let sliding = sliding.to_string_lossy();
    let output = replay(
        &log,
        &["--controller", &sliding, "--csv", &csv_name, "--json"],
    );
    assert!(output.status.success(), "{output:?}");
    let answer = json(&output);
    assert_eq!(
        (
            &answer["same_pilot"],
            &answer["identical"],
            &answer["replayed"]
        ),
        (&Value::from(false), &Value::from(false), &Value::from(n))
    );
    assert!(answer["largest"]["value"].as_f64().is_some_and(|v| v > 0.0));
    let rows = std::fs::read_to_string(&csv).expect("written");
    assert_eq!(rows.lines().count(), n + 1);
    assert!(rows.starts_with("t,u,theta,alpha,") && rows.contains("replayed_command"));

    // One bit of one command.
    let mut changed = furuta_log::read(&log).expect("a log");
    let record = &mut changed.records[700];
    record.command = f64::from_bits(record.command.to_bits() ^ 1);
    let file = std::fs::File::create(folder.path("changed.mcap")).expect("a file");
    changed.write_to(file).expect("written");
    let line = failure(&replay(&folder.path("changed.mcap"), &[]));
    for part in ["changed.mcap", "sample 700", "command", "1 ULP apart"] {
        assert!(line.contains(part), "{line}");
    }
    let output = replay(&folder.path("changed.mcap"), &["--json"]);
    assert_eq!(output.status.code(), Some(1));
    let first = &json(&output)["first"];
    assert_eq!(
        (&first["index"], &first["quantities"][0]["ulps"]),
        (&Value::from(700), &Value::from(1))
    );

    // What cannot be is one line.
    let line = failure(&replay(&log, &["--rig", "fong2014-emecs"]));
    assert!(
        line.contains("of another rig") && line.contains("--any-rig"),
        "{line}"
    );
    let converted = folder.path("converted.mcap");
    let made = furuta(&["convert"])
        .args([&folder.file("run.csv", common::swing()), &converted])
        .output()
        .expect("runs");
    assert!(made.status.success(), "{made:?}");
    let line = failure(&replay(&converted, &[]));
    assert!(line.contains("no log of `furuta run`"), "{line}");
    let csv = folder.file("letter.mcap", "Dear Sir or Madam");
    assert!(failure(&replay(&csv, &[])).contains("not an MCAP file"));
    assert!(failure(&replay(&folder.path("none.mcap"), &[])).contains("none.mcap"));
}
