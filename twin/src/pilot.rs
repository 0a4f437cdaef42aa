//! Flight seen from outside: the plant with its instruments, a ground station at the telemetry UART, and the checks.

use crate::check::check;
use crate::fetch::{self, Fetch};
use crate::mission::MissionProgress;
use crate::wire::UartWire;
use crate::world::Transducers;
use afbc_flight_core::motor::{THROTTLE_MAX, THROTTLE_MIN};
use afbc_ground::{Client, RetryPolicy};
use afbc_mavlink::telemetry::EscStatus;
use afbc_mavlink::{Datum, Decoder, Downlink, Height, MissionMessage, MissionType, Telemetry, Uplink, VehicleCommand};
use afbc_onboard::Readings;
use afbc_plant::Motion;
use afbc_scenario::Scenario;
use afbc_sim::flight::World;
use afbc_types::{PoseSigmas, ROTORS_MAX, RotorSpeeds};
use rigless::machine::flight::Signals;
use std::error::Error;

/// Time between heartbeats [ms].
const HEARTBEAT_MS: u64 = 1_000;
/// Height of the hover above the start [m], and default duration of the hover [ms].
const HEIGHT_M: f32 = 5.0;
const HOVER_MS: u64 = 30_000;
/// Longest hover if logs are fetched afterwards [ms].
const SHORT_HOVER_MS: u64 = 6_000;
/// Longest times until the vehicle is armed, for the climb, and for landing and disarming [ms].
const PATIENCE_MS: [u64; 3] = [40_000, 15_000, 40_000];
/// Time from disarming until the log's last blocks are written [ms].
const REST_MS: u64 = 1_500;
/// Longest time from the start of the mission until the vehicle is disarmed [ms].
const MISSION_MS: u64 = 160_000;
/// Largest mean position error of the hover [m], and largest tilt in gusts [rad]. A mission may tilt more, since each
/// leg begins with an acceleration.
const OFF_M: f64 = 2.5;
const TILT_RAD: f64 = 0.7;
const MISSION_TILT_RAD: f64 = 0.9;

/// Time between two states from an external tracker [ms].
const TRACKED_MS: u64 = 10;

/// Phase of the flight.
#[derive(Clone, Copy, Debug, PartialEq)]
enum FlightPhase {
    Wakes,
    Climbs,
    Hovers,
    Mission,
    Lands,
    Fetches,
    /// Disarmed, waiting for the log on the card to end.
    Rests,
    Done,
}

/// World around the vehicle, and ground station that commands the flight.
pub struct GroundPilot {
    world: World,
    transducers: Transducers,
    throttles: Vec<u16>,
    /// True speeds of the rotors [rad/s], and a rotor that is no longer driven.
    rotor_speeds_rad_s: Vec<f64>,
    stopped_rotor: Option<usize>,
    speed_max_rad_s: f32,
    wire: UartWire,
    client: Client,
    phase: FlightPhase,
    /// Current time, and start of the phase [ms].
    now_ms: u64,
    since_ms: u64,
    armed: bool,
    /// True position at the start of the climb [m]; below, sum [m] and number of the position errors in hover.
    start_m: [f64; 3],
    off_m: (f64, u64),
    /// Durations of armed ticks from telemetry [us]: sum and number; longest since power-up; number of late ticks.
    ticks_us: (f64, u64),
    longest_us: f32,
    late: u32,
    /// Duration of the hover [ms].
    hover_ms: u64,
    /// Mission that replaces the hover.
    mission: Option<MissionProgress>,
    /// True to wait for the end of the log after the flight.
    logs: bool,
    /// Download of the logs after the flight.
    fetch: Option<Fetch>,
    tilt_rad: f64,
    error: Option<String>,
    /// Newest telemetry of the motor controllers, with its time [ms].
    escs: Option<(u64, EscStatus)>,
    /// Status texts of the vehicle, with their times [ms], and whether they are printed.
    heard: Vec<(u64, String)>,
    prints: bool,
}

impl GroundPilot {
    /// Creates the world of a scenario, and a station at the other end of the wire.
    pub fn new(scenario: &Scenario, wire: UartWire) -> Result<Self, Box<dyn Error>> {
        Ok(GroundPilot {
            world: World::released(scenario, 1e-3)?,
            transducers: Transducers::new(),
            throttles: vec![0; scenario.rotors.len()],
            rotor_speeds_rad_s: vec![0.0; scenario.rotors.len()],
            stopped_rotor: None,
            // The speed is that of `vehicles/paper.toml`, for which the images are built.
            speed_max_rad_s: 1000.0,
            wire,
            client: client(),
            phase: FlightPhase::Wakes,
            now_ms: 0,
            since_ms: 0,
            armed: false,
            start_m: [0.0; 3],
            off_m: (0.0, 0),
            ticks_us: (0.0, 0),
            longest_us: 0.0,
            late: 0,
            hover_ms: HOVER_MS,
            mission: None,
            logs: false,
            fetch: None,
            tilt_rad: 0.0,
            error: None,
            escs: None,
            heard: Vec::new(),
            prints: true,
        })
    }

