//! Known drag: its change is the derivative of its acceleration, and its moment that of a force above the centre of
//! mass.
#![allow(missing_docs)]

use afbc_control::drag::KnownDrag;
use nalgebra::{Unit, Vector3};
use proptest::prelude::*;

fn vector(size: f32) -> impl Strategy<Value = Vector3<f32>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn drag() -> impl Strategy<Value = KnownDrag> {
    (0.0_f32..0.7, 0.0_f32..0.05, -0.05_f32..0.05).prop_map(|(rotor_drag_1_s, body_drag_1_m, rotor_height_m)| {
        KnownDrag { rotor_drag_1_s, body_drag_1_m, rotor_height_m }
    })
}

proptest! {
    #[test]
    fn change_is_the_derivative_of_the_acceleration(
        drag in drag(), v in vector(8.0), by in vector(10.0), up in vector(1.0), share in 0.3_f32..2.0,
    ) {
        prop_assume!(up.norm() > 0.1 && v.norm() > 0.5);
        let up = Unit::new_normalize(up).into_inner();
        let at = |t: f32| drag.acceleration(&(v + by * t), &up, share);
        let change = (at(0.01) - at(-0.01)) / 0.02;
        let found = drag.change(&v, &up, share, &by);
        prop_assert!((found - change).norm() < 0.02 + 0.01 * change.norm(), "{found:?}, not {change:?}");
    }

    /// It takes energy, whatever the attitude, and the share of the blades acts in the plane of the rotors.
    #[test]
    fn it_slows_down(drag in drag(), v in vector(8.0), up in vector(1.0), share in 0.0_f32..2.0) {
        prop_assume!(up.norm() > 0.1);
        let up = Unit::new_normalize(up).into_inner();
        prop_assert!(drag.acceleration(&v, &up, share).dot(&v) <= 1e-4);
        let blades = KnownDrag { body_drag_1_m: 0.0, ..drag }.acceleration(&v, &up, share);
        prop_assert!(blades.dot(&up).abs() < 1e-4);
    }

    #[test]
    fn its_moment_is_that_of_the_blades_force(drag in drag(), v in vector(8.0), share in 0.0_f32..2.0) {
        let blades = KnownDrag { body_drag_1_m: 0.0, ..drag }.acceleration(&v, &Vector3::z(), share);
        let moment = Vector3::new(0.0, 0.0, drag.rotor_height_m).cross(&blades);
        prop_assert!((drag.moment(&v, share) - moment).norm() < 1e-5);
    }
}
