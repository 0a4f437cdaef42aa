//! Reading of commands.

use super::{
    ARM_DISARM, CALIBRATE, CHECK_ARMING, CUSTOM_MODE, CalibrationRequest, ENGAGE, FORCED, GET_INTERVAL, HOME, LAND,
    ORBIT, REBOOT, REPOSITION, REQUEST_CAPABILITIES, REQUEST_MESSAGE, REQUEST_PROTOCOL, RETURN, Reboot, SELECT_MODE,
    SELECT_STANDARD_MODE, SELF_TEST, SET_CURRENT, SET_INTERVAL, SPEED, START_LOG_STREAM, START_MISSION,
    STOP_LOG_STREAM, STORAGE, Storage, TAKE_OFF, VehicleCommand,
};
use crate::address::Address;
use crate::global_position::{Datum, GlobalPosition, Height, datum, e7};
use crate::message::{FrameFault, MessageFormat};
use crate::wire::{MessageLayout, Unused};
use mavlink::MessageData;
use mavlink::dialects::common::{COMMAND_INT_DATA, COMMAND_LONG_DATA, SET_HOME_POSITION_DATA, SET_MODE_DATA};

/// Fields: seven parameters, command, receiver, confirmation.
pub(super) const LONG: MessageLayout<COMMAND_LONG_DATA, ([f32; 7], u16, Address, u8)> = MessageLayout::NEW;
/// Fields: four parameters, x, y, z, command, receiver, frame, current, autocontinue.
pub(super) const INT: MessageLayout<COMMAND_INT_DATA, ([f32; 4], [i32; 2], f32, u16, Address, u8, [u8; 2])> =
    MessageLayout::NEW;
/// Fields: custom mode, system, base mode.
const MODE: MessageLayout<SET_MODE_DATA, (u32, u8, u8)> = MessageLayout::NEW;
/// Fields: latitude, longitude, altitude \[mm\]; attitude and approach; system, time.
const PLACE: MessageLayout<SET_HOME_POSITION_DATA, ([i32; 3], Unused<40>, u8, Unused<8>)> = MessageLayout::NEW;

/// Speed that stands for no limit \[m/s\].
const SPEED_MAX_M_S: f32 = 1e3;
/// Value of MAV_CMD_DO_CHANGE_SPEED that returns to the default speed.
const DEFAULT: f32 = -2.0;

pub(crate) fn format(id: u32) -> Option<MessageFormat> {
    Some(match id {
        COMMAND_LONG_DATA::ID => LONG.format(),
        COMMAND_INT_DATA::ID => INT.format(),
        SET_MODE_DATA::ID => MODE.format(),
        SET_HOME_POSITION_DATA::ID => PLACE.format(),
        _ => return None,
    })
}

/// Returns the command and its receiver. No command is dropped, since each must be answered.
pub(crate) fn read(id: u32, payload: &[u8]) -> Result<(VehicleCommand, Address), FrameFault> {
    match id {
        COMMAND_LONG_DATA::ID => {
            let (parameters, id, to, _) = LONG.read(payload);
            let [.., latitude, longitude, metres] = parameters;
            // COMMAND_LONG has no frame. Ground stations send heights above the sea, except for a take-off, whose
            // height is above the ground.
            let above = if id == TAKE_OFF { Datum::Here } else { Datum::Sea };
            let place = GlobalPosition {
                latitude_e7: e7(latitude),
                longitude_e7: e7(longitude),
                height: Height { metres, above },
            };
            Ok((command(id, parameters, Some(place)), to))
        }
        COMMAND_INT_DATA::ID => {
            let ([p1, p2, p3, p4], [latitude_e7, longitude_e7], metres, id, to, frame, _) = INT.read(payload);
            let number = |whole: i32| if whole == GlobalPosition::AS_IT_IS { f32::NAN } else { whole as f32 };
            let parameters = [p1, p2, p3, p4, number(latitude_e7), number(longitude_e7), metres];
            let place = datum(frame).map(|above| GlobalPosition {
                latitude_e7,
                longitude_e7,
                height: Height { metres, above },
            });
            Ok((command(id, parameters, place), to))
        }
        SET_MODE_DATA::ID => {
            let (mode, system, base) = MODE.read(payload);
            let is_custom = u32::from(base) & CUSTOM_MODE != 0 && mode & 0xFFFF == 0;
            let command =
                if is_custom { VehicleCommand::SelectMode(mode) } else { VehicleCommand::Denied(SELECT_MODE) };
            Ok((command, Address { system, component: 0 }))
        }
        SET_HOME_POSITION_DATA::ID => {
            let ([latitude_e7, longitude_e7, altitude_mm], _, system, _) = PLACE.read(payload);
            let height = Height { metres: altitude_mm as f32 * 1e-3, above: Datum::Sea };
            let command = command(HOME, [0.0; 7], Some(GlobalPosition { latitude_e7, longitude_e7, height }));
            Ok((command, Address { system, component: 0 }))
        }
        _ => Err(FrameFault::Unknown),
    }
}

