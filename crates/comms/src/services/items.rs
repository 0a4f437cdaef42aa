//! Checks mission items and converts them to the guidance's items.

use crate::services::origin::{EarthOrigin, LocalChart, resolve};
use crate::services::texts::Words;
use afbc_guidance::{Item, is_place};
use afbc_mavlink::{Datum, GlobalPosition, Height, MavCmd, MissionItem, MissionResult};
use nalgebra::{Vector2, Vector3};

/// Largest number of items of all plans together.
pub const ITEMS_MAX: usize = 64;

const WAYPOINT: u16 = MavCmd::MAV_CMD_NAV_WAYPOINT as u16;
const LOITER: u16 = MavCmd::MAV_CMD_NAV_LOITER_UNLIM as u16;
const LOITER_TURNS: u16 = MavCmd::MAV_CMD_NAV_LOITER_TURNS as u16;
const LOITER_TIME: u16 = MavCmd::MAV_CMD_NAV_LOITER_TIME as u16;
const RETURN: u16 = MavCmd::MAV_CMD_NAV_RETURN_TO_LAUNCH as u16;
const LAND: u16 = MavCmd::MAV_CMD_NAV_LAND as u16;
const TAKE_OFF: u16 = MavCmd::MAV_CMD_NAV_TAKEOFF as u16;
const LOITER_TO_ALTITUDE: u16 = MavCmd::MAV_CMD_NAV_LOITER_TO_ALT as u16;
const DELAY: u16 = MavCmd::MAV_CMD_NAV_DELAY as u16;
const YAW: u16 = MavCmd::MAV_CMD_CONDITION_YAW as u16;
pub(super) const JUMP: u16 = MavCmd::MAV_CMD_DO_JUMP as u16;
const SPEED: u16 = MavCmd::MAV_CMD_DO_CHANGE_SPEED as u16;
const LOOK: u16 = MavCmd::MAV_CMD_DO_SET_ROI_LOCATION as u16;
const LOOK_NOWHERE: u16 = MavCmd::MAV_CMD_DO_SET_ROI_NONE as u16;
#[allow(deprecated, reason = "ground stations still send it")]
const OLD_LOOK: u16 = MavCmd::MAV_CMD_DO_SET_ROI as u16;
const RALLY_POINT: u16 = MavCmd::MAV_CMD_NAV_RALLY_POINT as u16;

/// Commands that stations use in missions but that are refused, with their names for the texts.
const NAMES: [(u16, &str); 19] = [
    (82, "NAV_SPLINE_WAYPOINT"),
    (84, "NAV_VTOL_TAKEOFF"),
    (85, "NAV_VTOL_LAND"),
    (94, "NAV_PAYLOAD_PLACE"),
    (112, "CONDITION_DELAY"),
    (114, "CONDITION_DISTANCE"),
    (179, "DO_SET_HOME"),
    (181, "DO_SET_RELAY"),
    (183, "DO_SET_SERVO"),
    (189, "DO_LAND_START"),
    (203, "DO_DIGICAM_CONTROL"),
    (205, "DO_MOUNT_CONTROL"),
    (206, "DO_SET_CAM_TRIGG_DIST"),
    (211, "DO_GRIPPER"),
    (530, "SET_CAMERA_MODE"),
    (2000, "IMAGE_START_CAPTURE"),
    (2001, "IMAGE_STOP_CAPTURE"),
    (2500, "VIDEO_START_CAPTURE"),
    (2501, "VIDEO_STOP_CAPTURE"),
];
/// Ends of texts, after the name of a command and after the number of a parameter.
const UNSUPPORTED: &str = " unsupported";
const NOT_USED: &str = " must be 0";
/// Refusal of a place that is too far away.
pub(super) const FAR: Invalid = Invalid { result: MissionResult::INVALID_X, reason: "too far away" };
/// Most repetitions of a DO_JUMP.
const REPEATS_MAX: f32 = 1000.0;

/// Reason why an item is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Invalid {
    /// Result for MISSION_ACK.
    pub result: MissionResult,
    /// Reason in words. For an unsupported command: the end of the text, after its name.
    pub reason: &'static str,
}

