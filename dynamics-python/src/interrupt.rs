//! Long work without Python's lock, which Ctrl-C ends.

use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::law::Interruption;

/// How long Python's signals may wait: short enough to feel immediate, long enough to cost nothing.
const BETWEEN_SIGNALS: Duration = Duration::from_millis(50);

/// What the main thread of a process has on Linux: large models are evaluated on the stack.
const STACK: usize = 8 << 20;

/// Does the work without Python's lock. On the main thread, where Python handles signals, another thread
/// works, and this one looks for signals: an exception of theirs (`KeyboardInterrupt`) raises the flag of the
/// interruption and is kept there.
pub(crate) fn without_lock<T: Send>(
    py: Python<'_>,
    interruption: &Interruption,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    if !is_main_thread(py)? {
        return Ok(py.detach(work));
    }
    py.detach(|| {
        thread::scope(|scope| {
            let (done, wait) = sync_channel(1);
            let worker = thread::Builder::new().stack_size(STACK).spawn_scoped(scope, move || {
                let result = work();
                // Only a receiver that is gone would be an error, and this function holds it.
                let _ = done.send(());
                result
            });
            let worker =
                worker.map_err(|error| PyRuntimeError::new_err(format!("no thread for the run: {error}")))?;
            while let Err(RecvTimeoutError::Timeout) = wait.recv_timeout(BETWEEN_SIGNALS) {
                if let Err(error) = Python::attach(|py| py.check_signals()) {
                    interruption.raise(error);
                }
            }
            Ok(worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
        })
    })
}

fn is_main_thread(py: Python<'_>) -> PyResult<bool> {
    let threading = py.import("threading")?;
    Ok(threading.call_method0("current_thread")?.is(&threading.call_method0("main_thread")?))
}
