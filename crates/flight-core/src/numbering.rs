//! Which rotor is which motor on a flight controller for X frames.
//!
//! Such a controller numbers its outputs by the corners of an X. Four rotors with one in each corner are driven by
//! their corners, in whatever order the vehicle's file lists them; of any other frame, output n drives rotor n.

use afbc_types::Rotor;
use core::array;

/// A corner of an X frame, seen from above, forward up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "named after what they are")]
pub enum Corner {
    FrontRight,
    RearRight,
    RearLeft,
    FrontLeft,
}

/// Motors 1 to 4 as Betaflight numbers them.
pub const BETAFLIGHT: [Corner; 4] = [Corner::RearRight, Corner::FrontRight, Corner::RearLeft, Corner::FrontLeft];
/// Motors 1 to 4 as ArduPilot and PX4 number them.
pub const ARDUPILOT: [Corner; 4] = [Corner::FrontRight, Corner::RearLeft, Corner::FrontLeft, Corner::RearRight];

/// Least distance from the body's x and y axes of a rotor in a corner \[arm lengths\].
const ASIDE: f32 = 0.1;

/// Returns the index of the rotor that each output drives, first output first; beyond the vehicle's rotors for an
/// output without one.
#[must_use]
pub fn rotors_of_outputs<const N: usize, const OUTPUTS: usize>(
    numbering: [Corner; 4],
    rotors: &[Rotor; N],
) -> [usize; OUTPUTS] {
    let rotor_in = |corner| rotors.iter().position(|rotor| self::corner(rotor) == Some(corner));
    let is_x = N == numbering.len() && numbering.iter().all(|corner| rotor_in(*corner).is_some());
    array::from_fn(|output| match numbering.get(output) {
        // There is one: every corner of an X has been looked for.
        Some(corner) if is_x => rotor_in(*corner).unwrap_or(output),
        _ => output,
    })
}

/// Returns the corner that a rotor is in.
fn corner(rotor: &Rotor) -> Option<Corner> {
    let (ahead, left) = (rotor.x > ASIDE, rotor.y > ASIDE);
    let (behind, right) = (rotor.x < -ASIDE, rotor.y < -ASIDE);
    match () {
        () if ahead && right => Some(Corner::FrontRight),
        () if behind && right => Some(Corner::RearRight),
        () if behind && left => Some(Corner::RearLeft),
        () if ahead && left => Some(Corner::FrontLeft),
        () => None,
    }
}
