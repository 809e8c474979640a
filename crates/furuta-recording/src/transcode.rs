//! From CSV to MCAP and back, of any length, without loss: of the log of a run every bit of every sample and all that
//! it says of its run, of
//! any other CSV file every byte. Samples pass through one by one.

use std::io::{self, Read, Seek, Write};
use std::path::Path;

use furuta_file::{FileError, WholeFile};
use furuta_input::{Input, Limits, shown};
use furuta_log::{FIELDS, Log, LogError, LogWriter, Part as LogPart, Record};

use super::csv::{Part, each_row};
use super::mcap_write::{Cell, SampleWriter, Shape};
use super::source::{self, Digest};
use super::trouble::Trouble;
use super::{Notice, NoticeKind, Recording, RecordingError, checks, csv, mcap};

/// Of a longer recording, what samples mean is checked of this number of samples only: an hour at 250 Hz.
const CHECKED: usize = 1_000_000;
/// Enough of a file to tell what it is.
const START: u64 = 64;

/// The two forms of a recording.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Format {
    /// Text, one row a sample.
    Csv,
    /// The log that `furuta run` writes.
    Mcap,
}

/// What was converted.
#[derive(Clone, Debug)]
pub struct Transcoded {
    /// Samples.
    pub samples: usize,
    /// From the first to the last, s.
    pub seconds: f64,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// What was noticed about the recording; that it is cut off comes last, in `cut_off`.
    pub notices: Vec<String>,
    /// How the log ends where it ends early: what stands before that place is written.
    pub cut_off: Option<String>,
}

/// Converts a recording. The output is begun once the input is known to be sound, and takes its place when it is
/// complete.
///
/// # Errors
/// Those of [`Recording::salvage`]; [`RecordingError::NotLoggable`]; [`RecordingError::File`] where the output cannot
/// be written.
pub fn transcode(
    input: &Path,
    output: &Path,
    format: Format,
) -> Result<Transcoded, RecordingError> {
    let limits = Limits::default();
    let job = Job {
        file: shown(input),
        opened: super::open(input, &limits)?,
        limits,
    };
    let mut begun = None;
    let file = &mut begun;
    let create = || {
        let new = WholeFile::create(output).map_err(RecordingError::from)?;
        Ok({ file }.insert(new))
    };
    let mut start = Vec::new();
    let read = job.opened.again()?.take(START).read_to_end(&mut start);
    read.map_err(|e| Trouble::Write(e).of(&job.file))?;
    let is_log = mcap::is_mcap(&start) || super::named_mcap(input) && !start.is_empty();
    let made = if is_log {
        job.of_mcap(format, create)
    } else if furuta_log::is_csv(&start) {
        job.of_log_csv(format, create)
    } else {
        job.of_csv(format, create)
    };
    let made = made.map_err(|trouble| match trouble {
        Trouble::Write(source) => RecordingError::File(FileError::Write {
            path: output.into(),
            source,
        }),
        other => other.of(&job.file),
    })?;
    if let Some(file) = begun {
        file.commit()?;
    }
    Ok(made)
}

/// What is done with a sample: its time and its values.
type EachSample<'a> = dyn FnMut(f64, &[Cell<'_>]) -> Result<(), Trouble> + 'a;

/// A file that is being converted.
struct Job {
    file: String,
    opened: Input,
    limits: Limits,
}

impl Job {
    fn input(&self) -> Result<io::BufReader<Input>, Trouble> {
        let again = self.opened.again().map_err(RecordingError::from)?;
        Ok(again.buffered())
    }

    /// A log that a run wrote, as CSV: every row is read before anything is written.
    fn of_log_csv<W: Write + Seek>(
        &self,
        format: Format,
        create: impl FnOnce() -> Result<W, Trouble>,
    ) -> Result<Transcoded, Trouble> {
        let mut ends = Ends::default();
        let log = furuta_log::each_csv_record(self.input()?, &self.limits, |record| {
            ends.add(&record);
            Ok::<(), Trouble>(())
        })?;
        let mut out = create()?;
        match format {
            Format::Mcap => self.write_run(&log, out, |each| {
                furuta_log::each_csv_record(self.input()?, &self.limits, each).map(drop)
            })?,
            Format::Csv => {
                io::copy(&mut self.input()?, &mut out).map_err(Trouble::Write)?;
                out.flush().map_err(Trouble::Write)?;
            }
        }
        let table = csv::parse(&self.file, self.input()?, &self.limits, CHECKED);
        Ok(ends.of_a_run(&log, noticed(table.map(|(table, _)| table))))
    }

