//! Runs the flight image of a board, as flashed, on register-level models of the board.
//!
//! Models and processor are those of `rigless`, which is independent of this project.
#![forbid(unsafe_code)]

mod boot;
mod card;
mod card_logs;
mod check;
mod cuts;
mod esc_line;
mod escs;
mod f405;
mod fault_injection;
mod faults;
mod fetch;
mod fly;
mod host;
mod hover_snapshot;
mod impairments;
mod line_answers;
mod machine;
mod machines;
mod mission;
mod parameter_flash;
mod pilot;
mod piloted;
mod pins;
mod radio;
mod random;
mod same;
mod steady;
mod stick_pilots;
mod table;
mod transmitter;
mod ublox;
mod usb_ring;
mod wire;
mod world;

use card::CardFaults;
use clap::builder::PossibleValuesParser;
use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use fly::FlightOptions;
use hover_snapshot::HoverSnapshot;
use machines::MachineName;
use radio::RadioOptions;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use ublox::Generation;

/// GNSS receivers by name: the board's own model, and factory-new u-blox receivers.
const RECEIVERS: [(&str, Option<Generation>); 3] =
    [("nmea", None), ("m8", Some(Generation::Eight)), ("m10", Some(Generation::Ten))];

fn machine_argument() -> Arg {
    let names = MachineName::ALL.map(MachineName::name);
    Arg::new("machine").required(true).value_parser(PossibleValuesParser::new(names)).help("The board")
}

fn file_argument(name: &'static str, help: &'static str) -> Arg {
    Arg::new(name).required(true).value_parser(value_parser!(PathBuf)).help(help)
}

fn image_argument() -> Arg {
    file_argument("image", "The flight image, an ELF file")
}

fn scenario_argument() -> Arg {
    file_argument("scenario", "The scenario's file")
}

fn option(name: &'static str, value: &'static str, help: &'static str) -> Arg {
    Arg::new(name).long(name).value_name(value).help(help)
}

fn whole(name: &'static str, usual: &'static str, help: &'static str) -> Arg {
    option(name, "N", help).value_parser(value_parser!(u64)).default_value(usual)
}

fn mission_argument() -> Arg {
    let mission = Arg::new("mission").long("mission").action(ArgAction::SetTrue);
    mission.help("Fly a mission of two minutes, uploaded over the link, instead of the hover")
}

/// Declares the command line.
fn command() -> Command {
    let phases = whole(
        "\
         phases",
        "\
         40",
        "Number of instants within a control period at which the kill switch's frames \
         arrive",
    );
    let rate =
        whole("rate", "250", "Frames per second of the receiver in the test of the kill switch; may be repeated")
            .value_parser(value_parser!(u64).range(1..=1000))
            .action(ArgAction::Append);
    let kept = file_argument("hover", "File that keeps the hover, from which further runs begin");
    let only = option(
        "\
         only",
        "\
         NAME",
        "Only faults whose names begin with this text; may be \
         repeated",
    )
    .action(ArgAction::Append);
    let seeds = [
        whole(
            "\
         seeds",
            "\
         1",
            "Number of flights for each \
         fault",
        ),
        whole(
            "\
         first",
            "\
         1",
            "Seed of the first \
         flight",
        ),
    ];
    let in_turn = Arg::new("in-turn").long("in-turn").action(ArgAction::SetTrue);
    let in_turn = in_turn.help("Fly only one fault with each seed, the faults in turn, instead of all faults");
    let cuts = [
        whole(
            "\
             cuts",
            "\
             100",
            "Approximate number of cuts in a write, and in an \
             erase",
        ),
        whole(
            "\
             seed",
            "\
             1",
            "Seed of \
             the random numbers",
        ),
    ];
    let escs = Command::new("escs").about("Fly with motor controllers that send telemetry, and stop rotors");
    let lines = Arg::new("lines").long("lines").action(ArgAction::SetTrue);
    let lines = lines.help(
        "The motor controllers answer on the motors' lines (bidirectional DSHOT), not over the \
         telemetry line",
    );
    Command::new("twin")
        .about("Runs a board's flight image, exactly as flashed, on register-level models of the board")
        .subcommand_required(true)
        .arg_required_else_help(true)
        .subcommand(
            Command::new(
                "\
                 boot",
            )
            .about(
                "Boot the image, and check buses and \
                 pins",
            )
            .args([machine_argument(), image_argument()]),
        )
        .subcommand(fly_command())
        .subcommand(Command::new("radio").about("Fly by radio control, and stop the motors by the kill switch").args([
            machine_argument(),
            image_argument(),
            scenario_argument(),
            rate,
            phases,
        ]))
        .subcommand(escs.args([machine_argument(), image_argument(), scenario_argument(), lines]))
        .subcommand(Command::new("replay").about("Replay an exact log").arg(file_argument("log", "The log")))
        .subcommand(
            Command::new("faults")
                .about("Inject faults at a board's pins, starting from a hover that a file keeps")
                .args([machine_argument(), image_argument(), scenario_argument(), kept, only])
                .args(seeds)
                .arg(in_turn),
        )
        .subcommand(
            Command::new("cuts")
                .about("Cut the power while the Matek H743 writes and erases its parameters")
                .arg(image_argument())
                .args(cuts),
        )
        .subcommand(
            Command::new("host")
                .about("Fly a scenario with the firmware's code on this machine")
                .args([scenario_argument(), mission_argument()]),
        )
}

