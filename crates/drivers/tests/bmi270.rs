//! BMI270 against its registers, as BST-BMI270-DS000 has them.
#![allow(clippy::expect_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

mod rig;

use afbc_drivers::bmi270::Bmi270;
use afbc_drivers::{InertialReading, PartFault, Registers as _, SensorPart, SpiRegisters, Step};
use embassy_futures::block_on;
use embedded_hal_async::spi::{ErrorType, Operation, SpiDevice};
use nalgebra::Vector3;
use rig::{Model, Rig, noise, reads, refuses_another, run, survives_all_troubles};

/// FNV-1a of `bmi270_config_file` in Bosch's `BMI270_SensorAPI`.
const CONFIGURATION: u64 = 0xA3AB_E71B_91DB_4895;

struct Registers {
    identity: u8,
    registers: [u8; 128],
    /// The interface is SPI; I2C until the select line rises.
    is_spi: bool,
    reset_us: u64,
    /// When power saving was switched off.
    awake_us: Option<u64>,
    loaded: Vec<u8>,
    /// When the configuration was started, and whether it is the right one.
    started_us: Option<(u64, bool)>,
    /// Since when gyroscope and accelerometer run.
    on_us: [Option<u64>; 2],
    /// Factor of z in x of the gyroscope, in 1/512.
    cas: i8,
    rates_deg_s: [f64; 3],
    force_g: [f64; 3],
    temperature_c: f64,
    /// How far the self-test pushes each axis to a side \[g\].
    pushes_g: [f64; 3],
}

impl Registers {
    fn new(identity: u8) -> Self {
        let mut part = Registers {
            identity,
            registers: [0; 128],
            is_spi: false,
            reset_us: 0,
            awake_us: None,
            loaded: Vec::new(),
            started_us: None,
            on_us: [None; 2],
            cas: -37,
            rates_deg_s: [10.0, -250.0, 500.0],
            force_g: [0.1, -0.2, 1.0],
            temperature_c: 31.0,
            pushes_g: [8.6, -8.1, 5.4],
        };
        part.reset(0);
        part
    }

    /// Period of the output \[us\], in the performance mode.
    fn period_us(&self) -> u64 {
        let rate = self.registers[0x42] & 0xF;
        assert!((0x6..=0xD).contains(&rate), "rate {rate:#x}");
        40_000 >> (rate - 6)
    }

    fn status(&self, now_us: u64) -> u8 {
        match self.started_us {
            Some((since_us, is_right)) if now_us >= since_us + 15_000 => 2 - u8::from(is_right),
            _ => 0,
        }
    }

    fn data(&self, now_us: u64) -> [u8; 12] {
        let now_us = now_us / self.period_us() * self.period_us();
        let on = |at: usize, start_us: u64| self.on_us[at].is_some_and(|on_us| now_us >= on_us + start_us);
        let mut numbers = [0_i16; 6];
        let acc = 32768.0 / f64::from(2 << (self.registers[0x41] & 3));
        let gyr = 32768.0 / (2000.0 / f64::from(1 << (self.registers[0x43] & 7)));
        for axis in 0..3 {
            if on(1, 2_000) {
                let push = match self.registers[0x6D] & 0b1101 {
                    0b1101 => self.pushes_g[axis],
                    0b1001 => -self.pushes_g[axis],
                    _ => 0.0,
                };
                let lsb = (self.force_g[axis] + push) * acc + 6.0 * noise(now_us, axis as u64);
                numbers[axis] = lsb.round().clamp(-32768.0, 32767.0) as i16;
            }
            if on(0, 45_000) {
                let z = if axis == 0 { self.rates_deg_s[2] * f64::from(self.cas) / 512.0 } else { 0.0 };
                let lsb = (self.rates_deg_s[axis] + z) * gyr + 2.0 * noise(now_us, 4 + axis as u64);
                numbers[3 + axis] = lsb.round().clamp(-32768.0, 32767.0) as i16;
            }
        }
        let mut bytes = [0; 12];
        for (pair, number) in bytes.chunks_exact_mut(2).zip(numbers) {
            pair.copy_from_slice(&number.to_le_bytes());
        }
        bytes
    }

    fn temperature(&self, now_us: u64) -> [u8; 2] {
        let is_on = self.registers[0x7D] & 8 != 0 && self.on_us[0].is_some_and(|on_us| now_us >= on_us + 10_000);
        let number = if is_on { ((self.temperature_c - 23.0) * 512.0).round() as i16 } else { i16::MIN };
        number.to_le_bytes()
    }
}