impl Invalid {
    /// Refusal of an unsupported command.
    pub const COMMAND: Self = Invalid { result: MissionResult::UNSUPPORTED, reason: UNSUPPORTED };

    /// Returns the text about an item of a plan, given the item's number and command.
    pub(super) fn text(self, plan: &str, number: u16, command: u16) -> Words {
        let words = Words::of(plan).and(" item ").number(number.into()).and(": ");
        if self.reason == NOT_USED {
            let parameter = self.result.0.saturating_sub(MissionResult::INVALID_PARAM1.0) + 1;
            return words.and("parameter ").number(parameter.into()).and(self.reason);
        }
        if self != Invalid::COMMAND {
            return words.and(self.reason);
        }
        let words = match NAMES.iter().find(|(known, _)| *known == command) {
            Some((_, name)) => words.and(name),
            None => words.and("command ").number(command.into()),
        };
        words.and(self.reason)
    }
}

/// Checks a mission item.
///
/// # Errors
/// Returns the first fault of the item.
pub fn check(item: &MissionItem) -> Result<(), Invalid> {
    let refuse = |result, reason| Err(Invalid { result, reason });
    let used = used(item).ok_or(Invalid::COMMAND)?;
    check_unused(item, used)?;
    let within = |number: f32, max: f32| number.is_nan() || (0.0..=max).contains(&number);
    let [first, second, third, fourth] = item.parameters;
    match item.command {
        WAYPOINT | LOITER | LOITER_TURNS | LOITER_TIME | LAND | TAKE_OFF | LOITER_TO_ALTITUDE | LOOK => (),
        OLD_LOOK if first == 3.0 => (),
        OLD_LOOK if first == 0.0 => return Ok(()),
        OLD_LOOK => return refuse(MissionResult::INVALID_PARAM1, "ROI mode is not supported"),
        RETURN | LOOK_NOWHERE => return Ok(()),
        SPEED => {
            let speed_known = KEPT.contains(&second) || (second > 0.0 && second <= 1e3);
            return match item.parameters {
                [0.0 | 1.0, ..] if !speed_known => refuse(MissionResult(7), "speed is out of range"),
                [0.0 | 1.0, _, throttle, _] if !(is_neutral(throttle) || KEPT.contains(&throttle)) => {
                    refuse(MissionResult(8), "throttle is not supported")
                }
                [0.0 | 1.0, ..] => Ok(()),
                _ => refuse(MissionResult::INVALID_PARAM1, "kind of speed is not supported"),
            };
        }
        DELAY if (0.0..=86_400.0).contains(&first) => {
            let clock = [second, third, fourth].into_iter().any(|part| !(is_neutral(part) || part == -1.0));
            return if clock { refuse(MissionResult(7), "time of day is not supported") } else { Ok(()) };
        }
        DELAY if first < 0.0 => return refuse(MissionResult::INVALID_PARAM1, "time of day is not supported"),
        DELAY => return refuse(MissionResult::INVALID_PARAM1, "delay is out of range"),
        YAW => {
            return match item.parameters {
                // A NaN is not in the range either.
                [angle, ..] if !(-3600.0..=3600.0).contains(&angle) => {
                    refuse(MissionResult::INVALID_PARAM1, "angle is out of range")
                }
                [_, _, -1.0 | 0.0 | 1.0, 0.0 | 1.0] => Ok(()),
                [_, _, -1.0 | 0.0 | 1.0, _] => refuse(MissionResult(9), "choose absolute or relative angle"),
                _ => refuse(MissionResult(8), "direction must be -1, 0 or 1"),
            };
        }
        JUMP => {
            return if whole(first, f32::from(u8::MAX)).is_none() {
                refuse(MissionResult::INVALID_PARAM1, "the jump's target does not exist")
            } else if second != -1.0 && whole(second, REPEATS_MAX).is_none() {
                refuse(MissionResult(7), "repetitions must be -1 to 1000")
            } else {
                Ok(())
            };
        }
        // Unreachable: `used` has refused all other commands.
        _ => return Err(Invalid::COMMAND),
    }
    let Some(place) = place(item) else {
        return refuse(MissionResult::UNSUPPORTED_FRAME, "frame is not supported");
    };
    // A take-off or a landing may be at the vehicle's present place.
    if !is_here(item) {
        on_earth(&place)?;
    }
    // The height of a landing or of a region of interest is not used.
    let any_height = item.z.is_nan() && [LAND, LOOK, OLD_LOOK].contains(&item.command);
    if !any_height && !(-1e5..=1e5).contains(&item.z) {
        return refuse(MissionResult::INVALID_Z, "altitude is out of range");
    }
    if [WAYPOINT, LOITER_TIME].contains(&item.command) && !within(first, 3600.0) {
        return refuse(MissionResult::INVALID_PARAM1, "time to stay is out of range");
    }
    if item.command == WAYPOINT && !within(second, 1000.0) {
        return refuse(MissionResult(7), "radius is out of range");
    }
    if item.command == LOITER_TURNS {
        if !(0.0..=1000.0).contains(&first) {
            return refuse(MissionResult::INVALID_PARAM1, "number of turns is out of range");
        }
        if !(third.is_nan() || third == 0.0 || (1.0..=1000.0).contains(&third.abs())) {
            return refuse(MissionResult(8), "radius must be 1 to 1000 m");
        }
    }
    if [WAYPOINT, LOITER, LOITER_TIME].contains(&item.command) && !(fourth.is_nan() || fourth.abs() <= 3600.0) {
        return refuse(MissionResult(9), "heading is out of range");
    }
    Ok(())
}

