//! Checks of the boards: each meets the firmware in one place, uses nothing twice and gives every interrupt the
//! priority of its purpose, and the documented wiring is that of the code.
//!
//! The compiler already refuses a pin on the wrong peripheral, a DMA stream of another request, the wrong channel of a
//! timer, and any of them used twice. The linker refuses two handlers for an interrupt, and an image that is too large.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs)] // unreadable code must stop it

use crate::board_table::{Battery, BoardTable, LogBus, Motor, Stream, Timer, row, wiring};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// File of the macro that makes an image of a table.
const TABLES: &str = "firmware/chips/stm32f4/src/flight_controller.rs";

/// Returns every Rust file below `folder`, with its text.
fn sources(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("target") {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push((path.clone(), fs::read_to_string(&path).unwrap()));
        }
    }
    found
}

/// Returns the names of pins in `text`, such as PA13.
fn pins(text: &str) -> BTreeSet<String> {
    let words = text.split(|c: char| !c.is_ascii_alphanumeric());
    let is_pin = |word: &&str| {
        word.strip_prefix('P').is_some_and(|rest| {
            let number = rest.trim_start_matches(|c: char| c.is_ascii_uppercase());
            rest.len() == number.len() + 1 && number.parse::<u8>().is_ok_and(|number| number < 16)
        })
    };
    words.filter(is_pin).map(str::to_owned).collect()
}

/// A board written in code calls the firmware once in its folder. A board described by a table calls the firmware once
/// in its file.
#[test]
fn every_board_meets_the_firmware_once() {
    let (tables, mut codes) = kinds();
    codes.push(root().join("firmware/boards/emulated"));
    for board in codes {
        for met in ["firmware::image!(", "impl Board for "] {
            let count = |path: &str| fs::read_to_string(board.join(path)).unwrap().matches(met).count();
            assert_eq!(count("src/main.rs") + count("src/board.rs"), 1, "{}: {met}", board.display());
        }
    }
    for (board, table) in tables {
        let text = fs::read_to_string(&board).unwrap();
        assert_eq!(text.matches("::flight_controller! {").count(), 1, "{table:?}");
        assert!(!text.contains("firmware::") && !text.contains("unsafe"), "{}", board.display());
    }
    assert!(root().join("memory.x").is_file());
}

/// Every board has a page that is listed in the book and has the required sections.
#[test]
fn every_board_has_a_page() {
    let contents = fs::read_to_string(root().join("docs/SUMMARY.md")).unwrap();
    let (tables, codes) = kinds();
    for board in codes.iter().chain(tables.iter().map(|(board, _)| board)) {
        let name = name_of(board);
        assert!(contents.contains(&format!("(boards/{name}.md)")), "{name}");
        let page = fs::read_to_string(root().join(format!("docs/boards/{name}.md"))).unwrap();
        for wanted in [
            "\n## What works\n".to_owned(),
            "\n## First steps, propellers off\n".to_owned(),
            format!("cargo xtask flash {name} --vehicle "),
            "bring-up --connect serial:/dev/tty".to_owned(),
            "\n## What has run where\n".to_owned(),
            "run on silicon yet".to_owned(),
        ] {
            assert!(page.contains(&wanted), "{name}: {wanted}");
        }
    }
}

/// The firmware selects no board by `#[path]` or conditional compilation, and names no chip.
#[test]
fn the_firmware_knows_no_board() {
    let manifest = fs::read_to_string(root().join("firmware/Cargo.toml")).unwrap();
    let firmware = sources(&root().join("firmware/src"));
    assert!(firmware.len() >= 7, "{firmware:?}");
    for (path, text) in firmware {
        assert!(pins(&text).is_empty(), "{}: {:?}", path.display(), pins(&text));
        for choice in ["cfg(", "cfg_attr", "peripherals::", "board_"] {
            assert!(!text.contains(choice), "{}: {choice}", path.display());
        }
        for chip in ["stm32", "f405", "h743", "usart", "can2"] {
            for text in [&text, &manifest] {
                assert!(!text.to_lowercase().contains(chip), "{}: {chip}", path.display());
            }
        }
    }
    for folder in ["crates", "firmware", "sitl", "tests/src", "tests/tests"] {
        for (path, text) in sources(&root().join(folder)) {
            let is_moved = text.lines().any(|line| line.trim_start().starts_with("#[") && line.contains("path = "));
            assert!(!is_moved, "{}", path.display());
        }
    }
}

