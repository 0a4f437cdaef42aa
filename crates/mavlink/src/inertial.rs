//! Readings of the inertial sensor and the magnetometer.

use crate::address::Address;
use crate::frames::flip;
use crate::message::{FrameFault, MessageFormat, MessageSet, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use mavlink::MessageData;
use mavlink::dialects::common::HIGHRES_IMU_DATA;
use nalgebra::Vector3;

/// HIGHRES_IMU (105), in the body frame of [`afbc_types`]. It is a separate direction, so that boards without sensors
/// contain none of its code; a ground station needs another [`Decoder`](crate::Decoder) for it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InertialSample {
    /// Time since power-up \[us\].
    pub time_us: u64,
    /// Specific force \[m/s2\].
    pub specific_force_m_s2: Vector3<f32>,
    /// p, q, r \[rad/s\].
    pub rates_rad_s: Vector3<f32>,
    /// Magnetic field, if it was measured \[uT\].
    pub field_ut: Option<Vector3<f32>>,
}

/// Fields: time; force, rates, field; pressures and altitude; temperature; flags of updated fields.
const SAMPLE: MessageLayout<HIGHRES_IMU_DATA, (u64, [[f32; 3]; 3], [f32; 3], f32, u16)> = MessageLayout::NEW;
/// HIGHRES_IMU_UPDATED_FLAGS, three axes each.
const INERTIAL: u16 = 0o77;
const FIELD: u16 = 0o700;
/// Microtesla per gauss, the message's unit.
const UT_PER_GAUSS: f32 = 100.0;

impl MessageSet for InertialSample {
    fn format(id: u32) -> Option<MessageFormat> {
        (id == HIGHRES_IMU_DATA::ID).then(|| SAMPLE.format())
    }

    fn read(_: u32, payload: &[u8], _: Address) -> Result<Self, FrameFault> {
        let (time_us, [force, rates, field], .., updated) = SAMPLE.read(payload);
        if !force.iter().chain(&rates).chain(&field).all(|number| number.is_finite()) {
            return Err(FrameFault::Implausible);
        }
        if updated & INERTIAL != INERTIAL {
            return Err(FrameFault::Unsupported);
        }
        Ok(InertialSample {
            time_us,
            specific_force_m_s2: flip(force.into()),
            rates_rad_s: flip(rates.into()),
            field_ut: (updated & FIELD == FIELD).then(|| flip(field.into()) * UT_PER_GAUSS),
        })
    }

    fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let InertialSample { time_us, specific_force_m_s2, rates_rad_s, field_ut } = *self;
        let field = field_ut.map_or([0.0; 3], |field_ut| (flip(field_ut) / UT_PER_GAUSS).into());
        let updated = INERTIAL | if field_ut.is_some() { FIELD } else { 0 };
        let vectors = [flip(specific_force_m_s2).into(), flip(rates_rad_s).into(), field];
        SAMPLE.write(&(time_us, vectors, [0.0; 3], 0.0, updated), payload)
    }
}
