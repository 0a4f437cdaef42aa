//! Checks what must hold at every tick of every flight. A model follows the vehicle from outside, by the messages of
//! its stations and the true motion, and complains of everything that must not happen.

use super::{Tick, Truth};
use afbc_comms::services::modes;
use afbc_guidance::FlightMode;
use afbc_mavlink::{
    Address, CommandResult, ControlRequest, Downlink, ExternalTarget, MissionMessage, ParameterRequest, Uplink,
    VehicleCommand,
};

/// Time within which a command must be answered \[ms\].
const ANSWERED_MS: u32 = 1000;
/// Time in which rotors without a command stop, because of their lag \[ms\]. `TURNS_RAD_S` is the speed from which a
/// rotor counts as turning \[rad/s\].
const STOPS_MS: u32 = 300;
const TURNS_RAD_S: f64 = 5.0;
/// Height of the centre of mass above which the vehicle is certainly in the air \[m\].
const AIR_M: f64 = 0.3;
/// In the air, the fastest rotor must not stay below this speed for longer than `UNCARRIED_MS` \[rad/s, ms\]. It is
/// half of the hover speed.
const CARRIES_RAD_S: f64 = 100.0;
const UNCARRIED_MS: u32 = 300;
/// Largest tilt and speed at which the vehicle may be armed: the flight core's limits plus a margin for the estimate's
/// error.
const ARMS_RAD: f64 = 0.3;
const ARMS_M_S: f64 = 0.7;
/// Tolerance for the link's clock and the estimate \[ms\].
const SOON_MS: u32 = 60;
/// Age at which targets count as lost, the default of COM_OF_LOSS_T \[ms\].
const TARGETS_MS: u32 = 500;

/// Largest accepted coordinate of a target \[m\].
const PLACE_MAX_M: f32 = 1e5;

/// Announcements with which the flight core may stop the motors in the air.
pub const CUTS: [&str; 2] = ["tumbled: motors stopped", "no state for 2.25 s: motors stopped"];
const DESCENDS: &str = "no state for 0.25 s: descending";
const DISARMS: &str = "on the ground: disarming";

/// Bounds of a flight from arming on, until the motors are stopped in the air.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub tilt_rad: f64,
    pub speed_m_s: f64,
    /// Largest height and distance from the start \[m\].
    pub height_m: f64,
    pub radius_m: f64,
    /// Fastest allowed touch-down \[m/s\].
    pub touch_m_s: f64,
    /// True if the flight core may stop the motors in the air, with an announcement.
    pub cut: bool,
}

impl Bounds {
    pub const DEFAULT: Self =
        Bounds { tilt_rad: 0.65, speed_m_s: 7.5, height_m: 20.0, radius_m: 60.0, touch_m_s: 1.0, cut: false };
}

/// Extremes of a flight.
#[derive(Clone, Copy, Debug, Default)]
pub struct Extremes {
    pub tilt_rad: f64,
    pub speed_m_s: f64,
    pub height_m: f64,
    pub radius_m: f64,
    pub touch_m_s: Option<f64>,
}

/// Model of the vehicle that follows a flight and collects complaints.
pub struct Checker {
    bounds: Bounds,
    /// Silence after which a station counts as lost \[ms\]. `acts_on_station` is true if the vehicle then acts.
    station_lost_ms: u32,
    acts_on_station: bool,
    open: Vec<(u32, Address, VehicleCommand)>,
    /// Address of the station in control, and the time when it was last heard.
    holder: Option<(Address, u32)>,
    /// Time when the last station in control was heard, whichever it was.
    commander_ms: Option<u32>,
    target_ms: Option<u32>,
    armed: bool,
    mode: FlightMode,
    mode_ms: u32,
    disarmed_ms: u32,
    descends: Option<u32>,
    disarms_told: bool,
    station_told: bool,
    /// True from a stop of the motors in the air until the vehicle stands.
    falls: bool,
    flown: bool,
    uncarried_ms: u32,
    last: Option<Truth>,
    last_ms: u32,
    pub extremes: Extremes,
    /// Announced texts, without immediate repetitions.
    pub texts: Vec<String>,
    pub complaints: Vec<String>,
}

