//! Checks bus times against manual calculations, the boards against `firmware/boards/`, and the tables of
//! `docs/reference/timing-tables.md`.
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::unwrap_used,
    missing_docs,
    reason = "a file that cannot be read must stop the test"
)]

use pil::response::PeriodicTask;
use pil::timing::{
    BOARDS, CORTEX_M4F, CORTEX_M7, CycleLimit, InstructionCounts, KnownLateness, RateOfUart, TABLES, TimingRow,
    default_baud, i2c_ns, page, reports, spi_clock_hz, spi_ns, verdicts,
};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap()
}

#[test]
fn the_page_has_the_tables() {
    let text = read("docs/reference/timing-tables.md");
    let written = page(&text, &reports(&read("docs/budgets.md")).unwrap()).unwrap();
    assert_eq!(text, written, "cargo run --release -p pil --bin timing");
}

/// The page promises that a tick's motor frame is sent before the next tick. The only exception is a Pixracer with both
/// links full in both directions, whose response has no bound. With all fetches hitting the cache, every board is in
/// time.
#[test]
fn the_tick_is_in_time() {
    let work = InstructionCounts::read(&read("docs/budgets.md")).unwrap();
    for board in &BOARDS {
        for limit in [CycleLimit::Best, CycleLimit::Bound] {
            let rows = work.rows(board, limit, default_baud());
            let tick = rows.iter().find(|row| row.name.starts_with("control tick")).unwrap();
            let is_in_time = tick.response_ns.is_some_and(|response| Some(response) <= tick.deadline_ns);
            let has_bound = board.name != "pixracer" || limit == CycleLimit::Best;
            assert_eq!(is_in_time, has_bound, "{}, {limit:?}", board.name);
        }
    }
}

/// The page says that at the default baud rate no byte is lost, but that at twice the rate bytes can be lost on an
/// STM32F4. At half the rate only the links' task may be late.
#[test]
fn the_baud_rate_is_the_highest_that_loses_no_byte() {
    let work = InstructionCounts::read(&read("docs/budgets.md")).unwrap();
    for board in &BOARDS {
        let late = |baud| {
            let rows = work.rows(board, CycleLimit::Bound, baud);
            rows.iter().filter(|row| row.is_late()).map(|row| row.name).collect::<Vec<_>>()
        };
        let (as_it_is, twice) = (late(default_baud()), late(2 * default_baud()));
        assert!(!as_it_is.iter().any(|name| name.contains("byte")), "{}: {as_it_is:?}", board.name);
        assert_eq!(twice.contains(&"first link: byte received"), board.uart_keeps == 1, "{}: {twice:?}", board.name);
        let half = late(default_baud() / 2);
        assert!(half.iter().all(|name| *name == "links' task"), "{}: {half:?}", board.name);
    }
}

fn row(name: &'static str, response_us: Option<u64>) -> TimingRow {
    let task = PeriodicTask { priority: 1, period_ns: 10_000, jitter_ns: 0, cost_ns: 1_000, blocking_ns: 0 };
    TimingRow { name, task, deadline_ns: Some(10_000), response_ns: response_us.map(|response_us| 1000 * response_us) }
}

/// Late rows fail the check unless they are known and no later than known. A known row that is in time fails it, too.
#[test]
fn what_is_known_is_not_loosened() {
    let known = |most_us, at_best| KnownLateness { row: "byte", most_us, at_best, reason: "" };
    for (listed, best_us, most_us, wrong) in [
        (None, 5, Some(10), None),
        (None, 5, Some(11), Some("byte: over its deadline")),
        (None, 5, None, Some("byte: over its deadline")),
        (Some(known(Some(12), false)), 5, Some(12), None),
        (Some(known(Some(12), false)), 5, Some(13), Some("byte: later than known.rs allows")),
        (Some(known(Some(12), false)), 5, None, Some("byte: later than known.rs allows")),
        (Some(known(None, false)), 5, None, None),
        (Some(known(None, false)), 11, None, Some("byte: late even in the best case")),
        (Some(known(None, true)), 11, None, None),
        (
            Some(known(Some(12), false)),
            5,
            Some(10),
            Some("byte: listed as late, but in time; delete the entry in known.rs"),
        ),
    ] {
        let listed: Vec<_> = listed.into_iter().collect();
        let found = verdicts(&listed, &[row("byte", Some(best_us))], &[row("byte", most_us)]);
        assert_eq!(found, wrong.into_iter().collect::<Vec<_>>(), "{listed:?} {best_us} {most_us:?}");
    }
    let gone = verdicts(&[known(None, false)], &[], &[]);
    assert_eq!(gone, ["byte: listed in known.rs as late, but there is no such task"]);
}

/// A UART of the STM32F4 keeps one byte (RM0090, 30.3.3), one of the STM32H743 sixteen (RM0433, 48.3).
#[test]
fn uarts_keep_what_their_manuals_say() {
    let kept: Vec<_> = BOARDS.iter().map(|board| (board.name, board.uart_keeps)).collect();
    assert_eq!(kept, [("stm32f405", 1), (TABLES, 1), ("pixracer", 1), ("stm32h743", 16)]);
}

#[test]
fn a_page_that_lacks_a_row_is_refused() {
    let text = read("docs/budgets.md");
    assert!(InstructionCounts::read(&text).is_ok());
    let error = InstructionCounts::read(&text.replace("SysTick's interrupt |", "its interrupt |")).unwrap_err();
    assert!(error.to_string().contains("SysTick"), "{error}");
}

