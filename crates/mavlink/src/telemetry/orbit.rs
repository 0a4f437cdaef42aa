//! Orbit being flown.

use crate::message::{MessageFormat, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use mavlink::MessageData;
use mavlink::dialects::common::ORBIT_EXECUTION_STATUS_DATA;

/// ORBIT_EXECUTION_STATUS (360).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OrbitStatus {
    /// Time since power-up \[us\].
    pub time_us: u64,
    /// Radius, positive for clockwise \[m\].
    pub radius_m: f32,
    /// Latitude and longitude of the centre \[1e-7 deg\].
    pub place_e7: [i32; 2],
    /// Altitude above the sea \[m\].
    pub altitude_m: f32,
}

/// Fields: time; radius, place, altitude; frame.
const ORBIT: MessageLayout<ORBIT_EXECUTION_STATUS_DATA, (u64, f32, [i32; 2], f32, u8)> = MessageLayout::NEW;
/// MAV_FRAME_GLOBAL_INT.
const FRAME: u8 = 5;

pub(super) fn format(id: u32) -> Option<MessageFormat> {
    (id == ORBIT_EXECUTION_STATUS_DATA::ID).then(|| ORBIT.format())
}

impl OrbitStatus {
    pub(super) fn read(payload: &[u8]) -> Self {
        let (time_us, radius_m, place_e7, altitude_m, _) = ORBIT.read(payload);
        OrbitStatus { time_us, radius_m, place_e7, altitude_m }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let OrbitStatus { time_us, radius_m, place_e7, altitude_m } = *self;
        ORBIT.write(&(time_us, radius_m, place_e7, altitude_m, FRAME), payload)
    }
}