impl Checker {
    /// Makes the checker of a vehicle that has just been powered up. `station_lost_s` is COM_DL_LOSS_T.
    pub fn new(bounds: Bounds, station_lost_s: f32, acts_on_station: bool) -> Self {
        Checker {
            bounds,
            station_lost_ms: (station_lost_s * 1e3) as u32,
            acts_on_station,
            open: Vec::new(),
            holder: None,
            commander_ms: None,
            target_ms: None,
            armed: false,
            mode: FlightMode::Hold,
            mode_ms: 0,
            disarmed_ms: 0,
            descends: None,
            disarms_told: false,
            station_told: false,
            falls: false,
            flown: false,
            uncarried_ms: 0,
            last: None,
            last_ms: 0,
            extremes: Extremes::default(),
            texts: Vec::new(),
            complaints: Vec::new(),
        }
    }

    pub fn armed(&self) -> bool {
        self.armed
    }

    pub fn mode(&self) -> FlightMode {
        self.mode
    }

    fn complain(&mut self, time_ms: u32, what: &str) {
        // The first complaints tell the most, so later ones are dropped.
        if self.complaints.len() < 8 {
            self.complaints.push(format!("{:.3} s: {what}", f64::from(time_ms) * 1e-3));
        }
    }

    /// Checks a tick.
    pub fn see(&mut self, tick: &Tick) {
        let time_ms = tick.time_ms;
        tick.sent.iter().for_each(|(from, message)| self.hear(time_ms, *from, message));
        let accepted = self.answers(tick);
        let texts: Vec<String> = tick.heard.iter().filter_map(text).collect();
        for text in &texts {
            self.announced(time_ms, text, &accepted);
            if self.texts.last() != Some(text) {
                self.texts.push(text.clone());
            }
        }
        self.arming(tick, &accepted, &texts);
        self.heartbeats(tick);
        self.silences(time_ms);
        self.motors(tick);
        self.motion(tick);
        (self.last, self.last_ms) = (Some(tick.truth), time_ms);
    }

    /// Takes a message to the vehicle into the model, and tracks which station is in control after it.
    fn hear(&mut self, time_ms: u32, from: Address, message: &Uplink) {
        if let Uplink::Target(ExternalTarget::Motion(target)) = message
            && target.position_m.iter().any(|place_m| place_m.abs() > PLACE_MAX_M)
        {
            // The vehicle drops a target with such a coordinate when it reads the message.
            return;
        }
        if let Uplink::Command(command) = message {
            self.open.push((time_ms, from, *command));
        }
        let present = |heard_ms: u32| time_ms.saturating_sub(heard_ms) <= self.station_lost_ms;
        let last = self.holder.map(|(holder, _)| holder);
        let holder = self.holder.filter(|(_, heard_ms)| present(*heard_ms)).map(|(holder, _)| holder);
        let claims = match message {
            Uplink::Command(command) => needs_control(command),
            Uplink::Target(_) | Uplink::Setpoint(_) => true,
            Uplink::Parameter(request) => matches!(request, ParameterRequest::Set { .. }),
            Uplink::Mission(message) => {
                matches!(message, MissionMessage::Count(..) | MissionMessage::Clear(_) | MissionMessage::SetCurrent(_))
            }
            Uplink::Control(ControlRequest::Release) if holder == Some(from) => {
                // The station in control has given up control.
                self.commander_ms = Some(time_ms);
                return self.holder = None;
            }
            Uplink::Control(wish) => *wish == ControlRequest::Take,
            _ => false,
        };
        if last == Some(from) || claims && holder.is_none() {
            (self.holder, self.commander_ms) = (Some((from, time_ms)), Some(time_ms));
            if matches!(message, Uplink::Target(_) | Uplink::Setpoint(_)) {
                self.target_ms = Some(time_ms);
            }
        }
    }

