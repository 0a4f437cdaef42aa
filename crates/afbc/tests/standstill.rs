//! Standing on the ground: detected from demanded thrust and motion, and without adaptation.
#![allow(clippy::unwrap_used, missing_docs)] // a controller that cannot be built must stop the test

use afbc::reference::ReferenceModel;
use afbc::standstill::{
    IN_AIR_S, LEFT_M, LIFT_SHARE, PUSHED_M_S2, SINKS_M_S, STILL_M_S, STILL_S, STOPPED_SHARE, StandstillDetector,
};
use afbc::{Adaptive, Controller, Profile, Settings};
use afbc_control::Smoothing;
use afbc_control::{FlightController, Validated};
use afbc_types::{Parameters, Setpoint, State};
use nalgebra::{Vector3, Vector4};
use proptest::prelude::*;

const DT_S: f32 = 0.001;
const WEIGHT_N: f32 = 4.77;
/// Velocity of a reference at rest and observed acceleration along z of a vehicle that nothing holds.
const STILL: [f32; 2] = [0.0, 0.0];

fn moving(velocity_m_s: Vector3<f32>) -> State {
    State { velocity_m_s, ..State::default() }
}

/// Returns whether a vehicle with these values for `steps` steps counts as standing.
fn stands(thrust_n: f32, velocity_m_s: Vector3<f32>, steps: usize) -> bool {
    let mut standstill = StandstillDetector::default();
    for _ in 0..steps {
        standstill.advance([thrust_n, WEIGHT_N], &moving(velocity_m_s), STILL, DT_S);
    }
    standstill.is_standing()
}

proptest! {
    #[test]
    fn only_a_still_vehicle_with_little_thrust_stands(
        share in 0.0_f32..2.0,
        x in -0.2_f32..0.2,
        y in -0.2_f32..0.2,
        z in -0.2_f32..0.2,
        steps in 0_usize..1000,
    ) {
        prop_assume!((steps as f32 * DT_S - STILL_S).abs() > 2.0 * DT_S);
        let still = [x, y, z].iter().all(|v| v.abs() < STILL_M_S);
        let expected = share * WEIGHT_N < LIFT_SHARE * WEIGHT_N && still && steps as f32 * DT_S > STILL_S;
        prop_assert_eq!(stands(share * WEIGHT_N, Vector3::new(x, y, z), steps), expected);
    }
}

#[test]
fn a_light_vehicle_that_hovers_does_not_stand_and_one_that_lifts_off_no_longer() {
    // This vehicle hovers with 60 % of the nominal weight as thrust.
    assert!(!stands(0.6 * WEIGHT_N, Vector3::zeros(), 10_000));
    let mut standstill = StandstillDetector::default();
    for _ in 0..1000 {
        standstill.advance([0.0, WEIGHT_N], &State::default(), STILL, DT_S);
    }
    assert!(standstill.is_standing());
    let mut rocking = standstill;
    rocking.advance([0.0, WEIGHT_N], &moving(Vector3::new(0.0, -0.49, 0.0)), STILL, DT_S);
    assert!(rocking.is_standing(), "it rocks");
    rocking.advance([0.0, WEIGHT_N], &moving(Vector3::new(0.0, 0.0, -0.51)), STILL, DT_S);
    standstill.advance([0.5 * WEIGHT_N, WEIGHT_N], &State::default(), STILL, DT_S);
    assert!(!standstill.is_standing() && !rocking.is_standing());
}

/// A vehicle stands on the ground with its setpoint below it, until the setpoint is raised.
#[test]
fn estimates_freeze_on_the_ground_and_thaw_on_lift() {
    let setpoint = |z| Setpoint { position_m: Vector3::new(0.3, 0.0, z), ..Setpoint::default() };
    let fly = |freeze_on_ground| {
        let mut settings = Settings { freeze_on_ground, ..Profile::Flight.settings() };
        (settings.reference, settings.smoothing) = (ReferenceModel::DEFAULT, Smoothing::DEFAULT);
        let law = Adaptive::new(Profile::Flight.gains()).unwrap();
        let controller = Controller::new(Parameters::PAPER.to_f32(), settings, law).unwrap();
        let mut memory = Validated::default();
        [(-1.0, 300, 0.0), (-1.0, 3000, 0.0), (1.0, 1, 0.0), (1.0, 100, 0.0), (1.0, 100, 0.06)].map(
            |(z, steps, up_m)| {
                let state = State { position_m: Vector3::z() * up_m, ..State::default() };
                for _ in 0..steps {
                    let _ = controller.step(&mut memory, Some(&state), &setpoint(z));
                }
                memory.control.estimates
            },
        )
    };
    let [stood, still_standing, asked, lifted, left] = fly(true);
    assert_eq!(stood, still_standing);
    // The step that first demands lift still counts as standing, and the next step does not.
    assert_eq!(asked, stood);
    assert!(lifted.z != stood.z && lifted.x == stood.x, "its feet still touch the ground");
    assert_ne!(left.x, stood.x);
    let [stood, still_standing, ..] = fly(false);
    assert_ne!(stood, still_standing, "nothing to freeze");
}

