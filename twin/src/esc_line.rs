//! Motor controllers with KISS telemetry on the board's UART. A controller answers when the telemetry bit of a DSHOT
//! frame on its pin asks for it.

use crate::wire::UartWire;
use afbc_drivers::esc_telemetry::EscReading;

/// Magnetic poles of the motors, as in the vehicle's defaults.
const POLES: u32 = 14;
/// Voltage in the first controller's telemetry, and step from one controller to the next, by which they can be told
/// apart \[0.01 V\].
const VOLTAGE_CV: u16 = 1500;
const STEP_CV: u16 = 10;

/// Returns the voltage that the controller of a motor, counted from 0, sends \[0.01 V\].
pub fn voltage_cv(motor: usize) -> u16 {
    VOLTAGE_CV + motor as u16 * STEP_CV
}

/// Motor controllers on the telemetry UART.
pub struct Escs {
    wire: UartWire,
    asked: Vec<usize>,
}

impl Escs {
    pub fn new(wire: UartWire) -> Self {
        Escs { wire, asked: Vec::new() }
    }

    /// Stores the motors whose controllers are to answer.
    pub fn ask(&mut self, motors: Vec<usize>) {
        self.asked.extend(motors);
    }

    /// Sends the answers, with the speeds of the rotors \[rad/s\].
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
