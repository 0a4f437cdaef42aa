//! Writing of commands, addressed to everyone.

use super::read::{INT, LONG};
use super::{CalibrationRequest, FORCED, Reboot, Storage, USUAL, VehicleCommand};
use crate::address::Address;
use crate::global_position::{Datum, GlobalPosition, Height, frame};
use crate::message::PAYLOAD_MAX;

/// Writes COMMAND_LONG, or COMMAND_INT for a command with a place or a height above the sea or home.
pub(crate) fn write(command: VehicleCommand, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
    let nowhere = |height| GlobalPosition { latitude_e7: 0, longitude_e7: 0, height };
    let (first, place) = match command {
        VehicleCommand::Arm => ([1.0, 0.0, 0.0, 0.0], None),
        VehicleCommand::Kill => ([0.0, FORCED, 0.0, 0.0], None),
        VehicleCommand::Calibrate(asked) => {
            let (first, fifth) = match asked {
                CalibrationRequest::Gyroscope => ([1.0, 0.0], 0.0),
                CalibrationRequest::Magnetometer => ([0.0, 1.0], 0.0),
                CalibrationRequest::Accelerometer => ([0.0; 2], 1.0),
                CalibrationRequest::Level => ([0.0; 2], 2.0),
                CalibrationRequest::Cancel => ([0.0; 2], 0.0),
            };
            let [p1, p2] = first;
            let parameters = [p1, p2, 0.0, 0.0, fifth, 0.0, 0.0];
            return LONG.write(&(parameters, command.id(), Address::default(), 0), payload);
        }
        // Infinity is invalid for every parameter of every command.
        VehicleCommand::Denied(id) => return LONG.write(&([f32::INFINITY; 7], id, Address::default(), 0), payload),
        VehicleCommand::Disarm
        | VehicleCommand::CheckArming
        | VehicleCommand::Engage
        | VehicleCommand::SelfTest
        | VehicleCommand::Land
        | VehicleCommand::Return
        | VehicleCommand::StartLogStream
        | VehicleCommand::StopLogStream
        | VehicleCommand::Other(_) => ([0.0; 4], None),
        VehicleCommand::TakeOff(height) => ([0.0; 4], Some(nowhere(height))),
        VehicleCommand::SelectMode(mode) => {
            let [_, _, main, sub] = mode.to_le_bytes();
            ([1.0, f32::from(main), f32::from(sub), 0.0], None)
        }
        VehicleCommand::SelectStandardMode(mode) => ([f32::from(mode), 0.0, 0.0, 0.0], None),
        VehicleCommand::Reposition { place, yaw_rad, speed_m_s, changes_mode } => {
            ([speed_m_s.unwrap_or(USUAL), f32::from(u8::from(changes_mode)), 0.0, -yaw_rad], Some(place))
        }
        VehicleCommand::Orbit { place, radius_m, speed_m_s, angle_deg, heading } => {
            let angle_rad = f32::from(angle_deg).to_radians();
            ([radius_m, speed_m_s, f32::from(heading), angle_rad], Some(place))
        }
        VehicleCommand::Speed(speed_m_s) => ([1.0, speed_m_s, USUAL, 0.0], None),
        VehicleCommand::Home(place) => ([f32::from(u8::from(place.is_none())), 0.0, 0.0, 0.0], place),
        VehicleCommand::StartMission(first, last) => ([f32::from(first), last.map_or(0.0, f32::from), 0.0, 0.0], None),
        VehicleCommand::SetCurrent(number, resets) => {
            ([number.map_or(USUAL, f32::from), f32::from(u8::from(resets)), 0.0, 0.0], None)
        }
        VehicleCommand::SetInterval { message, interval_us } => ([message as f32, interval_us as f32, 0.0, 0.0], None),
        VehicleCommand::GetInterval(message) => ([message as f32, 0.0, 0.0, 0.0], None),
        VehicleCommand::RequestMessage { message, index } => ([message as f32, index as f32, 0.0, 0.0], None),
        VehicleCommand::RequestProtocol
        | VehicleCommand::RequestCapabilities
        | VehicleCommand::Reboot(Reboot::Program) => ([1.0, 0.0, 0.0, 0.0], None),
        VehicleCommand::Reboot(Reboot::BootLoader) => ([3.0, 0.0, 0.0, 0.0], None),
        VehicleCommand::Storage(storage) => {
            let action = match storage {
                Storage::Load => 0.0,
                Storage::Save => 1.0,
                Storage::Reset => 2.0,
            };
            ([action, 0.0, 0.0, 0.0], None)
        }
    };
    let to = Address::default();
    match place {
        Some(GlobalPosition { latitude_e7, longitude_e7, height: Height { metres, above } })
            if above != Datum::Here =>
        {
            INT.write(&(first, [latitude_e7, longitude_e7], metres, command.id(), to, frame(above), [0; 2]), payload)
        }
        _ => {
            let ([p1, p2, p3, p4], metres) = (first, place.map_or(0.0, |place| place.height.metres));
            LONG.write(&([p1, p2, p3, p4, 0.0, 0.0, metres], command.id(), to, 0), payload)
        }
    }
}
