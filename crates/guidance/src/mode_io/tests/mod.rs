//! Tests of the modes' outputs for given inputs, with every threshold on both sides. The crate's `tests` folder flies
//! the modes.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

mod courses;
mod directed;
mod missions;

use super::*;
use crate::available_thrust::AvailableThrust;
use crate::course::{Hold, Land, Return, Takeoff};
use crate::failsafe::FailsafeSettings;
use crate::mission::MissionMemory;
use crate::mode::FlightMode;
use crate::offboard::{self, OffboardMemory};
use crate::order::{AttitudeTarget, Item, MotionTarget, OffboardTarget, OrderRefusal, RequestedItem, Sticks};
use crate::{mission, sticks};
use afbc_flight_core::Stamped;
use nalgebra::{Rotation3, UnitQuaternion};
use proptest::prelude::*;

const NAN: Vector3<f32> = Vector3::new(f32::NAN, f32::NAN, f32::NAN);
const LIFT: AvailableThrust = AvailableThrust { most_m_s2: 25.0, gravity_m_s2: 9.81, given_m_s2: None };

/// Limits and speeds that all differ from one another.
fn limits() -> MotionLimits {
    MotionLimits { speed_m_s: 9.0, up_m_s: 3.0, down_m_s: 2.0, yaw_rate_rad_s: 1.5, ..MotionLimits::DEFAULT }
}

fn flying() -> FlightModeSettings {
    FlightModeSettings {
        cruise_m_s: 4.0,
        takeoff_m_s: 1.2,
        stick_tilt_rad: 0.6,
        within_m: 0.7,
        ..FlightModeSettings::DEFAULT
    }
}

/// Inputs of a mode: a vehicle and its setpoint in the air.
#[derive(Clone, Copy, Debug)]
struct Stage {
    state: State,
    present: Setpoint,
    airborne: bool,
    home_m: Vector3<f32>,
    speed_m_s: f32,
    ceiling_m: f32,
}

impl Stage {
    /// Returns a stage with vehicle and setpoint at the same place, and with different headings.
    fn at(position_m: Vector3<f32>) -> Self {
        let mut state = State { position_m, ..State::default() };
        state.attitude_rad = Vector3::new(0.1, -0.2, 0.8);
        let present = Setpoint { position_m, yaw_rad: 1.1, ..Setpoint::default() };
        let home_m = Vector3::new(1.0, 2.0, 0.5);
        Stage { state, present, airborne: true, home_m, speed_m_s: f32::INFINITY, ceiling_m: f32::INFINITY }
    }

    fn moving(self, velocity_m_s: Vector3<f32>) -> Self {
        Stage { present: Setpoint { velocity_m_s, ..self.present }, ..self }
    }

    /// Moves the setpoint away from the vehicle.
    fn apart(self, by_m: Vector3<f32>) -> Self {
        Stage { present: Setpoint { position_m: self.state.position_m + by_m, ..self.present }, ..self }
    }

