//! An estimator that fails, a disk that is full.

use std::io::{self, Cursor, Seek, SeekFrom, Write};

use furuta_hw::{
    Decision, EmulatedTransport, End, Measurement, Pilot, Recorder, RunError, SwingUpBalance, run,
};
use furuta_log::{LogError, LogWriter, Metadata, Mode};

use super::common::{TempLog, emulated, logged, pilot, settings};
use super::link;

/// A pilot whose estimator fails at the second second.
struct Nan(SwingUpBalance);

impl Pilot for Nan {
    type State = <SwingUpBalance as Pilot>::State;

    fn start(&self) -> Self::State {
        self.0.start()
    }

    fn process(&self, state: &mut Self::State, m: &Measurement) -> Decision {
        let mut decision = self.0.process(state, m);
        if m.t >= 2.0 {
            decision.alpha_dot = f64::NAN;
        }
        decision
    }
}

#[test]
fn nan_from_an_estimator_ends_the_run_with_the_motor_off() {
    let mut line = EmulatedTransport::new(emulated());
    let (mut link, hello) = link(&mut line);
    let (summary, recorded, log) = logged(&mut link, &hello, &Nan(pilot()), &settings(60.0), "nan");
    match summary.error() {
        Some(error @ RunError::NotFinite { quantity, t }) => {
            assert_eq!((*quantity, *t), ("pendulum speed", 2.0));
            assert!(error.to_string().contains("motor off"));
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(line.rig().tick().volts, 0.0);
    assert!(recorded.error.is_none());
    // The sample at which it happened is the log's last; its command is the 0 V that was sent.
    let last = log.records.last().expect("records");
    assert!(
        last.t == 2.0 && last.alpha_dot.is_nan() && last.command == 0.0,
        "{last:?}"
    );
}

/// A disk that takes `capacity` bytes.
struct SmallDisk {
    bytes: Cursor<Vec<u8>>,
    capacity: usize,
}

impl Write for SmallDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.bytes.get_ref().len() + bytes.len() > self.capacity {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.bytes.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for SmallDisk {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.bytes.seek(to)
    }
}

/// A pilot that does something to the log at the second second.
struct Vandal<F>(SwingUpBalance, F);

impl<F: Fn()> Pilot for Vandal<F> {
    type State = (<SwingUpBalance as Pilot>::State, bool);

    fn start(&self) -> Self::State {
        (self.0.start(), false)
    }

    fn process(&self, (state, done): &mut Self::State, m: &Measurement) -> Decision {
        if m.t >= 2.0 && !*done {
            *done = true;
            (self.1)();
        }
        self.0.process(state, m)
    }
}

/// What is done to the file of a log costs the log, and that is told; the run goes on.
#[test]
fn a_log_that_is_removed_replaced_or_truncated_is_told() {
    type Deed = fn(&std::path::Path);
    let deeds: [(Deed, &str); 3] = [
        (|path| std::fs::remove_file(path).expect("there"), "removed"),
        (
            |path| {
                // In one go: between removing and writing, the log might be looked for.
                let other = path.with_extension("other");
                std::fs::write(&other, "another").expect("writable");
                std::fs::rename(other, path).expect("writable");
            },
            "replaced",
        ),
        (
            |path| {
                let file = std::fs::File::options().write(true).open(path);
                file.and_then(|file| file.set_len(10)).expect("there");
            },
            "truncated",
        ),
    ];
    for (deed, says) in deeds {
        let file = TempLog::new(says);
        let log = LogWriter::create(&file.0, &Metadata::default()).expect("writable");
        let (mut sender, recorder) = Recorder::start(log).expect("a thread");
        let (mut link, hello) = link(EmulatedTransport::new(emulated()));
        let vandal = Vandal(pilot(), || {
            // Not before something was written.
            for _ in 0..1000 {
                if std::fs::metadata(&file.0).is_ok_and(|m| m.len() > 10_000) {
                    break;
                }
                std::thread::sleep(std::time::Duration::from_millis(5));
            }
            deed(&file.0);
        });
        let summary = run(&mut link, &hello, &vandal, &settings(10.0), &mut sender);
        drop(sender);
        assert!(matches!(summary.end, End::Finished), "{summary:?}");
        let recorded = recorder.finish();
        match recorded.error {
            Some(error @ LogError::Tampered(_)) => {
                assert!(error.to_string().contains(says), "{error}");
            }
            other => panic!("{says}: {other:?}"),
        }
        assert_eq!(recorded.records, 0);
    }
}

#[test]
fn a_full_disk_costs_the_log_and_not_the_run() {
    let disk = SmallDisk {
        bytes: Cursor::default(),
        capacity: 60_000,
    };
    let log = LogWriter::new(disk, &Metadata::default()).expect("room for the metadata");
    let (mut sender, recorder) = Recorder::start(log).expect("a thread");
    let (mut link, hello) = link(EmulatedTransport::new(emulated()));
    let summary = run(&mut link, &hello, &pilot(), &settings(10.0), &mut sender);
    drop(sender);
    assert!(matches!(summary.end, End::Finished), "{summary:?}");
    assert_eq!((summary.samples, summary.held), (5001, 0));
    assert!(
        summary
            .modes
            .last()
            .is_some_and(|m| m.mode == Mode::Balance)
    );
    let recorded = recorder.finish();
    assert!(
        recorded.records > 100 && recorded.records < 5001,
        "{recorded:?}"
    );
    match recorded.error {
        Some(error @ LogError::Write(_)) => assert!(error.to_string().contains("log"), "{error}"),
        other => panic!("{other:?}"),
    }
}
