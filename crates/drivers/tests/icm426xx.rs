//! ICM-42688-P and ICM-42605, tested on a model of their registers (DS-000347). The model includes undocumented
//! behaviour: the adaptive full-scale range freezes the gyroscope.

use crate::rig::suite::{Pace, Suite, reads_the_whole_range};
use crate::rig::{Model, Rig, Trouble, noise, reads, run};
use afbc_drivers::icm426xx::{Icm426xx, Icm42688p};
use afbc_drivers::{InertialReading, PartFault, SensorPart};
use embassy_futures::block_on;

/// Registers of bank 0; of banks 1 and 2, only the self-test data.
struct Registers {
    identity: u8,
    bank: u8,
    registers: [u8; 128],
    /// Times at which gyroscope and accelerometer were switched on.
    on_us: [Option<u64>; 2],
    rates_deg_s: [f64; 3],
    /// Amplitude of each rate's oscillation, with a period of 0.1 s \[deg/s\].
    swing_deg_s: f64,
    force_g: [f64; 3],
    /// Factory's self-test codes, and each axis' response relative to them.
    trims: [[u8; 3]; 2],
    responds: [f64; 6],
}

impl Registers {
    fn new(identity: u8) -> Self {
        let (rates_deg_s, force_g) = ([10.0, -250.0, 0.5], [0.1, -0.2, 1.0]);
        let (trims, responds) = ([[110, 97, 130], [140, 1, 120]], [1.0; 6]);
        let (registers, on_us) = ([0; 128], [None; 2]);
        let (bank, swing_deg_s) = (0, 0.0);
        let mut part =
            Registers { identity, bank, registers, on_us, rates_deg_s, swing_deg_s, force_g, trims, responds };
        part.reset(0);
        part
    }

    fn scale(config: u8, full: f64) -> f64 {
        32768.0 / (full / f64::from(1 << (config >> 5)))
    }

    /// Returns the output period \[us\].
    fn period_us(&self) -> u64 {
        match self.registers[0x4F] & 0xF {
            0x3 => 125,
            0x4 => 250,
            0x5 => 500,
            0x6 => 1_000,
            0x7 => 5_000,
            other => panic!("rate {other:#x}"),
        }
    }

    /// Returns the true turn rate of an axis \[deg/s\].
    fn rate_deg_s(&self, axis: usize, at_us: u64) -> f64 {
        let turns = at_us as f64 / 100e3 + axis as f64 / 3.0;
        self.rates_deg_s[axis] + self.swing_deg_s * (turns * std::f64::consts::TAU).sin()
    }

    /// Returns the time of the sample that the gyroscope shows. It is the newest, unless AFSR is on and a rate has
    /// crossed 100 deg/s within 2 ms. No data sheet mentions this (ArduPilot's issue 25025).
    fn shown_us(&self, sample_us: u64) -> u64 {
        let is_fast = |at_us| (0..3).any(|axis| self.rate_deg_s(axis, at_us).abs() > 100.0);
        let adapts = self.registers[0x4D] & 0xC0 != 0x40;
        let crossed = (1..=2_000 / self.period_us()).rev().find_map(|samples| {
            let before_us = sample_us.saturating_sub(samples * self.period_us());
            (is_fast(before_us) != is_fast(before_us + self.period_us())).then_some(before_us)
        });
        crossed.filter(|_| adapts).unwrap_or(sample_us)
    }

    fn data(&self, now_us: u64) -> [u8; 14] {
        let now_us = now_us / self.period_us() * self.period_us();
        let shown_us = self.shown_us(now_us);
        let mut numbers = [-32768_i16; 7];
        numbers[0] = ((31.0 - 25.0) * 132.48 + 4.0 * noise(now_us, 9)) as i16;
        let on = |at: usize, start_us: u64| self.on_us[at].is_some_and(|on_us| now_us >= on_us + start_us);
        for axis in 0..3 {
            if on(1, 10_000) {
                let responds = self.registers[0x70] & 0x40 != 0 && self.registers[0x70] >> (3 + axis) & 1 != 0;
                let more_g =
                    if responds { self.responds[3 + axis] * factory(self.trims[1][axis]) / 16384.0 } else { 0.0 };
                let lsb = (self.force_g[axis] + more_g) * Self::scale(self.registers[0x50], 16.0);
                numbers[1 + axis] = (lsb + 8.0 * noise(now_us, axis as u64)).round().clamp(-32767.0, 32767.0) as i16;
            }
            if on(0, 30_000) {
                let responds = self.registers[0x70] >> axis & 1 != 0;
                let more_deg_s =
                    if responds { self.responds[axis] * factory(self.trims[0][axis]) / 131.0 } else { 0.0 };
                let rate_deg_s = self.rate_deg_s(axis, shown_us) + more_deg_s;
                let lsb = rate_deg_s * Self::scale(self.registers[0x4F], 2000.0);
                numbers[4 + axis] =
                    (lsb + 2.0 * noise(shown_us, 4 + axis as u64)).round().clamp(-32767.0, 32767.0) as i16;
            }
        }
        let mut bytes = [0; 14];
        for (pair, number) in bytes.chunks_exact_mut(2).zip(numbers) {
            pair.copy_from_slice(&if self.registers[0x4C] & 0x10 != 0 {
                number.to_be_bytes()
            } else {
                number.to_le_bytes()
            });
        }
        bytes
    }
}