#[test]
fn the_wiring_is_what_the_board_uses() {
    for (board, page, heading, count) in [
        ("stm32f405", "boards/stm32f405.md", "\n## Wiring", 8),
        ("stm32h743", "boards/stm32h743.md", "\n## Wiring", 42),
        ("pixracer", "boards/pixracer.md", "\n## Wiring", 44),
    ] {
        let text = fs::read_to_string(root().join("docs").join(page)).unwrap();
        let table = text.split_once(heading).unwrap().1.split("\n#").next().unwrap();
        let code = code_of(&root().join("firmware/boards").join(board));
        let (head, body) = code.split_once("\nuse ").unwrap();
        assert_eq!(pins(body).len(), count, "{board}: {:?}", pins(body));
        // The chip fixes the pins of crystal and debugger.
        let fixed = ["PH0", "PH1", "PA13", "PA14"].map(str::to_owned).into();
        assert_eq!(&pins(table) - &fixed, pins(body), "docs/{page}, {board}");
        assert_eq!(&pins(head) - &fixed, pins(body), "the table of {board} itself");
    }
}

/// Returns a board's code.
fn code_of(board: &Path) -> String {
    fs::read_to_string(board.join("src/board.rs")).unwrap()
}

/// Returns the sorted contents of a folder; none if the folder is missing.
fn within(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<_> = fs::read_dir(folder).into_iter().flatten().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths
}

/// Returns all boards of the firmware. The first list has each board that is described by a table, as the table's file
/// and the table. The second list has the folders of the boards written in code.
fn kinds() -> (Vec<(PathBuf, BoardTable)>, Vec<PathBuf>) {
    let codes =
        within(&root().join("firmware/boards")).into_iter().filter(|path| path.is_dir() && !path.ends_with("emulated"));
    let codes: Vec<_> = codes.collect();
    let tables = codes.iter().flat_map(|folder| within(&folder.join("src/bin")));
    let tables: Vec<_> = tables.map(|path| (path.clone(), BoardTable::read(&path))).collect();
    assert!(tables.len() >= 6 && codes.len() >= 3, "{tables:?} {codes:?}");
    (tables, codes)
}

/// Returns the name of a board, from its table's file or its folder.
fn name_of(board: &Path) -> &str {
    let name = board.file_stem().unwrap().to_str().unwrap();
    if board.is_dir() { name } else { name.strip_prefix("flight-").unwrap() }
}

/// Returns the chip of a board, as its package names it.
fn chip_of(board: &Path) -> String {
    let manifests = board.ancestors().map(|folder| folder.join("Cargo.toml"));
    let text = manifests.into_iter().find_map(|manifest| fs::read_to_string(manifest).ok()).unwrap();
    text.split_once("\nchip = \"").unwrap().1.split('"').next().unwrap().to_owned()
}

/// Returns the rest of each word of `text` that begins with `start`.
fn names_after<'a>(text: &'a str, start: &'a str) -> Vec<&'a str> {
    let is_end = |c: char| !c.is_ascii_alphanumeric() && c != '_';
    text.split(start).skip(1).map(|rest| rest.split(is_end).next().unwrap()).collect()
}

/// Returns the interrupt lines that the first `firmware::image!` of a file gives to the executors.
fn executors(file: &Path) -> Vec<String> {
    let text = fs::read_to_string(file).unwrap();
    let image = text.split_once("firmware::image!(").unwrap().1.split_once(");").unwrap().0;
    let words: Vec<_> = image.split([',', '\n']).filter_map(|word| word.split_once(": ")).collect();
    words.iter().map(|(_, line)| line.trim().to_owned()).collect()
}

fn assert_once<T: Ord + std::fmt::Debug>(what: Vec<T>, board: &Path) {
    let count = what.len();
    let once: BTreeSet<_> = what.into_iter().collect();
    assert_eq!(once.len(), count, "{}: one of {once:?} is there twice", board.display());
}

