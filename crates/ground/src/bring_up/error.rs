//! Reasons why a bring-up ends without a log.

use std::fmt;

/// Reason why an [`ByteExchange`](super::ByteExchange) failed.
pub type ExchangeError = Box<dyn std::error::Error + Send + Sync>;

/// Reason why a bring-up ends without a log; displayed as one line.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// The board sent nothing.
    Silent,
    /// The board sent this number of bytes, but no heartbeat of an autopilot.
    Nonsense(u64),
    /// The board speaks MAVLink, but runs other firmware.
    Stranger,
    /// The vehicle is armed.
    Armed,
    /// The vehicle signs its frames.
    Signed,
    /// The connection failed.
    Connection(ExchangeError),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Silent => write!(
                f,
                "the board sends nothing: check its power, the port, and that TX and RX are crossed; is it flashed?"
            ),
            Error::Nonsense(bytes) => write!(
                f,
                "the board sends {bytes} bytes but no MAVLink heartbeat: check the baud rate, and that this firmware \
                 is flashed"
            ),
            Error::Stranger => {
                write!(f, "the board speaks MAVLink but does not run this firmware: no health array within 5 s")
            }
            Error::Armed => write!(f, "the vehicle is armed: disarm it, and take the propellers off"),
            Error::Signed => write!(
                f,
                "the vehicle has a signing key and ignores unsigned messages: remove the key first, by SETUP_SIGNING \
                 from a station"
            ),
            Error::Connection(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for Error {}
