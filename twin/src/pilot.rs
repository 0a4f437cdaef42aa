//! A flight seen from outside: the plant with its instruments, a station at the telemetry UART, and what must hold.

use crate::check::check;
use crate::fetch::{self, Fetch};
use crate::tour::Tour;
use crate::wire::Wire;
use crate::world::Transducers;
use afbc_flight_core::motor::{THROTTLE_MAX, THROTTLE_MIN};
use afbc_ground::{Client, Patience};
use afbc_link::telemetry::EscStatus;
use afbc_link::{Command, Datum, Decoder, Downlink, Height, Mission, Plan, Telemetry, Uplink};
use afbc_onboard::Readings;
use afbc_plant::Motion;
use afbc_scenario::Scenario;
use afbc_sim::flight::World;
use afbc_types::{PoseSigmas, ROTORS_MAX, RotorSpeeds};
use rigless::machine::flight::Signals;
use std::error::Error;

/// Time between heartbeats [ms].
const HEARTBEAT_MS: u64 = 1_000;
/// Height of the hover above where it stood [m], and its time, if it is not said [ms].
const HEIGHT_M: f32 = 5.0;
const HOVER_MS: u64 = 30_000;
/// Time of the hover before logs are fetched [ms].
const SHORT_HOVER_MS: u64 = 6_000;
/// Time within which it must arm, climb, and land and disarm [ms].
const PATIENCE_MS: [u64; 3] = [40_000, 15_000, 40_000];
/// Time for which a log goes on once the vehicle is disarmed, with its last blocks [ms].
const REST_MS: u64 = 1_500;
/// Time within which it must fly the mission, and have disarmed [ms].
const TOUR_MS: u64 = 160_000;
/// What the hover may be off on average, and the vehicle be tilted by at any time, in gusts, and on a mission, which
/// begins each leg with an acceleration [m, rad].
const OFF_M: f64 = 2.5;
const TILT_RAD: f64 = 0.7;
const TOUR_TILT_RAD: f64 = 0.9;

/// Time between two states of a tracker [ms].
const TRACKED_MS: u64 = 10;

/// Parts of the flight.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Wakes,
    Climbs,
    Hovers,
    Tours,
    Lands,
    Fetches,
    /// Disarmed, until the log on its card has ended.
    Rests,
    Done,
}

/// The world around a vehicle, and who leads it through the flight.
pub struct Pilot {
    world: World,
    transducers: Transducers,
    throttles: Vec<u16>,
    /// True speeds of the rotors [rad/s], and the one that is not driven any more.
    rotor_speeds_rad_s: Vec<f64>,
    stopped_rotor: Option<usize>,
    speed_max_rad_s: f32,
    wire: Wire,
    client: Client,
    phase: Phase,
    /// Milliseconds, and when the phase began.
    now_ms: u64,
    since_ms: u64,
    armed: bool,
    /// Where it hovers, by the truth [m].
    start_m: [f64; 3],
    off_m: (f64, u64),
    /// Durations of armed ticks, as the vehicle tells them: sum, number; the longest since power-up [us]; late ones.
    ticks_us: (f64, u64),
    longest_us: f32,
    late: u32,
    /// How long it hovers [ms].
    hover_ms: u64,
    /// The mission that is flown in the place of a hover.
    tour: Option<Tour>,
    /// Waits for the log's end afterwards.
    logs: bool,
    /// Fetches the logs afterwards.
    fetch: Option<Fetch>,
    tilt_rad: f64,
    error: Option<String>,
    /// What it has said of its motor controllers last, with the time [ms].
    escs: Option<(u64, EscStatus)>,
    /// What the vehicle has said, with the time [ms], and whether it is printed.
    heard: Vec<(u64, String)>,
    prints: bool,
}

impl Pilot {
    /// At the start of a scenario, at the other end of the wire.
    pub fn new(scenario: &Scenario, wire: Wire) -> Result<Self, Box<dyn Error>> {
        Ok(Pilot {
            world: World::released(scenario, 1e-3)?,
            transducers: Transducers::new(),
            throttles: vec![0; scenario.rotors.len()],
            rotor_speeds_rad_s: vec![0.0; scenario.rotors.len()],
            stopped_rotor: None,
            // Of `vehicles/paper.toml`, which the images are built for.
            speed_max_rad_s: 1000.0,
            wire,
            client: client(),
            phase: Phase::Wakes,
            now_ms: 0,
            since_ms: 0,
            armed: false,
            start_m: [0.0; 3],
            off_m: (0.0, 0),
            ticks_us: (0.0, 0),
            longest_us: 0.0,
            late: 0,
            hover_ms: HOVER_MS,
            tour: None,
            logs: false,
            fetch: None,
            tilt_rad: 0.0,
            error: None,
            escs: None,
            heard: Vec::new(),
            prints: true,
        })
    }

    /// Prints nothing on the way.
    #[must_use]
    pub fn quiet(self) -> Self {
        Pilot { prints: false, ..self }
    }

