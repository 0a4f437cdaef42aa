//! DPS310 and SPL06-001, tested on a model of their registers (Infineon's data sheet V1.2).

use crate::rig::suite::{Pace, Suite, reads_no_pressure_beyond, reads_pressures};
use crate::rig::{Model, Rig, noise, run};
use afbc_drivers::dps310::{Dps310, Spl06};
use afbc_drivers::{PartFault, PressureReading};

/// Table 16: durations of a measurement with 1, 2, 4 ... 128 samples.
const TIMES_US: [u64; 8] = [3_600, 5_200, 8_400, 14_800, 27_600, 53_200, 104_400, 206_800];
/// Scale factors of table 9.
const SCALES: [f64; 8] =
    [524_288.0, 1_572_864.0, 3_670_016.0, 7_864_320.0, 253_952.0, 516_096.0, 1_040_384.0, 2_088_960.0];
/// Coefficients c0, c1, c00, c10, c01, c11, c20, c21, c30: of a typical part, small ones, and some at the limits of
/// their registers.
const SETS: [[i32; 9]; 5] = [
    [207, -255, 81_507, -57_266, -2_837, 1_316, -9_612, 71, -1_529],
    [204, -258, 75_000, -52_000, -2_000, 300, 200, -20, -5],
    [2_047, -2_048, 524_287, -524_288, -32_768, 32_767, -32_768, 32_767, -32_768],
    [-2_048, 2_047, -524_288, 524_287, 32_767, -32_768, 32_767, -32_768, 32_767],
    [-1, 1_000, -1, 90_000, -1, -1, -1, -1, -1],
];

struct Registers {
    is_spl06: bool,
    identity: u8,
    set: [i32; 9],
    /// Bit 7 of COEF_SRCE: the temperature sensor of the coefficients.
    source: u8,
    /// True if the temperature is wrong until the fuses are enabled.
    has_bad_fuses: bool,
    /// True if the coefficients read differently each time.
    coefficients_flicker: bool,
    registers: [u8; 128],
    since_us: u64,
    measuring_us: Option<u64>,
    /// Times at which pressure and temperature were last read.
    read_us: [u64; 2],
    reads: u8,
    pressure_pa: f64,
    temperature_c: f64,
}

impl Registers {
    fn new(is_spl06: bool) -> Self {
        let mut part = Registers {
            is_spl06,
            identity: 0x10,
            set: SETS[0],
            source: 0x80,
            has_bad_fuses: !is_spl06,
            coefficients_flicker: false,
            registers: [0; 128],
            since_us: 0,
            measuring_us: None,
            read_us: [0; 2],
            reads: 0,
            pressure_pa: 101_325.0,
            temperature_c: 25.0,
        };
        part.reset(0);
        part
    }

    fn coefficients(&self) -> [u8; 18] {
        let mut bits = Vec::new();
        for (value, width) in self.set.iter().zip([12, 12, 20, 20, 16, 16, 16, 16, 16]) {
            bits.extend((0..width).rev().map(|bit| (value >> bit & 1) as u8));
        }
        let mut bytes = [0; 18];
        for (byte, bits) in bytes.iter_mut().zip(bits.chunks(8)) {
            *byte = bits.iter().fold(0, |byte, bit| byte << 1 | bit);
        }
        bytes
    }

    /// Returns samples code, period and duration of a measurement of pressure (0) or temperature (1).
    fn timing(&self, what: usize) -> (usize, u64, u64) {
        let config = self.registers[0x06 + what];
        let samples = usize::from(config & 0xF);
        (samples, 1_000_000 >> (config >> 4 & 7), TIMES_US[samples])
    }

    /// Returns the end of the last complete measurement.
    fn done_us(&self, what: usize, now_us: u64) -> Option<u64> {
        let [pressure, temperature] = [self.timing(0), self.timing(1)];
        let busy = [pressure, temperature].iter().map(|(_, period_us, us)| us * (1_000_000 / period_us)).sum::<u64>();
        assert!(busy < 1_000_000, "section 4.4: too many measurements a second, {busy} us");
        let (_, period_us, us) = [pressure, temperature][what];
        // The temperature is measured after the pressure.
        let first_us = self.measuring_us? + us + if what == 1 { pressure.2 } else { 0 };
        Some(first_us + now_us.checked_sub(first_us)? / period_us * period_us)
    }

