//! Progress of a command on stderr: a bar on a terminal, otherwise lines.

use super::terminal::say;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, stderr};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Number of parts of the work. Without a terminal, a line is written after each part.
const PARTS: u64 = 10;
/// Time without a line after which a further line is written. Doubles with each such line.
const SILENCE: Duration = Duration::from_secs(5);
/// Upper limit of the doubled time, so that the log of a long command stays short.
const SILENCE_MAX: Duration = Duration::from_secs(30);

/// Progress of a command.
pub(crate) struct CommandProgress {
    shared: Arc<SharedProgress>,
    /// Stops the [thread](remind) that writes lines after a silence, when dropped.
    silence: Option<(Sender<()>, JoinHandle<()>)>,
}

/// State shared by all threads of the command.
struct SharedProgress {
    name: String,
    unit: &'static str,
    total: u64,
    start: Instant,
    /// Progress bar; `None` without a terminal.
    bar: Option<ProgressBar>,
    state: Mutex<ProgressState>,
}

/// Mutable state.
struct ProgressState {
    count: UnitCount,
    /// Text between count and rate.
    note: String,
    /// Time of the last line.
    said: Instant,
}

/// Number of units done.
#[derive(Clone, Copy, Default)]
struct UnitCount {
    done: u64,
    /// Number done by an earlier run, which is left out of the rate.
    before: u64,
}

impl CommandProgress {
    /// Creates the progress of `total` units, such as flights. An earlier run has done `before` of them. `name`
    /// identifies the progress in a log.
    pub(crate) fn new(name: &str, unit: &'static str, total: u64, before: u64) -> Self {
        let start = Instant::now();
        let bar = stderr().is_terminal().then(|| bar(total));
        let count = UnitCount { done: before, before };
        let state = Mutex::new(ProgressState { count, note: String::new(), said: start });
        let shared = Arc::new(SharedProgress { name: name.into(), unit, total, start, bar, state });
        shared.show(&mut shared.state(), true);
        let silence = shared.bar.is_none().then(|| {
            let (sender, end) = channel();
            let shared = Arc::clone(&shared);
            let remind = move || {
                let (mut silence, mut wait) = (SILENCE, SILENCE);
                while end.recv_timeout(wait) == Err(RecvTimeoutError::Timeout) {
                    let mut state = shared.state();
                    wait = silence.saturating_sub(state.said.elapsed());
                    if wait.is_zero() {
                        shared.show(&mut state, true);
                        silence = (2 * silence).min(SILENCE_MAX);
                        wait = silence;
                    }
                }
            };
            (sender, std::thread::spawn(remind))
        });
        CommandProgress { shared, silence }
    }

    /// Creates hidden progress, for short commands.
    pub(crate) fn hidden() -> Self {
        let state =
            Mutex::new(ProgressState { count: UnitCount::default(), note: String::new(), said: Instant::now() });
        let bar = Some(ProgressBar::hidden());
        let shared = SharedProgress { name: String::new(), unit: "", total: 0, start: Instant::now(), bar, state };
        CommandProgress { shared: Arc::new(shared), silence: None }
    }

    /// Adds to the number of units done.
    pub(crate) fn add(&self, more: u64) {
        let mut state = self.shared.state();
        // The product of two counts cannot overflow 128 bits.
        let part = |done: u64| u128::from(done) * u128::from(PARTS) / u128::from(self.shared.total.max(1));
        let old = part(state.count.done);
        state.count.done += more;
        let due = part(state.count.done) > old;
        self.shared.show(&mut state, due);
    }

    /// Sets the text between count and rate.
    pub(crate) fn note(&self, note: String) {
        let mut state = self.shared.state();
        state.note = note;
        self.shared.show(&mut state, false);
    }
}

impl Drop for CommandProgress {
    fn drop(&mut self) {
        if let Some(bar) = &self.shared.bar {
            bar.finish_and_clear();
        }
        if let Some((sender, thread)) = self.silence.take() {
            drop(sender);
            // The thread has no result.
            let _ = thread.join();
        }
    }
}

