//! AFBC under its monitor in the closed loop: causes of trips, flights without trips, and flights across a switch to
//! the fallback law.
#![allow(clippy::unwrap_used, missing_docs)] // a failed flight must stop the test

use afbc::monitor::MonitorBounds;
use afbc::{Guarded, Profile, Settings, Trip, guarded};
use afbc_control::{Action, FlightController, Trace, Validated};
use afbc_plant::{
    Deviations, Drag, Environment, Motion, Plant, PlantModel, Realism, Rotors, Sensing, StateSensor, Turbulence, Wind,
};
use afbc_scenario::case::Case;
use afbc_scenario::paper;
use afbc_types::{Axis, Inputs, Parameters, PerAxis, Setpoint};
use nalgebra::{Vector2, Vector3, Vector4};

const STEP_S: f64 = 0.001;
const SECOND: usize = 1000;

fn guarded(profile: Profile, settings: Settings, bounds: MonitorBounds) -> Guarded {
    Guarded::new(Parameters::PAPER.to_f32(), settings, profile.gains(), bounds).unwrap()
}

/// Returns the profile `flight` under its own bounds, some of them changed.
fn flight(change: fn(&mut MonitorBounds)) -> Guarded {
    let mut bounds =
        MonitorBounds::new(&Profile::Flight.gains(), &Parameters::PAPER.to_f32(), &Profile::Flight.settings());
    change(&mut bounds);
    guarded(Profile::Flight, Profile::Flight.settings(), bounds)
}

fn above(height_m: f32) -> Setpoint {
    Setpoint { position_m: Vector3::new(0.0, 0.0, height_m), ..Setpoint::default() }
}

/// A vehicle with its sensors, its controller and the controller's memory.
struct Bench {
    controller: Guarded,
    memory: Validated<guarded::Memory>,
    plant: Plant,
    sensors: StateSensor,
}

impl Bench {
    /// Makes a vehicle in the air, with a rotor lag of 20 ms and 3 N per rotor.
    fn real(controller: Guarded, realism: Realism, noise: Deviations) -> Self {
        let rotors = Rotors { time_constant_s: 0.02, max_rad_s: 317.0, ..Rotors::default() };
        let environment = Environment::calm(Parameters::PAPER).unwrap();
        let realism = Realism { rotors, ..realism };
        let plant =
            Plant::with_realism(PlantModel::RigidBody, Motion::default(), environment, &realism, STEP_S).unwrap();
        let sensors = StateSensor::new(&Sensing { noise, ..Sensing::default() }, 1, STEP_S).unwrap();
        Bench { controller, memory: Validated::default(), plant, sensors }
    }

    /// Returns the trace of the last step.
    fn trace(&self) -> Trace {
        Guarded::trace(&self.memory.control)
    }

    fn step(&mut self, setpoint: &Setpoint) -> Action {
        let measured = self.sensors.measure(&self.plant.motion());
        let command = self.controller.step(&mut self.memory, Some(&measured.state), setpoint);
        self.plant.step(&command.speeds, STEP_S);
        command
    }

    /// Flies for `steps`, or until the monitor trips.
    fn fly(&mut self, steps: usize, setpoint: &Setpoint) -> Option<Trip> {
        for _ in 0..steps {
            let _ = self.step(setpoint);
            if self.memory.control.trip().is_some() {
                break;
            }
        }
        self.memory.control.trip()
    }

    fn distance_m(&self, setpoint: &Setpoint) -> f64 {
        (self.plant.motion().position_m - setpoint.position_m.cast()).norm()
    }
}

/// The noise of position and velocity is typical of motion capture. The noise of attitude and rates is typical of a
/// small inertial sensor.
const NOISE: Deviations = Deviations { position_m: 0.002, velocity_m_s: 0.01, attitude_rad: 0.002, rates_rad_s: 0.02 };

/// In the paper's flight with gusts and uncertainty, the robust terms with the printed epsilon of 1 mm/s chatter once
/// they have grown, after more than half of the flight. The detector trips. Without the detector, nothing trips.
#[test]
fn the_printed_laws_chatter_is_a_limit_cycle() {
    let paper = paper::scenario(PlantModel::Simplified, Case::DEFAULT).unwrap();
    let bounds = MonitorBounds::new(&Profile::Paper.gains(), &Parameters::PAPER.to_f32(), &Profile::Paper.settings());
    let fly = |bounds| {
        let mut bench = Bench {
            controller: guarded(Profile::Paper, Profile::Paper.settings(), bounds),
            memory: Validated::default(),
            plant: Plant::new(PlantModel::Simplified, paper.initial, paper.environment.clone()),
            sensors: StateSensor::new(&Sensing::default(), 0, STEP_S).unwrap(),
        };
        (0..60 * SECOND).find_map(|step| {
            let reference = paper.trajectory.at(step as f64 * STEP_S);
            bench.fly(1, &reference.setpoint()).map(|trip| (step / SECOND, trip))
        })
    };
    let (second, trip) = fly(bounds).unwrap();
    assert!(second >= 30 && matches!(trip, Trip::LimitCycle(_)), "{trip:?} after {second} s");
    assert_eq!(fly(MonitorBounds { swings_hz: 1e4, ..bounds }), None);
}

