//! Tests the drag that a law knows. Its part of the thrust's derivatives is compared with finite differences. Its
//! moment is compared with the moment of a force above the centre of mass.

use afbc_control::drag::KnownDrag;
use nalgebra::{Unit, Vector3};
use proptest::prelude::*;

const GRAVITY: f64 = 9.81;

fn vector(size: f32) -> impl Strategy<Value = Vector3<f32>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn drag() -> impl Strategy<Value = KnownDrag> {
    (0.0_f32..0.7, 0.0_f32..0.05, -0.05_f32..0.05).prop_map(|(rotor_drag_1_s, body_drag_1_m, rotor_height_m)| {
        KnownDrag { rotor_drag_1_s, body_drag_1_m, rotor_height_m }
    })
}

proptest! {
    /// Drag removes energy at any attitude, and blade drag acts in the rotor plane.
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

/// Compares the jerk and snap of the thrust on 2,000 paths with finite differences of the needed thrust, in double
/// precision. Jerk and snap must contain nearly all that drag adds. The snap is compared without its part along the
/// thrust, because that part does not turn the vehicle.
#[test]
fn jerk_and_snap_are_those_of_the_thrust_on_the_path() {
    let mut seed = 1_u64;
    let mut uniform = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f64 / f64::from(1 << 24)
    };
    let mut added = [0.0, 0.0];
    let mut missed = [0.0, 0.0];
    for _ in 0..2000 {
        let (rotors, body) = (0.7 * uniform(), 0.05 * uniform());
        let drag = KnownDrag { rotor_drag_1_s: rotors as f32, body_drag_1_m: body as f32, rotor_height_m: 0.0 };
        let [v, a, jerk, snap] =
            [8.0, 4.0, 6.0, 20.0].map(|size| Vector3::from_fn(|_, _| size * (2.0 * uniform() - 1.0)));
        // Thrust and drag determine each other: iterate.
        let thrust = |t: f64| {
            let v = v + a * t + jerk * (t * t / 2.0) + snap * (t * t * t / 6.0);
            let free = a + jerk * t + snap * (t * t / 2.0) + Vector3::z() * GRAVITY + v * (body * v.norm());
            (0..60).fold(free, |f, _| {
                let up = f.normalize();
                free + (v - up * up.dot(&v)) * (rotors * (f.norm() / GRAVITY).sqrt())
            })
        };
        let (f, h) = (thrust(0.0), 1e-3);
        let exact = [(thrust(h) - thrust(-h)) / (2.0 * h), (thrust(h) + thrust(-h) - f * 2.0) / (h * h)];
        let up = f.normalize();
        let share = [(f.norm() / GRAVITY) as f32, f.norm() as f32];
        let found = drag.followed(&v.cast(), &up.cast(), share, [&a.cast(), &jerk.cast(), &snap.cast()]);
        let [first, second] = found.map(|found| found.cast::<f64>());
        let across = |of: Vector3<f64>| (of - up * up.dot(&of)).norm();
        added[0] += (exact[0] - jerk).norm();
        missed[0] += (first - exact[0]).norm();
        added[1] += across(exact[1] - snap);
        missed[1] += across(second - exact[1]);
    }
    let [first, second] = [missed[0] / added[0], missed[1] / added[1]];
    assert!(first < 0.02, "{first}");
    assert!(second < 0.25, "{second}");
}
