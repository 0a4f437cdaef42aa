//! Encodes parameter values on the link: four bytes and a type.
//!
//! Numbers are sent as REAL32, which has one encoding. Switches and whole numbers are sent as INT32, which has two
//! encodings. *Bytewise*, the four bytes are the integer itself; this vehicle sends it, and PX4, QGroundControl and
//! MAVSDK use it. In the *C cast* of ArduPilot, they are the number as a float.
//!
//! Both are understood, because they never clash. The float bits of a whole number other than zero, read as an integer,
//! are beyond +-1,065,000,000, where no parameter is. The bytes of an integer within +-8,388,607, read as a float, are
//! no whole number other than 0, and 0 is the same in both.

/// Type of a parameter on the link (MAV_PARAM_TYPE).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A number.
    Real32,
    /// A switch or a whole number.
    Int32,
}

/// MAV_PARAM_TYPE_REAL32.
const REAL32: u8 = 9;
/// Widths of MAV_PARAM_TYPE_UINT8 (1) to MAV_PARAM_TYPE_INT32 (6) \[bytes\]. Odd types are unsigned.
const WIDTHS: [u32; 6] = [1, 1, 2, 2, 4, 4];
/// Largest whole number that is the same in `f32` and in both encodings.
const WHOLE_MAX: f32 = 8_388_607.0;

impl Kind {
    /// Returns the MAV_PARAM_TYPE.
    pub const fn number(self) -> u8 {
        match self {
            Kind::Real32 => REAL32,
            Kind::Int32 => 6,
        }
    }

    /// Returns the value's four bytes on the link, little-endian.
    pub fn encode(self, value: f32) -> [u8; 4] {
        match self {
            Kind::Real32 => value.to_le_bytes(),
            Kind::Int32 => (value as i32).to_le_bytes(),
        }
    }
}

/// Returns the value that `bytes` of the MAV_PARAM_TYPE `kind` represent. Returns none for a type of more than four
/// bytes, and for an integer beyond +-8,388,607.
pub fn decode(kind: u8, bytes: [u8; 4]) -> Option<f32> {
    let as_float = f32::from_le_bytes(bytes);
    if kind == REAL32 {
        return Some(as_float);
    }
    let width = *WIDTHS.get(usize::from(kind).checked_sub(1)?)?;
    let is_whole = |number: f32| number.is_normal() && number as i32 as f32 == number;
    if is_whole(as_float) && as_float.abs() <= WHOLE_MAX {
        return Some(as_float);
    }
    // Uses only the type's own bytes, whatever the others hold.
    let unused = 32 - 8 * width;
    let shifted = u32::from_le_bytes(bytes) << unused;
    let is_signed = kind.is_multiple_of(2);
    // Shifting an i32 back extends the sign.
    let value = if is_signed { f64::from((shifted as i32) >> unused) } else { f64::from(shifted >> unused) };
    (value.abs() <= f64::from(WHOLE_MAX)).then_some(value as f32)
}

#[cfg(test)]
#[allow(clippy::indexing_slicing, reason = "a test that cannot go on should say why")]
mod tests {
    use super::*;

    /// Types 1 to 6 are decoded in both encodings.
    #[test]
    fn both_encodings_of_every_integer_are_distinguished() {
        let step = 997;
        for number in (-8_388_607..=8_388_607_i32).step_by(step).chain(-70_000..=70_000) {
            let value = number as f32;
            let fits = [0..=255, -128..=127, 0..=65_535, -32_768..=32_767, 0..=8_388_607, -8_388_607..=8_388_607];
            for (kind, fits) in (1..).zip(fits) {
                if fits.contains(&number) {
                    let low = number.to_le_bytes();
                    let width = [1, 1, 2, 2, 4, 4][usize::from(kind) - 1];
                    let bytewise = core::array::from_fn(|i| if i < width { low[i] } else { 0 });
                    assert_eq!(decode(kind, bytewise), Some(value), "type {kind}, bytewise");
                    assert_eq!(decode(kind, value.to_le_bytes()), Some(value), "type {kind}, C cast");
                    // pymavlink and MAVSDK may sign-extend or not: bytes beyond the number are ignored.
                    if kind.is_multiple_of(2) {
                        assert_eq!(decode(kind, low), Some(value), "type {kind}, sign-extended");
                    }
                }
            }
            assert_eq!(decode(REAL32, value.to_le_bytes()), Some(value));
            assert_eq!(Kind::Int32.encode(value), number.to_le_bytes());
        }
    }

    #[test]
    fn a_type_that_does_not_fit_is_no_value() {
        for kind in [0, 7, 8, 10, 11, 255] {
            assert_eq!(decode(kind, [0; 4]), None);
        }
        assert_eq!(decode(6, i32::MAX.to_le_bytes()), None);
    }
}
