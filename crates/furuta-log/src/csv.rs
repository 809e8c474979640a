//! A log as CSV, and back, without loss: what the log says of its run in comments, one row per sample, each number with
//! as many digits as it takes to read the same bits again. Other programs read it as any CSV file.
//!
//! ```text
//! # furuta log 1
//! # rig: shahzad2022-srv02
//! # controller: energy swing-up; ...
//! # rig| [rig]
//! # rig| name = "shahzad2022-srv02"
//! t,u,theta,alpha,theta_dot,alpha_dot,reference,command,mode,seq,status,lost,delay,compute
//! 0,0,0,3.141592653589793,0,0,0,1.5,swing-up,211,3,0,0,0.000011
//! ```
//!
//! A value of one line is `key: value`, a text of lines `key| line` for each (`rig|` is the rig file), anything else
//! `key: "..."`, a string of JSON. NaN is an empty field, infinities are `inf` and `-inf`.

use std::collections::BTreeMap;
use std::io::{self, BufRead, Read as _, Write};

use furuta_input::{Limits, foreign, quoted};

use crate::{FIELDS, Log, Metadata, Mode, Record, Timing};

/// First line of such a file.
const MARK: &str = "# furuta log 1";
const RIG_FILE: &str = "rig_file";
/// What the rig file's lines begin with, as in every CSV recording that carries one.
const RIG_LINES: &str = "rig";
/// What the system granted the loop, and how punctual it was; the run's own keys of these names are written in quotes.
const REAL_TIME: &str = "real_time";
const TIMING: &str = "timing";

/// A CSV file that begins as a log does, and does not go on as one.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("row {row}: {problem}")]
pub struct CsvError {
    /// Line of the file, from 1.
    pub row: usize,
    /// What is wrong there.
    pub problem: String,
}

/// Whether this is a log as [`write_csv`] writes it.
#[must_use]
pub fn is_csv(bytes: &[u8]) -> bool {
    bytes
        .strip_prefix(MARK.as_bytes())
        .is_some_and(|rest| rest.starts_with(b"\n") || rest.starts_with(b"\r\n"))
}

/// Writes a log as CSV.
///
/// ```
/// use furuta_log::{Log, Metadata, Record, is_csv, read_csv, write_csv};
/// let record = Record { t: 0.002, u: -0.0, theta: 1.0 / 3.0, theta_dot: f64::NEG_INFINITY, ..Record::default() };
/// let log = Log { metadata: Some(Metadata::default()), records: vec![record], ..Log::default() };
/// let mut csv = Vec::new();
/// write_csv(&log, &mut csv)?;
/// assert!(is_csv(&csv));
/// let again = read_csv(&csv)?;
/// assert_eq!(again, log);
/// assert_eq!(again.records[0].u.to_bits(), (-0.0_f64).to_bits());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// The writer's.
pub fn write_csv(log: &Log, mut out: impl Write) -> io::Result<()> {
    write_csv_head(log, &mut out)?;
    log.records
        .iter()
        .try_for_each(|record| write_csv_record(record, &mut out))?;
    out.flush()
}

/// Writes what stands before a log's records: what it says of its run, and the header.
///
/// # Errors
/// The writer's.
pub fn write_csv_head(log: &Log, mut out: impl Write) -> io::Result<()> {
    writeln!(out, "{MARK}")?;
    if let Some(metadata) = &log.metadata {
        let own = metadata.own().into_iter();
        let extra = metadata.extra.iter().map(|(k, v)| (k.as_str(), v.as_str()));
        for (key, value) in own.chain(extra) {
            comment(&mut out, key, value)?;
        }
    }
    if !log.real_time.is_empty() {
        note(&mut out, REAL_TIME, &log.real_time)?;
    }
    if let Some(timing) = &log.timing {
        let map = timing.to_map().map_err(io::Error::other)?;
        note(&mut out, TIMING, &map)?;
    }
    writeln!(out, "{}", header())
}