    fn write_run<W: Write + Seek>(
        &self,
        log: &Log,
        out: W,
        records: impl FnOnce(&mut dyn FnMut(Record) -> Result<(), Trouble>) -> Result<(), Trouble>,
    ) -> Result<(), Trouble> {
        let metadata = log.metadata.clone().unwrap_or_default();
        let mut writer = LogWriter::new(out, &metadata).map_err(unwritten)?;
        if !log.real_time.is_empty() {
            writer.write_real_time(&log.real_time).map_err(unwritten)?;
        }
        records(&mut |record| writer.write(&record).map_err(unwritten))?;
        if let Some(timing) = &log.timing {
            writer.write_timing(timing).map_err(unwritten)?;
        }
        writer.finish().map_err(unwritten)?;
        Ok(())
    }

    fn of_mcap<W: Write + Seek>(
        &self,
        format: Format,
        create: impl FnOnce() -> Result<W, Trouble>,
    ) -> Result<Transcoded, Trouble> {
        let mut log = Log::default();
        let (mut digest, mut mark) = (Digest::default(), None);
        let (mut first, mut last): (Vec<u8>, Vec<u8>) = Default::default();
        let mut samples = 0;
        let ending = furuta_log::each_part(self.input()?, &self.limits, |part| {
            match part {
                LogPart::Metadata(metadata) => log.metadata = Some(metadata),
                LogPart::RealTime(granted) => log.real_time = granted,
                LogPart::Timing(timing) => log.timing = Some(timing),
                LogPart::Other(name, map) if name == source::MARK => mark = Some(map),
                LogPart::Sample(json) => {
                    digest.add(json);
                    last.clear();
                    last.extend_from_slice(json);
                    if samples == 0 {
                        first.clone_from(&last);
                    }
                    samples += 1;
                }
                _ => {}
            }
            Ok::<(), Trouble>(())
        })?;
        let mut ends = Ends::default();
        for json in [first, last] {
            if let Ok(record) = serde_json::from_slice(&json) {
                ends.add(&record);
            }
        }
        ends.samples = samples;
        let listed = log.metadata.as_ref().and_then(mcap::listed);
        if log.metadata.is_some() && listed.is_none() && samples > 0 {
            log.notice =
                ending.map(|ending| ending.after(samples, ends.time.map(|[_, last]| last)));
            return self.of_run(&log, &ends, format, create);
        }
        let whole = ending.is_none() && mark.is_some_and(|mark| mark == digest.to_map());
        let made = match (whole, format) {
            // Its samples are still those of the file that was converted.
            (true, Format::Csv) => {
                let out = create()?;
                let copied = furuta_log::copy_attachment(self.input()?, source::NAME, out);
                copied.map_err(Trouble::Write)?
            }
            (true, Format::Mcap) => {
                let mut out = create()?;
                io::copy(&mut self.input()?, &mut out).map_err(Trouble::Write)?;
                out.flush().map_err(Trouble::Write)?;
                true
            }
            (false, _) => return self.rewritten(format, create),
        };
        if !made {
            return Err(Trouble::Recording(RecordingError::Log {
                file: self.file.clone(),
                reason: "the CSV file kept in it is damaged; convert the original again".into(),
            }));
        }
        let table = mcap::parse(&self.file, self.input()?, &self.limits, CHECKED);
        let table = table.map(|(table, _)| table);
        Ok(ends.of(listed.unwrap_or_default(), noticed(table), None))
    }

