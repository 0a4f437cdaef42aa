//! BMP388 and BMP390, tested on a model of their registers (BST-BMP388-DS001).

use crate::rig::suite::{Pace, Suite, reads_no_pressure_beyond, reads_pressures};
use crate::rig::{Model, Rig, noise, run};
use afbc_drivers::bmp3::{Bmp388, Bmp390};
use afbc_drivers::{PartFault, PressureReading};

/// Coefficients NVM_PAR_T1 to T3 and P1 to P11.
type Trim = [i64; 14];
/// Lengths of the coefficients \[bytes\].
const LENGTHS: [usize; 14] = [2, 2, 1, 2, 2, 1, 1, 2, 2, 1, 1, 2, 1, 1];
/// Coefficients of a typical part, and some at the limits of their registers.
const SETS: [Trim; 4] = [
    [27_772, 18_933, -10, -56, -1_010, 35, 0, 25_209, 30_267, 3, -6, 16_442, 31, -60],
    [27_400, 19_100, -7, -180, -1_300, 35, 1, 24_600, 29_800, -13, 4, 12_000, 20, -40],
    [2_600, 65_535, 127, 32_767, 32_767, 127, 127, 0, 200, 127, 127, 32_767, 127, 127],
    [50_000, 30_000, -128, -32_768, -32_768, -128, -128, 65_535, 0, -128, -128, -32_768, -128, -128],
];

/// Computes CRC-8/SAE-J1850 by bitwise division.
fn crc8(bytes: &[u8]) -> u8 {
    let mut remainder: u8 = 0xFF;
    for bit in bytes.iter().flat_map(|byte| (0..8).rev().map(move |bit| byte >> bit & 1)) {
        let out = remainder >> 7 ^ bit;
        remainder <<= 1;
        if out == 1 {
            remainder ^= 0x1D;
        }
    }
    remainder ^ 0xFF
}

struct Registers {
    identity: u8,
    trim: Trim,
    /// Registers from 0x30 on: CRC and coefficients.
    calibration: Vec<u8>,
    registers: [u8; 128],
    up_us: u64,
    measuring_us: Option<u64>,
    /// Times at which pressure and temperature were last read.
    read_us: [u64; 2],
    pressure_pa: f64,
    temperature_c: f64,
}

impl Registers {
    fn new(identity: u8, trim: Trim) -> Self {
        let bytes: Vec<u8> =
            trim.iter().zip(LENGTHS).flat_map(|(value, length)| value.to_le_bytes()[..length].to_vec()).collect();
        let mut part = Registers {
            identity,
            trim,
            calibration: [vec![crc8(&bytes)], bytes].concat(),
            registers: [0; 128],
            up_us: 0,
            measuring_us: None,
            read_us: [0; 2],
            pressure_pa: 101_325.0,
            temperature_c: 25.0,
        };
        part.reset(0);
        part
    }

    /// Section 9.2: returns the temperature of a raw value \[C\].
    fn temperature(&self, raw: f64) -> f64 {
        let [t1, t2, t3, ..] = self.trim.map(|value| value as f64);
        let above = raw - t1 * 256.0;
        above * t2 / 2_f64.powi(30) + above.powi(2) * t3 / 2_f64.powi(48)
    }

    /// Section 9.3: returns the pressure of a raw value \[Pa\].
    fn pressure(&self, raw: f64, t: f64) -> f64 {
        let [_, _, _, p1, p2, p3, p4, p5, p6, p7, p8, p9, p10, p11] = self.trim.map(|value| value as f64);
        let out1 = p5 * 8.0 + p6 / 64.0 * t + p7 / 256.0 * t.powi(2) + p8 / 32_768.0 * t.powi(3);
        let out2 = raw
            * ((p1 - 16_384.0) / 2_f64.powi(20)
                + (p2 - 16_384.0) / 2_f64.powi(29) * t
                + p3 / 2_f64.powi(32) * t.powi(2)
                + p4 / 2_f64.powi(37) * t.powi(3));
        let out3 = raw.powi(2) * (p9 / 2_f64.powi(48) + p10 / 2_f64.powi(48) * t);
        out1 + out2 + out3 + raw.powi(3) * p11 / 2_f64.powi(65)
    }

    /// Returns the duration of a measurement and the output period.
    fn timing_us(&self) -> (u64, u64) {
        let osr = self.registers[0x1C];
        (234 + 392 + (2_020 << (osr & 7)) + 163 + (2_020 << (osr >> 3 & 7)), 5_000 << self.registers[0x1D])
    }

    fn done_us(&self, now_us: u64) -> Option<u64> {
        let (us, period_us) = self.timing_us();
        let first_us = self.measuring_us? + us;
        // Section 3.9: a measurement that takes longer than the period is refused.
        let elapsed_us = now_us.checked_sub(first_us).filter(|_| us <= period_us)?;
        Some(first_us + elapsed_us / period_us * period_us)
    }

