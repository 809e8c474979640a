//! The loop against an emulated rig through a real pseudo-terminal: what is counted, what ends a run, what the rig
//! does meanwhile.

use crate::common;

mod connecting;
mod ends;
mod samples;
