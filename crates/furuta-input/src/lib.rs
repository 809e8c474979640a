//! What a person gives the program to read: files, opened in one place and read within limits ([`Input`]), and their
//! text in messages, which
//! is cut and never reaches a terminal as anything but printable characters ([`quoted`], [`number`]).
//!
//! ```
//! use furuta_input::{number, quoted};
//! assert_eq!(quoted("\u{1b}[31mred").to_string(), "\\u{1b}[31mred");
//! assert_eq!(quoted(&"x".repeat(1000)).to_string(), "x".repeat(80) + "...");
//! assert_eq!(number(1e300).to_string(), "1e300");
//! assert_eq!(number(0.002).to_string(), "0.002");
//! ```
#![cfg_attr(not(feature = "std"), no_std)]

#[cfg(feature = "std")]
mod file;
mod number;
mod quote;

#[cfg(feature = "std")]
pub use file::{Input, InputError, Limits, TEXT_LIMIT, read_text, shown};
pub use number::{Number, number};
pub use quote::{Foreign, Plain, QUOTED, Quoted, foreign, is_printable, plain, quoted};
