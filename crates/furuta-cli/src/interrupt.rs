//! Ctrl-C ends a run as its duration would (motor off, log ended), and a diagnosis with what is known so far.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
static SECOND_ENDS: AtomicBool = AtomicBool::new(false);

/// Exit code of a program that Ctrl-C ended: 128 and the signal's number, as shells have it.
pub(crate) const EXIT: u8 = 130;

/// A flag that Ctrl-C sets. Where the system allows no handler, Ctrl-C ends the process; the rig's watchdog and the
/// log's chunks are made for that.
pub(crate) fn flag() -> &'static AtomicBool {
    // An error means that the handler is there already.
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) && SECOND_ENDS.load(Ordering::Relaxed) {
            std::process::exit(i32::from(EXIT));
        }
    });
    &INTERRUPTED
}

/// As [`flag`], where a second Ctrl-C ends the process at once: for what moves no rig.
pub(crate) fn flag_then_exit() -> &'static AtomicBool {
    SECOND_ENDS.store(true, Ordering::Relaxed);
    flag()
}

/// Sleeps until Ctrl-C, or for `duration` where one is given.
pub(crate) fn wait(duration: Option<Duration>) {
    let flag = flag();
    let start = Instant::now();
    while !flag.load(Ordering::Relaxed) && duration.is_none_or(|d| start.elapsed() < d) {
        std::thread::sleep(Duration::from_millis(20));
    }
}
