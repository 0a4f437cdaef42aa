#![allow(clippy::indexing_slicing, reason = "tests")]

extern crate std;
use super::*;
use afbc_types::Declared;
use proptest::prelude::*;

/// Values computed by hand from PX4's formulae (src/lib/mathlib/math/Functions.hpp): `expo(x, e) = (1 - e) x + e x^3`,
/// `deadzone(x, d) = (x - sign(x) d) / (1 - d)` outside the dead zone, `superexpo(x, e, g) = expo(x, e) (1 - g) / (1 -
/// |x| g)`.
#[test]
fn values_by_hand() {
    let near = |found: f32, expected: f32| assert!((found - expected).abs() < 1e-6, "{found}, not {expected}");
    // 0.4 * 0.5 + 0.6 * 0.125.
    near(expo(0.5, 0.6), 0.275);
    near(expo(-0.5, 0.6), -0.275);
    // (0.55 - 0.1) / 0.9 = 0.5.
    near(expo_dead_zone(0.55, 0.6, 0.1), 0.275);
    near(expo_dead_zone(-0.55, 0.6, 0.1), -0.275);
    near(expo_dead_zone(0.1, 0.6, 0.1), 0.0);
    near(expo_dead_zone(-0.09, 0.0, 0.1), 0.0);
    // expo(0.5, 0.69) = 0.155 + 0.08625 = 0.24125; times 0.3 / 0.65.
    near(super_expo(0.5, 0.69, 0.7), 0.111_346_15);
    near(super_expo(-0.5, 0.69, 0.7), -0.111_346_15);
    near(super_expo(0.8, 0.0, 0.95), 0.04 / 0.24);
    // A dead zone of 1 is limited to 0.99.
    near(expo_dead_zone(1.0, 0.0, 1.0), 1.0);
}

/// Tests every mode with four different stick deflections, so that swapped sticks are noticed.
#[test]
fn every_mode_has_its_curves() {
    let curves = StickCurves {
        horizontal_expo: 0.2,
        vertical_expo: 0.4,
        yaw_expo: 0.8,
        dead_zone: 0.2,
        acro_expo: 0.3,
        acro_yaw_expo: 0.5,
        acro_super_expo: 0.6,
        acro_yaw_super_expo: 0.9,
    };
    let sticks = Sticks { roll: 0.4, pitch: -0.6, throttle: 0.8, yaw: -0.7 };
    // Deflections beyond the dead zone, computed as (0.4 - 0.2) / 0.8 = 0.25. In the same way, the others are 0.5, 0.75
    // and 0.625.
    let [roll, pitch] = [0.25f32, -0.5].map(|way| 0.8 * way + 0.2 * way * way * way);
    let (throttle, yaw) = (0.6 * 0.75 + 0.4 * 0.421_875, -(0.2 * 0.625 + 0.8 * 0.244_140_63));
    let position = Sticks { roll, pitch, throttle, yaw };
    let altitude = Sticks { throttle, yaw, ..sticks };
    let acro = Sticks {
        roll: (0.7 * 0.4 + 0.3 * 0.064) * 0.4 / (1.0 - 0.24),
        pitch: -(0.7 * 0.6 + 0.3 * 0.216) * 0.4 / (1.0 - 0.36),
        throttle: 0.8,
        yaw: -(0.5 * 0.7 + 0.5 * 0.343) * 0.1 / (1.0 - 0.63),
    };
    for mode in FlightMode::ALL {
        let expected = match mode {
            FlightMode::Position => position,
            FlightMode::Altitude => altitude,
            FlightMode::Acro => acro,
            _ => sticks,
        };
        let shaped = curves.shape(mode, &sticks);
        let numbers = |it: Sticks| [it.roll, it.pitch, it.throttle, it.yaw];
        for (found, expected) in numbers(shaped).into_iter().zip(numbers(expected)) {
            assert!((found - expected).abs() < 1e-6, "{mode:?}: {shaped:?}");
        }
    }
}

proptest! {
    /// Every curve is odd, never decreases, reaches both ends and never exceeds the deflection itself.
    #[test]
    fn curves_lead_from_end_to_end(
        [share, bend, dead_zone] in prop::array::uniform3(0.0f32..=0.95),
        ways in prop::collection::vec(-1.0f32..=1.0, 2..20),
    ) {
        let curves: [&dyn Fn(f32) -> f32; 3] =
            [&|x| expo(x, share), &|x| expo_dead_zone(x, share, dead_zone), &|x| super_expo(x, share, bend)];
        let mut ways = ways;
        ways.sort_by(f32::total_cmp);
        for curve in curves {
            prop_assert!((curve(1.0) - 1.0).abs() < 1e-5 && (curve(-1.0) + 1.0).abs() < 1e-5 && curve(0.0) == 0.0);
            for pair in ways.windows(2) {
                let [low, high] = [curve(pair[0]), curve(pair[1])];
                prop_assert!(low <= high + 1e-6 && high.abs() <= 1.0 + 1e-6);
                prop_assert_eq!(curve(-pair[0]), -low);
                prop_assert!(low.abs() <= pair[0].abs() + 1e-6);
            }
        }
    }
}

#[test]
fn defaults_are_in_range() {
    assert_eq!(StickCurves::DEFAULT.validate(), Ok(()));
}