    /// Turns progress messages off.
    #[must_use]
    pub fn quiet(self) -> Self {
        GroundPilot { prints: false, ..self }
    }

    /// Returns a copy in the same world, on another wire, without progress messages and without received data.
    pub fn again(&self, wire: UartWire) -> Self {
        GroundPilot {
            world: self.world.clone(),
            transducers: self.transducers.clone(),
            throttles: self.throttles.clone(),
            rotor_speeds_rad_s: self.rotor_speeds_rad_s.clone(),
            wire,
            client: client(),
            mission: None,
            error: None,
            escs: None,
            heard: Vec::new(),
            prints: false,
            fetch: None,
            ..*self
        }
    }

    /// Sets the duration of the hover [ms].
    #[must_use]
    pub fn hovering(self, hover_ms: u64) -> Self {
        GroundPilot { hover_ms, ..self }
    }

    /// Replaces the hover by a mission, from take-off to landing.
    #[must_use]
    pub fn with_mission(self) -> Self {
        GroundPilot { mission: Some(MissionProgress::new()), ..self }
    }

    /// Waits after the flight until the vehicle's log has ended.
    #[must_use]
    pub fn logging(self) -> Self {
        GroundPilot { logs: true, ..self }
    }

    /// Lists, downloads and erases the vehicle's logs after the flight.
    #[must_use]
    pub fn fetching(self) -> Self {
        let fetch = Some(Fetch::new(Decoder::new(Client::STATION)));
        GroundPilot { fetch, hover_ms: self.hover_ms.min(SHORT_HOVER_MS), ..self }
    }

    /// Returns the downloaded logs when all are complete and not yet erased.
    pub fn fetched(&self) -> Option<&Fetch> {
        self.fetch.as_ref().filter(|fetch| fetch.has_all())
    }

    /// Returns the newest motor commands.
    pub fn throttles(&self) -> &[u16] {
        &self.throttles
    }

    /// Returns the rotors' true speeds [rad/s].
    pub fn rotor_speeds_rad_s(&self) -> &[f64] {
        &self.rotor_speeds_rad_s
    }

    /// Stops driving a rotor.
    pub fn stop_rotor(&mut self, rotor: usize) {
        self.stopped_rotor = Some(rotor);
    }

    /// Returns the newest telemetry of the motor controllers, and its time [ms].
    pub fn escs(&self) -> Option<(u64, EscStatus)> {
        self.escs
    }

    /// Returns the vehicle's true motion.
    pub fn motion(&self) -> Motion {
        self.world.plant().motion()
    }

    /// True if the vehicle's newest heartbeat says that it is armed.
    pub fn armed(&self) -> bool {
        self.armed
    }

    /// Returns the status texts of the vehicle, with their times [ms].
    pub fn heard(&self) -> &[(u64, String)] {
        &self.heard
    }

    /// Returns the time in hover so far [ms].
    pub fn hovers_ms(&self) -> Option<u64> {
        (self.phase == FlightPhase::Hovers).then(|| self.now_ms - self.since_ms)
    }

    /// Sets the motor commands; `None` keeps a motor's former command.
    pub fn command(&mut self, throttles: impl IntoIterator<Item = Option<u16>>) {
        for (known, new) in self.throttles.iter_mut().zip(throttles) {
            *known = new.unwrap_or(*known);
        }
    }

    /// Advances to this millisecond, commands the flight, and returns the instruments' readings. Returns `None` at the
    /// flight's end.
    pub fn advance(&mut self, now_ms: u64) -> Option<(Readings, Signals)> {
        let felt = self.watch(now_ms);
        self.supervise();
        (self.error.is_none() && self.phase != FlightPhase::Done).then_some(felt)
    }

