//! Flies the simulated vehicle without a controller: rotors at hover speed, tipped over by a wind of 5 m/s. `cargo run
//! -p afbc-plant --example plant_alone`.

use afbc_plant::{Drag, Environment, Motion, Plant, PlantModel, Realism, Rotors, Wind};
use afbc_types::{OutOfRange, Parameters, RotorSpeeds};
use nalgebra::{Vector3, Vector4};

fn main() -> Result<(), OutOfRange> {
    let realism = Realism {
        rotors: Rotors { time_constant_s: 0.02, max_rad_s: 317.0, ..Rotors::default() },
        drag: Some(Drag::PAPER),
        wind: Wind { steady_m_s: Vector3::new(5.0, 0.0, 0.0), ..Wind::default() },
        ..Realism::default()
    };
    let environment = Environment::calm(Parameters::PAPER)?;
    let mut plant = Plant::with_realism(PlantModel::RigidBody, Motion::default(), environment, &realism, 0.001)?;
    for ms in 1..=1000 {
        plant.step(&RotorSpeeds(Vector4::repeat(199.9)), 0.001);
        if ms % 200 == 0 {
            println!("{:.1} s: {:.3?} m/s", plant.time_s(), plant.motion().velocity_m_s.as_slice());
        }
    }
    assert!(plant.motion().velocity_m_s.x > 0.1);
    Ok(())
}
