//! Long work without the GIL: Ctrl-C ends it, progress is shown, and what a law of one's own raised is raised again.

use crate::law;
use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
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

/// Does `work` on a thread of its own, on this many cores if that is said, while this one calls `progress` with what is
/// done.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Watch) -> T + Send,
) -> PyResult<T> {
    let watch = Watch::default();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build();
    let pool = pool.map_err(crate::error::error)?;
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
        interrupted
            .and_then(|()| worker.join().map_err(|_| crate::error::error("a flight ended by a panic; report it")))
    });
    match law::take_error() {
        Some(error) => Err(error),
        None => ended,
    }
}