    /// The log of a run.
    fn of_run<W: Write + Seek>(
        &self,
        log: &Log,
        ends: &Ends,
        format: Format,
        create: impl FnOnce() -> Result<W, Trouble>,
    ) -> Result<Transcoded, Trouble> {
        let mut out = create()?;
        match format {
            Format::Csv => {
                furuta_log::write_csv_head(log, &mut out).map_err(Trouble::Write)?;
                furuta_log::each_record(self.input()?, &self.limits, |record| {
                    furuta_log::write_csv_record(&record, &mut out).map_err(Trouble::Write)
                })?;
                out.flush().map_err(Trouble::Write)?;
            }
            Format::Mcap => self.write_run(log, out, |each| {
                furuta_log::each_record(self.input()?, &self.limits, each).map(drop)
            })?,
        }
        let table = mcap::parse(&self.file, self.input()?, &self.limits, CHECKED);
        Ok(ends.of_a_run(log, noticed(table.map(|(table, _)| table))))
    }

    /// A log of others, or one that was changed: read whole, written anew.
    fn rewritten<W: Write + Seek>(
        &self,
        format: Format,
        create: impl FnOnce() -> Result<W, Trouble>,
    ) -> Result<Transcoded, Trouble> {
        let (recording, notices) = Recording::read_mcap(&self.file, self.input()?, &self.limits)?;
        self.write(&recording, &notices, format, create)
    }

    fn write<W: Write + Seek>(
        &self,
        recording: &Recording,
        notices: &[Notice],
        format: Format,
        create: impl FnOnce() -> Result<W, Trouble>,
    ) -> Result<Transcoded, Trouble> {
        match format {
            Format::Csv => recording.to_csv(create()?).map_err(Trouble::Write)?,
            Format::Mcap => {
                let shape = recording.shape();
                recording.fits_the_log(&shape)?;
                let out = create()?;
                recording.to_mcap(&shape, out).map_err(Trouble::Write)?;
            }
        }
        let ends = Ends {
            samples: recording.len(),
            time: recording
                .t
                .first()
                .copied()
                .zip(recording.t.last().copied())
                .map(Into::into),
        };
        let names = recording.column_names();
        let cut_off = notices.iter().find_map(|notice| match &notice.kind {
            NoticeKind::CutOff { what } => Some(what.clone()),
            _ => None,
        });
        let said = notices
            .iter()
            .filter(|n| !matches!(n.kind, NoticeKind::CutOff { .. }));
        let said = said.map(ToString::to_string).collect();
        Ok(ends.of(names.into_iter().map(Into::into).collect(), said, cut_off))
    }

    /// A recording of any other origin.
    fn of_csv<W: Write + Seek>(
        &self,
        format: Format,
        create: impl FnOnce() -> Result<W, Trouble>,
    ) -> Result<Transcoded, Trouble> {
        if format == Format::Csv {
            let (recording, notices) =
                Recording::read_csv(&self.file, self.input()?, &self.limits)?;
            return self.write(&recording, &notices, format, create);
        }
        let (table, through) = csv::parse(&self.file, self.input()?, &self.limits, CHECKED)?;
        let (about, notices) = checks::check(table)?;
        let mut notices: Vec<String> = notices.iter().map(ToString::to_string).collect();
        if through.samples > CHECKED {
            notices.push(only_beginning(&self.file));
        }
        // State first, as everywhere.
        let order = order(&through.columns);
        let at = |i: &usize| through.columns.get(*i).cloned();
        let columns: Vec<(String, bool)> = order.iter().filter_map(at).collect();
        let names = columns.iter().map(|(name, _)| name.clone()).collect();
        let numbers: Vec<bool> = columns.iter().map(|(_, numbers)| *numbers).collect();
        let shape = Shape::new(columns);
        // Whether every value fits is known before anything is written, as it is for every other mistake.
        if shape.shares_names() {
            self.each_sample(&order, &numbers, &mut |_, cells| {
                for (i, cell) in cells.iter().enumerate() {
                    if let Some(meaning) = shape.misfit(i, *cell) {
                        let name = at(order.get(i).unwrap_or(&i)).unwrap_or_default().0;
                        return Err(Trouble::Recording(RecordingError::NotLoggable {
                            file: self.file.clone(),
                            column: name,
                            meaning,
                        }));
                    }
                }
                Ok(())
            })?;
        }
        let out = create()?;
        let mut writer = SampleWriter::new(out, &shape, &about).map_err(Trouble::Write)?;
        self.each_sample(&order, &numbers, &mut |t, cells| {
            writer.write(t, cells).map_err(Trouble::Write)
        })?;
        let size = self.opened.size().map_err(RecordingError::from)?;
        writer.attach(self.input()?, size).map_err(Trouble::Write)?;
        writer.finish().map_err(Trouble::Write)?;
        let ends = Ends {
            samples: through.samples,
            time: Some(through.time),
        };
        Ok(ends.of(names, notices, None))
    }

