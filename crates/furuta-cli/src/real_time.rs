//! What a loop asks of the system, and how punctual it was: arguments and tables that `run` and `latency` share.

use furuta_hw::RealTime;
use furuta_log::{Histogram, Quantiles, Timing};

/// What the loop asks of the system.
#[derive(clap::Args, Copy, Clone, Debug)]
pub(crate) struct RealTimeArgs {
    /// Run the loop under SCHED_FIFO with this priority, 1 to 99, its memory locked and processors kept from deep
    /// sleep. What the system refuses is said, and the loop runs without it (docs/realtime.md).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=99))]
    priority: Option<u8>,
    /// Keep the loop on this processor.
    #[arg(long, value_name = "CPU")]
    cpu: Option<usize>,
}

impl RealTimeArgs {
    pub(crate) fn asked(self) -> RealTime {
        RealTime {
            priority: self.priority,
            cpu: self.cpu,
        }
    }
}

/// First and last doubling of the histogram in a line: 0.5 us to 33 ms.
const FIRST_BIT: u32 = 9;
const LAST_BIT: u32 = 24;

/// A histogram in a line, one character a doubling of the time, its height the logarithm of the count.
pub(crate) fn sparkline(h: &Histogram) -> String {
    const HEIGHTS: [char; 9] = [' ', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let mut counts = [0u64; (LAST_BIT - FIRST_BIT + 1) as usize];
    for bucket in h.buckets() {
        let bit = bucket.lowest.max(1).ilog2().clamp(FIRST_BIT, LAST_BIT);
        if let Some(count) = counts.get_mut((bit - FIRST_BIT) as usize) {
            *count += bucket.count;
        }
    }
    let log = |n: u64| (1.0 + n as f64).ln();
    let highest = log(counts.iter().copied().max().unwrap_or(0)).max(1e-9);
    let line = counts.map(|count| {
        let height = (log(count) / highest * 8.0).ceil() as usize;
        HEIGHTS.get(height).copied().unwrap_or('█')
    });
    line.iter().collect::<String>()
}

/// Rows of a table of times: name, histogram.
pub(crate) fn table(rows: &[(&str, &Histogram)]) -> String {
    let us = |s: Option<f64>| s.map_or_else(|| "-".to_owned(), |s| format!("{:.1}", 1e6 * s));
    let mut lines = vec![format!(
        "{:<12}{:>9}{:>9}{:>9}{:>10}   0.5 us to 32 ms, by doublings",
        "times [us]", "p50", "p99", "p99.9", "max"
    )];
    for (name, h) in rows {
        let q = Quantiles::of(h);
        let line = format!(
            "{name:<12}{:>9}{:>9}{:>9}{:>10}   {}",
            us(q.p50),
            us(q.p99),
            us(q.p99_9),
            us(q.max),
            sparkline(h)
        );
        lines.push(line.trim_end().to_owned());
    }
    lines.join("\n")
}

/// The table of a run's times.
pub(crate) fn times(timing: &Timing) -> String {
    let rows = timing.parts().map(|(name, h)| match name {
        "wake_up" => ("wake-up", h),
        "round_trip" => ("round trip", h),
        other => (other, h),
    });
    format!(
        "{}\n{} of {} samples answered later than a period ({:.0} us)",
        table(&rows),
        timing.overruns,
        timing.total.count(),
        timing.period as f64 / 1e3
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_histogram_in_a_line() {
        let mut h = Histogram::new();
        assert_eq!(sparkline(&h).trim(), "");
        for _ in 0..1000 {
            h.record(3_000);
        }
        h.record(1_000_000_000);
        let line: Vec<char> = sparkline(&h).chars().collect();
        assert_eq!(line.len(), 16);
        // 3 us lie in the doubling from 2.048 us, the third; what is longer than all in the last.
        assert_eq!((line[2], line[15]), ('█', '▁'));
        assert!(table(&[("x", &h)]).contains("3.0"));
    }
}
