//! Logs, written and read. One program: each links all of what it tests.

mod csv;
mod logs;
