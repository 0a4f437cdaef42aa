//! Tests which states and setpoints are plausible, one number at a time.
#![allow(clippy::indexing_slicing, missing_docs)] // tests

use afbc_types::{Setpoint, State};
use proptest::prelude::*;

/// Largest documented sizes, in the order of the fields.
const STATE_MAX: [f32; 12] = [1e5, 1e5, 1e5, 1e3, 1e3, 1e3, 1e3, 1e3, 1e3, 1e3, 1e3, 1e3];
const SETPOINT_MAX: [f32; 18] =
    [1e5, 1e5, 1e5, 1e3, 1e3, 1e3, 1e3, 1e3, 1e3, 1e5, 1e5, 1e5, 1e7, 1e7, 1e7, 1e3, 1e3, 1e3];

fn state(numbers: [f32; 12]) -> State {
    let [x, y, z, u, v, w, roll, pitch, yaw, p, q, r] = numbers;
    State {
        position_m: [x, y, z].into(),
        velocity_m_s: [u, v, w].into(),
        attitude_rad: [roll, pitch, yaw].into(),
        rates_rad_s: [p, q, r].into(),
    }
}

fn setpoint(numbers: [f32; 18]) -> Setpoint {
    let [x, y, z, u, v, w, ax, ay, az, jx, jy, jz, sx, sy, sz, yaw, yaw_rate, yaw_acceleration] = numbers;
    Setpoint {
        position_m: [x, y, z].into(),
        velocity_m_s: [u, v, w].into(),
        acceleration_m_s2: [ax, ay, az].into(),
        jerk_m_s3: [jx, jy, jz].into(),
        snap_m_s4: [sx, sy, sz].into(),
        yaw_rad: yaw,
        yaw_rate_rad_s: yaw_rate,
        yaw_acceleration_rad_s2: yaw_acceleration,
    }
}

/// Any number, often at a bound or just beyond it.
fn number() -> impl Strategy<Value = f32> {
    let edges: Vec<f32> =
        [1e3_f32, 1e5, 1e7].into_iter().flat_map(|most| [most, most.next_up(), -most, most.next_down()]).collect();
    prop_oneof![any::<f32>(), -2e3_f32..2e3, proptest::sample::select(edges)]
}

proptest! {
    /// A state or setpoint is plausible if every number is finite and within its bound, bounds included.
    #[test]
    fn every_number_within_its_bound(numbers in prop::array::uniform18(number())) {
        let within = |numbers: &[f32], most: &[f32]| numbers.iter().zip(most).all(|(x, most)| x.abs() <= *most);
        prop_assert_eq!(setpoint(numbers).is_plausible(), within(&numbers, &SETPOINT_MAX));
        let first = core::array::from_fn(|i| numbers[i]);
        prop_assert_eq!(state(first).is_plausible(), within(&first, &STATE_MAX));
    }

    /// One number decides, with all others at their bounds.
    #[test]
    fn one_number_is_enough(place in 0_usize..18, number in number(), signs in prop::array::uniform18(any::<bool>())) {
        let mut numbers = core::array::from_fn(|i| if signs[i] { SETPOINT_MAX[i] } else { -SETPOINT_MAX[i] });
        prop_assert!(setpoint(numbers).is_plausible());
        numbers[place] = number;
        prop_assert_eq!(setpoint(numbers).is_plausible(), number.abs() <= SETPOINT_MAX[place]);
        let mut numbers = core::array::from_fn(|i| if signs[i] { STATE_MAX[i] } else { -STATE_MAX[i] });
        prop_assert!(state(numbers).is_plausible());
        let place = place % 12;
        numbers[place] = number;
        prop_assert_eq!(state(numbers).is_plausible(), number.abs() <= STATE_MAX[place]);
    }
}
