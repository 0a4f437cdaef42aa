//! The flight image of a board on register-level models of it, as it is flashed.
//!
//! Models and processor are those of `rigless`, which nobody of this project wrote.
#![forbid(unsafe_code)]

mod boot;
mod check;
mod fly;
mod host;
mod machine;
mod pilot;
mod pins;
mod wire;
mod world;

use rigless::machine::matekh743::MatekH743;
use rigless::machine::pixracer::Pixracer;
use std::path::Path;
use std::process::ExitCode;

const USAGE: &str = "twin boot matekh743|pixracer IMAGE: boots it, and looks at bus and pins
twin fly IMAGE SCENARIO: takes off, hovers and lands, in lockstep with the plant
twin host SCENARIO: the same with the firmware's code on this machine";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let result = match *arguments {
        ["boot", "matekh743", image] => boot::boot::<MatekH743>(Path::new(image)),
        ["boot", "pixracer", image] => boot::boot::<Pixracer>(Path::new(image)),
        ["fly", image, scenario] => fly::fly(Path::new(image), Path::new(scenario)),
        ["host", scenario] => host::fly(Path::new(scenario)),
        _ => Err(USAGE.into()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("twin: {error}");
            ExitCode::FAILURE
        }
    }
}