#[test]
fn nothing_is_used_twice() {
    let of_tables = executors(&root().join(TABLES));
    assert_eq!(of_tables.len(), 6, "with that of the logs: {of_tables:?}");
    for (board, table) in kinds().0 {
        let BoardTable { link, gnss, radio, escs, imu, i2c, timers, logs, .. } = &table;
        let radio = radio.as_ref().map(|radio| &radio.uart.name);
        let escs = escs.as_ref().map(|escs| &escs.name);
        assert_once(table.pins(), &board);
        let names = [&link.name, &gnss.name, &imu.name, &i2c.name].into_iter().chain(escs);
        let others = timers.iter().map(|timer| &timer.name).chain(logs.iter().map(|logs| &logs.name));
        assert_once(names.chain(radio).chain(others).collect(), &board);
        let mut motors: Vec<_> = table.motors().map(|motor| motor.number).collect();
        motors.sort_unstable();
        assert_eq!(motors, (1..=table.outputs).collect::<Vec<_>>(), "{}", board.display());
        let streams = table.streams().into_iter().map(|stream| stream.line.clone());
        let lines =
            streams.chain(i2c.lines.clone()).chain([&link.name, &gnss.name, &imu.ready.line].map(String::clone));
        let lines = lines.chain(escs.cloned());
        assert_once(lines.chain(radio.cloned()).chain(of_tables.clone()).collect(), &board);
    }
    for board in kinds().1 {
        let code = code_of(&board);
        let bound = code.split_once("bind_interrupts!(").unwrap().1.split_once("});").unwrap().0;
        let lines = bound.lines().filter_map(|line| line.split_once(" => ")).map(|(line, _)| line.trim().to_owned());
        assert_once(lines.chain(executors(&board.join("src/main.rs"))).collect(), &board);
    }
}

/// Pins with the same number share an EXTI line on all ports. No board uses a line twice, each line matches its pin,
/// and its interrupt is the one in the chips' manuals (RM0090, RM0433).
#[test]
fn every_line_of_external_interrupts_is_that_of_one_pin() {
    let interrupt = |line: usize| match line {
        0..=4 => format!("EXTI{line}"),
        5..=9 => "EXTI9_5".to_owned(),
        _ => "EXTI15_10".to_owned(),
    };
    let mut count = 0;
    let mut assert_lines = |board: &Path, wired: &[(String, String)], bound: &BTreeSet<String>| {
        let mut interrupts = BTreeSet::new();
        for (pin, channel) in wired {
            let number: usize = channel.strip_prefix("EXTI").unwrap().parse().unwrap();
            assert_eq!(pin[2..], number.to_string(), "{}: {pin} on {channel}", board.display());
            interrupts.insert(interrupt(number));
        }
        assert_once(wired.iter().map(|(_, channel)| channel).collect(), board);
        assert_eq!(interrupts, *bound, "{}", board.display());
        count += wired.len();
    };
    let (tables, codes) = kinds();
    let expected = tables.len() + 2 + 2;
    for (board, table) in tables {
        let ready = &table.imu.ready;
        assert_lines(&board, &[(ready.pin.clone(), ready.channel.clone())], &[ready.line.clone()].into());
    }
    for board in codes {
        let code = code_of(&board);
        let wired = code.split("InterruptPin::new(p.").skip(1).map(|rest| {
            let (pin, rest) = rest.split_once(", p.").unwrap();
            (pin.to_owned(), rest.split_once(',').unwrap().0.to_owned())
        });
        let bound = handlers(&code).into_iter().filter(|(_, handler)| handler.contains("exti::InterruptHandler"));
        assert_lines(&board, &wired.collect::<Vec<_>>(), &bound.map(|(line, _)| line).collect());
    }
    assert_eq!(count, expected);
}

