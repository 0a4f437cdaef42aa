//! What is known of the motor controllers.

use crate::rotor_monitor::RotorFailure;
use afbc_drivers::esc_telemetry::EscReading;
use afbc_types::{ROTORS_MAX, Stamped};

/// Age at which a motor controller does not answer any more \[us\].
const OFFLINE_US: u32 = 500_000;

/// What is known of the motor controllers, each for the rotor with its index.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EscTelemetry {
    /// Newest reading of each.
    pub readings: [Option<Stamped<EscReading>>; ROTORS_MAX],
    /// How each rotor fails.
    pub failures: [Option<RotorFailure>; ROTORS_MAX],
    /// Readings since power-up, modulo 65,536.
    pub counter: u16,
    /// Magnetic poles of a motor.
    pub poles: u16,
}

impl EscTelemetry {
    /// True if any of them has ever answered.
    #[must_use]
    pub fn is_known(&self) -> bool {
        self.readings.iter().any(Option::is_some)
    }

    /// Returns the measured speeds of the rotors \[rad/s\], with their times.
    pub fn speeds(&self) -> impl Iterator<Item = Option<Stamped<f32>>> + '_ {
        let poles = self.poles.into();
        let speed = move |reading: Stamped<EscReading>| Stamped {
            value: reading.value.speed_rad_s(poles),
            at_us: reading.at_us,
        };
        self.readings.iter().map(move |reading| reading.map(speed))
    }

    /// Returns a bit for each motor controller that answers.
    #[must_use]
    pub fn online(&self, now_us: u64) -> u8 {
        let answers =
            |reading: &Option<Stamped<EscReading>>| reading.is_some_and(|reading| reading.age_us(now_us) < OFFLINE_US);
        let bits = self.readings.iter().zip(0_u8..).filter(|(reading, _)| answers(reading));
        // Eight rotors at most: the shift does not wrap.
        bits.fold(0, |bits, (_, at)| bits | 1_u8.wrapping_shl(at.into()))
    }
}
