//! Runs one step of AFBC, one metre below its setpoint: `cargo run -p afbc --example hover`.

use afbc::{Adaptive, Controller, Profile};
use afbc_control::{FlightController, Validated};
use afbc_types::{OutOfRange, Parameters, Setpoint, State};

fn main() -> Result<(), OutOfRange> {
    let vehicle = Parameters::PAPER.to_f32();
    let law = Adaptive::new(Profile::Flight.gains_for(&vehicle, afbc::LAG_S))?;
    let controller = Controller::new(vehicle, Profile::Flight.settings(), law)?;
    let mut memory = Validated::default();
    let mut setpoint = Setpoint::default();
    setpoint.position_m.z = 1.0;
    let action = controller.step(&mut memory, Some(&State::default()), &setpoint);
    println!("rotor speeds {:.1?} rad/s, {:?}", action.speeds.0.as_slice(), action.health);
    Ok(())
}
