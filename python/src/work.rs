//! Runs long work without the GIL. Ctrl-C ends it, progress is reported, and an exception of a user's law is raised
//! again.

use crate::error::error;
use crate::law;
use pyo3::prelude::*;
use rayon::ThreadPool;
use std::process;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

/// Period of the checks for an interrupt.
const PERIOD: Duration = Duration::from_millis(50);

/// Progress of the work, and a request to end it.
#[derive(Default)]
pub(crate) struct WorkProgress {
    done: AtomicU64,
    stop: AtomicBool,
}

impl WorkProgress {
    /// Adds `count` to the finished units of work.
    pub(crate) fn add(&self, count: u64) {
        self.done.fetch_add(count, Ordering::Relaxed);
    }

    /// Sets the number of finished units of work.
    pub(crate) fn set(&self, count: u64) {
        self.done.store(count, Ordering::Relaxed);
    }

    /// True if the work shall end.
    pub(crate) fn is_over(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Returns the flag that requests the end.
    pub(crate) fn stop(&self) -> &AtomicBool {
        &self.stop
    }
}

fn threads_of(count: usize) -> PyResult<ThreadPool> {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().map_err(error)
}

/// Threads kept between calls, with the number of the process that they belong to.
static KEPT: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Returns threads on all cores. The threads of a parent do not exist in a forked process, which gets its own.
fn kept_threads() -> PyResult<Arc<ThreadPool>> {
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, pool)) = kept.as_ref().filter(|(owner, _)| *owner == process::id()) {
        return Ok(Arc::clone(pool));
    }
    let pool = Arc::new(threads_of(0)?);
    let before = kept.replace((process::id(), Arc::clone(&pool)));
    // The parent's pool is never dropped, since its threads would never answer here.
    core::mem::forget(before);
    Ok(pool)
}

/// Does work of the size `whole` in parts of at most `slice`, on all cores. Ctrl-C ends it between two parts.
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

/// Runs `work` on another thread, with `threads` threads or one per core. Meanwhile, this thread calls `progress` with
/// the number of finished units.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&WorkProgress) -> T + Send,
) -> PyResult<T> {
    let watch = WorkProgress::default();
    let pool = threads_of(threads.unwrap_or(0))?;
    law::forget_error();
    let ended = thread::scope(|scope| {
        let worker = scope.spawn(|| pool.install(|| work(&watch)));
        let (mut shown, mut interrupted) = (0, Ok(()));
        while !worker.is_finished() {
            // The first wait is short, so that brief work does not wait for a whole period.
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
        interrupted
            .and_then(|()| worker.join().map_err(|_| error("a flight ended with a panic; please report this bug")))
    });
    match law::take_error() {
        Some(error) => Err(error),
        None => ended,
    }
}
