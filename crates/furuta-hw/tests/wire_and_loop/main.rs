//! The loop against an emulated rig through a real pseudo-terminal: what is counted, what ends a run, what the rig
//! does meanwhile.

#[path = "../common/mod.rs"]
mod common;

mod connecting;
mod ends;
mod samples;
