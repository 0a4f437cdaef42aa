//! A plan flown by a served vehicle, in lockstep: uploaded, started and watched by messages, as a station does.

use crate::plan_file::QgcPlan;
use crate::vehicle::ServedVehicle;
use afbc_guidance::FlightMode;
use afbc_link::{
    Address, Answer, Command, Decoder, Downlink, FRAME_MAX, Mission, MissionItem, MissionResult, Plan, Sender, Uplink,
};
use afbc_station::services::modes::custom;

const STATION: Address = Address { system: 255, component: 190 };
/// Number of its peer.
const PEER: u32 = 0;
/// Commands that it gives.
const ARM: u16 = 400;
const START: u16 = 300;
/// Time within which the vehicle is ready, and answers \[ms\].
const READY_MS: u64 = 60_000;
const ANSWER_MS: u64 = 3_000;
/// Time between heartbeats, and between two attempts to arm \[ms\].
const HEARTBEAT_MS: u64 = 1_000;
/// Time in hold after which a mission that is not complete has been stopped: MISSION_CURRENT comes every second \[ms\].
const STOPPED_MS: u64 = 2_500;
/// Time in which a vehicle whose motors have stopped in the air comes to the ground \[ms\].
const FALL_MS: u64 = 60_000;
/// Speed at which a vehicle that comes to the ground has fallen, twice that of the fastest descent, and the tilt of one
/// that lies there \[m/s, rad\].
const FALLS_M_S: f64 = 3.0;
const LIES_RAD: f64 = 1.0;
/// `MISSION_STATE`: complete.
const COMPLETE: u8 = 5;

/// How a plan has ended.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanEnd {
    /// Items that were reached.
    pub reached: Vec<u16>,
    /// True if the mission is complete.
    pub complete: bool,
    /// True if the vehicle has left the mission for hold before that, where it stays.
    pub stopped: bool,
    /// True if the motors have stopped.
    pub disarmed: bool,
    /// True if it has come to the ground faster than it lands, or lies there.
    pub fell: bool,
    /// Duration of the flight \[s\].
    pub flight_s: f64,
}

/// A station and what it has heard.
struct Station<'a> {
    vehicle: &'a mut ServedVehicle,
    log: &'a mut dyn FnMut(&str),
    decoder: Decoder<Downlink>,
    now_ms: u64,
    answers: Vec<(u16, Answer)>,
    missions: Vec<Mission>,
    texts: Vec<String>,
    reached: Vec<u16>,
    complete: bool,
    armed: bool,
    /// Since when it has been in hold \[ms\].
    hold_ms: Option<u64>,
    /// Its speed downwards in the last step, and the largest at which it has come to the ground \[m/s\].
    sinks_m_s: f64,
    struck_m_s: f64,
    on_ground: bool,
}

/// Flies `plan` with a vehicle that stands at its start, for at most `limit_s`; what is worth a line goes to `log`.
///
/// # Errors
/// A line on what the vehicle refuses.
pub fn fly_plan(
    vehicle: &mut ServedVehicle,
    plan: &QgcPlan,
    limit_s: f64,
    log: &mut dyn FnMut(&str),
) -> Result<PlanEnd, String> {
    let mut station = Station {
        vehicle,
        log,
        decoder: Decoder::new(STATION),
        now_ms: 0,
        answers: Vec::new(),
        missions: Vec::new(),
        texts: Vec::new(),
        reached: Vec::new(),
        complete: false,
        armed: false,
        hold_ms: None,
        sinks_m_s: 0.0,
        struck_m_s: 0.0,
        on_ground: true,
    };
    station.fly(plan, limit_s)
}

