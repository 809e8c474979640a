//! What the loop does for its own books at each sample: a time into a histogram, a record into the ring of the log's
//! writer.

use std::hint::black_box;
use std::io::{self, Seek, SeekFrom, Write};
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use furuta_hw::Recorder;
use furuta_log::{Histogram, LogWriter, Metadata, Record, Timing};

/// Records sent at once: half of what the ring holds.
const BURST: u64 = 4096;
/// In this time the writer has long taken a record out again.
const WRITTEN: Duration = Duration::from_micros(20);

/// A disk that keeps nothing.
struct Nothing(u64);

impl Write for Nothing {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0 += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Nothing {
    fn seek(&mut self, _: SeekFrom) -> io::Result<u64> {
        Ok(self.0)
    }
}

fn books(c: &mut Criterion) {
    let mut h = Histogram::new();
    let mut ns = 1u64;
    c.bench_function("a time into a histogram", |b| {
        b.iter(|| {
            // Any time from 0 to 1 s, so that every bucket is visited.
            ns = ns.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            h.record(black_box(ns >> 34));
        });
    });
    let mut timing = Timing::new(2_000_000);
    c.bench_function("a sample's times", |b| {
        b.iter(|| timing.sample(black_box(3e-6), black_box(20e-6)));
    });
    c.bench_function("a quantile of a histogram", |b| {
        b.iter(|| h.quantile(black_box(0.999)));
    });
    let log = LogWriter::new(Nothing(0), &Metadata::default()).expect("takes anything");
    let (mut sender, _recorder) = Recorder::start(log).expect("a thread");
    // In bursts that find room: a ring that is full refuses, which is another thing, and a loop fills it faster than
    // any log is written.
    let mut ring = c.benchmark_group("log");
    ring.sample_size(10); // long ones: nearly all of the time is spent waiting for the writer
    ring.bench_function("a record into the ring", |b| {
        b.iter_custom(|records| {
            let mut spent = Duration::ZERO;
            let mut left = records;
            while left > 0 {
                let burst = left.min(BURST);
                let begin = Instant::now();
                for _ in 0..burst {
                    sender.send(black_box(Record::default()));
                }
                spent += begin.elapsed();
                std::thread::sleep(WRITTEN * u32::try_from(burst).unwrap_or(u32::MAX));
                left -= burst;
            }
            spent
        });
    });
    ring.finish();
    println!("{} records found the ring full", sender.lost());
}

criterion_group!(benches, books);
criterion_main!(benches);
