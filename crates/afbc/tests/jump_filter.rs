//! Compares the smoothed jerk and snap with the setpoint's derivatives and the filter in double precision.

use afbc::jump_filter::{JumpFilter, JumpMemory};
use afbc_types::Setpoint;
use nalgebra::Vector3;
use proptest::prelude::*;

const DT_S: f32 = 0.001;

/// Returns a setpoint with these derivatives of acceleration along x, y and z.
fn setpoint(a: Vector3<f32>, j: Vector3<f32>, s: Vector3<f32>) -> Setpoint {
    Setpoint { acceleration_m_s2: a, jerk_m_s3: j, snap_m_s4: s, ..Setpoint::default() }
}

/// Returns a, j and s along x for a jerk that jumps by `jump` at time 0, with the snap `s` after it.
fn corner(t: f32, jump: f32, snap: f32) -> [f32; 3] {
    [t * (jump + 0.5 * t * snap), jump + t * snap, snap]
}

#[test]
fn a_smooth_setpoint_is_followed_as_it_is() {
    let forward = JumpFilter::new(15.0, DT_S).unwrap();
    let (size, rate) = (4.0_f32, 3.0_f32);
    let mut followed: Option<JumpMemory> = None;
    for k in 0..5000_u16 {
        let angle = rate * f32::from(k) * DT_S;
        let (sine, cosine) = (angle.sin() * size, angle.cos() * size);
        let a = Vector3::new(sine, cosine, sine);
        let j = Vector3::new(cosine, -sine, cosine) * rate;
        let s = -a * (rate * rate);
        let [jerk, snap] = forward.advance(&mut followed, &setpoint(a, j, s));
        assert!((jerk - j).norm() < 0.01 * size * rate, "{k}: {jerk} {j}");
        assert!((snap - s).norm() < 0.02 * size * rate * rate, "{k}: {snap} {s}");
    }
}

#[test]
fn a_jump_of_the_jerk_is_followed_as_the_filter_says() {
    // The error e = x - x_f obeys d^2 e/dt^2 + 2 w de/dt + w^2 e = 0 from e = 0 and de/dt = jump, so e = jump t exp(-w
    // t).
    let (w, jump, snap) = (20.0_f32, 30.0_f32, -40.0_f32);
    let forward = JumpFilter::new(w, DT_S).unwrap();
    let mut followed = None;
    for _ in 0..10 {
        forward.advance(&mut followed, &Setpoint::default());
    }
    let mut turned = 0.0;
    for k in 0..600_u16 {
        let t = f32::from(k) * DT_S;
        let [a, j, s] = corner(t, jump, snap).map(|x| Vector3::new(x, -x, 2.0 * x));
        let [jerk, pulse] = forward.advance(&mut followed, &setpoint(a, j, s));
        let late = jump * (1.0 - w * t) * (-w * t).exp();
        let expected = j.x - late;
        assert!((jerk.x - expected).abs() < 0.03 * jump, "{t}: {} {expected}", jerk.x);
        assert!((jerk.y + jerk.x).abs() < 1e-3 * jump, "{t}: along y as along x");
        assert_eq!([jerk.z, pulse.z], [j.z, s.z], "{t}: z as it is");
        turned += pulse.x * DT_S;
        let along = jerk.x + pulse.x * DT_S;
        assert!((turned - along).abs() < 1e-2 * jump, "{t}: the snap is the derivative of the jerk");
    }
    // The whole jump is made up for in the end.
    assert!((turned - corner(0.6, jump, snap)[1]).abs() < 0.01 * jump, "{turned}");
}

proptest! {
    #[test]
    fn it_follows_any_setpoint_within_what_it_asks(
        bandwidth in 1.0_f32..1000.0,
        jumps in prop::collection::vec((-50.0_f32..50.0, -500.0_f32..500.0), 1..50),
    ) {
        let forward = JumpFilter::new(bandwidth, DT_S).unwrap();
        let mut followed = None;
        let most = 2.0 * 50.0 * bandwidth + 2.0 * 500.0;
        for (a, j) in jumps {
            let point = setpoint(Vector3::repeat(a), Vector3::repeat(j), Vector3::zeros());
            for _ in 0..20 {
                let [jerk, snap] = forward.advance(&mut followed, &point);
                prop_assert!(jerk.x.abs() <= 2.0 * most && snap.x.is_finite(), "{jerk} {snap}");
            }
        }
    }
}
