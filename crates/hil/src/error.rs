//! Errors of a flight in the loop.

use afbc_types::OutOfRange;
use std::fmt;

/// Reasons why a flight did not start or was aborted. Each is displayed as one line.
#[derive(Debug)]
pub enum Error {
    /// The scenario needs a setting that the firmware does not have.
    Mismatch(&'static str),
    /// The scenario has instruments whose readings cannot reach the vehicle.
    Unread,
    /// The baud rate is too low for sufficiently fresh states.
    Baud {
        /// Baud rate given \[baud\].
        given: u32,
        /// Smallest possible baud rate \[baud\].
        least: u32,
    },
    /// The vehicle sends no message that can be read.
    Silent,
    /// The vehicle answers but does not arm, for this reason.
    NotArmed(String),
    /// A parameter is out of range.
    OutOfRange(OutOfRange),
    /// The autopilot has failed with this error.
    Autopilot(Box<dyn std::error::Error + Send + Sync>),
    /// The log could not be written.
    Log(csv::Error),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Mismatch(what) => write!(
                f,
                "the firmware holds the paper's vehicle and AFBC with the profile flight, but the scenario has {what}; \
                 fly the scenario by `sitl fly`, or change the scenario"
            ),
            Error::Unread => write!(
                f,
                "the readings of the scenario's [instruments] cannot reach this board; leave out [instruments], or fly \
                 the scenario by `sitl pil`"
            ),
            Error::Baud { given, least } => {
                write!(f, "{given} baud is too slow for a state every 10 ms; take at least {least}")
            }
            Error::Silent => {
                write!(
                    f,
                    "no MAVLink comes from the vehicle; check the vehicle's power, the port, the baud rate and the \
                     wires; a vehicle with a signing key ignores unsigned messages"
                )
            }
            Error::NotArmed(reason) => write!(f, "the vehicle did not arm: {reason}"),
            Error::OutOfRange(error) => error.fmt(f),
            Error::Autopilot(error) => error.fmt(f),
            Error::Log(error) => write!(f, "the log cannot be written ({error})"),
        }
    }
}

impl std::error::Error for Error {}

impl From<OutOfRange> for Error {
    fn from(error: OutOfRange) -> Self {
        Error::OutOfRange(error)
    }
}

impl From<csv::Error> for Error {
    fn from(error: csv::Error) -> Self {
        Error::Log(error)
    }
}