impl Model for Registers {
    fn read(&mut self, now_us: u64, register: u8, into: &mut [u8]) {
        for (register, byte) in (usize::from(register)..).zip(into) {
            *byte = match (register, self.bank) {
                (0x76, _) => self.bank,
                (0x75, 0) => self.identity,
                (0x1D..=0x2A, 0) => self.data(now_us)[register - 0x1D],
                (_, 0) => self.registers[register],
                (0x5F..=0x61, 1) => self.trims[0][register - 0x5F],
                (0x3B..=0x3D, 2) => self.trims[1][register - 0x3B],
                _ => 0,
            };
        }
    }

    fn write(&mut self, now_us: u64, register: u8, bytes: &[u8]) {
        for (register, byte) in (usize::from(register)..).zip(bytes) {
            match (register, self.bank) {
                (0x76, _) => self.bank = byte & 7,
                (0x11, 0) if byte & 1 != 0 => self.reset(now_us),
                (0x1D..=0x2A | 0x75, 0) => (),
                (0x4E, 0) => {
                    self.registers[register] = *byte;
                    for (at, on_us) in self.on_us.iter_mut().enumerate() {
                        let on = byte >> (2 * (1 - at) as u8) & 3 == 3 || at == 0 && byte >> 2 & 3 == 3;
                        let on = if at == 1 { byte & 3 == 3 } else { on };
                        *on_us = if on { on_us.or(Some(now_us)) } else { None };
                    }
                }
                (_, 0) => self.registers[register] = *byte,
                _ => (),
            }
        }
    }

    fn reset(&mut self, _: u64) {
        self.registers = [0; 128];
        for (register, value) in
            [(0x4C, 0x30), (0x4D, 0x91), (0x4F, 0x06), (0x50, 0x06), (0x52, 0x11), (0x64, 0x10), (0x65, 0x10)]
        {
            self.registers[register] = value;
        }
        (self.bank, self.on_us) = (0, [None; 2]);
    }

    fn next_interrupt_us(&self, now_us: u64) -> Option<u64> {
        let routed = self.registers[0x65] & 8 != 0 && self.registers[0x14] & 3 == 3 && self.registers[0x64] & 0x10 == 0;
        // From 4 kHz on, the pulse of 100 us and the equally long pause after it must be off.
        let is_apart = self.period_us() > 250 || self.registers[0x64] & 0x60 == 0x60;
        let on = self.on_us.iter().any(Option::is_some);
        (routed && is_apart && on).then(|| (now_us / self.period_us() + 1) * self.period_us())
    }
}

/// Returns the response for a factory code, in raw numbers at 250 deg/s and 2 g.
fn factory(trim: u8) -> f64 {
    2620.0 * 1.01_f64.powi(i32::from(trim) - 1)
}

