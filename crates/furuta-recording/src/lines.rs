//! The lines of a CSV file, one at a time: whoever wrote it, however long it is.

use std::io::{BufRead, Read as _};

use furuta_input::Limits;

use super::RecordingError;

/// The byte-order mark that spreadsheets put in front.
const MARK: &[u8] = b"\xef\xbb\xbf";

/// Reads line by line. Lines end with LF, CR LF or, in a file that has no LF at its beginning, CR alone.
pub(super) struct Lines<'a, R> {
    file: &'a str,
    input: R,
    limit: usize,
    end: u8,
    line: Vec<u8>,
    row: usize,
}

/// What a line is.
pub(super) enum Line<'a> {
    /// Without its `#`.
    Comment(&'a str),
    /// A line of fields.
    Data(&'a str),
}

impl<'a, R: BufRead> Lines<'a, R> {
    pub(super) fn new(
        file: &'a str,
        mut input: R,
        limits: &Limits,
    ) -> Result<Self, RecordingError> {
        let start = input.fill_buf().map_err(|e| failed(file, e))?;
        let has = |byte| start.contains(&byte);
        let end = if has(b'\r') && !has(b'\n') {
            b'\r'
        } else {
            b'\n'
        };
        Ok(Self {
            file,
            input,
            limit: limits.line,
            end,
            line: Vec::new(),
            row: 0,
        })
    }

    /// The next line that is not blank, with its number from 1.
    pub(super) fn next(&mut self) -> Result<Option<(usize, Line<'_>)>, RecordingError> {
        loop {
            self.line.clear();
            let most = self.limit as u64 + 1;
            let mut input = self.input.by_ref().take(most);
            let read = input.read_until(self.end, &mut self.line);
            if read.map_err(|e| failed(self.file, e))? == 0 {
                return Ok(None);
            }
            self.row += 1;
            if self.line.len() > self.limit {
                return Err(RecordingError::LineTooLong {
                    file: self.file.into(),
                    row: self.row,
                    limit: self.limit,
                });
            }
            if self.line.last() == Some(&self.end) {
                self.line.pop();
            }
            while self.line.last() == Some(&b'\r') {
                self.line.pop();
            }
            if self.row == 1 && self.line.starts_with(MARK) {
                self.line.drain(..MARK.len());
            }
            if self.line.contains(&0) {
                return Err(RecordingError::ZeroBytes {
                    file: self.file.into(),
                    row: self.row,
                });
            }
            if self.line.contains(&b'\r') {
                let returns = self.line.iter_mut().filter(|byte| **byte == b'\r');
                returns.for_each(|byte| *byte = b' ');
            }
            if !self.line.iter().all(u8::is_ascii_whitespace) {
                break;
            }
        }
        let text = core::str::from_utf8(&self.line).map_err(|_| RecordingError::NotText {
            file: self.file.into(),
            row: self.row,
        })?;
        let line = match text.trim_start().strip_prefix('#') {
            Some(comment) => Line::Comment(comment.strip_prefix(' ').unwrap_or(comment)),
            None => Line::Data(text),
        };
        Ok(Some((self.row, line)))
    }
}

pub(super) fn failed(file: &str, source: std::io::Error) -> RecordingError {
    RecordingError::Io {
        path: file.into(),
        source,
    }
}
