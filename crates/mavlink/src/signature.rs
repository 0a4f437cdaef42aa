//! MAVLink 2 signatures: link id, timestamp and the first 48 bits of SHA-256 over key, frame, link id and timestamp.
//!
//! See <https://mavlink.io/en/guide/message_signing.html>. This module does not decide which signatures to accept: the
//! receiver does, since it keeps the timestamps.

use crate::address::Address;
use crate::message::{MessageFormat, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use core::fmt;
use hmac_sha256::Hash;
use mavlink::MessageData;
use mavlink::dialects::common::SETUP_SIGNING_DATA;

/// Length of a signature \[bytes\].
pub(crate) const SIGNATURE: usize = 13;
/// Length of link id and 48-bit timestamp at the beginning of a signature \[bytes\].
const STAMP: usize = 7;
/// Largest timestamp.
pub const TIME_MAX: u64 = (1 << 48) - 1;

/// A secret key, which `Debug` does not print.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct SigningKey(pub [u8; 32]);

impl fmt::Debug for SigningKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SigningKey")
    }
}

impl SigningKey {
    /// Returns the first bytes of the SHA-256 of the key alone. They are stored with the key to detect damage.
    pub fn check(&self) -> [u8; 4] {
        first(&Hash::hash(&self.0))
    }

    /// Returns the hash part of a signature over `frame`, which is given from its first byte to its checksum. Not
    /// inlined, so that the firmware contains it only once.
    #[inline(never)]
    fn code(&self, frame: &[u8], stamp: &[u8]) -> [u8; SIGNATURE - STAMP] {
        let mut hash = Hash::new();
        hash.update(self.0);
        hash.update(frame);
        hash.update(stamp);
        first(&hash.finalize())
    }

    /// Returns the signature of `frame` with this link id and timestamp.
    pub(crate) fn sign(&self, frame: &[u8], stamp: Stamp) -> [u8; SIGNATURE] {
        let stamp = stamp.to_bytes();
        let code = self.code(frame, &stamp);
        let mut bytes = stamp.into_iter().chain(code);
        [(); SIGNATURE].map(|()| bytes.next().unwrap_or_default())
    }
}

/// Returns the first bytes of a digest.
fn first<const N: usize>(digest: &[u8]) -> [u8; N] {
    digest.first_chunk().copied().unwrap_or([0; N])
}

/// Link id and timestamp of a signature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    /// Link id of the sender.
    pub link: u8,
    /// Timestamp since the beginning of 2015 UTC \[10 us\], up to [`TIME_MAX`]. It must increase with each frame that
    /// the sender sends over this link.
    pub time_10us: u64,
}

impl Stamp {
    fn to_bytes(self) -> [u8; STAMP] {
        let [a, b, c, d, e, f, ..] = self.time_10us.min(TIME_MAX).to_le_bytes();
        [self.link, a, b, c, d, e, f]
    }

    fn from_bytes([link, a, b, c, d, e, f]: [u8; STAMP]) -> Self {
        Stamp { link, time_10us: u64::from_le_bytes([a, b, c, d, e, f, 0, 0]) }
    }
}

/// A frame with a correct checksum, passed to the receiver to accept or refuse.
#[derive(Clone, Copy, Debug)]
pub struct ReceivedFrame<'a> {
    /// Sender.
    pub from: Address,
    /// Message id.
    pub id: u32,
    /// The frame, from its first byte to its checksum.
    bytes: &'a [u8],
    signature: Option<&'a [u8; SIGNATURE]>,
}

impl<'a> ReceivedFrame<'a> {
    /// Creates the received frame; its first `unsigned` bytes end with the checksum.
    pub(crate) fn new(from: Address, id: u32, frame: &'a [u8], unsigned: usize) -> Self {
        let (bytes, rest) = frame.split_at_checked(unsigned).unwrap_or((frame, &[]));
        ReceivedFrame { from, id, bytes, signature: rest.first_chunk() }
    }

    /// Returns link id and timestamp of the frame's signature; none if it is not signed.
    pub fn stamp(&self) -> Option<Stamp> {
        self.signature?.first_chunk().copied().map(Stamp::from_bytes)
    }

    /// True if the frame has a signature made with this key.
    pub fn is_signed_by(&self, key: &SigningKey) -> bool {
        let Some((stamp, sent)) = self.signature.map(|signature| signature.split_at(STAMP)) else { return false };
        let code = key.code(self.bytes, stamp);
        // Compares all bytes, so that the time taken does not reveal the first difference.
        code.len() == sent.len() && code.iter().zip(sent).fold(0, |differs, (a, b)| differs | (a ^ b)) == 0
    }
}

/// SETUP_SIGNING (256): sets or removes the vehicle's key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SetupSigning {
    /// New key; none to stop signing, sent as zeros.
    pub key: Option<SigningKey>,
    /// Timestamp of the sender ([`Stamp::time_10us`]).
    pub time_10us: u64,
}

/// Fields: time, system, component, key.
const SETUP: MessageLayout<SETUP_SIGNING_DATA, (u64, Address, [u8; 32])> = MessageLayout::NEW;

impl SetupSigning {
    /// Message id.
    pub const ID: u32 = SETUP_SIGNING_DATA::ID;

    pub(crate) fn format() -> MessageFormat {
        SETUP.format()
    }

    /// Returns the message and its receiver.
    pub(crate) fn read(payload: &[u8]) -> (Self, Address) {
        let (time_10us, to, key) = SETUP.read(payload);
        (SetupSigning { key: (key != [0; 32]).then_some(SigningKey(key)), time_10us: time_10us.min(TIME_MAX) }, to)
    }

    pub(crate) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        SETUP.write(&(self.time_10us, Address::default(), self.key.map_or([0; 32], |key| key.0)), payload)
    }
}
