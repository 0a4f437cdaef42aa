//! Vehicles of other sizes: each hovers under every law of the profile `flight`, or is refused by name.

use afbc::{Guarded, Profile};
use afbc_plant::Environment;
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::{Scenario, built_in};
use afbc_sim::flight::fly;
use afbc_types::{Axis, Parameters};
use nalgebra::Vector3;
use proptest::prelude::*;

/// Returns the hover scenario for this vehicle, with a rotor lag of 20 ms, this largest force per rotor, and an initial
/// error.
fn scenario(vehicle: Parameters<f64>, force_max_n: f64) -> Scenario {
    let hardware = built_in("hardware").unwrap().read().unwrap();
    let mut scenario = built_in("hover").unwrap().read().unwrap();
    scenario.vehicle = vehicle;
    scenario.environment = Environment::calm(vehicle).unwrap();
    scenario.duration_s = 6.0;
    scenario.realism.rotors = hardware.realism.rotors;
    scenario.realism.rotors.max_rad_s = (force_max_n / vehicle.thrust_factor_n_s2).sqrt();
    scenario.initial.position_m += Vector3::new(0.1, -0.1, 0.05);
    scenario
}

/// Flies the vehicle with rotors of `margin` times the hover force. Returns the final distance \[m\], or the reason of
/// a refusal.
fn hovers(kind: ControllerKind, vehicle: Parameters<f64>, margin: f64) -> Result<f64, String> {
    let force_max_n = margin * vehicle.mass_kg * vehicle.gravity_m_s2 / 4.0;
    let scenario = scenario(vehicle, force_max_n);
    let settings = Profile::Flight.settings().with_rotor_force_max_n(force_max_n as f32);
    let mut contender = Contender::of(kind, Profile::Flight).for_vehicle(&vehicle).monitored();
    contender.settings = settings;
    contender.check(&vehicle, &scenario.rotors).map_err(|error| error.to_string())?;
    let (mut distance_m, mut trip) = (f64::NAN, None);
    let lost = fly(&scenario, &contender, |sample| {
        distance_m = (sample.motion.position_m - sample.reference.position_m).norm();
        trip = trip.or(sample.action.health.fallback);
    });
    assert_eq!((lost.unwrap(), trip), (None, None), "{} {vehicle:?}", kind.name());
    Ok(distance_m)
}

/// Returns a vehicle of this mass and size. `spread` sets the share of the mass at the rotors.
fn vehicle(mass_kg: f64, arm_m: f64, spread: f64) -> Parameters<f64> {
    let inertia = spread * mass_kg * arm_m * arm_m;
    Parameters {
        mass_kg,
        arm_m,
        inertia_kg_m2: Vector3::new(inertia, inertia, 1.8 * inertia),
        rotor_inertia_kg_m2: 0.0,
        thrust_factor_n_s2: mass_kg * 6e-5,
        drag_factor_n_m_s2: mass_kg * 6e-5 * 0.02,
        gravity_m_s2: 9.81,
    }
}

#[test]
fn every_law_hovers_vehicles_from_50_g_to_3_kg() {
    for (mass_kg, arm_m, spread) in
        [(0.05, 0.05, 0.2), (0.25, 0.1, 0.1), (0.7, 0.15, 0.15), (1.5, 0.25, 0.15), (3.0, 0.35, 0.1)]
    {
        for kind in ControllerKind::ALL {
            let distance_m = hovers(kind, vehicle(mass_kg, arm_m, spread), 2.0).unwrap();
            println!("{mass_kg} kg, {}: {distance_m:.4} m", kind.name());
            assert!(distance_m < 0.02, "{mass_kg} kg, {}: {distance_m} m", kind.name());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    /// Every vehicle hovers or is refused by name.
    #[test]
    fn what_is_not_refused_hovers(
        mass_kg in 0.05..3.5_f64,
        arm_m in 0.05..0.4_f64,
        spread in 0.05..0.4_f64,
        margin in 0.8..3.0_f64,
    ) {
        let vehicle = vehicle(mass_kg, arm_m, spread);
        let hover_n = mass_kg * 9.81 / 4.0;
        let authority = 2.0 * hover_n * (margin - 1.0).min(1.0) * arm_m / vehicle.inertia_kg_m2.x;
        match hovers(ControllerKind::Afbc, vehicle, margin) {
            Ok(distance_m) => prop_assert!(margin > 1.299 && authority > 79.9 && distance_m < 0.03, "{distance_m} m"),
            Err(error) if error.contains("rotor_force_max_n") => prop_assert!(margin < 1.301, "{error}"),
            Err(error) if error.contains("hover_authority_rad_s2") => prop_assert!(authority < 80.1, "{error}"),
            // For the heaviest vehicles, the yaw gain would be out of range.
            Err(error) => prop_assert!(error.contains("gamma") && vehicle.inertia_kg_m2.z > 0.1, "{error}"),
        }
    }
}

/// The property test above found these vehicles before they were refused: the first stayed 0.2 m away, the others
/// tripped.
#[test]
fn vehicles_that_turn_too_slowly_are_refused() {
    for (mass_kg, arm_m, spread, margin) in [
        (0.05, 0.27007604335499685, 0.33430256387679064, 2.6746),
        (1.3242, 0.3279, 0.3241, 2.0),
        (0.05, 0.3279, 0.3241, 2.0),
    ] {
        let error = hovers(ControllerKind::Afbc, vehicle(mass_kg, arm_m, spread), margin).unwrap_err();
        assert!(error.contains("hover_authority_rad_s2"), "{error}");
    }
}

/// `Guarded` of the profile `flight` does not trip in an ideal hover, at any weight of the vehicle.
#[test]
fn a_perfect_hover_does_not_trip() {
    use afbc_control::FlightController;
    for mass_kg in [0.3, 0.486, 0.8, 0.97, 1.3, 2.0, 3.5] {
        let vehicle = Parameters { mass_kg, ..Parameters::PAPER.to_f32() };
        let settings = Profile::Flight.settings().with_rotor_force_max_n(mass_kg * 6.0);
        let gains = Profile::Flight.gains_for(&vehicle, afbc::LAG_S);
        let guarded =
            Guarded::new(vehicle, settings, gains, afbc::monitor::MonitorBounds::new(&gains, &vehicle, &settings))
                .unwrap();
        let mut memory = afbc_control::Validated::default();
        for _ in 0..5_000 {
            let command =
                guarded.step(&mut memory, Some(&afbc_types::State::default()), &afbc_types::Setpoint::default());
            assert_eq!(command.health.fallback, None, "{mass_kg} kg");
        }
        let learnt = memory.control.estimates();
        assert!(Axis::ALL.iter().all(|axis| learnt[*axis].theta.norm().is_finite()));
    }
}
