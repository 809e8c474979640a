//! Work that Python waits for: in a thread of its own, so that Ctrl-C and progress work while Rust is at it.

use crate::forked::here;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// How often Ctrl-C is looked for.
const PATIENCE: Duration = Duration::from_millis(50);

/// What `work` gives. Ctrl-C raises `KeyboardInterrupt` within a twentieth of a second; the work, which owns all it
/// needs, then goes on unseen to its end, and nothing waits for it.
pub(crate) fn awaited<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    told(py, |_: &Sender<()>| work(), |()| Ok(()))
}

/// The same for work that tells how far it is: `tell` hears the latest in the calling thread, and an error of its ends
/// the call.
pub(crate) fn told<T: Send + 'static, P: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Sender<P>) -> T + Send + 'static,
    mut tell: impl FnMut(P) -> PyResult<()>,
) -> PyResult<T> {
    let (send, receive) = channel::<P>();
    let worker = std::thread::spawn(move || here(|| work(&send)));
    // The receiver sits in a Mutex only because a reference to it crosses `detach`.
    let receive = Mutex::new(receive);
    loop {
        let news = py.detach(|| latest(&receive));
        py.check_signals()?;
        match news {
            Ok(news) => tell(news)?,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    py.detach(|| worker.join()).map_err(|_| {
        PyRuntimeError::new_err(
            "the work broke off: this is a mistake of the program, please report it",
        )
    })
}

/// The last of what has come, or the first to come.
fn latest<P>(receive: &Mutex<Receiver<P>>) -> Result<P, RecvTimeoutError> {
    let Ok(receive) = receive.lock() else {
        return Err(RecvTimeoutError::Disconnected);
    };
    let first = receive.recv_timeout(PATIENCE)?;
    Ok(receive.try_iter().last().unwrap_or(first))
}
