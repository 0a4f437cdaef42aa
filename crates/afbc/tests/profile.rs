//! Checks the profiles: the paper's numbers, the rules for `flight`, and that every profile is valid.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, missing_docs)] // a failed construction must stop the test

use afbc::adaptive::Gains;
use afbc::fuzzy::Membership;
use afbc::monitor::MonitorBounds;
use afbc::{
    Adaptive, Backstepping, Controller, Guarded, LAG_S, PositionControlLimits, Profile, Safeguards, Settings, by_rule,
    slowness,
};
use afbc_types::{Axis, Declared, Parameters, PerAxis};
use nalgebra::Vector3;
use proptest::prelude::*;

/// The profile has the numbers of section IV: alpha_1, alpha_2, gamma and eta of z and of the other five subsystems,
/// and the Gaussians of attitude and position.
#[test]
fn the_printed_gains_are_those_of_section_iv() {
    let gains = Profile::Paper.gains();
    for axis in Axis::ALL {
        let Gains { backstepping, gamma, eta, epsilon, membership, safeguards } = gains[axis];
        let wanted = if axis == Axis::Z { [3.0, 6.0, 2.8, 0.9] } else { [1.0, 2.0, 1.2, 0.3] };
        assert_eq!([backstepping.alpha1, backstepping.alpha2, gamma, eta], wanted, "{axis:?}");
        let position = matches!(axis, Axis::X | Axis::Y | Axis::Z);
        let (centre, width) = if position { (10.0, 4.0) } else { (0.26, 0.1) };
        assert_eq!(membership, Membership { centre, width }, "{axis:?}");
        assert_eq!((epsilon, backstepping.stiffness, safeguards), (0.001, 1.0, Safeguards::NONE), "{axis:?}");
    }
    // The paper's profile has nothing that is not in the paper.
    let Settings { limits, tilt_by_thrust, anti_windup, freeze_on_ground, bumpless, feed_forward, .. } =
        Profile::Paper.settings();
    assert_eq!(limits, PositionControlLimits::NONE);
    assert!(!(tilt_by_thrust || anti_windup || freeze_on_ground || bumpless || feed_forward));
    assert_eq!(Profile::Paper.settings_for(2.0, 0.1), Profile::Paper.settings());
}

/// Scenario files and logs use these names.
#[test]
fn every_profile_has_its_name() {
    assert_eq!(Profile::ALL.map(Profile::name), ["paper", "flight"]);
}

/// Near zero the robust term has the gain delta_hat/epsilon. Times g of the input, it is half of the limit for a loop
/// with the response times of `docs/flight.md`.
#[test]
fn the_robust_term_leaves_half_of_the_limit() {
    let gains = Profile::Flight.gains();
    let (mass, inertia, arm, drag) = (0.486, [0.0038, 0.0038, 0.0076], 0.25, 3.232e-7 / 2.984e-5);
    let g = PerAxis {
        roll: arm / inertia[0],
        pitch: arm / inertia[1],
        yaw: drag / inertia[2],
        z: 1.0 / mass,
        x: 1.0,
        y: 1.0,
    };
    let response_s = PerAxis { roll: 0.08, pitch: 0.08, yaw: 0.041, z: 0.041, x: 0.12, y: 0.12 };
    for axis in Axis::ALL {
        let of = gains[axis];
        let gain: f32 = g[axis] * of.safeguards.delta_max / of.epsilon;
        assert!((gain * response_s[axis] - 0.5).abs() < 1e-4, "{axis:?}: {gain} 1/s");
        assert!((Profile::flight_epsilon(axis, 2.0 * of.safeguards.delta_max) / of.epsilon - 2.0).abs() < 1e-6);
    }
}

/// The profile is as slow as the rotors, but never faster than the rotors for which it is tuned.
#[test]
fn slowness_is_the_delay_over_that_of_the_papers_vehicle() {
    assert_eq!([0.0, 0.5, 1.0].map(|share| slowness(share * LAG_S)), [1.0; 3]);
    // Of the 50 ms of delay, 30 are not the rotors'.
    assert!([1.5_f32, 2.0, 7.0].iter().all(|k| (slowness(k * 0.05 - 0.03) - k).abs() < 1e-6));
}

