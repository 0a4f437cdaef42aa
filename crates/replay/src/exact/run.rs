//! Runs the records of an exact log.

use super::compare::ChangeComparison;
use super::frames;
use super::outcome::{ExactReplay, FirstDifference, GivenSignal, LoggedParameter, ReplayFinding};
use super::player::TickPlayers;
use afbc_log::exact::{FrameError, Given, Record, ReplayDifference, ReplayStep, StartRecord, decode};
use afbc_onboard::{Report, TickInputs};

/// Number of bytes between two calls of `progress`.
const PROGRESS_BYTES: usize = 1 << 20;

/// State of a running replay.
struct ExactRun {
    players: TickPlayers,
    out: ExactReplay,
    /// Number of the next expected tick, and whether the motors were driven in the last tick.
    next: u32,
    is_armed: bool,
    /// Time of the last tick since its start, and time of that start since the first tick of the log \[us\].
    last_us: u64,
    began_us: i64,
    /// Time of the first tick of the log \[us\].
    first_us: Option<u64>,
}

/// Runs the frames of a file; `start` is its first start record.
///
/// # Errors
/// One line, without the file's name.
pub(super) fn run(
    bytes: &mut [u8],
    start: StartRecord,
    players: TickPlayers,
    progress: &mut dyn FnMut(u64),
) -> Result<ExactReplay, String> {
    let length = bytes.len();
    let comparison = players.changed.is_some().then(|| ChangeComparison::new(&players.changes));
    let out = ExactReplay {
        vehicle: start.vehicle.as_str().into(),
        law: start.law.as_str().into(),
        rotors: start.rotors.into(),
        starts: 0,
        ticks: 0,
        armed_ticks: 0,
        flights: 0,
        lost_ticks: 0,
        messages: 0,
        parameters: Vec::new(),
        bytes: length as u64,
        damaged: (0, None),
        cut_bytes: 0,
        same_ticks: 0,
        first_difference: None,
        comparison,
    };
    let mut run = ExactRun { players, out, next: 0, is_armed: false, last_us: 0, began_us: 0, first_us: None };
    let mut told = 0;
    for frame in frames::each(bytes) {
        if frame.at >= told + PROGRESS_BYTES {
            progress((frame.at - told) as u64);
            told = frame.at;
        }
        let at = frame.at;
        if !frame.is_whole {
            run.out.cut_bytes = frame.bytes.len();
            continue;
        }
        match decode(frame.bytes) {
            Ok(record) => run.take(at, &record)?,
            // Bytes received before the processor's start are no part of the log.
            Err(_) if run.out.starts == 0 => {}
            Err(FrameError::Foreign(_)) => {
                return Err(format!(
                    "byte {at}: the record has another version; replay each flight with the program version that flew \
                     it"
                ));
            }
            Err(FrameError::Damaged) => {
                run.out.damaged.0 += 1;
                run.out.damaged.1.get_or_insert(at);
            }
        }
    }
    progress((length - told) as u64);
    if run.out.ticks == 0 {
        return Err("the log has a start record but no tick; record for as long as the vehicle flies".into());
    }
    Ok(run.out)
}

impl ExactRun {
    fn take(&mut self, byte: usize, record: &Record) -> Result<(), String> {
        // Ticks are missing after the last recorded tick.
        let before_us = matches!(record, Record::Tick(tick, _) if tick.number != self.next).then_some(self.last_us);
        self.count(record);
        if self.out.first_difference.is_some() || self.out.starts == 0 {
            return Ok(());
        }
        let flown = match self.players.flown.take(record) {
            ReplayStep::Nothing => None,
            ReplayStep::Same(report) => {
                self.out.same_ticks += 1;
                Some(report)
            }
            ReplayStep::Differs(difference, _) => {
                let tick = match &difference {
                    ReplayDifference::Missing(number)
                    | ReplayDifference::Configuration(number)
                    | ReplayDifference::Given { number, .. } => *number,
                    _ => self.next,
                };
                let (finding, start) = (finding(difference)?, self.out.starts);
                let at_s = before_us.unwrap_or(self.last_us) as f64 * 1e-6;
                self.out.first_difference = Some(FirstDifference { start, tick, at_s, byte, finding });
                None
            }
        };
        let Some(changed) = &mut self.players.changed else { return Ok(()) };
        let other = match changed.take(record) {
            ReplayStep::Differs(ReplayDifference::Parameter, _) => {
                return Err("--change: the vehicle cannot fly with this value; change it less, or change other \
                     parameters too"
                    .into());
            }
            ReplayStep::Same(report) | ReplayStep::Differs(_, Some(report)) => Some(report),
            ReplayStep::Nothing | ReplayStep::Differs(_, None) => None,
        };
        if let (Some(flown), Some(other), Record::Tick(tick, _)) = (flown, other, record) {
            self.compare(tick, &flown, &other);
        }
        Ok(())
    }