/// For any setpoint and tilt, no moment tips over a standing vehicle until it is to lift off.
#[test]
fn a_standing_vehicle_is_not_tipped_over() {
    let law = Adaptive::new(Profile::Flight.gains()).unwrap();
    let controller = Controller::new(Parameters::PAPER.to_f32(), Profile::Flight.settings(), law).unwrap();
    let state = State { attitude_rad: Vector3::new(0.1, -0.05, 0.3), ..State::default() };
    let mut memory = Validated::default();
    let mut forces = |z, steps| {
        let setpoint = Setpoint { position_m: Vector3::new(2.0, -1.0, z), ..Setpoint::default() };
        let mut forces = Vector4::zeros();
        for _ in 0..steps {
            forces = controller.step(&mut memory, Some(&state), &setpoint).forces.0;
        }
        forces
    };
    let spread = |forces: Vector4<f32>| forces.max() - forces.min();
    assert!(spread(forces(-0.4, 100)) > 0.1);
    assert_eq!(forces(-0.4, 200), Vector4::zeros());
    // The reference rises before the vehicle is to lift off.
    assert!(spread(forces(0.4, 400)) > 0.1);
}

/// A vehicle on the ground touches it until it has risen, climbs fast, or its rotors have carried it for long.
#[test]
fn a_vehicle_touches_the_ground_until_it_leaves_it() {
    let touches = |state: State, steps| {
        let mut standstill = StandstillDetector::default();
        assert!(!standstill.is_touching_ground(), "a law begins in the air");
        standstill.land();
        standstill.advance([WEIGHT_N, WEIGHT_N], &State::default(), STILL, DT_S);
        for _ in 0..steps {
            standstill.advance([WEIGHT_N, WEIGHT_N], &state, STILL, DT_S);
        }
        standstill.is_touching_ground()
    };
    let at = |x, z| State { position_m: Vector3::new(x, 0.0, z), ..State::default() };
    assert!(touches(at(3.0, 0.9 * LEFT_M), 100), "it slid");
    assert!(!touches(at(0.0, 1.1 * LEFT_M), 1));
    assert!(!touches(at(0.0, -1.1 * LEFT_M), 1));
    assert!(touches(moving(Vector3::new(0.0, 0.6, 0.0)), 100), "it slides");
    assert!(!touches(moving(Vector3::new(0.0, 0.0, 0.6)), 1));
    let carried_steps = (IN_AIR_S / DT_S) as usize;
    assert!(touches(at(0.0, 0.0), carried_steps - 100) && !touches(at(0.0, 0.0), carried_steps + 100));
}

/// The allowed tilt grows with the height, until the vehicle is high, falls, or its rotors have carried it for long.
#[test]
fn a_vehicle_that_has_just_risen_tilts_little() {
    let after = |z_m: f32, climb_m_s: f32, steps: u32| {
        let mut standstill = StandstillDetector::default();
        assert_eq!(standstill.tilt_max_tan(), f32::INFINITY, "a law begins in the air");
        standstill.land();
        standstill.advance([WEIGHT_N, WEIGHT_N], &State::default(), STILL, DT_S);
        let (position_m, velocity_m_s) = (Vector3::z() * z_m, Vector3::z() * climb_m_s);
        let state = State { position_m, velocity_m_s, ..State::default() };
        (0..steps).for_each(|_| standstill.advance([WEIGHT_N, WEIGHT_N], &state, STILL, DT_S));
        standstill.tilt_max_tan()
    };
    let standing = after(0.0, 0.0, 1);
    assert_eq!(after(0.9 * LEFT_M, 0.0, 1), standing);
    let mut least = standing;
    for z_m in [0.1, 0.2, 0.4, 0.8] {
        for climb_m_s in [0.0, 0.6] {
            let tan = after(z_m, climb_m_s, 1);
            assert!(tan > least - 1e-6 && (tan - standing - z_m).abs() < 1e-6, "{z_m} m: {tan}");
            least = tan;
        }
    }
    assert!(after(0.02, 0.6, 1) > standing, "it rises fast");
    for (z_m, climb_m_s, steps) in [(1.1, 0.0, 1), (0.3, -0.6, 1), (0.3, 0.0, (IN_AIR_S / DT_S) as u32 + 100)] {
        assert_eq!(after(z_m, climb_m_s, steps), f32::INFINITY, "{z_m} m, {climb_m_s} m/s");
    }
}

proptest! {
    /// A vehicle has met the ground if it stays behind its descent, needs little thrust, and something holds it.
    #[test]
    fn a_descent_that_something_stops_has_met_the_ground(
        share in -3.0_f32..2.0,
        sinks_m_s in -2.0_f32..1.0,
        followed in -1.0_f32..2.0,
        pushed_m_s2 in -10.0_f32..10.0,
    ) {
        let mut standstill = StandstillDetector::default();
        let state = moving(Vector3::z() * (followed * sinks_m_s));
        standstill.advance([share * WEIGHT_N, WEIGHT_N], &state, [sinks_m_s, pushed_m_s2], DT_S);
        let behind = state.velocity_m_s.z > STOPPED_SHARE * sinks_m_s;
        // A vehicle that climbs or falls this fast leaves the ground in the same step.
        let leaves = state.velocity_m_s.z.abs() > 0.5;
        let expected = share < LIFT_SHARE && sinks_m_s < -SINKS_M_S && behind && pushed_m_s2 > PUSHED_M_S2 && !leaves;
        prop_assert_eq!(standstill.is_touching_ground(), expected);
    }
}
