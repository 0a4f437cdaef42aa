//! What NAV-PVT says: a navigation solution.

use crate::reading::FixReading;
use nalgebra::Vector3;

/// Lengths of its payload, of the seventh generation and of later ones.
const LENGTHS: [usize; 2] = [84, 92];
/// `fixType`: in three dimensions, without and with dead reckoning.
const IN_SPACE: [u8; 2] = [3, 4];
/// Bit of `flags`: within the receiver's own limits of accuracy.
const IS_GOOD: u8 = 1;
/// Bit of `flags3`: no position.
const IS_NO_PLACE: u8 = 1;
/// The receivers' own limits: altitude \[m\], speed along an axis \[m/s\].
const ALTITUDES_M: core::ops::RangeInclusive<f64> = -10_000.0..=80_000.0;
const SPEED_MAX_M_S: f32 = 500.0;
/// Standard deviations beyond which a fix is none: of the position \[m\], of the velocity \[m/s\].
const SIGMA_MAX_M: f32 = 200.0;
const SIGMA_MAX_M_S: f32 = 20.0;

/// Returns the fix of a payload: none if it has another length, `Some(None)` for an epoch without a fix, or with one
/// that no receiver can have.
pub(super) fn read(payload: &[u8]) -> Option<Option<FixReading>> {
    LENGTHS.contains(&payload.len()).then(|| fix(payload))
}

fn fix(payload: &[u8]) -> Option<FixReading> {
    let byte = |at: usize| payload.get(at).copied();
    let word = |at: usize| payload.get(at..).and_then(|rest| rest.first_chunk::<4>()).copied();
    let signed = |at: usize| word(at).map(i32::from_le_bytes);
    // Distances in millimetres, speeds in millimetres per second.
    let metres = |at: usize| signed(at).map(|number| f64::from(number) * 1e-3);
    let sigma = |at: usize, most: f32| {
        let sigma = word(at).map(u32::from_le_bytes)? as f32 * 1e-3;
        (sigma > 0.0 && sigma <= most).then_some(sigma)
    };
    if !IN_SPACE.contains(&byte(20)?) || byte(21)? & IS_GOOD == 0 || byte(78)? & IS_NO_PLACE != 0 {
        return None;
    }
    let [longitude_deg, latitude_deg] = [f64::from(signed(24)?) * 1e-7, f64::from(signed(28)?) * 1e-7];
    let altitude_m = metres(36)?;
    let velocity_ned_m_s = Vector3::new(metres(48)?, metres(52)?, metres(56)?).map(|speed| speed as f32);
    let is_possible = latitude_deg.abs() <= 90.0
        && longitude_deg.abs() <= 180.0
        && ALTITUDES_M.contains(&altitude_m)
        && velocity_ned_m_s.iter().all(|speed| speed.abs() <= SPEED_MAX_M_S);
    let speed_sigma_m_s = sigma(68, SIGMA_MAX_M_S)?;
    is_possible.then_some(FixReading {
        latitude_deg,
        longitude_deg,
        altitude_m,
        velocity_ned_m_s,
        horizontal_sigma_m: sigma(40, SIGMA_MAX_M)?,
        vertical_sigma_m: sigma(44, SIGMA_MAX_M)?,
        speed_sigma_m_s,
        climb_sigma_m_s: speed_sigma_m_s,
        satellites: byte(23)?,
    })
}
