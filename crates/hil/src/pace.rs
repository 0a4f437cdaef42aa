//! Message rates of the station.

use super::Error;

/// Frame lengths of a state, a setpoint and a ping \[bytes\].
const STATE_BYTES: u64 = 242;
const SETPOINT_BYTES: u64 = 65;
const PING_BYTES: u64 = 45;
/// Start bit, eight data bits, stop bit.
const BITS_PER_BYTE: u64 = 10;
/// Share of the line's capacity that is used; the rest lets a backlog drain \[%\].
const LINE_USE_PERCENT: u64 = 90;
/// Longest time between states \[ms\]: half of the age at which a state counts as stale.
const STATE_PERIOD_MAX_MS: u64 = 10;
/// Time between setpoints, and between pings, on a serial line \[ms\].
const SETPOINT_PERIOD_MS: u64 = 10;
const PING_PERIOD_MS: u64 = 100;

/// Periods of messages \[ms\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessagePeriods {
    /// Period of states.
    pub state_ms: u64,
    /// Period of setpoints.
    pub setpoint_ms: u64,
    /// Period of pings that measure the round trip, if any.
    pub ping_ms: Option<u64>,
}

impl MessagePeriods {
    /// State and setpoint in every control tick, as without a link.
    pub const LOCKSTEP: MessagePeriods = MessagePeriods { state_ms: 1, setpoint_ms: 1, ping_ms: None };

    /// Returns the periods for a serial line of `baud`: states as often as possible, at a period of whole milliseconds.
    ///
    /// # Errors
    /// [`Error::Baud`] if the period of states would exceed 10 ms.
    pub fn at(baud: u32) -> Result<Self, Error> {
        let bytes_per_s = u64::from(baud) * LINE_USE_PERCENT / 100 / BITS_PER_BYTE;
        let state_ms = bytes_per_s
            .checked_sub(other_bytes_per_s())
            .filter(|&left| left > 0)
            .map(|left| (STATE_BYTES * 1000).div_ceil(left));
        match state_ms {
            Some(state_ms @ ..=STATE_PERIOD_MAX_MS) => {
                Ok(MessagePeriods { state_ms, setpoint_ms: SETPOINT_PERIOD_MS, ping_ms: Some(PING_PERIOD_MS) })
            }
            _ => Err(Error::Baud { given: baud, least: least_baud() }),
        }
    }

    /// Returns the number of states per second.
    pub fn state_hz(&self) -> f64 {
        1000.0 / self.state_ms as f64
    }
}

/// Returns the bytes per second of setpoints and pings.
const fn other_bytes_per_s() -> u64 {
    SETPOINT_BYTES * 1000 / SETPOINT_PERIOD_MS + PING_BYTES * 1000 / PING_PERIOD_MS
}

fn least_baud() -> u32 {
    let bytes_per_s = other_bytes_per_s() + STATE_BYTES * 1000 / STATE_PERIOD_MAX_MS;
    (bytes_per_s * BITS_PER_BYTE * 100).div_ceil(LINE_USE_PERCENT) as u32
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test")]
mod tests {
    use super::*;
    use afbc_mavlink::{Address, Encoder, FRAME_MAX, MavCmd, Uplink, VehicleCommand};
    use afbc_types::{PoseSigmas, Setpoint, State};

    #[test]
    fn frames_are_as_long_as_said() {
        let length =
            |message: Uplink| Encoder::new(Address::default()).send(&message, &mut [0; FRAME_MAX]).len() as u64;
        assert_eq!(
            length(Uplink::State { sent_us: 0, state: State::default(), sigmas: PoseSigmas::UNKNOWN }),
            STATE_BYTES
        );
        assert!(length(Uplink::Setpoint(Setpoint::default())) <= SETPOINT_BYTES);
        assert!(length(Uplink::Command(VehicleCommand::Other(MavCmd::MAV_CMD_USER_5 as u16))) <= PING_BYTES);
    }

    #[test]
    fn states_come_as_often_as_the_line_allows() {
        let state_ms = |baud| MessagePeriods::at(baud).map(|pace| pace.state_ms).ok();
        assert_eq!(state_ms(4_000_000), Some(1));
        assert_eq!(state_ms(921_600), Some(4));
        assert_eq!(state_ms(460_800), Some(8));
        assert_eq!(state_ms(least_baud()), Some(10));
        assert_eq!(state_ms(least_baud() - 100), None);
        assert_eq!(state_ms(9_600), None);
        assert_eq!(state_ms(0), None);
    }
}