    /// Checks that each command is answered once, and soon. Returns the commands accepted in this tick.
    fn answers(&mut self, tick: &Tick) -> Vec<(Address, VehicleCommand)> {
        let mut accepted = Vec::new();
        for message in &tick.heard {
            let Downlink::CommandAck { command, answer, to } = *message else { continue };
            let place = self.open.iter().position(|(_, from, it)| *from == to && it.id() == command);
            match place.map(|place| self.open.remove(place)) {
                None => self.complain(tick.time_ms, &format!("an answer to nothing: {command}")),
                Some((_, from, command)) if answer == CommandResult::Accepted => {
                    let holder = self.holder.map(|(holder, _)| holder);
                    if needs_control(&command) && holder != Some(from) {
                        self.complain(tick.time_ms, &format!("obeys {from:?}, who is not in control: {command:?}"));
                    }
                    accepted.push((from, command));
                }
                Some(_) => {}
            }
        }
        while let Some((_, from, command)) =
            self.open.first().copied().filter(|(at_ms, ..)| tick.time_ms.saturating_sub(*at_ms) > ANSWERED_MS)
        {
            self.complain(tick.time_ms, &format!("no answer to {command:?} of {from:?}"));
            self.open.remove(0);
        }
        accepted
    }

    /// Checks arming: only an accepted command arms, and only at rest. The vehicle disarms on the ground, by force or
    /// with an announcement.
    fn arming(&mut self, tick: &Tick, accepted: &[(Address, VehicleCommand)], texts: &[String]) {
        let Some(armed) = super::session::is_armed(tick) else { return };
        let (was, time_ms, truth) = (self.armed, tick.time_ms, tick.truth);
        let has = |wanted: VehicleCommand| accepted.iter().any(|(_, command)| *command == wanted);
        self.armed = armed;
        if armed && !was {
            (self.disarms_told, self.station_told, self.flown) = (false, false, false);
            self.descends = None;
            if !has(VehicleCommand::Arm) {
                self.complain(time_ms, "armed by nobody");
            }
            if truth.position_m.z > AIR_M || truth.tilt_rad > ARMS_RAD || truth.velocity_m_s.norm() > ARMS_M_S {
                self.complain(time_ms, &format!("armed in {truth:?}"));
            }
        }
        if was && !armed {
            self.disarmed_ms = time_ms;
            let in_air = truth.position_m.z > AIR_M;
            self.falls = in_air;
            let cut = texts.iter().any(|text| CUTS.contains(&text.as_str()));
            let grounded = has(VehicleCommand::Disarm) || self.disarms_told || self.descends.is_some();
            let why = match (has(VehicleCommand::Kill), cut, in_air) {
                (true, ..) => None,
                (_, true, true) if !self.bounds.cut => Some("the motors are stopped in the air"),
                (_, true, _) => None,
                (.., true) => Some("disarmed in the air"),
                _ if grounded => None,
                _ => Some("disarmed, and nobody was told"),
            };
            why.into_iter().for_each(|why| self.complain(time_ms, why));
        }
    }

    /// Checks that the reason of an announced transition allows it.
    fn announced(&mut self, time_ms: u32, text: &str, accepted: &[(Address, VehicleCommand)]) {
        match text {
            DESCENDS => (self.descends, self.mode, self.mode_ms) = (Some(time_ms), FlightMode::Land, time_ms),
            DISARMS => self.disarms_told = true,
            _ => {}
        }
        self.station_told |= text.contains("station lost") && !text.contains("cleared");
        let Some((mode, reason)) = text.split_once(": ") else { return };
        let Some(mode) = FlightMode::ALL.into_iter().find(|it| it.name() == mode) else { return };
        let asked = |(_, command): &(Address, VehicleCommand)| wanted(command) == Some(mode);
        let silent_ms = self.commander_ms.map_or(0, |heard_ms| time_ms.saturating_sub(heard_ms));
        let targetless_ms = self.target_ms.map_or(u32::MAX, |at_ms| time_ms.saturating_sub(at_ms));
        let lands = matches!(mode, FlightMode::Land | FlightMode::Return);
        let fits = match reason {
            "ordered" => accepted.iter().any(asked),
            "done" => matches!(self.mode, FlightMode::Takeoff | FlightMode::Mission) && mode == FlightMode::Hold,
            "by the mission" => self.mode == FlightMode::Mission && lands,
            "take-off failed: still on the ground" => matches!(mode, FlightMode::Hold | FlightMode::Land),
            "disarmed" => mode == FlightMode::Hold && !self.armed && time_ms - self.disarmed_ms <= 2,
            "station lost" => silent_ms + SOON_MS > self.station_lost_ms,
            "the state estimate is back" => self.mode == FlightMode::Land && self.descends.is_some(),
            "no targets" => self.mode == FlightMode::Offboard && targetless_ms + SOON_MS > TARGETS_MS,
            // The safety net may select these modes. The tests that provoke the safety net check which mode it selects.
            _ => matches!(mode, FlightMode::Hold | FlightMode::Return | FlightMode::Land),
        };
        if mode == self.mode {
            self.complain(time_ms, &format!("announced twice: {text}"));
        } else if !fits {
            self.complain(time_ms, &format!("{:?} becomes {text}", self.mode));
        }
        (self.mode, self.mode_ms) = (mode, time_ms);
    }

