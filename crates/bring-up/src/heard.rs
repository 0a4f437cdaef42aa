//! What the vehicle has said.

use afbc_link::telemetry::{ActuatorOutputs, BatteryStatus, Fix, SystemStatus, Version};
use afbc_link::{Address, Answer, Downlink, HealthArray, InertialSample, ParameterValue, Telemetry};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// `MAV_COMP_ID_AUTOPILOT1`.
const AUTOPILOT: u8 = 1;

/// The newest of each message, and what is counted.
#[derive(Debug, Default)]
pub(crate) struct Heard {
    /// Who it is, once there was a heartbeat, and whether it is armed.
    pub(crate) vehicle: Option<(Address, bool)>,
    pub(crate) heartbeats: u32,
    pub(crate) health: Option<HealthArray>,
    pub(crate) system: Option<SystemStatus>,
    pub(crate) fix: Option<Fix>,
    pub(crate) battery: Option<BatteryStatus>,
    pub(crate) version: Option<Version>,
    pub(crate) outputs: Option<ActuatorOutputs>,
    /// Roll, pitch, yaw \[rad\].
    pub(crate) attitude_rad: Option<Vector3<f32>>,
    pub(crate) attitudes: u32,
    /// Altitudes since they were last taken \[m\].
    pub(crate) altitudes_m: Vec<f32>,
    /// Texts, with the time at which they came \[ms\].
    pub(crate) texts: Vec<(u64, String)>,
    pub(crate) answers: BTreeMap<u16, Answer>,
    /// Name, value and type by place.
    pub(crate) parameters: BTreeMap<u16, (String, String)>,
    pub(crate) parameter_count: Option<u16>,
    /// Samples since they were last taken.
    pub(crate) samples: Vec<InertialSample>,
    /// How often its clock has run backward.
    pub(crate) restarts: u32,
}

impl Heard {
    /// Takes a message that came at `now_ms`.
    pub(crate) fn take(&mut self, from: Address, message: Downlink, now_ms: u64) {
        // Stations have heartbeats too, this side's own among them where a wire sends it back.
        if let Downlink::Heartbeat { armed, .. } = message
            && from.component == AUTOPILOT
        {
            let vehicle = self.vehicle.get_or_insert((from, armed));
            if vehicle.0 == from {
                vehicle.1 = armed;
                self.heartbeats += 1;
            }
        }
        if self.vehicle.is_some_and(|(vehicle, _)| vehicle != from) {
            return;
        }
        match message {
            Downlink::Health(health) => {
                let before_us = self.health.map_or(0, |health| health.time_us);
                self.restarts += u32::from(health.time_us < before_us);
                self.health = Some(health);
            }
            Downlink::Text { text, .. } => {
                self.texts.push((now_ms, text.to_str().unwrap_or("not readable").to_owned()));
            }
            Downlink::Answer { command, answer, .. } => drop(self.answers.insert(command, answer)),
            Downlink::Parameter(value) => self.parameter(&value),
            Downlink::Attitude { attitude_rad, .. } => {
                self.attitude_rad = Some(attitude_rad);
                self.attitudes += 1;
            }
            Downlink::Telemetry(telemetry) => match telemetry {
                Telemetry::System(status) => self.system = Some(status),
                Telemetry::Fix(fix) => self.fix = Some(fix),
                Telemetry::Battery(battery) => self.battery = Some(battery),
                Telemetry::Version(version) => self.version = Some(version),
                Telemetry::Outputs(outputs) => self.outputs = Some(outputs),
                Telemetry::Summary(summary) => self.altitudes_m.push(summary.altitude_m),
                _ => (),
            },
            _ => (),
        }
    }

    fn parameter(&mut self, value: &ParameterValue) {
        self.parameter_count = Some(value.count);
        let bytes: Vec<u8> = value.name.iter().copied().take_while(|&byte| byte != 0).collect();
        // MAV_PARAM_TYPE: 9 is a float, even numbers below it are signed.
        let number = match value.kind {
            9 => f32::from_le_bytes(value.value).to_string(),
            2 | 4 | 6 => i32::from_le_bytes(value.value).to_string(),
            _ => u32::from_le_bytes(value.value).to_string(),
        };
        if value.place < value.count {
            self.parameters.insert(value.place, (String::from_utf8_lossy(&bytes).into_owned(), number));
        }
    }

    /// True once every parameter has come.
    pub(crate) fn has_all_parameters(&self) -> bool {
        self.parameter_count.is_some_and(|count| self.parameters.len() == usize::from(count))
    }
}
