//! MS5611, tested on a model of its commands (ENG_DS_MS5611-01BA03_B3).

use crate::rig::suite::{Pace, Suite, reads_no_pressure_beyond, reads_pressures};
use crate::rig::{Model, Rig, noise, run};
use afbc_drivers::ms5611::Ms5611;
use afbc_drivers::{PartFault, PressureReading, SensorPart};

/// Coefficients C1 to C6: the example of figure 2, a typical part's, small and large ones.
const SETS: [[u16; 6]; 4] = [
    [40_127, 36_924, 23_317, 23_282, 33_464, 28_312],
    [46_546, 42_845, 29_751, 29_457, 32_745, 29_059],
    [30_000, 20_000, 10_000, 10_000, 25_000, 20_000],
    [65_535, 60_000, 35_000, 35_000, 40_000, 40_000],
];

/// Computes the CRC-4 bit by bit: the remainder of all words without the last byte, divided by x4 + x + 1.
fn crc4(words: [u16; 8]) -> u16 {
    let mut remainder = 0;
    let bits = words.iter().flat_map(|word| (0..16).rev().map(move |bit| word >> bit & 1)).take(120);
    for bit in bits.chain([0; 4]) {
        let carry = remainder >> 3 & 1;
        remainder = (remainder << 1 | bit) & 0xF;
        if carry == 1 {
            remainder ^= 0b0011;
        }
    }
    remainder
}

struct Part5611 {
    prom: [u16; 8],
    /// Time from which the PROM can be read.
    loaded_us: Option<u64>,
    /// Command, its end, and whether its result is spoilt or already read.
    conversion: Option<(u8, u64, bool)>,
    pressure_pa: f64,
    temperature_c: f64,
}

impl Part5611 {
    fn new(set: [u16; 6]) -> Self {
        let mut prom = [0x004A, 0, 0, 0, 0, 0, 0, 0x7B30];
        prom[1..7].copy_from_slice(&set);
        prom[7] |= crc4(prom);
        Part5611 { prom, loaded_us: None, conversion: None, pressure_pa: 101_325.0, temperature_c: 20.5 }
    }

    /// Figures 2 and 3 in floating point, first and second order: returns temperature \[C\], offset and sensitivity.
    fn of(&self, d2: f64) -> (f64, f64, f64) {
        let [_, c1, c2, c3, c4, c5, c6, _] = self.prom.map(f64::from);
        let dt = d2 - c5 * 256.0;
        let temp = 2000.0 + dt * c6 / 8_388_608.0;
        let (mut t2, mut off2, mut sens2) = (0.0, 0.0, 0.0);
        if temp < 2000.0 {
            t2 = dt * dt / 2_147_483_648.0;
            off2 = 2.5 * (temp - 2000.0).powi(2);
            sens2 = off2 / 2.0;
        }
        if temp < -1500.0 {
            off2 += 7.0 * (temp + 1500.0).powi(2);
            sens2 += 5.5 * (temp + 1500.0).powi(2);
        }
        let (off, sens) = (c2 * 65_536.0 + c4 * dt / 128.0 - off2, c1 * 32_768.0 + c3 * dt / 256.0 - sens2);
        ((temp - t2) / 100.0, off, sens)
    }

    fn d2(&self) -> f64 {
        let (mut low, mut high) = (0.0, 16_777_215.0);
        assert!(self.of(low).0 < self.temperature_c && self.of(high).0 > self.temperature_c, "{:?}", self.prom);
        while high - low > 1e-3 {
            let middle = (low + high) / 2.0;
            if self.of(middle).0 < self.temperature_c { low = middle } else { high = middle }
        }
        low.round()
    }

    fn result(&self, command: u8, now_us: u64) -> u32 {
        let value = if command & 0xF0 == 0x50 {
            self.d2() + 3.0 * noise(now_us, 0)
        } else {
            let (_, off, sens) = self.of(self.d2());
            (self.pressure_pa * 32_768.0 + off) * 2_097_152.0 / sens + 20.0 * noise(now_us, 1)
        };
        value.round().clamp(1.0, 16_777_215.0) as u32
    }
}