fn command(id: u16, parameters: [f32; 7], place: Option<GlobalPosition>) -> VehicleCommand {
    let [p1, p2, ..] = parameters;
    // Ignores all other parameters: nothing may keep the motors running.
    if id == ARM_DISARM && p1 == 0.0 && p2 == FORCED {
        return VehicleCommand::Kill;
    }
    if !VehicleCommand::KNOWN.contains(&id) {
        return VehicleCommand::Other(id);
    }
    let used = used(id, p1);
    let unused = parameters.into_iter().enumerate().filter(|(place, _)| used >> place & 1 == 0);
    let command = if unused.map(|(_, value)| value).all(is_neutral) { known(id, parameters, place) } else { None };
    command.unwrap_or(VehicleCommand::Denied(id))
}

/// Returns the used parameters of a known command, as one bit each, lowest bit for the first. All others must be
/// neutral, so that no request of a ground station is silently ignored.
fn used(id: u16, first: f32) -> u8 {
    match id {
        RETURN | LAND | CHECK_ARMING | STOP_LOG_STREAM | ENGAGE | SELF_TEST => 0,
        SELECT_STANDARD_MODE | GET_INTERVAL | REQUEST_PROTOCOL | REQUEST_CAPABILITIES => 0b1,
        REBOOT | START_LOG_STREAM | ARM_DISARM => 0b1,
        START_MISSION | SET_CURRENT | STORAGE => 0b11,
        SELECT_MODE | SPEED => 0b111,
        SET_INTERVAL | REQUEST_MESSAGE => 0b100_0011,
        TAKE_OFF => 0b100_0001,
        // The first parameter selects the present position, or a given one.
        HOME if first == 1.0 => 0b1,
        HOME => 0b111_0001,
        REPOSITION => 0b111_1011,
        ORBIT | CALIBRATE => 0b111_1111,
        _ => 0,
    }
}

/// True for a value that requests nothing.
fn is_neutral(value: f32) -> bool {
    value == 0.0 || value.is_nan()
}

/// True for a value that requests nothing, including -1.
fn is_neutral_or_minus(value: f32) -> bool {
    is_neutral(value) || value == -1.0
}

