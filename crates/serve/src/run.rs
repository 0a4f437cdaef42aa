//! Runs the server: vehicles, ports, time and text lines together.

use crate::hook::{ServerHook, TimeFlow, TimeRate};
use crate::pace::{Pace, Wait};
use crate::ports::Ports;
use crate::server::{LINE_MAX, Server, ServerAction};
use std::io::{self, BufRead, Read};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

/// Reason why a run has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunEnd {
    /// Somebody has sent `quit`.
    Quit,
    /// The stop flag was set.
    Stopped,
    /// In lockstep, the input has ended, so time cannot advance any more.
    Silent,
}

/// Interfaces through which clients reach the vehicles.
pub struct Interfaces<'a> {
    /// Ports of all vehicles.
    pub ports: &'a mut Ports,
    /// Another interface, such as a web page; `()` if there is none.
    pub hook: &'a mut dyn ServerHook,
}

/// Text lines from an input, read in the background.
pub struct InputLines {
    lines: Receiver<String>,
    over: bool,
}

/// Longest wait for a line before the stop flag is checked again.
const NAP: Duration = Duration::from_millis(50);
/// Largest number of queued lines, and largest number of lines that are carried out between two steps.
const LINES_MAX: usize = 16;
/// Least time between two reports of lost time.
const REPORTED_EVERY: Duration = Duration::from_secs(5);

impl InputLines {
    /// Reads lines of `source` in a separate thread.
    pub fn of(source: impl BufRead + Send + 'static) -> Self {
        Self::paced(source, || ())
    }

    /// Reads lines of `source` in a separate thread, which calls `wait` before it passes on each line.
    pub fn paced(mut source: impl BufRead + Send + 'static, wait: impl Fn() + Send + 'static) -> Self {
        let (sender, lines) = sync_channel(LINES_MAX);
        thread::spawn(move || {
            // Invalid UTF-8 is passed on, too, and refused later.
            while let Ok(Some(line)) = read_line(&mut source) {
                wait();
                if sender.send(String::from_utf8_lossy(&line).into_owned()).is_err() {
                    return;
                }
            }
        });
        InputLines { lines, over: false }
    }

    /// Returns the next line, if there is one.
    fn next(&mut self) -> Option<String> {
        let line = self.lines.try_recv();
        self.over |= line == Err(TryRecvError::Disconnected);
        line.ok()
    }

    /// Waits a short time for the next line.
    fn wait(&mut self) -> Option<String> {
        if self.over {
            // After the end of the input, waiting would return at once and the loop would spin.
            thread::sleep(NAP);
            return None;
        }
        let line = self.lines.recv_timeout(NAP);
        self.over |= line == Err(RecvTimeoutError::Disconnected);
        line.ok()
    }
}

/// Returns the next line; `None` at the end. Of a line that is too long it returns the beginning, which is then
/// refused.
fn read_line(source: &mut impl BufRead) -> io::Result<Option<Vec<u8>>> {
    // The reader takes one byte more than allowed, and the line ending of two bytes.
    let most = LINE_MAX as u64 + 3;
    let mut line = Vec::new();
    if source.take(most).read_until(b'\n', &mut line)? == 0 {
        return Ok(None);
    }
    let mut rest = Vec::new();
    while !line.ends_with(b"\n") && !rest.ends_with(b"\n") {
        rest.clear();
        if source.take(most).read_until(b'\n', &mut rest)? == 0 {
            break;
        }
    }
    let ends = [&b"\n"[..], b"\r"];
    ends.into_iter().for_each(|end| line.truncate(line.strip_suffix(end).unwrap_or(&line).len()));
    Ok(Some(line))
}

