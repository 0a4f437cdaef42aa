//! CRSF, the protocol of Crossfire and ExpressLRS receivers: 416,666 or 420,000 baud, 8N1.
//!
//! A frame is the address, the number of bytes that follow, the type, the payload and a checksum of type and payload
//! (CRC-8, polynomial 0xD5). Source: TBS's specification of the protocol, revision 11.

use crate::channels::{Channels, PACKED};
use core::ops::RangeInclusive;
use crc::{CRC_8_DVB_S2, Crc, Table};
use heapless::Vec;

/// Bytes of the longest frame.
pub(crate) const FRAME_MAX: usize = 64;
/// Address of a flight controller, with which frames begin.
pub(crate) const ADDRESS: u8 = 0xC8;
/// Bytes before those that the length counts.
const HEADER: usize = 2;
/// Accepted lengths: type and checksum at least.
const LENGTHS: RangeInclusive<usize> = 2..=FRAME_MAX - HEADER;

const LINK_STATISTICS: u8 = 0x14;
const RC_CHANNELS_PACKED: u8 = 0x16;

static CHECKSUM: Crc<u8, Table<1>> = Crc::<u8, Table<1>>::new(&CRC_8_DVB_S2);

/// Pulse lengths that the sticks of a transmitter give \[us\]: 172 to 1811 in a frame.
pub const CRSF_MICROSECONDS: RangeInclusive<u16> = 988..=2012;

/// A frame that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrsfFrame {
    /// RC_CHANNELS_PACKED (0x16).
    Channels(Channels),
    /// LINK_STATISTICS (0x14).
    LinkStatistics(LinkStatistics),
}

/// How well the receiver hears the transmitter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkStatistics {
    /// Received power on the better antenna \[dBm\].
    pub rssi_dbm: i16,
    /// Packets that arrive \[%\].
    pub quality_percent: u8,
    /// Signal to noise \[dB\].
    pub snr_db: i8,
}

impl CrsfFrame {
    /// Reads a frame whose checksum is right; none if it is of another type, or too short.
    fn read(kind: u8, payload: &[u8]) -> Option<Self> {
        match kind {
            RC_CHANNELS_PACKED => {
                let packed = payload.first_chunk::<PACKED>()?;
                Some(CrsfFrame::Channels(Channels::unpack(packed, to_us)))
            }
            LINK_STATISTICS => {
                let [first, second, quality_percent, snr, antenna, ..] = *payload.first_chunk::<10>()?;
                // Of two antennas, the second is active if the number says so.
                let rssi = if antenna == 1 { second } else { first };
                let snr_db = i8::from_le_bytes([snr]);
                // The protocol sends the power without its sign, which is negative.
                Some(CrsfFrame::LinkStatistics(LinkStatistics { rssi_dbm: -i16::from(rssi), quality_percent, snr_db }))
            }
            _ => None,
        }
    }

    /// Returns the frame's bytes, as a receiver sends them: for tests and simulated receivers.
    pub fn encode(&self) -> Vec<u8, FRAME_MAX> {
        match self {
            CrsfFrame::Channels(channels) => framed(RC_CHANNELS_PACKED, &channels.pack(from_us)),
            CrsfFrame::LinkStatistics(link) => {
                let rssi = link.rssi_dbm.unsigned_abs().min(255) as u8;
                let [snr] = link.snr_db.to_le_bytes();
                framed(
                    LINK_STATISTICS,
                    &[rssi, rssi, link.quality_percent, snr, 0, 0, 0, rssi, link.quality_percent, snr],
                )
            }
        }
    }
}

/// Frames a payload; empty if it is too long for a frame.
pub(crate) fn framed(kind: u8, payload: &[u8]) -> Vec<u8, FRAME_MAX> {
    let mut bytes = Vec::new();
    let mut digest = CHECKSUM.digest();
    digest.update(&[kind]);
    digest.update(payload);
    let length = payload.len().saturating_add(2);
    let written = LENGTHS.contains(&length)
        && bytes.extend_from_slice(&[ADDRESS, length as u8, kind]).is_ok()
        && bytes.extend_from_slice(payload).is_ok()
        && bytes.push(digest.finalize()).is_ok();
    if written { bytes } else { Vec::new() }
}

