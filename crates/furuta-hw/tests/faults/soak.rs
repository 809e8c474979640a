//! Every fault of the line at once, for long.

use std::io::{self, Cursor, Seek, SeekFrom, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use furuta_hw::{
    Decision, EmulatedTransport, End, FaultRates, FaultyTransport, Measurement, Pilot, Recorder,
    SwingUpBalance, run,
};
use furuta_log::{LogWriter, Metadata, Mode};

use super::common::{emulated, pilot, settings, srv02};
use super::link;

/// Half an hour of the rig's time, balancing, with every fault of the line and every record kept.
#[test]
fn soak_half_an_hour_of_random_faults() {
    const SECONDS: f64 = 1800.0;
    let rates = FaultRates {
        frame_lost: 0.01,
        delayed: 0.005,
        lost: 0.0005,
        flipped: 0.0005,
        doubled: 0.0005,
    };
    let mut line = FaultyTransport::new(EmulatedTransport::new(emulated()), rates, 14);
    let written = Arc::new(AtomicU64::new(0));
    let disk = Counted(Arc::clone(&written), Cursor::new(Vec::new()));
    let log = LogWriter::new(disk, &Metadata::default()).expect("memory");
    let (mut sender, recorder) = Recorder::start(log).expect("a thread");
    let (mut link, hello) = link(&mut line);
    let pilot = Watched {
        pilot: pilot(),
        limit: srv02().params.motor.command_limit,
        written,
    };
    let summary = run(&mut link, &hello, &pilot, &settings(SECONDS), &mut sender);
    drop(sender);
    let recorded = recorder.finish();
    println!("{summary:?}");
    assert!(matches!(summary.end, End::Finished), "{:?}", summary.end);
    assert!(summary.samples + summary.lost >= 900_000);
    assert!(
        summary.lost > 10_000 && summary.bad_frames > 10_000,
        "{summary:?}"
    );
    assert!(recorded.error.is_none());
    assert_eq!((recorded.records, summary.unlogged), (summary.samples, 0));
    // Up once and for good.
    assert!(summary.mode_changes <= 4, "{:?}", summary.modes);
    assert_eq!(summary.modes.last().map(|m| m.mode), Some(Mode::Balance));
}

/// A disk in memory that tells how much it has got.
struct Counted(Arc<AtomicU64>, Cursor<Vec<u8>>);

impl Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        self.1.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Counted {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.1.seek(to)
    }
}

/// Sees that no command and no voltage is one that a motor must not get. A run that is two hundred times faster than
/// real time waits for the log's writer now and then.
struct Watched {
    pilot: SwingUpBalance,
    limit: f64,
    written: Arc<AtomicU64>,
}

impl Pilot for Watched {
    type State = (<SwingUpBalance as Pilot>::State, u32, u64);

    fn start(&self) -> Self::State {
        (self.pilot.start(), 0, 0)
    }

    fn process(&self, state: &mut Self::State, m: &Measurement) -> Decision {
        let (state, calls, before) = state;
        let decision = self.pilot.process(state, m);
        assert!(
            decision.volts.abs() <= self.limit && m.held.abs() <= self.limit,
            "t = {}",
            m.t
        );
        *calls += 1;
        if calls.is_multiple_of(4000) {
            // Until it has begun to write what came since, and has come to an end with it; the ring holds twice as
            // many.
            let mut last = *before;
            for _ in 0..500 {
                std::thread::sleep(Duration::from_millis(10));
                let now = self.written.load(Ordering::Relaxed);
                if now != *before && now == last {
                    break;
                }
                last = now;
            }
            *before = last;
        }
        decision
    }
}
