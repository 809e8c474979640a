//! Commands that run in real time: rigs behind ports, ends of runs, lateness. One program: each links all of what it
//! tests.

mod common;
mod ends_of_runs;
mod long;
mod real_time;
mod rig_in_qemu;
mod rig_in_simavr;
mod rigs_on_ports;
mod time_of_day;
