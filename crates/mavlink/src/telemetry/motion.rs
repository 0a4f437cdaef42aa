//! Attitude, and the summary for a pilot's display.

use crate::frames::{flip, flip_turn};
use crate::message::{MessageFormat, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use mavlink::MessageData;
use mavlink::dialects::common::{ATTITUDE_QUATERNION_DATA, VFR_HUD_DATA};
use nalgebra::Vector3;

/// ATTITUDE_QUATERNION (31).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AttitudeQuaternion {
    /// Time since power-up \[ms\].
    pub time_ms: u32,
    /// Quaternion w, x, y, z from body to earth.
    pub attitude: [f32; 4],
    /// p, q, r \[rad/s\].
    pub rates_rad_s: Vector3<f32>,
}

/// VFR_HUD (74).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VfrHud {
    /// Ground speed, horizontal \[m/s\]; also sent as airspeed.
    pub speed_m_s: f32,
    /// Altitude above mean sea level, or in the local frame if that is unknown \[m\].
    pub altitude_m: f32,
    /// Climb rate \[m/s\].
    pub climb_m_s: f32,
    /// Compass heading, 0 to 359 \[deg\].
    pub heading_deg: i16,
    /// Throttle, 0 to 100 \[%\].
    pub throttle_percent: u16,
}

const ATTITUDE: MessageLayout<ATTITUDE_QUATERNION_DATA, (u32, [f32; 4], [f32; 3], [f32; 4])> = MessageLayout::NEW;
/// Fields: airspeed, ground speed, altitude, climb rate; heading, throttle.
const SUMMARY: MessageLayout<VFR_HUD_DATA, ([f32; 4], i16, u16)> = MessageLayout::NEW;

pub(super) fn format(id: u32) -> Option<MessageFormat> {
    match id {
        ATTITUDE_QUATERNION_DATA::ID => Some(ATTITUDE.format()),
        VFR_HUD_DATA::ID => Some(SUMMARY.format()),
        _ => None,
    }
}

impl AttitudeQuaternion {
    pub(super) fn read(payload: &[u8]) -> Self {
        let (time_ms, attitude, rates, _) = ATTITUDE.read(payload);
        let (attitude, rates_rad_s) = (flip_turn(attitude), flip(rates.into()));
        AttitudeQuaternion { time_ms, attitude, rates_rad_s }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let rates = flip(self.rates_rad_s).into();
        ATTITUDE.write(&(self.time_ms, flip_turn(self.attitude), rates, [0.0; 4]), payload)
    }
}

impl VfrHud {
    pub(super) fn read(payload: &[u8]) -> Self {
        let ([_, speed_m_s, altitude_m, climb_m_s], heading_deg, throttle_percent) = SUMMARY.read(payload);
        VfrHud { speed_m_s, altitude_m, climb_m_s, heading_deg, throttle_percent }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let VfrHud { speed_m_s, altitude_m, climb_m_s, heading_deg, throttle_percent } = *self;
        SUMMARY.write(&([speed_m_s, speed_m_s, altitude_m, climb_m_s], heading_deg, throttle_percent), payload)
    }
}