    /// Checks that heartbeats show the mode announced last.
    fn heartbeats(&mut self, tick: &Tick) {
        for message in &tick.heard {
            let Downlink::Heartbeat { armed, mode, .. } = *message else { continue };
            if mode != modes::custom(self.mode) && tick.time_ms - self.mode_ms > 2 {
                let reported = modes::of_custom(mode);
                self.complain(tick.time_ms, &format!("the heartbeat says {reported:?}, announced was {:?}", self.mode));
            }
            if armed != self.armed {
                self.complain(tick.time_ms, "heartbeat and rotors disagree");
            }
        }
    }

    /// Checks that silence of stations and targets is noticed.
    fn silences(&mut self, time_ms: u32) {
        let silent_ms = self.commander_ms.map_or(0, |heard_ms| time_ms.saturating_sub(heard_ms));
        if silent_ms + SOON_MS < self.station_lost_ms {
            self.station_told = false;
        }
        let lost = self.armed && silent_ms > self.station_lost_ms + 2 * SOON_MS;
        if lost && self.acts_on_station && !self.station_told {
            self.complain(time_ms, "the station is lost, and nobody was told");
            self.station_told = true;
        }
        let targetless_ms = self.target_ms.map_or(u32::MAX, |at_ms| time_ms.saturating_sub(at_ms));
        let offboard = self.armed && self.mode == FlightMode::Offboard && time_ms - self.mode_ms > SOON_MS;
        if offboard && targetless_ms > TARGETS_MS + 2 * SOON_MS {
            self.complain(time_ms, "offboard without targets");
            self.mode_ms = time_ms;
        }
    }

    /// Checks that motors only turn while armed, and carry the vehicle in the air.
    fn motors(&mut self, tick: &Tick) {
        for message in &tick.heard {
            if let Downlink::Rotors { armed: false, speeds, .. } = message
                && speeds.0.iter().any(|speed| *speed != 0.0)
            {
                self.complain(tick.time_ms, "disarmed motors are commanded to turn");
            }
        }
        let stopped = !self.armed && tick.time_ms - self.disarmed_ms > STOPS_MS;
        if stopped && tick.truth.rotor_rad_s > TURNS_RAD_S {
            self.complain(tick.time_ms, "disarmed motors turn");
        }
        let idles = self.armed && tick.truth.position_m.z > AIR_M && tick.truth.rotor_rad_s < CARRIES_RAD_S;
        self.uncarried_ms = if idles { self.uncarried_ms + 1 } else { 0 };
        if self.uncarried_ms == UNCARRIED_MS {
            self.complain(tick.time_ms, "motors off in the air");
        }
    }

