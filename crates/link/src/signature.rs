//! MAVLink 2 signatures: link, time and the first 48 bits of SHA-256 over key, frame, link and time.
//!
//! <https://mavlink.io/en/guide/message_signing.html>. What is accepted is the receiver's to decide: it keeps the
//! times.

use crate::address::Address;
use crate::message::{MessageFormat, PAYLOAD_MAX};
use crate::wire::Layout;
use core::fmt;
use hmac_sha256::Hash;
use mavlink::MessageData;
use mavlink::dialects::common::SETUP_SIGNING_DATA;

/// Bytes of a signature.
pub(crate) const SIGNATURE: usize = 13;
/// Bytes of a signature before its code: link, and time of 48 bits.
const STAMP: usize = 7;
/// Largest time of a signature.
pub const TIME_MAX: u64 = (1 << 48) - 1;

/// A secret key. Not shown by `Debug`.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Key(pub [u8; 32]);

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Key")
    }
}

impl Key {
    /// Returns the first bytes of the key's own SHA-256: what is kept beside it to find that it is whole.
    pub fn check(&self) -> [u8; 4] {
        first(&Hash::hash(&self.0))
    }

    /// Returns the code of a signature over `frame`, from its first byte to its checksum. Out of line: once in an
    /// image.
    #[inline(never)]
    fn code(&self, frame: &[u8], stamp: &[u8]) -> [u8; SIGNATURE - STAMP] {
        let mut hash = Hash::new();
        hash.update(self.0);
        hash.update(frame);
        hash.update(stamp);
        first(&hash.finalize())
    }

    /// Returns the signature of `frame` under this stamp.
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

/// Link and time of a signature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    /// Number of the sender's link.
    pub link: u8,
    /// Time since the beginning of 2015 UTC \[10 us\], up to [`TIME_MAX`]. Larger than that of any frame that the
    /// sender has sent by this link before.
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

/// A frame with the right checksum, to be trusted or not.
#[derive(Clone, Copy, Debug)]
pub struct ReceivedFrame<'a> {
    /// Sender.
    pub from: Address,
    /// Number of the message.
    pub id: u32,
    /// The frame, from its first byte to its checksum.
    bytes: &'a [u8],
    signature: Option<&'a [u8; SIGNATURE]>,
}

impl<'a> ReceivedFrame<'a> {
    /// A frame whose first `unsigned` bytes reach to its checksum.
    pub(crate) fn new(from: Address, id: u32, frame: &'a [u8], unsigned: usize) -> Self {
        let (bytes, rest) = frame.split_at_checked(unsigned).unwrap_or((frame, &[]));
        ReceivedFrame { from, id, bytes, signature: rest.first_chunk() }
    }

    /// Returns link and time of its signature; none if it has none.
    pub fn stamp(&self) -> Option<Stamp> {
        self.signature?.first_chunk().copied().map(Stamp::from_bytes)
    }

    /// True if it has a signature, made with this key.
    pub fn is_signed_by(&self, key: &Key) -> bool {
        let Some((stamp, sent)) = self.signature.map(|signature| signature.split_at(STAMP)) else { return false };
        let code = key.code(self.bytes, stamp);
        // All of it, however early it differs: the time tells nothing.
        code.len() == sent.len() && code.iter().zip(sent).fold(0, |differs, (a, b)| differs | (a ^ b)) == 0
    }
}

/// SETUP_SIGNING (256): a key for this vehicle, or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SetupSigning {
    /// The key; none to sign nothing any more, sent as zeros.
    pub key: Option<Key>,
    /// The sender's time ([`Stamp::time_10us`]).
    pub time_10us: u64,
}

/// Time, system, component, key.
const SETUP: Layout<SETUP_SIGNING_DATA, (u64, Address, [u8; 32])> = Layout::NEW;

impl SetupSigning {
    /// Number of the message.
    pub const ID: u32 = SETUP_SIGNING_DATA::ID;

    pub(crate) fn format() -> MessageFormat {
        SETUP.format()
    }

    /// Returns the message and the system that it is for.
    pub(crate) fn read(payload: &[u8]) -> (Self, Address) {
        let (time_10us, to, key) = SETUP.read(payload);
        (SetupSigning { key: (key != [0; 32]).then_some(Key(key)), time_10us: time_10us.min(TIME_MAX) }, to)
    }

    pub(crate) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        SETUP.write(&(self.time_10us, Address::default(), self.key.map_or([0; 32], |key| key.0)), payload)
    }
}
