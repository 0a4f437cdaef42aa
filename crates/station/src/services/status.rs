//! What the services know of the vehicle.

use crate::services::origin::EarthOrigin;
use afbc_flight_core::supervisor::COAST_US;
use afbc_flight_core::{Mode, Reasons, TickHealth};
use afbc_guidance::{FlightMode, Guided};
use afbc_link::telemetry::BatteryStatus;
use afbc_onboard::{EscTelemetry, Report};
use afbc_radio::Channels;
use afbc_types::{ROTORS_MAX, State};

/// What the shell reports, since the control tick does not know it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AuxSensors {
    /// Where the local frame's origin is on the earth.
    pub origin: Option<EarthOrigin>,
    /// The satellite receiver's newest fix, if there is a receiver.
    pub receiver: Option<GnssReceiver>,
    /// The battery, if it is measured.
    pub battery: Option<BatteryStatus>,
    /// Further sensors: magnetometer, barometer and the like, as `MAV_SYS_STATUS_SENSOR`.
    pub sensors: SensorBits,
    /// Time since 1970 at power-up, 0 if unknown \[us\].
    pub powered_up_us: u64,
}

/// A satellite receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GnssReceiver {
    /// `GPS_FIX_TYPE`: 1 no fix, 3 in three dimensions.
    pub kind: u8,
    /// Number of satellites; 255 if unknown.
    pub satellites: u8,
    /// Horizontal and vertical uncertainty; 0 if unknown \[mm\].
    pub sigma_mm: [u32; 2],
}

impl GnssReceiver {
    /// Without a fix.
    pub const NO_FIX: Self = GnssReceiver { kind: 1, satellites: 0, sigma_mm: [0; 2] };
    /// [`kind`](Self::kind) of a fix in three dimensions.
    pub const FIX_3D: u8 = 3;
}

/// Sets of sensors, as `MAV_SYS_STATUS_SENSOR`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SensorBits {
    /// What is there.
    pub present: u32,
    /// What of it is well.
    pub healthy: u32,
}

/// The vehicle after a tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct VehicleStatus {
    /// Start of the tick, since power-up \[us\].
    pub time_us: u64,
    /// Mode of the flight core.
    pub mode: Mode,
    /// What the guidance decided.
    pub guided: Guided,
    /// The newest state, its own or the link's.
    pub state: Option<State>,
    /// True if the vehicle has an inertial sensor.
    pub senses: bool,
    /// True if it serves files.
    pub has_files: bool,
    /// Health of the flight core.
    pub health: TickHealth,
    /// What spoke against arming in the tick; none before the first.
    pub against: Option<Reasons>,
    /// Throttles: 0, or 48 to 2047.
    pub throttles: [u16; ROTORS_MAX],
    /// Number of rotors.
    pub rotors: u8,
    /// Duration of the tick \[us\].
    pub tick_us: f32,
    /// Frames dropped since power-up.
    pub dropped_frames: u32,
    /// The pilot's channels, if one is heard.
    pub radio: Option<RadioStatus>,
    /// What the shell has reported.
    pub aux: AuxSensors,
    /// What the motor controllers have told.
    pub escs: EscTelemetry,
}

/// A pilot's channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RadioStatus {
    /// The channels.
    pub channels: Channels,
    /// How well the pilot is received, 0 to 254; 255 if unknown.
    pub rssi: u8,
}

impl VehicleStatus {
    /// Updates it by a tick's report, except for the state.
    pub(crate) fn update<const N: usize>(&mut self, report: &Report<N>, tick_us: f32) {
        self.time_us = report.time_us;
        (self.mode, self.guided, self.health) = (report.mode, report.guided, report.health);
        self.against = Some(report.against);
        self.senses = report.estimate.is_some();
        self.throttles.iter_mut().zip(report.throttles).for_each(|(to, from)| *to = from);
        (self.rotors, self.tick_us) = (N as u8, tick_us);
    }

    /// Returns the time since power-up \[ms\].
    pub fn time_ms(&self) -> u32 {
        (self.time_us / 1000) as u32
    }

    /// Returns the flight mode that is reported to stations: that of the guidance, which orders change as soon as the
    /// state is back, also while the flight core still descends.
    pub fn flight_mode(&self) -> FlightMode {
        if self.mode == Mode::Descending && !self.is_located() { FlightMode::Land } else { self.guided.mode }
    }

    /// True if the vehicle knows where it is.
    pub fn is_located(&self) -> bool {
        self.state.is_some() && self.health.state_age_us <= COAST_US
    }

    /// True in the air, as far as is known.
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
        assert_eq!(status.flight_mode(), FlightMode::Mission, "chosen since the state is back");
        for airborne in [true, false] {
            status.guided.airborne = airborne;
            assert_eq!(status.is_airborne(), airborne);
        }
    }
}