/// Names that a table repeats agree with each other.
#[test]
fn streams_have_their_interrupts_and_motors_their_pins() {
    for (board, table) in kinds().0 {
        for Stream { channel, line } in table.streams() {
            assert_eq!(channel.replace("_CH", "_STREAM"), *line, "{}", board.display());
        }
        for Motor { pin, port, bit, .. } in table.motors() {
            assert_eq!(*pin, format!("P{}{bit}", port.strip_prefix("GPIO").unwrap()), "{}", board.display());
        }
        assert_eq!(table.i2c.lines, ["EV", "ER"].map(|line| format!("{}_{line}", table.i2c.name)));
        for Timer { name, word, .. } in &table.timers {
            // TIM2 and TIM5 have 32 bits (RM0090).
            let is_wide = ["TIM2", "TIM5"].contains(&name.as_str());
            assert_eq!(word, if is_wide { "u32" } else { "u16" }, "{}", board.display());
        }
    }
    // In boards in code, the motor pins are those that are held low after a panic.
    for board in kinds().1 {
        let code = code_of(&board);
        let driven: BTreeSet<_> = names_after(&code, "pin(p.").into_iter().map(str::to_owned).collect();
        let mut held = BTreeSet::new();
        for call in code.split("hold_low(pac::GPIO").skip(1) {
            let (port, rest) = call.split_once(", ").unwrap();
            let numbers: Vec<usize> = match rest.strip_prefix('[') {
                Some(list) => list.split_once(']').unwrap().0.split(", ").map(|it| it.parse().unwrap()).collect(),
                None => {
                    let (first, last) = rest.split_once(')').unwrap().0.split_once("..=").unwrap();
                    (first.parse().unwrap()..=last.parse().unwrap()).collect()
                }
            };
            held.extend(numbers.iter().map(|number| format!("P{port}{number}")));
        }
        assert_eq!(driven, held, "{}", board.display());
        assert!(driven.len() >= 4, "{}", board.display());
    }
}

/// Interrupts of serial ports have the highest priority, then those of IMU and its transfers, motors, slow sensors and
/// memory card.
#[test]
fn every_interrupt_has_the_priority_of_its_purpose() {
    let table = fs::read_to_string(root().join(TABLES)).unwrap();
    let purposes: BTreeMap<_, _> = [
        ("$link", "UART"),
        ("$gnss", "UART"),
        ("$radio", "UART"),
        ("$escs", "UART"),
        ("$spi_tx_line", "SAMPLING"),
        ("$spi_rx_line", "SAMPLING"),
        ("$exti_line", "SAMPLING"),
        ("$event", "AIDING"),
        ("$error", "AIDING"),
        ("$i2c_tx_line", "AIDING"),
        ("$i2c_rx_line", "AIDING"),
        ("$line", "MOTOR_DMA"),
    ]
    .into();
    assert_eq!(prioritised(&table), purposes.iter().map(|(line, of)| (line.to_string(), of.to_string())).collect());
    assert_eq!(handlers(&table).into_keys().collect::<Vec<_>>(), purposes.keys().copied().collect::<Vec<_>>());

    for board in kinds().1 {
        let code = code_of(&board);
        let priorities = prioritised(&code);
        let handlers = handlers(&code);
        assert!(priorities.keys().eq(handlers.keys()), "{}: {priorities:?} {handlers:?}", board.display());
        let motors: Vec<_> = code.split("Motors<").skip(1).filter_map(|it| it.split(", ").nth(1)).collect();
        // `card` holds the peripherals that the card's interface takes.
        let card = code.split_once("Sdmmc::new_4bit(").map_or("", |(_, call)| call.split(')').next().unwrap());
        let card: Vec<_> = names_after(card, "p.").iter().map(|name| format!("<{name}>")).collect();
        for (line, handler) in handlers {
            let priority = priorities[&line].as_str();
            let fits = match handler.split("::").next().unwrap() {
                "usart" => priority == "UART",
                "i2c" => priority == "AIDING",
                "StampHandler<EXTI2>" | "StampHandler<EXTI15_10>" => priority == "SAMPLING",
                _ if card.iter().any(|part| handler.contains(part)) => priority == "LOGGING",
                _ if motors.iter().any(|motor| handler.contains(motor)) => priority == "MOTOR_DMA",
                _ => ["SAMPLING", "AIDING"].contains(&priority),
            };
            assert!(fits, "{}: {line} has priority {priority}", board.display());
        }
    }
}