/// Returns a known command with these parameters; the last three are also given as `place`. Returns none if a parameter
/// is invalid.
fn known(id: u16, parameters: [f32; 7], place: Option<GlobalPosition>) -> Option<VehicleCommand> {
    let [p1, p2, p3, p4, _, _, p7] = parameters;
    let plausible = place.filter(GlobalPosition::is_plausible);
    Some(match id {
        CALIBRATE => calibration(parameters),
        ARM_DISARM if p1 == 1.0 => VehicleCommand::Arm,
        ARM_DISARM if p1 == 0.0 => VehicleCommand::Disarm,
        ENGAGE => VehicleCommand::Engage,
        SELF_TEST => VehicleCommand::SelfTest,
        // -1 means no pitch.
        TAKE_OFF if is_neutral_or_minus(p1) => VehicleCommand::TakeOff(take_off(place?.height)?),
        LAND => VehicleCommand::Land,
        RETURN => VehicleCommand::Return,
        SELECT_MODE => {
            let (base, sub) = (whole(p1)?, whole(or_zero(p3))?);
            let mode = entire_mode(p2).filter(|_| sub == 0);
            let in_parts = || Some(whole(p2).filter(|main| *main <= 0xFF && sub <= 0xFF)? << 16 | sub << 24);
            VehicleCommand::SelectMode(mode.or_else(in_parts).filter(|_| base & CUSTOM_MODE != 0)?)
        }
        SELECT_STANDARD_MODE => VehicleCommand::SelectStandardMode(u8::try_from(whole(p1)?).ok()?),
        REPOSITION => {
            let is_usual = p1 < 0.0 || is_neutral(p1);
            let speed_m_s = if is_usual { None } else { Some(speed(p1)?) };
            // A heading relative to the present one is not supported.
            let changes_mode = if p2 == 1.0 { true } else { Some(false).filter(|_| is_neutral(p2))? };
            let yaw_rad = if p4.is_nan() { p4 } else { Some(-p4).filter(|yaw| yaw.abs() <= 1e3)? };
            VehicleCommand::Reposition { place: plausible?, yaw_rad, speed_m_s, changes_mode }
        }
        ORBIT => orbit([p1, p2, p3, p4], plausible?)?,
        // Parameter 1 may only be 0 (airspeed) or 1 (ground speed), since climb and descent have their own limits.
        // Parameter 2 of -2 returns to the default speed. Parameter 3 of -1 or -2 leaves the throttle unchanged.
        SPEED if (p1 == 0.0 || p1 == 1.0) && (is_neutral_or_minus(p3) || p3 == DEFAULT) => {
            VehicleCommand::Speed(if p2 == DEFAULT { SPEED_MAX_M_S } else { speed(p2)? })
        }
        HOME if p1 == 1.0 => VehicleCommand::Home(None),
        HOME if p1 == 0.0 => VehicleCommand::Home(Some(plausible.filter(is_whole)?)),
        START_MISSION => {
            let [first, last] = [number(or_zero(p1))?, number(or_zero(p2))?];
            let last = if last == 0 { None } else { Some(Some(last).filter(|last| *last >= first)?) };
            VehicleCommand::StartMission(first, last)
        }
        SET_CURRENT if p2 == 1.0 || is_neutral(p2) => {
            VehicleCommand::SetCurrent(if p1 == -1.0 { None } else { Some(number(p1)?) }, p2 == 1.0)
        }
        // p7, the receiver of the messages, is checked but not used: messages go to everyone, including the requester.
        SET_INTERVAL | REQUEST_MESSAGE if ![0.0, 1.0, 2.0].contains(&or_zero(p7)) => return None,
        SET_INTERVAL => VehicleCommand::SetInterval { message: whole(p1)?, interval_us: interval(or_zero(p2))? },
        GET_INTERVAL => VehicleCommand::GetInterval(whole(p1)?),
        REQUEST_MESSAGE => VehicleCommand::RequestMessage { message: whole(p1)?, index: whole(or_zero(p2))? },
        REQUEST_PROTOCOL if p1 == 1.0 => VehicleCommand::RequestProtocol,
        REQUEST_CAPABILITIES if p1 == 1.0 => VehicleCommand::RequestCapabilities,
        REBOOT if p1 == 1.0 => VehicleCommand::Reboot(Reboot::Program),
        REBOOT if p1 == 3.0 => VehicleCommand::Reboot(Reboot::BootLoader),
        // p2 concerns stored missions, which do not exist: -1 leaves them unchanged, 0 reads none.
        STORAGE if !is_neutral_or_minus(p2) => return None,
        STORAGE if p1 == 0.0 => VehicleCommand::Storage(Storage::Load),
        STORAGE if p1 == 1.0 => VehicleCommand::Storage(Storage::Save),
        STORAGE if p1 == 2.0 => VehicleCommand::Storage(Storage::Reset),
        CHECK_ARMING => VehicleCommand::CheckArming,
        START_LOG_STREAM if p1 == 0.0 => VehicleCommand::StartLogStream,
        STOP_LOG_STREAM => VehicleCommand::StopLogStream,
        _ => return None,
    })
}