    /// Checks that the vehicle stays within its bounds and touches down gently.
    fn motion(&mut self, tick: &Tick) {
        let (truth, bounds) = (tick.truth, self.bounds);
        if !self.armed {
            return;
        }
        let z = truth.position_m.z;
        self.flown |= z > 2.0 * AIR_M;
        let touches = truth.on_ground && self.flown;
        if let Some(last) = self.last.filter(|_| touches) {
            self.flown = false;
            let speed_m_s = -last.velocity_m_s.z;
            let fastest = self.extremes.touch_m_s.map_or(speed_m_s, |touch_m_s| touch_m_s.max(speed_m_s));
            self.extremes.touch_m_s = Some(fastest);
            if speed_m_s > bounds.touch_m_s {
                self.complain(tick.time_ms, &format!("touches the ground at {speed_m_s:.2} m/s"));
            }
        }
        let now = [truth.tilt_rad, truth.velocity_m_s.norm(), z, truth.position_m.xy().norm()];
        let Extremes { tilt_rad, speed_m_s, height_m, radius_m, .. } = &mut self.extremes;
        let most = [bounds.tilt_rad, bounds.speed_m_s, bounds.height_m, bounds.radius_m];
        let mut beyond = None;
        for (((extreme, now), most), what) in [tilt_rad, speed_m_s, height_m, radius_m]
            .into_iter()
            .zip(now)
            .zip(most)
            .zip(["tilt", "speed", "height", "distance"])
        {
            if now > most && *extreme <= most {
                beyond = Some(format!("{what} {now:.2}, beyond {most}"));
            }
            *extreme = extreme.max(now);
        }
        beyond.into_iter().for_each(|what| self.complain(tick.time_ms, &what));
    }

    /// Returns how the flight ended.
    pub fn end(&mut self) -> End {
        let Some(truth) = self.last else { return End::Lost };
        let end = match (self.armed, !truth.on_ground) {
            (false, false) if truth.rotor_rad_s < TURNS_RAD_S => End::Disarmed,
            (true, true) if self.mode == FlightMode::Hold && truth.velocity_m_s.norm() < 1.5 => End::Holds,
            (true, true) => End::Flies,
            _ => End::Lost,
        };
        if end == End::Lost {
            self.complain(self.last_ms, &format!("ends armed on the ground or falling: {truth:?}"));
        }
        end
    }

    /// Returns the true motion after the last tick.
    pub fn last(&self) -> Option<Truth> {
        self.last
    }
}

/// End of a flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The vehicle is disarmed on the ground, with the motors still.
    Disarmed,
    /// The vehicle is in the air and nearly still, in hold.
    Holds,
    /// The vehicle is in the air, in another mode or moving.
    Flies,
    /// None of the above.
    Lost,
}

fn text(message: &Downlink) -> Option<String> {
    match message {
        Downlink::Text { text, .. } => Some(text.to_str().unwrap_or_default().to_owned()),
        _ => None,
    }
}

/// True if only the station in control may give the command (docs/security.md).
fn needs_control(command: &VehicleCommand) -> bool {
    matches!(
        command,
        VehicleCommand::Arm
            | VehicleCommand::Engage
            | VehicleCommand::TakeOff(_)
            | VehicleCommand::Land
            | VehicleCommand::Return
            | VehicleCommand::SelectMode(_)
            | VehicleCommand::SelectStandardMode(_)
            | VehicleCommand::Reposition { .. }
            | VehicleCommand::Orbit { .. }
            | VehicleCommand::Speed(_)
            | VehicleCommand::Home(_)
            | VehicleCommand::StartMission(..)
            | VehicleCommand::SetCurrent(..)
            | VehicleCommand::Reboot(_)
            | VehicleCommand::Storage(_)
    )
}

/// Returns the mode that a command requests.
fn wanted(command: &VehicleCommand) -> Option<FlightMode> {
    match command {
        VehicleCommand::TakeOff(_) => Some(FlightMode::Takeoff),
        VehicleCommand::Land => Some(FlightMode::Land),
        VehicleCommand::Return => Some(FlightMode::Return),
        VehicleCommand::Reposition { .. } => Some(FlightMode::Hold),
        VehicleCommand::StartMission(..) => Some(FlightMode::Mission),
        VehicleCommand::SelectMode(custom) => modes::of_custom(*custom),
        VehicleCommand::SelectStandardMode(standard) => modes::of_standard(*standard),
        _ => None,
    }
}
