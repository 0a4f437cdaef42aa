//! Ten hours of hover with noise: the estimates of the profile `flight` stay bounded; those of the law as printed
//! drift.

use afbc::{Adaptive, AdaptiveEstimate, CascadeMemory, Controller, Profile};
use afbc_control::{FlightController, Validated};
use afbc_plant::sensors::Deviations;
use afbc_plant::{Environment, Motion, Plant, PlantModel, Realism, Rotors, Sensing, StateSensor};
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::{Scenario, built_in};
use afbc_sim::flight::Sample;
use afbc_sim::run::FlightResult;
use afbc_types::{Axis, Parameters, PerAxis, Setpoint};
use nalgebra::Vector3;

const STEP_S: f64 = 0.001;
const HOUR: u64 = 3_600_000;

/// A hover at 2 m with a rotor lag of 20 ms, at most 3 N per rotor, and noise of 0.001 on every state.
struct Hover {
    controller: Controller<Adaptive>,
    memory: Validated<CascadeMemory<AdaptiveEstimate>>,
    plant: Plant,
    sensors: StateSensor,
    setpoint: Setpoint,
}

impl Hover {
    fn new(profile: Profile) -> Self {
        let vehicle = Parameters::PAPER;
        let controller =
            Controller::new(vehicle.to_f32(), profile.settings(), Adaptive::new(profile.gains()).unwrap()).unwrap();
        let max_rad_s = (3.0 / vehicle.thrust_factor_n_s2).sqrt();
        let rotors = Rotors { time_constant_s: 0.02, max_rad_s, delay_s: 0.001, ..Rotors::default() };
        let realism = Realism { rotors, seed: 11, ..Realism::default() };
        let start = Motion { position_m: Vector3::new(0.0, 0.0, 2.0), ..Motion::default() };
        let environment = Environment::calm(vehicle).unwrap();
        let plant = Plant::with_realism(PlantModel::RigidBody, start, environment, &realism, STEP_S).unwrap();
        let sensors =
            StateSensor::new(&Sensing { noise: Deviations::all(0.001), ..Sensing::default() }, 11, STEP_S).unwrap();
        let setpoint = Setpoint { position_m: Vector3::new(0.0, 0.0, 2.0), ..Setpoint::default() };
        Hover { controller, memory: Validated::default(), plant, sensors, setpoint }
    }

    /// Flies `steps` and returns the largest distance from the setpoint \[m\].
    fn fly(&mut self, steps: u64) -> f64 {
        let mut furthest = 0.0_f64;
        for _ in 0..steps {
            let motion = self.plant.motion();
            let state = self.sensors.measure(&motion).state;
            let command = self.controller.step(&mut self.memory, Some(&state), &self.setpoint);
            self.plant.step(&command.speeds, STEP_S);
            furthest = furthest.max((motion.position_m - Vector3::new(0.0, 0.0, 2.0)).norm());
        }
        furthest
    }

    /// Returns the norms |Theta_hat| and delta_hat of each subsystem.
    fn norms(&self) -> PerAxis<[f32; 2]> {
        let estimates = &self.memory.control.estimates;
        PerAxis::from_fn(|axis| [estimates[axis].theta.norm(), estimates[axis].delta])
    }
}

#[test]
fn estimates_of_the_profile_flight_stay_bounded_over_ten_hours() {
    let mut hover = Hover::new(Profile::Flight);
    let gains = Profile::Flight.gains();
    hover.fly(HOUR);
    let first = hover.norms();
    for hour in 2..=10 {
        let furthest = hover.fly(HOUR);
        assert!(furthest < 0.05, "hour {hour}: {furthest} m away");
        let norms = hover.norms();
        for axis in Axis::ALL {
            let [theta, delta] = norms[axis];
            let safeguards = gains[axis].safeguards;
            assert!(theta <= 0.9 * safeguards.theta_max, "hour {hour}, {axis:?}: |Theta_hat| = {theta}");
            assert!((0.0..=safeguards.delta_max).contains(&delta), "hour {hour}, {axis:?}: delta_hat = {delta}");
            // There is no slow drift: an hour is 36 time constants of the leakage.
            let [theta_then, delta_then] = first[axis];
            assert!((theta - theta_then).abs() <= 0.2 * theta_then.max(0.1), "{axis:?}: {theta_then} to {theta}");
            assert!((delta - delta_then).abs() <= 0.2 * delta_then.max(0.01), "{axis:?}: {delta_then} to {delta}");
        }
    }
    println!("after an hour {first:?}\nafter ten    {:?}", hover.norms());
}

#[test]
fn estimates_of_the_law_as_printed_drift_until_the_vehicle_is_lost() {
    let mut hover = Hover::new(Profile::Paper);
    let mut deltas = [0.0; 5];
    for delta in &mut deltas {
        let furthest = hover.fly(20_000);
        assert!(furthest < 0.5, "{furthest} m away");
        *delta = hover.norms().z[1];
    }
    println!("delta_hat of z every 20 s: {deltas:?}");
    assert!(deltas.is_sorted_by(|before, after| after - before > 0.05), "{deltas:?}");
    let furthest = hover.fly(140_000);
    println!("up to 240 s: {furthest} m away");
    assert!(furthest > 50.0);
}

/// Without noise, the flight lasts as long as docs/results.md says. It ends level, with the thrust that the allocation
/// needs for the limit cycle in pitch.
#[test]
fn the_printed_hover_is_lost_upwards_and_level() {
    let mut scenario = Scenario { duration_s: 300.0, ..built_in("hover").unwrap().read().unwrap() };
    scenario.contenders = ControllerKind::PAPER.map(|kind| Contender::of(kind, Profile::Paper)).to_vec();
    let fly = |kind| FlightResult::fly(&scenario, scenario.contender(kind).unwrap(), 7).unwrap();
    let run = fly(ControllerKind::Afbc);
    let (lost, last) = (run.lost.unwrap(), run.log.last().unwrap());
    let reported = format!(
        "after {:.1} s (`sitl fly hover --controller afbc-as-printed --duration 300`), level, and {:.0} m up",
        lost.time_s, last.motion.position_m.z
    );
    let page = include_str!("../../docs/results.md").split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(page.contains(&reported), "docs/results.md does not say: {reported}");

    let tilt = |sample: &Sample| sample.motion.attitude_rad.xy().amax();
    assert!(run.log.iter().filter(|sample| sample.time_s > 5.0).all(|sample| tilt(sample) < 0.06));
    // In the last second, the thrust exceeds the demand, since pitch has priority.
    let end: Vec<_> = run.log.iter().filter(|sample| sample.time_s > lost.time_s - 1.0).collect();
    let mean = |of: fn(&Sample) -> f32| end.iter().map(|sample| of(sample)).sum::<f32>() / end.len() as f32;
    let weight_n = (Parameters::PAPER.mass_kg * Parameters::PAPER.gravity_m_s2) as f32;
    let given = mean(|sample| sample.action.forces.0.sum());
    assert!(mean(|sample| sample.trace.inputs.thrust_n) < -1000.0 && given > 1.1 * weight_n, "{given} N");
    assert!(end.iter().any(|sample| sample.trace.inputs.pitch_n.abs() > 0.5 * weight_n));
    assert_eq!(fly(ControllerKind::Backstepping).lost, None);
}
