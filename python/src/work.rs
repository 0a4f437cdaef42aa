//! Long work without the GIL: Ctrl-C ends it, progress is shown, and what a law of one's own raised is raised again.

use crate::error::error;
use crate::law;
use pyo3::prelude::*;
use rayon::ThreadPool;
use std::process;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

/// How often the interpreter is asked whether it was interrupted.
const PERIOD: Duration = Duration::from_millis(50);

/// How far work has come, and whether it is to end.
#[derive(Default)]
pub(crate) struct Watch {
    done: AtomicU64,
    stop: AtomicBool,
}

impl Watch {
    /// `count` more are done.
    pub(crate) fn add(&self, count: u64) {
        self.done.fetch_add(count, Ordering::Relaxed);
    }

    /// `count` are done.
    pub(crate) fn set(&self, count: u64) {
        self.done.store(count, Ordering::Relaxed);
    }

    /// True if work is to end.
    pub(crate) fn is_over(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// The flag that becomes true then.
    pub(crate) fn stop(&self) -> &AtomicBool {
        &self.stop
    }
}

fn threads_of(count: usize) -> PyResult<ThreadPool> {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().map_err(error)
}

/// Threads that stay, of the process with this number.
static KEPT: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Threads on all cores. A process that was forked has those of its parent no more, and gets its own.
fn kept_threads() -> PyResult<Arc<ThreadPool>> {
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, pool)) = kept.as_ref().filter(|(owner, _)| *owner == process::id()) {
        return Ok(Arc::clone(pool));
    }
    let pool = Arc::new(threads_of(0)?);
    let before = kept.replace((process::id(), Arc::clone(&pool)));
    // Nobody answers there any more: it is left as it is.
    core::mem::forget(before);
    Ok(pool)
}

/// Does `work` in `slices` of a whole, on all cores; Ctrl-C ends it between them.
pub(crate) fn in_slices(py: Python<'_>, whole: u64, slice: u64, mut work: impl FnMut(u64) + Send) -> PyResult<()> {
    let pool = kept_threads()?;
    let mut left = whole;
    while left > 0 {
        let part = left.min(slice);
        py.detach(|| pool.install(|| work(part)));
        left -= part;
        py.check_signals()?;
    }
    Ok(())
}

/// Does `work` on a thread of its own, on this many cores if that is said, while this one calls `progress` with what is
/// done.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Watch) -> T + Send,
) -> PyResult<T> {
    let watch = Watch::default();
    let pool = threads_of(threads.unwrap_or(0))?;
    law::forget_error();
    let ended = thread::scope(|scope| {
        let worker = scope.spawn(|| pool.install(|| work(&watch)));
        let (mut shown, mut interrupted) = (0, Ok(()));
        while !worker.is_finished() {
            // Short until something is done, so that brief work does not wait for a whole period.
            py.detach(|| thread::sleep(PERIOD.min(if shown == 0 { PERIOD / 25 } else { PERIOD })));
            let done = watch.done.load(Ordering::Relaxed);
            if interrupted.is_ok() {
                interrupted = py.check_signals();
            }
            if let (Some(progress), true, true) = (progress, interrupted.is_ok(), done != shown) {
                interrupted = progress.call1((done,)).map(drop);
            }
            shown = done;
            if interrupted.is_err() || law::has_error() {
                watch.stop.store(true, Ordering::Relaxed);
            }
        }
        interrupted.and_then(|()| worker.join().map_err(|_| error("a flight ended by a panic; report it")))
    });
    match law::take_error() {
        Some(error) => Err(error),
        None => ended,
    }
}
