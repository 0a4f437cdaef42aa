//! IST8310, tested on a model of its registers (its data sheet).

use crate::rig::suite::{Pace, Suite, reads_fields};
use crate::rig::{Model, Rig, Trouble, noise, run};
use afbc_drivers::ist8310::Ist8310;
use afbc_drivers::{MagneticReading, PartFault, SensorPart};
use nalgebra::Vector3;

/// Field along forward, right and down.
const FIELD_UT: [f64; 3] = [22.0, -3.0, 42.0];

struct Registers {
    identity: u8,
    registers: [u8; 128],
    up_us: u64,
    /// Time at which the current measurement ends.
    done_us: Option<u64>,
    data: [u8; 6],
    is_ready: bool,
    field_ut: [f64; 3],
}

impl Registers {
    fn new() -> Self {
        let (data, field_ut) = ([0; 6], FIELD_UT);
        let mut part =
            Registers { identity: 0x10, registers: [0; 128], up_us: 0, done_us: None, data, is_ready: false, field_ut };
        part.reset(0);
        part
    }

    fn measure(&mut self, now_us: u64) {
        let Some(done_us) = self.done_us.filter(|done_us| *done_us <= now_us) else { return };
        (self.done_us, self.is_ready) = (None, true);
        let [x, y, down] = self.field_ut;
        let averages = [self.registers[0x41] & 7, self.registers[0x41] >> 3 & 7, self.registers[0x41] & 7];
        for (axis, ut) in [x, y, -down].into_iter().enumerate() {
            let lsb_per_ut = if self.registers[0x0D] & (0x10 << axis) == 0 { 3.3 } else { 13.2 };
            // Fewer samples are noisier, and other pulses give a wrong scale.
            let noise_ut = 0.2 * f64::from(1 << (4 - averages[axis])) * noise(done_us, axis as u64);
            let gain = if self.registers[0x42] & 0xC0 == 0xC0 { 1.0 } else { 0.9 };
            let lsb = ((gain * ut + noise_ut) * lsb_per_ut).round().clamp(-32768.0, 32767.0) as i16;
            self.data[2 * axis..2 * axis + 2].copy_from_slice(&lsb.to_le_bytes());
        }
    }
}

impl Model for Registers {
    fn read(&mut self, now_us: u64, register: u8, into: &mut [u8]) {
        self.measure(now_us);
        for (register, byte) in (usize::from(register)..).zip(into) {
            *byte = match register {
                0x0B if now_us < self.up_us => 1,
                _ if now_us < self.up_us => 0,
                0x00 => self.identity,
                0x02 => u8::from(self.is_ready),
                0x03..=0x08 => {
                    self.is_ready = false;
                    self.data[register - 0x03]
                }
                _ => self.registers[register],
            };
        }
    }

    fn write(&mut self, now_us: u64, register: u8, bytes: &[u8]) {
        self.measure(now_us);
        for (register, &byte) in (usize::from(register)..).zip(bytes) {
            match register {
                _ if now_us < self.up_us => (),
                0x0A if byte & 0xF == 1 => {
                    // A measurement of 16 samples takes 6 ms, which allows at most 166 per second.
                    let samples = 1_u64 << (self.registers[0x41] & 7).max(self.registers[0x41] >> 3 & 7);
                    self.done_us = Some(now_us + 1_000 + 312 * samples);
                }
                0x0B if byte & 1 != 0 => self.reset(now_us),
                0x0A | 0x0B | 0x0D | 0x41 | 0x42 => self.registers[register] = byte,
                _ => panic!("writes to {register:#x}"),
            }
        }
    }

    fn reset(&mut self, now_us: u64) {
        self.registers = [0; 128];
        // Reset values, including bits without a meaning.
        (self.registers[0x0D], self.registers[0x42]) = (0x02, 0x41);
        (self.up_us, self.done_us, self.is_ready) = (now_us + 15_000, None, false);
    }
}

fn is_field(reading: &MagneticReading, field_ut: [f64; 3]) -> bool {
    (reading.field_ut - Vector3::from(field_ut.map(|ut| ut as f32))).amax() < 0.3
}

fn right(reading: &MagneticReading) -> bool {
    is_field(reading, FIELD_UT)
}

#[test]
fn it_passes_the_suite() {
    let others = vec![(Registers { identity: 0x08, ..Registers::new() }, 0x08)];
    let pace = Pace::Polled(950..=1_000);
    // After a reset the part measures on with its worse defaults. The registers show this, and the driver reads one of
    // them every 16 cycles.
    Suite { part: &|| Ist8310, model: &Registers::new, right, notice_us: 1_500_000, others, pace }.passes();
}

#[test]
fn fields_of_the_whole_range_are_read_and_none_beyond() {
    let inside = [[1_599.0, -1_599.0, 2_479.0], [-1_599.0, 1_599.0, -2_479.0], [0.5, -0.5, 1.0]];
    let beyond = [[1_610.0, 0.0, 0.0], [0.0, -1_610.0, 0.0], [0.0, 0.0, 2_490.0], [0.0, 0.0, -2_600.0]];
    let fields = [&inside[..], &beyond];
    reads_fields(Ist8310, Registers::new(), |part, field_ut| part.field_ut = field_ut, is_field, fields);
}

/// The ends of the range belong to it.
#[test]
fn the_largest_field_is_read() {
    let read = |words: [i16; 3]| Ist8310.take(0, words.map(i16::to_le_bytes).as_flattened());
    let field_ut = read([21_120, -21_120, 32_736]).ok().flatten().expect("a reading").field_ut;
    assert_eq!(field_ut, Vector3::new(1_600.0, -1_600.0, -2_480.0));
    for beyond in [[21_121, 0, 0], [0, -21_121, 0], [0, 0, 32_737], [0, 0, -32_737]] {
        assert_eq!(read(beyond), Err(PartFault::Range), "{beyond:?}");
    }
}

#[test]
fn after_a_reset_it_soon_measures_as_before() {
    let rig = Rig::new(Registers::new());
    let mut driver = rig.driver(Ist8310);
    let _ = run(&mut driver, &rig, 500_000);
    rig.set(Trouble::Reset);
    let (_, faults) = run(&mut driver, &rig, 2_000_000);
    assert!(faults.iter().any(|fault| matches!(fault, PartFault::Register(_))), "{faults:?}");
    let (readings, faults) = run(&mut driver, &rig, 2_000_000);
    assert!(faults.is_empty() && readings.iter().all(|reading| right(&reading.value)), "{faults:?}");
}