    /// Counts the log's contents, also after the replay has ended.
    fn count(&mut self, record: &Record) {
        if let Record::Start(_) = record {
            // Uses the previous start's offset, since this start begins at the time of that start's last tick.
            self.began_us = self.now_us(self.last_us);
            self.out.starts += 1;
            (self.next, self.is_armed) = (0, false);
        }
        if self.out.starts == 0 {
            return;
        }
        match record {
            Record::Start(_) => {}
            Record::Parameter { configuration, name, value } => {
                let at_s = self.changed_s(*configuration);
                self.out.parameters.push(LoggedParameter { at_s, name: Some(name.to_string()), value: *value });
            }
            Record::Restored { configuration } => {
                let at_s = self.changed_s(*configuration);
                self.out.parameters.push(LoggedParameter { at_s, name: None, value: 0.0 });
            }
            Record::Inputs { .. } => self.out.messages += 1,
            Record::Tick(tick, given) => {
                let armed = given.throttles.iter().any(|throttle| *throttle > 0);
                self.first_us.get_or_insert(tick.time_us);
                self.out.ticks += 1;
                self.out.armed_ticks += u64::from(armed);
                self.out.flights += u32::from(armed && !self.is_armed);
                self.out.lost_ticks += u64::from(tick.number.saturating_sub(self.next));
                (self.next, self.is_armed, self.last_us) = (tick.number.wrapping_add(1), armed, tick.time_us);
            }
        }
    }

    fn changed_s(&self, configuration: u16) -> Option<f64> {
        let is_first = configuration == 0 && self.out.starts == 1;
        (!is_first).then(|| self.now_us(self.last_us) as f64 * 1e-6)
    }

    /// Returns the time since the first tick of the log \[us\].
    fn now_us(&self, time_us: u64) -> i64 {
        // Every start counts its time from zero; only the first start's time is counted from the first tick of the log.
        let first_us = if self.out.starts > 1 { 0 } else { self.first_us.unwrap_or_default() };
        self.began_us.saturating_add(time_us.saturating_sub(first_us).try_into().unwrap_or(i64::MAX))
    }

    fn compare(&mut self, tick: &TickInputs, flown: &Report, other: &Report) {
        let time_s = self.now_us(tick.time_us) as f64 * 1e-6;
        let TickPlayers { flown: player, changed: Some(changed), .. } = &self.players else { return };
        let (trace, other_trace) = (player.trace(), changed.trace());
        if let Some(comparison) = &mut self.out.comparison {
            comparison.add(time_s, (flown, &trace), (other, &other_trace));
        }
    }
}

/// Returns the finding for a difference.
///
/// # Errors
/// One line, if the log is not of this vehicle.
fn finding(difference: ReplayDifference) -> Result<ReplayFinding, String> {
    match difference {
        ReplayDifference::Start(StartRecord { rotors, parameters, vehicle, .. }) => Err(format!(
            "the log is from the vehicle {vehicle} with {rotors} rotors and {parameters} parameters, but this program \
             has other parameters; give the vehicle's file by --vehicle, or use the program version that flew it"
        )),
        ReplayDifference::Parameters(StartRecord { vehicle, .. }) => Err(format!(
            "the vehicle {vehicle} differs from the one that flew: its file has changed, the file is another \
             vehicle's, or parameters of the start record are lost; give the file that flew by --vehicle"
        )),
        ReplayDifference::Parameter => Ok(ReplayFinding::Parameter),
        ReplayDifference::Configuration(_) => Ok(ReplayFinding::Configuration),
        ReplayDifference::Missing(_) => Ok(ReplayFinding::Missing),
        ReplayDifference::Given { then, now, .. } => Ok(ReplayFinding::Given(signals(&then, &now))),
    }
}

/// Returns the signals that differ, causes before effects.
fn signals(then: &Given, now: &Given) -> Vec<GivenSignal> {
    let mode = (then.mode != now.mode).then_some(GivenSignal::Mode { then: then.mode, now: now.mode });
    let estimate = (then.estimate != now.estimate).then_some(GivenSignal::Estimate);
    let speeds = (then.speeds != now.speeds).then_some(GivenSignal::Speeds);
    let both = (1..).zip(then.throttles.iter().zip(&now.throttles));
    let throttles = both.filter(|(_, (then, now))| then != now);
    let throttles = throttles.map(|(motor, (then, now))| GivenSignal::Throttle { motor, then: *then, now: *now });
    mode.into_iter().chain(estimate).chain(speeds).chain(throttles).collect()
}
