//! Runs one step of three controllers behind one interface, 0.2 m beside their setpoint: `cargo run -p afbc-laws
//! --example one_interface`.

use afbc_control::{FlightController, Settings, Validated};
use afbc_laws::{geometric, indi, pid};
use afbc_types::{OutOfRange, Parameters, Setpoint, State};

fn step(name: &str, controller: &impl FlightController) {
    let mut setpoint = Setpoint::default();
    setpoint.position_m.x = 0.2;
    let action = controller.step(&mut Validated::default(), Some(&State::default()), &setpoint);
    // The vehicle must pitch forward: the rear rotor gives more than the front one.
    assert!(action.forces.0.w > action.forces.0.y);
    println!("{name:9}: rotor forces {:.3?} N", action.forces.0.as_slice());
}

fn main() -> Result<(), OutOfRange> {
    let vehicle = Parameters::PAPER.to_f32();
    let settings = Settings { rotor_force_max_n: 3.0, ..Settings::DEFAULT };
    step("PID", &pid::Pid::new(vehicle, settings, pid::Gains::TUNED)?);
    step("geometric", &geometric::Geometric::new(vehicle, settings, geometric::Gains::TUNED)?);
    step("INDI", &indi::Indi::new(vehicle, settings, indi::Gains::TUNED)?);
    Ok(())
}
