//! Measures the firmware's cost and writes the table of `docs/budgets.md`. With `--check`, it searches for the worst
//! tick from fewer seeds and writes nothing. Fails if a budget is exceeded. Both images must have been built.

use afbc_hil::Station;
use pil::background::BackgroundInstructions;
use pil::budget::{ESTIMATING_INSTRUCTIONS_MAX, FRAME_BYTES, LEVELS, LinkedImage, TICK_INSTRUCTIONS_MAX};
use pil::exercise::{TICKS, bytes_of_tick};
use pil::worst_tick::{StateSource, search};
use pil::{Emulator, Error, FirmwareImage};
use std::path::Path;
use std::process::ExitCode;

/// Page with the table.
const DOCUMENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/budgets.md");
const BEGIN: &str = "<!-- budgets: written by cargo run --release -p pil --bin budgets -->\n";
const END: &str = "<!-- end -->\n";

/// Functions that end the program to start the chip's boot loader.
const BOOT_LOADER: [&str; 2] = ["chip_stm32::boot_loader::enter", "cortex_m::asm::bootload"];
/// Start-up functions that run before the links' task is spawned (`firmware::run`), and the interrupt of that task's
/// executor, which has nothing to do until then.
const BEFORE_LINKS: [&str; 2] = ["firmware::read", "firmware::control::make"];
const LINKS: &str = "CAN2_RX0";
/// Name of the control tick's function.
const TICK: &str = "firmware::control::tick";

/// Interrupts whose tasks are not needed in flight: a panic in such a task ends only that task.
const DISPENSABLE: [&str; 3] = ["CAN2_RX0", "CAN2_RX1", "OTG_FS"];
/// Number of panics in the motors' output, all in its driver (`docs/budgets.md` lists them).
const VITAL_PANICS: u64 = 6;

/// Number of searches for the worst tick, each from another seed, and candidates per search: the result of a single
/// search is partly luck.
const SEARCHES: u64 = 8;
/// Number of searches with `--check`. On 2026-11-27 two searches came within three instructions of the result of eight,
/// in a quarter of the time.
const SEARCHES_OF_CHECK: u64 = 2;
const CANDIDATES: u64 = 500;

/// A line of the table.
struct Budget {
    what: &'static str,
    unit: &'static str,
    measured: u64,
    /// Largest value allowed; none if the figure is only informative.
    most: Option<u64>,
}

