//! How far a command has come, on stderr: a bar for people, lines for the log of a machine without a terminal.

use super::terminal::say;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, stderr};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Without a terminal there is a line at the start, another whenever a further tenth is done, ...
const PARTS: u64 = 10;
/// ... and another when there has been none for so long.
const SILENCE: Duration = Duration::from_secs(60);

/// How far a command has come.
pub(crate) struct Progress {
    shared: Arc<Shared>,
    /// Ends the [thread](remind) that breaks the silence, by being dropped.
    silence: Option<(Sender<()>, JoinHandle<()>)>,
}

/// What every thread of the command knows of it.
struct Shared {
    name: String,
    unit: &'static str,
    total: u64,
    start: Instant,
    /// None without a terminal.
    bar: Option<ProgressBar>,
    state: Mutex<State>,
}

/// What changes on the way.
struct State {
    count: Count,
    /// Between count and rate.
    note: String,
    /// When there was a line.
    said: Instant,
}

/// What is done.
#[derive(Clone, Copy, Default)]
struct Count {
    done: u64,
    /// By an earlier run: this one has not spent any time on it.
    before: u64,
}

impl Progress {
    /// Of `total` `unit`, such as flights, `before` of which an earlier run has done; `name` tells them from others in a
    /// log.
    pub(crate) fn new(name: &str, unit: &'static str, total: u64, before: u64) -> Self {
        let start = Instant::now();
        let bar = stderr().is_terminal().then(|| bar(total));
        let count = Count { done: before, before };
        let state = Mutex::new(State { count, note: String::new(), said: start });
        let shared = Arc::new(Shared { name: name.into(), unit, total, start, bar, state });
        shared.show(&mut shared.state(), true);
        let silence = shared.bar.is_none().then(|| {
            let (sender, end) = channel();
            let shared = Arc::clone(&shared);
            let remind = move || {
                while end.recv_timeout(SILENCE) == Err(RecvTimeoutError::Timeout) {
                    let mut state = shared.state();
                    if state.said.elapsed() >= SILENCE {
                        shared.show(&mut state, true);
                    }
                }
            };
            (sender, std::thread::spawn(remind))
        });
        Progress { shared, silence }
    }

    /// Without anything to be seen, of what will not take long.
    pub(crate) fn hidden() -> Self {
        let state = Mutex::new(State { count: Count::default(), note: String::new(), said: Instant::now() });
        let bar = Some(ProgressBar::hidden());
        let shared = Shared { name: String::new(), unit: "", total: 0, start: Instant::now(), bar, state };
        Progress { shared: Arc::new(shared), silence: None }
    }

    /// So many more are done.
    pub(crate) fn add(&self, more: u64) {
        let mut state = self.shared.state();
        let part = |done: u64| u128::from(done) * u128::from(PARTS) / u128::from(self.shared.total.max(1));
        let old = part(state.count.done);
        state.count.done += more;
        let due = part(state.count.done) > old;
        self.shared.show(&mut state, due);
    }

    /// Says `note` between count and rate from now on.
    pub(crate) fn note(&self, note: String) {
        let mut state = self.shared.state();
        state.note = note;
        self.shared.show(&mut state, false);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.shared.bar {
            bar.finish_and_clear();
        }
        if let Some((sender, thread)) = self.silence.take() {
            drop(sender);
            // It has nothing to say but lines.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Brings the bar up to date; or, where there is none, writes a line if one is `due`.
    fn show(&self, state: &mut State, due: bool) {
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

/// `120 of 10000 flights, 60 a second, 165 s left`; how fast and how long nobody knows before the first.
fn words(Count { done, before }: Count, total: u64, unit: &str, note: &str, elapsed: Duration) -> String {
    let mut text = format!("{done} of {total} {unit}{note}");
    let (flown, seconds) = ((done - before) as f64, elapsed.as_secs_f64());
    if flown > 0.0 && seconds > 0.0 && done < total {
        text += &format!(", {}, {} left", rate(flown / seconds), wait((total - done) as f64 * seconds / flown));
    }
    text
}

/// In whole ones: of a time in which there are several.
fn rate(per_s: f64) -> String {
    const SEVERAL: f64 = 9.5;
    let (rate, time) = match per_s {
        _ if per_s >= SEVERAL => (per_s, "a second"),
        _ if per_s * 60.0 >= SEVERAL => (per_s * 60.0, "a minute"),
        _ => (per_s * 3600.0, "an hour"),
    };
    format!("{rate:.0} {time}")
}

/// A time to wait, at least a second of it.
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
        words(Count { done, before }, 10_000, "flights", "", Duration::from_secs_f64(seconds))
    }

    #[test]
    fn nothing_is_promised_before_there_is_anything_to_go_by() {
        assert_eq!(said(0, 0, 0.0), "0 of 10000 flights");
        assert_eq!(said(0, 0, 30.0), "0 of 10000 flights");
        assert_eq!(said(64, 64, 30.0), "64 of 10000 flights");
        assert_eq!(said(10_000, 64, 30.0), "10000 of 10000 flights");
    }

    #[test]
    fn what_an_earlier_run_has_done_does_not_count_for_the_rate() {
        assert_eq!(said(1000, 0, 10.0), "1000 of 10000 flights, 100 a second, 90 s left");
        assert_eq!(said(6000, 5000, 10.0), "6000 of 10000 flights, 100 a second, 40 s left");
    }

    #[test]
    fn rates_are_whole_and_waits_never_nothing() {
        assert_eq!(said(9999, 0, 10.0), "9999 of 10000 flights, 1000 a second, 1 s left");
        assert_eq!(said(100, 0, 10.0), "100 of 10000 flights, 10 a second, 17 min left");
        assert_eq!(said(100, 0, 100.0), "100 of 10000 flights, 60 a minute, 3 h left");
        assert_eq!(said(100, 0, 1000.0), "100 of 10000 flights, 360 an hour, 28 h left");
    }
}
