//! Flies AFBC in a closed loop with the plant: `cargo run --example closed_loop`.
//!
//! The vehicle is 30 % heavier than the law's model, its rotors lag by 20 ms, and it starts 1 m from its setpoint.

use afbc::{Adaptive, Controller, Profile};
use afbc_control::{FlightController, Validated};
use afbc_plant::{Environment, Motion, Plant, PlantModel, Realism, Rotors};
use afbc_types::{OutOfRange, Parameters, Setpoint};

const DT_S: f64 = 0.001;

fn main() -> Result<(), OutOfRange> {
    let believed = Parameters::PAPER.to_f32();
    let law = Adaptive::new(Profile::Flight.gains_for(&believed, afbc::LAG_S))?;
    let controller = Controller::new(believed, Profile::Flight.settings(), law)?;
    let mut memory = Validated::default();

    let mut truth = Parameters::PAPER;
    truth.mass_kg *= 1.3;
    let rotors = Rotors { time_constant_s: 0.02, ..Rotors::default() };
    let realism = Realism { rotors, ..Realism::default() };
    let mut plant =
        Plant::with_realism(PlantModel::RigidBody, Motion::default(), Environment::calm(truth)?, &realism, DT_S)?;

    let mut setpoint = Setpoint::default();
    setpoint.position_m.x = 1.0;
    for step in 0..=10_000 {
        let state = plant.motion().measure();
        if step % 2_000 == 0 {
            println!("{:4.1} s: {:6.3?} m", plant.time_s(), state.position_m.as_slice());
        }
        let action = controller.step(&mut memory, Some(&state), &setpoint);
        plant.step(&action.speeds, DT_S);
    }
    let distance_m = (plant.motion().measure().position_m - setpoint.position_m).norm();
    assert!(distance_m < 0.01, "the vehicle is {distance_m} m from its setpoint at the end");
    Ok(())
}
