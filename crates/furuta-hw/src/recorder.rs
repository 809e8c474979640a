//! Logging off the loop: the loop pushes records into a lock-free ring, a thread of its own encodes and writes them. A
//! slow or full disk costs records, never time.

use std::collections::BTreeMap;
use std::io::{Seek, Write};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

use furuta_log::{LogError, LogWriter, Record, Timing};
use rtrb::{Consumer, Producer, RingBuffer};

use crate::real_time::Granted;

/// Records the ring holds: 16 s at 500 Hz, 2 MB. A disk that stalls for longer costs records.
const CAPACITY: usize = 8192;
/// How often the writer looks for records.
const POLL: Duration = Duration::from_millis(5);

/// What is said but once.
#[derive(Debug)]
enum Note {
    RealTime(BTreeMap<String, String>),
    Timing(Box<Timing>),
}

/// The loop's end of the ring.
#[derive(Debug)]
pub struct RecordSender {
    ring: Option<Producer<Record>>,
    /// Used before the loop and after it.
    notes: Option<SyncSender<Note>>,
    lost: u64,
}

impl RecordSender {
    /// For a run without a log.
    #[must_use]
    pub fn nowhere() -> Self {
        Self {
            ring: None,
            notes: None,
            lost: 0,
        }
    }

    /// Hands a record over, without waiting. A full ring loses it, counted; so does a writer that has given up.
    pub fn send(&mut self, record: Record) {
        if let Some(ring) = &mut self.ring
            && (ring.is_abandoned() || ring.push(record).is_err())
        {
            self.lost += 1;
        }
    }

    /// Records lost because the writer did not keep up, or has given up. What was in the ring when it gave up is lost
    /// as well: [`Recorded::records`] has the last word.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Ends the log, saying how punctual the loop was. One that is dropped ends the log without.
    pub fn end(self, timing: &Timing) {
        self.note(|| Note::Timing(Box::new(timing.clone())));
    }

    /// Says in the log what the system granted the loop: before its first record.
    pub fn granted(&self, granted: &Granted) {
        self.note(|| Note::RealTime(granted.to_map()));
    }

    fn note(&self, note: impl FnOnce() -> Note) {
        if let Some(sender) = &self.notes {
            // There is room for both; a writer that has given up takes none.
            let _ = sender.try_send(note());
        }
    }
}

/// The writer's end of the ring.
#[derive(Debug)]
pub struct Recorder {
    thread: JoinHandle<Recorded>,
}

/// What became of a log.
#[derive(Debug)]
pub struct Recorded {
    /// Records written, and handed to the system.
    pub records: u64,
    /// Why the log ends early, where it does.
    pub error: Option<LogError>,
}

impl Recorder {
    /// Starts the writer's thread.
    ///
    /// # Errors
    /// The system starts no thread.
    pub fn start<W>(log: LogWriter<W>) -> std::io::Result<(RecordSender, Self)>
    where
        W: Write + Seek + Send + 'static,
    {
        let (producer, consumer) = RingBuffer::new(CAPACITY);
        let (sender, notes) = sync_channel(2);
        let thread = std::thread::Builder::new()
            .name("log-writer".to_owned())
            .spawn(move || write_all(consumer, &notes, log))?;
        Ok((
            RecordSender {
                ring: Some(producer),
                notes: Some(sender),
                lost: 0,
            },
            Self { thread },
        ))
    }

    /// Waits until everything sent is written and the log is ended. The sender must have been dropped; it ends the log.
    #[must_use]
    pub fn finish(self) -> Recorded {
        // The writer does not panic; were it to, the log is as long as its last chunk.
        self.thread.join().unwrap_or(Recorded {
            records: 0,
            error: None,
        })
    }
}

fn write_all<W: Write + Seek>(
    mut ring: Consumer<Record>,
    notes: &Receiver<Note>,
    mut log: LogWriter<W>,
) -> Recorded {
    let written = write_until_the_end(&mut ring, notes, &mut log);
    // The sender notices nothing of an error but that no reader is left: the loop must go on without a log.
    let (records, kept) = (log.written(), log.kept());
    match written.and_then(|()| log.finish().map(drop)) {
        Ok(()) => Recorded {
            records,
            error: None,
        },
        Err(error) => Recorded {
            records: match error {
                LogError::Tampered(_) => 0,
                _ => kept,
            },
            error: Some(error),
        },
    }
}