    /// Returns the raw values without filter: 16 bits, and one more for each doubling of the samples.
    fn data(&self, now_us: u64) -> [u8; 6] {
        let Some(done_us) = self.done_us(now_us) else { return [0, 0, 0x80, 0, 0, 0x80] };
        let osr = self.registers[0x1C];
        let cut = |raw: f64, samples: u8| {
            let step = f64::from(1 << (8 - samples));
            (raw / step).round() * step
        };
        let solve = |of: &dyn Fn(f64) -> f64| {
            let (mut low, mut high) = (0.0, 16_777_215.0);
            assert!(of(low) * of(high) < 0.0, "no raw value with {:?}", self.trim);
            while high - low > 1e-3 {
                let middle = (low + high) / 2.0;
                if of(low) * of(middle) <= 0.0 { high = middle } else { low = middle }
            }
            low
        };
        let temperature_c = self.temperature_c + 0.005 * noise(done_us, 1);
        let temperature = cut(solve(&|raw| self.temperature(raw) - temperature_c), osr >> 3 & 7);
        let t = self.temperature(temperature);
        let pressure_pa = self.pressure_pa + 1.5 * noise(done_us, 0);
        let pressure = cut(solve(&|raw| self.pressure(raw, t) - pressure_pa), osr & 7);
        let [a, b, c, _] = (pressure as u32).to_le_bytes();
        let [d, e, f, _] = (temperature as u32).to_le_bytes();
        [a, b, c, d, e, f]
    }
}

impl Model for Registers {
    fn read(&mut self, now_us: u64, register: u8, into: &mut [u8]) {
        for (register, byte) in (usize::from(register)..).zip(into) {
            *byte = match register {
                _ if now_us < self.up_us => 0,
                0x00 => self.identity,
                0x03 => {
                    let ready = self.read_us.map(|read_us| self.done_us(now_us).is_some_and(|us| us > read_us));
                    0x10 | if ready[0] { 0x20 } else { 0 } | if ready[1] { 0x40 } else { 0 }
                }
                0x04..=0x09 => {
                    self.read_us[if register < 0x07 { 0 } else { 1 }] = now_us;
                    self.data(now_us)[register - 0x04]
                }
                0x30..=0x45 => self.calibration[register - 0x30],
                _ => self.registers[register],
            };
        }
    }

    fn write(&mut self, now_us: u64, register: u8, bytes: &[u8]) {
        let &[byte] = bytes else { panic!("it takes pairs of register and value") };
        match register {
            0x7E if byte == 0xB6 => self.reset(now_us),
            0x1B..=0x1D | 0x1F => {
                self.registers[usize::from(register)] = byte;
                self.measuring_us = (self.registers[0x1B] == 0x33).then_some(now_us);
            }
            _ => panic!("writes to {register:#x}"),
        }
    }

    fn reset(&mut self, now_us: u64) {
        self.registers = [0; 128];
        self.registers[0x1C] = 0x02;
        (self.up_us, self.measuring_us, self.read_us) = (now_us + 2_000, None, [now_us; 2]);
    }
}

fn right(reading: &PressureReading) -> bool {
    (reading.pressure_pa - 101_325.0).abs() < 2.5 && (reading.temperature_c - 25.0).abs() < 0.02
}

#[test]
fn both_pass_the_suite() {
    let (others, pace) = (vec![(Registers::new(0x60, SETS[0]), 0x60)], Pace::Polled(498..=502));
    let (part, model) = (&Bmp388::default, &|| Registers::new(0x50, SETS[0]));
    Suite { part, model, right, notice_us: 600_000, others, pace }.passes();
    let (others, pace) = (vec![(Registers::new(0x58, SETS[0]), 0x58)], Pace::Polled(498..=502));
    let (part, model) = (&Bmp390::default, &|| Registers::new(0x60, SETS[1]));
    Suite { part, model, right, notice_us: 600_000, others, pace }.passes();
}

#[test]
fn pressures_and_temperatures_of_the_whole_range_are_read_and_none_beyond() {
    let points =
        [(30_010.0, -39.9), (30_010.0, 84.9), (124_990.0, -39.9), (124_990.0, 84.9), (101_325.0, 25.0), (7e4, 0.0)];
    for trim in SETS {
        let model = |pressure_pa, temperature_c| Registers { pressure_pa, temperature_c, ..Registers::new(0x50, trim) };
        // The tolerances cover 1.5 Pa of noise and half of the last of 19 bits.
        reads_pressures(Bmp388::default, model, &points, [1.5 + 1.0, 0.02], 11);
    }
    let model = |pressure_pa, temperature_c| Registers { pressure_pa, temperature_c, ..Registers::new(0x50, SETS[0]) };
    reads_no_pressure_beyond(Bmp388::default, model, [29_900.0, 125_100.0]);
}

#[test]
fn the_checksum_is_that_of_its_catalogue() {
    assert_eq!(crc8(b"123456789"), 0x4B);
}

#[test]
fn a_damaged_calibration_is_refused() {
    for byte in 0..22 {
        for bit in 0..8 {
            let rig = Rig::new(Registers::new(0x50, SETS[0]));
            rig.with(|part| part.calibration[byte] ^= 1 << bit);
            let (readings, faults) = run(&mut rig.driver(Bmp388::default()), &rig, 300_000);
            assert!(readings.is_empty() && !faults.is_empty(), "byte {byte}, bit {bit}");
            assert!(faults.iter().all(|fault| *fault == PartFault::Calibration), "{faults:?}");
        }
    }
}
