//! Telemetry of the motor controllers.

use crate::rotor_monitor::RotorFailure;
use afbc_drivers::esc_telemetry::EscReading;
use afbc_types::{ROTORS_MAX, Stamped};

/// Age of the last reading from which a motor controller counts as offline \[us\].
const OFFLINE_US: u32 = 500_000;

/// State of the motor controllers, each at the index of its rotor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EscTelemetry {
    /// Newest reading of each motor controller.
    pub readings: [Option<Stamped<EscReading>>; ROTORS_MAX],
    /// Failure of each rotor, if any.
    pub failures: [Option<RotorFailure>; ROTORS_MAX],
    /// Number of readings since power-up, modulo 65,536.
    pub counter: u16,
    /// Number of magnetic poles of a motor.
    pub poles: u16,
}

impl EscTelemetry {
    /// Returns true if any motor controller has ever answered.
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

    /// Returns a bit mask of the motor controllers that are online.
    #[must_use]
    pub fn online(&self, now_us: u64) -> u8 {
        let answers =
            |reading: &Option<Stamped<EscReading>>| reading.is_some_and(|reading| reading.age_us(now_us) < OFFLINE_US);
        let bits = self.readings.iter().zip(0_u8..).filter(|(reading, _)| answers(reading));
        // There are at most eight rotors, so the shift does not wrap.
        bits.fold(0, |bits, (_, at)| bits | 1_u8.wrapping_shl(at.into()))
    }
}
