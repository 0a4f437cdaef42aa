//! Missions, fences and rally points: the messages of MAVLink's mission protocol, in both directions.

use crate::address::Address;
use crate::global_position::GlobalPosition;
use crate::message::{FrameFault, MessageFormat, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use mavlink::MessageData;
use mavlink::dialects::common::{
    MISSION_ACK_DATA, MISSION_CLEAR_ALL_DATA, MISSION_COUNT_DATA, MISSION_CURRENT_DATA, MISSION_ITEM_DATA,
    MISSION_ITEM_INT_DATA, MISSION_ITEM_REACHED_DATA, MISSION_REQUEST_DATA, MISSION_REQUEST_INT_DATA,
    MISSION_REQUEST_LIST_DATA, MISSION_REQUEST_PARTIAL_LIST_DATA, MISSION_SET_CURRENT_DATA,
    MISSION_WRITE_PARTIAL_LIST_DATA,
};

/// Kind of a list of items: `MAV_MISSION_TYPE`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct MissionType(pub u8);

impl MissionType {
    /// A mission.
    pub const MISSION: MissionType = MissionType(0);
    /// A geofence.
    pub const FENCE: MissionType = MissionType(1);
    /// Rally points.
    pub const RALLY: MissionType = MissionType(2);
    /// Mission, geofence and rally points together. Only a request to clear may use it.
    pub const ALL: MissionType = MissionType(255);
}

/// An item as sent: MISSION_ITEM_INT (73) without its receiver, or MISSION_ITEM (39) converted to the same units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MissionItem {
    /// Sequence number, from 0.
    pub number: u16,
    /// Command of the item, `MAV_CMD`.
    pub command: u16,
    /// `MAV_FRAME` of the position.
    pub frame: u8,
    /// True for the current item.
    pub is_current: bool,
    /// Autocontinue: true if the next item follows without a command.
    pub goes_on: bool,
    /// First four parameters of the command; NaN: not given.
    pub parameters: [f32; 4],
    /// Latitude \[1e-7 deg\], or x \[1e-4 m\] in a local frame.
    pub x: i32,
    /// Longitude \[1e-7 deg\], or y \[1e-4 m\] in a local frame.
    pub y: i32,
    /// Altitude, or z in a local frame \[m\].
    pub z: f32,
}

/// A message of the mission protocol.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MissionMessage {
    /// MISSION_COUNT (44): number of items that follow or can be requested.
    Count(u16, MissionType),
    /// MISSION_REQUEST_LIST (43): requests the number of items.
    List(MissionType),
    /// MISSION_REQUEST_INT (51), or the equivalent MISSION_REQUEST (40): requests an item.
    Request(u16, MissionType),
    /// MISSION_ITEM_INT (73), or the equivalent MISSION_ITEM (39).
    Item(MissionItem, MissionType),
    /// MISSION_REQUEST_PARTIAL_LIST (37) or MISSION_WRITE_PARTIAL_LIST (38): a range of items.
    PartialList(MissionRange, MissionType),
    /// MISSION_ACK (47) with a `MAV_MISSION_RESULT`.
    Ack(MissionResult, MissionType),
    /// MISSION_CLEAR_ALL (45).
    Clear(MissionType),
    /// MISSION_SET_CURRENT (41).
    SetCurrent(u16),
    /// MISSION_CURRENT (42), to everyone.
    Current(MissionCurrent),
    /// MISSION_ITEM_REACHED (46), to everyone.
    Reached(u16),
}

/// A range of a list of items.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MissionRange {
    /// True to write the range, false to read it.
    pub writes: bool,
    /// Numbers of the first and the last item.
    pub numbers: [i16; 2],
}

/// Content of MISSION_CURRENT.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MissionCurrent {
    /// Number of the current item.
    pub number: u16,
    /// Number of items.
    pub total: u16,
    /// `MISSION_STATE`: 1 no mission, 2 not started, 3 active, 4 paused, 5 complete.
    pub state: u8,
    /// `mission_mode`: 1 in mission mode, 2 suspended.
    pub mode: u8,
}

/// Outcome of an upload, a download or a deletion: `MAV_MISSION_RESULT`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MissionResult(pub u8);

impl MissionResult {
    /// Done.
    pub const ACCEPTED: Self = MissionResult(0);
    /// Generic error: mission commands are not accepted at present.
    pub const ERROR: Self = MissionResult(1);
    /// The frame of an item is not supported.
    pub const UNSUPPORTED_FRAME: Self = MissionResult(2);
    /// The command of an item, or the kind of list, is not supported.
    pub const UNSUPPORTED: Self = MissionResult(3);
    /// There is no room for this many items.
    pub const NO_SPACE: Self = MissionResult(4);
    /// The first parameter of an item is invalid; the next numbers stand for the other parameters.
    pub const INVALID_PARAM1: Self = MissionResult(6);
    /// The latitude of an item is invalid.
    pub const INVALID_X: Self = MissionResult(10);
    /// The longitude of an item is invalid.
    pub const INVALID_Y: Self = MissionResult(11);
    /// The altitude of an item is invalid.
    pub const INVALID_Z: Self = MissionResult(12);
    /// The item was not the requested one.
    pub const INVALID_SEQUENCE: Self = MissionResult(13);
    /// Refused, since another station is in control or is uploading.
    pub const DENIED: Self = MissionResult(14);
    /// The transfer was cancelled.
    pub const CANCELLED: Self = MissionResult(15);
}