impl Station<'_> {
    fn fly(&mut self, plan: &QgcPlan, limit_s: f64) -> Result<PlanEnd, String> {
        if plan.mission.is_empty() {
            return Err("the mission has no items; add some".into());
        }
        self.get_ready()?;
        // The mission is checked against the fence.
        self.upload(&plan.fence, Plan::FENCE, "geoFence")?;
        self.upload(&plan.rally, Plan::RALLY, "rallyPoints")?;
        self.upload(&plan.mission, Plan::MISSION, "mission")?;
        self.order(Command::Arm, ARM)?;
        let begun_ms = self.now_ms;
        self.order(Command::StartMission(0, None), START)?;
        let limit_ms = begun_ms + (limit_s * 1e3) as u64;
        while self.now_ms < limit_ms && self.armed && !self.complete && !self.is_stopped() {
            self.step();
        }
        let flight_s = (self.now_ms - begun_ms) as f64 * 1e-3;
        // Motors that were stopped in the air: how it ends is seen on the ground.
        let fallen_ms = self.now_ms + FALL_MS;
        while !self.armed && !self.on_ground && self.now_ms < fallen_ms {
            self.step();
        }
        let [roll, pitch, _] = self.vehicle.world().plant().motion().attitude_rad.into();
        let lies = self.on_ground && f64::max(roll.abs(), pitch.abs()) > LIES_RAD;
        Ok(PlanEnd {
            reached: std::mem::take(&mut self.reached),
            complete: self.complete,
            stopped: self.is_stopped() && !self.complete && self.armed,
            disarmed: !self.armed,
            fell: lies || self.struck_m_s > FALLS_M_S,
            flight_s,
        })
    }

    /// True if the vehicle has left the mission for hold, and does not say that it is complete.
    fn is_stopped(&self) -> bool {
        self.hold_ms.is_some_and(|hold_ms| self.now_ms - hold_ms > STOPPED_MS)
    }

    /// Waits until the vehicle would arm.
    fn get_ready(&mut self) -> Result<(), String> {
        while self.now_ms < READY_MS {
            self.texts.clear();
            self.say(&Uplink::Command(Command::CheckArming));
            (0..HEARTBEAT_MS).for_each(|_| self.step());
            if self.texts.iter().any(|text| text == "ready to arm") {
                return Ok(());
            }
        }
        Err(format!("the vehicle does not get ready: {}", self.texts.join(", ")))
    }

    fn upload(&mut self, items: &[MissionItem], plan: Plan, part: &str) -> Result<(), String> {
        self.missions.clear();
        self.texts.clear();
        self.say(&Uplink::Mission(Mission::Count(items.len() as u16, plan)));
        // The vehicle asks for one item after the other.
        let given_up_ms = self.now_ms + ANSWER_MS + 100 * items.len() as u64;
        while self.now_ms < given_up_ms {
            self.step();
            for message in std::mem::take(&mut self.missions) {
                match message {
                    Mission::Request(number, asked) if asked == plan => {
                        if let Some(item) = items.get(usize::from(number)) {
                            self.say(&Uplink::Mission(Mission::Item(*item, plan)));
                        }
                    }
                    Mission::Ack(MissionResult::ACCEPTED, of) if of == plan => return Ok(()),
                    Mission::Ack(MissionResult(result), of) if of == plan => {
                        // The text follows.
                        (0..100).for_each(|_| self.step());
                        let why = self.texts.last().cloned().unwrap_or_else(|| format!("result {result}"));
                        return Err(format!("{part}: the vehicle refuses it: {why}; change it in QGroundControl"));
                    }
                    _ => (),
                }
            }
        }
        Err(format!("{part}: the vehicle does not answer"))
    }

    fn order(&mut self, command: Command, id: u16) -> Result<(), String> {
        self.answers.clear();
        self.texts.clear();
        self.say(&Uplink::Command(command));
        let given_up_ms = self.now_ms + ANSWER_MS;
        while self.now_ms < given_up_ms {
            self.step();
            match self.answers.iter().find(|(answered, _)| *answered == id).map(|(_, answer)| *answer) {
                None => (),
                Some(Answer::Accepted) => {
                    self.armed = true;
                    // Until its heartbeat says so.
                    (0..HEARTBEAT_MS).for_each(|_| self.step());
                    return Ok(());
                }
                Some(answer) => {
                    (0..100).for_each(|_| self.step());
                    return Err(format!("the vehicle does not fly: {answer:?}, {}", self.texts.join(", ")));
                }
            }
        }
        Err("the vehicle does not answer".into())
    }

    fn say(&mut self, message: &Uplink) {
        let mut buffer = [0; FRAME_MAX];
        self.vehicle.hear(PEER, Sender::new(STATION).send(message, &mut buffer));
    }

    fn step(&mut self) {
        if self.now_ms.is_multiple_of(HEARTBEAT_MS) {
            self.say(&Uplink::Heartbeat);
        }
        self.now_ms += 1;
        let Station { vehicle, log, decoder, now_ms, answers, missions, texts, reached, complete, armed, .. } = self;
        let time_s = *now_ms as f64 * 1e-3;
        let bytes = vehicle.step(|text| log(&format!("{time_s:.3} {text}")));
        decoder.feed(&bytes, |_, message| match message {
            Downlink::Heartbeat { armed: is_armed, mode, .. } => {
                *armed = is_armed;
                let holds = is_armed && mode == custom(FlightMode::Hold);
                self.hold_ms = holds.then_some(self.hold_ms.unwrap_or(*now_ms));
            }
            Downlink::Answer { command, answer, .. } => answers.push((command, answer)),
            Downlink::Text { text, .. } => texts.push(text.to_str().unwrap_or_default().into()),
            Downlink::Mission { message: Mission::Reached(number), .. } => reached.push(number),
            Downlink::Mission { message: Mission::Current(current), .. } => *complete = current.state == COMPLETE,
            Downlink::Mission { message, .. } => missions.push(message),
            _ => (),
        });
        let plant = vehicle.world().plant();
        let was_on_ground = std::mem::replace(&mut self.on_ground, plant.telemetry().is_some_and(|it| it.on_ground));
        if self.on_ground && !was_on_ground {
            self.struck_m_s = self.struck_m_s.max(self.sinks_m_s);
        }
        self.sinks_m_s = -plant.motion().velocity_m_s.z;
    }
}