/// Returns the interrupts that the code binds, with their handlers. USB is left out, since its driver sets its own
/// priority.
fn handlers(code: &str) -> BTreeMap<String, String> {
    let bound = code.split_once("bind_interrupts!(struct").unwrap().1.split_once("});").unwrap().0;
    let lines = bound.lines().filter_map(|line| line.split_once(" => "));
    let name = |line: &str| line.trim().trim_start_matches("$(").to_owned();
    let lines = lines.filter(|(line, _)| !line.ends_with("OTG_FS"));
    lines.map(|(line, handler)| (name(line), handler.trim_start_matches("embassy_stm32::").to_owned())).collect()
}

/// Returns the interrupts to which the code gives a priority, with the priority's name. The code does so one by one, in
/// pairs, or in a loop over a list.
fn prioritised(code: &str) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    let mut add = |line: &str, priority: &str| {
        let priority = priority.split([')', ',']).next().unwrap().to_owned();
        assert!(found.insert(line.to_owned(), priority).is_none(), "{line} has two priorities");
    };
    for pair in code.split("(Interrupt::").skip(1) {
        let (line, rest) = pair.split_once(", priority::").unwrap();
        add(line, rest);
    }
    for one in code.split(" interrupt::").skip(1).filter(|one| one.contains(".set_priority(Priority::from(priority::"))
    {
        if let Some((line, rest)) = one.split_once(".set_priority(Priority::from(priority::")
            && !line.contains(char::is_whitespace)
        {
            add(line, rest);
        }
    }
    for list in code.split("for line in ").skip(1) {
        let Some((name, rest)) = list.split_once(" {\n            line.set_priority(Priority::from(priority::") else {
            continue;
        };
        let (_, lines) = code.split_once(&format!("const {name}: [Interrupt")).unwrap();
        for line in names_after(lines.split_once("];").unwrap().0, "Interrupt::") {
            add(line, rest);
        }
    }
    found
}

/// A line that nothing drives must not be read, so every UART uses the set-up with a pull-up on RX. Every I2C recovers
/// after errors.
#[test]
fn no_board_has_a_bare_uart_or_i2c() {
    let (mut uarts, mut buses) = (0, 0);
    for (path, text) in ["firmware/boards", "firmware/chips"].iter().flat_map(|folder| sources(&root().join(folder))) {
        let calls = |call: &str| text.matches(call).count();
        assert_eq!(calls("usart::Config::default()"), 0, "{}", path.display());
        if text.contains("embassy_stm32::usart::") {
            // Only this file creates a UART's default configuration. All other UARTs' configurations start from that
            // one.
            let begins = path.ends_with("chips/stm32/src/link.rs");
            assert_eq!(calls("= Config::default()"), usize::from(begins), "{}", path.display());
        }
        let set_up = ["link::uart()", "link::config()", "link::radio()", "escs::config()"].map(calls);
        assert!(calls("BufferedUart::new(") <= set_up.iter().sum(), "{}", path.display());
        assert_eq!(calls("I2c::new(p."), calls("i2c::bus("), "{}", path.display());
        (uarts, buses) = (uarts + calls("BufferedUart::new("), buses + calls("I2c::new(p."));
    }
    let link = fs::read_to_string(root().join("firmware/chips/stm32/src/link.rs")).unwrap();
    assert!(link.contains("config.rx_pull = Pull::Up;"));
    assert!(uarts >= 12 && buses >= 4, "{uarts} UARTs, {buses} I2C");
}

