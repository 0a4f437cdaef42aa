//! LIS3MDL, tested on a model of its registers (DS9463).

use crate::rig::suite::{Pace, Suite, reads_fields};
use crate::rig::{Model, Rig, noise, run};
use afbc_drivers::lis3mdl::Lis3mdl;
use afbc_drivers::{MagneticReading, PartFault};
use embassy_futures::block_on;
use nalgebra::Vector3;

const FIELD_UT: [f64; 3] = [22.0, -3.0, -42.0];

struct Registers {
    identity: u8,
    registers: [u8; 64],
    since_us: u64,
    measured: u64,
    field_ut: [f64; 3],
    /// Field applied by the self-test.
    own_ut: [f64; 3],
}

impl Registers {
    fn new() -> Self {
        let mut part = Registers {
            identity: 0x3D,
            registers: [0; 64],
            since_us: 0,
            measured: 0,
            field_ut: FIELD_UT,
            own_ut: [200.0, 200.0, 50.0],
        };
        part.reset(0);
        part
    }

    fn measure(&mut self, now_us: u64) {
        if self.registers[0x22] & 3 != 0 {
            return;
        }
        assert!(self.registers[0x20] & 2 == 0 && self.registers[0x22] & 0x20 == 0, "rates of tables 19 and 26");
        let period_us = 1_600_000 >> (self.registers[0x20] >> 2 & 7);
        let measured = (now_us - self.since_us) / period_us;
        if measured == self.measured {
            return;
        }
        self.measured = measured;
        let lsb_per_gauss = [6_842.0, 3_421.0, 2_281.0, 1_711.0][usize::from(self.registers[0x21] >> 5 & 3)];
        for axis in 0..3 {
            // Lower-performance modes are noisier.
            let mode = if axis == 2 { self.registers[0x23] >> 2 } else { self.registers[0x20] >> 5 } & 3;
            let noise_ut = 0.4 * f64::from(4 - mode) * noise(now_us, axis as u64);
            let own_ut = if self.registers[0x20] & 1 != 0 { self.own_ut[axis] } else { 0.0 };
            let lsb = ((self.field_ut[axis] + own_ut + noise_ut) / 100.0 * lsb_per_gauss).round();
            let lsb = lsb.clamp(-32768.0, 32767.0) as i16;
            let bytes = if self.registers[0x23] & 2 == 0 { lsb.to_le_bytes() } else { lsb.to_be_bytes() };
            self.registers[0x28 + 2 * axis..0x2A + 2 * axis].copy_from_slice(&bytes);
        }
        self.registers[0x27] |= if self.registers[0x27] & 8 == 0 { 0x0F } else { 0xF0 };
    }
}

impl Model for Registers {
    fn read(&mut self, now_us: u64, register: u8, into: &mut [u8]) {
        self.measure(now_us);
        // Without the auto-increment bit of I2C, the address stays.
        let counts = register & 0x80 != 0;
        let mut register = usize::from(register & 0x3F);
        for byte in into {
            *byte = if register == 0x0F { self.identity } else { self.registers[register] };
            if register == 0x2D {
                self.registers[0x27] = 0;
            }
            if counts {
                register = if register == 0x2D { 0x28 } else { (register + 1) & 0x3F };
            }
        }
    }

    fn write(&mut self, now_us: u64, register: u8, bytes: &[u8]) {
        self.measure(now_us);
        let &[byte] = bytes else { panic!("one register at a time") };
        match register {
            0x21 if byte & 4 != 0 => self.reset(now_us),
            0x20..=0x24 => {
                self.registers[usize::from(register)] = byte;
                (self.since_us, self.measured) = (now_us, 0);
            }
            _ => panic!("writes to {register:#x}, which may damage it"),
        }
    }

    fn reset(&mut self, _: u64) {
        self.registers = [0; 64];
        (self.registers[0x20], self.registers[0x22]) = (0x10, 0x03);
    }
}

fn is_field(reading: &MagneticReading, field_ut: [f64; 3]) -> bool {
    (reading.field_ut - Vector3::from(field_ut.map(|ut| ut as f32))).amax() < 0.45
}

/// The data sheet's limits: 1 to 3 gauss along x and y, 0.1 to 1 gauss along z.
#[test]
fn its_self_test_passes_within_the_bounds() {
    for (own_ut, passes) in [
        ([110.0, 290.0, 12.0], true),
        ([-110.0, 290.0, 95.0], true),
        ([90.0, 200.0, 50.0], false),
        ([200.0, 310.0, 50.0], false),
        ([200.0, 200.0, 8.0], false),
        ([200.0, 200.0, 105.0], false),
        ([0.0; 3], false),
    ] {
        let rig = Rig::new(Registers::new());
        rig.with(|part| part.own_ut = own_ut);
        let mut driver = rig.driver(Lis3mdl);
        let result = block_on(driver.self_test());
        assert_eq!(result, if passes { Ok(()) } else { Err(PartFault::SelfTest) }, "{own_ut:?}");
        let (readings, faults) = run(&mut driver, &rig, 500_000);
        assert!(faults.is_empty() && readings.len() > 30 && readings.iter().all(|reading| right(&reading.value)));
    }
}

fn right(reading: &MagneticReading) -> bool {
    is_field(reading, FIELD_UT)
}

#[test]
fn it_passes_the_suite() {
    let others = vec![(Registers { identity: 0x40, ..Registers::new() }, 0x40)];
    let pace = Pace::Polled(798..=802);
    Suite { part: &|| Lis3mdl, model: &Registers::new, right, notice_us: 500_000, others, pace }.passes();
}

#[test]
fn fields_of_the_whole_range_are_read_and_none_beyond() {
    let inside = [[399.0, -399.0, 0.5], [-399.0, 399.0, -0.5], [0.2, 0.5, 399.0], [48.0, 16.0, -30.0]];
    let fields = [&inside[..], &[[402.0, 0.0, 0.0], [0.0, -470.0, 0.0], [0.0, 0.0, 900.0]]];
    reads_fields(Lis3mdl, Registers::new(), |part, field_ut| part.field_ut = field_ut, is_field, fields);
}