/// Checks a rally point.
///
/// # Errors
/// Returns the first fault of the rally point.
pub(super) fn check_rally(item: &MissionItem, origin: Option<&EarthOrigin>) -> Result<(), Invalid> {
    if item.command != RALLY_POINT {
        return Err(Invalid::COMMAND);
    }
    check_unused(item, PLACE)?;
    let global = place(item).filter(|_| item.frame != LOCAL_NED);
    let Some(place) = global else {
        return Err(Invalid { result: MissionResult::UNSUPPORTED_FRAME, reason: "frame is not supported" });
    };
    on_earth(&place)?;
    let near = resolve_item(item, origin, 0.0).is_none_or(|place_m| is_place(&place_m));
    if near { Ok(()) } else { Err(FAR) }
}

/// Bits of the parameters of a place: x, y and z.
const PLACE: u8 = 0b111_0000;

/// Returns the bits of the parameters that a command uses, from the lowest on. Returns none for an unknown command.
fn used(item: &MissionItem) -> Option<u8> {
    let [first, ..] = item.parameters;
    Some(match item.command {
        WAYPOINT => PLACE | 0b1011,
        LOITER => PLACE | 0b1000,
        LOITER_TURNS => PLACE | 0b0101,
        LOITER_TIME => PLACE | 0b1001,
        // The pitch is for fixed-wing aircraft, but ground stations set it for any vehicle.
        TAKE_OFF => PLACE | 0b0001,
        LAND | LOITER_TO_ALTITUDE | LOOK => PLACE,
        RETURN | LOOK_NOWHERE => 0,
        OLD_LOOK if first == 0.0 => 0b0001,
        OLD_LOOK => PLACE | 0b0001,
        DELAY => 0b1111,
        YAW => 0b1101,
        JUMP => 0b0011,
        SPEED => 0b0111,
        _ => return None,
    })
}

/// Checks that no parameter outside the bits `used` is set, so that nothing is ignored silently.
///
/// # Errors
/// Returns the first parameter that is neither 0 nor omitted.
pub(in crate::services) fn check_unused(item: &MissionItem, used: u8) -> Result<(), Invalid> {
    let [p1, p2, p3, p4] = item.parameters.map(is_neutral);
    let [x, y] = [item.x, item.y].map(|whole| whole == 0 || whole == GlobalPosition::AS_IT_IS);
    for (place, neutral) in (0..).zip([p1, p2, p3, p4, x, y, is_neutral(item.z)]) {
        if used >> place & 1 == 0 && !neutral {
            let result = MissionResult(MissionResult::INVALID_PARAM1.0 + place);
            return Err(Invalid { result, reason: NOT_USED });
        }
    }
    Ok(())
}