fn main() -> ExitCode {
    match run() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("budgets: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Returns true if every budget is met.
fn run() -> Result<bool, Error> {
    let flight = LinkedImage::read(&FirmwareImage::Flight.find()?)?;
    let tick = flight.reach(TICK)?;
    for (name, bytes) in &tick.deepest {
        println!("{bytes:6} bytes of stack: {name}");
    }
    for chain in &tick.doubles {
        println!("computes in double precision: {}", chain.join(" > "));
    }
    println!("calls through a pointer, assumed to be the executor's waker: {}", tick.indirect.join(", "));

    // The deepest call chain of start-up, plus one interrupt of each level.
    let start_up = flight.reach("main")?;
    let callers: Vec<_> =
        start_up.indirect.iter().map(String::as_str).filter(|name| !BOOT_LOADER.contains(name)).collect();
    if !callers.is_empty() {
        let callers = callers.join(", ");
        return Err(Error::Protocol(format!(
            "start-up calls through a pointer in {callers}; the proof does not follow these calls"
        )));
    }
    // Stack of start-up before the links' task exists, and afterwards.
    let before = start_up.stack_bytes;
    let after = flight.reach_without("main", &BEFORE_LINKS)?.stack_bytes;
    let mut nested = [before, after];
    println!("{after:6} bytes of stack: start-up once the links' task exists, and the idle loop");
    println!("{before:6} bytes of stack: start-up, of which:");
    for (name, bytes) in start_up.deepest.iter().filter(|(_, bytes)| *bytes > 0) {
        println!("    {bytes:6} {name}");
    }
    let (mut vital, mut dispensable) = (tick.panics.clone(), Vec::new());
    for (priority, interrupts) in LEVELS {
        let mut deepest = 0;
        for interrupt in interrupts {
            let reach = flight.reach(interrupt)?;
            deepest = deepest.max(reach.stack_bytes + FRAME_BYTES);
            println!("{:6} bytes of stack: {interrupt}, priority {priority}", reach.stack_bytes + FRAME_BYTES);
            let panics = if DISPENSABLE.contains(interrupt) { &mut dispensable } else { &mut vital };
            panics.extend(reach.panics);
        }
        let [before, after] = &mut nested;
        *after += deepest;
        if *interrupts != [LINKS] {
            *before += deepest;
        }
    }
    let nested = nested.into_iter().max().unwrap_or_default();
    for panics in [&mut vital, &mut dispensable] {
        panics.sort();
        panics.dedup();
    }
    for chain in &vital {
        println!("stops the motors: {}", chain.join(" > "));
    }
    for chain in &dispensable {
        println!("panics in a task that the flight does not need: {}", chain.join(" > "));
    }

    let check = std::env::args().any(|argument| argument == "--check");
    let searches = if check { SEARCHES_OF_CHECK } else { SEARCHES };
    let [min, mean, max, stack] = fly()?;
    let max = max.max(worst(StateSource::Link, searches)?);
    let estimating = worst(StateSource::Estimate, searches)?;
    let background = BackgroundInstructions::count(&FirmwareImage::Flight.find()?)?;
    let line = |what, unit, measured, most| Budget { what, unit, measured, most };
    let budgets = [
        line("control tick, worst", "instructions", max, Some(TICK_INSTRUCTIONS_MAX.into())),
        line(
            "control tick with the estimate, worst",
            "instructions",
            estimating,
            Some(ESTIMATING_INSTRUCTIONS_MAX.into()),
        ),
        line("DSHOT frames of four motors", "instructions", background.dshot.into(), Some(1_500)),
        line("SysTick's interrupt", "instructions", background.systick.into(), Some(200)),
        line("USART1's interrupt, for a byte", "instructions", background.byte.into(), Some(250)),
        line("link's task per wake-up, most seen", "instructions", background.wake.into(), None),
        line("control tick, mean", "instructions", mean, None),
        line("control tick, least", "instructions", min, None),
        line("stack of the control tick, worst case", "bytes", tick.stack_bytes.into(), Some(4_608)),
        line("stack of everything, worst case", "bytes", nested.into(), Some(64 * 1024)),
        line("stack of everything, deepest seen in the pil image", "bytes", stack, None),
        line("panics reachable from the control tick", "", tick.panics.len() as u64, Some(0)),
        line("double-precision arithmetic reachable from the control tick", "", tick.doubles.len() as u64, Some(0)),
        line(
            "panics reachable from other interrupts that the flight needs",
            "",
            vital.len() as u64,
            Some(VITAL_PANICS),
        ),
        line(
            "panics reachable from link, housekeeping and USB, which do not end the flight",
            "",
            dispensable.len() as u64,
            None,
        ),
        line("flash", "bytes", flight.flash_bytes, Some(464 * 1024)),
        line("static RAM, without the stack", "bytes", flight.ram_bytes, Some(48 * 1024)),
    ];
    let table = table(&budgets);
    print!("{table}");
    if !check {
        write(&table)?;
    }
    Ok(budgets.iter().all(|budget| budget.most.is_none_or(|most| budget.measured <= most)))
}

/// Returns the instructions of the worst tick that any search found.
fn worst(source: StateSource, searches: u64) -> Result<u64, Error> {
    let mut worst = 0;
    for seed in 1..=searches {
        let found = search(Emulator::start(&FirmwareImage::Pil.find()?)?, source, seed, CANDIDATES)?;
        println!(
            "{source:?}, seed {seed}: of {} candidate ticks, number {} is the worst, with {} instructions",
            found.candidates, found.candidate, found.instructions
        );
        worst = worst.max(found.instructions.into());
    }
    Ok(worst)
}

/// Returns the least, mean and most instructions of a tick with motors on, and the deepest stack \[bytes\].
fn fly() -> Result<[u64; 4], Error> {
    let mut emulator = Emulator::start(&FirmwareImage::Pil.find()?)?;
    let mut station = Station::default();
    let (mut min, mut sum, mut count, mut max, mut stack) = (u64::MAX, 0, 0, 0, 0);
    for tick in 0..TICKS {
        let reply = emulator.exchange(&bytes_of_tick(&mut station, tick))?;
        stack = reply.stack_bytes.into();
        if reply.throttles.iter().any(|throttle| *throttle != 0) {
            let instructions = reply.instructions.into();
            min = min.min(instructions);
            max = max.max(instructions);
            sum += instructions;
            count += 1;
        }
    }
    if count == 0 {
        return Err(Error::Protocol("the motors never turned".into()));
    }
    Ok([min, sum / count, max, stack])
}

fn table(budgets: &[Budget]) -> String {
    let mut table = String::from("| | measured | at most | |\n|---|---:|---:|---|\n");
    for Budget { what, unit, measured, most } in budgets {
        let limit = most.map_or_else(String::new, |most| most.to_string());
        let verdict = match most {
            Some(most) if measured > most => "**over**",
            _ => "",
        };
        table += &format!("| {what} | {measured} {unit} | {limit} | {verdict} |\n");
    }
    table
}

/// Writes the table between the markers of the page.
fn write(table: &str) -> Result<(), Error> {
    let path = Path::new(DOCUMENT);
    let text = std::fs::read_to_string(path)?;
    let unmarked = || Error::Protocol(format!("{} lacks the markers of the table", path.display()));
    let (before, rest) = text.split_once(BEGIN).ok_or_else(unmarked)?;
    let (_, after) = rest.split_once(END).ok_or_else(unmarked)?;
    Ok(std::fs::write(path, [before, BEGIN, table, END, after].concat())?)
}