/// Returns an orbit; none if a parameter is invalid. The yaw behaviour that needs radio control is refused.
fn orbit([radius, speed, heading, angle_rad]: [f32; 4], place: GlobalPosition) -> Option<VehicleCommand> {
    let within = |number: f32, most: f32| number.is_nan() || number.abs() <= most;
    // Backwards is the same as the other direction of rotation.
    let radius_m = if speed < 0.0 { -radius } else { radius };
    let angle_deg = or_zero(angle_rad).to_degrees();
    let heading = u8::try_from(whole(or_zero(heading))?).ok().filter(|heading| [0, 1, 2, 3, 5].contains(heading))?;
    let flown = within(radius, 1e5) && within(speed, 1e3) && (0.0..=65_535.0).contains(&angle_deg);
    let angle_deg = (angle_deg + 0.5) as u16;
    flown.then_some(VehicleCommand::Orbit { place, radius_m, speed_m_s: speed.abs(), angle_deg, heading })
}

/// Returns the requested calibration: exactly one parameter selects it, all others must be 0 or NaN.
fn calibration(parameters: [f32; 7]) -> VehicleCommand {
    let asked = match parameters.map(or_zero) {
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0] => CalibrationRequest::Gyroscope,
        [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0] => CalibrationRequest::Magnetometer,
        [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0] => CalibrationRequest::Accelerometer,
        [0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0] => CalibrationRequest::Level,
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0] => CalibrationRequest::Cancel,
        _ => return VehicleCommand::Denied(CALIBRATE),
    };
    VehicleCommand::Calibrate(asked)
}

fn or_zero(number: f32) -> f32 {
    if number.is_nan() { 0.0 } else { number }
}

/// Returns the number of a mission item.
fn number(number: f32) -> Option<u16> {
    u16::try_from(whole(number)?).ok()
}

/// Returns an integer up to 2^24.
fn whole(number: f32) -> Option<u32> {
    // Every integer up to 2^24 is exact in an f32.
    let whole = number as u32;
    ((0.0..=16_777_216.0).contains(&number) && whole as f32 == number).then_some(whole)
}

/// Returns a complete `custom_mode`, as MAVProxy and pymavlink send it for `mode NUMBER`. It is larger than any main
/// mode, since its lower half is 0.
fn entire_mode(number: f32) -> Option<u32> {
    let mode = number as u32;
    (mode as f32 == number && mode != 0 && mode & 0xFFFF == 0).then_some(mode)
}

/// Returns an interval \[us\]; negative values mean never.
fn interval(number: f32) -> Option<i32> {
    (number.abs() <= 2e9).then_some(if number < 0.0 { -1 } else { number as i32 })
}

fn speed(number: f32) -> Option<f32> {
    (0.0..=SPEED_MAX_M_S).contains(&number).then_some(number)
}

fn is_whole(place: &GlobalPosition) -> bool {
    let GlobalPosition { latitude_e7, longitude_e7, height } = *place;
    ![latitude_e7, longitude_e7].contains(&GlobalPosition::AS_IT_IS) && height.metres.is_finite()
}

/// Returns the height of a take-off; NaN for the height in the parameters.
fn take_off(height: Height) -> Option<Height> {
    let usual = height.metres.is_nan() || (height.metres == 0.0 && height.above == Datum::Here);
    let metres = if usual { f32::NAN } else { height.metres };
    (usual || metres.abs() <= 1e5).then_some(Height { metres, ..height })
}