fn write_until_the_end<W: Write + Seek>(
    ring: &mut Consumer<Record>,
    notes: &Receiver<Note>,
    log: &mut LogWriter<W>,
) -> Result<(), LogError> {
    let mut timing = None;
    let mut take = |note, log: &mut LogWriter<W>| match note {
        Note::RealTime(map) => log.write_real_time(&map),
        // Kept for the end.
        Note::Timing(given) => {
            timing = Some(given);
            Ok(())
        }
    };
    loop {
        // Asked before the ring is emptied: what was sent before the sender was dropped is seen below.
        let last_round = ring.is_abandoned();
        while let Ok(note) = notes.try_recv() {
            take(note, log)?;
        }
        while let Ok(record) = ring.pop() {
            log.write(&record)?;
        }
        if last_round {
            break;
        }
        std::thread::sleep(POLL);
    }
    // Waits, at most, for the sender to be dropped in full.
    for note in notes {
        take(note, log)?;
    }
    match timing {
        Some(timing) => log.write_timing(&timing),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::io::{self, Cursor, SeekFrom};
    use std::time::Instant;

    use furuta_log::Metadata;

    use super::*;

    /// A disk that takes its time, and no more than `capacity` bytes.
    struct BadDisk {
        bytes: Cursor<Vec<u8>>,
        capacity: usize,
        stall: Duration,
    }

    impl Write for BadDisk {
        fn write(&mut self, buf: &[u8]) -> io::Result<usize> {
            std::thread::sleep(self.stall);
            if self.bytes.get_ref().len() + buf.len() > self.capacity {
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.bytes.write(buf)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Seek for BadDisk {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.bytes.seek(to)
        }
    }

    fn record_to(disk: BadDisk, records: u32) -> (Duration, u64, Recorded) {
        let log = LogWriter::new(disk, &Metadata::default()).expect("room for the metadata");
        let (mut sender, recorder) = Recorder::start(log).expect("a thread");
        let start = Instant::now();
        for seq in 0..records {
            sender.send(Record {
                t: f64::from(seq) * 0.002,
                seq,
                ..Record::default()
            });
        }
        let (took, lost) = (start.elapsed(), sender.lost());
        drop(sender);
        (took, lost, recorder.finish())
    }

    #[test]
    fn a_slow_disk_does_not_slow_the_sender() {
        let stall = Duration::from_millis(5); // the log takes several hundred writes: more than a second
        let disk = BadDisk {
            bytes: Cursor::default(),
            capacity: usize::MAX,
            stall,
        };
        let (took, lost, recorded) = record_to(disk, 2000);
        assert!(took < Duration::from_millis(500), "{took:?}"); // a push takes 10 ns; the bound is for busy machines
        assert_eq!((lost, recorded.records), (0, 2000));
        assert!(recorded.error.is_none());
    }

    #[test]
    fn the_loops_times_are_the_logs_last_word() {
        let path =
            std::env::temp_dir().join(format!("furuta-hw-timing-{}.mcap", std::process::id()));
        let log = LogWriter::create(&path, &Metadata::default()).expect("writable");
        let (mut sender, recorder) = Recorder::start(log).expect("a thread");
        let mut timing = Timing::new(2_000_000);
        for seq in 0..100 {
            sender.send(Record {
                seq,
                ..Record::default()
            });
            timing.sample(1e-6 * f64::from(seq), 2e-5);
        }
        sender.end(&timing);
        assert_eq!(recorder.finish().records, 100);
        let log = furuta_log::read(&path).expect("own log");
        std::fs::remove_file(&path).expect("written above");
        assert_eq!((log.records.len(), log.notice), (100, None));
        assert_eq!(log.timing.as_deref(), Some(&timing));
    }

    #[test]
    fn a_full_disk_is_told_at_the_end() {
        let disk = BadDisk {
            bytes: Cursor::default(),
            capacity: 20_000,
            stall: Duration::ZERO,
        };
        let (_, _, recorded) = record_to(disk, 5000);
        assert!(recorded.records < 5000);
        assert!(matches!(recorded.error, Some(LogError::Write(_))));
    }

    #[test]
    fn a_full_ring_loses_records_and_counts_them() {
        let (mut producer, _consumer) = RingBuffer::new(2);
        producer.push(Record::default()).expect("room");
        let mut sender = RecordSender {
            ring: Some(producer),
            notes: None,
            lost: 0,
        };
        for _ in 0..4 {
            sender.send(Record::default());
        }
        assert_eq!(sender.lost(), 3);
    }
}
