//! Vehicles, ports, time and lines together.

use crate::pace::{Pace, Wait};
use crate::ports::Ports;
use crate::server::{Server, Then};
use std::io::BufRead;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError, channel};
use std::thread;
use std::time::{Duration, Instant};

/// How time goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimeRate {
    /// At so many times real time; 0: as fast as possible.
    Times(f64),
    /// By the command `step` alone.
    Lockstep,
}

/// Why a run has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunEnd {
    /// Somebody has said so.
    Quit,
    /// The stop flag was set.
    Stopped,
    /// There are no more lines, without which time does not go on.
    Silent,
}

/// Lines from somebody, as they come.
pub struct Lines {
    lines: Receiver<String>,
    over: bool,
}

/// Longest wait for a line between two looks at the stop flag.
const NAP: Duration = Duration::from_millis(50);
/// Least time between two lines about lost time.
const REPORTED_EVERY: Duration = Duration::from_secs(5);

impl Lines {
    /// Reads lines in a thread of their own.
    pub fn of(mut source: impl BufRead + Send + 'static) -> Self {
        let (sender, lines) = channel();
        thread::spawn(move || {
            let mut bytes = Vec::new();
            // What is not text is a line as well, which is refused.
            while source.read_until(b'\n', &mut bytes).is_ok_and(|length| length > 0) {
                if sender.send(String::from_utf8_lossy(&bytes).trim().to_owned()).is_err() {
                    return;
                }
                bytes.clear();
            }
        });
        Lines { lines, over: false }
    }

    /// Returns the next line, if there is one.
    fn next(&mut self) -> Option<String> {
        let line = self.lines.try_recv();
        self.over |= line == Err(TryRecvError::Disconnected);
        line.ok()
    }

    /// Waits a little for the next line.
    fn wait(&mut self) -> Option<String> {
        let line = self.lines.recv_timeout(NAP);
        self.over |= line == Err(RecvTimeoutError::Disconnected);
        line.ok()
    }
}

/// Runs `server` until somebody says `quit` or `stop` is set; passes answers and events to `log`, a line each.
pub fn run(
    server: &mut Server,
    ports: &mut Ports,
    mut rate: TimeRate,
    lines: &mut Lines,
    stop: &AtomicBool,
    mut log: impl FnMut(&str),
) -> RunEnd {
    let began = Instant::now();
    let mut pace = Pace::new(factor(rate), began.elapsed());
    let mut reported = None;
    loop {
        // Lines first: in lockstep there is nothing else to do.
        loop {
            let line = if rate == TimeRate::Lockstep { lines.wait() } else { lines.next() };
            if stop.load(Ordering::Relaxed) {
                return RunEnd::Stopped;
            }
            let Some(line) = line else {
                match rate {
                    TimeRate::Lockstep if lines.over => return RunEnd::Silent,
                    TimeRate::Lockstep => continue,
                    TimeRate::Times(_) => break,
                }
            };
            let mut reply = server.line(&line);
            match (reply.then, rate) {
                (Then::Nothing, _) => {}
                (Then::Quit, _) => {
                    reply.lines.iter().for_each(|line| log(line));
                    return RunEnd::Quit;
                }
                (Then::Step(steps), TimeRate::Lockstep) => {
                    for _ in 0..steps {
                        if stop.load(Ordering::Relaxed) {
                            return RunEnd::Stopped;
                        }
                        if step(server, ports, began, &mut log) == Then::Quit {
                            return RunEnd::Quit;
                        }
                    }
                }
                (Then::Step(_), TimeRate::Times(_)) => {
                    reply.lines = vec!["error step: time goes on by itself; start with --lockstep".into()];
                }
                (Then::Speed(_), TimeRate::Lockstep) => {
                    reply.lines = vec!["error speed: time goes on by step alone; start without --lockstep".into()];
                }
                (Then::Speed(speed), TimeRate::Times(_)) => {
                    rate = TimeRate::Times(speed);
                    pace = Pace::new(speed, began.elapsed());
                }
            }
            reply.lines.iter().for_each(|line| log(line));
        }
        match step(server, ports, began, &mut log) {
            Then::Quit => return RunEnd::Quit,
            Then::Speed(speed) => {
                rate = TimeRate::Times(speed);
                pace = Pace::new(speed, began.elapsed());
            }
            Then::Nothing | Then::Step(_) => {}
        }
        let now = began.elapsed();
        match pace.step(now) {
            Wait::Not => {}
            Wait::For(ahead) => thread::sleep(ahead),
            Wait::Lost(lost) => {
                if reported.is_none_or(|at| now.saturating_sub(at) > REPORTED_EVERY) {
                    let (now_s, lost_s) = (server.now_s(), lost.as_secs_f64());
                    log(&format!("{now_s:.3} behind: this machine was too slow or suspended; {lost_s:.1} s are lost"));
                    reported = Some(now);
                }
            }
        }
    }
}

/// Runs a millisecond.
fn step(server: &mut Server, ports: &mut Ports, began: Instant, mut log: impl FnMut(&str)) -> Then {
    ports.receive(server, began.elapsed(), &mut log);
    server.step(|vehicle, bytes| ports.send(vehicle, bytes), &mut log)
}

fn factor(rate: TimeRate) -> f64 {
    match rate {
        TimeRate::Times(speed) => speed,
        TimeRate::Lockstep => 0.0,
    }
}