type ToAddress<D, W> = MessageLayout<D, (W, Address, u8)>;

// Some messages end with ids of the plan, which are not used.
const COUNT: MessageLayout<MISSION_COUNT_DATA, (u16, Address, u8, u32)> = MessageLayout::NEW;
const READ_PART: ToAddress<MISSION_REQUEST_PARTIAL_LIST_DATA, [i16; 2]> = MessageLayout::NEW;
const WRITE_PART: ToAddress<MISSION_WRITE_PARTIAL_LIST_DATA, [i16; 2]> = MessageLayout::NEW;
const LIST: MessageLayout<MISSION_REQUEST_LIST_DATA, (Address, u8)> = MessageLayout::NEW;
const REQUEST_INT: ToAddress<MISSION_REQUEST_INT_DATA, u16> = MessageLayout::NEW;
const REQUEST: ToAddress<MISSION_REQUEST_DATA, u16> = MessageLayout::NEW;
const ACK: MessageLayout<MISSION_ACK_DATA, (Address, u8, u8, u32)> = MessageLayout::NEW;
const CLEAR: MessageLayout<MISSION_CLEAR_ALL_DATA, (Address, u8)> = MessageLayout::NEW;
const SET_CURRENT: MessageLayout<MISSION_SET_CURRENT_DATA, (u16, Address)> = MessageLayout::NEW;
const CURRENT: MessageLayout<MISSION_CURRENT_DATA, (u16, u16, u8, u8, [u32; 3])> = MessageLayout::NEW;
const REACHED: MessageLayout<MISSION_ITEM_REACHED_DATA, (u16,)> = MessageLayout::NEW;
/// Fields: parameters, x, y, z; number, command, receiver; frame, current, autocontinue, kind of list.
const ITEM: MessageLayout<MISSION_ITEM_INT_DATA, ([f32; 4], [i32; 2], f32, u16, u16, Address, [u8; 3], u8)> =
    MessageLayout::NEW;
/// The fields of [`ITEM`], with x and y as floats.
const FLOAT_ITEM: MessageLayout<MISSION_ITEM_DATA, ([f32; 4], [f32; 2], f32, u16, u16, Address, [u8; 3], u8)> =
    MessageLayout::NEW;

impl MissionMessage {
    pub(crate) fn format(id: u32) -> Option<MessageFormat> {
        Some(match id {
            MISSION_COUNT_DATA::ID => COUNT.format(),
            MISSION_REQUEST_LIST_DATA::ID => LIST.format(),
            MISSION_REQUEST_INT_DATA::ID => REQUEST_INT.format(),
            MISSION_REQUEST_DATA::ID => REQUEST.format(),
            MISSION_ITEM_INT_DATA::ID => ITEM.format(),
            MISSION_ITEM_DATA::ID => FLOAT_ITEM.format(),
            MISSION_REQUEST_PARTIAL_LIST_DATA::ID => READ_PART.format(),
            MISSION_WRITE_PARTIAL_LIST_DATA::ID => WRITE_PART.format(),
            MISSION_ACK_DATA::ID => ACK.format(),
            MISSION_CLEAR_ALL_DATA::ID => CLEAR.format(),
            MISSION_SET_CURRENT_DATA::ID => SET_CURRENT.format(),
            MISSION_CURRENT_DATA::ID => CURRENT.format(),
            MISSION_ITEM_REACHED_DATA::ID => REACHED.format(),
            _ => return None,
        })
    }

