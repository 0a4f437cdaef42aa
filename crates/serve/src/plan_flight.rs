//! Flies a plan with a served vehicle in lockstep: uploads, starts and watches it by MAVLink, as a ground station does.

use crate::plan_file::QgcPlan;
use crate::vehicle::ServedVehicle;
use afbc_comms::services::modes::custom;
use afbc_ground::{Client, CommandState, RetryPolicy, UploadEnd};
use afbc_guidance::FlightMode;
use afbc_mavlink::{CommandResult, Downlink, MissionItem, MissionMessage, MissionType, VehicleCommand};

/// Peer number of the station.
const PEER: u32 = 0;
/// Longest wait until the vehicle is ready to arm, and wait for the text that explains a refusal \[ms\].
const READY_MS: u64 = 60_000;
const TEXT_MS: u64 = 100;
/// Heartbeat period, and time between two arming checks \[ms\].
const HEARTBEAT_MS: u64 = 1_000;
/// Time in hold after which an incomplete mission counts as stopped \[ms\]. MISSION_CURRENT comes every second.
const STOPPED_MS: u64 = 2_500;
/// Longest fall of a vehicle whose motors have stopped in the air \[ms\].
const FALL_MS: u64 = 60_000;
/// Touchdown speed above which the vehicle counts as fallen, twice the fastest descent \[m/s\], and tilt above which it
/// counts as lying on the ground \[rad\].
const FALLS_M_S: f64 = 3.0;
const LIES_RAD: f64 = 1.0;
/// `MISSION_STATE` value for a completed mission.
const COMPLETE: u8 = 5;

/// Result of a flown plan.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanEnd {
    /// Numbers of the items that were reached.
    pub reached: Vec<u16>,
    /// True if the mission was completed.
    pub complete: bool,
    /// True if the vehicle left the mission for hold before it was complete.
    pub stopped: bool,
    /// True if the motors have stopped.
    pub disarmed: bool,
    /// True if the vehicle hit the ground faster than it lands, or lies on the ground.
    pub fell: bool,
    /// Duration of the flight \[s\].
    pub flight_s: f64,
}

/// A ground station, and what it has observed.
struct PlanStation<'a> {
    vehicle: &'a mut ServedVehicle,
    log: &'a mut dyn FnMut(&str),
    client: Client,
    now_ms: u64,
    reached: Vec<u16>,
    complete: bool,
    /// Start of the current time in hold \[ms\]; `None` in other modes.
    hold_ms: Option<u64>,
    /// Sink rate in the last step, and largest sink rate at a touchdown \[m/s\].
    sinks_m_s: f64,
    struck_m_s: f64,
    on_ground: bool,
}

/// Flies `plan` with a vehicle that stands at its start, for at most `limit_s`. Passes lines about the progress to
/// `log`.
///
/// # Errors
/// Fails with one line if the vehicle refuses the plan or a command.
pub fn fly_plan(
    vehicle: &mut ServedVehicle,
    plan: &QgcPlan,
    limit_s: f64,
    log: &mut dyn FnMut(&str),
) -> Result<PlanEnd, String> {
    let mut client = Client::new(Client::STATION);
    client.set_heartbeat_period(Some(HEARTBEAT_MS));
    let mut station = PlanStation {
        vehicle,
        log,
        client,
        now_ms: 0,
        reached: Vec::new(),
        complete: false,
        hold_ms: None,
        sinks_m_s: 0.0,
        struck_m_s: 0.0,
        on_ground: true,
    };
    station.fly(plan, limit_s)
}

