//! Work on several threads in a process that was forked from the one that imported this module: the threads of rayon's
//! global pool stay behind with the parent, and work that is given to it would wait for good.

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::{Arc, Mutex, OnceLock};

/// The process that imported this module.
static IMPORTED: OnceLock<u32> = OnceLock::new();

/// The pool of a forked process, with the process it is of.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Remembers this process as the one that imports the module.
pub(crate) fn imported() {
    let _ = IMPORTED.set(std::process::id());
}

/// What `work` gives, on threads of this process: as it is in the process that imported this module, in a pool of its
/// own in one that was forked from it.
pub(crate) fn here<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let process = std::process::id();
    if IMPORTED.get().is_none_or(|imported| *imported == process) {
        return work();
    }
    match pool(process) {
        Some(pool) => pool.install(work),
        // Without threads of its own there is nothing better.
        None => work(),
    }
}

/// The pool of this process, made where there is none yet. Another thread may have held the lock in the moment of the
/// fork, and does not let go of it here: nothing waits for it.
fn pool(process: u32) -> Option<Arc<ThreadPool>> {
    let known = |kept: &Option<(u32, Arc<ThreadPool>)>| match kept {
        Some((of, pool)) if *of == process => Some(Arc::clone(pool)),
        _ => None,
    };
    if let Some(pool) = POOL.try_lock().ok().and_then(|kept| known(&kept)) {
        return Some(pool);
    }
    let made = Arc::new(ThreadPoolBuilder::new().build().ok()?);
    if let Ok(mut kept) = POOL.try_lock() {
        if let Some(pool) = known(&kept) {
            return Some(pool);
        }
        // The threads of a pool of the process before are not here to be ended.
        std::mem::forget(kept.replace((process, Arc::clone(&made))));
    }
    Some(made)
}
