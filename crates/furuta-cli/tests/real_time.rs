//! `furuta run --priority` and `furuta latency`: what was granted is said, whatever it is; and how punctual the loop
//! was.

use crate::common;

use common::{Folder, failure, furuta, json};

/// Privileged or not: each measure is granted or has a reason, in the report and in the log.
#[test]
fn a_run_says_what_was_granted_and_how_late_it_was() {
    let folder = Folder::new("real-time-run");
    let path = folder.path("run.mcap");
    let report = json(&[
        "run",
        "--emulated",
        "shahzad2022-srv02",
        "--duration",
        "1.5",
        "--priority",
        "10",
        "--cpu",
        "4000",
        "--json",
        "--log",
        path.to_str().expect("a name in Unicode"),
    ]);
    let measures = report["real_time"]["measures"].as_array().expect("a list");
    let names: Vec<_> = measures.iter().map(|m| m["what"].as_str()).collect();
    assert_eq!(
        names,
        [
            Some("processor"),
            Some("memory"),
            Some("sleep"),
            Some("scheduling")
        ]
    );
    assert!(measures[0]["refused"].is_string(), "no such processor");
    let log = furuta_log::read(&path).expect("a log");
    for measure in measures {
        let said = &log.real_time[measure["what"].as_str().expect("a name")];
        let granted = measure["refused"].is_null();
        assert_eq!(said.starts_with("granted: "), granted, "{said} {measure}");
    }
    let timing = log.timing.expect("in the log");
    assert_eq!(timing.total.count(), log.records.len() as u64);
    // The histograms are those of the samples' own times.
    let longest = log
        .records
        .iter()
        .fold(0.0_f64, |max, r| max.max(r.compute));
    let told = timing.compute.max().expect("samples") as f64 / 1e9;
    assert!((told - longest).abs() < 1e-9, "{told} {longest}");
    assert_eq!(report["timing"]["compute"]["max"].as_f64(), Some(told));
    // Asked once in 0.1 s, which is not at every sample; on a machine that does other work, a run of 1.5 s takes
    // longer.
    let (trips, samples) = (timing.round_trip.count(), timing.total.count());
    assert!(trips >= 5 && 10 * trips <= samples, "{trips} of {samples}");
}

#[test]
fn latency_is_measured_with_and_without_cyclictest() {
    let seconds = ["latency", "--seconds", "0.4", "--rate", "250", "--json"];
    let report = json(&seconds);
    assert_eq!(report["wake_up"]["late"]["count"], 100);
    // Where it is installed: the same number of loops.
    if !report["cyclictest"].is_null() {
        assert_eq!(report["cyclictest"]["late"]["count"], 100, "{report}");
        assert!(
            report["cyclictest"]["ratio"]["p50"]
                .as_f64()
                .is_some_and(|r| r > 0.0)
        );
    } else {
        eprintln!("cyclictest is not installed: nothing compared");
    }
    let folder = Folder::new("latency");
    let plot = folder.path("late.svg");
    // Nothing on the path: not installed.
    let without = furuta(&[
        "latency",
        "--seconds",
        "0.1",
        "--emulated",
        "qube-servo-2",
        "--plot",
    ])
    .arg(&plot)
    .env("PATH", "")
    .output()
    .expect("the binary runs");
    let text = String::from_utf8_lossy(&without.stdout).into_owned();
    assert!(without.status.success(), "{without:?}");
    assert!(
        text.contains("apt install rt-tests") && text.contains("round trip"),
        "{text}"
    );
    assert!(
        std::fs::read_to_string(&plot)
            .expect("drawn")
            .starts_with("<svg")
    );
}

#[test]
fn what_latency_cannot_do_is_one_line() {
    let output = furuta(&["latency", "--seconds", "0.1", "--port", "/dev/no-such-port"])
        .output()
        .expect("the binary runs");
    assert!(failure(&output).contains("does not exist"));
}
