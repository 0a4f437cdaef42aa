//! SBUS, the protocol of Futaba's and FrSky's receivers: 100,000 baud, 8E2, inverted.
//!
//! A frame is 25 bytes: 0x0F, sixteen channels, flags, and a footer. There is no checksum, and a byte of a channel may
//! be 0x0F too: frames are found by the pause before them, 4 ms at least.
//!
//! Betaflight, ArduPilot and PX4 accept any footer, since receivers differ. Here a footer that is not known counts from
//! its second frame on: a receiver repeats its own, noise does not.

use crate::channels::{Channels, PACKED};
use heapless::Vec;

/// Pause after which a frame begins \[us\]. A frame takes 3 ms; frames follow one another every 7 to 14 ms.
pub const SBUS_GAP_US: u64 = 2_000;
const FRAME: usize = 25;
const HEADER: u8 = 0x0F;
const FRAME_LOST: u8 = 1 << 2;
const FAILSAFE: u8 = 1 << 3;
/// Flags of the digital channels and the two above.
const FLAGS: u8 = 0x0F;
/// Bits of a footer that a receiver repeats; SBUS2 counts its slots in the upper ones.
const FOOTER: u8 = 0x0F;

/// True if receivers are known to send this footer: 0x00, and with a slot above 0x03, 0x04 and 0x08 (R7003SB).
fn is_known(footer: u8) -> bool {
    footer == 0 || footer < 0x40 && matches!(footer & FOOTER, 0x03 | 0x04 | 0x08)
}

/// A frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SbusFrame {
    /// Its channels: the last ones that the receiver heard, or those of its failsafe.
    pub channels: Channels,
    /// True if the receiver heard nothing of the transmitter for this frame.
    pub frame_lost: bool,
    /// True if the receiver has given the transmitter up.
    pub failsafe: bool,
}

impl SbusFrame {
    /// Reads a frame, and its footer.
    fn read(frame: &[u8; FRAME]) -> Option<(Self, u8)> {
        let [HEADER, rest @ ..] = frame else { return None };
        let (packed, &[flags, footer]) =
            rest.split_first_chunk::<PACKED>().and_then(|(packed, rest)| Some((packed, rest.first_chunk::<2>()?)))?;
        // The upper flags are never set: without a checksum, every bit that is known counts.
        (flags & !FLAGS == 0).then(|| {
            let (frame_lost, failsafe) = (flags & FRAME_LOST != 0, flags & FAILSAFE != 0);
            (SbusFrame { channels: Channels::unpack(packed, to_us), frame_lost, failsafe }, footer)
        })
    }

    /// Returns the frame's bytes, as a receiver sends them: for tests and simulated receivers.
    pub fn encode(&self) -> [u8; FRAME] {
        let mut frame = [0; FRAME];
        let flags = (u8::from(self.frame_lost) * FRAME_LOST) | (u8::from(self.failsafe) * FAILSAFE);
        let bytes = [HEADER].into_iter().chain(self.channels.pack(from_us)).chain([flags, 0]);
        frame.iter_mut().zip(bytes).for_each(|(place, byte)| *place = byte);
        frame
    }
}

/// 200 to 1800 are 1000 to 2000 us, as in PX4.
fn to_us(ticks: u16) -> u16 {
    (u32::from(ticks) * 5 / 8 + 875) as u16
}

fn from_us(us: u16) -> u16 {
    // Rounded up, so that it is read as the same again.
    (u32::from(us).saturating_sub(875) * 8).div_ceil(5).min(2047) as u16
}

/// Finds frames in a receiver's bytes.
#[derive(Clone, Debug, Default)]
pub struct SbusDecoder {
    held: Vec<u8, FRAME>,
    /// When the last bytes came \[us\].
    last_us: u64,
    /// True until the next pause: more bytes came than a frame has, or no frame.
    waits: bool,
    /// The last frame's footer, whether it counted or not.
    footer: Option<u8>,
    good_frames: u32,
    bad_frames: u32,
}

impl SbusDecoder {
    /// Takes bytes that came one after the other, the last of them at `now_us`, and gives each frame.
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
            // What begins otherwise is no frame that was damaged: on SBUS2's line, sensors answer between the frames.
            self.waits |= self.held.is_empty() && *byte != HEADER;
            if self.waits {
                continue;
            }
            // There is room: a frame is taken out with its last byte.
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

    /// Number of frames.
    pub fn good_frames(&self) -> u32 {
        self.good_frames
    }

    /// Number of frames that were cut short, or of as many bytes that are none.
    pub fn bad_frames(&self) -> u32 {
        self.bad_frames
    }
}