    /// Returns the result registers: raw values from section 4.9 solved backwards.
    fn result(&self, what: usize, now_us: u64) -> [u8; 3] {
        let Some(done_us) = self.done_us(what, now_us) else { return [0x80, 0, 0] };
        let [c0, c1, c00, c10, c01, c11, c20, c21, c30] = self.set.map(f64::from);
        let mut temperature_c = self.temperature_c + 0.003 * noise(self.done_us(1, now_us).unwrap_or(0), 1);
        if self.has_bad_fuses {
            temperature_c += 30.0;
        }
        if self.registers[0x07] & 0x80 != self.source {
            temperature_c += 3.0;
        }
        let t = (temperature_c - c0 / 2.0) / c1;
        let pressure_pa = self.pressure_pa + 0.3 * noise(done_us, 0);
        let of = |p: f64| c00 + p * (c10 + p * (c20 + p * c30)) + t * c01 + t * p * (c11 + p * c21) - pressure_pa;
        let (mut low, mut high) = (-1.4, 1.4);
        assert!(of(low) * of(high) < 0.0, "no raw value gives {pressure_pa} Pa with {:?}", self.set);
        while high - low > 1e-12 {
            let middle = (low + high) / 2.0;
            if of(low) * of(middle) <= 0.0 { high = middle } else { low = middle }
        }
        let (samples, ..) = self.timing(what);
        let raw = ([low, t][what] * SCALES[samples]).round() as i64;
        // Without the result shift, a sum of more than 8 samples overflows.
        let raw = if samples > 3 && self.registers[0x09] & (4 << what) == 0 { raw << (samples - 3) } else { raw };
        let [.., a, b, c] = raw.to_be_bytes();
        [a, b, c]
    }

    fn is_ready(&self, what: usize, now_us: u64) -> bool {
        self.done_us(what, now_us).is_some_and(|done_us| done_us > self.read_us[what])
    }

    fn byte(&mut self, now_us: u64, register: usize) -> u8 {
        let up_us = now_us - self.since_us;
        match register {
            0x00..=0x02 => {
                let byte = self.result(0, now_us)[register];
                if register == 0x02 {
                    self.read_us[0] = now_us;
                }
                byte
            }
            0x03..=0x05 => {
                let byte = self.result(1, now_us)[register - 0x03];
                if register == 0x05 {
                    self.read_us[1] = now_us;
                }
                byte
            }
            0x08 => {
                let flags = [
                    (0x80, up_us >= 40_000),
                    (0x40, up_us >= 12_000),
                    (0x20, self.is_ready(1, now_us)),
                    (0x10, self.is_ready(0, now_us)),
                ];
                let mode = if self.measuring_us.is_some() { 7 } else { 0 };
                flags.iter().map(|&(bit, is_set)| if is_set { bit } else { 0 }).sum::<u8>() | mode
            }
            0x0D => self.identity,
            0x10..=0x21 | 0x28 if up_us < 40_000 => 0,
            0x10..=0x21 => {
                let flicker = if self.coefficients_flicker && register == 0x14 { self.reads } else { 0 };
                self.coefficients()[register - 0x10] ^ flicker
            }
            0x28 if !self.is_spl06 => self.source | 0x12,
            _ => self.registers[register],
        }
    }
}

impl Model for Registers {
    fn read(&mut self, now_us: u64, register: u8, into: &mut [u8]) {
        self.reads = self.reads.wrapping_add(1);
        // The part does not answer within the first 2.5 ms after power-up.
        let answers = now_us - self.since_us >= 2_500;
        for (register, byte) in (usize::from(register)..).zip(into) {
            *byte = if answers { self.byte(now_us, register) } else { 0xFF };
        }
    }

