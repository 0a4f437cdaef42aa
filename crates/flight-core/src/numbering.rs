//! Assignment of motor outputs to rotors, for flight controllers that number their outputs for an X frame.
//!
//! Such a controller numbers its outputs by the corners of the X. If the vehicle has four rotors, one in each corner,
//! an output drives the rotor in its corner, in whatever order the vehicle's file lists the rotors. For any other
//! frame, output n drives rotor n.

use afbc_types::{Rotor, Rotors};
use core::array;

/// A corner of an X frame, seen from above with the front up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "named after what they are")]
pub enum Corner {
    FrontRight,
    RearRight,
    RearLeft,
    FrontLeft,
}

/// Corners of motors 1 to 4 in Betaflight.
pub const BETAFLIGHT: [Corner; 4] = [Corner::RearRight, Corner::FrontRight, Corner::RearLeft, Corner::FrontLeft];
/// Corners of motors 1 to 4 in ArduPilot and PX4.
pub const ARDUPILOT: [Corner; 4] = [Corner::FrontRight, Corner::RearLeft, Corner::FrontLeft, Corner::RearRight];

/// Smallest distance of a corner's rotor from the body's x and y axes \[arm lengths\].
const ASIDE: f32 = 0.1;

/// Returns the index of the rotor that each output drives. For an output without a rotor, the index is beyond the
/// vehicle's rotors.
#[must_use]
pub fn rotors_of_outputs<const OUTPUTS: usize>(numbering: [Corner; 4], rotors: &Rotors) -> [usize; OUTPUTS] {
    let rotor_in = |corner| rotors.iter().position(|rotor| self::corner(&rotor) == Some(corner));
    let is_x = rotors.count() == numbering.len() && numbering.iter().all(|corner| rotor_in(*corner).is_some());
    array::from_fn(|output| match numbering.get(output) {
        // The rotor is always found, since `is_x` has checked every corner.
        Some(corner) if is_x => rotor_in(*corner).unwrap_or(output),
        _ => output,
    })
}

/// Returns the corner of a rotor, if it is in one.
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