/// Writes one record.
///
/// # Errors
/// The writer's.
pub fn write_csv_record(r: &Record, mut out: impl Write) -> io::Result<()> {
    for value in [
        r.t,
        r.u,
        r.theta,
        r.alpha,
        r.theta_dot,
        r.alpha_dot,
        r.reference,
        r.command,
    ] {
        number(&mut out, value)?;
        write!(out, ",")?;
    }
    write!(out, "{},{},{},{},", r.mode, r.seq, r.status, r.lost)?;
    number(&mut out, r.delay)?;
    write!(out, ",")?;
    number(&mut out, r.compute)?;
    writeln!(out)
}

/// What the loop says of itself, as JSON.
fn note(out: &mut impl Write, key: &str, map: &BTreeMap<String, String>) -> io::Result<()> {
    writeln!(out, "# {key}: {}", serde_json::to_string(map)?)
}

fn header() -> String {
    FIELDS.map(|field| field.name).join(",")
}

fn number(out: &mut impl Write, value: f64) -> io::Result<()> {
    // Rust prints the shortest decimal that reads back equal.
    if value.is_nan() {
        Ok(())
    } else {
        write!(out, "{value}")
    }
}

fn comment(out: &mut impl Write, key: &str, value: &str) -> io::Result<()> {
    let json = |text: &str| serde_json::Value::from(text).to_string();
    let plain_key = !["", REAL_TIME, TIMING].contains(&key)
        && key.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_');
    let lines = value
        .strip_suffix('\n')
        .filter(|_| plain_key && key != RIG_LINES && !value.contains('\r'));
    if let Some(lines) = lines {
        let key = if key == RIG_FILE { RIG_LINES } else { key };
        return lines
            .split('\n')
            .try_for_each(|line| writeln!(out, "# {key}| {line}"));
    }
    let one_line = !value.is_empty()
        && value.trim() == value
        && !value.starts_with('"')
        && !value.contains(['\n', '\r']);
    let key = if plain_key { key.to_owned() } else { json(key) };
    if one_line {
        writeln!(out, "# {key}: {value}")
    } else {
        writeln!(out, "# {key}: {}", json(value))
    }
}

/// Reads what [`write_csv`] wrote.
///
/// # Errors
/// [`CsvError`], with the row: no log, a comment or a field that is none of it.
pub fn read_csv(bytes: &[u8]) -> Result<Log, CsvError> {
    let mut records = Vec::new();
    let log = each_csv_record(bytes, &Limits::default(), |record| {
        records.push(record);
        Ok::<(), CsvError>(())
    })?;
    Ok(Log { records, ..log })
}

/// Goes through what [`write_csv`] wrote, record by record, and returns what it says beside them.
///
/// # Errors
/// As [`read_csv`], and those of `each`.
pub fn each_csv_record<E: From<CsvError>>(
    mut input: impl BufRead,
    limits: &Limits,
    mut each: impl FnMut(Record) -> Result<(), E>,
) -> Result<Log, E> {
    let mut log = Log::default();
    let mut has_header = false;
    let (mut line, mut row) = (Vec::new(), 0);
    loop {
        line.clear();
        row += 1;
        let error = |problem: String| CsvError { row, problem };
        let most = limits.line as u64 + 1;
        let mut part = input.by_ref().take(most);
        let read = part.read_until(b'\n', &mut line);
        if read.map_err(|e| error(format!("cannot be read: {e}")))? == 0 {
            break;
        }
        if line.len() > limits.line {
            let problem = format!("the line is longer than {} bytes", limits.line);
            return Err(error(problem).into());
        }
        let text = std::str::from_utf8(&line);
        let text = text.map_err(|_| error("is not text in UTF-8".to_owned()))?;
        let text = text.strip_suffix('\n').unwrap_or(text);
        let text = text.strip_suffix('\r').unwrap_or(text);
        if row == 1 && text != MARK {
            return Err(error(format!("a log begins with `{MARK}`")).into());
        }
        if row == 1 || text.is_empty() {
            continue;
        }
        if let Some(comment) = text.strip_prefix("# ") {
            take(&mut log, comment).map_err(error)?;
            let entries = log.metadata.as_ref().map_or(0, |m| m.extra.len());
            if entries > limits.names {
                let problem = format!("more than {} comments with a key", limits.names);
                return Err(error(problem).into());
            }
        } else if has_header {
            each(record(text).map_err(error)?)?;
        } else if text == header() {
            has_header = true;
        } else {
            return Err(error(format!("the columns of a log are {}", header())).into());
        }
    }
    if !has_header {
        let problem = "the file ends before its header".to_owned();
        return Err(CsvError { row, problem }.into());
    }
    Ok(log)
}

