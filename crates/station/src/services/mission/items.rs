//! Items of a mission: what is valid, and what the guidance makes of it.

use crate::services::origin::{EarthOrigin, resolve};
use afbc_guidance::Item;
use afbc_link::{Datum, Height, MissionItem, MissionResult, Place};
use nalgebra::Vector3;

/// Most items of a mission.
pub const ITEMS_MAX: usize = 64;

const WAYPOINT: u16 = 16;
const LOITER_TIME: u16 = 19;
const RETURN: u16 = 20;
const LAND: u16 = 21;
const TAKE_OFF: u16 = 22;
const SPEED: u16 = 178;

/// Why an item is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Invalid {
    /// As the protocol has it.
    pub result: MissionResult,
    /// In words.
    pub reason: &'static str,
}

/// Checks an item.
///
/// # Errors
/// The first thing that is wrong with it.
pub fn check(item: &MissionItem) -> Result<(), Invalid> {
    let refuse = |result, reason| Err(Invalid { result, reason });
    let within = |number: f32, max: f32| number.is_nan() || (0.0..=max).contains(&number);
    let [first, second, _, fourth] = item.parameters;
    if ![WAYPOINT, LOITER_TIME, RETURN, LAND, TAKE_OFF, SPEED].contains(&item.command) {
        return refuse(MissionResult::UNSUPPORTED, "command is not supported");
    }
    if item.command == SPEED {
        return match item.parameters {
            // -1: no change.
            [0.0 | 1.0, speed, ..] if speed == -1.0 || (speed > 0.0 && speed <= 1e3) => Ok(()),
            [0.0 | 1.0, ..] => refuse(MissionResult(7), "speed is out of range"),
            _ => refuse(MissionResult::INVALID_PARAM1, "kind of speed is not supported"),
        };
    }
    if item.command == RETURN {
        return Ok(());
    }
    let Some(place) = place(item) else {
        return refuse(MissionResult::UNSUPPORTED_FRAME, "frame is not supported");
    };
    if item.command != TAKE_OFF {
        // A landing may be where the vehicle is.
        let anywhere = item.command == LAND && place.latitude_e7 == 0 && place.longitude_e7 == 0;
        if !anywhere && place.latitude_e7.unsigned_abs() > 900_000_000 {
            return refuse(MissionResult::INVALID_X, "latitude is out of range");
        }
        if !anywhere && place.longitude_e7.unsigned_abs() > 1_800_000_000 {
            return refuse(MissionResult::INVALID_Y, "longitude is out of range");
        }
    }
    // A landing's height does not matter.
    let any_height = item.command == LAND && item.z.is_nan();
    if !any_height && !(-1e5..=1e5).contains(&item.z) {
        return refuse(MissionResult::INVALID_Z, "altitude is out of range");
    }
    if [WAYPOINT, LOITER_TIME].contains(&item.command) {
        if !within(first, 3600.0) {
            return refuse(MissionResult::INVALID_PARAM1, "time to stay is out of range");
        }
        if item.command == WAYPOINT && !within(second, 1000.0) {
            return refuse(MissionResult(7), "radius is out of range");
        }
        if !(fourth.is_nan() || fourth.abs() <= 3600.0) {
            return refuse(MissionResult(9), "heading is out of range");
        }
    }
    Ok(())
}

/// Returns the item in the local frame; none for a place on the earth while the origin is unknown, or an invalid item.
/// `home_m` is the height of home.
pub fn to_guidance(item: &MissionItem, origin: Option<&EarthOrigin>, home_m: f32) -> Option<Item> {
    let [first, second, _, fourth] = item.parameters;
    let or_zero = |number: f32| if number.is_nan() { 0.0 } else { number };
    let position_m = || resolve_item(item, origin, home_m);
    Some(match item.command {
        TAKE_OFF => Item::TakeOff { height_m: position_m()?.z },
        WAYPOINT => Item::Waypoint {
            position_m: position_m()?,
            yaw_rad: -fourth.to_radians(),
            hold_s: or_zero(first),
            within_m: or_zero(second),
            fly_through: false,
        },
        LOITER_TIME => Item::Waypoint {
            position_m: position_m()?,
            yaw_rad: f32::NAN,
            hold_s: or_zero(first),
            within_m: 0.0,
            fly_through: false,
        },
        LAND if item.x == 0 && item.y == 0 => Item::Land { position_m: Vector3::from_element(f32::NAN) },
        LAND => Item::Land { position_m: position_m()? },
        RETURN => Item::Return,
        SPEED => Item::Speed(second),
        _ => return None,
    })
}

/// Returns the place of an item in a global frame or, with coordinates in metres, in the local one.
fn place(item: &MissionItem) -> Option<Place> {
    let above = match item.frame {
        0 | 5 | LOCAL_NED => Datum::Sea,
        3 | 6 => Datum::Home,
        _ => return None,
    };
    let height = Height { metres: item.z, above };
    // Metres of the local frame are no degrees.
    let coordinates = if item.frame == LOCAL_NED { [1; 2] } else { [item.x, item.y] };
    let [latitude_e7, longitude_e7] = coordinates;
    Some(Place { latitude_e7, longitude_e7, height })
}

/// MAV_FRAME_LOCAL_NED.
const LOCAL_NED: u8 = 1;

fn resolve_item(item: &MissionItem, origin: Option<&EarthOrigin>, home_m: f32) -> Option<Vector3<f32>> {
    if item.frame == LOCAL_NED {
        return Some(Vector3::new(item.x as f32 * 1e-4, item.y as f32 * -1e-4, -item.z));
    }
    Some(resolve(origin?, &place(item)?, home_m, f32::NAN))
}
