//! Writes the black box.

use crate::ulog::definitions::{Definitions, LogStart, parameter};
use crate::ulog::dropouts::Dropouts;
use crate::ulog::known::Known;
use crate::ulog::moment::{BesideTick, Moment};
use crate::ulog::ring::{LogRing, RingView};
use crate::ulog::topics::{
    ActuatorArmed, ActuatorMotors, ActuatorOutputs, AidOffered, Aiding, BatteryVoltage, EscStatusReport,
    EstimatorFigures, EstimatorFlags, EstimatorVector, LandDetected, LawSignals, Listed, ManualControl, MeanSample,
    SensorCombined, TOPICS, ThrustDemand, TorqueDemand, VehicleAngularVelocity, VehicleAttitude,
    VehicleAttitudeSetpoint, VehicleGlobalPosition, VehicleLocalPosition, VehicleLocalPositionSetpoint,
    VehicleRatesSetpoint, VehicleState,
};
use afbc_estimator::Measurement;
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{Aged, TickRecord, tracker_aid};
use afbc_store::RecordName;
use afbc_types::{PerAxis, Stamped};

/// Bytes from which a reader resumes in a damaged log, and the time between two such marks \[us\].
const SYNC: [u8; 8] = [0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12];
const SYNC_US: u64 = 500_000;
/// Length of an array with an entry per kind of measurement: `afbc_aid` numbers the six kinds from 1 on.
const AID_KINDS: usize = 7;
/// Longest text in the log \[bytes\]. A longer text is cut off.
const TEXT_MAX: usize = 128;

/// Writes the log of a vehicle. Runs beside the control tick, not in it.
#[derive(Clone, Debug)]
pub struct BlackBox {
    known: Known,
    definitions: Definitions,
    /// Largest number of entries of the log's beginning, or of changed parameters, written in one tick.
    pace: u16,
    small: bool,
    unwritten: Unwritten,
    dropouts: Dropouts,
    /// Time at which each topic is due \[us\].
    due_us: [u64; TOPICS.len()],
    synced_us: u64,
    last: Last,
}

/// Parameters whose change is not in the log yet.
#[derive(Clone, Copy, Debug)]
enum Unwritten {
    None,
    One(RecordName),
    /// All parameters from this place in the table on.
    From(u16),
}

/// State carried from tick to tick.
#[derive(Clone, Debug, Default)]
struct Last {
    armed: bool,
    airborne: bool,
    /// Times of arming and of take-off, 0 while disarmed or on the ground \[us\].
    since_us: [u64; 2],
    /// Inertial samples that are in no message yet.
    mean: Option<MeanSample>,
    /// Time at which each kind of measurement is due in a small log \[us\].
    aids_due_us: [u64; AID_KINDS],
    sampled: Option<(SensorCombined, u64)>,
    pose_us: Option<u64>,
    norms: PerAxis<[f32; 2]>,
    state: Option<VehicleState>,
    arming: Option<ActuatorArmed>,
    landing: Option<LandDetected>,
    figures: Option<EstimatorFigures>,
}

impl BlackBox {
    /// Creates a log with nothing written yet, for a vehicle with these parameters.
    pub fn new(start: &LogStart<'_>, table: &ParameterTable) -> Self {
        BlackBox {
            known: Known::of(table.configuration()),
            definitions: Definitions::new(start),
            pace: u16::MAX,
            small: false,
            unwritten: Unwritten::None,
            dropouts: Dropouts::default(),
            due_us: [0; TOPICS.len()],
            synced_us: 0,
            last: Last::default(),
        }
    }

    /// Limits the entries of the log's beginning that one tick handles; the limit is at least one. There are some
    /// hundreds of entries: formats, parameters and the like, each looked up in the vehicle's table. The limit also
    /// holds when all parameters change at once. Without `paced`, only the ring's room limits them.
    #[must_use]
    pub fn paced(self, entries: u16) -> Self {
        BlackBox { pace: entries.max(1), ..self }
    }

    /// Makes this a small log. Each topic is written at its longer period
    /// ([`LoggedTopic::small_us`](crate::ulog::LoggedTopic::small_us)), and the inertial sensor as the mean of its
    /// samples since the last message.
    #[must_use]
    pub fn small(self) -> Self {
        BlackBox { small: true, ..self }
    }