impl Model for Part5611 {
    fn read(&mut self, now_us: u64, command: u8, into: &mut [u8]) {
        let mut answer = Vec::new();
        match command {
            0xA0..=0xAE if command & 1 == 0 => {
                let is_loaded = self.loaded_us.is_some_and(|loaded_us| loaded_us <= now_us);
                let word = self.prom[usize::from(command - 0xA0) / 2];
                answer.extend(if is_loaded { word } else { 0 }.to_be_bytes());
            }
            0x00 => {
                let value = match self.conversion {
                    Some((of, end_us, false)) if end_us <= now_us => self.result(of, end_us),
                    _ => 0,
                };
                // A second read, or one that comes too early, gives a wrong result.
                self.conversion = self.conversion.map(|(of, end_us, _)| (of, end_us, true));
                answer.extend(&value.to_be_bytes()[1..]);
            }
            _ => panic!("reads {command:#x}"),
        }
        into.copy_from_slice(&answer);
    }

    fn write(&mut self, now_us: u64, command: u8, bytes: &[u8]) {
        assert!(bytes.is_empty(), "it takes commands");
        match command {
            0x1E => (self.loaded_us, self.conversion) = (Some(now_us + 2_800), None),
            0x40..=0x48 | 0x50..=0x58 if command & 1 == 0 => {
                // Longest conversion times.
                let us = [600, 1_170, 2_280, 4_540, 9_040][usize::from(command & 0xF) / 2];
                let is_spoilt = self.conversion.is_some_and(|(_, end_us, _)| now_us < end_us);
                self.conversion = Some((command, now_us + us, is_spoilt));
            }
            _ => panic!("command {command:#x}"),
        }
    }

    fn reset(&mut self, _: u64) {
        (self.loaded_us, self.conversion) = (None, None);
    }
}

fn right(reading: &PressureReading) -> bool {
    (reading.pressure_pa - 101_325.0).abs() < 3.0 && (reading.temperature_c - 20.5).abs() < 0.02
}

#[test]
fn it_passes_the_suite() {
    let (part, model, pace) = (&Ms5611::default, &|| Part5611::new(SETS[0]), Pace::Polled(500..=550));
    // The MS5611 has no identity register, so no other part can be told from it.
    Suite { part, model, right, notice_us: 500_000, others: Vec::new(), pace }.passes();
}

#[test]
fn pressures_and_temperatures_of_the_whole_range_are_read_and_none_beyond() {
    let points = [
        (1_010.0, -39.9),
        (119_990.0, -39.9),
        (1_010.0, 84.9),
        (119_990.0, 84.9),
        (101_325.0, 20.01),
        (101_325.0, 19.9),
        (50_000.0, -10.0),
        (30_000.0, -15.5),
    ];
    for set in SETS {
        let model = |pressure_pa, temperature_c| Part5611 { pressure_pa, temperature_c, ..Part5611::new(set) };
        reads_pressures(Ms5611::default, model, &points, [3.0, 0.03], 11);
    }
    let model = |pressure_pa, temperature_c| Part5611 { pressure_pa, temperature_c, ..Part5611::new(SETS[0]) };
    reads_no_pressure_beyond(Ms5611::default, model, [950.0, 120_100.0]);
}

#[test]
fn the_data_sheets_example_is_read() {
    let mut part = Ms5611::default();
    let prom = Part5611::new(SETS[0]).prom;
    for (command, word) in (0xA0..).step_by(2).zip(prom) {
        assert_eq!(part.take(command, &word.to_be_bytes()), Ok(None));
    }
    assert_eq!(part.take(0x00, &8_569_150_u32.to_be_bytes()[1..]), Ok(None));
    let reading = part.take(0x00, &9_085_466_u32.to_be_bytes()[1..]).expect("in range").expect("complete");
    assert_eq!(reading.temperature_c, 20.07);
    assert!((reading.pressure_pa - 100_009.5).abs() < 0.5, "{reading:?}");
}

#[test]
fn the_checksum_is_that_of_the_makers_example() {
    // Example of AN520.
    assert_eq!(crc4([0x3132, 0x3334, 0x3536, 0x3738, 0x3940, 0x4142, 0x4344, 0x4500]), 0xB);
}

#[test]
fn a_damaged_prom_is_refused() {
    for word in 0..8 {
        for bit in (0..16).filter(|bit| word < 7 || !(4..8).contains(bit)) {
            let rig = Rig::new(Part5611::new(SETS[1]));
            rig.with(|part| part.prom[word] ^= 1 << bit);
            let (readings, faults) = run(&mut rig.driver(Ms5611::default()), &rig, 500_000);
            assert!(readings.is_empty() && !faults.is_empty(), "word {word}, bit {bit}");
            assert!(faults.iter().all(|fault| *fault == PartFault::Calibration), "{faults:?}");
        }
    }
}