/// A comment into what the log says of its run.
fn take(log: &mut Log, comment: &str) -> Result<(), String> {
    let map = |key: &str| {
        let text = comment.strip_prefix(key)?.strip_prefix(": ")?;
        Some(serde_json::from_str(text).map_err(|e| format!("{key}: {}", foreign(&e.to_string()))))
    };
    if let Some(map) = map(REAL_TIME) {
        log.real_time = map?;
        return Ok(());
    }
    if let Some(map) = map(TIMING) {
        let timing = Timing::from_map(&map?).map_err(|e| e.to_string())?;
        log.timing = Some(Box::new(timing));
        return Ok(());
    }
    let metadata: &mut Metadata = log.metadata.get_or_insert_default();
    let problem = || {
        format!(
            "`# {}` is neither `# key: value` nor `# key| line`",
            quoted(comment)
        )
    };
    let is_json = comment.starts_with('"');
    if !is_json
        && let Some((key, line)) = comment.split_once('|')
        && !key.contains(':')
    {
        let key = if key == RIG_LINES { RIG_FILE } else { key };
        let text = metadata.entry(key);
        *text += line.strip_prefix(' ').unwrap_or(line);
        text.push('\n');
        return Ok(());
    }
    let (key, value) = if is_json {
        let mut keys = serde_json::Deserializer::from_str(comment).into_iter::<String>();
        let key = keys.next().and_then(Result::ok).ok_or_else(problem)?;
        let rest = comment.get(keys.byte_offset()..).ok_or_else(problem)?;
        (key, rest.strip_prefix(':').ok_or_else(problem)?)
    } else {
        let (key, value) = comment.split_once(':').ok_or_else(problem)?;
        (key.to_owned(), value)
    };
    let value = value.strip_prefix(' ').unwrap_or(value);
    *metadata.entry(&key) = if value.starts_with('"') {
        serde_json::from_str(value).map_err(|e| {
            format!(
                "the value of `{}`: {}",
                quoted(&key),
                foreign(&e.to_string())
            )
        })?
    } else {
        value.to_owned()
    };
    Ok(())
}

fn record(line: &str) -> Result<Record, String> {
    let fields: Vec<&str> = line.split(',').collect();
    let Ok(
        [
            t,
            u,
            theta,
            alpha,
            theta_dot,
            alpha_dot,
            reference,
            command,
            mode,
            seq,
            status,
            lost,
            delay,
            compute,
        ],
    ) = <[&str; FIELDS.len()]>::try_from(fields)
    else {
        let found = line.split(',').count();
        return Err(format!("{found} fields, a log has {}", FIELDS.len()));
    };
    Ok(Record {
        t: float("t", t)?,
        u: float("u", u)?,
        theta: float("theta", theta)?,
        alpha: float("alpha", alpha)?,
        theta_dot: float("theta_dot", theta_dot)?,
        alpha_dot: float("alpha_dot", alpha_dot)?,
        reference: float("reference", reference)?,
        command: float("command", command)?,
        mode: Mode::ALL
            .into_iter()
            .find(|known| known.name() == mode)
            .ok_or_else(|| {
                let known = Mode::ALL.map(Mode::name).join(", ");
                format!("mode = `{}`, must be one of {known}", quoted(mode))
            })?,
        seq: whole("seq", seq)?,
        status: whole("status", status)?,
        lost: whole("lost", lost)?,
        delay: float("delay", delay)?,
        compute: float("compute", compute)?,
    })
}

fn float(name: &str, text: &str) -> Result<f64, String> {
    if text.is_empty() {
        return Ok(f64::NAN);
    }
    text.parse()
        .map_err(|_| format!("{name} = `{}` is not a number", quoted(text)))
}

fn whole<T: std::str::FromStr>(name: &str, text: &str) -> Result<T, String> {
    text.parse().map_err(|_| {
        format!(
            "{name} = `{}` is not a whole number of its range",
            quoted(text)
        )
    })
}