#[test]
fn buses_by_hand() {
    // 15 bytes at 1 MHz: 14 data bytes and a register. A byte at 921,600 baud.
    assert_eq!(spi_ns(15, 1_000_000), 120_000);
    assert_eq!(RateOfUart::Link.byte_ns(921_600), 10_850);
    // UM10204: start, address, register, start, address, one byte, stop: 39 bits of 2.5 us.
    assert_eq!(i2c_ns(4, 3), 97_500);
    // Prescalers in RM0090: f/2 to f/256.
    assert_eq!(spi_clock_hz(84_000_000, 24_000_000), 21_000_000);
    assert_eq!(spi_clock_hz(84_000_000, 42_000_000), 42_000_000);
    assert_eq!(spi_clock_hz(84_000_000, 1_000_000), 656_250);
    assert_eq!(spi_clock_hz(84_000_000, 1_000), 328_125);
}

/// A reading of an ICM-42688-P: temperature, force and rates (14 bytes) and a configuration byte, each after a register
/// address.
#[test]
fn a_script_is_walked() {
    let board = BOARDS.iter().find(|board| board.name == "stm32h743").unwrap();
    let script = board.scripts().into_iter().find(|script| script.part == "ICM-42688-P").unwrap();
    assert_eq!((script.bytes, script.transfers, script.clock_hz), (17, 2, 12_500_000));
    assert_eq!(script.time_ns, 9_600 + 1_280);
}

#[test]
fn limits_of_the_cores() {
    for core in [&CORTEX_M4F, &CORTEX_M7] {
        let [best, bound] = [CycleLimit::Best, CycleLimit::Bound].map(|limit| core.per_instruction(limit));
        assert!(best < bound && core.per_cached(CycleLimit::Bound) < bound, "{}", core.name);
        assert!(core.exception_ns(CycleLimit::Best) < core.exception_ns(CycleLimit::Bound));
    }
    // Arm's Cortex-M4 issues one instruction at a time.
    assert!(CORTEX_M4F.per_instruction(CycleLimit::Best) >= 1.0);
    assert!(CORTEX_M7.per_instruction(CycleLimit::Best) >= 0.5);
}

/// Every board in `firmware/boards/` has times, with its links and parts.
#[test]
fn boards_are_those_of_the_project() {
    let within = |path: &Path| fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()).collect::<Vec<_>>();
    let codes: Vec<_> = within(&root().join("firmware/boards")).into_iter().filter(|path| path.is_dir()).collect();
    let mut files: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for folder in codes.iter().filter(|path| !path.ends_with("emulated")) {
        let own = folder.file_name().unwrap().to_str().unwrap();
        let (programs, sources): (Vec<_>, Vec<_>) = within(&folder.join("src")).into_iter().partition(|it| it.is_dir());
        files.insert(own, vec![sources]);
        let tables = programs.iter().flat_map(|programs| within(programs)).map(|table| vec![table]);
        files.entry(TABLES).or_default().extend(tables);
    }
    assert!(files[TABLES].len() >= 6);
    assert!(files.keys().copied().eq(BOARDS.iter().map(|board| board.name).collect::<BTreeSet<_>>()), "{files:?}");
    for board in &BOARDS {
        let parts: BTreeSet<_> = board.scripts().iter().map(|script| name_in_code(script.part)).collect();
        for files in &files[board.name] {
            let code: String = files.iter().map(|path| fs::read_to_string(path).unwrap()).collect();
            let uses = code.lines().filter_map(|line| line.strip_prefix("use afbc_drivers::"));
            let used: String = uses.collect();
            let words: BTreeSet<_> = used.split(|c: char| !c.is_alphanumeric()).filter(|word| is_part(word)).collect();
            assert!(words.iter().all(|word| parts.contains(*word)), "{files:?}: {words:?}, not {parts:?}");
            let is_table = code.contains("flight_controller! {");
            assert_eq!(is_table, board.name == TABLES, "{files:?}");
            let uarts = if is_table { 1 } else { code.matches("link::config()").count() };
            assert_eq!(uarts, board.links, "{files:?}");
        }
    }
}

/// Returns true for the name of a part's type: it begins with an upper-case letter and has digits.
fn is_part(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_uppercase())
        && word.contains(|c: char| c.is_ascii_digit())
        && !word.starts_with("CW")
        && !word.ends_with("Registers")
}

/// Returns the type name of a part, such as `Icm42688p` for ICM-42688-P.
fn name_in_code(part: &str) -> &str {
    match part {
        "ICM-42688-P" => "Icm42688p",
        "ICM-42605" => "Icm42605",
        "ICM-20602" => "Icm20602",
        "ICM-20608-G" => "Icm20608",
        "ICM-20689" => "Icm20689",
        "MPU-6000" => "Mpu6000",
        "MPU-6500" => "Mpu6500",
        "MPU-9250" => "Mpu9250",
        "BMI270" => "Bmi270",
        "SPL06-001" => "Spl06",
        "DPS310" => "Dps310",
        "BMP280" => "Bmp280",
        "MS5611" => "Ms5611",
        "LIS3MDL" => "Lis3mdl",
        "QMC5883L" => "Qmc5883l",
        other => other,
    }
}
