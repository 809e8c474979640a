//! Standard output and standard error.
//!
//! Who reads may leave early (`furuta simulate | head`). That is no failure, and no reason to end what a command does
//! beside its text: it may be bringing a rig to rest, or writing a file. So what has no reader any more is thrown away.
//! Where text cannot be written for another reason (a full disk), the command fails as with any other file.

use std::fmt::Arguments;
use std::io::{self, ErrorKind, StdoutLock, Write};

/// Standard output, to a reader that may leave.
pub(crate) struct Output(StdoutLock<'static>);

/// Standard output, for this thread alone until it is dropped.
pub(crate) fn output() -> Output {
    Output(io::stdout().lock())
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        unless_left(self.0.write(bytes), bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        unless_left(self.0.flush(), ())
    }
}

/// What was written, or `all` where the reader has left.
fn unless_left<T>(written: io::Result<T>, all: T) -> io::Result<T> {
    written.or_else(|error| match error.kind() {
        ErrorKind::BrokenPipe => Ok(all),
        // One to try again: without a word.
        ErrorKind::Interrupted => Err(error),
        kind => Err(io::Error::new(kind, format!("standard output: {error}"))),
    })
}

/// A line on standard error, beside what a command answers.
macro_rules! note {
    ($($text:tt)*) => {
        $crate::streams::beside(format_args!($($text)*))
    };
}
pub(crate) use note;

/// What [`note!`] calls. Where standard error takes nothing, there is nowhere to say so.
pub(crate) fn beside(text: Arguments<'_>) {
    let _ = writeln!(
        io::stderr().lock(),
        "{}",
        furuta_input::plain(&text.to_string())
    );
}
