//! Text of a file in a message.

use core::fmt::{self, Write as _};

/// The most characters of a file that are quoted in one place.
pub const QUOTED: usize = 80;
/// The most characters that are taken from a parser's words, which may hold several quotations and lists of what is
/// known.
const FOREIGN: usize = 1200;

/// Text of a file for a message: see [`quoted`].
#[derive(Copy, Clone, Debug)]
pub struct Quoted<'a>(&'a str);

/// At most [`QUOTED`] printable characters of a text, `...` where it goes on. What is not printable (line ends, the
/// escape sequences of a terminal,
/// marks that turn the direction of writing) is written as an escape of Rust's.
#[must_use]
pub const fn quoted(text: &str) -> Quoted<'_> {
    Quoted(text)
}

impl fmt::Display for Quoted<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        piece(self.0, QUOTED, f)?;
        Ok(())
    }
}

/// Words of a parser about a text: see [`foreign`].
#[derive(Copy, Clone, Debug)]
pub struct Foreign<'a>(&'a str);

/// What a parser says of a text, in one line: each part between quotation marks, which may be the text's, is
/// [`quoted`].
#[must_use]
pub const fn foreign(message: &str) -> Foreign<'_> {
    Foreign(message)
}

impl fmt::Display for Foreign<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut left = FOREIGN;
        for part in self.0.split_inclusive(['`', '"']) {
            let written = piece(part, QUOTED.min(left), f)?;
            left = left.saturating_sub(written);
            if left == 0 {
                return Ok(());
            }
        }
        Ok(())
    }
}

/// Whether a terminal shows this character and does nothing else. Rust's own escapes tell, but for quotation marks.
#[must_use]
pub fn is_printable(c: char) -> bool {
    matches!(c, '\'' | '"' | '\\') || c.escape_debug().len() == 1
}

/// Writes up to `most` characters and returns how many.
fn piece(text: &str, most: usize, f: &mut fmt::Formatter<'_>) -> Result<usize, fmt::Error> {
    let mut written = 0;
    for c in text.chars() {
        let length = if is_printable(c) {
            1
        } else {
            c.escape_debug().len()
        };
        if written + length > most {
            f.write_str("...")?;
            return Ok(most);
        }
        written += length;
        if length == 1 {
            f.write_char(c)?;
        } else {
            write!(f, "{}", c.escape_debug())?;
        }
    }
    Ok(written)
}

/// A text for a terminal: see [`plain`].
#[derive(Copy, Clone, Debug)]
pub struct Plain<'a>(&'a str);

/// A whole text with its lines, what else is not printable as an escape of Rust's: for what is about to reach a
/// terminal.
#[must_use]
pub const fn plain(text: &str) -> Plain<'_> {
    Plain(text)
}

impl fmt::Display for Plain<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for c in self.0.chars() {
            if c == '\n' || is_printable(c) {
                f.write_char(c)?;
            } else {
                write!(f, "{}", c.escape_debug())?;
            }
        }
        Ok(())
    }
}
