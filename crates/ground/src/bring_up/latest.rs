//! Messages in which the vehicle reported its sensors and its clock.

use afbc_mavlink::telemetry::{ActuatorOutputs, BatteryStatus, GpsRawInt, SystemStatus, Version};
use afbc_mavlink::{Downlink, HealthArray, InertialSample, Telemetry};
use nalgebra::Vector3;

/// The newest message of each kind, and some counts.
#[derive(Debug, Default)]
pub(crate) struct LatestMessages {
    pub(crate) health: Option<HealthArray>,
    pub(crate) system: Option<SystemStatus>,
    pub(crate) fix: Option<GpsRawInt>,
    pub(crate) battery: Option<BatteryStatus>,
    pub(crate) version: Option<Version>,
    pub(crate) outputs: Option<ActuatorOutputs>,
    /// Roll, pitch, yaw \[rad\].
    pub(crate) attitude_rad: Option<Vector3<f32>>,
    pub(crate) attitudes: u32,
    /// Altitudes since the list was last cleared \[m\].
    pub(crate) altitudes_m: Vec<f32>,
    /// Inertial samples since the list was last cleared.
    pub(crate) samples: Vec<InertialSample>,
    /// Number of times that the vehicle's clock has jumped back, as after a restart.
    pub(crate) restarts: u32,
}

impl LatestMessages {
    /// Stores a message.
    pub(crate) fn take(&mut self, message: &Downlink) {
        match *message {
            Downlink::Health(health) => {
                let before_us = self.health.map_or(0, |health| health.time_us);
                self.restarts += u32::from(health.time_us < before_us);
                self.health = Some(health);
            }
            Downlink::Attitude { attitude_rad, .. } => {
                self.attitude_rad = Some(attitude_rad);
                self.attitudes += 1;
            }
            Downlink::Telemetry(telemetry) => match telemetry {
                Telemetry::System(status) => self.system = Some(status),
                Telemetry::GpsRawInt(fix) => self.fix = Some(fix),
                Telemetry::Battery(battery) => self.battery = Some(battery),
                Telemetry::Version(version) => self.version = Some(version),
                Telemetry::Outputs(outputs) => self.outputs = Some(outputs),
                Telemetry::VfrHud(summary) => self.altitudes_m.push(summary.altitude_m),
                _ => (),
            },
            _ => (),
        }
    }
}
