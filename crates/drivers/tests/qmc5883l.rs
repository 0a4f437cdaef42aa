//! QMC5883L, tested on a model of its registers (data sheet 1.0).

use crate::rig::suite::{Pace, Suite, reads_fields};
use crate::rig::{Model, noise};
use afbc_drivers::MagneticReading;
use afbc_drivers::qmc5883l::Qmc5883l;
use nalgebra::Vector3;

const FIELD_UT: [f64; 3] = [22.0, -3.0, -42.0];

pub(crate) struct Registers {
    identity: u8,
    data: [u8; 6],
    /// Status bits DOR, OVL and DRDY.
    status: u8,
    control: [u8; 3],
    /// True while the data are locked: from the reading of the first byte to the reading of the last.
    is_locked: bool,
    since_us: u64,
    /// Number of measurements since `since_us`.
    measured: u64,
    field_ut: [f64; 3],
}

impl Registers {
    pub(crate) fn new() -> Self {
        let (data, control, field_ut) = ([0; 6], [0; 3], FIELD_UT);
        Registers { identity: 0xFF, data, status: 0, control, is_locked: false, since_us: 0, measured: 0, field_ut }
    }

    fn measure(&mut self, now_us: u64) {
        if self.control[0] & 3 != 1 {
            return;
        }
        let period_us = [100_000, 20_000, 10_000, 5_000][usize::from(self.control[0] >> 2 & 3)];
        let measured = (now_us - self.since_us) / period_us;
        if measured == self.measured {
            return;
        }
        self.measured = measured;
        if self.is_locked {
            self.status |= 4;
            return;
        }
        let lsb_per_gauss = if self.control[0] & 0x10 == 0 { 12_000.0 } else { 3_000.0 };
        // Without the set/reset pulses, an old magnetisation stays.
        let offset_ut = if self.control[2] == 1 { 0.0 } else { 15.0 };
        let lsb = std::array::from_fn::<f64, 3, _>(|axis| {
            let lsb = (self.field_ut[axis] + offset_ut) / 100.0 * lsb_per_gauss;
            (lsb + 4.0 * noise(now_us, axis as u64)).round()
        });
        for (bytes, &lsb) in self.data.chunks_exact_mut(2).zip(&lsb) {
            bytes.copy_from_slice(&(lsb.clamp(-32768.0, 32767.0) as i16).to_le_bytes());
        }
        let is_over = lsb.iter().any(|&lsb| !(-32768.0..=32767.0).contains(&lsb));
        self.status = self.status & 4 | if self.status & 1 != 0 { 4 } else { 0 } | if is_over { 3 } else { 1 };
    }
}

impl Model for Registers {
    fn read(&mut self, now_us: u64, register: u8, into: &mut [u8]) {
        self.measure(now_us);
        for (register, byte) in (usize::from(register)..).zip(into) {
            *byte = match register {
                0x00..=0x05 => {
                    if !self.is_locked {
                        self.status &= !5;
                    }
                    self.is_locked = register != 0x05;
                    self.data[register]
                }
                0x06 => {
                    let status = self.status;
                    self.status &= !4;
                    status
                }
                0x09..=0x0B => self.control[register - 0x09],
                0x0C => 0x01,
                0x0D => self.identity,
                _ => 0,
            };
        }
    }

    fn write(&mut self, now_us: u64, register: u8, bytes: &[u8]) {
        self.measure(now_us);
        for (register, &byte) in (register..).zip(bytes) {
            match register {
                0x09 => (self.control[0], self.since_us, self.measured) = (byte, now_us, 0),
                0x0A if byte & 0x80 != 0 => self.reset(now_us),
                0x0A => self.control[1] = byte & 0x41,
                0x0B => self.control[2] = byte,
                _ => (),
            }
        }
    }

    fn reset(&mut self, _: u64) {
        (self.status, self.control, self.is_locked) = (0, [0; 3], false);
    }
}

fn is_field(reading: &MagneticReading, field_ut: [f64; 3]) -> bool {
    // The tolerance is four and a half bits.
    (reading.field_ut - Vector3::from(field_ut.map(|ut| ut as f32))).amax() < 0.16
}

fn right(reading: &MagneticReading) -> bool {
    is_field(reading, FIELD_UT)
}

#[test]
fn it_passes_the_suite() {
    let others = vec![(Registers { identity: 0x80, ..Registers::new() }, 0x80)];
    let pace = Pace::Polled(995..=1_005);
    Suite { part: &|| Qmc5883l, model: &Registers::new, right, notice_us: 500_000, others, pace }.passes();
}

#[test]
fn fields_of_the_whole_range_are_read_and_none_beyond() {
    let inside = [FIELD_UT, [799.0, -799.0, 0.5], [-799.0, 799.0, -0.5], [0.2, 0.5, 799.0], [48.0, 16.0, -30.0]];
    // 8 to 10.9 gauss fit into its words; beyond, it flags an overflow.
    let beyond = [820.0, -1_050.0, 1_200.0, -5_000.0].into_iter().flat_map(|ut| {
        (0..3).map(move |axis| std::array::from_fn(|other| if other == axis { ut } else { FIELD_UT[other] }))
    });
    let fields = [&inside[..], &beyond.collect::<Vec<_>>()];
    reads_fields(Qmc5883l, Registers::new(), |part, field_ut| part.field_ut = field_ut, is_field, fields);
}