impl SharedProgress {
    fn state(&self) -> MutexGuard<'_, ProgressState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Updates the bar. Without a bar, writes a line if one is `due`.
    fn show(&self, state: &mut ProgressState, due: bool) {
        let text = || words(state.count, self.total, self.unit, &state.note, self.start.elapsed());
        match &self.bar {
            Some(bar) if !bar.is_hidden() => {
                bar.set_position(state.count.done);
                bar.set_message(text());
            }
            Some(_) => {}
            None if due => {
                say(&format!("{}: {}", self.name, text()));
                state.said = Instant::now();
            }
            None => {}
        }
    }
}

fn bar(total: u64) -> ProgressBar {
    let bar = ProgressBar::new(total);
    bar.set_style(ProgressStyle::with_template("{bar:30} {msg}").unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.enable_steady_tick(Duration::from_millis(250));
    bar
}

/// Formats `120 of 10000 flights, 60 per second, 165 s left`. Leaves rate and remaining time out before the first unit
/// is done.
fn words(UnitCount { done, before }: UnitCount, total: u64, unit: &str, note: &str, elapsed: Duration) -> String {
    let mut text = format!("{done} of {total} {unit}{note}");
    let (flown, seconds) = ((done - before) as f64, elapsed.as_secs_f64());
    if flown > 0.0 && seconds > 0.0 && done < total {
        text += &format!(", {}, {} left", rate(flown / seconds), wait((total - done) as f64 * seconds / flown));
    }
    text
}

/// Formats a rate as a whole number, per second, minute or hour, whichever is the first to give several units.
fn rate(per_s: f64) -> String {
    const SEVERAL: f64 = 9.5;
    let (rate, time) = match per_s {
        _ if per_s >= SEVERAL => (per_s, "per second"),
        _ if per_s * 60.0 >= SEVERAL => (per_s * 60.0, "per minute"),
        _ => (per_s * 3600.0, "per hour"),
    };
    format!("{rate:.0} {time}")
}

/// Formats the remaining time, at least a second.
fn wait(seconds: f64) -> String {
    match seconds {
        _ if seconds < 100.0 => format!("{:.0} s", seconds.ceil().max(1.0)),
        _ if seconds < 100.0 * 60.0 => format!("{:.0} min", (seconds / 60.0).ceil()),
        _ => format!("{:.0} h", (seconds / 3600.0).ceil()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(done: u64, before: u64, seconds: f64) -> String {
        words(UnitCount { done, before }, 10_000, "flights", "", Duration::from_secs_f64(seconds))
    }

    #[test]
    fn rate_and_wait_are_left_out_before_the_first_flight() {
        assert_eq!(said(0, 0, 0.0), "0 of 10000 flights");
        assert_eq!(said(0, 0, 30.0), "0 of 10000 flights");
        assert_eq!(said(64, 64, 30.0), "64 of 10000 flights");
        assert_eq!(said(10_000, 64, 30.0), "10000 of 10000 flights");
    }

    #[test]
    fn flights_of_an_earlier_run_do_not_count_for_the_rate() {
        assert_eq!(said(1000, 0, 10.0), "1000 of 10000 flights, 100 per second, 90 s left");
        assert_eq!(said(6000, 5000, 10.0), "6000 of 10000 flights, 100 per second, 40 s left");
    }

    #[test]
    fn rates_are_whole_and_waits_are_not_zero() {
        assert_eq!(said(9999, 0, 10.0), "9999 of 10000 flights, 1000 per second, 1 s left");
        assert_eq!(said(100, 0, 10.0), "100 of 10000 flights, 10 per second, 17 min left");
        assert_eq!(said(100, 0, 100.0), "100 of 10000 flights, 60 per minute, 3 h left");
        assert_eq!(said(100, 0, 1000.0), "100 of 10000 flights, 360 per hour, 28 h left");
    }
}