/// Each table's file repeats the relevant part of Betaflight's description of the board (`betaflight/config`), copied
/// by hand a second time: the current scale in millivolts per 10 A, the LED unless it is at the debugger's pins,
/// PINIO1, which is inverted and off while armed, and the flash chip, if it is used.
#[test]
fn boards_are_as_betaflight_describes_them() {
    for (board, table) in kinds().0 {
        let name = name_of(&board);
        let text = fs::read_to_string(&board).unwrap();
        let rows = text.lines().filter_map(|line| line.strip_prefix("//! | ")?.strip_suffix(" |")?.split_once(" | "));
        let mut described: BTreeMap<_, _> = rows.map(|(what, pins)| (what, pins.to_owned())).collect();
        let Battery { converter, voltage, current, volts_per_volt, amperes_per_volt } = &table.battery;
        let scale: f64 = described.remove("current's scale").unwrap().parse().unwrap();
        assert!((amperes_per_volt - 1e4 / scale).abs() < 0.05, "{name}");

        let BoardTable { imu, i2c, led, buzzer, bluetooth, logs, .. } = &table;
        let motor = |number| table.motors().find(|motor| motor.number == number).unwrap().pin.as_str();
        let gyroscope = [&*imu.clock, &imu.into, &imu.out, &imu.select, &imu.ready.pin, &imu.alignment];
        let mut wired = vec![
            ("gyroscope: clock, data in, data out, select, interrupt, alignment", gyroscope.to_vec()),
            ("motors 1 to 4", (1..=4).map(motor).collect()),
            ("barometer: clock, data", vec![&*i2c.clock, &i2c.data]),
            ("buzzer", vec![&**buzzer]),
            ("battery: voltage, current", vec![&**voltage, current]),
        ];
        wired.extend(led.iter().map(|pin| ("LED", vec![&**pin])));
        wired.extend(bluetooth.iter().map(|pin| ("PINIO1", vec![&**pin])));
        wired.extend(logs.iter().filter(|logs| logs.is_flash).map(
            |LogBus { name, clock, into, out, select, .. }| {
                ("flash chip: bus, clock, data in, data out, select", vec![&**name, clock, into, out, select])
            },
        ));
        let wired: BTreeMap<_, _> = wired.into_iter().map(|(what, pins)| (what, pins.join(", "))).collect();
        assert_eq!(wired, described, "{name}");
        // Betaflight gives no voltage scale for these boards, so its default applies: 110 tenths of a volt per volt.
        assert_eq!((*volts_per_volt, &**converter), (11.0, "ADC1"), "{name}");
        assert_eq!((table.crystal_hz, table.numbering.as_str()), (8_000_000, "BETAFLIGHT"), "{name}");
    }
}

const BEGIN: &str = "<!-- wiring: written by WRITE=1 cargo test -p flight-tests --test all boards:: -->\n";
const END: &str = "<!-- end -->";
const HEADING: &str = "| board | chip | IMU | barometer | motors |\n|---|---|---|---|---|\n";

#[test]
fn every_board_that_is_a_table_has_its_page() {
    for (board, table) in kinds().0 {
        let name = name_of(&board);
        let path = root().join("docs/boards").join(name).with_extension("md");
        let page = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let (head, rest) = page.split_once(BEGIN).unwrap();
        let (_, tail) = rest.split_once(END).unwrap();
        assert_written(&path, &format!("{head}{BEGIN}{}{END}{tail}", wiring(&table)));
        assert!(page.contains(&format!("cargo xtask fw {name}")), "{}", path.display());
    }
}

/// Writes a page if the variable WRITE is set, then compares it.
fn assert_written(path: &Path, text: &str) {
    if std::env::var_os("WRITE").is_some() {
        fs::write(path, text).unwrap();
    }
    assert_eq!(fs::read_to_string(path).unwrap(), text, "run WRITE=1 cargo test -p flight-tests --test all boards::");
}

/// The rows of boards that are tables are generated; the rows of other boards follow.
#[test]
fn the_list_has_every_board() {
    let path = root().join("docs/boards.md");
    let page = fs::read_to_string(&path).unwrap();
    let (head, rest) = page.split_once(HEADING).unwrap();
    let (tables, codes) = kinds();
    let begin = |board: &Path| format!("| [`{}`]", name_of(board));
    let is_code = |line: &str| codes.iter().any(|board| line.starts_with(&begin(board)));
    assert_eq!(rest.lines().filter(|line| is_code(line)).count(), codes.len());
    let others = rest.split_inclusive('\n').skip_while(|line| line.starts_with("| [`") && !is_code(line));
    let rows = tables.iter().map(|(board, table)| row(name_of(board), &chip_of(board), table));
    let rows: String = rows.chain(others.map(str::to_owned)).collect();
    assert_written(&path, &format!("{head}{HEADING}{rows}"));
}