/// Declares the command `fly`, with its options for the memory card.
fn fly_command() -> Command {
    let receiver = Arg::new("receiver")
        .long("receiver")
        .value_parser(PossibleValuesParser::new(RECEIVERS.map(|(name, _)| name)))
        .default_value("nmea")
        .help("GNSS receiver: the board's usual model, or an unconfigured u-blox");
    let seconds = "Seconds of hover, at most six with --fetch; the position error counts from the fourth on";
    let hover = whole("hover", "30", seconds).value_parser(value_parser!(u64).range(4..=3600));
    let log = option(
        "log",
        "FILE",
        "Write the exact log to this file, and replay it on this machine: the results must be \
             the same to the last bit",
    );
    let card = option(
        "card",
        "FOLDER",
        "Copy the logs of the memory card or flash chip to this folder; one of them must cover the whole flight",
    );
    let from_until = |name, help| {
        Arg::new(name).long(name).num_args(2).value_names(["MS", "MS"]).value_parser(value_parser!(u64)).help(help)
    };
    let cut =
        option("card-cut", "MS", "Save the card's content at this time, as if the power was cut then; may be repeated");
    let fetch = Arg::new("fetch").long("fetch").action(ArgAction::SetTrue).requires("card");
    Command::new("fly").about("Take off, hover and land, in lockstep with the plant").args([
        machine_argument(),
        image_argument(),
        scenario_argument(),
        receiver,
        log.value_parser(value_parser!(PathBuf)),
        hover,
        mission_argument(),
        card.value_parser(value_parser!(PathBuf)),
        from_until("card-stall", "Time at which the card stalls, and for how long"),
        from_until("card-out", "Times from which and until which the card is removed"),
        option("card-full", "KB", "Free space on the card").value_parser(value_parser!(u64)),
        cut.action(ArgAction::Append).value_parser(value_parser!(u64)),
        fetch.help("After the flight, list the logs over the link, download parts of one log, and erase all logs"),
    ])
}

/// Returns the path given for an argument.
fn path<'a>(matches: &'a ArgMatches, name: &str) -> Result<&'a Path, Box<dyn Error>> {
    Ok(matches.get_one::<PathBuf>(name).ok_or("no file")?)
}

/// Returns the number given for an argument.
fn number(matches: &ArgMatches, name: &str) -> Result<u64, Box<dyn Error>> {
    Ok(*matches.get_one(name).ok_or("no number")?)
}

