//! Motor controllers that answer: KISS's telemetry over the board's UART for it, when the telemetry bit of a frame on
//! their pin asks for it.

use crate::wire::Wire;
use afbc_drivers::esc_telemetry::EscReading;

/// Magnetic poles of the motors, the vehicle's default.
const POLES: u32 = 14;
/// Voltage that the first tells, and what each further one tells more, to be told apart \[0.01 V\].
const VOLTAGE_CV: u16 = 1500;
const STEP_CV: u16 = 10;

/// Returns the voltage that a motor's tells, from 0 \[0.01 V\].
pub fn voltage_cv(motor: usize) -> u16 {
    VOLTAGE_CV + motor as u16 * STEP_CV
}

/// The controllers on their line.
pub struct Escs {
    wire: Wire,
    asked: Vec<usize>,
}

impl Escs {
    pub fn new(wire: Wire) -> Self {
        Escs { wire, asked: Vec::new() }
    }

    /// Takes who has been asked.
    pub fn ask(&mut self, motors: Vec<usize>) {
        self.asked.extend(motors);
    }

    /// Lets those who were asked answer what the rotors do \[rad/s\].
    pub fn answer(&mut self, speeds_rad_s: &[f64]) {
        for motor in self.asked.drain(..) {
            let speed_rad_s = speeds_rad_s.get(motor).copied().unwrap_or_default();
            let answer = EscReading {
                temperature_c: 40,
                voltage_cv: voltage_cv(motor),
                erpm_hundreds: EscReading::erpm_hundreds_of(speed_rad_s as f32, POLES),
                ..EscReading::default()
            };
            self.wire.send(&answer.to_bytes());
        }
    }
}
