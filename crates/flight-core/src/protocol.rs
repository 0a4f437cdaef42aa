//! Protocols of the motor controllers (ESCs).

use crate::dshot::DshotRate;
use crate::pulse::PulseFormat;
use afbc_types::{Choice, parameters};

parameters! {
    /// Output to the motor controllers. Not in the paper.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct MotorOutputs {
        /// Protocol of the motor controllers, from the next start on.
        #[choice(PROTOCOL)]
        pub protocol: MotorProtocol = MotorProtocol::Dshot600,
    }
}

/// A protocol of the motor controllers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotorProtocol {
    /// DSHOT at 600 kbit/s.
    Dshot600,
    /// DSHOT at 300 kbit/s.
    Dshot300,
    /// DSHOT at 150 kbit/s.
    Dshot150,
    /// One pulse of 125 to 250 us per tick.
    OneShot125,
    /// A pulse of 1000 to 2000 us, 400 times per second.
    Pwm400,
}

impl Choice for MotorProtocol {
    const ALL: &'static [Self] = &[
        MotorProtocol::Dshot600,
        MotorProtocol::Dshot300,
        MotorProtocol::Dshot150,
        MotorProtocol::OneShot125,
        MotorProtocol::Pwm400,
    ];
    const WORDS: &'static [&'static str] = &["dshot600", "dshot300", "dshot150", "oneshot125", "pwm400"];
}

/// Signal that a timer generates for a protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotorSignal {
    /// Frames of bits, by DMA.
    Frames(DshotRate),
    /// Pulses, without DMA.
    Pulses(PulseFormat),
}

impl MotorProtocol {
    /// Returns the signal that a timer generates.
    pub const fn signal(self) -> MotorSignal {
        match self {
            MotorProtocol::Dshot600 => MotorSignal::Frames(DshotRate::Dshot600),
            MotorProtocol::Dshot300 => MotorSignal::Frames(DshotRate::Dshot300),
            MotorProtocol::Dshot150 => MotorSignal::Frames(DshotRate::Dshot150),
            MotorProtocol::OneShot125 => MotorSignal::Pulses(PulseFormat::ONESHOT125),
            MotorProtocol::Pwm400 => MotorSignal::Pulses(PulseFormat::PWM400),
        }
    }
}
