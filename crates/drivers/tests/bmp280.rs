//! BMP280, tested on a model of its registers and its integer compensation (BST-BMP280-DS001).

use crate::rig::suite::{Pace, Suite, reads_pressures};
use crate::rig::{Model, noise};
use afbc_drivers::PressureReading;
use afbc_drivers::bmp280::Bmp280;

/// Coefficients dig_T1 to dig_T3 and dig_P1 to dig_P9.
type Trim = [i64; 12];
/// Coefficients of the data sheet's example (section 3.12), and of another part.
const SETS: [Trim; 2] = [
    [27_504, 26_435, -1_000, 36_477, -10_685, 3_024, 2_855, 140, -7, 15_500, -14_600, 6_000],
    [28_009, 25_654, 50, 39_145, -10_750, 3_024, 5_667, -120, -7, 15_500, -14_600, 6_000],
];

/// Section 3.11.3: returns the temperature \[0.01 C\] and its finer value for the pressure.
fn temperature(trim: &Trim, raw: i64) -> (i64, i64) {
    let [t1, t2, t3, ..] = *trim;
    let first = (((raw >> 3) - (t1 << 1)) * t2) >> 11;
    let above = (raw >> 4) - t1;
    let fine = first + ((((above * above) >> 12) * t3) >> 14);
    ((fine * 5 + 128) >> 8, fine)
}

/// Section 3.11.3: returns the pressure \[1/256 Pa\].
fn pressure(trim: &Trim, raw: i64, fine: i64) -> i64 {
    let [_, _, _, p1, p2, p3, p4, p5, p6, p7, p8, p9] = *trim;
    let warm = fine - 128_000;
    let offset = warm * warm * p6 + ((warm * p5) << 17) + (p4 << 35);
    let slope = (((1 << 47) + ((warm * warm * p3) >> 8) + ((warm * p2) << 12)) * p1) >> 33;
    let plain = ((((1_048_576 - raw) << 31) - offset) * 3125) / slope;
    let bend = ((p9 * (plain >> 13) * (plain >> 13)) >> 25) + ((p8 * plain) >> 19);
    ((plain + bend) >> 8) + (p7 << 4)
}

struct Registers {
    identity: u8,
    trim: Trim,
    config: u8,
    up_us: u64,
    /// Time at which the commanded measurement ends, if there is one.
    done_us: Option<u64>,
    data: [u8; 6],
    pressure_pa: f64,
    temperature_c: f64,
}

/// Data registers without a measurement.
const SKIPPED: [u8; 6] = [0x80, 0, 0, 0x80, 0, 0];

impl Registers {
    fn new(identity: u8, trim: Trim) -> Self {
        Registers {
            identity,
            trim,
            config: 0,
            up_us: 0,
            done_us: None,
            data: SKIPPED,
            pressure_pa: 101_325.0,
            temperature_c: 25.0,
        }
    }

    /// Returns the data of a measurement at this time, without filter: 19 bits of pressure and 16 of temperature.
    fn measured(&self, now_us: u64) -> [u8; 6] {
        let solve = |falls: bool, of: &dyn Fn(i64) -> f64, value: f64| {
            let (mut low, mut high) = (0, 0xF_FFFF);
            while high - low > 1 {
                let middle = (low + high) / 2;
                if (of(middle) > value) == falls { low = middle } else { high = middle }
            }
            low
        };
        let temperature_c = self.temperature_c + 0.005 * noise(now_us, 1);
        let t = solve(false, &|raw| temperature(&self.trim, raw).0 as f64 / 100.0, temperature_c) & !0xF;
        let (_, fine) = temperature(&self.trim, t);
        let pressure_pa = self.pressure_pa + 1.5 * noise(now_us, 0);
        let p = solve(true, &|raw| pressure(&self.trim, raw, fine) as f64 / 256.0, pressure_pa) & !1;
        let [[_, a, b, c], [_, d, e, f]] = [p, t].map(|raw| ((raw as u32) << 4).to_be_bytes());
        [a, b, c, d, e, f]
    }
}

impl Model for Registers {
    fn read(&mut self, now_us: u64, register: u8, into: &mut [u8]) {
        let is_done = self.done_us.is_none_or(|done_us| done_us <= now_us);
        if let Some(done_us) = self.done_us.filter(|_| is_done) {
            (self.data, self.done_us) = (self.measured(done_us), None);
        }
        let trim: Vec<u8> = self.trim.iter().flat_map(|value| value.to_le_bytes()[..2].to_vec()).collect();
        for (register, byte) in (usize::from(register)..).zip(into) {
            *byte = match register {
                _ if now_us < self.up_us => 0,
                0x88..=0x9F => trim[register - 0x88],
                0xD0 => self.identity,
                0xF3 => {
                    if is_done {
                        0
                    } else {
                        0x08
                    }
                }
                0xF5 => self.config,
                0xF7..=0xFC => self.data[register - 0xF7],
                _ => panic!("reads {register:#x}"),
            };
        }
    }

    fn write(&mut self, now_us: u64, register: u8, bytes: &[u8]) {
        let &[byte] = bytes else { panic!("it takes pairs of register and value") };
        match register {
            0xE0 if byte == 0xB6 => self.reset(now_us),
            0xF4 => {
                assert_eq!(byte & 0b11, 0b01, "forced");
                // The measurement takes the longest time in section 3.8.1, with 2^(osrs - 1) samples of each quantity.
                let samples = |osrs: u8| if osrs == 0 { 0 } else { 1_u64 << (osrs - 1) };
                let us = 1_250 + 2_300 * samples(byte >> 5) + 2_300 * samples(byte >> 2 & 7) + 575;
                self.done_us = Some(now_us + us);
            }
            0xF5 => self.config = byte,
            _ => panic!("writes to {register:#x}"),
        }
    }

    fn reset(&mut self, now_us: u64) {
        (self.config, self.done_us, self.data, self.up_us) = (0, None, SKIPPED, now_us + 2_000);
    }
}

fn right(reading: &PressureReading) -> bool {
    (reading.pressure_pa - 101_325.0).abs() < 3.0 && (reading.temperature_c - 25.0).abs() < 0.03
}

/// The data sheet's example: raw values 519888 and 415148 are 25.08 C and 100653.27 Pa.
#[test]
fn the_model_has_the_data_sheets_example() {
    let (hundredths, fine) = temperature(&SETS[0], 519_888);
    assert_eq!(hundredths, 2_508);
    assert!((pressure(&SETS[0], 415_148, fine) as f64 / 256.0 - 100_653.27).abs() < 0.1);
}

#[test]
fn it_passes_the_suite() {
    for trim in SETS {
        let others = vec![(Registers::new(0x60, trim), 0x60)];
        let (part, model, pace) = (&Bmp280::default, &|| Registers::new(0x58, trim), Pace::Polled(440..=446));
        Suite { part, model, right, notice_us: 700_000, others, pace }.passes();
    }
}

#[test]
fn true_pressures_and_temperatures_are_read() {
    let points =
        [(30_010.0, -39.9), (30_010.0, 84.9), (109_990.0, -39.9), (109_990.0, 84.9), (101_325.0, 25.0), (7e4, 0.0)];
    for trim in SETS {
        let model = |pressure_pa, temperature_c| Registers { pressure_pa, temperature_c, ..Registers::new(0x58, trim) };
        reads_pressures(Bmp280::default, model, &points, [3.0, 0.03], 20);
    }
}