/// Returns true if a parameter is 0 or omitted.
fn is_neutral(value: f32) -> bool {
    value == 0.0 || value.is_nan()
}

/// Values of DO_CHANGE_SPEED that keep the speed or throttle, or restore the default.
const KEPT: [f32; 2] = [NO_CHANGE, USUAL];
const NO_CHANGE: f32 = -1.0;
const USUAL: f32 = -2.0;

/// Returns true for a take-off or a landing at the vehicle's present place.
fn is_here(item: &MissionItem) -> bool {
    let nowhere = [[0; 2], [GlobalPosition::AS_IT_IS; 2]].contains(&[item.x, item.y]);
    nowhere && [TAKE_OFF, LAND].contains(&item.command)
}

fn on_earth(place: &GlobalPosition) -> Result<(), Invalid> {
    if place.latitude_e7.unsigned_abs() > 900_000_000 {
        return Err(Invalid { result: MissionResult::INVALID_X, reason: "latitude is out of range" });
    }
    if place.longitude_e7.unsigned_abs() > 1_800_000_000 {
        return Err(Invalid { result: MissionResult::INVALID_Y, reason: "longitude is out of range" });
    }
    Ok(())
}

/// Checks all jumps of a mission. The items must be valid one by one. Each jump must lead to another item, and no
/// endless loop may consist only of items that take no time.
///
/// # Errors
/// Returns the number of a jump and its fault.
pub(super) fn check_jumps(items: &[MissionItem]) -> Result<(), (u16, Invalid)> {
    let at = |place: usize| items.get(place);
    let takes_time = |item: &MissionItem| ![JUMP, SPEED, LOOK, LOOK_NOWHERE, OLD_LOOK].contains(&item.command);
    let mut jumps = 0;
    for (place, item) in items.iter().enumerate().filter(|(_, item)| item.command == JUMP) {
        let refuse = |result, reason| Err((item.number, Invalid { result, reason }));
        jumps += 1;
        if jumps > JUMPS_MAX {
            return refuse(MissionResult::NO_SPACE, "more than 8 jumps");
        }
        let [target, ..] = item.parameters;
        // The target is a whole number and not negative, as `check` ensures.
        if target as usize >= items.len() || target as usize == place {
            return refuse(MissionResult::INVALID_PARAM1, "the jump's target does not exist");
        }
        // Jumps with a limited number of repetitions end at some time.
        let mut next = place;
        // More steps than items mean that an item was reached twice: the loop is endless.
        let ends = (0..=items.len()).any(|_| {
            let Some(item) = at(next).filter(|item| !takes_time(item)) else { return true };
            let [target, repeats, ..] = item.parameters;
            next = if item.command == JUMP && repeats == -1.0 { target as usize } else { next + 1 };
            false
        });
        if !ends {
            return refuse(MissionResult::INVALID_PARAM1, "jump loops without a waypoint");
        }
    }
    Ok(())
}

/// Largest number of jumps in a mission.
pub(super) const JUMPS_MAX: usize = 8;

/// Returns the number if it is whole and at most `most`.
fn whole(number: f32, most: f32) -> Option<u16> {
    let whole = number as u16;
    ((0.0..=most).contains(&number) && f32::from(whole) == number).then_some(whole)
}

/// Returns the horizontal position that an item leads the vehicle to \[m\]. Returns none for an item without a place.
pub(super) fn stop_m(item: &MissionItem, chart: &LocalChart) -> Option<Vector2<f32>> {
    let stops = [TAKE_OFF, WAYPOINT, LOITER, LOITER_TURNS, LOITER_TIME, LOITER_TO_ALTITUDE, LAND];
    if is_here(item) || !stops.contains(&item.command) {
        return None;
    }
    if item.frame == LOCAL_NED {
        return Some(Vector2::new(item.x as f32 * 1e-4, item.y as f32 * -1e-4));
    }
    Some(chart.local([item.x, item.y]))
}