    fn write(&mut self, now_us: u64, register: u8, bytes: &[u8]) {
        for (register, &byte) in (usize::from(register)..).zip(bytes) {
            match register {
                0x06 | 0x07 | 0x09 => self.registers[register] = byte,
                0x08 => {
                    assert!(byte == 0 || byte == 7, "mode {byte:#x}");
                    // A sensor that is not ready yet does not start measuring.
                    let is_ready = now_us - self.since_us >= 12_000;
                    self.measuring_us = (byte == 7 && is_ready).then_some(now_us);
                }
                0x0C if byte & 0xF == 0b1001 => self.reset(now_us),
                0x0E | 0x0F | 0x62 if !self.is_spl06 => {
                    self.registers[register] = byte;
                    let is_unlocked = self.registers[0x0E] == 0xA5 && self.registers[0x0F] == 0x96;
                    if register == 0x62 && is_unlocked && byte == 2 {
                        self.has_bad_fuses = false;
                    }
                }
                _ => panic!("writes to {register:#x}"),
            }
        }
    }

    fn reset(&mut self, now_us: u64) {
        self.registers = [0; 128];
        (self.since_us, self.measuring_us, self.read_us) = (now_us, None, [now_us; 2]);
        self.has_bad_fuses = !self.is_spl06;
    }
}

fn right(reading: &PressureReading) -> bool {
    (reading.pressure_pa - 101_325.0).abs() < 1.0 && (reading.temperature_c - 25.0).abs() < 0.02
}

#[test]
fn both_pass_the_suite() {
    // The other part is the SPL07-003, which has more coefficients.
    let others = |is_spl06| vec![(Registers { identity: 0x11, ..Registers::new(is_spl06) }, 0x11)];
    let (others, pace, notice_us) = ([false, true].map(others), || Pace::Polled(318..=322), 1_000_000);
    let [of_dps310, of_spl06] = others;
    let (part, model) = (&Dps310::default, &|| Registers::new(false));
    Suite { part, model, right, notice_us, others: of_dps310, pace: pace() }.passes();
    let (part, model) = (&Spl06::default, &|| Registers::new(true));
    Suite { part, model, right, notice_us, others: of_spl06, pace: pace() }.passes();
}

#[test]
fn pressures_and_temperatures_of_the_whole_range_are_read_and_none_beyond() {
    let points =
        [(30_010.0, -39.9), (30_010.0, 84.9), (119_990.0, -39.9), (119_990.0, 84.9), (101_325.0, 25.0), (7e4, 0.0)];
    for set in SETS {
        let model = |pressure_pa, temperature_c| Registers { set, pressure_pa, temperature_c, ..Registers::new(false) };
        // The tolerances cover 0.3 Pa of noise and the last bit.
        let lsb_pa = f64::from(set[3].abs()) / SCALES[4];
        reads_pressures(Dps310::default, model, &points, [0.5 + lsb_pa, 0.02], 6);
    }
    let model = |pressure_pa, temperature_c| Registers { pressure_pa, temperature_c, ..Registers::new(false) };
    reads_no_pressure_beyond(Dps310::default, model, [29_900.0, 120_100.0]);
}

#[test]
fn temperature_is_of_the_sensor_that_the_coefficients_are_for() {
    for source in [0, 0x80] {
        let rig = Rig::new(Registers { source, ..Registers::new(false) });
        let (readings, faults) = run(&mut rig.driver(Dps310::default()), &rig, 500_000);
        assert!(faults.is_empty() && readings.iter().all(|reading| right(&reading.value)), "{readings:?}");
    }
}

#[test]
fn coefficients_that_read_differently_are_not_used() {
    let rig = Rig::new(Registers { coefficients_flicker: true, ..Registers::new(false) });
    let mut driver = rig.driver(Dps310::default());
    let (readings, faults) = run(&mut driver, &rig, 1_000_000);
    assert!(readings.is_empty() && faults.iter().all(|fault| *fault == PartFault::Calibration), "{faults:?}");
    rig.with(|part| part.coefficients_flicker = false);
    let _ = run(&mut driver, &rig, 1_000_000);
    let (readings, faults) = run(&mut driver, &rig, 500_000);
    assert!(faults.is_empty() && readings.iter().all(|reading| right(&reading.value)), "{faults:?}");
}
