//! Tests the law's memory of aerodynamic forces: a difference from the vehicle's file is learnt lap by lap. Compares
//! the table of `docs/reference/flight.md`, or writes it with `WRITE=1`.

use afbc::Profile;
use afbc_plant::{Environment, Motion, Payload, PlantParameter, PlantParameterChange, RotorFault};
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::trajectory::{Sine, Trajectory};
use afbc_scenario::{Scenario, built_in};
use afbc_sim::run::FlightResult;
use core::f64::consts::{SQRT_2, TAU};
use nalgebra::Vector3;
use std::{env, fs};

const LAPS: usize = 5;
const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/reference/flight.md");
const BEGIN: &str = "<!-- laps: written by WRITE=1 cargo test -p flight-tests --test all laps:: -->\n";
const END: &str = "<!-- laps: end -->";

/// A difference between the vehicle and its file.
#[derive(Clone, Copy)]
enum Unlike {
    /// Factor on the drag.
    Drag(f64),
    /// Factor on the thrust at any rotor speed.
    Thrust(f64),
    /// Remaining fraction of the first rotor's thrust.
    Rotor(f64),
    /// Payload with this fraction of the mass, a fifth of an arm ahead.
    Payload(f64),
}

impl Unlike {
    const ALL: [Unlike; 5] =
        [Unlike::Drag(2.0), Unlike::Drag(0.5), Unlike::Thrust(0.8), Unlike::Rotor(0.8), Unlike::Payload(0.15)];

    fn words(self) -> String {
        match self {
            Unlike::Drag(factor) => format!("drag x {factor}"),
            Unlike::Thrust(factor) => format!("thrust x {factor}"),
            Unlike::Rotor(share) => format!("a rotor at {:.0} %", 100.0 * share),
            Unlike::Payload(share) => format!("a payload of {:.0} %", 100.0 * share),
        }
    }

    /// Changes the vehicle of `scenario`, but not the file by which the laws know the vehicle.
    fn put(self, scenario: &mut Scenario) {
        let vehicle = scenario.vehicle;
        let (start_s, end_s) = (0.0, f64::INFINITY);
        match self {
            Unlike::Drag(factor) => {
                let drag = scenario.realism.drag.as_mut().unwrap();
                drag.blade_n_s2_m *= factor;
                drag.area_m2 *= factor;
            }
            Unlike::Thrust(factor) => {
                let change = PlantParameterChange { quantity: PlantParameter::ThrustFactor, factor, start_s, end_s };
                scenario.environment = Environment::new(vehicle, vec![change], Vec::new()).unwrap();
            }
            Unlike::Rotor(efficiency) => {
                scenario.realism.rotors.faults = vec![RotorFault { rotor: 1, efficiency, start_s }];
            }
            Unlike::Payload(share) => {
                let (mass_kg, ahead_m) = (share * vehicle.mass_kg, 0.2 * vehicle.arm_m);
                let payload = Payload { mass_kg, below_m: 0.0, ahead_m, left_m: 0.0, start_s, end_s };
                let calm = Environment::calm(vehicle).unwrap();
                scenario.environment = calm.with_payloads(vec![payload]).unwrap();
            }
        }
    }
}

/// Returns laps of Gerono's lemniscate of 6 m by 3 m at up to this speed, and the time of a lap.
fn laps(vehicle: &str, speed_m_s: f64, unlike: Unlike) -> (Scenario, f64) {
    let vehicle = afbc_vehicles::built_in(vehicle).unwrap().read().unwrap();
    let mut scenario = built_in("hardware").unwrap().read().unwrap();
    let period_s = TAU * 3.0 * SQRT_2 / speed_m_s;
    let sine = |amplitude_m, period_s| Sine { amplitude_m, period_s, phase_rad: 0.0 };
    let sines = [sine(3.0, period_s), sine(1.5, 0.5 * period_s), sine(0.0, period_s)];
    scenario.trajectory = Trajectory::Lissajous { centre_m: Vector3::new(0.0, 0.0, 3.0), sines, yaw_rad: 0.0 };
    scenario.environment = Environment::calm(*scenario.environment.nominal()).unwrap();
    scenario = scenario.on(&vehicle, Profile::Flight).unwrap();
    scenario.duration_s = LAPS as f64 * period_s;
    let start = scenario.trajectory.at(0.0);
    scenario.initial = Motion { position_m: start.position_m, velocity_m_s: start.velocity_m_s, ..Motion::default() };
    unlike.put(&mut scenario);
    (scenario, period_s)
}

