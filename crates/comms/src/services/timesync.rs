//! Time synchronisation: answers to TIMESYNC and PING.

use afbc_mavlink::{Address, TimeMessage};

/// Returns the answer to a TIMESYNC or PING of `from`, at `now_us` since power-up. `me` is the vehicle's address.
pub fn answer(message: TimeMessage, from: Address, me: Address, now_us: u64) -> Option<TimeMessage> {
    match message {
        // 64 bits hold 292 years in nanoseconds.
        TimeMessage::Sync { answered_ns: 0, asked_ns, to } if me.is_meant_by(to) => {
            Some(TimeMessage::Sync { answered_ns: (now_us as i64).wrapping_mul(1000), asked_ns, to: from })
        }
        TimeMessage::Ping { time_us, number, to: Address { system: 0, component: 0 } } => {
            Some(TimeMessage::Ping { time_us, number, to: from })
        }
        // Answers to requests that the vehicle has not made, and the time of day, need no answer.
        TimeMessage::Sync { .. } | TimeMessage::Ping { .. } | TimeMessage::Time { .. } => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ME: Address = Address { system: 1, component: 1 };
    const STATION: Address = Address { system: 255, component: 190 };
    const ALL: Address = Address { system: 0, component: 0 };

    #[test]
    fn questions_are_answered_with_what_was_asked() {
        let asked = TimeMessage::Sync { answered_ns: 0, asked_ns: 77, to: ALL };
        let reported = TimeMessage::Sync { answered_ns: 5_000_000, asked_ns: 77, to: STATION };
        assert_eq!(answer(asked, STATION, ME, 5_000), Some(reported));
        let ping = TimeMessage::Ping { time_us: 9, number: 3, to: ALL };
        assert_eq!(answer(ping, STATION, ME, 0), Some(TimeMessage::Ping { time_us: 9, number: 3, to: STATION }));
    }

    /// If answers were answered, two vehicles would answer each other for ever.
    #[test]
    fn answers_are_not_answered() {
        for message in [
            TimeMessage::Sync { answered_ns: 1, asked_ns: 2, to: ME },
            TimeMessage::Ping { time_us: 1, number: 2, to: ME },
            TimeMessage::Time { unix_us: 1, boot_ms: 2 },
            TimeMessage::Sync { answered_ns: 0, asked_ns: 2, to: Address { system: 2, component: 1 } },
        ] {
            assert_eq!(answer(message, STATION, ME, 5), None);
        }
    }
}
