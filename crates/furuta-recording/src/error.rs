//! Why a recording was refused.

use std::path::PathBuf;

use furuta_input::{InputError, number, quoted};

/// Why a recording was refused: in which file, in which row and column, which value, and what to do.
///
/// Rows are counted as an editor counts lines, from 1 and with the header and comments (CSV), or as messages (MCAP) or
/// samples from 1.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The file could not be written; an older one of its name is as it was.
    #[error(transparent)]
    File(#[from] furuta_file::FileError),
    /// The file could not be read.
    #[error("{}: {source}; give the path of a CSV or MCAP recording", path.display())]
    Io {
        /// The path as given.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// The file is not read: a directory, a pipe, zeros, too large.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A line goes on and on.
    #[error(
        "{file}: row {row}: the line is longer than {limit} bytes; no line of a recording is: cut the file there"
    )]
    LineTooLong {
        /// The file.
        file: String,
        /// The row.
        row: usize,
        /// Bytes that a line may have.
        limit: usize,
    },
    /// Bytes that were never written.
    #[error(
        "{file}: row {row}: a zero byte, which no text has: the file was not written or copied whole there; cut it \
         before that row"
    )]
    ZeroBytes {
        /// The file.
        file: String,
        /// The row.
        row: usize,
    },
    /// More columns than are read, or more entries of what the recording says of itself.
    #[error(
        "{file}: {found} columns or entries; at most {limit} are read: keep those that are needed"
    )]
    TooManyColumns {
        /// The file.
        file: String,
        /// How many there are, as far as was read.
        found: usize,
        /// How many there may be.
        limit: usize,
    },
    /// The recording would take more memory than it may.
    #[error("{file}: takes more than {limit} bytes of memory; cut the recording into shorter ones")]
    TooMuchMemory {
        /// The file.
        file: String,
        /// Bytes of memory that it may take.
        limit: u64,
    },
    /// Nothing is left of a recording that is thinned out or cut.
    #[error("{file}: {problem}")]
    Selection {
        /// The recording.
        file: String,
        /// What is wrong with the selection, and what to do.
        problem: String,
    },
    /// There is nothing in the file.
    #[error(
        "{file}: the file is empty; a recording needs a header `t,u,theta,alpha` and rows of numbers"
    )]
    Empty {
        /// The file.
        file: String,
    },
    /// The bytes are not UTF-8.
    #[error("{file}: row {row}: not UTF-8 text; save the recording as plain CSV in UTF-8")]
    NotText {
        /// The file.
        file: String,
        /// Row of the first byte that is not text.
        row: usize,
    },
    /// A quoted field is not closed within its row.
    #[error(
        "{file}: row {row}: a quoted field is not closed; close the quotation mark or remove it"
    )]
    OpenQuote {
        /// The file.
        file: String,
        /// The row.
        row: usize,
    },
    /// A required column is absent.
    #[error(
        "{file}: no column `{column}`; found {}; required are t (s), u (V), theta (rad), alpha (rad){hint}",
        quoted(found)
    )]
    MissingColumn {
        /// The file.
        file: String,
        /// The column that is absent.
        column: &'static str,
        /// The columns that are there, separated by commas.
        found: String,
        /// What the header suggests has gone wrong; empty or starting with `; `.
        hint: &'static str,
    },
    /// Two columns bear one name.
    #[error(
        "{file}: row {row}: two columns are called `{}`; rename one",
        quoted(column)
    )]
    DuplicateColumn {
        /// The file.
        file: String,
        /// Row of the header.
        row: usize,
        /// The name.
        column: String,
    },
    /// A row has more or fewer fields than the header.
    #[error(
        "{file}: row {row}: {found} fields where the header has {expected}; the row is cut off or has a stray comma: \
         mend or delete it"
    )]
    FieldCount {
        /// The file.
        file: String,
        /// The row.
        row: usize,
        /// Fields in the row.
        found: usize,
        /// Fields in the header.
        expected: usize,
    },
    /// A field of a column of numbers is something else.
    #[error(
        "{file}: row {row}, column {column}: `{}` is not a number; write a number with a decimal point, or delete the \
         row",
        quoted(value)
    )]
    NotANumber {
        /// The file.
        file: String,
        /// The row.
        row: usize,
        /// The column.
        column: String,
        /// What stands there.
        value: String,
    },
    /// A field is NaN or infinite.
    #[error(
        "{file}: row {row}, column {column}: the value is {value}, not a finite number; delete the row or cut the \
         recording there"
    )]
    NotFinite {
        /// The file.
        file: String,
        /// The row.
        row: usize,
        /// The column.
        column: String,
        /// NaN or an infinity.
        value: f64,
    },
    /// A time stamp is earlier than the one before.
    #[error(
        "{file}: row {row}, column t: time goes backwards, from {} s to {} s; cut the recording there or sort the rows",
        number(*before), number(*t)
    )]
    TimeBackwards {
        /// The file.
        file: String,
        /// The later row.
        row: usize,
        /// Time stamp of the row before, s.
        before: f64,
        /// Time stamp of this row, s.
        t: f64,
    },
    /// Two rows of different content have one time stamp.
    #[error(
        "{file}: row {row}, column t: {} s again, with other values than the row before; give time stamps that tell \
         the rows apart",
        number(*t)
    )]
    TimeStandsStill {
        /// The file.
        file: String,
        /// The later row.
        row: usize,
        /// The time stamp, s.
        t: f64,
    },
    /// The intervals between time stamps scatter too much for an evenly sampled recording.
    #[error(
        "{file}: {irregular} of {intervals} intervals between time stamps differ by more than {percent:.0} % from the \
         sample period of {} s \
         (first: {} s before row {row}); record at a fixed rate, or resample the recording",
        number(*period), number(*interval)
    )]
    IrregularTime {
        /// The file.
        file: String,
        /// Intervals that differ.
        irregular: usize,
        /// All intervals.
        intervals: usize,
        /// The tolerance, per cent.
        percent: f64,
        /// The sample period, s.
        period: f64,
        /// The first interval that differs, s.
        interval: f64,
        /// The row after it.
        row: usize,
    },
    /// Too few rows to know a sample period.
    #[error("{file}: {rows} rows of data; a recording needs at least {required}")]
    TooFewRows {
        /// The file.
        file: String,
        /// Rows there are.
        rows: usize,
        /// Rows there must be.
        required: usize,
    },
    /// A log was cut off or damaged.
    #[error("{file}: {what}; `furuta convert {file} OUT.csv` saves what was read")]
    CutOff {
        /// The file.
        file: String,
        /// How the log ends and how much was read.
        what: String,
    },
    /// A column cannot be stored in a log under its name.
    #[error(
        "{file}: column `{}` has the name of a field of the log ({meaning}) but holds something else; rename it",
        quoted(column)
    )]
    NotLoggable {
        /// The recording.
        file: String,
        /// The column.
        column: String,
        /// What the log's field of that name holds.
        meaning: &'static str,
    },
    /// The MCAP log could not be read.
    #[error("{file}: {reason}")]
    Log {
        /// The file.
        file: String,
        /// What is wrong with the log, and what to do.
        reason: String,
    },
}
