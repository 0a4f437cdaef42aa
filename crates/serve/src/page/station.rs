//! The web page's ground station: sends commands to the vehicle as MAVLink messages, and handles the answers.

use crate::Server;
use afbc_ground::{Client, RetryPolicy, UploadEnd};
use afbc_mavlink::{
    Address, CommandResult, Downlink, ExternalTarget, MavCmd, MavSeverity, MissionItem, MissionType, PositionTarget,
    Uplink, VehicleCommand,
};
use nalgebra::Vector3;

/// Address of the station: a ground station's system id, with a component id of its own.
const ADDRESS: Address = Address { system: 255, component: 191 };
/// Peer number of the station; ports count up from 1.
const PEER: u32 = u32::MAX;
/// Index of the vehicle that the station talks to: the first.
const VEHICLE: usize = 0;
/// Heartbeat period, interval of targets, and longest wait for arming \[ms\].
const HEARTBEAT_MS: u64 = 1_000;
const TARGET_MS: u64 = 50;
const PATIENCE_MS: u64 = 3_000;
/// Messages that the station decodes: COMMAND_ACK, STATUSTEXT, MISSION_REQUEST, MISSION_REQUEST_INT, MISSION_ACK,
/// PARAM_VALUE, PARAM_ERROR.
const HEARD: [u32; 7] = [77, 253, 40, 51, 47, 22, 345];
/// Severities of texts about a refusal, and about progress.
const REFUSED: MavSeverity = MavSeverity::MAV_SEVERITY_ERROR;
const INFO: MavSeverity = MavSeverity::MAV_SEVERITY_INFO;
/// Names of commands by their number.
const NAMES: [(u16, &str); 8] = [
    (MavCmd::MAV_CMD_COMPONENT_ARM_DISARM as u16, "arm or disarm"),
    (MavCmd::MAV_CMD_NAV_TAKEOFF as u16, "take off"),
    (MavCmd::MAV_CMD_NAV_LAND as u16, "land"),
    (MavCmd::MAV_CMD_NAV_RETURN_TO_LAUNCH as u16, "return"),
    (MavCmd::MAV_CMD_DO_SET_MODE as u16, "mode"),
    (MavCmd::MAV_CMD_DO_REPOSITION as u16, "go to"),
    (MavCmd::MAV_CMD_MISSION_START as u16, "start mission"),
    (VehicleCommand::Engage.id(), "engage"),
];

/// The ground station of the web page.
pub(crate) struct PageStation {
    client: Client,
    now_ms: u64,
    /// Command to give once the vehicle is armed, and the time at which to give up \[ms\].
    once_armed: Option<(VehicleCommand, u64)>,
    /// Target for a vehicle that does not know its place on the earth, local frame \[m\].
    target_m: Option<Vector3<f32>>,
    heard: Vec<Downlink>,
    parameter_changes: u32,
}

impl PageStation {
    pub(crate) fn new() -> Self {
        PageStation {
            client: Client::new(ADDRESS),
            now_ms: 0,
            once_armed: None,
            target_m: None,
            heard: Vec::new(),
            parameter_changes: 0,
        }
    }

    /// Returns the number of parameter changes so far.
    pub(crate) fn parameter_changes(&self) -> u32 {
        self.parameter_changes
    }

    /// Sends all queued messages. Once the station has sent anything, it keeps sending heartbeats.
    fn send(&mut self, server: &mut Server) {
        let mut speaks = false;
        self.client.send(|_, frame| {
            speaks = true;
            server.hear(VEHICLE, PEER, frame);
        });
        if speaks {
            self.client.set_heartbeat_period(Some(HEARTBEAT_MS));
        }
    }

    /// Sends a command.
    pub(crate) fn command(&mut self, server: &mut Server, command: VehicleCommand) {
        // A new command cancels whatever was to follow the last command.
        (self.once_armed, self.target_m) = (None, None);
        self.client.command(command, RetryPolicy::ONCE);
        self.send(server);
    }

    /// Arms the vehicle if it is not armed, then sends a command.
    pub(crate) fn command_armed(&mut self, server: &mut Server, command: VehicleCommand) {
        let armed = server.vehicles().get(VEHICLE).and_then(|it| it.report()).is_some_and(|it| it.mode.armed());
        self.command(server, if armed { command } else { VehicleCommand::Arm });
        self.once_armed = (!armed).then_some((command, self.now_ms + PATIENCE_MS));
    }