/// Runs `server` until somebody sends `quit` or `stop` is set. Passes answers and events to `log`, one line each.
pub fn run(
    server: &mut Server,
    Interfaces { ports, hook }: Interfaces<'_>,
    rate: TimeRate,
    lines: &mut InputLines,
    stop: &AtomicBool,
    mut log: impl FnMut(&str),
) -> RunEnd {
    let began = Instant::now();
    let mut time =
        RunningTime { flow: TimeFlow { rate, paused: false }, pace: Pace::new(factor(rate), Duration::ZERO) };
    let mut reported = None;
    loop {
        // Handle lines first: during a pause there is nothing else to do.
        for _ in 0..LINES_MAX {
            let halted = time.is_halted();
            let line = if halted { lines.wait() } else { lines.next() };
            if stop.load(Ordering::Relaxed) {
                return RunEnd::Stopped;
            }
            let Some(line) = line else {
                if rate == TimeRate::Lockstep && lines.over {
                    return RunEnd::Silent;
                }
                break;
            };
            let mut reply = server.line(&line);
            match (reply.action, rate) {
                (ServerAction::Step(steps), TimeRate::Lockstep) => {
                    for _ in 0..steps {
                        if stop.load(Ordering::Relaxed) {
                            return RunEnd::Stopped;
                        }
                        if step(server, ports, hook, began, &mut log) == ServerAction::Quit {
                            return RunEnd::Quit;
                        }
                    }
                }
                (ServerAction::Step(_), TimeRate::Times(_)) => {
                    reply.lines = vec!["error step: time already runs by itself; start with --lockstep".into()];
                }
                (ServerAction::Speed(_) | ServerAction::Pause(_), TimeRate::Lockstep) => {
                    let command = line.split_whitespace().next().unwrap_or_default();
                    let problem = "with --lockstep, only step moves time; start without this option";
                    reply.lines = vec![format!("error {command}: {problem}")];
                }
                (action, _) => time.change(action, began.elapsed()),
            }
            reply.lines.iter().for_each(|line| log(line));
            if reply.action == ServerAction::Quit {
                return RunEnd::Quit;
            }
        }
        let action = hook.update(server, time.flow, began.elapsed(), &mut log);
        time.change(action, began.elapsed());
        if time.is_halted() {
            continue;
        }
        match step(server, ports, hook, began, &mut log) {
            ServerAction::Quit => return RunEnd::Quit,
            action => time.change(action, began.elapsed()),
        }
        let now = began.elapsed();
        match time.pace.step(now) {
            Wait::Not => {}
            Wait::For(ahead) => thread::sleep(ahead),
            Wait::Lost(lost) => {
                if reported.is_none_or(|at| now.saturating_sub(at) > REPORTED_EVERY) {
                    let (now_s, lost_s) = (server.now_s(), lost.as_secs_f64());
                    log(&format!(
                        "{now_s:.3} behind real time: this machine was too slow or suspended; {lost_s:.1} s are lost"
                    ));
                    reported = Some(now);
                }
            }
        }
    }
}

/// Speed of the simulated time, and its pace.
struct RunningTime {
    flow: TimeFlow,
    pace: Pace,
}

impl RunningTime {
    /// Returns true if time does not advance by itself.
    fn is_halted(&self) -> bool {
        self.flow.paused || self.flow.rate == TimeRate::Lockstep
    }

    /// Changes speed or pause from `now` on.
    fn change(&mut self, action: ServerAction, now: Duration) {
        match action {
            ServerAction::Nothing | ServerAction::Step(_) | ServerAction::Quit => return,
            ServerAction::Speed(speed) if self.flow.rate != TimeRate::Lockstep => {
                self.flow.rate = TimeRate::Times(speed)
            }
            ServerAction::Speed(_) => return,
            ServerAction::Pause(paused) => self.flow.paused = paused,
        }
        // Restart the pace: time that passed during a pause is not caught up.
        self.pace = Pace::new(factor(self.flow.rate), now);
    }
}

/// Runs one millisecond.
fn step(
    server: &mut Server,
    ports: &mut Ports,
    hook: &mut dyn ServerHook,
    began: Instant,
    mut log: impl FnMut(&str),
) -> ServerAction {
    ports.receive(server, began.elapsed(), &mut log);
    let send = |vehicle, bytes: &[u8]| {
        ports.send(vehicle, bytes);
        hook.sent(vehicle, bytes);
    };
    server.step(send, &mut log)
}

fn factor(rate: TimeRate) -> f64 {
    match rate {
        TimeRate::Times(speed) => speed,
        TimeRate::Lockstep => 0.0,
    }
}
