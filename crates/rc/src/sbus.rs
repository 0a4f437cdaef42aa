//! SBUS, the protocol of Futaba's and FrSky's receivers: 100,000 baud, 8E2, inverted.
//!
//! A frame is 25 bytes: 0x0F, sixteen channels, flags and a footer. It has no checksum, and channel bytes may also be
//! 0x0F, so frames are found by the pause of at least 4 ms before them.
//!
//! Betaflight, ArduPilot and PX4 accept any footer, since receivers differ. Here an unknown footer is accepted from the
//! second frame with it: a receiver repeats its footer, noise does not.

use crate::channels::{Channels, PACKED};
use heapless::Vec;

/// Pause before a frame \[us\]. A frame takes 3 ms; frames come every 7 to 14 ms.
pub const SBUS_GAP_US: u64 = 2_000;
const FRAME: usize = 25;
const HEADER: u8 = 0x0F;
const FRAME_LOST: u8 = 1 << 2;
const FAILSAFE: u8 = 1 << 3;
/// Flag bits in use: the digital channels, frame lost and failsafe.
const FLAGS: u8 = 0x0F;
/// Footer bits that a receiver repeats; SBUS2 counts its slots in the upper bits.
const FOOTER: u8 = 0x0F;

/// True for the footers of known receivers: 0x00, and 0x03, 0x04 or 0x08 (R7003SB) with a slot number in the upper
/// bits.
fn is_known(footer: u8) -> bool {
    footer == 0 || footer < 0x40 && matches!(footer & FOOTER, 0x03 | 0x04 | 0x08)
}

/// A decoded frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SbusFrame {
    /// Channels: the last ones received, or the receiver's failsafe values.
    pub channels: Channels,
    /// True if the receiver missed the transmitter's data for this frame.
    pub frame_lost: bool,
    /// True if the receiver is in failsafe.
    pub failsafe: bool,
}

impl SbusFrame {
    /// Decodes a frame; returns it with its footer.
    fn read(frame: &[u8; FRAME]) -> Option<(Self, u8)> {
        let [HEADER, rest @ ..] = frame else { return None };
        let (packed, &[flags, footer]) =
            rest.split_first_chunk::<PACKED>().and_then(|(packed, rest)| Some((packed, rest.first_chunk::<2>()?)))?;
        // The upper flag bits are never set in a valid frame. Without a checksum, every known bit helps to reject
        // noise.
        (flags & !FLAGS == 0).then(|| {
            let (frame_lost, failsafe) = (flags & FRAME_LOST != 0, flags & FAILSAFE != 0);
            (SbusFrame { channels: Channels::unpack(packed, to_us), frame_lost, failsafe }, footer)
        })
    }

    /// Encodes the frame as a receiver does; for tests and simulated receivers.
    pub fn encode(&self) -> [u8; FRAME] {
        let mut frame = [0; FRAME];
        let flags = (u8::from(self.frame_lost) * FRAME_LOST) | (u8::from(self.failsafe) * FAILSAFE);
        let bytes = [HEADER].into_iter().chain(self.channels.pack(from_us)).chain([flags, 0]);
        frame.iter_mut().zip(bytes).for_each(|(place, byte)| *place = byte);
        frame
    }
}

/// Converts raw ticks to microseconds: 200 to 1800 are 1000 to 2000 us, as in PX4.
fn to_us(ticks: u16) -> u16 {
    (u32::from(ticks) * 5 / 8 + 875) as u16
}

fn from_us(us: u16) -> u16 {
    // Rounds up, so that decoding gives the same pulse again.
    (u32::from(us).saturating_sub(875) * 8).div_ceil(5).min(2047) as u16
}

/// Decoder of a receiver's byte stream.
#[derive(Clone, Debug, Default)]
pub struct SbusDecoder {
    held: Vec<u8, FRAME>,
    /// Arrival time of the last bytes \[us\].
    last_us: u64,
    /// True while bytes are skipped until the next pause: after a frame, or if the first byte was no header.
    waits: bool,
    /// Footer of the last frame, even if that frame was rejected.
    footer: Option<u8>,
    good_frames: u32,
    bad_frames: u32,
}

impl SbusDecoder {
    /// Takes received bytes, the last of which arrived at `now_us`, and passes each frame to `take`.
    pub fn feed(&mut self, bytes: &[u8], now_us: u64, mut take: impl FnMut(SbusFrame)) {
        if bytes.is_empty() {
            return;
        }
        if now_us.saturating_sub(self.last_us) >= SBUS_GAP_US {
            if !self.held.is_empty() {
                self.bad_frames = self.bad_frames.saturating_add(1);
            }
            self.held.clear();
            self.waits = false;
        }
        self.last_us = now_us;
        for byte in bytes {
            // Other first bytes are not counted as a damaged frame: on an SBUS2 line, sensors answer between the
            // frames.
            self.waits |= self.held.is_empty() && *byte != HEADER;
            if self.waits {
                continue;
            }
            // The buffer cannot overflow, because a complete frame is removed with its last byte.
            let _ = self.held.push(*byte);
            if let Some(frame) = self.held.first_chunk::<FRAME>() {
                let read = SbusFrame::read(frame).filter(|(_, footer)| {
                    let last = self.footer.replace(*footer);
                    is_known(*footer) || last.is_some_and(|last| (last ^ footer) & FOOTER == 0)
                });
                match read {
                    Some((frame, _)) => {
                        self.good_frames = self.good_frames.saturating_add(1);
                        take(frame);
                    }
                    None => self.bad_frames = self.bad_frames.saturating_add(1),
                }
                self.held.clear();
                self.waits = true;
            }
        }
    }

    /// Returns the number of accepted frames.
    pub fn good_frames(&self) -> u32 {
        self.good_frames
    }

    /// Returns the number of frames that were cut short or invalid.
    pub fn bad_frames(&self) -> u32 {
        self.bad_frames
    }
}
