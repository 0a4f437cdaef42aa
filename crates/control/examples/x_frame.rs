//! Allocates inputs with the mixer of an X frame: `cargo run -p afbc-control --example x_frame`.
#![allow(clippy::unwrap_used, reason = "an example whose parameters are not valid should say so")]

use afbc_control::Mixer;
use afbc_types::{Airframe, Inputs, Parameters, Rotor};

fn main() {
    // Front right, front left, rear left, rear right, in arm lengths. Adjacent rotors spin in opposite directions.
    let c = core::f32::consts::FRAC_1_SQRT_2;
    let rotor = |x, y, pushes_left| Rotor { x, y, pushes_left };
    let rotors = [rotor(c, -c, true), rotor(c, c, false), rotor(-c, c, true), rotor(-c, -c, false)];
    let mixer = Mixer::new(Airframe { rotors, parameters: Parameters::PAPER.to_f32() }, 3.0).unwrap();
    let inputs = Inputs { pitch_n: 1.0, thrust_n: 5.0, ..Inputs::default() };
    let forces = mixer.allocate(&inputs).forces;
    println!("{inputs:?}: {:.3?} N", forces.0.as_slice());
    assert!((mixer.inputs(&forces).pitch_n - 1.0).abs() < 1e-5);
}
