//! Files that are written whole or not at all, and what may be replaced without asking.
//!
//! - [`Place`]: the file that a path names, behind its links, whether it can be written and what stands there.
//! - [`WholeFile`]: written beside its place and moved there when it is complete.
//! - [`GrowingFile`]: a log, which must be readable while it grows and after the program was killed.
//!
//! Devices, pipes and `/dev/stdout` are written directly.

mod growing;
mod kind;
mod place;
mod whole;

pub use growing::GrowingFile;
pub use kind::Kind;
pub use place::{FileError, Place};
pub use whole::{WholeFile, write};
