//! Compares rotors with closed-form solutions, and checks the battery's energy balance.

use afbc_plant::{
    BatteryModel, BatteryState, Environment, Motion, Plant, PlantModel, Realism, RotorFault, RotorStart, Rotors, Sag,
};
use afbc_types::{Parameters, RotorSpeeds};
use nalgebra::{Vector3, Vector4};

const STEP_S: f64 = 0.001;
const P: Parameters<f64> = Parameters::PAPER;

fn plant_at(rotors: Rotors, step_s: f64) -> Plant {
    let realism = Realism { rotors, ..Realism::default() };
    let environment = Environment::calm(P).unwrap();
    Plant::with_realism(PlantModel::RigidBody, Motion::default(), environment, &realism, step_s).unwrap()
}

fn plant(rotors: Rotors) -> Plant {
    plant_at(rotors, STEP_S)
}

fn command(w: f64) -> RotorSpeeds {
    RotorSpeeds(Vector4::repeat(w as f32))
}

fn speeds(plant: &Plant) -> Vector4<f64> {
    plant.telemetry().unwrap().rotor_speeds_rad_s.fixed_rows::<4>(0).into()
}

fn hover_rad_s() -> f64 {
    (P.mass_kg * P.gravity_m_s2 / (4.0 * P.thrust_factor_n_s2)).sqrt()
}

fn refused(rotors: Rotors) -> &'static str {
    let realism = Realism { rotors, ..Realism::default() };
    let environment = Environment::calm(P).unwrap();
    let result = Plant::with_realism(PlantModel::RigidBody, Motion::default(), environment, &realism, STEP_S);
    result.unwrap_err().range.name
}

#[test]
fn a_step_of_the_command_is_answered_by_an_exponential() {
    let tau = 0.02;
    let mut plant = plant(Rotors { time_constant_s: tau, start: RotorStart::Idle, ..Rotors::default() });
    for k in 1..=200 {
        plant.step(&command(250.0), STEP_S);
        let expected = 250.0 * (1.0 - (-f64::from(k) * STEP_S / tau).exp());
        assert!((speeds(&plant) - Vector4::repeat(expected)).amax() < 1e-10);
    }
}

/// Velocity by the thrust b omega^2 at time `t` in closed form: omega = W (1 - exp(-t/tau)).
#[test]
fn lagging_thrust_is_right_to_second_order() {
    let (tau, w, t) = (0.02_f64, 300.0, 0.1);
    let decay = (-t / tau).exp();
    let square = w * w * (t - 2.0 * tau * (1.0 - decay) + 0.5 * tau * (1.0 - decay * decay));
    let expected = 4.0 * P.thrust_factor_n_s2 * square / P.mass_kg - P.gravity_m_s2 * t;
    let error = |steps: u32| {
        let step_s = t / f64::from(steps);
        let mut plant = plant_at(Rotors { time_constant_s: tau, start: RotorStart::Idle, ..Rotors::default() }, step_s);
        (0..steps).for_each(|_| plant.step(&command(w), step_s));
        plant.motion().velocity_m_s.z - expected
    };
    let (coarse, fine) = (error(100), error(200));
    assert!(coarse.abs() < 1e-4, "{coarse}");
    assert!((coarse / fine - 4.0).abs() < 0.1, "halving the step divides the error by {}", coarse / fine);
}

#[test]
fn commands_arrive_exactly_as_many_steps_later() {
    for (delay_s, steps) in [(0.0, 0), (0.001, 1), (0.0014, 1), (0.020, 20)] {
        let mut plant = plant(Rotors { delay_s, ..Rotors::default() });
        for k in 0..100_u16 {
            plant.step(&command(100.0 + f64::from(k)), STEP_S);
            let expected =
                if k < steps { f64::from(hover_rad_s() as f32) } else { 100.0 + f64::from(k) - f64::from(steps) };
            assert_eq!(speeds(&plant), Vector4::repeat(expected), "delay {delay_s}, step {k}");
        }
    }
}

#[test]
fn a_hovering_vehicle_starts_without_a_transient() {
    let mut plant = plant(Rotors { time_constant_s: 0.05, delay_s: 0.02, ..Rotors::default() });
    (0..1000).for_each(|_| plant.step(&command(hover_rad_s()), STEP_S));
    // Only the rounding of the command to f32 remains.
    assert!(plant.motion().velocity_m_s.norm() < 1e-5);
}

