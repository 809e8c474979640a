//! Ctrl-C, SIGTERM and SIGHUP end a run as its duration would (motor off, log ended), and a diagnosis with what is
//! known so far. A file that may not become larger (SIGXFSZ) is an error as that of a full disk, and no end of the
//! program.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock, Once};
use std::time::{Duration, Instant};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag::{register, register_conditional_shutdown};

static INTERRUPTED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);
/// Whether the next signal ends the process at once.
static NEXT_ENDS: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// Exit code of a program that Ctrl-C ended: 128 and the signal's number, as shells have it.
pub(crate) const EXIT: u8 = 130;

/// The signals that ask for an end. SIGHUP that was ignored from the start stays so: `nohup furuta run` outlives its
/// terminal. A script's background job
/// ignores SIGINT from the start, and a motor must be stopped all the same.
fn ends() -> impl Iterator<Item = i32> {
    #[cfg(unix)]
    let hang_up = (ignored() & 1 << (signal_hook::consts::SIGHUP - 1) == 0)
        .then_some(signal_hook::consts::SIGHUP);
    #[cfg(not(unix))]
    let hang_up = None;
    [SIGINT, SIGTERM].into_iter().chain(hang_up)
}

/// The signals that this process was told to ignore, a bit each; none where the system does not tell as Linux does.
#[cfg(unix)]
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .unwrap_or(0)
}

/// A flag that Ctrl-C, SIGTERM and SIGHUP set. Where the system allows no handler, they end the process; the rig's
/// watchdog and the log's chunks are made for that.
pub(crate) fn flag() -> &'static AtomicBool {
    static HANDLERS: Once = Once::new();
    HANDLERS.call_once(|| {
        for signal in ends() {
            // In this order: the first signal must not find its own flag.
            let _ = register_conditional_shutdown(signal, i32::from(EXIT), Arc::clone(&NEXT_ENDS));
            let _ = register(signal, Arc::clone(&INTERRUPTED));
        }
    });
    &INTERRUPTED
}

/// As [`flag`], where a second signal ends the process at once: for what moves no rig.
pub(crate) fn flag_then_exit() -> &'static AtomicBool {
    static HANDLERS: Once = Once::new();
    let flag = flag();
    HANDLERS.call_once(|| {
        for signal in ends() {
            let _ = register(signal, Arc::clone(&NEXT_ENDS));
        }
    });
    flag
}

/// From now on a write beyond the largest size that a file may have (`ulimit -f`) fails, as on a full disk. Without
/// this the signal would end the process in the middle of a run.
pub(crate) fn survive_file_limits() {
    #[cfg(unix)]
    {
        static BEYOND: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);
        // Where this is refused, the rig's watchdog switches the motor off.
        let _ = register(signal_hook::consts::SIGXFSZ, Arc::clone(&BEYOND));
    }
}

/// Sleeps until Ctrl-C, or for `duration` where one is given.
pub(crate) fn wait(duration: Option<Duration>) {
    let flag = flag();
    let start = Instant::now();
    while !flag.load(Ordering::Relaxed) && duration.is_none_or(|d| start.elapsed() < d) {
        std::thread::sleep(Duration::from_millis(20));
    }
}