    /// Advances like `advance`, but sends no flight commands and never ends.
    pub fn watch(&mut self, now_ms: u64) -> (Readings, Signals) {
        self.now_ms = now_ms;
        let mut speeds = RotorSpeeds::<ROTORS_MAX>::default();
        for (speed, throttle) in speeds.0.iter_mut().zip(&self.throttles) {
            let share = throttle.saturating_sub(THROTTLE_MIN) as f32 / f32::from(THROTTLE_MAX - THROTTLE_MIN);
            *speed = share * self.speed_max_rad_s;
        }
        if let Some(speed) = self.stopped_rotor.and_then(|rotor| speeds.0.get_mut(rotor)) {
            *speed = 0.0;
        }
        self.world.advance(&speeds);
        let view = self.world.look();
        if let Some(effects) = view.telemetry {
            self.rotor_speeds_rad_s.iter_mut().zip(&effects.rotor_speeds_rad_s).for_each(|(known, new)| *known = *new);
        }
        let readings = self.world.readings().copied().unwrap_or_default();
        // A vehicle without instruments gets its state from a tracker.
        if let Some(state) = view.state.filter(|_| self.world.readings().is_none() && now_ms % TRACKED_MS == 0) {
            self.say(&Uplink::State { sent_us: now_ms * 1000, state, sigmas: PoseSigmas::UNKNOWN });
        }
        let signals = self.transducers.signals(&readings);
        self.talk();
        (readings, signals)
    }

    /// Prints a summary of the flight, and fails if it was not flown well.
    pub fn verdict(self) -> Result<(), Box<dyn Error>> {
        let GroundPilot { error, off_m: (sum, count), mission, tilt_rad, now_ms, phase, .. } = self;
        let (ticks_us, ticks) = self.ticks_us;
        println!(
            "armed ticks take {:.1} us on average, the longest {:.1} us; {} late or lost",
            ticks_us / ticks.max(1) as f64,
            self.longest_us,
            self.late
        );
        let off_m = sum / count.max(1) as f64;
        let how = match &mission {
            Some(mission) => mission.summary(),
            None => format!("{off_m:.2} m off in hover, on average"),
        };
        println!("{:.1} s; {how}, largest tilt {tilt_rad:.2} rad", now_ms as f64 * 1e-3);
        if let Some(error) = error {
            return Err(error.into());
        }
        check(phase == FlightPhase::Done, "the flight ends")?;
        if let Some(mission) = &mission {
            mission.verdict()?;
            return check(tilt_rad < MISSION_TILT_RAD, "it flies well");
        }
        check(off_m < OFF_M && tilt_rad < TILT_RAD, "it flies well")
    }

    fn say(&mut self, message: &Uplink) {
        self.client.say(*message);
        self.send();
    }

    fn send(&mut self) {
        self.client.send(|_, frame| self.wire.send(frame));
    }

    /// Processes messages from the vehicle.
    fn talk(&mut self) {
        let bytes = self.wire.take();
        let now_ms = self.now_ms;
        let (armed, escs) = (&mut self.armed, &mut self.escs);
        let (ticks_us, longest_us, late) = (&mut self.ticks_us, &mut self.longest_us, &mut self.late);
        let (mission, position_m) = (&mut self.mission, self.world.plant().motion().position_m.into());
        if let Some(fetch) = self.fetch.as_mut().filter(|_| self.phase == FlightPhase::Fetches) {
            fetch.hear(&bytes, now_ms);
        }
        self.client.hear(&bytes, |_, message| match message {
            Downlink::Heartbeat { armed: is_armed, .. } => *armed = *is_armed,
            Downlink::Telemetry(Telemetry::EscStatus(status)) => *escs = Some((now_ms, *status)),
            Downlink::Mission { message: MissionMessage::Reached(number), .. } => {
                mission.iter_mut().for_each(|mission| mission.reach(*number, now_ms, position_m));
            }
            Downlink::Health(health) => {
                if *armed {
                    (ticks_us.0, ticks_us.1) = (ticks_us.0 + f64::from(health.tick_us), ticks_us.1 + 1);
                }
                (*longest_us, *late) = (health.tick_max_us, health.late_ticks);
            }
            _ => {}
        });
        for text in self.client.take_texts() {
            if self.prints {
                println!("{:7.3} s: {}", now_ms as f64 * 1e-3, text.text);
            }
            self.heard.push((now_ms, text.text));
        }
        if let (Some(mission), Some(end)) = (&mut self.mission, self.client.take_upload_end()) {
            mission.end_upload(end);
        }
        self.client.update(now_ms);
        self.send();
    }

