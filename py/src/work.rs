//! Long work on a thread of its own, while the caller's hears signals and tells of progress.

use std::collections::BTreeSet;
use std::ffi::CString;
use std::panic::resume_unwind;
use std::process;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::thread;
use std::time::Duration;

use hemicube::progress::{Cancelled, Progress};
use pyo3::prelude::*;

use crate::failure::Failure;

/// How often signals are looked for.
const LOOK: Duration = Duration::from_millis(50);

/// As much as the main thread of a program has.
const STACK: usize = 8 << 20;

/// The process that worked first: the threads that all work is shared out among are its own.
static PROCESS: OnceLock<u32> = OnceLock::new();

/// What is heard of work, and whether it is to stop.
#[derive(Debug, Default)]
struct Heard {
    stopped: AtomicBool,
    done: AtomicU64,
    /// The stage and its units in all.
    stage: Mutex<(String, u64)>,
    warnings: Mutex<BTreeSet<String>>,
}

impl Progress for Heard {
    fn stage(&self, name: &str, total: u64) {
        let mut stage = self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        *stage = (name.to_owned(), total);
        self.done.store(0, Relaxed);
    }

    fn advance(&self, n: u64) -> Result<(), Cancelled> {
        self.done.fetch_add(n, Relaxed);
        if self.stopped.load(Relaxed) { Err(Cancelled) } else { Ok(()) }
    }

    fn warn(&self, message: &str) {
        let mut warnings = self.warnings.lock().unwrap_or_else(PoisonError::into_inner);
        warnings.insert(message.to_owned());
    }
}

impl Heard {
    /// The stage, its units in all and those done, which are not those of the next.
    fn now(&self) -> (String, u64, u64) {
        let stage = self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        (stage.0.clone(), stage.1, self.done.load(Relaxed))
    }

    /// Raises what a signal means, and tells `progress(stage, done, total)`.
    fn look(&self, py: Python<'_>, progress: Option<&Py<PyAny>>) -> PyResult<()> {
        py.check_signals()?;
        if let Some(progress) = progress {
            let (stage, total, done) = self.now();
            progress.call1(py, (stage, done, total))?;
        }
        Ok(())
    }
}

/// What `work` yields, which `progress(stage, done, total)` hears of when it begins, a few times a
/// second, and when it has ended well. Other threads of Python go on meanwhile. Ctrl-C, and what
/// `progress` raises, stop the work.
pub fn run<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&dyn Progress) -> Result<T, Failure> + Send,
) -> PyResult<T> {
    refuse_forked(py)?;
    let heard = &Heard::default();
    let progress = progress.as_ref();
    let (ended, stopped) = py.detach(|| {
        thread::scope(|scope| {
            // Closed as soon as the work ends, however it does.
            let (working, ends) = mpsc::channel::<()>();
            let work = move || {
                let _working = working;
                work(heard)
            };
            let thread = thread::Builder::new().name("hemicube".into()).stack_size(STACK);
            let thread = match thread.spawn_scoped(scope, work) {
                Ok(thread) => thread,
                Err(e) => {
                    return (Err(Failure::Failed(format!("no thread to work on: {e}"))), None);
                }
            };
            let mut stopped = None;
            // Short work is heard of too.
            loop {
                if stopped.is_none() {
                    stopped = Python::attach(|py| heard.look(py, progress)).err();
                    heard.stopped.store(stopped.is_some(), Relaxed);
                }
                if ends.recv_timeout(LOOK) != Err(RecvTimeoutError::Timeout) {
                    break;
                }
            }
            (thread.join().unwrap_or_else(|panic| resume_unwind(panic)), stopped)
        })
    });
    if let Some(error) = stopped {
        return Err(error);
    }
    let done = ended.map_err(|failure| failure.raise(py))?;
    heard.look(py, progress)?;
    let warnings =
        std::mem::take(&mut *heard.warnings.lock().unwrap_or_else(PoisonError::into_inner));
    warnings.iter().try_for_each(|text| warn(py, text))?;
    Ok(done)
}

/// What `work` yields that cannot be stopped, like reading a file. At Ctrl-C it is left alone, and
/// what it yields is dropped.
pub fn run_unheard<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    refuse_forked(py)?;
    let (done, ends) = mpsc::channel();
    let thread = thread::Builder::new().name("hemicube".into()).stack_size(STACK);
    let sending = move || {
        // Nobody may listen any more.
        let _ = done.send(work());
    };
    if let Err(e) = thread.spawn(sending) {
        return Err(Failure::Failed(format!("no thread to work on: {e}")).raise(py));
    }
    let ended = py.detach(move || {
        loop {
            match ends.recv_timeout(LOOK) {
                Err(RecvTimeoutError::Timeout) => Python::attach(|py| py.check_signals())?,
                ended => return Ok::<_, PyErr>(ended),
            }
        }
    })?;
    let panicked = |_| Failure::Failed("the work ended without a result".to_owned());
    ended.map_err(panicked).flatten().map_err(|failure| failure.raise(py))
}

/// A forked process has none of the threads that work.
fn refuse_forked(py: Python<'_>) -> PyResult<()> {
    if *PROCESS.get_or_init(process::id) != process::id() {
        let text = "this process was forked from one that has worked already, and has none of its \
                    threads; use the start method 'spawn' or 'forkserver' of multiprocessing";
        return Err(Failure::Failed(text.to_owned()).raise(py));
    }
    Ok(())
}

/// Says something doubtful about a result.
pub fn warn(py: Python<'_>, text: &str) -> PyResult<()> {
    let category = py.import("hemicube._errors")?.getattr("ModelWarning")?;
    PyErr::warn(py, &category, &CString::new(text)?, 2)
}
