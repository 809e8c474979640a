//! A minute of the loop, log included: it allocates nothing, never waits, and does not notice what becomes of its log.

use crate::common;

use std::io::{self, Cursor, Seek, SeekFrom, Write};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use common::{TempLog, connect, emulated, pilot, settings, start};
use furuta_hw::{
    EmulatedTransport, Emulation, End, Link, LoopSettings, Pace, Recorder, Summary, run,
};
use furuta_log::{LogError, LogWriter, Metadata, Mode};

/// A minute at 500 Hz, both ends included.
const SECONDS: f64 = 60.0;
const SAMPLES: u64 = 30_001;

/// As `furuta run` has it: with the query that times the line.
fn timed(seconds: f64) -> LoopSettings<'static> {
    LoopSettings {
        probe: Some(LoopSettings::PROBE),
        ..settings(seconds)
    }
}

/// A rig without a port: nothing in the loop waits, so that whoever does is the loop.
fn without_a_port() -> (Link<EmulatedTransport>, furuta_wire::Hello) {
    let transport = EmulatedTransport::new(emulated());
    Link::connect(transport, Duration::from_secs(1)).expect("it answers")
}

/// What a minute's run does to the allocator of its thread, on the way to a log that `disk` keeps.
fn a_minute(disk: impl Write + Seek + Send + 'static) -> (Summary, Recorder) {
    let (mut link, hello) = without_a_port();
    let log = LogWriter::new(disk, &Metadata::default()).expect("room for the metadata");
    let (mut sender, recorder) = Recorder::start(log).expect("a thread");
    let (pilot, settings) = (pilot(), timed(SECONDS));
    let mut summary = None;
    // Counts this thread's allocations; the log's writer, in its own thread, may allocate.
    let counted = allocation_counter::measure(|| {
        summary = Some(run(&mut link, &hello, &pilot, &settings, &mut sender));
    });
    let summary = summary.expect("ran");
    assert!(matches!(summary.end, End::Finished), "{summary:?}");
    assert_eq!(counted.count_total, 0, "{counted:?}");
    assert_eq!((summary.samples, summary.held), (SAMPLES, 0));
    assert_eq!(summary.timing.total.count(), SAMPLES);
    sender.end(&summary.timing);
    (summary, recorder)
}

#[test]
fn a_minute_of_the_loop_allocates_nothing() {
    let (_, recorder) = a_minute(Cursor::new(Vec::new()));
    assert!(recorder.finish().error.is_none());
    // The counter is at work.
    assert_eq!(
        allocation_counter::measure(|| drop(std::hint::black_box(Box::new(1)))).count_total,
        1
    );
}

#[test]
fn a_logged_run_over_a_terminal_allocates_nothing() {
    let rig = start(&Emulation::default(), Pace::HostLed);
    let (mut link, hello) = connect(&rig);
    let file = TempLog::new("allocation");
    let log = LogWriter::create(&file.0, &Metadata::default()).expect("writable");
    let (mut sender, recorder) = Recorder::start(log).expect("a thread");
    let (pilot, settings) = (pilot(), timed(10.0));
    let mut summary = None;
    let counted = allocation_counter::measure(|| {
        summary = Some(run(&mut link, &hello, &pilot, &settings, &mut sender));
    });
    let summary = summary.expect("ran");
    assert!(matches!(summary.end, End::Finished), "{summary:?}");
    assert_eq!(counted.count_total, 0, "{counted:?}");
    assert!(summary.timing.round_trip.count() > 0, "{summary:?}");
    sender.end(&summary.timing);
    assert_eq!(recorder.finish().records, 5001);
    let log = file.read();
    assert_eq!(log.timing.as_deref(), Some(&summary.timing));
}

/// A thread that takes a lock that another holds, or waits for anything else, gives its processor away of its own
/// accord, which Linux counts. On a line that never makes it wait the loop has no other reason to.
#[cfg(target_os = "linux")]
#[test]
fn a_minute_of_the_loop_never_waits() {
    let waits = || {
        let status = std::fs::read_to_string("/proc/thread-self/status").expect("Linux");
        let count = status
            .lines()
            .find_map(|l| l.strip_prefix("voluntary_ctxt_switches:"));
        count
            .and_then(|c| c.trim().parse::<u64>().ok())
            .expect("a number")
    };
    let (mut link, hello) = without_a_port();
    let log = LogWriter::new(Cursor::new(Vec::new()), &Metadata::default()).expect("memory");
    let (mut sender, recorder) = Recorder::start(log).expect("a thread");
    let pilot = pilot();
    let before = waits();
    let summary = run(&mut link, &hello, &pilot, &timed(SECONDS), &mut sender);
    let waited = waits() - before;
    drop(sender);
    assert_eq!(
        (summary.samples, recorder.finish().error.is_none()),
        (SAMPLES, true)
    );
    // The writer took records out of the ring all the while. A page fault may wait for the process's memory map: a few
    // at the start.
    assert!(
        waited < 20,
        "the loop waited {waited} times in {SAMPLES} samples"
    );
}

/// A disk that takes the metadata and then nothing until it is told to, or ever.
struct Stuck {
    disk: Cursor<Vec<u8>>,
    released: Receiver<()>,
    taken: u64,
    fails: bool,
}

/// More than the metadata's bytes and less than the run's.
const TAKEN_AT_ONCE: u64 = 100_000;

impl Write for Stuck {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.taken += bytes.len() as u64;
        if self.taken > TAKEN_AT_ONCE {
            // Returns when the other end is dropped.
            let _ = self.released.recv();
            if self.fails {
                return Err(io::ErrorKind::StorageFull.into());
            }
        }
        self.disk.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Stuck {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.disk.seek(to)
    }
}

fn stuck(fails: bool) -> (Stuck, std::sync::mpsc::Sender<()>) {
    let (release, released) = channel();
    let disk = Stuck {
        disk: Cursor::default(),
        released,
        taken: 0,
        fails,
    };
    (disk, release)
}

#[test]
fn a_writer_that_blocks_costs_records_and_nothing_else() {
    let (disk, release) = stuck(false);
    let (summary, recorder) = a_minute(disk);
    // Balanced to the end; the ring took what it could.
    assert_eq!(summary.modes.last().map(|m| m.mode), Some(Mode::Balance));
    assert!(
        summary.unlogged > SAMPLES / 2 && summary.unlogged < SAMPLES,
        "{summary:?}"
    );
    drop(release);
    let recorded = recorder.finish();
    assert!(recorded.error.is_none());
    // What was lost was counted, one by one.
    assert_eq!(recorded.records + summary.unlogged, SAMPLES);
}

#[test]
fn a_writer_that_fails_late_is_told_and_costs_nothing_else() {
    let (disk, release) = stuck(true);
    let (summary, recorder) = a_minute(disk);
    assert_eq!(summary.modes.last().map(|m| m.mode), Some(Mode::Balance));
    drop(release);
    let recorded = recorder.finish();
    assert!(
        matches!(recorded.error, Some(LogError::Write(_))),
        "{recorded:?}"
    );
    assert!(recorded.records + summary.unlogged < SAMPLES);
}
