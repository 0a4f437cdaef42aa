//! Decoding of NAV-PVT, a navigation solution.

use crate::reading::GnssReading;
use nalgebra::Vector3;

/// Payload lengths of the seventh generation and of later ones.
const LENGTHS: [usize; 2] = [84, 92];
/// `fixType`: three-dimensional, without and with dead reckoning.
const IN_SPACE: [u8; 2] = [3, 4];
/// Bit of `flags`: within the receiver's own accuracy limits.
const IS_GOOD: u8 = 1;
/// Bit of `flags3`: position invalid.
const IS_NO_PLACE: u8 = 1;

/// Decodes a payload. Returns none for another length, and `Some(None)` for an epoch without a fix or with impossible
/// numbers.
pub(super) fn read(payload: &[u8]) -> Option<Option<GnssReading>> {
    LENGTHS.contains(&payload.len()).then(|| fix(payload))
}

fn fix(payload: &[u8]) -> Option<GnssReading> {
    let byte = |at: usize| payload.get(at).copied();
    let word = |at: usize| payload.get(at..).and_then(|rest| rest.first_chunk::<4>()).copied();
    let signed = |at: usize| word(at).map(i32::from_le_bytes);
    // Distances in millimetres, speeds in millimetres per second.
    let metres = |at: usize| signed(at).map(|number| f64::from(number) * 1e-3);
    let sigma = |at: usize| word(at).map(|bytes| u32::from_le_bytes(bytes) as f32 * 1e-3);
    if !IN_SPACE.contains(&byte(20)?) || byte(21)? & IS_GOOD == 0 || byte(78)? & IS_NO_PLACE != 0 {
        return None;
    }
    let speed_sigma_m_s = sigma(68)?;
    let reading = GnssReading {
        latitude_deg: f64::from(signed(28)?) * 1e-7,
        longitude_deg: f64::from(signed(24)?) * 1e-7,
        altitude_m: metres(36)?,
        velocity_ned_m_s: Vector3::new(metres(48)?, metres(52)?, metres(56)?).map(|speed| speed as f32),
        horizontal_sigma_m: sigma(40)?,
        vertical_sigma_m: sigma(44)?,
        speed_sigma_m_s,
        climb_sigma_m_s: speed_sigma_m_s,
        satellites: byte(23)?,
    };
    reading.possible()
}
