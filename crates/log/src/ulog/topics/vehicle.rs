//! Topics of modes, arming and landing.

use crate::ulog::layout::message;
use crate::ulog::moment::Moment;
use afbc_flight_core::Mode;
use afbc_guidance::FlightMode;

/// PX4's arming states: disarmed, armed.
const STANDBY: u8 = 1;
const ARMED: u8 = 2;
/// PX4's vehicle type: rotary wing.
const ROTARY_WING: u8 = 1;
/// MAVLink component id: autopilot.
const AUTOPILOT: u8 = 1;

message! {
    /// Mode and arming.
    "vehicle_status" VehicleState {
        armed_time: u64 = "us; 0 while disarmed",
        takeoff_time: u64 = "us; 0 on the ground",
        arming_state: u8 = "1 disarmed, 2 armed",
        nav_state: u8 = "mode, as PX4 numbers it",
        vehicle_type: u8 = "1: rotary wing",
        failsafe: bool = "",
        system_type: u8 = "MAV_TYPE",
        system_id: u8 = "",
        component_id: u8 = "",
    }
}

impl VehicleState {
    /// Returns the message with the times of arming and of the last take-off \[us\].
    pub(crate) fn of(moment: &Moment<'_>, [armed_time, takeoff_time]: [u64; 2]) -> Self {
        let report = moment.report;
        VehicleState {
            timestamp: moment.now_us(),
            armed_time,
            takeoff_time,
            arming_state: if report.mode.armed() { ARMED } else { STANDBY },
            nav_state: nav_state(report.mode, report.guided.mode),
            vehicle_type: ROTARY_WING,
            failsafe: report.guided.failsafe.is_some() || report.mode == Mode::Descending,
            system_type: match moment.known.rotors {
                // MAV_TYPE has no number for five or seven rotors.
                6 => 13,
                8 => 14,
                _ => 2,
            },
            system_id: moment.known.system,
            component_id: AUTOPILOT,
        }
    }
}

/// Returns PX4's number of a mode.
fn nav_state(core: Mode, mode: FlightMode) -> u8 {
    match mode {
        _ if core == Mode::Descending => 12,
        FlightMode::Altitude => 1,
        FlightMode::Position => 2,
        FlightMode::Mission => 3,
        FlightMode::Hold => 4,
        FlightMode::Return => 5,
        FlightMode::Acro => 10,
        FlightMode::Offboard => 14,
        FlightMode::Stabilised => 15,
        FlightMode::Takeoff => 17,
        FlightMode::Land => 18,
    }
}

message! {
    /// Whether the motors may turn.
    "actuator_armed" ActuatorArmed of moment {
        armed: bool = "" => moment.report.mode.armed(),
        ready_to_arm: bool = "" => moment.report.against.is_empty(),
    }
}

message! {
    /// Whether the vehicle is on the ground.
    "vehicle_land_detected" LandDetected of moment {
        maybe_landed: bool = "" => !moment.report.guided.airborne,
        landed: bool = "" => !moment.report.guided.airborne,
    }
}