    /// Goes through the rows of a CSV file that was found to be sound, with the columns in this order.
    fn each_sample(
        &self,
        order: &[usize],
        numbers: &[bool],
        each: &mut EachSample<'_>,
    ) -> Result<(), Trouble> {
        let mut failed = None;
        let gone = each_row(&self.file, self.input()?, &self.limits, &mut |part| {
            let Part::Row(_, fields) = part else {
                return Ok(());
            };
            let cell = |(&i, &number): (&usize, &bool)| match fields.get(i) {
                Some(field) if number => Cell::Number(field.parse().unwrap_or(f64::NAN)),
                Some(field) => Cell::Text(field),
                None => Cell::Text(""),
            };
            let cells: Vec<Cell<'_>> = order.iter().zip(numbers).map(cell).collect();
            let t = match cells.first() {
                Some(Cell::Number(t)) => *t,
                _ => 0.0,
            };
            each(t, &cells).map_err(|trouble| {
                failed = Some(trouble);
                RecordingError::Empty {
                    file: self.file.clone(),
                }
            })
        });
        match (failed, gone) {
            (Some(trouble), _) => Err(trouble),
            (None, gone) => Ok(gone?),
        }
    }
}

/// Writing the output failed, not reading the log.
fn unwritten(error: LogError) -> Trouble {
    Trouble::Write(io::Error::other(error))
}

/// Places of the columns: t, u, theta, alpha, the speeds, then the others as they stand.
fn order(columns: &[(String, bool)]) -> Vec<usize> {
    let place = |name: &str| mcap::STATE.iter().position(|state| *state == name);
    let mut order: Vec<usize> = (0..columns.len()).collect();
    order.sort_by_key(|&i| {
        let name = columns.get(i).map_or("", |(name, _)| name);
        place(name).unwrap_or(mcap::STATE.len())
    });
    order
}

/// First and last time of the samples that were seen.
#[derive(Default)]
struct Ends {
    samples: usize,
    time: Option<[f64; 2]>,
}

impl Ends {
    fn add(&mut self, record: &Record) {
        self.samples += 1;
        let [first, _] = self.time.unwrap_or([record.t; 2]);
        self.time = Some([first, record.t]);
    }

    fn of(
        &self,
        columns: Vec<String>,
        notices: Vec<String>,
        cut_off: Option<String>,
    ) -> Transcoded {
        Transcoded {
            samples: self.samples,
            seconds: self.time.map_or(0.0, |[first, last]| last - first),
            columns,
            notices,
            cut_off,
        }
    }

    fn of_a_run(&self, log: &Log, notices: Vec<String>) -> Transcoded {
        let columns = FIELDS.iter().map(|field| field.name.to_owned()).collect();
        let cut_off = log.notice.as_ref().map(ToString::to_string);
        self.of(columns, notices, cut_off)
    }
}

/// What a person should know about a recording, and what would make it useless to diagnose.
fn noticed(table: Result<super::Table, RecordingError>) -> Vec<String> {
    let full = table.as_ref().ok().filter(|table| table.t.len() >= CHECKED);
    let more = full.map(|table| only_beginning(&table.file));
    match table.and_then(checks::check) {
        Ok((_, notices)) => notices
            .iter()
            .map(ToString::to_string)
            .chain(more)
            .collect(),
        Err(error) => vec![error.to_string()],
    }
}

fn only_beginning(file: &str) -> String {
    format!("{file}: what the samples mean was checked of the first {CHECKED} only")
}