    /// Writes a parameter change. Call it after the table has changed.
    pub fn change<const R: usize>(&mut self, table: &ParameterTable, change: RecordChange, ring: &mut LogRing<R>) {
        self.known = Known::of(table.configuration());
        self.unwritten = match (self.unwritten, change) {
            (Unwritten::None, RecordChange::Set(name, _)) => Unwritten::One(name),
            // Only one name can be remembered, so all parameters are written again.
            _ => Unwritten::From(0),
        };
        // A change of all parameters is written by `tick`, at its pace.
        if self.definitions.is_done() && matches!(self.unwritten, Unwritten::One(_)) {
            self.write_parameters(table, &mut ring.view());
        }
    }

    /// Writes a text of this severity (0 emergency to 7 debug), if there is room.
    pub fn text<const R: usize>(&mut self, now_us: u64, severity: u8, text: &str, ring: &mut LogRing<R>) {
        if !self.definitions.is_done() {
            return;
        }
        // The text is cut between letters, because readers expect UTF-8.
        let end = (0..=TEXT_MAX.min(text.len())).rfind(|end| text.is_char_boundary(*end)).unwrap_or_default();
        let text = text.get(..end).unwrap_or_default();
        let _ = self.dropouts.put(now_us, &mut ring.view(), &mut |ring| {
            ring.record(b'L', &mut |content| {
                content.put(&[b'0' + severity.min(7)]);
                content.put(&now_us.to_le_bytes());
                content.put(text.as_bytes());
            })
        });
    }

    /// Logs a dropout from a time to the next written tick: ticks are missing.
    pub fn miss(&mut self, since_us: u64) {
        if self.definitions.is_done() {
            self.dropouts.miss(since_us);
        }
    }

    /// Writes the rest of the log's beginning, if any, then the tick. The tick is left out until the beginning is
    /// complete.
    pub fn tick<const R: usize>(
        &mut self,
        tick: &TickRecord<'_>,
        beside: &BesideTick<'_>,
        table: &ParameterTable,
        ring: &mut LogRing<R>,
    ) {
        let now_us = tick.report.time_us;
        let mut ring = ring.view();
        self.definitions.write(now_us, table, self.pace, &mut ring);
        let writes = self.definitions.is_done();
        if writes {
            self.write_parameters(table, &mut ring);
            if now_us.saturating_sub(self.synced_us) >= SYNC_US && ring.record(b'S', &mut |content| content.put(&SYNC))
            {
                self.synced_us = now_us;
            }
        }
        self.topics(tick, beside, writes, &mut ring);
    }

    /// Writes a tick's topics, or only updates the state carried between ticks. Not generic in the ring, so that it is
    /// compiled once.
    #[inline(never)]
    fn topics(&mut self, tick: &TickRecord<'_>, beside: &BesideTick<'_>, writes: bool, ring: &mut RingView<'_>) {
        let TickRecord { report, details } = *tick;
        let moment = Moment { report, details, beside: *beside, known: &self.known };
        let now_us = report.time_us;
        let (due_us, dropouts) = (&mut self.due_us, &mut self.dropouts);
        let mut topics = Topics { now_us, writes, small: self.small, due_us, dropouts, ring };
        self.last.sensors(&moment, &mut topics);
        self.last.states(&moment, &mut topics);
        (self.last.armed, self.last.airborne) = (report.mode.armed(), report.guided.airborne);
    }

    /// Writes changed parameters, as far as room and pace allow.
    fn write_parameters(&mut self, table: &ParameterTable, ring: &mut RingView<'_>) {
        for _ in 0..self.pace {
            let (found, next) = match self.unwritten {
                Unwritten::None => return,
                Unwritten::One(name) => (table.get(name), Unwritten::None),
                Unwritten::From(place) => {
                    let found = table.at(place);
                    let next = if found.is_some() { Unwritten::From(place + 1) } else { Unwritten::None };
                    (found, next)
                }
            };
            if found.is_some_and(|found| !parameter(&found, ring)) {
                return;
            }
            self.unwritten = next;
        }
    }
}