#[test]
fn its_self_test_passes_as_at_the_factory_and_the_part_reads_on() {
    // The self-test passes if a rate responds by at least half, and a force by 0.5 to 1.5.
    for (axis, response, passes) in [
        (0, 1.0, true),
        (1, -0.55, true),
        (2, 0.45, false),
        (2, 1.9, true),
        (3, 0.45, false),
        (4, -0.55, true),
        (5, 1.45, true),
        (5, 1.55, false),
        (3, 0.0, false),
    ] {
        let rig = Rig::new(Registers::new(0x47));
        rig.with(|part| (part.rates_deg_s, part.responds[axis]) = ([1.0, -19.0, 0.5], response));
        let mut driver = rig.driver(Icm42688p::<false> {});
        let result = block_on(driver.self_test());
        assert_eq!(result, if passes { Ok(()) } else { Err(PartFault::SelfTest) }, "{axis}: {response}");
        let (readings, faults) = run(&mut driver, &rig, 200_000);
        let right = |reading: &InertialReading| reads(reading, [1.0, -19.0, 0.5], [0.1, -0.2, 1.0], 31.0);
        assert!(faults.is_empty() && readings.len() > 100 && readings.iter().all(|reading| right(&reading.value)));
    }
    // The self-test fails if the part turns, or does not answer.
    let rig = Rig::new(Registers::new(0x47));
    rig.with(|part| part.rates_deg_s = [0.0, 0.0, 25.0]);
    assert_eq!(block_on(rig.driver(Icm42688p::<true> {}).self_test()), Err(PartFault::SelfTest));
    rig.set(Trouble::Reads(0xFF));
    assert_eq!(block_on(rig.driver(Icm42688p::<true> {}).self_test()), Err(PartFault::Silent));
}

fn right(reading: &InertialReading) -> bool {
    reads(reading, [10.0, -250.0, 0.5], [0.1, -0.2, 1.0], 31.0)
}

fn passes<const IDENTITY: u8, const POLLED: bool>(other: u8) {
    let (part, model) = (&|| Icm426xx::<IDENTITY, POLLED> {}, &|| Registers::new(IDENTITY));
    let others = vec![(Registers::new(other), other)];
    let pace = Pace::Interrupts(if POLLED { 250 } else { 1_000 }, 900);
    Suite { part, model, right, notice_us: 60_000, others, pace }.passes();
    let set = |part: &mut Registers, rates, force, _| (part.rates_deg_s, part.force_g) = (rates, force);
    reads_the_whole_range(part(), model(), set, ([31.0; 4], 0.1));
}

#[test]
fn all_pass_the_suite() {
    passes::<0x47, false>(0x42);
    passes::<0x47, true>(0x42);
    passes::<0x42, false>(0x47);
    passes::<0x42, true>(0x47);
}

/// An axis that has not been measured yet makes an answer no reading.
#[test]
fn an_axis_without_a_measurement_is_no_reading() {
    let take = |answer: [u8; 14]| Icm42688p::<true> {}.take(0, &answer);
    assert!(take([0; 14]).unwrap().is_some());
    // The first number is the temperature.
    for axis in 1..7 {
        let mut answer = [0; 14];
        answer[2 * axis] = 0x80;
        assert_eq!(take(answer), Ok(None), "axis {axis}");
        answer[2 * axis + 1] = 1;
        assert!(take(answer).unwrap().is_some(), "axis {axis}");
    }
}

/// The part always shows the present rates, however it moves.
fn follows_every_turn<const IDENTITY: u8, const POLLED: bool>() {
    for (middle, swing) in [(0.0, 90.0), (0.0, 150.0), (100.0, 20.0), (-100.0, 5.0), (-300.0, 600.0), (0.0, 1900.0)] {
        let rig = Rig::new(Registers::new(IDENTITY));
        rig.with(|part| (part.rates_deg_s, part.swing_deg_s) = ([middle; 3], swing));
        let mut driver = rig.driver(Icm426xx::<IDENTITY, POLLED> {});
        let (mut readings, faults) = run(&mut driver, &rig, 500_000);
        assert!(faults.is_empty() && readings.len() > 400, "{middle}, {swing}: {faults:?}");
        // If the part is reset in the meantime, the driver writes the same settings again.
        rig.set(Trouble::Reset);
        rig.set(Trouble::None);
        let _ = run(&mut driver, &rig, 300_000);
        readings.extend(run(&mut driver, &rig, 300_000).0);
        for reading in readings {
            for axis in 0..3 {
                let true_deg_s = rig.with(|part| part.rate_deg_s(axis, reading.at_us));
                let off_deg_s = f64::from(reading.value.rates_rad_s[axis]).to_degrees() - true_deg_s;
                assert!(off_deg_s.abs() < 0.3, "{middle}, {swing}: {off_deg_s} at {} us", reading.at_us);
            }
        }
        // The other bits of the register, which concern the clock, keep their reset values.
        assert_eq!(rig.with(|part| part.registers[0x4D]), 0x51);
    }
}

#[test]
fn no_rate_freezes_it() {
    follows_every_turn::<0x47, false>();
    follows_every_turn::<0x47, true>();
    follows_every_turn::<0x42, false>();
    follows_every_turn::<0x42, true>();
}