/// Returns the root mean square distance from the reference in each lap \[m\].
fn errors((scenario, period_s): &(Scenario, f64), contender: &Contender) -> [f64; LAPS] {
    let run = FlightResult::fly(scenario, contender, 1).unwrap();
    assert!(run.lost.is_none() && run.tripped.is_none(), "{:?} {:?}", run.lost, run.tripped);
    core::array::from_fn(|lap| {
        let within = |time_s: f64| (time_s / period_s) as usize == lap;
        let squares: Vec<_> = run
            .log
            .iter()
            .filter(|sample| within(sample.time_s))
            .map(|sample| (sample.motion.position_m - sample.reference.position_m).norm_squared())
            .collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    })
}

/// Returns the errors in each lap of AFBC, of AFBC without its memory, and of INDI, each with its gains for the vehicle
/// \[m\].
fn all_errors(flight: &(Scenario, f64)) -> [[f64; LAPS]; 3] {
    let vehicle = flight.0.vehicle_file.as_ref().unwrap();
    let on_it = |kind| Contender::of(kind, Profile::Flight).on(vehicle, Profile::Flight).unwrap();
    let [afbc, indi] = [ControllerKind::Afbc, ControllerKind::Indi].map(on_it);
    let mut forgetful = afbc.clone();
    forgetful.settings.disturbance.memory_1_s = 0.0;
    [afbc, forgetful, indi].map(|contender| errors(flight, &contender))
}

/// With a drag unlike the file's, each lap has a smaller error than the one before. Lap 5 has at most half of INDI's
/// error, and at most 0.5 (paper's vehicle) or 0.65 (racer) of that of lap 1. With twice the drag, it has at least 15 %
/// less than without the memory. With other differences, the memory makes no flight worse.
#[test]
fn what_the_file_does_not_tell_is_learnt_lap_by_lap() {
    let mut table = String::from("| | lap 1 | 2 | 3 | 5 | 5, no memory | 5, INDI |\n|---|--:|--:|--:|--:|--:|--:|\n");
    let flown = [("paper", 3.0, "paper's vehicle, 3 m/s", [0.5, 0.8]), ("racer", 4.0, "racer, 4 m/s", [0.65, 0.85])];
    for (vehicle, speed_m_s, title, [of_lap_1, of_forgetful]) in flown {
        for unlike in Unlike::ALL {
            let [with, without, peer] = all_errors(&laps(vehicle, speed_m_s, unlike));
            let case = format!("{title}, {}", unlike.words());
            let mm = |value: f64| format!("{:.2}", 1000.0 * value);
            let cells = [with[0], with[1], with[2], with[4], without[4], peer[4]].map(mm);
            table += &format!("| {case} | {} |\n", cells.join(" | "));
            let seen = format!("{case}: {with:.5?}, without memory {without:.5?}, INDI {peer:.5?}");
            println!("{seen}");
            if let Unlike::Drag(factor) = unlike {
                assert!(with.is_sorted_by(|a, b| a >= b) && with[4] < 0.5 * peer[4], "{seen}");
                let learnt = with[4] < of_lap_1 * with[0] && with[4] < of_forgetful * without[4];
                assert!(factor < 1.0 || learnt, "{seen}");
            }
            assert!(with[4] < 1.05 * without[4], "{seen}");
        }
    }
    let page = fs::read_to_string(PAGE).unwrap();
    let (before, rest) = page.split_once(BEGIN).unwrap();
    let (kept, after) = rest.split_once(END).unwrap();
    if env::var_os("WRITE").is_some() {
        fs::write(PAGE, format!("{before}{BEGIN}{table}{END}{after}")).unwrap();
    } else {
        assert_eq!(kept, table, "WRITE=1 writes it");
    }
}