/// Writes the messages of a tick that are due.
struct Topics<'a, 'r> {
    now_us: u64,
    /// True once the log's beginning is written.
    writes: bool,
    small: bool,
    due_us: &'a mut [u64; TOPICS.len()],
    dropouts: &'a mut Dropouts,
    ring: &'a mut RingView<'r>,
}

impl Topics<'_, '_> {
    /// Writes a message in every tick, but in a small log at the topic's rate. Returns false if it is not due.
    fn each<T: Listed>(&mut self, message: T) -> bool {
        if !self.small {
            // A message that does not fit leaves a dropout in the log.
            let _ = self.at_once(&message);
            return true;
        }
        self.at_rate(|| Some(message))
    }

    /// Writes a message at its topic's rate. Returns false if it is not due.
    fn at_rate<T: Listed>(&mut self, make: impl FnOnce() -> Option<T>) -> bool {
        let place = usize::from(T::ID);
        let (Some(due_us), Some(topic)) = (self.due_us.get(place), TOPICS.get(place)) else { return false };
        if self.now_us < *due_us {
            return false;
        }
        let Some(message) = make() else { return false };
        // A message that is on time keeps the phase of its topic.
        let period_us = u64::from(if self.small { topic.small_us } else { topic.period_us });
        let next_us = due_us.saturating_add(period_us);
        // 0 means no phase: the first message, a change, or a message to be made up for.
        let is_on_time = *due_us > 0 && next_us > self.now_us;
        let next_us = if is_on_time { next_us } else { self.now_us.saturating_add(period_us) };
        // A message that did not fit is made up for in the next tick.
        let next_us = if self.at_once(&message) { next_us } else { 0 };
        self.due_us.get_mut(place).into_iter().for_each(|due_us| *due_us = next_us);
        true
    }

    /// Writes a message. Returns false if it did not fit or the log's beginning is unfinished.
    fn at_once<T: Listed>(&mut self, message: &T) -> bool {
        self.writes
            && self.dropouts.put(self.now_us, self.ring, &mut |ring| {
                ring.record(b'D', &mut |content| {
                    content.put(&T::ID.to_le_bytes());
                    message.write(content);
                })
            })
    }

    /// Writes a message at its topic's rate, or at once if `like` finds it different from the last message.
    fn on_change<T: Listed + Copy>(&mut self, last: &mut Option<T>, message: T, like: impl FnOnce(&T, &T) -> bool) {
        if !last.as_ref().is_some_and(|last| like(last, &message)) {
            self.due_us.get_mut(usize::from(T::ID)).into_iter().for_each(|due_us| *due_us = 0);
        }
        *last = Some(message);
        let _ = self.at_rate(|| Some(message));
    }
}

impl Last {
    /// Writes the sensor readings, and the measurements that the estimator was offered.
    fn sensors(&mut self, moment: &Moment<'_>, topics: &mut Topics<'_, '_>) {
        let (now_us, details) = (moment.now_us(), moment.details);
        if let Some(sample) = &details.sample {
            let clips = details.estimate.is_some_and(|estimate| estimate.imu.clipped);
            let mean = MeanSample::with(self.mean.take(), sample, clips);
            let (message, at_us) = SensorCombined::of(&mean, self.sampled.as_ref(), topics.small);
            if topics.each(message) {
                self.sampled = Some((message, at_us));
            } else {
                self.mean = Some(mean);
            }
        }
        let pose = details.pose.filter(|pose| self.pose_us != Some(pose.at_us));
        self.pose_us = pose.map(|pose| pose.at_us).or(self.pose_us);
        let brought = pose.map(|Stamped { value, at_us }| Aged {
            value: tracker_aid(&value),
            age_us: u32::try_from(now_us.saturating_sub(at_us)).unwrap_or(u32::MAX),
        });
        let read =
            details.inputs.readings.aids.iter().zip(details.local).filter_map(|(read, local)| Some(((*read)?, local)));
        for (read, local) in read.chain(brought.map(|pose| (pose, Some(pose.value)))) {
            if topics.small && !self.is_due(&read.value, now_us) {
                continue;
            }
            // A GNSS fix is logged as the receiver reports it, in the receiver's frame.
            let told = local.filter(|_| !matches!(read.value, Measurement::Gnss { .. })).unwrap_or(read.value);
            let _ = match Aiding::of(moment, &Aged { value: told, ..read }) {
                Some(Aiding::Air(message)) => topics.at_once(&message),
                Some(Aiding::Field(message)) => topics.at_once(&message),
                Some(Aiding::Gnss(message)) => topics.at_once(&message),
                Some(Aiding::Pose(message)) => topics.at_once(&message),
                None => true,
            };
            if let Some(offered) = local.filter(|_| details.offers) {
                let at_us = now_us.saturating_sub(read.age_us.into());
                let _ = topics.at_once(&AidOffered::of(now_us, at_us, &offered));
            }
        }
    }