/// Converts an item to the guidance's type, in the local frame. Returns none for an invalid item, or for a global place
/// while the origin is unknown. `home_m` is the height of home.
pub fn to_guidance(item: &MissionItem, origin: Option<&EarthOrigin>, home_m: f32) -> Option<Item> {
    let [first, second, third, fourth] = item.parameters;
    let or_zero = |number: f32| if number.is_nan() { 0.0 } else { number };
    let position_m = || resolve_item(item, origin, home_m);
    Some(match item.command {
        TAKE_OFF if is_here(item) => Item::TakeOff { height_m: position_m()?.z },
        TAKE_OFF => Item::TakeOffTo { position_m: position_m()? },
        // `Jumps` counts the repetitions: 0 for none, -1 for no limit.
        JUMP => Item::Jump(whole(first, f32::from(u8::MAX))?),
        LOITER => Item::Waypoint {
            position_m: position_m()?,
            yaw_rad: -fourth.to_radians(),
            hold_s: f32::INFINITY,
            within_m: 0.0,
            fly_through: false,
        },
        LOITER_TURNS => Item::Turns { centre_m: position_m()?, radius_m: -or_zero(third), turns: first },
        LOITER_TO_ALTITUDE => Item::Waypoint {
            position_m: position_m()?,
            yaw_rad: f32::NAN,
            hold_s: 0.0,
            within_m: 0.0,
            fly_through: false,
        },
        DELAY => Item::Wait(first),
        // MAVLink's angles are clockwise.
        YAW => Item::Yaw { yaw_rad: -first.to_radians(), relative: fourth == 1.0, direction: -(third as i8) },
        LOOK_NOWHERE => Item::Look { at_m: Vector3::repeat(f32::NAN) },
        OLD_LOOK if first == 0.0 => Item::Look { at_m: Vector3::repeat(f32::NAN) },
        LOOK | OLD_LOOK => Item::Look { at_m: position_m()? },
        WAYPOINT => Item::Waypoint {
            position_m: position_m()?,
            yaw_rad: -fourth.to_radians(),
            hold_s: or_zero(first),
            within_m: or_zero(second),
            fly_through: false,
        },
        LOITER_TIME => Item::Waypoint {
            position_m: position_m()?,
            yaw_rad: -fourth.to_radians(),
            hold_s: or_zero(first),
            within_m: 0.0,
            fly_through: false,
        },
        LAND if is_here(item) => Item::Land { position_m: Vector3::from_element(f32::NAN) },
        LAND => Item::Land { position_m: position_m()? },
        RETURN => Item::Return,
        SPEED if second == NO_CHANGE => Item::Wait(0.0),
        SPEED => Item::Speed(if second == USUAL { f32::INFINITY } else { second }),
        _ => return None,
    })
}

/// Returns the place of an item. For an item in the local frame only the height counts.
fn place(item: &MissionItem) -> Option<GlobalPosition> {
    let above = match item.frame {
        0 | 5 | LOCAL_NED => Datum::Sea,
        3 | 6 => Datum::Home,
        _ => return None,
    };
    let height = Height { metres: item.z, above };
    // The local coordinates are not degrees, so they are replaced by valid ones.
    let coordinates = if item.frame == LOCAL_NED { [1; 2] } else { [item.x, item.y] };
    let [latitude_e7, longitude_e7] = coordinates;
    Some(GlobalPosition { latitude_e7, longitude_e7, height })
}

/// `MAV_FRAME_LOCAL_NED`.
const LOCAL_NED: u8 = 1;

fn resolve_item(item: &MissionItem, origin: Option<&EarthOrigin>, home_m: f32) -> Option<Vector3<f32>> {
    if item.frame == LOCAL_NED {
        return Some(Vector3::new(item.x as f32 * 1e-4, item.y as f32 * -1e-4, -item.z));
    }
    Some(resolve(origin?, &place(item)?, home_m, f32::NAN))
}