/// Returns the board given on the command line.
fn chosen(matches: &ArgMatches) -> Result<MachineName, Box<dyn Error>> {
    let name = matches.get_one::<String>("machine").ok_or("no machine")?;
    Ok(MachineName::ALL.into_iter().find(|machine| machine.name() == name).ok_or("no such machine")?)
}

fn run(matches: &ArgMatches) -> Result<(), Box<dyn Error>> {
    match matches.subcommand() {
        Some(("boot", matches)) => {
            let image = path(matches, "image")?;
            with_machine!(chosen(matches)?, M => boot::boot::<M>(image))
        }
        Some(("fly", matches)) => {
            let (image, scenario) = (path(matches, "image")?, path(matches, "scenario")?);
            let name = matches.get_one::<String>("receiver");
            let receiver = RECEIVERS.into_iter().find(|(receiver, _)| name.is_some_and(|name| name == receiver));
            let receiver = receiver.and_then(|(_, generation)| generation);
            let log = matches.get_one::<PathBuf>("log").map(PathBuf::as_path);
            let card = matches.get_one::<PathBuf>("card").map(PathBuf::as_path);
            let times = |name| {
                let mut times = matches.get_many::<u64>(name)?.copied();
                Some([times.next()?, times.next()?])
            };
            let card_faults = CardFaults { stall_ms: times("card-stall"), out_ms: times("card-out") };
            let (is_mission, fetches) = (matches.get_flag("mission"), matches.get_flag("fetch"));
            let full_kb = matches.get_one("card-full").copied();
            let cuts_ms: Vec<u64> = matches.get_many("card-cut").into_iter().flatten().copied().collect();
            let order = FlightOptions {
                scenario,
                hover_ms: 1000 * number(matches, "hover")?,
                is_mission,
                receiver,
                log,
                card,
                card_faults,
                full_kb,
                cuts_ms: &cuts_ms,
                fetches,
            };
            with_machine!(chosen(matches)?, M => fly::fly::<M>(image, &order))
        }
        Some(("radio", matches)) => {
            let (image, scenario) = (path(matches, "image")?, path(matches, "scenario")?);
            let rates: Vec<u64> = matches.get_many("rate").into_iter().flatten().copied().collect();
            let order = RadioOptions { scenario, rates: &rates, phases: number(matches, "phases")? };
            with_machine!(chosen(matches)?, M => radio::fly::<M>(image, &order))
        }
        Some(("escs", matches)) => {
            let (image, scenario) = (path(matches, "image")?, path(matches, "scenario")?);
            with_machine!(chosen(matches)?, M => escs::fly::<M>(image, scenario, matches.get_flag("lines")))
        }
        Some(("replay", matches)) => same::check_log(&std::fs::read(path(matches, "log")?)?),
        Some(("faults", matches)) => {
            let [image, scenario, hover] = ["image", "scenario", "hover"].map(|name| path(matches, name));
            let (image, scenario, hover) = (image?, scenario?, hover?);
            let first = number(matches, "first")?;
            let seeds = first..first + number(matches, "seeds")?;
            let names: Vec<_> = matches.get_many::<String>("only").into_iter().flatten().map(String::as_str).collect();
            let in_turn = matches.get_flag("in-turn");
            with_machine!(chosen(matches)?, M => {
                faults::fly_all(&HoverSnapshot::<M>::of(image, scenario, hover)?, seeds, &names, in_turn)
            })
        }
        Some(("cuts", matches)) => {
            cuts::cut_all(path(matches, "image")?, number(matches, "seed")?, number(matches, "cuts")?)
        }
        Some(("host", matches)) => host::fly(path(matches, "scenario")?, matches.get_flag("mission")),
        _ => Err("no such command".into()),
    }
}

fn main() -> ExitCode {
    match run(&command().get_matches()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("twin: {error}");
            ExitCode::FAILURE
        }
    }
}