impl PlanStation<'_> {
    fn fly(&mut self, plan: &QgcPlan, limit_s: f64) -> Result<PlanEnd, String> {
        if plan.mission.is_empty() {
            return Err("the mission has no items; add some".into());
        }
        self.get_ready()?;
        // The fence comes first: the vehicle checks the mission against it.
        self.upload(&plan.fence, MissionType::FENCE, "geoFence")?;
        self.upload(&plan.rally, MissionType::RALLY, "rallyPoints")?;
        self.upload(&plan.mission, MissionType::MISSION, "mission")?;
        self.order(VehicleCommand::Arm)?;
        let begun_ms = self.now_ms;
        self.order(VehicleCommand::StartMission(0, None))?;
        let limit_ms = begun_ms + (limit_s * 1e3) as u64;
        while self.now_ms < limit_ms && self.armed() && !self.complete && !self.is_stopped() {
            self.step();
        }
        let flight_s = (self.now_ms - begun_ms) as f64 * 1e-3;
        // If the motors stopped in the air, wait for the impact.
        let fallen_ms = self.now_ms + FALL_MS;
        while !self.armed() && !self.on_ground && self.now_ms < fallen_ms {
            self.step();
        }
        let [roll, pitch, _] = self.vehicle.world().plant().motion().attitude_rad.into();
        let lies = self.on_ground && f64::max(roll.abs(), pitch.abs()) > LIES_RAD;
        Ok(PlanEnd {
            reached: std::mem::take(&mut self.reached),
            complete: self.complete,
            stopped: self.is_stopped() && !self.complete && self.armed(),
            disarmed: !self.armed(),
            fell: lies || self.struck_m_s > FALLS_M_S,
            flight_s,
        })
    }

    fn armed(&self) -> bool {
        self.client.vehicle().armed
    }

    /// Returns true if the vehicle has changed from the mission to hold without completing it.
    fn is_stopped(&self) -> bool {
        self.hold_ms.is_some_and(|hold_ms| self.now_ms - hold_ms > STOPPED_MS)
    }

    /// Returns the texts since the last call.
    fn take_texts(&mut self) -> Vec<String> {
        self.client.take_texts().into_iter().map(|text| text.text).collect()
    }

    /// Waits until the vehicle is ready to arm.
    fn get_ready(&mut self) -> Result<(), String> {
        let mut texts = Vec::new();
        while self.now_ms < READY_MS {
            self.client.command(VehicleCommand::CheckArming, RetryPolicy::ONCE);
            self.wait(HEARTBEAT_MS);
            texts = self.take_texts();
            if texts.iter().any(|text| text == "ready to arm") {
                return Ok(());
            }
        }
        Err(format!("the vehicle did not become ready to arm: {}", texts.join(", ")))
    }

    fn upload(&mut self, items: &[MissionItem], plan: MissionType, part: &str) -> Result<(), String> {
        self.take_texts();
        self.client.upload([(plan, items.to_vec())], RetryPolicy::ONCE);
        loop {
            self.step();
            match self.client.take_upload_end() {
                None => (),
                Some(UploadEnd::Accepted) => return Ok(()),
                Some(UploadEnd::Refused(_, result)) => {
                    self.wait(TEXT_MS);
                    let why = self.take_texts().pop().unwrap_or_else(|| format!("result {}", result.0));
                    return Err(format!("{part}: the vehicle refuses this part: {why}; change it in QGroundControl"));
                }
                Some(UploadEnd::Silent(_)) => return Err(format!("{part}: the vehicle does not answer")),
            }
        }
    }

    fn order(&mut self, command: VehicleCommand) -> Result<(), String> {
        self.take_texts();
        self.client.command(command, RetryPolicy::ONCE);
        while self.client.state(command) == Some(CommandState::Waiting) {
            self.step();
        }
        match self.client.answer(command) {
            Some(CommandResult::Accepted) => {
                // Wait until the heartbeat shows the new state.
                self.wait(HEARTBEAT_MS);
                Ok(())
            }
            Some(answer) => {
                self.wait(TEXT_MS);
                let reasons: String = self.take_texts().iter().map(|text| format!(", {text}")).collect();
                Err(format!("the vehicle does not fly: {answer:?}{reasons}"))
            }
            None => Err("the vehicle does not answer".into()),
        }
    }

    fn wait(&mut self, milliseconds: u64) {
        (0..milliseconds).for_each(|_| self.step());
    }

    fn step(&mut self) {
        let PlanStation { vehicle, log, client, now_ms, reached, complete, .. } = self;
        client.update(*now_ms);
        client.send(|_, frame| {
            vehicle.hear(PEER, frame);
        });
        *now_ms += 1;
        let time_s = *now_ms as f64 * 1e-3;
        let bytes = vehicle.step(|text| log(&format!("{time_s:.3} {text}")));
        client.hear(&bytes, |_, message| match message {
            Downlink::Mission { message: MissionMessage::Reached(number), .. } => reached.push(*number),
            Downlink::Mission { message: MissionMessage::Current(current), .. } => {
                *complete = current.state == COMPLETE
            }
            _ => (),
        });
        let holds = client.vehicle().armed && client.vehicle().mode == custom(FlightMode::Hold);
        self.hold_ms = holds.then_some(self.hold_ms.unwrap_or(*now_ms));
        let plant = vehicle.world().plant();
        let was_on_ground = std::mem::replace(&mut self.on_ground, plant.telemetry().is_some_and(|it| it.on_ground));
        if self.on_ground && !was_on_ground {
            self.struck_m_s = self.struck_m_s.max(self.sinks_m_s);
        }
        self.sinks_m_s = -plant.motion().velocity_m_s.z;
    }
}
