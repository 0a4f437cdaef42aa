//! Pilot's transmitter, with a CRSF receiver at a UART of the board.

use crate::wire::UartWire;
use afbc_rc::{Channels, CrsfDecoder, CrsfFrame};
use std::collections::BTreeSet;

/// Duration of a byte of ten bits at 420,000 baud \[ns\].
const BYTE_NS: u64 = 10 * 1_000_000_000 / 420_000;

/// Channels, counted from 0.
pub const PITCH: usize = 1;
pub const THROTTLE: usize = 2;
pub const ARM: usize = 4;
pub const KILL: usize = 6;

/// Telemetry frames: type and name.
const NAMES: [(u8, &str); 4] = [(0x02, "place"), (0x08, "battery"), (0x1E, "attitude"), (0x21, "mode")];

/// Transmitter, and the receiver's wire to the board.
pub struct RcTransmitter {
    wire: UartWire,
    pub channels: Channels,
    /// True while the receiver sends frames.
    pub is_heard: bool,
    /// Time between two frames, and time of the next frame \[ns\].
    period_ns: u64,
    next_ns: u64,
    /// Time at which the last byte of the first frame with the kill switch on was sent \[ns\].
    pub killed_ns: Option<u64>,
    kills: bool,
    /// Telemetry received: bytes of an incomplete frame, a decoder that counts wrong checksums, and types of complete
    /// frames.
    back: Vec<u8>,
    checker: CrsfDecoder,
    shown: BTreeSet<u8>,
}

impl RcTransmitter {
    /// Creates a transmitter with sticks centred, throttle down and all switches off.
    pub fn new(wire: UartWire, period_ns: u64, next_ns: u64) -> Self {
        let mut us = [1000; 16];
        us[..4].fill(1500);
        us[THROTTLE] = 1000;
        RcTransmitter {
            wire,
            channels: Channels::of(us),
            is_heard: true,
            period_ns,
            next_ns,
            killed_ns: None,
            kills: false,
            back: Vec::new(),
            checker: CrsfDecoder::default(),
            shown: BTreeSet::new(),
        }
    }

    /// Returns a transmitter with the same stick and switch positions, on another receiver's wire.
    pub fn again(&self, wire: UartWire, period_ns: u64, next_ns: u64) -> Self {
        RcTransmitter { channels: self.channels, ..RcTransmitter::new(wire, period_ns, next_ns) }
    }

    /// Returns the time of the next frame \[ns\].
    pub fn next_ns(&self) -> u64 {
        self.next_ns
    }

    /// Sends a frame if it is due, and reads telemetry.
    pub fn step(&mut self, now_ns: u64) {
        if self.kills && self.killed_ns.is_none() {
            self.killed_ns = self.wire.emptied_ns().map(|begun_ns| begun_ns + BYTE_NS);
        }
        if now_ns >= self.next_ns {
            self.next_ns += self.period_ns;
            if self.is_heard {
                self.wire.send(&CrsfFrame::Channels(self.channels).encode());
                self.kills |= self.channels.us[KILL] > 1500;
            }
        }
        let bytes = self.wire.take();
        self.checker.feed(&bytes, now_ns / 1000, |_| ());
        self.back.extend(bytes);
        // CRSF's length field counts neither the address nor itself.
        while let [_, length, kind, ..] = *self.back
            && self.back.len() >= usize::from(length) + 2
        {
            self.shown.insert(kind);
            self.back.drain(..usize::from(length) + 2);
        }
    }

    /// Returns the names of the telemetry received, and the number of frames with a wrong checksum.
    pub fn shown(&self) -> (Vec<&'static str>, u32) {
        let shown = NAMES.into_iter().filter(|(kind, _)| self.shown.contains(kind)).map(|(_, name)| name).collect();
        (shown, self.checker.bad_frames())
    }
}
