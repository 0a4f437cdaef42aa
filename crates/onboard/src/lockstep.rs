//! Protocol between the emulated board and the host, which wait for each other.
//!
//! It has two streams of bytes, little-endian. For each control tick, the host sends the [`Readings`](crate::Readings),
//! a `u32` length, and that many bytes, which arrive at the link before the tick. After the tick, the firmware sends a
//! [`ReplyHead`] and as many bytes as the head states.

use afbc_types::ROTORS_MAX;

/// Head of the firmware's reply after a control tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReplyHead {
    /// Start of the tick, since power-up \[us\].
    pub time_us: u64,
    /// Duration of the tick \[core cycles\].
    pub cycles: u32,
    /// Largest stack depth so far \[bytes\].
    pub stack_bytes: u32,
    /// Number of bytes sent over the link, which follow the head.
    pub length: u32,
    /// DSHOT throttles of the motors: 0, or 48 to 2047; 0 where there is no motor.
    pub throttles: [u16; ROTORS_MAX],
}

impl ReplyHead {
    /// Length on the wire \[bytes\].
    pub const LEN: usize = 8 + 3 * 4 + 2 * ROTORS_MAX;

    /// Returns the head's bytes on the wire.
    pub fn to_bytes(&self) -> [u8; Self::LEN] {
        let ReplyHead { time_us, cycles, stack_bytes, length, throttles } = *self;
        let words = [cycles, stack_bytes, length].into_iter().flat_map(u32::to_le_bytes);
        let fields =
            time_us.to_le_bytes().into_iter().chain(words).chain(throttles.into_iter().flat_map(u16::to_le_bytes));
        let mut bytes = [0; Self::LEN];
        bytes.iter_mut().zip(fields).for_each(|(to, from)| *to = from);
        bytes
    }

    /// Reads a head.
    pub fn from_bytes(bytes: &[u8; Self::LEN]) -> Self {
        let mut rest = bytes.iter().copied();
        let mut next =
            |size: usize| (0..size).fold(0, |value, i| value | u64::from(rest.next().unwrap_or(0)) << (8 * i));
        ReplyHead {
            time_us: next(8),
            cycles: next(4) as u32,
            stack_bytes: next(4) as u32,
            length: next(4) as u32,
            throttles: [(); ROTORS_MAX].map(|()| next(2) as u16),
        }
    }
}