    /// Returns one in the same world, at the other end of another wire, who is quiet and has heard nothing yet.
    pub fn again(&self, wire: Wire) -> Self {
        Pilot {
            world: self.world.clone(),
            transducers: self.transducers.clone(),
            throttles: self.throttles.clone(),
            rotor_speeds_rad_s: self.rotor_speeds_rad_s.clone(),
            wire,
            client: client(),
            tour: None,
            error: None,
            escs: None,
            heard: Vec::new(),
            prints: false,
            fetch: None,
            ..*self
        }
    }

    /// Has it hover for so long [ms].
    #[must_use]
    pub fn hovering(self, hover_ms: u64) -> Self {
        Pilot { hover_ms, ..self }
    }

    /// Has it fly a mission, from take-off to landing, in the place of a hover.
    #[must_use]
    pub fn touring(self) -> Self {
        Pilot { tour: Some(Tour::new()), ..self }
    }

    /// Waits for the end of the vehicle's log after the flight.
    #[must_use]
    pub fn logging(self) -> Self {
        Pilot { logs: true, ..self }
    }

    /// Has it list, download and erase the vehicle's logs after the flight.
    #[must_use]
    pub fn fetching(self) -> Self {
        let fetch = Some(Fetch::new(Decoder::new(Client::STATION)));
        Pilot { fetch, hover_ms: self.hover_ms.min(SHORT_HOVER_MS), ..self }
    }

    /// Returns what has been downloaded, once all is, and before it is erased.
    pub fn fetched(&self) -> Option<&Fetch> {
        self.fetch.as_ref().filter(|fetch| fetch.has_all())
    }

    /// Returns what the motors' wires said last.
    pub fn throttles(&self) -> &[u16] {
        &self.throttles
    }

    /// Returns the rotors' true speeds [rad/s].
    pub fn rotor_speeds_rad_s(&self) -> &[f64] {
        &self.rotor_speeds_rad_s
    }

    /// Drives a rotor no more.
    pub fn stop_rotor(&mut self, rotor: usize) {
        self.stopped_rotor = Some(rotor);
    }

    /// Returns what the vehicle has said of its motor controllers last, and when [ms].
    pub fn escs(&self) -> Option<(u64, EscStatus)> {
        self.escs
    }

    /// Returns the vehicle's true motion.
    pub fn motion(&self) -> Motion {
        self.world.plant().motion()
    }

    /// True if the vehicle has said so last.
    pub fn armed(&self) -> bool {
        self.armed
    }

    /// Returns what the vehicle has said, with the times [ms].
    pub fn heard(&self) -> &[(u64, String)] {
        &self.heard
    }

    /// Returns for how long it has hovered [ms].
    pub fn hovers_ms(&self) -> Option<u64> {
        (self.phase == Phase::Hovers).then(|| self.now_ms - self.since_ms)
    }

    /// Takes what the motors' wires say; none keeps what was said before.
    pub fn command(&mut self, throttles: impl IntoIterator<Item = Option<u16>>) {
        for (known, new) in self.throttles.iter_mut().zip(throttles) {
            *known = new.unwrap_or(*known);
        }
    }

    /// Advances to this millisecond, and returns what the transducers feel there; none at the end.
    pub fn advance(&mut self, now_ms: u64) -> Option<(Readings, Signals)> {
        let felt = self.watch(now_ms);
        self.supervise();
        (self.error.is_none() && self.phase != Phase::Done).then_some(felt)
    }