proptest! {
    /// For every vehicle, an input's effect times its gains equals that of the paper's vehicle, so the errors follow
    /// the same curve, only slower. Gains in metres and radians stay.
    #[test]
    fn by_rule_every_vehicle_behaves_as_the_papers(
        mass_kg in 0.1_f32..20.0, arm_m in 0.05_f32..1.0, inertia in prop::array::uniform3(1e-4_f32..1.0),
        drag in 1e-8_f32..1e-6, lag_s in 0.0_f32..0.1,
    ) {
        let paper = Parameters::PAPER.to_f32();
        let inertia_kg_m2 = Vector3::from(inertia);
        let vehicle = Parameters { mass_kg, arm_m, inertia_kg_m2, drag_factor_n_m_s2: drag, ..paper };
        let k = ((lag_s + 0.03) / 0.05).max(1.0);
        for (profile, k) in [(Profile::Flight, k), (Profile::Paper, 1.0)] {
            let (base, gains) = (profile.gains(), profile.gains_for(&vehicle, lag_s));
            prop_assert_eq!(by_rule(&base, &vehicle, if k > 1.0 { lag_s } else { 0.0 }), gains);
            for (index, axis) in Axis::ALL.into_iter().enumerate() {
                let g = |of: &Parameters| match axis {
                    Axis::Roll | Axis::Pitch => of.arm_m / of.inertia_kg_m2.as_slice()[index],
                    Axis::Yaw => of.drag_factor_n_m_s2 / of.thrust_factor_n_s2 / of.inertia_kg_m2.z,
                    Axis::Z => 1.0 / of.mass_kg,
                    Axis::X | Axis::Y => 1.0,
                };
                let (own, of) = (&gains[axis], &base[axis]);
                let effect = g(&vehicle) / g(&paper);
                let near = |a: f32, b: f32| (a - b).abs() <= 1e-5 * b.abs();
                prop_assert!(near(effect * own.backstepping.alpha2 * k, of.backstepping.alpha2), "{axis:?}");
                prop_assert!(near(own.backstepping.alpha1 * k, of.backstepping.alpha1), "{axis:?}");
                prop_assert!(near(own.backstepping.stiffness * k * k, of.backstepping.stiffness), "{axis:?}");
                prop_assert!(near(effect * own.gamma * k * k, of.gamma), "{axis:?}");
                prop_assert!(near(effect * own.eta * k * k, of.eta), "{axis:?}");
                // The bounds fit a disturbance in proportion to the vehicle, within the accepted range.
                let bound = |own: f32, of: f32| near(own, (of / effect).min(1e6));
                prop_assert!(bound(own.safeguards.theta_max, of.safeguards.theta_max), "{axis:?}");
                prop_assert!(bound(own.safeguards.delta_max, of.safeguards.delta_max), "{axis:?}");
                prop_assert!(near(own.epsilon, of.epsilon * k) && near(own.safeguards.sigma * k, of.safeguards.sigma));
                prop_assert_eq!(own.membership, of.membership);
            }
        }
    }
}

/// Every profile builds every law of the crate, at the paper's lag and at a slower one.
#[test]
fn every_profile_is_valid() {
    let vehicle = Parameters::PAPER.to_f32();
    for profile in Profile::ALL {
        for lag_s in [LAG_S, 2.0 * LAG_S] {
            let (gains, settings) = (profile.gains_for(&vehicle, lag_s), profile.settings_for(3.0, lag_s));
            assert!(settings.validate().is_ok());
            let law = Adaptive::new(gains).unwrap();
            assert!(Controller::<_, 4>::new(vehicle, settings, law).is_ok());
            let law = Backstepping::new(&vehicle, gains.map(|gains| gains.backstepping)).unwrap();
            assert!(Controller::<_, 4>::new(vehicle, settings, law).is_ok());
            let bounds = MonitorBounds::new(&gains, &vehicle, &settings);
            assert!(Guarded::<4>::new(vehicle, settings, gains, bounds).is_ok(), "{} {lag_s}", profile.name());
        }
    }
}
