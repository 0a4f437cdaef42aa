//! State of the vehicle that the services use.

use crate::services::origin::EarthOrigin;
use afbc_flight_core::supervisor::COAST_US;
use afbc_flight_core::{Mode, Reasons, TickHealth};
use afbc_guidance::{FlightMode, GuidanceOutputs};
use afbc_mavlink::telemetry::BatteryStatus;
use afbc_onboard::{EscTelemetry, Report};
use afbc_rc::Channels;
use afbc_types::{ROTORS_MAX, State};

/// Data from the shell that the control tick does not have.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AuxSensors {
    /// Global position of the local frame's origin.
    pub origin: Option<EarthOrigin>,
    /// Newest fix of the satellite receiver, if there is a receiver.
    pub receiver: Option<GnssReceiver>,
    /// State of the battery, if it is measured.
    pub battery: Option<BatteryStatus>,
    /// State of further sensors such as magnetometer and barometer.
    pub sensors: SensorBits,
    /// Unix time at power-up \[us\]; 0 if unknown.
    pub powered_up_us: u64,
}

/// Fix of a satellite receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GnssReceiver {
    /// `GPS_FIX_TYPE`: 1 for no fix, 3 for a fix in three dimensions.
    pub kind: u8,
    /// Number of satellites; 255 if unknown.
    pub satellites: u8,
    /// Horizontal and vertical uncertainty \[mm\]; 0 if unknown.
    pub sigma_mm: [u32; 2],
}

impl GnssReceiver {
    /// A receiver without a fix.
    pub const NO_FIX: Self = GnssReceiver { kind: 1, satellites: 0, sigma_mm: [0; 2] };
    /// [`kind`](Self::kind) of a fix in three dimensions.
    pub const FIX_3D: u8 = 3;
}

/// Sets of sensors, in bits of `MAV_SYS_STATUS_SENSOR`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SensorBits {
    /// Sensors that are present.
    pub present: u32,
    /// Present sensors that are healthy.
    pub healthy: u32,
}

/// State of the vehicle after a tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct VehicleStatus {
    /// Start of the tick, since power-up \[us\].
    pub time_us: u64,
    /// Mode of the flight core.
    pub mode: Mode,
    /// State of the guidance.
    pub guided: GuidanceOutputs,
    /// Newest state, from the vehicle's estimator or from the link.
    pub state: Option<State>,
    /// True if the vehicle has an IMU and estimates its state.
    pub senses: bool,
    /// True if the vehicle serves files.
    pub has_files: bool,
    /// Health of the flight core.
    pub health: TickHealth,
    /// Reasons against arming in this tick; none before the first tick.
    pub against: Option<Reasons>,
    /// Throttles in units of DSHOT: 0, or 48 to 2047.
    pub throttles: [u16; ROTORS_MAX],
    /// Number of rotors.
    pub rotors: u8,
    /// Duration of the tick \[us\].
    pub tick_us: f32,
    /// Number of frames dropped since power-up.
    pub dropped_frames: u32,
    /// Channels of the pilot, if they are received.
    pub radio: Option<RadioStatus>,
    /// Data from the shell.
    pub aux: AuxSensors,
    /// Telemetry of the motor controllers.
    pub escs: EscTelemetry,
}

/// Radio channels of a pilot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RadioStatus {
    /// Channels as received.
    pub channels: Channels,
    /// Quality of reception, 0 to 254; 255 if unknown.
    pub rssi: u8,
}

impl VehicleStatus {
    /// Updates everything but the state from a tick's report.
    pub(crate) fn update(&mut self, report: &Report, tick_us: f32) {
        self.time_us = report.time_us;
        (self.mode, self.guided, self.health) = (report.mode, report.guided, report.health);
        self.against = Some(report.against);
        self.senses = report.estimate.is_some();
        (self.throttles, self.rotors, self.tick_us) = (report.throttles, report.rotors, tick_us);
    }

    /// Returns the time since power-up \[ms\].
    pub fn time_ms(&self) -> u32 {
        (self.time_us / 1000) as u32
    }

    /// Returns the flight mode for stations: Land while the flight core descends without a state, else the guidance's
    /// mode. Orders change that mode as soon as the state is back, even during the descent.
    pub fn flight_mode(&self) -> FlightMode {
        if self.mode == Mode::Descending && !self.is_located() { FlightMode::Land } else { self.guided.mode }
    }

    /// Returns true if the vehicle's position is known.
    pub fn is_located(&self) -> bool {
        self.state.is_some() && self.health.state_age_us <= COAST_US
    }

    /// Returns true if the vehicle is in the air, as far as the guidance knows.
    pub fn is_airborne(&self) -> bool {
        self.guided.airborne
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_knows_where_it_is_while_the_state_is_fresh() {
        let mut status = VehicleStatus { time_us: 1_234_567, ..VehicleStatus::default() };
        assert_eq!((status.time_ms(), status.is_located()), (1_234, false));
        status.state = Some(State::default());
        for (age_us, located) in [(0, true), (COAST_US, true), (COAST_US + 1, false), (u32::MAX, false)] {
            status.health.state_age_us = age_us;
            assert_eq!(status.is_located(), located, "{age_us} us");
        }
    }

    #[test]
    fn a_descent_of_the_flight_core_reads_as_land() {
        let mut status = VehicleStatus::default();
        status.guided.mode = FlightMode::Mission;
        for mode in [Mode::Disarmed, Mode::Flying, Mode::Coasting, Mode::Descending] {
            status.mode = mode;
            let reported = if mode == Mode::Descending { FlightMode::Land } else { FlightMode::Mission };
            assert_eq!(status.flight_mode(), reported);
        }
        status.state = Some(State::default());
        assert_eq!(status.flight_mode(), FlightMode::Mission, "chosen since the state estimate is back");
        for airborne in [true, false] {
            status.guided.airborne = airborne;
            assert_eq!(status.is_airborne(), airborne);
        }
    }
}
