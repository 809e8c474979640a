//! The loop, the wire and the rig's end together. One program: each links all of what it tests.

mod common;
mod corpus;
mod faults;
mod limits;
mod no_allocation;
mod replay;
mod swing_up;
mod wire_and_loop;