/// TICKS_TO_US of the specification.
fn to_us(ticks: u16) -> u16 {
    // 880 to 2159: eleven bits.
    ((i32::from(ticks) - 992) * 5 / 8 + 1500) as u16
}

/// The inverse: ticks that are read as this pulse again.
fn from_us(us: u16) -> u16 {
    let off_us = i32::from(us) - 1500;
    let ticks = (off_us.abs() * 8 + 4) / 5 * off_us.signum();
    (ticks + 992).clamp(0, 2047) as u16
}

/// Pause after which no frame goes on \[us\]: the longest takes 1.5 ms. Without it, what is left of a frame that lost a
/// byte and the next frame would have a right checksum once in 256 times.
pub const CRSF_GAP_US: u64 = 2_000;

/// Finds frames in a receiver's bytes.
#[derive(Clone, Debug, Default)]
pub struct CrsfDecoder {
    /// What may be the beginning of a frame.
    held: Vec<u8, FRAME_MAX>,
    /// When the last bytes came \[us\].
    last_us: u64,
    good_frames: u32,
    bad_frames: u32,
}

impl CrsfDecoder {
    /// Takes bytes that came one after the other, the last of them at `now_us`, and gives each frame that is of use.
    pub fn feed(&mut self, bytes: &[u8], now_us: u64, mut take: impl FnMut(CrsfFrame)) {
        if bytes.is_empty() {
            return;
        }
        if now_us.saturating_sub(self.last_us) >= CRSF_GAP_US && !self.held.is_empty() {
            self.bad_frames = self.bad_frames.saturating_add(1);
            self.held.clear();
        }
        self.last_us = now_us;
        for byte in bytes {
            // There is room: a frame of the longest length has been taken out.
            let _ = self.held.push(*byte);
            while self.advance(&mut take) {}
        }
    }

    /// Number of frames with a right checksum.
    pub fn good_frames(&self) -> u32 {
        self.good_frames
    }

    /// Number of beginnings of frames whose length or checksum was wrong.
    pub fn bad_frames(&self) -> u32 {
        self.bad_frames
    }

    /// Takes out a frame or a byte that begins none; false if more bytes are needed.
    fn advance(&mut self, take: &mut impl FnMut(CrsfFrame)) -> bool {
        let Some((address, rest)) = self.held.split_first() else { return false };
        if *address != ADDRESS {
            return self.drop_first(1);
        }
        let Some((length, rest)) = rest.split_first() else { return false };
        let length = usize::from(*length);
        if !LENGTHS.contains(&length) {
            self.bad_frames = self.bad_frames.saturating_add(1);
            return self.drop_first(1);
        }
        let Some((content, _)) = rest.split_at_checked(length) else { return false };
        // Always: the accepted lengths have a type and a checksum.
        let Some(([kind, payload @ ..], checksum)) = content.split_last().map(|(last, content)| (content, *last))
        else {
            return self.drop_first(1);
        };
        let mut digest = CHECKSUM.digest();
        digest.update(&[*kind]);
        digest.update(payload);
        if digest.finalize() != checksum {
            // A frame may begin within what was taken for one.
            self.bad_frames = self.bad_frames.saturating_add(1);
            return self.drop_first(1);
        }
        self.good_frames = self.good_frames.saturating_add(1);
        if let Some(frame) = CrsfFrame::read(*kind, payload) {
            take(frame);
        }
        self.drop_first(HEADER + length)
    }

    fn drop_first(&mut self, count: usize) -> bool {
        let count = count.min(self.held.len());
        self.held.rotate_left(count);
        self.held.truncate(self.held.len() - count);
        true
    }
}