    /// The same, but leaves the vehicle to itself, whatever it does.
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
        // A vehicle without instruments has a tracker.
        if let Some(state) = view.state.filter(|_| self.world.readings().is_none() && now_ms % TRACKED_MS == 0) {
            self.say(&Uplink::State { sent_us: now_ms * 1000, state, sigmas: PoseSigmas::UNKNOWN });
        }
        let signals = self.transducers.feel(&readings);
        self.talk();
        (readings, signals)
    }

    /// Prints how the flight was, and fails if it was not well flown.
    pub fn verdict(self) -> Result<(), Box<dyn Error>> {
        let Pilot { error, off_m: (sum, count), tour, tilt_rad, now_ms, phase, .. } = self;
        let (ticks_us, ticks) = self.ticks_us;
        println!(
            "armed ticks take {:.1} us on average, the longest {:.1} us; {} late or lost",
            ticks_us / ticks.max(1) as f64,
            self.longest_us,
            self.late
        );
        let off_m = sum / count.max(1) as f64;
        let how = match &tour {
            Some(tour) => tour.told(),
            None => format!("hover off by {off_m:.2} m on average"),
        };
        println!("{:.1} s; {how}, largest tilt {tilt_rad:.2} rad", now_ms as f64 * 1e-3);
        if let Some(error) = error {
            return Err(error.into());
        }
        check(phase == Phase::Done, "the flight ends")?;
        if let Some(tour) = &tour {
            tour.verdict()?;
            return check(tilt_rad < TOUR_TILT_RAD, "it flies well");
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

    /// Hears the vehicle.
    fn talk(&mut self) {
        let bytes = self.wire.take();
        let now_ms = self.now_ms;
        let (armed, escs) = (&mut self.armed, &mut self.escs);
        let (ticks_us, longest_us, late) = (&mut self.ticks_us, &mut self.longest_us, &mut self.late);
        let (tour, position_m) = (&mut self.tour, self.world.plant().motion().position_m.into());
        if let Some(fetch) = self.fetch.as_mut().filter(|_| self.phase == Phase::Fetches) {
            fetch.hear(&bytes, now_ms);
        }
        self.client.hear(&bytes, |_, message| match message {
            Downlink::Heartbeat { armed: is_armed, .. } => *armed = *is_armed,
            Downlink::Telemetry(Telemetry::EscStatus(status)) => *escs = Some((now_ms, *status)),
            Downlink::Mission { message: Mission::Reached(number), .. } => {
                tour.iter_mut().for_each(|tour| tour.reach(*number, now_ms, position_m));
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
        if let (Some(tour), Some(end)) = (&mut self.tour, self.client.take_upload_end()) {
            tour.end_upload(end);
        }
        self.client.turn(now_ms);
        self.send();
    }

    /// Leads it through the flight, and watches.
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
                errors = format!("; fix off by {fix}, height by {:.2} m", height_m - z);
            }
            println!("{:7.3} s: {:?}, {x:.2} {y:.2} {z:.2} m{errors}", self.now_ms as f64 * 1e-3, self.phase);
        }
        let after = match &self.fetch {
            Some(_) => Phase::Fetches,
            None if self.logs => Phase::Rests,
            None => Phase::Done,
        };
        let next = match self.phase {
            Phase::Wakes => {
                let is_ready = self.tour.as_ref().is_none_or(Tour::is_aboard);
                if second && self.now_ms > 3000 {
                    if is_ready {
                        self.client.say(Uplink::Command(Command::Arm));
                    } else {
                        self.client.upload([(Plan::MISSION, Tour::items())], Patience::ONCE);
                    }
                    self.send();
                }
                self.armed.then_some(if self.tour.is_some() { Phase::Tours } else { Phase::Climbs })
            }
            Phase::Climbs => {
                if passed_ms == 0 {
                    self.start_m = [x, y, z];
                }
                if passed_ms % 2000 == 500 && z - self.start_m[2] < 0.5 {
                    let height = Height { metres: HEIGHT_M, above: Datum::Here };
                    self.say(&Uplink::Command(Command::TakeOff(height)));
                }
                (z - self.start_m[2] > 0.6 * f64::from(HEIGHT_M)).then_some(Phase::Hovers)
            }
            Phase::Hovers => {
                if passed_ms > 3000 {
                    self.off_m.0 += (x - self.start_m[0]).hypot(y - self.start_m[1]).hypot(z - self.start_m[2] - 5.0);
                    self.off_m.1 += 1;
                }
                (passed_ms >= self.hover_ms).then_some(Phase::Lands)
            }
            Phase::Tours => {
                if passed_ms % 2000 == 0 && z < 0.5 && self.tour.as_ref().is_some_and(|tour| !tour.has_begun()) {
                    self.say(&Uplink::Command(Command::StartMission(0, None)));
                }
                (!self.armed).then_some(after)
            }
            Phase::Lands => {
                if passed_ms % 2000 == 0 && self.armed {
                    self.say(&Uplink::Command(Command::Land));
                }
                (!self.armed).then_some(after)
            }
            Phase::Fetches => {
                let now_ms = self.now_ms;
                if let Some(request) = self.fetch.as_mut().and_then(|fetch| fetch.next(now_ms)) {
                    self.say(&request);
                }
                self.fetch.as_ref().is_none_or(Fetch::is_done).then_some(Phase::Done)
            }
            Phase::Rests => (passed_ms >= REST_MS).then_some(Phase::Done),
            Phase::Done => None,
        };
        let patience_ms = match self.phase {
            Phase::Wakes => PATIENCE_MS[0],
            Phase::Climbs => PATIENCE_MS[1],
            Phase::Lands => PATIENCE_MS[2],
            Phase::Tours => TOUR_MS,
            Phase::Fetches => fetch::PATIENCE_MS,
            _ => u64::MAX,
        };
        if let Some(next) = next {
            (self.phase, self.since_ms) = (next, self.now_ms);
        } else if passed_ms > patience_ms {
            self.error = Some(format!("{:?}: not within {} s", self.phase, patience_ms / 1000));
        }
        if matches!(self.phase, Phase::Climbs | Phase::Hovers) && !self.armed {
            self.error = Some(format!("{:?}: it disarmed", self.phase));
        }
        if tilt_rad > 1.5 {
            self.error = Some(format!("{:?}: it turned over", self.phase));
        }
    }
}

fn client() -> Client {
    let mut client = Client::new(Client::STATION);
    client.beat_every(Some(HEARTBEAT_MS));
    client
}
