//! CRSF, the protocol of Crossfire and ExpressLRS receivers: 416,666 or 420,000 baud, 8N1.
//!
//! A frame consists of the address, the number of remaining bytes, the type, the payload and a checksum of type and
//! payload (CRC-8, polynomial 0xD5). Source: TBS's specification of the protocol, revision 11.

use crate::channels::{Channels, PACKED};
use core::ops::RangeInclusive;
use crc::{CRC_8_DVB_S2, Crc, Table};
use heapless::Vec;

/// Bytes of the longest frame.
pub(crate) const FRAME_MAX: usize = 64;
/// Address of a flight controller; every frame begins with it.
pub(crate) const ADDRESS: u8 = 0xC8;
/// Bytes that the length field does not count: address and length.
const HEADER: usize = 2;
/// Accepted values of the length field: at least type and checksum.
const LENGTHS: RangeInclusive<usize> = 2..=FRAME_MAX - HEADER;

const LINK_STATISTICS: u8 = 0x14;
const RC_CHANNELS_PACKED: u8 = 0x16;

static CHECKSUM: Crc<u8, Table<1>> = Crc::<u8, Table<1>>::new(&CRC_8_DVB_S2);

/// Pulse lengths at the ends of a transmitter's sticks \[us\]: 172 to 1811 in a frame.
pub const CRSF_MICROSECONDS: RangeInclusive<u16> = 988..=2012;

/// A decoded frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrsfFrame {
    /// RC_CHANNELS_PACKED (0x16).
    Channels(Channels),
    /// LINK_STATISTICS (0x14).
    LinkStatistics(LinkStatistics),
}

/// Quality of the radio link from transmitter to receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkStatistics {
    /// Received power on the active antenna \[dBm\].
    pub rssi_dbm: i16,
    /// Share of packets received \[%\].
    pub quality_percent: u8,
    /// Signal-to-noise ratio \[dB\].
    pub snr_db: i8,
}

impl CrsfFrame {
    /// Decodes a frame with a valid checksum; returns none for another type or a payload that is too short.
    fn read(kind: u8, payload: &[u8]) -> Option<Self> {
        match kind {
            RC_CHANNELS_PACKED => {
                let packed = payload.first_chunk::<PACKED>()?;
                Some(CrsfFrame::Channels(Channels::unpack(packed, to_us)))
            }
            LINK_STATISTICS => {
                let [first, second, quality_percent, snr, antenna, ..] = *payload.first_chunk::<10>()?;
                // Antenna number 1 means that the second of two antennas is active.
                let rssi = if antenna == 1 { second } else { first };
                let snr_db = i8::from_le_bytes([snr]);
                // The protocol sends the power in dBm without its minus sign.
                Some(CrsfFrame::LinkStatistics(LinkStatistics { rssi_dbm: -i16::from(rssi), quality_percent, snr_db }))
            }
            _ => None,
        }
    }

    /// Encodes the frame as a receiver does; for tests and simulated receivers.
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

/// Builds a frame around a payload; returns no bytes if the payload is too long.
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

/// Converts raw ticks to microseconds: TICKS_TO_US of the specification.
fn to_us(ticks: u16) -> u16 {
    // Eleven bits give 880 to 2159 us.
    ((i32::from(ticks) - 992) * 5 / 8 + 1500) as u16
}

/// Converts microseconds to ticks, so that [`to_us`] returns the same pulse again.
fn from_us(us: u16) -> u16 {
    let off_us = i32::from(us) - 1500;
    let ticks = (off_us.abs() * 8 + 4) / 5 * off_us.signum();
    (ticks + 992).clamp(0, 2047) as u16
}

/// Pause that ends an incomplete frame \[us\]; the longest frame takes 1.5 ms. Without this limit, the rest of a frame
/// that lost a byte, joined with the next frame, would pass the checksum once in 256 times.
pub const CRSF_GAP_US: u64 = 2_000;

/// Decoder of a receiver's byte stream.
#[derive(Clone, Debug, Default)]
pub struct CrsfDecoder {
    /// Bytes that may be the beginning of a frame.
    held: Vec<u8, FRAME_MAX>,
    /// Arrival time of the last bytes \[us\].
    last_us: u64,
    good_frames: u32,
    bad_frames: u32,
}

impl CrsfDecoder {
    /// Takes received bytes, the last of which arrived at `now_us`, and passes each decoded frame to `take`.
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
            // The buffer cannot overflow, because a frame of maximum length was removed already.
            let _ = self.held.push(*byte);
            while self.advance(&mut take) {}
        }
    }

    /// Returns the number of frames with a valid checksum.
    pub fn good_frames(&self) -> u32 {
        self.good_frames
    }

    /// Returns the number of frames with a wrong length or checksum, or cut short by a pause.
    pub fn bad_frames(&self) -> u32 {
        self.bad_frames
    }

    /// Removes one frame, or one byte that cannot begin a frame. Returns false if more bytes are needed.
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
        // The split never fails, because the accepted lengths include type and checksum.
        let Some(([kind, payload @ ..], checksum)) = content.split_last().map(|(last, content)| (content, *last))
        else {
            return self.drop_first(1);
        };
        let mut digest = CHECKSUM.digest();
        digest.update(&[*kind]);
        digest.update(payload);
        if digest.finalize() != checksum {
            // The next frame may begin among these bytes.
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
