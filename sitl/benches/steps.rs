//! Measures the time per step of each part, and closed-loop steps per second on one core.
//!
//! Run by `cargo bench -p sitl`. Single steps cycle through inputs of the paper's flight, so that branches and
//! exponentials vary. The closed loop is a whole flight of 60 s at 1 kHz, with reference, AFBC, rigid body by
//! Runge-Kutta, gusts and parameter changes, but without a log. Its items are steps.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)] // a failed scenario must stop it

use afbc::{Adaptive, Backstepping, Controller, Profile};
use afbc_control::{FlightController, Validated};
use afbc_plant::{Deviations, Drag, Plant, PlantModel, Realism, Rotors, Sensing, Turbulence, Wind};
use afbc_scenario::Scenario;
use afbc_scenario::case::Case;
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::paper::scenario;
use afbc_sim::flight::{FlightSoftware, LawOnly, World, fly};
use afbc_types::{Parameters, RotorSpeeds, Setpoint, State};
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use nalgebra::Vector3;

fn main() {
    divan::main();
}

/// Number of steps in a flight.
const STEPS: usize = 60_000;

fn paper(model: PlantModel) -> Scenario {
    scenario(model, Case::DEFAULT).unwrap()
}

/// Returns inputs and outputs of a controller at every 60th step of the paper's flight.
fn recorded(model: PlantModel, kind: ControllerKind) -> Vec<(State, Setpoint, RotorSpeeds<8>)> {
    let (mut steps, mut index) = (Vec::new(), 0_usize);
    fly(&paper(model), &Contender::of(kind, Profile::Paper), |sample| {
        if index.is_multiple_of(60) {
            steps.push((sample.motion.measure(), sample.reference.setpoint(), sample.action.speeds));
        }
        index += 1;
    })
    .unwrap();
    steps
}

fn afbc(profile: Profile) -> Controller<Adaptive> {
    let law = Adaptive::new(profile.gains()).unwrap();
    Controller::new(Parameters::PAPER.to_f32(), profile.settings(), law).unwrap()
}

fn backstepping(profile: Profile) -> Controller<Backstepping> {
    let (vehicle, gains) = (Parameters::PAPER.to_f32(), profile.gains().map(|gains| gains.backstepping));
    Controller::new(vehicle, profile.settings(), Backstepping::new(&vehicle, gains).unwrap()).unwrap()
}

fn control_step(bencher: Bencher, kind: ControllerKind, controller: impl FlightController) {
    let steps = recorded(PlantModel::RigidBody, kind);
    let mut memory = Validated::default();
    let mut at = 0;
    bencher.counter(ItemsCount::new(1_usize)).bench_local(|| {
        let (state, setpoint, _) = &steps[at];
        at = if at + 1 == steps.len() { 0 } else { at + 1 };
        controller.step(&mut memory, Some(black_box(state)), black_box(setpoint))
    });
}

#[divan::bench]
fn control_step_afbc(bencher: Bencher) {
    control_step(bencher, ControllerKind::Afbc, afbc(Profile::Paper));
}

#[divan::bench]
fn control_step_backstepping(bencher: Bencher) {
    control_step(bencher, ControllerKind::Backstepping, backstepping(Profile::Paper));
}

fn plant_step(bencher: Bencher, model: PlantModel) {
    let scenario = paper(model);
    let steps = recorded(model, ControllerKind::Afbc);
    let mut plant = Plant::new(model, scenario.initial, scenario.environment);
    let mut at = 0;
    bencher.counter(ItemsCount::new(1_usize)).bench_local(|| {
        let (_, _, speeds) = &steps[at];
        at = if at + 1 == steps.len() { 0 } else { at + 1 };
        plant.step(black_box(speeds), 0.001);
    });
    black_box(plant.motion());
}

#[divan::bench]
fn plant_step_rigid_body(bencher: Bencher) {
    plant_step(bencher, PlantModel::RigidBody);
}

#[divan::bench]
fn plant_step_simplified(bencher: Bencher) {
    plant_step(bencher, PlantModel::Simplified);
}

fn closed_loop(bencher: Bencher, scenario: &Scenario, controller: impl FlightController + Copy) {
    bencher
        .counter(ItemsCount::new(STEPS))
        .with_inputs(|| (World::new(scenario, 0.001).unwrap(), LawOnly::new(controller)))
        .bench_local_refs(|(world, pilot)| {
            for _ in 0..STEPS {
                let Ok(sample) = pilot.step(world);
                world.advance(&sample.action.speeds);
            }
            world.look().motion
        });
}

#[divan::bench]
fn closed_loop_afbc_rigid_body(bencher: Bencher) {
    closed_loop(bencher, &paper(PlantModel::RigidBody), afbc(Profile::Paper));
}

#[divan::bench]
fn closed_loop_backstepping_rigid_body(bencher: Bencher) {
    closed_loop(bencher, &paper(PlantModel::RigidBody), backstepping(Profile::Paper));
}

#[divan::bench]
fn closed_loop_afbc_simplified(bencher: Bencher) {
    closed_loop(bencher, &paper(PlantModel::Simplified), afbc(Profile::Paper));
}

/// Returns the paper's flight with all effects that a campaign adds: rotor lag, limits and delay, drag, wind,
/// turbulence, and noise, bias and delay of the measurements.
fn real() -> Scenario {
    let rotors = Rotors { time_constant_s: 0.02, max_rad_s: 317.0, delay_s: 0.001, ..Rotors::default() };
    let wind =
        Wind { steady_m_s: Vector3::new(3.0, 1.0, 0.0), turbulence: Some(Turbulence::MODERATE), ..Wind::default() };
    let (noise, bias) = (Deviations::all(0.001), Deviations::all(0.001));
    Scenario {
        realism: Realism { rotors, wind, drag: Some(Drag::PAPER), ..Realism::default() },
        sensing: Sensing { noise, bias, delay_s: 0.002, ..Sensing::DEFAULT },
        ..paper(PlantModel::RigidBody)
    }
}

#[divan::bench]
fn closed_loop_afbc_real(bencher: Bencher) {
    closed_loop(bencher, &real(), afbc(Profile::Flight));
}

/// Measures flights of a built-in campaign under every contender. An item is the flight of one contender.
#[divan::bench]
fn campaign_flight(bencher: Bencher) {
    let campaign = afbc_campaign::built_in("robustness").unwrap().read().unwrap();
    let mut flight = 0;
    bencher.counter(ItemsCount::new(campaign.scenario.contenders.len())).bench_local(|| {
        flight += 1;
        campaign.rows(flight).unwrap()
    });
}
