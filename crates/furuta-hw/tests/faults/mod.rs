//! What goes wrong, and what then happens: rows of docs/faults.md. Without a port or a clock where the fault allows it,
//! so that each run is the same every time.

use crate::common;

mod clock;
mod host;
mod line;
mod rig;
mod soak;

use std::time::Duration;

use furuta_hw::{Link, Transport};
use furuta_wire::Hello;

fn link<T: Transport>(transport: T) -> (Link<T>, Hello) {
    Link::connect(transport, Duration::from_secs(20)).expect("it answers")
}