#[test]
fn speeds_keep_their_limits_whatever_is_commanded() {
    let rotors = Rotors { min_rad_s: 20.0, max_rad_s: 317.0, ..Rotors::default() };
    let mut plant = plant(rotors);
    for (commanded, achieved) in
        [(0.0, 20.0), (-5.0, 20.0), (150.0, 150.0), (400.0, 317.0), (1e30, 317.0), (f64::NAN, 20.0)]
    {
        plant.step(&command(commanded), STEP_S);
        assert_eq!(speeds(&plant), Vector4::repeat(achieved));
    }
}

#[test]
fn a_failing_rotor_loses_its_share_of_thrust_and_moment_at_its_time() {
    let fault = RotorFault { rotor: 2, efficiency: 0.6, start_s: 0.01 };
    let mut plant = plant(Rotors { faults: vec![fault], ..Rotors::default() });
    let w = 200.0;
    (0..10).for_each(|_| plant.step(&command(w), STEP_S));
    assert_eq!(plant.motion().rates_rad_s, Vector3::zeros());
    plant.step(&command(w), STEP_S);
    // F2 = 0.6 b w^2: less thrust in front pitches the nose down, and less moment of rotor 2 yaws positively.
    let (lost, rates) = (0.4 * w * w, plant.motion().rates_rad_s);
    assert!((rates.y - P.arm_m * P.thrust_factor_n_s2 * lost / P.inertia_kg_m2.y * STEP_S).abs() < 1e-6, "{rates}");
    assert!((rates.z - P.drag_factor_n_m_s2 * lost / P.inertia_kg_m2.z * STEP_S).abs() < 1e-6, "{rates}");
}

#[test]
fn faults_of_one_rotor_multiply_and_a_dead_rotor_is_dead() {
    let fault = |efficiency, start_s| RotorFault { rotor: 3, efficiency, start_s };
    let mut twice = plant(Rotors { faults: vec![fault(0.5, 0.0), fault(0.5, 0.0)], ..Rotors::default() });
    let mut once = plant(Rotors { faults: vec![fault(0.25, 0.0)], ..Rotors::default() });
    let mut dead = plant(Rotors { faults: vec![fault(0.0, 0.0)], ..Rotors::default() });
    let mut ideal = plant(Rotors::default());
    (0..20).for_each(|_| {
        twice.step(&command(200.0), STEP_S);
        once.step(&command(200.0), STEP_S);
        dead.step(&command(200.0), STEP_S);
        ideal.step(&RotorSpeeds(Vector4::new(200.0, 200.0, 0.0, 200.0)), STEP_S);
    });
    assert_eq!(twice.motion(), once.motion());
    assert_eq!(dead.motion(), ideal.motion());
}

/// A dead rotor slows down like one that is commanded to stop, even below its smallest speed, and turns again when it
/// is repaired.
#[test]
fn a_dead_rotor_slows_down() {
    let fault = RotorFault { rotor: 2, efficiency: 0.0, start_s: 0.02 };
    let rotors = Rotors { time_constant_s: 0.05, min_rad_s: 30.0, faults: vec![fault], ..Rotors::default() };
    let mut plant = plant(rotors);
    (0..20).for_each(|_| plant.step(&command(200.0), STEP_S));
    let before = speeds(&plant);
    (0..50).for_each(|_| plant.step(&command(200.0), STEP_S));
    let after = speeds(&plant);
    assert!((after.y - before.y * (-1.0_f64).exp()).abs() < 1e-9, "{after}");
    assert_eq!((after.x > 190.0, after.z > 190.0), (true, true));
    plant.set_rotor_faults(Vec::new()).unwrap();
    (0..1_000).for_each(|_| plant.step(&command(200.0), STEP_S));
    assert!((speeds(&plant).y - 200.0).abs() < 1e-3);
}

fn battery_of(plant: &Plant) -> BatteryState {
    plant.telemetry().unwrap().battery.unwrap()
}

/// All energy from the cells drives rotors and avionics or heats the battery.
#[test]
fn battery_energy_is_accounted_for() {
    let battery = BatteryModel { capacity_a_h: 0.01, ..BatteryModel::THREE_CELLS };
    let mut plant = plant(Rotors { battery: Some(battery), ..Rotors::default() });
    let (mut cells_j, mut heat_j, mut used_j, mut drawn_a_s) = (0.0, 0.0, 0.0, 0.0);
    for k in 0..5000_u32 {
        let before = battery_of(&plant);
        let open_v = battery.empty_v + (battery.full_v - battery.empty_v) * before.charge;
        let w = 180.0 + f64::from(k % 50);
        plant.step(&command(w), STEP_S);
        let now = battery_of(&plant);
        assert!((now.voltage_v - (open_v - battery.resistance_ohm * now.current_a)).abs() < 1e-12);
        cells_j += open_v * now.current_a * STEP_S;
        heat_j += battery.resistance_ohm * now.current_a * now.current_a * STEP_S;
        let w = f64::from(w as f32);
        used_j += (4.0 * P.drag_factor_n_m_s2 * w * w * w / battery.efficiency + battery.avionics_w) * STEP_S;
        drawn_a_s += now.current_a * STEP_S;
    }
    assert!((cells_j - heat_j - used_j).abs() < 1e-9 * cells_j, "{cells_j} = {heat_j} + {used_j}");
    let left = battery_of(&plant).charge;
    assert!((1.0 - left - drawn_a_s / (3600.0 * battery.capacity_a_h)).abs() < 1e-12);
    assert!(left < 0.9 && left > 0.0);
}

