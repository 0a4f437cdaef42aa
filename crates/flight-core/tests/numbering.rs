//! Tests which output drives which rotor, with the corners from Betaflight's and ArduPilot's documentation.

use afbc_flight_core::numbering::{ARDUPILOT, BETAFLIGHT, rotors_of_outputs};
use afbc_types::{PLUS, Rotor, Rotors};
use proptest::prelude::*;

/// Signs of x (forward) and y (left) of motors 1 to 4: Betaflight's "Quad X" and ArduPilot's "X".
const BETAFLIGHTS: [[f32; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]];
const ARDUPILOTS: [[f32; 2]; 4] = [[1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [-1.0, -1.0]];

fn rotor([x, y]: [f32; 2]) -> Rotor {
    Rotor { x, y, pushes_left: x * y > 0.0 }
}

proptest! {
    /// In any order of the vehicle's file, each motor drives the rotor in its corner.
    #[test]
    fn an_x_is_driven_by_its_corners(order in Just([0, 1, 2, 3]).prop_shuffle(), x in 0.2_f32..1.5, y in 0.2_f32..1.5) {
        let rotors = order.map(|at: usize| rotor([BETAFLIGHTS[at][0] * x, BETAFLIGHTS[at][1] * y]));
        for (numbering, places) in [(BETAFLIGHT, BETAFLIGHTS), (ARDUPILOT, ARDUPILOTS)] {
            let outputs: [usize; 6] = rotors_of_outputs(numbering, &Rotors::new(&rotors));
            for (output, [sign_x, sign_y]) in outputs.iter().zip(places) {
                prop_assert_eq!([rotors[*output].x, rotors[*output].y], [sign_x * x, sign_y * y]);
            }
            prop_assert!(outputs[4..].iter().all(|rotor| *rotor >= rotors.len()));
        }
    }
}

#[test]
fn another_frame_is_driven_by_number() {
    assert_eq!(rotors_of_outputs(BETAFLIGHT, &Rotors::new(&PLUS)), [0, 1, 2, 3]);
    // Three rotors are in one corner.
    let crowded = [[1.0, 1.0], [0.9, 0.9], [0.8, 0.8], [-1.0, -1.0]].map(rotor);
    assert_eq!(rotors_of_outputs(BETAFLIGHT, &Rotors::new(&crowded)), [0, 1, 2, 3]);
    // Six rotors: two at the sides, four in the corners of an X.
    let six = [[0.0, -1.0], [0.0, 1.0], [0.9, 0.5], [-0.9, -0.5], [0.9, -0.5], [-0.9, 0.5]].map(rotor);
    assert_eq!(rotors_of_outputs(ARDUPILOT, &Rotors::new(&six)), [0, 1, 2, 3, 4, 5]);
}