    /// Returns the message and its receiver.
    pub(crate) fn read(id: u32, payload: &[u8]) -> Result<(Self, Address), FrameFault> {
        Ok(match id {
            MISSION_COUNT_DATA::ID => {
                let (count, to, plan, _) = COUNT.read(payload);
                (MissionMessage::Count(count, MissionType(plan)), to)
            }
            MISSION_REQUEST_LIST_DATA::ID => {
                let (to, plan) = LIST.read(payload);
                (MissionMessage::List(MissionType(plan)), to)
            }
            // MISSION_REQUEST has the same fields and is answered the same, by MISSION_ITEM_INT.
            MISSION_REQUEST_INT_DATA::ID | MISSION_REQUEST_DATA::ID => {
                let (number, to, plan) = REQUEST_INT.read(payload);
                (MissionMessage::Request(number, MissionType(plan)), to)
            }
            MISSION_ITEM_INT_DATA::ID => {
                let (parameters, [x, y], z, number, command, to, [frame, current, goes_on], plan) = ITEM.read(payload);
                let (is_current, goes_on) = (current != 0, goes_on != 0);
                let item = MissionItem { number, command, frame, is_current, goes_on, parameters, x, y, z };
                (MissionMessage::Item(item, MissionType(plan)), to)
            }
            MISSION_ITEM_DATA::ID => {
                let (parameters, place, z, number, command, to, [frame, current, goes_on], plan) =
                    FLOAT_ITEM.read(payload);
                let (is_current, goes_on) = (current != 0, goes_on != 0);
                let [x, y] = place.map(|number| in_units(number, frame));
                let item = MissionItem { number, command, frame, is_current, goes_on, parameters, x, y, z };
                (MissionMessage::Item(item, MissionType(plan)), to)
            }
            MISSION_REQUEST_PARTIAL_LIST_DATA::ID => {
                let (numbers, to, plan) = READ_PART.read(payload);
                (MissionMessage::PartialList(MissionRange { writes: false, numbers }, MissionType(plan)), to)
            }
            MISSION_WRITE_PARTIAL_LIST_DATA::ID => {
                let (numbers, to, plan) = WRITE_PART.read(payload);
                (MissionMessage::PartialList(MissionRange { writes: true, numbers }, MissionType(plan)), to)
            }
            MISSION_ACK_DATA::ID => {
                let (to, result, plan, _) = ACK.read(payload);
                (MissionMessage::Ack(MissionResult(result), MissionType(plan)), to)
            }
            MISSION_CLEAR_ALL_DATA::ID => {
                let (to, plan) = CLEAR.read(payload);
                (MissionMessage::Clear(MissionType(plan)), to)
            }
            MISSION_SET_CURRENT_DATA::ID => {
                let (number, to) = SET_CURRENT.read(payload);
                (MissionMessage::SetCurrent(number), to)
            }
            MISSION_CURRENT_DATA::ID => {
                let (number, total, state, mode, _) = CURRENT.read(payload);
                (MissionMessage::Current(MissionCurrent { number, total, state, mode }), Address::default())
            }
            MISSION_ITEM_REACHED_DATA::ID => (MissionMessage::Reached(REACHED.read(payload).0), Address::default()),
            _ => return Err(FrameFault::Unknown),
        })
    }

    /// Writes the message to the receiver `to`, if the message names one.
    pub(crate) fn write(&self, to: Address, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        match *self {
            MissionMessage::Count(count, plan) => COUNT.write(&(count, to, plan.0, 0), payload),
            MissionMessage::List(plan) => LIST.write(&(to, plan.0), payload),
            MissionMessage::Request(number, plan) => REQUEST_INT.write(&(number, to, plan.0), payload),
            MissionMessage::Item(item, plan) => {
                let MissionItem { number, command, frame, is_current, goes_on, parameters, x, y, z } = item;
                let flags = [frame, u8::from(is_current), u8::from(goes_on)];
                ITEM.write(&(parameters, [x, y], z, number, command, to, flags, plan.0), payload)
            }
            MissionMessage::PartialList(MissionRange { writes: true, numbers }, plan) => {
                WRITE_PART.write(&(numbers, to, plan.0), payload)
            }
            MissionMessage::PartialList(MissionRange { numbers, .. }, plan) => {
                READ_PART.write(&(numbers, to, plan.0), payload)
            }
            MissionMessage::Ack(result, plan) => ACK.write(&(to, result.0, plan.0, 0), payload),
            MissionMessage::Clear(plan) => CLEAR.write(&(to, plan.0), payload),
            MissionMessage::SetCurrent(number) => SET_CURRENT.write(&(number, to), payload),
            MissionMessage::Current(MissionCurrent { number, total, state, mode }) => {
                CURRENT.write(&(number, total, state, mode, [0; 3]), payload)
            }
            MissionMessage::Reached(number) => REACHED.write(&(number,), payload),
        }
    }
}

/// Converts degrees, or metres in a local frame, to the units of MISSION_ITEM_INT.
fn in_units(number: f32, frame: u8) -> i32 {
    let units = if LOCAL_FRAMES.contains(&frame) { 1e4 } else { 1e7 };
    // The number is not given, which is not the same as 0.
    if number.is_nan() {
        return GlobalPosition::AS_IT_IS;
    }
    // The limits are beyond any position, but below the value for "not given".
    let scaled = (f64::from(number) * units).clamp(-2e9, 2e9);
    (scaled + if scaled < 0.0 { -0.5 } else { 0.5 }) as i32
}

/// Local frames: MAV_FRAME_LOCAL_NED, LOCAL_ENU, LOCAL_OFFSET_NED, BODY_NED, BODY_OFFSET_NED, BODY_FRD, LOCAL_FRD,
/// LOCAL_FLU.
const LOCAL_FRAMES: [u8; 8] = [1, 4, 7, 8, 9, 12, 20, 21];