impl Model for Registers {
    fn read(&mut self, now_us: u64, register: u8, into: &mut [u8]) {
        if now_us < self.reset_us + 2_000 || !self.is_spi {
            self.is_spi |= now_us >= self.reset_us + 2_000;
            into.fill(0xFF);
            return;
        }
        let runs = self.status(now_us) == 1;
        for (register, byte) in (usize::from(register)..).zip(into) {
            *byte = match register {
                0x00 => self.identity,
                0x0C..=0x17 if runs => self.data(now_us)[register - 0x0C],
                0x0C..=0x17 => 0,
                0x21 => self.status(now_us),
                0x22..=0x23 => self.temperature(now_us)[register - 0x22],
                0x3C if runs && self.registers[0x2F] == 0 => self.cas as u8 & 0x7F,
                0x30..=0x3F => 0,
                _ => self.registers[register],
            };
        }
    }

    fn write(&mut self, now_us: u64, register: u8, bytes: &[u8]) {
        if now_us < self.reset_us + 2_000 || !self.is_spi {
            self.is_spi |= now_us >= self.reset_us + 2_000;
            return;
        }
        let is_awake = self.awake_us.is_some_and(|awake_us| now_us >= awake_us + 450);
        match (register, bytes) {
            (0x7E, [0xB6]) => self.reset(now_us),
            (0x7C, [value]) => {
                self.registers[0x7C] = *value;
                self.awake_us = (value & 1 == 0).then_some(self.awake_us.unwrap_or(now_us));
            }
            // Other writes are lost while power is saved.
            _ if !is_awake => (),
            (0x59, [0]) => {
                self.loaded.clear();
                self.started_us = None;
                self.registers[0x59] = 0;
            }
            (0x59, [value]) => {
                let hash = self.loaded.iter().fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
                    (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01B3)
                });
                self.started_us = Some((now_us, self.loaded.len() == 8192 && hash == CONFIGURATION));
                self.registers[0x59] = *value;
            }
            // A block stays on this register; it is taken once INIT_CTRL has been 0.
            (0x5E, _) if self.registers[0x59] == 0 => self.loaded.extend_from_slice(bytes),
            (0x7D, [value]) => {
                self.registers[0x7D] = *value;
                for (on_us, bit) in self.on_us.iter_mut().zip([2, 4]) {
                    *on_us = (value & bit != 0).then_some(on_us.unwrap_or(now_us));
                }
            }
            (0x40..=0x5D | 0x5F..=0x6F, _) => {
                for (register, byte) in (usize::from(register)..).zip(bytes) {
                    self.registers[register] = *byte;
                }
            }
            _ => (),
        }
    }

    fn reset(&mut self, now_us: u64) {
        self.registers = [0; 128];
        for (register, value) in [(0x40, 0xA8), (0x41, 0x02), (0x42, 0xA9), (0x59, 0x90), (0x7C, 0x03)] {
            self.registers[register] = value;
        }
        (self.is_spi, self.reset_us, self.awake_us, self.started_us) = (false, now_us, None, None);
        self.on_us = [None; 2];
        self.loaded.clear();
    }

    fn next_interrupt_us(&self, now_us: u64) -> Option<u64> {
        let routed =
            self.registers[0x58] & 4 != 0 && self.registers[0x53] & 0b1110 == 0b1010 && self.registers[0x55] == 0;
        let on = self.status(now_us) == 1 && self.on_us.iter().any(Option::is_some);
        (routed && on).then(|| (now_us / self.period_us() + 1) * self.period_us())
    }
}

/// The least differences of the data sheet: 16, -15 and 10 g.
#[test]
fn its_self_test_passes_when_it_is_pushed_far_enough() {
    for (pushes_g, passes) in [
        ([8.1, -7.6, 5.1], true),
        ([7.9, -7.6, 5.1], false),
        ([8.1, -7.4, 5.1], false),
        ([8.1, -7.6, 4.9], false),
        ([8.1, 7.6, 5.1], false),
        ([0.0; 3], false),
    ] {
        let rig = Rig::new(Registers::new(0x24));
        rig.with(|part| part.pushes_g = pushes_g);
        let mut driver = rig.driver(Bmi270::default());
        let result = block_on(driver.self_test());
        assert_eq!(result, if passes { Ok(()) } else { Err(PartFault::SelfTest) }, "{pushes_g:?}");
        let (readings, faults) = run(&mut driver, &rig, 300_000);
        assert!(faults.is_empty() && readings.len() > 200 && readings.iter().all(|reading| right(&reading.value)));
    }
}

