//! Tests across the crates. One program: each links all of what it tests.

mod catalogue;
mod energy;
mod papers;
mod programs;
mod readers;
mod recordings_of_all_rigs;
mod shared;
