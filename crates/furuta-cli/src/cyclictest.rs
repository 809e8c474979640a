//! cyclictest of the rt-tests: the yardstick for wake-up jitter on Linux. Run as a program of its own, read by its
//! JSON.

use std::collections::BTreeMap;
use std::process::Command;
use std::time::Duration;

use furuta_hw::{Granted, RealTime};
use furuta_log::Histogram;
use serde::Deserialize;

use crate::failure::Failure;

/// Longest latency that its histogram holds (us); longer ones are counted in `cycles` and the longest is in `max`.
const LONGEST_US: u32 = 20_000;

/// What is said where it is not installed.
pub(crate) const MISSING: &str =
    "cyclictest is not installed: nothing to compare with (Debian, Ubuntu: apt install rt-tests)";

/// What one run of cyclictest says.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Report {
    /// Its version.
    pub(crate) version: String,
    /// Latencies (ns), to the microsecond below, as cyclictest counts.
    pub(crate) late: Histogram,
}

/// Its JSON, as far as it is needed; the colons in two of its keys are its own.
#[derive(Deserialize)]
struct Output {
    #[serde(rename = "rt_test_version:", alias = "rt_test_version")]
    version: String,
    thread: BTreeMap<String, Thread>,
}

#[derive(Deserialize)]
struct Thread {
    histogram: BTreeMap<u64, u64>,
    cycles: u64,
    max: u64,
}

impl Report {
    /// Reads what `cyclictest --json` writes.
    pub(crate) fn parse(json: &str) -> Result<Self, Failure> {
        let unread =
            |what: String| Failure::new(format!("cyclictest's report cannot be read: {what}"));
        let output: Output =
            serde_json::from_str(json).map_err(|error| unread(error.to_string()))?;
        let mut late = Histogram::new();
        for thread in output.thread.values() {
            let counted: u64 = thread.histogram.values().sum();
            let beyond = thread.cycles.checked_sub(counted).ok_or_else(|| {
                unread(format!("{counted} latencies in {} cycles", thread.cycles))
            })?;
            for (&us, &count) in &thread.histogram {
                late.record_times(us.saturating_mul(1000), count);
            }
            // Of those beyond its histogram only the longest is known.
            late.record_times(thread.max.saturating_mul(1000), beyond);
        }
        Ok(Self {
            version: output.version,
            late,
        })
    }
}

/// Its arguments, on the terms that our own loop has been granted.
pub(crate) fn arguments(
    interval: Duration,
    loops: u64,
    asked: RealTime,
    granted: &Granted,
) -> Vec<String> {
    let mut arguments = vec![
        "--quiet".to_owned(),
        format!("--interval={}", interval.as_micros()),
        format!("--loops={loops}"),
        format!("--histogram={LONGEST_US}"),
    ];
    match asked.priority.filter(|_| granted.has("scheduling")) {
        Some(priority) => {
            arguments.extend(["--policy=fifo".to_owned(), format!("--priority={priority}")]);
        }
        None => arguments.push("--policy=other".to_owned()),
    }
    if let Some(cpu) = asked.cpu.filter(|_| granted.has("processor")) {
        arguments.push(format!("--affinity={cpu}"));
    }
    if granted.has("memory") {
        arguments.push("--mlockall".to_owned());
    }
    if !granted.has("sleep") {
        arguments.push("--default-system".to_owned());
    }
    arguments
}

/// Runs it; `None` where it is not installed.
pub(crate) fn run(arguments: &[String]) -> Result<Option<Report>, Failure> {
    let path = std::env::temp_dir().join(format!("furuta-cyclictest-{}.json", std::process::id()));
    let done = Command::new("cyclictest")
        .args(arguments)
        .arg(format!("--json={}", path.display()))
        .output();
    let done = match done {
        Ok(done) => done,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => {
            return Err(Failure::new(format!(
                "cyclictest cannot be started: {error}"
            )));
        }
    };
    let json = std::fs::read_to_string(&path);
    let _ = std::fs::remove_file(&path);
    if !done.status.success() {
        let said = String::from_utf8_lossy(&done.stderr);
        return Err(Failure::new(format!(
            "cyclictest {} failed: {}",
            arguments.join(" "),
            said.trim().lines().last().unwrap_or("without a word")
        )));
    }
    Report::parse(&json?).map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Written by cyclictest 2.40 with the command line in it (the host's name taken out); one latency was beyond the
    /// histogram.
    const REAL: &str = include_str!("../tests/data/cyclictest.json");

    #[test]
    fn its_own_output_is_read() {
        let report = Report::parse(REAL)
            .map_err(|e| e.to_string())
            .expect("its own");
        assert_eq!(report.version, "2.40");
        let output: serde_json::Value = serde_json::from_str(REAL).expect("JSON");
        let thread = &output["thread"]["0"];
        assert_eq!(
            report.late.count(),
            thread["cycles"].as_u64().expect("a number")
        );
        let us = |ns: Option<u64>| ns.map(|ns| ns / 1000);
        assert_eq!(us(report.late.min()), thread["min"].as_u64());
        assert_eq!(us(report.late.max()), thread["max"].as_u64());
        // Its mean knows the latencies beyond the histogram, ours only the longest: here the same.
        let mean = report.late.mean().expect("not empty") / 1000.0;
        assert!(
            (mean - thread["avg"].as_f64().expect("a number")).abs() < 0.01,
            "{mean}"
        );
    }

    #[test]
    fn what_is_not_its_output_is_named() {
        for bad in [
            "",
            "{}",
            "{\"rt_test_version:\": \"2\", \"thread\": {\"0\": {\"histogram\": {\"3\": 2}, \"cycles\": 1, \
             \"max\": 3}}}",
        ] {
            let error = Report::parse(bad).expect_err(bad).to_string();
            assert!(
                error.starts_with("cyclictest's report cannot be read"),
                "{error}"
            );
        }
    }

    #[test]
    fn it_gets_what_our_loop_got() {
        let asked = RealTime {
            priority: Some(80),
            cpu: Some(1),
        };
        let refused = arguments(Duration::from_millis(2), 10, asked, &Granted::default());
        assert_eq!(
            refused,
            [
                "--quiet",
                "--interval=2000",
                "--loops=10",
                "--histogram=20000",
                "--policy=other",
                "--default-system"
            ]
        );
        let measure = |what| furuta_hw::Measure {
            what,
            asked: String::new(),
            refused: None,
        };
        let all = Granted {
            measures: ["scheduling", "memory", "sleep", "processor"]
                .map(measure)
                .to_vec(),
            preempt_rt: false,
        };
        let given = arguments(Duration::from_millis(2), 10, asked, &all);
        for argument in [
            "--policy=fifo",
            "--priority=80",
            "--affinity=1",
            "--mlockall",
        ] {
            assert!(given.iter().any(|a| a == argument), "{given:?}");
        }
        assert!(!given.iter().any(|a| a == "--default-system"));
    }
}
