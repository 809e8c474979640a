//! Ctrl-C ends a run as its duration would: motor off, log ended.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// A flag that Ctrl-C sets. Where the system allows no handler, Ctrl-C ends the process; the rig's watchdog and the
/// log's chunks are made for that.
pub(crate) fn flag() -> &'static AtomicBool {
    // An error means that the handler is there already.
    let _ = ctrlc::set_handler(|| INTERRUPTED.store(true, Ordering::Relaxed));
    &INTERRUPTED
}

/// Sleeps until Ctrl-C, or for `duration` where one is given.
pub(crate) fn wait(duration: Option<Duration>) {
    let flag = flag();
    let start = Instant::now();
    while !flag.load(Ordering::Relaxed) && duration.is_none_or(|d| start.elapsed() < d) {
        std::thread::sleep(Duration::from_millis(20));
    }
}