/// Noise, wind, turbulence and a series of steps do not trip the monitor of the profile `flight`.
#[test]
fn a_noisy_flight_in_wind_does_not_trip() {
    let wind =
        Wind { steady_m_s: Vector3::new(4.0, -2.0, 0.0), turbulence: Some(Turbulence::LIGHT), ..Wind::default() };
    let realism = Realism { drag: Some(Drag::PAPER), wind, seed: 3, ..Realism::default() };
    let mut bench = Bench::real(flight(|_| ()), realism, NOISE);
    for leg in 0..6 {
        let corner = Vector3::new((leg % 2) as f32 * 2.0, (leg / 2) as f32, 1.0);
        let setpoint = Setpoint { position_m: corner, yaw_rad: leg as f32, ..Setpoint::default() };
        assert_eq!(bench.fly(10 * SECOND, &setpoint), None, "leg {leg}");
        assert!(bench.distance_m(&setpoint) < 0.5, "leg {leg}: {} m off", bench.distance_m(&setpoint));
    }
}

/// The monitor trips while the vehicle adapts its tilt to the wind. The inputs continue without a jump, and the
/// fallback law returns to the setpoint. So does AFBC when it is engaged again, which it never does by itself.
#[test]
fn a_flight_goes_on_across_a_trip_and_back() {
    let setpoint = above(0.0);
    let wind = Wind { steady_m_s: Vector3::new(3.0, 0.0, 0.0), ..Wind::default() };
    let realism = Realism { drag: Some(Drag::PAPER), wind, ..Realism::default() };
    let mut bench = Bench::real(flight(|bounds| bounds.theta.x = 0.05), realism, Deviations::default());

    // At the switch, filtered inputs continue to change as in the step before, within 5 mN. Virtual inputs, which are
    // not filtered, change by at most 5 mm/s2.
    let bumpless = |earlier: &Trace, before: &Trace, after: &Trace, what: &str| {
        let wanted = |trace: &Trace| {
            let Inputs { roll_n, pitch_n, yaw_n, thrust_n } = trace.inputs;
            (Vector4::new(roll_n, pitch_n, yaw_n, thrust_n), Vector2::from(trace.virtual_m_s2))
        };
        let [(u0, _), (u1, v1), (u2, v2)] = [earlier, before, after].map(wanted);
        let (bends, jumps) = (u2 - 2.0 * u1 + u0, v2 - v1);
        assert!(bends.amax() < 0.005 && jumps.amax() < 0.005, "{what}: {bends} {jumps}");
    };
    let mut last = bench.step(&setpoint);
    let mut before = bench.trace();
    let mut earlier = before;
    for _ in 0..20 * SECOND {
        if bench.memory.control.trip().is_some() {
            break;
        }
        last = bench.step(&setpoint);
        (earlier, before) = (before, bench.trace());
    }
    assert_eq!((last.health.fallback, bench.memory.control.trip()), (None, Some(Trip::Theta(Axis::X))));
    let _ = bench.step(&setpoint);
    bumpless(&earlier, &before, &bench.trace(), "fallback");
    for _ in 0..20 * SECOND {
        let action = bench.step(&setpoint);
        assert_eq!(action.health.fallback, Some(Trip::Theta(Axis::X).reason()), "engaged by itself");
        assert!(bench.distance_m(&setpoint) < 0.5, "{} m off", bench.distance_m(&setpoint));
        (earlier, before) = (before, bench.trace());
    }
    assert!(bench.distance_m(&setpoint) < 0.01, "{} m off", bench.distance_m(&setpoint));

    // Engages AFBC with bounds that the wind does not exceed.
    bench.controller = flight(|_| ());
    bench.controller.engage(&mut bench.memory.control);
    let _ = bench.step(&setpoint);
    bumpless(&earlier, &before, &bench.trace(), "engaged");
    for _ in 0..20 * SECOND {
        let action = bench.step(&setpoint);
        assert_eq!((action.health.fallback, bench.memory.control.trip()), (None, None));
        assert!(bench.distance_m(&setpoint) < 0.05, "{} m off", bench.distance_m(&setpoint));
    }
}

/// The fallback law reaches setpoints for which its speed limits matter, up, down and sideways.
#[test]
fn the_fallback_flies_far() {
    let tripped = |bounds: &mut MonitorBounds| bounds.error = PerAxis { z: 0.0, ..bounds.error };
    let mut bench = Bench::real(flight(tripped), Realism::default(), Deviations::default());
    assert_eq!(bench.fly(SECOND, &above(0.1)), Some(Trip::Error(Axis::Z)));
    for (x, z) in [(0.0, 30.0), (0.0, 2.0), (40.0, 2.0), (0.0, 20.0)] {
        let setpoint = Setpoint { position_m: Vector3::new(x, 0.0, z), ..Setpoint::default() };
        let mut fastest = 0.0_f64;
        for _ in 0..40 * SECOND {
            let _ = bench.step(&setpoint);
            let motion = bench.plant.motion();
            fastest = fastest.max(motion.velocity_m_s.amax());
            assert!(motion.attitude_rad.xy().amax() < 1.0 && motion.position_m.z > -1.0, "{motion:?}");
        }
        assert!(bench.distance_m(&setpoint) < 0.1, "{} m from {x}, {z}", bench.distance_m(&setpoint));
        assert!(fastest < 7.0, "{fastest} m/s");
    }
}