    /// Leads the vehicle to a place of its local frame \[m\] in offboard mode.
    pub(crate) fn fly_to(&mut self, server: &mut Server, place_m: Vector3<f32>, offboard: VehicleCommand) {
        self.target_m = Some(place_m);
        // Send the target first: the vehicle refuses offboard mode without a fresh target.
        self.say_target();
        self.client.command(offboard, RetryPolicy::ONCE);
        self.send(server);
    }

    fn say_target(&mut self) {
        if let Some(position_m) = self.target_m {
            let target = PositionTarget { position_m, ..PositionTarget::NONE };
            self.client.say(Uplink::Target(ExternalTarget::Motion(target)));
        }
    }

    /// Sets a parameter.
    pub(crate) fn set(&mut self, server: &mut Server, name: &str, value: f32) {
        self.client.set_parameter(name, value);
        self.send(server);
    }

    /// Uploads plans, in this order.
    pub(crate) fn upload(
        &mut self,
        server: &mut Server,
        plans: impl IntoIterator<Item = (MissionType, Vec<MissionItem>)>,
    ) {
        self.client.upload(plans, RetryPolicy::ONCE);
        self.send(server);
    }

    /// Takes the bytes that the vehicle sent in a step.
    pub(crate) fn hear(&mut self, vehicle: usize, bytes: &[u8]) {
        if vehicle == VEHICLE {
            let PageStation { client, heard, .. } = self;
            // Telemetry is not decoded: the page shows the simulated vehicle directly.
            client.hear_accepted(bytes, |frame| HEARD.contains(&frame.id), |_, message| heard.push(*message));
        }
    }

    /// Handles the received messages after a step, and passes texts for the page to `say`.
    pub(crate) fn update(&mut self, server: &mut Server, say: &mut dyn FnMut(MavSeverity, String)) {
        let now_ms = (server.now_s() * 1e3).round() as u64;
        // Time does not advance during a pause.
        let goes_on = now_ms != self.now_ms;
        self.now_ms = now_ms;
        self.send(server);
        // The loop below shows the texts in the order of all messages, so drop this copy.
        drop(self.client.take_texts());
        for message in std::mem::take(&mut self.heard) {
            match message {
                Downlink::Text { severity, text } => say(severity, text.to_str().unwrap_or_default().into()),
                Downlink::CommandAck { command, answer, .. } if answer != CommandResult::Accepted => {
                    let known = NAMES.iter().find(|(number, _)| *number == command);
                    let name = known.map_or_else(|| format!("command {command}"), |(_, name)| (*name).into());
                    let severity = if answer == CommandResult::InProgress { INFO } else { REFUSED };
                    say(severity, format!("{name}: {}", in_words(answer)));
                }
                Downlink::Parameter(_) => self.parameter_changes = self.parameter_changes.wrapping_add(1),
                Downlink::ParameterError { .. } => say(REFUSED, "parameter: refused".into()),
                _ => (),
            }
        }
        match self.client.take_upload_end() {
            Some(UploadEnd::Refused(_, result)) => say(REFUSED, format!("plan: refused, result {}", result.0)),
            Some(UploadEnd::Silent(_)) => say(REFUSED, "plan: the vehicle does not answer".into()),
            Some(UploadEnd::Accepted) | None => (),
        }
        if let Some((command, given_up_ms)) = self.once_armed {
            let armed = server.vehicles().get(VEHICLE).and_then(|it| it.report()).is_some_and(|it| it.mode.armed());
            if armed {
                self.command(server, command);
            } else if self.now_ms >= given_up_ms {
                self.once_armed = None;
            }
        }
        if goes_on && self.now_ms.is_multiple_of(TARGET_MS) {
            self.say_target();
        }
        self.client.update(self.now_ms);
        self.send(server);
    }
}

fn in_words(answer: CommandResult) -> &'static str {
    match answer {
        CommandResult::Accepted => "done",
        CommandResult::Denied => "a number is out of range",
        CommandResult::Unsupported => "not supported",
        CommandResult::Failed => "failed",
        CommandResult::InProgress => "in progress",
        _ => "refused",
    }
}
