//! The vehicle's position on the earth.

use crate::frames::{flip, flip_turn};
use crate::message::{MessageFormat, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use mavlink::MessageData;
use mavlink::dialects::common::{
    GLOBAL_POSITION_INT_DATA, GPS_GLOBAL_ORIGIN_DATA, GPS_RAW_INT_DATA, HOME_POSITION_DATA,
};
use nalgebra::Vector3;

/// GLOBAL_POSITION_INT (33).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GlobalPositionInt {
    /// Time since power-up \[ms\].
    pub time_ms: u32,
    /// Latitude and longitude \[1e-7 deg\].
    pub place_e7: [i32; 2],
    /// Altitude above the sea \[mm\].
    pub altitude_mm: i32,
    /// Altitude above home \[mm\].
    pub relative_mm: i32,
    /// Velocity north, east, down \[cm/s\].
    pub velocity_ned_cm_s: [i16; 3],
    /// Compass heading, 0 to 35999 \[0.01 deg\].
    pub heading_cdeg: u16,
}

/// GPS_RAW_INT (24).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GpsRawInt {
    /// Time since power-up \[us\].
    pub time_us: u64,
    /// Latitude and longitude \[1e-7 deg\].
    pub place_e7: [i32; 2],
    /// Altitude above the sea \[mm\].
    pub altitude_mm: i32,
    /// `GPS_FIX_TYPE`: 0 no receiver, 1 no fix, 3 three-dimensional.
    pub kind: u8,
    /// Number of satellites; 255 if unknown.
    pub satellites: u8,
    /// Horizontal and vertical uncertainty; 0 if unknown \[mm\].
    pub sigma_mm: [u32; 2],
    /// Speed above the ground \[cm/s\]; `u16::MAX` if unknown.
    pub speed_cm_s: u16,
    /// Course above the ground \[0.01 deg\]; `u16::MAX` if unknown.
    pub course_cdeg: u16,
}

/// HOME_POSITION (242).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HomePosition {
    /// Latitude and longitude \[1e-7 deg\].
    pub place_e7: [i32; 2],
    /// Altitude above the sea \[mm\].
    pub altitude_mm: i32,
    /// Position in the local frame \[m\].
    pub position_m: Vector3<f32>,
    /// Attitude at home: quaternion w, x, y, z.
    pub attitude: [f32; 4],
    /// Time since power-up \[us\].
    pub time_us: u64,
}

/// GPS_GLOBAL_ORIGIN (49): position of the local frame's origin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GlobalOrigin {
    /// Latitude and longitude \[1e-7 deg\].
    pub place_e7: [i32; 2],
    /// Altitude above the sea \[mm\].
    pub altitude_mm: i32,
    /// Time since power-up \[us\].
    pub time_us: u64,
}

/// Fields: time, latitude, longitude; altitudes above the sea and home; velocity; heading.
const GLOBAL: MessageLayout<GLOBAL_POSITION_INT_DATA, (u32, [i32; 2], [i32; 2], [i16; 3], u16)> = MessageLayout::NEW;
/// Fields: time, position, altitude; dilutions of precision, speed, course; fix type, satellites; altitude above the
/// ellipsoid, four uncertainties, yaw.
const FIX: MessageLayout<GPS_RAW_INT_DATA, (u64, [i32; 2], i32, [u16; 4], [u8; 2], i32, [u32; 4], u16)> =
    MessageLayout::NEW;
/// Fields: position, altitude; x, y, z; attitude; direction of the approach; time.
const HOME: MessageLayout<HOME_POSITION_DATA, ([i32; 2], i32, [f32; 3], [f32; 4], [f32; 3], u64)> = MessageLayout::NEW;
const ORIGIN: MessageLayout<GPS_GLOBAL_ORIGIN_DATA, ([i32; 2], i32, u64)> = MessageLayout::NEW;

pub(super) fn format(id: u32) -> Option<MessageFormat> {
    match id {
        GLOBAL_POSITION_INT_DATA::ID => Some(GLOBAL.format()),
        GPS_RAW_INT_DATA::ID => Some(FIX.format()),
        HOME_POSITION_DATA::ID => Some(HOME.format()),
        GPS_GLOBAL_ORIGIN_DATA::ID => Some(ORIGIN.format()),
        _ => None,
    }
}

impl GlobalPositionInt {
    pub(super) fn read(payload: &[u8]) -> Self {
        let (time_ms, place_e7, [altitude_mm, relative_mm], velocity_ned_cm_s, heading_cdeg) = GLOBAL.read(payload);
        GlobalPositionInt { time_ms, place_e7, altitude_mm, relative_mm, velocity_ned_cm_s, heading_cdeg }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let heights = [self.altitude_mm, self.relative_mm];
        GLOBAL.write(&(self.time_ms, self.place_e7, heights, self.velocity_ned_cm_s, self.heading_cdeg), payload)
    }
}

impl GpsRawInt {
    pub(super) fn read(payload: &[u8]) -> Self {
        let (time_us, place_e7, altitude_mm, [_, _, speed_cm_s, course_cdeg], [kind, satellites], _, sigma, _) =
            FIX.read(payload);
        let [horizontal, vertical, _, _] = sigma;
        let sigma_mm = [horizontal, vertical];
        GpsRawInt { time_us, place_e7, altitude_mm, kind, satellites, sigma_mm, speed_cm_s, course_cdeg }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let GpsRawInt { time_us, place_e7, altitude_mm, kind, satellites, sigma_mm, speed_cm_s, course_cdeg } = *self;
        // The dilutions of precision are unknown.
        let numbers = [u16::MAX, u16::MAX, speed_cm_s, course_cdeg];
        let [horizontal, vertical] = sigma_mm;
        let sigma = [horizontal, vertical, 0, 0];
        FIX.write(&(time_us, place_e7, altitude_mm, numbers, [kind, satellites], 0, sigma, 0), payload)
    }
}

impl HomePosition {
    pub(super) fn read(payload: &[u8]) -> Self {
        let (place_e7, altitude_mm, position, attitude, _, time_us) = HOME.read(payload);
        let (position_m, attitude) = (flip(position.into()), flip_turn(attitude));
        HomePosition { place_e7, altitude_mm, position_m, attitude, time_us }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let HomePosition { place_e7, altitude_mm, position_m, attitude, time_us } = *self;
        let (position, attitude) = (flip(position_m).into(), flip_turn(attitude));
        HOME.write(&(place_e7, altitude_mm, position, attitude, [0.0; 3], time_us), payload)
    }
}

impl GlobalOrigin {
    pub(super) fn read(payload: &[u8]) -> Self {
        let (place_e7, altitude_mm, time_us) = ORIGIN.read(payload);
        GlobalOrigin { place_e7, altitude_mm, time_us }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        ORIGIN.write(&(self.place_e7, self.altitude_mm, self.time_us), payload)
    }
}
