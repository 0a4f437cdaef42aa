//! Writes the wiring table of a board's page, and its row in the list of boards.

use super::read::Radio;
use super::{BoardTable, Stream};
use std::fmt::Write;

/// Returns the wiring table.
pub(crate) fn wiring(board: &BoardTable) -> String {
    let BoardTable { link, gnss, escs, imu, i2c, .. } = board;
    let mut rows = vec![
        [format!("crystal, {} MHz", board.crystal_hz / 1_000_000), "PH0, PH1".to_owned(), "HSE".to_owned()],
        [
            "link: out (TX), in (RX)".to_owned(),
            format!("{}, {}", link.tx, link.rx),
            format!("{}, 460,800 baud, 8N1, 3.3 V", link.name),
        ],
        [
            "IMU: clock, in, out, select, interrupt".to_owned(),
            [&*imu.clock, &imu.into, &imu.out, &imu.select, &imu.ready.pin].join(", "),
            format!(
                "{} on {}, {}, {}; `{}`",
                names(&imu.parts),
                imu.name,
                streams(&imu.streams),
                imu.ready.channel,
                imu.alignment
            ),
        ],
        [
            "barometer: clock, data".to_owned(),
            format!("{}, {}", i2c.clock, i2c.data),
            format!("{} on {}, 400 kHz, {}", names(&i2c.barometers), i2c.name, streams(&i2c.streams)),
        ],
        ["compass, outside".to_owned(), "the same".to_owned(), "QMC5883L at 0x0D".to_owned()],
        [
            "GNSS receiver, outside: out, in".to_owned(),
            format!("{}, {}", gnss.tx, gnss.rx),
            format!("u-blox or NMEA on {}", gnss.name),
        ],
    ];
    if let Some(Radio { uart, pad, inverter }) = &board.radio {
        let inverted = match inverter {
            Some(pin) => format!("SBUS by the same pad, before which {pin} switches an inverter"),
            None => format!("SBUS by the pad {pad}, which has an inverter before {}", uart.rx),
        };
        rows.push([
            "radio receiver, outside: out, in".to_owned(),
            format!("{}, {}", uart.tx, uart.rx),
            format!("CRSF on {}; {inverted}", uart.name),
        ]);
    }
    rows.extend(escs.as_ref().map(|escs| {
        let what = format!("KISS telemetry on {}, 115,200 baud; its TX, {}, sends nothing", escs.name, escs.tx);
        ["motor controllers: in".to_owned(), escs.rx.clone(), what]
    }));
    let corners = match board.numbering.as_str() {
        "BETAFLIGHT" => ["rear right", "front right", "rear left", "front left"],
        "ARDUPILOT" => ["front right", "rear left", "front left", "rear right"],
        other => panic!("{other}"),
    };
    let mut motors = Vec::new();
    for timer in &board.timers {
        for (channel, motor) in (1..).zip(&timer.channels) {
            let Some(motor) = motor else { continue };
            let corner = corners.get(motor.number - 1).unwrap();
            motors.push([
                format!("motor {}, {corner}", motor.number),
                motor.pin.clone(),
                format!("{} channel {channel}, DMA by {}", timer.name, streams(std::slice::from_ref(&timer.stream))),
            ]);
        }
    }
    motors.sort();
    rows.extend(motors);
    rows.extend(board.logs.iter().map(|logs| {
        let pins = [&*logs.clock, &logs.into, &logs.out, &logs.select].join(", ");
        let quiet =
            if logs.quiet.is_empty() { String::new() } else { format!("; {} stays high", logs.quiet.join(", ")) };
        let kind = if logs.is_flash { "flash chip" } else { "memory card" };
        [format!("{kind}: clock, in, out, select"), pins, format!("{}, up to 21 MHz{quiet}", logs.name)]
    }));
    let battery = &board.battery;
    rows.push([
        "battery: voltage, current".to_owned(),
        format!("{}, {}", battery.voltage, battery.current),
        format!(
            "{}, {} V and {} A a volt (`BAT1_V_DIV`, `BAT1_A_PER_V`)",
            battery.converter, battery.volts_per_volt, battery.amperes_per_volt
        ),
    ]);
    rows.extend(board.led.iter().map(|led| ["LED".to_owned(), led.clone(), "lit if low".to_owned()]));
    rows.push(["buzzer with a tone of its own".to_owned(), board.buzzer.clone(), "sounds if high".to_owned()]);
    rows.extend(
        board
            .bluetooth
            .iter()
            .map(|pin| ["Bluetooth's enable pin".to_owned(), pin.clone(), "held low: off".to_owned()]),
    );
    rows.push(["debugger".to_owned(), "PA13, PA14".to_owned(), "SWDIO, SWCLK".to_owned()]);
    let mut table = "| what | pin | peripheral |\n|---|---|---|\n".to_owned();
    for row in rows {
        writeln!(table, "| {} |", row.join(" | ")).unwrap();
    }
    table
}

/// Returns the board's row in the list of boards.
pub(crate) fn row(name: &str, chip: &str, board: &BoardTable) -> String {
    let [imu, barometer] = [&board.imu.parts, &board.i2c.barometers].map(|parts| names(parts));
    format!("| [`{name}`](boards/{name}.md) | {chip} | {imu} | {barometer} | {} |\n", board.outputs)
}

/// Returns the names of parts in their makers' spelling.
fn names(parts: &[String]) -> String {
    let name = |part: &String| match part.as_str() {
        "Bmi270" => "BMI270",
        "Bmp280" => "BMP280",
        "Dps310" => "DPS310",
        "Icm20602" => "ICM-20602",
        "Icm20689" => "ICM-20689",
        "Icm42688p" => "ICM-42688-P",
        "Mpu6000" => "MPU-6000",
        "Mpu6500" => "MPU-6500",
        "Spl06" => "SPL06-001",
        other => panic!("{other}"),
    };
    parts.iter().map(name).collect::<Vec<_>>().join(" or ")
}

/// Returns DMA streams in the form `DMA2 streams 3 and 0`.
fn streams(streams: &[Stream]) -> String {
    let parts: Vec<_> = streams.iter().map(|stream| stream.line.split_once("_STREAM").unwrap()).collect();
    let numbers: Vec<_> = parts.iter().map(|(_, number)| *number).collect();
    let plural = if parts.len() > 1 { "s" } else { "" };
    format!("{} stream{plural} {}", parts[0].0, numbers.join(" and "))
}