    fn see<T>(&self, look: impl FnOnce(&ModeInputs<'_>) -> T) -> T {
        let (flying, limits) = (flying(), limits());
        look(&ModeInputs {
            flying: &flying,
            limits: &limits,
            dt_s: 1e-3,
            state: &self.state,
            present: &self.present,
            airborne: self.airborne,
            home_m: self.home_m,
            speed_m_s: self.speed_m_s,
            ceiling_m: self.ceiling_m,
        })
    }
}

fn here() -> Vector3<f32> {
    Vector3::new(10.0, -5.0, 8.0)
}

fn along(axis: usize, size: f32) -> Vector3<f32> {
    Vector3::from_fn(|row, _| if row == axis { size } else { 0.0 })
}

/// True if both are equal, NaN included.
fn same(a: &Vector3<f32>, b: &Vector3<f32>) -> bool {
    a.iter().zip(b.iter()).all(|(a, b)| a == b || a.is_nan() && b.is_nan())
}

fn limited(output: &ModeOutput) -> LimiterTarget {
    let Shaping::Limited(aim) = output.shaping else { panic!("{output:?}") };
    aim
}

#[test]
fn the_usual_speed_is_the_cruise_or_what_was_ordered() {
    for (speed_m_s, expected) in [(f32::INFINITY, 4.0), (2.0, 2.0), (6.0, 4.0)] {
        let aim = Stage { speed_m_s, ..Stage::at(here()) }.see(|inputs| inputs.stop());
        assert_eq!((aim.speed_m_s, aim.up_m_s, aim.down_m_s), (expected, 3.0, 2.0));
        assert!(same(&aim.position_m, &NAN) && same(&aim.velocity_m_s, &NAN) && aim.yaw_rad.is_nan());
        let to = Stage { speed_m_s, ..Stage::at(here()) }.see(|inputs| inputs.to(Vector3::new(1.0, 2.0, 3.0)));
        assert_eq!((to.position_m, to.speed_m_s), (Vector3::new(1.0, 2.0, 3.0), expected));
    }
}

/// The sink rate is the landing speed below a height above home, the largest at twice that height, and linear in
/// between.
#[test]
fn it_descends_the_slower_the_lower() {
    let FlightModeSettings { land_m_s, land_slow_m, .. } = flying();
    let sinks = |above_m: f32| {
        let place = Vector3::new(10.0, -5.0, 0.5 + above_m);
        let aim = Stage::at(place).see(|inputs| inputs.down(Vector3::new(3.0, 4.0, 99.0)));
        assert!(same(&aim.position_m, &Vector3::new(3.0, 4.0, f32::NAN)));
        assert!(aim.velocity_m_s.x.is_nan() && aim.velocity_m_s.y.is_nan());
        -aim.velocity_m_s.z
    };
    let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-4, "{a}, not {b}");
    for (height, share) in [(0.0, 0.0), (0.9, 0.0), (1.0, 0.0), (1.25, 0.25), (1.8, 0.8), (2.0, 1.0), (9.0, 1.0)] {
        close(sinks(height * land_slow_m), land_m_s + (2.0 - land_m_s) * share);
    }
}

#[test]
fn a_heading_is_towards_a_place_that_is_not_near() {
    let towards = |x: f32, y: f32, z: f32| {
        Stage::at(here())
            .apart(Vector3::new(0.3, 0.4, 0.0))
            .see(|inputs| inputs.towards(&(inputs.present.position_m + Vector3::new(x, y, z))))
    };
    for (x, y) in [(3.0, 4.0), (-3.0, 4.0), (0.8, -0.8), (-9.0, -1.0)] {
        assert!((towards(x, y, 5.0) - f32::atan2(y, x)).abs() < 1e-5, "{x}, {y}");
    }
    assert!(towards(0.7, 0.7, 5.0).is_nan() && towards(0.0, 0.0, 9.0).is_nan(), "within a metre");
}

#[test]
fn it_stands_if_neither_speed_nor_acceleration_is_left() {
    for axis in 0..3 {
        let stands = |speed: f32, acceleration: f32| {
            let stage = Stage::at(here()).moving(along(axis, speed));
            let present = Setpoint { acceleration_m_s2: along(axis, acceleration), ..stage.present };
            Stage { present, ..stage }.see(|inputs| inputs.stands())
        };
        assert!(stands(0.0, 0.0) && stands(0.049, 0.19) && stands(-0.049, -0.19));
        assert!(!stands(0.051, 0.0) && !stands(0.0, -0.21) && !stands(-3.0, 4.0));
    }
}

/// Both vehicle and setpoint must be within a distance of the place, horizontally and vertically.
#[test]
fn at_a_place_are_vehicle_and_setpoint() {
    let place = here();
    let is_at = |vehicle: Vector3<f32>, setpoint: Vector3<f32>| {
        Stage::at(place + vehicle).apart(setpoint - vehicle).see(|inputs| inputs.is_at(&place, 2.0))
    };
    let zero = Vector3::zeros();
    for (off, at) in [
        (Vector3::new(1.99, 0.0, 0.0), true),
        (Vector3::new(0.0, -2.01, 0.0), false),
        (Vector3::new(1.41, -1.41, 1.99), true),
        (Vector3::new(1.42, 1.42, 0.0), false),
        (Vector3::new(0.0, 0.0, 2.01), false),
        (Vector3::new(0.0, 0.0, -2.01), false),
    ] {
        assert_eq!((is_at(off, zero), is_at(zero, off), is_at(off, off)), (at, at, at), "{off:?}");
    }
}