    /// Returns true if this kind of measurement is due in a small log, and schedules the next measurement.
    fn is_due(&mut self, value: &Measurement, now_us: u64) -> bool {
        let (kind, _) = value.numbers();
        let period_us = TOPICS.get(usize::from(AidOffered::ID)).map_or(0, |topic| topic.small_us);
        let Some(due_us) = self.aids_due_us.get_mut(usize::from(kind)).filter(|due_us| **due_us <= now_us) else {
            return false;
        };
        *due_us = now_us.saturating_add(period_us.into());
        true
    }

    /// Writes states, setpoints, commands and the estimator's figures.
    fn states(&mut self, moment: &Moment<'_>, topics: &mut Topics<'_, '_>) {
        let (report, now_us) = (moment.report, moment.now_us());
        if let Some((axis, norm)) = report.norms {
            self.norms[axis] = [norm.theta_squared, norm.delta];
        }
        let (is_armed, is_airborne) = (report.mode.armed(), report.guided.airborne);
        let [armed_us, airborne_us] = &mut self.since_us;
        for (since_us, was, is) in [(armed_us, self.armed, is_armed), (airborne_us, self.airborne, is_airborne)] {
            *since_us = match (was, is) {
                (_, false) => 0,
                (false, true) => now_us,
                (true, true) => *since_us,
            };
        }
        let _ = topics.at_rate(|| VehicleAttitude::of(moment));
        let _ = topics.at_rate(|| VehicleAngularVelocity::of(moment));
        let _ = topics.at_rate(|| VehicleAttitudeSetpoint::of(moment));
        let _ = topics.at_rate(|| VehicleRatesSetpoint::of(moment));
        let _ = topics.at_rate(|| ThrustDemand::of(moment));
        let _ = topics.at_rate(|| TorqueDemand::of(moment));
        let _ = topics.at_rate(|| Some(ActuatorMotors::of(moment)));
        let _ = topics.at_rate(|| VehicleLocalPosition::of(moment));
        let _ = topics.at_rate(|| VehicleLocalPositionSetpoint::of(moment));
        let _ = topics.at_rate(|| Some(ActuatorOutputs::of(moment)));
        let _ = topics.at_rate(|| ManualControl::of(moment));
        let _ = topics.at_rate(|| Some(LawSignals::of(moment, &self.norms)));
        let _ = topics.at_rate(|| VehicleGlobalPosition::of(moment));
        let _ = topics.at_rate(|| EstimatorVector::of(moment));
        let _ = topics.at_rate(|| EstimatorFlags::of(moment));
        let _ = topics.at_rate(|| BatteryVoltage::of(moment));
        let _ = topics.at_rate(|| EscStatusReport::of(moment));
        if let Some(figures) = EstimatorFigures::of(moment) {
            topics.on_change(&mut self.figures, figures, EstimatorFigures::is_like);
        }
        let state = VehicleState::of(moment, self.since_us);
        let timed =
            |last: &VehicleState, now: &VehicleState| VehicleState { timestamp: now.timestamp, ..*last } == *now;
        topics.on_change(&mut self.state, state, timed);
        let timed =
            |last: &ActuatorArmed, now: &ActuatorArmed| ActuatorArmed { timestamp: now.timestamp, ..*last } == *now;
        topics.on_change(&mut self.arming, ActuatorArmed::of(moment), timed);
        let timed =
            |last: &LandDetected, now: &LandDetected| LandDetected { timestamp: now.timestamp, ..*last } == *now;
        topics.on_change(&mut self.landing, LandDetected::of(moment), timed);
    }
}
