//! The flight image of a board on register-level models of it, as it is flashed.
//!
//! Models and processor are those of `rigless`, which nobody of this project wrote.
#![forbid(unsafe_code)]

mod aloft;
mod boot;
mod check;
mod cuts;
mod faults;
mod fly;
mod host;
mod kept;
mod machine;
mod pilot;
mod pins;
mod random;
mod same;
mod table;
mod ublox;
mod wire;
mod world;

use aloft::Aloft;
use rigless::machine::matekh743::MatekH743;
use rigless::machine::pixracer::Pixracer;
use std::path::Path;
use std::process::ExitCode;
use ublox::Generation;

const USAGE: &str = "twin boot matekh743|pixracer IMAGE: boots it, and looks at bus and pins
twin fly IMAGE SCENARIO [m8|m10] [LOG]: takes off, hovers and lands, in lockstep with the plant, with an NMEA receiver
    or a new one of u-blox's; keeps the exact log in a file, and flies it again: the same to the last bit
twin replay LOG: flies an exact log again
twin faults IMAGE SCENARIO KEPT [SEEDS] [NAMES]: faults at the pins in a hover that is kept in a file, from which
    further runs begin: those whose names begin so, with so many seeds
twin cuts IMAGE [CUTS] [SEED]: power cut so often while a parameter is written, and while its flash is erased
twin host SCENARIO: the same with the firmware's code on this machine";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let result = match *arguments {
        ["boot", "matekh743", image] => boot::boot::<MatekH743>(Path::new(image)),
        ["boot", "pixracer", image] => boot::boot::<Pixracer>(Path::new(image)),
        ["fly", image, scenario, ref options @ ..] if options.len() <= 2 => {
            let (mut receiver, mut log) = (None, None);
            for option in options {
                match *option {
                    "m8" => receiver = Some(Generation::Eight),
                    "m10" => receiver = Some(Generation::Ten),
                    file => log = Some(Path::new(file)),
                }
            }
            fly::fly(Path::new(image), Path::new(scenario), receiver, log)
        }
        ["replay", log] => std::fs::read(log).map_err(Into::into).and_then(|bytes| same::check_log(&bytes)),
        ["faults", image, scenario, kept, ref options @ ..] if options.len() <= 2 => {
            let (mut seeds, mut only) = (1, "");
            for option in options {
                match option.parse() {
                    Ok(number) => seeds = number,
                    Err(_) => only = *option,
                }
            }
            Aloft::of(Path::new(image), Path::new(scenario), Path::new(kept))
                .and_then(|aloft| faults::fly_all(&aloft, 1..seeds + 1, only))
        }
        ["cuts", image, ref numbers @ ..] if numbers.len() <= 2 => {
            let number = |at: usize, usual| numbers.get(at).map_or(Ok(usual), |text| text.parse());
            number(0, 100)
                .and_then(|cuts| Ok((cuts, number(1, 1)?)))
                .map_err(Into::into)
                .and_then(|(cuts, seed)| cuts::cut_all(Path::new(image), seed, cuts))
        }
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