fn right(reading: &InertialReading) -> bool {
    reads(reading, [10.0, -250.0, 500.0], [0.1, -0.2, 1.0], 31.0)
}

#[test]
fn every_fault_is_noticed_and_survived() {
    survives_all_troubles(Bmi270::default, || Registers::new(0x24), true, 60_000, right);
}

#[test]
fn another_part_is_named() {
    refuses_another(Bmi270::default(), Registers::new(0x43), 0x43);
}

#[test]
fn there_are_1600_readings_a_second_at_their_interrupts() {
    let rig = Rig::new(Registers::new(0x24));
    let mut driver = rig.driver(Bmi270::default());
    let (readings, faults) = run(&mut driver, &rig, 1_000_000);
    let times: Vec<u64> = readings.iter().map(|reading| reading.at_us).collect();
    assert!(times.len() > 1_400 && times.windows(2).all(|pair| pair[1] - pair[0] == 625), "{times:?}, {faults:?}");
}

#[test]
fn its_full_range_is_read() {
    let rig = Rig::new(Registers::new(0x24));
    rig.with(|part| part.cas = 0);
    let mut driver = rig.driver(Bmi270::default());
    let cases = [(1990.0, 15.9, -40.0), (-1990.0, -15.9, 85.0), (2500.0, 15.0, 23.0), (-1900.0, -20.0, 23.0)];
    for (rate, force, temperature) in cases {
        rig.with(|part| {
            (part.rates_deg_s, part.force_g, part.temperature_c) = ([rate; 3], [force; 3], temperature);
        });
        let _ = run(&mut driver, &rig, 100_000);
        let (readings, _) = run(&mut driver, &rig, 10_000);
        let reading = readings.last().expect("readings").value;
        let [rate, force] = [rate.clamp(-2000.0, 2000.0).to_radians(), force.clamp(-16.0, 16.0) * 9.80665];
        let InertialReading { rates_rad_s, specific_force_m_s2, temperature_c } = reading;
        assert!((rates_rad_s - Vector3::from_element(rate as f32)).amax() < 0.02, "{rates_rad_s}");
        assert!((specific_force_m_s2 - Vector3::from_element(force as f32)).amax() < 0.05, "{specific_force_m_s2}");
        assert!((temperature_c - temperature as f32).abs() < 0.01, "{temperature_c}");
    }
}

#[test]
fn a_wrong_crosstalk_of_the_gyroscope_is_corrected() {
    for cas in [-64, -1, 0, 3, 63] {
        let rig = Rig::new(Registers::new(0x24));
        rig.with(|part| part.cas = cas);
        let (readings, faults) = run(&mut rig.driver(Bmi270::default()), &rig, 500_000);
        assert!(faults.is_empty() && readings.iter().all(|reading| right(&reading.value)), "{cas}");
    }
}

#[test]
fn a_part_whose_configuration_is_lost_is_late() {
    // Nothing that is read back is lost, and all the same it does not work.
    let rig = Rig::new(Registers::new(0x24));
    let mut driver = rig.driver(Bmi270::default());
    let _ = run(&mut driver, &rig, 500_000);
    rig.with(|part| part.started_us = Some((0, false)));
    let (readings, faults) = run(&mut driver, &rig, 5_000);
    assert!(readings.is_empty() && faults.contains(&PartFault::Late), "{faults:?}");
}

/// What a device was sent, for a transfer.
struct Sent(Vec<u8>);

impl ErrorType for Sent {
    type Error = core::convert::Infallible;
}

impl SpiDevice for Sent {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Self::Error> {
        self.0.clear();
        for operation in operations {
            match operation {
                Operation::TransferInPlace(bytes) => {
                    self.0.extend_from_slice(bytes);
                    bytes.iter_mut().zip(0..).for_each(|(byte, at)| *byte = at);
                }
                _ => panic!("not what a read is"),
            }
        }
        Ok(())
    }
}

#[test]
fn a_byte_is_skipped_in_front_of_its_answers_and_the_configuration_is_one_block() {
    let spi = Bmi270::SPI.expect("SPI");
    let mut byte = [0];
    block_on(SpiRegisters::new(Sent(Vec::new()), spi).read(0x00, &mut byte)).expect("a read");
    assert_eq!(byte, [2], "command and dummy are sent before it is read");
    let blocks = Bmi270::SETUP.iter().filter(|step| matches!(step, Step::WriteAll(0x5E, bytes) if bytes.len() == 8192));
    assert_eq!(blocks.count(), 1);
}