#[test]
fn a_sagging_battery_lowers_the_ceiling_or_every_speed() {
    let sagging = |effect| {
        let battery = BatteryModel { initial_charge: 0.5, resistance_ohm: 0.0, effect, ..BatteryModel::THREE_CELLS };
        let mut plant = plant(Rotors { max_rad_s: 300.0, battery: Some(battery), ..Rotors::default() });
        let share = battery_of(&plant).voltage_v / battery.full_v;
        assert!((share - (0.5 * (9.9 + 12.6)) / 12.6).abs() < 1e-12);
        plant.step(&command(200.0), STEP_S);
        let usual = speeds(&plant).x;
        plant.step(&command(400.0), STEP_S);
        (usual / share, speeds(&plant).x / share)
    };
    let close = |(a, b): (f64, f64), (c, d): (f64, f64)| (a - c).abs() < 1e-3 && (b - d).abs() < 1e-3;
    let share = 0.5 * (9.9 + 12.6) / 12.6;
    assert!(close(sagging(Sag::Ceiling), (200.0 / share, 300.0)));
    assert!(close(sagging(Sag::Speed), (200.0, 300.0)));
}

#[test]
fn more_than_a_battery_can_give_is_not_given() {
    let battery = BatteryModel { resistance_ohm: 1.0, avionics_w: 1000.0, ..BatteryModel::THREE_CELLS };
    let mut plant = plant(Rotors { battery: Some(battery), ..Rotors::default() });
    plant.step(&command(200.0), STEP_S);
    // The load matches the battery's resistance, so the voltage falls to a half.
    let BatteryState { voltage_v, current_a, .. } = battery_of(&plant);
    assert!((voltage_v - 6.3).abs() < 1e-9 && (current_a - 6.3).abs() < 1e-9);
}

#[test]
fn an_empty_battery_stops_the_rotors() {
    let battery = BatteryModel { capacity_a_h: 0.001, ..BatteryModel::THREE_CELLS };
    let mut plant = plant(Rotors { battery: Some(battery), time_constant_s: 0.02, ..Rotors::default() });
    (0..3000).for_each(|_| plant.step(&command(200.0), STEP_S));
    assert_eq!(battery_of(&plant), BatteryState { voltage_v: 0.0, current_a: 0.0, charge: 0.0 });
    assert!(speeds(&plant).amax() < 1e-6);
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let fault = |rotor, efficiency, start_s| vec![RotorFault { rotor, efficiency, start_s }];
    let ok = Rotors::default;
    assert_eq!(refused(Rotors { time_constant_s: -0.1, ..ok() }), "time_constant_s");
    assert_eq!(refused(Rotors { max_rad_s: f64::INFINITY, ..ok() }), "max_rad_s");
    assert_eq!(refused(Rotors { min_rad_s: 400.0, max_rad_s: 300.0, ..ok() }), "min_rad_s");
    assert_eq!(refused(Rotors { delay_s: 0.6, ..ok() }), "delay_s");
    assert_eq!(refused(Rotors { faults: fault(5, 0.5, 0.0), ..ok() }), "rotor");
    assert_eq!(refused(Rotors { faults: fault(0, 0.5, 0.0), ..ok() }), "rotor");
    assert_eq!(refused(Rotors { faults: fault(1, 1.5, 0.0), ..ok() }), "efficiency");
    assert_eq!(refused(Rotors { faults: fault(1, 0.5, f64::NAN), ..ok() }), "start_s");
    let battery = |battery| refused(Rotors { battery: Some(battery), ..ok() });
    assert_eq!(battery(BatteryModel { empty_v: 13.0, ..BatteryModel::THREE_CELLS }), "empty_v");
    assert_eq!(battery(BatteryModel { resistance_ohm: -1.0, ..BatteryModel::THREE_CELLS }), "resistance_ohm");
    assert_eq!(battery(BatteryModel { capacity_a_h: 0.0, ..BatteryModel::THREE_CELLS }), "capacity_a_h");
}