    /// Commands the flight, and checks it.
    fn supervise(&mut self) {
        let motion = self.world.plant().motion();
        let [x, y, z]: [f64; 3] = motion.position_m.into();
        let tilt_rad = motion.attitude_rad.x.hypot(motion.attitude_rad.y);
        self.tilt_rad = self.tilt_rad.max(tilt_rad);
        let passed_ms = self.now_ms - self.since_ms;
        let second = passed_ms % 1000 == 999;
        if self.prints && self.now_ms % 5000 == 0 {
            let mut errors = String::new();
            if self.world.readings().is_some() {
                let ([east, north, up], height_m) = (self.transducers.fix_m(), self.transducers.height_m());
                let fix = format!("{:.2} {:.2} {:.2} m", east - x, north - y, up - z);
                errors = format!("; position fix off by {fix}, height by {:.2} m", height_m - z);
            }
            println!("{:7.3} s: {:?}, {x:.2} {y:.2} {z:.2} m{errors}", self.now_ms as f64 * 1e-3, self.phase);
        }
        let after = match &self.fetch {
            Some(_) => FlightPhase::Fetches,
            None if self.logs => FlightPhase::Rests,
            None => FlightPhase::Done,
        };
        let next = match self.phase {
            FlightPhase::Wakes => {
                let is_ready = self.mission.as_ref().is_none_or(MissionProgress::is_aboard);
                if second && self.now_ms > 3000 {
                    if is_ready {
                        self.client.say(Uplink::Command(VehicleCommand::Arm));
                    } else {
                        self.client.upload([(MissionType::MISSION, MissionProgress::items())], RetryPolicy::ONCE);
                    }
                    self.send();
                }
                self.armed.then_some(if self.mission.is_some() { FlightPhase::Mission } else { FlightPhase::Climbs })
            }
            FlightPhase::Climbs => {
                if passed_ms == 0 {
                    self.start_m = [x, y, z];
                }
                if passed_ms % 2000 == 500 && z - self.start_m[2] < 0.5 {
                    let height = Height { metres: HEIGHT_M, above: Datum::Here };
                    self.say(&Uplink::Command(VehicleCommand::TakeOff(height)));
                }
                (z - self.start_m[2] > 0.6 * f64::from(HEIGHT_M)).then_some(FlightPhase::Hovers)
            }
            FlightPhase::Hovers => {
                if passed_ms > 3000 {
                    self.off_m.0 += (x - self.start_m[0]).hypot(y - self.start_m[1]).hypot(z - self.start_m[2] - 5.0);
                    self.off_m.1 += 1;
                }
                (passed_ms >= self.hover_ms).then_some(FlightPhase::Lands)
            }
            FlightPhase::Mission => {
                if passed_ms % 2000 == 0 && z < 0.5 && self.mission.as_ref().is_some_and(|mission| !mission.has_begun())
                {
                    self.say(&Uplink::Command(VehicleCommand::StartMission(0, None)));
                }
                (!self.armed).then_some(after)
            }
            FlightPhase::Lands => {
                if passed_ms % 2000 == 0 && self.armed {
                    self.say(&Uplink::Command(VehicleCommand::Land));
                }
                (!self.armed).then_some(after)
            }
            FlightPhase::Fetches => {
                let now_ms = self.now_ms;
                if let Some(request) = self.fetch.as_mut().and_then(|fetch| fetch.next(now_ms)) {
                    self.say(&request);
                }
                self.fetch.as_ref().is_none_or(Fetch::is_done).then_some(FlightPhase::Done)
            }
            FlightPhase::Rests => (passed_ms >= REST_MS).then_some(FlightPhase::Done),
            FlightPhase::Done => None,
        };
        let patience_ms = match self.phase {
            FlightPhase::Wakes => PATIENCE_MS[0],
            FlightPhase::Climbs => PATIENCE_MS[1],
            FlightPhase::Lands => PATIENCE_MS[2],
            FlightPhase::Mission => MISSION_MS,
            FlightPhase::Fetches => fetch::PATIENCE_MS,
            _ => u64::MAX,
        };
        if let Some(next) = next {
            (self.phase, self.since_ms) = (next, self.now_ms);
        } else if passed_ms > patience_ms {
            self.error = Some(format!("{:?}: not within {} s", self.phase, patience_ms / 1000));
        }
        if matches!(self.phase, FlightPhase::Climbs | FlightPhase::Hovers) && !self.armed {
            self.error = Some(format!("{:?}: it disarmed", self.phase));
        }
        if tilt_rad > 1.5 {
            self.error = Some(format!("{:?}: it turned over", self.phase));
        }
    }
}

fn client() -> Client {
    let mut client = Client::new(Client::STATION);
    client.set_heartbeat_period(Some(HEARTBEAT_MS));
    client
}
