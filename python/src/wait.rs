//! Work without the interpreter's lock, which Ctrl-C ends.

use halflight::render::Stop;
use pyo3::prelude::*;
use std::panic::resume_unwind;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// Signals are looked for this often: a person does not notice, and nor does the work.
const LOOK: Duration = Duration::from_millis(50);

/// What a signal handler raised, if one did.
fn look() -> PyResult<()> {
    let signals = |py: Python<'_>| -> PyResult<()> { py.check_signals() };
    Python::attach(signals)
}

/// Does `work` in a thread of its own. Other Python threads run meanwhile; where a signal handler raises (Ctrl-C), `stop` is
/// asked, and the exception follows as soon as the work has ended.
pub fn wait<T: Send>(py: Python<'_>, stop: &Stop, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| {
        thread::scope(|scope| {
            let (done, finished) = channel::<()>();
            let worker = scope.spawn(move || {
                let made = work();
                drop(done);
                made
            });
            let mut heard = Ok(());
            while heard.is_ok() && finished.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                heard = look();
            }
            if heard.is_err() {
                stop.ask();
            }
            let made = worker.join().unwrap_or_else(|panic| resume_unwind(panic));
            // Also where all work is done between two looks.
            heard.and_then(|()| look()).map(|()| made)
        })
    })
}
