//! Serial ports and shells: SERIAL_CONTROL, in both directions.

use crate::address::Address;
use crate::message::{FrameFault, MessageFormat, PAYLOAD_MAX};
use crate::wire::{MessageLayout, Unused};
use mavlink::MessageData;
use mavlink::dialects::common::SERIAL_CONTROL_DATA;

/// SERIAL_CONTROL (126). Its data are ignored, except that a vehicle without a shell sends a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SerialControl {
    /// `SERIAL_CONTROL_DEV`.
    pub device: u8,
    /// Number of bytes.
    pub bytes: u8,
}

/// `SERIAL_CONTROL_FLAG`: this is a reply.
pub(super) const REPLY: u8 = 1;
/// `SERIAL_CONTROL_FLAG`: a reply is required.
pub(super) const RESPOND: u8 = 2;
pub(super) const ID: u32 = SERIAL_CONTROL_DATA::ID;

/// Fields: baud rate, timeout, device, flags, number of bytes, data, receiver.
const SERIAL: MessageLayout<SERIAL_CONTROL_DATA, (u32, u16, u8, u8, u8, [u8; LENGTH], Unused<60>, Address)> =
    MessageLayout::NEW;
const LENGTH: usize = SerialControl::NO_SHELL.len();

pub(super) fn format() -> MessageFormat {
    SERIAL.format()
}

impl SerialControl {
    /// Text sent by a vehicle without a shell.
    pub const NO_SHELL: [u8; 10] = *b"no shell\r\n";
    /// Number of the shell in `SERIAL_CONTROL_DEV`.
    pub const SHELL: u8 = 10;

    /// Reads a message that has `flag`, which is `REPLY` or `RESPOND`, but not both.
    pub(super) fn read(payload: &[u8], flag: u8) -> Result<(Self, Address), FrameFault> {
        let (_, _, device, flags, bytes, _, _, to) = SERIAL.read(payload);
        if flags & (REPLY | RESPOND) != flag {
            return Err(FrameFault::Unsupported);
        }
        Ok((SerialControl { device, bytes }, to))
    }

    /// Returns the receiver of a shell line that requires no reply; none for other messages.
    pub(super) fn read_line(payload: &[u8]) -> Option<Address> {
        let (_, _, device, flags, bytes, _, _, to) = SERIAL.read(payload);
        (device == Self::SHELL && flags & (REPLY | RESPOND) == 0 && bytes > 0).then_some(to)
    }

    pub(super) fn write(self, flag: u8, to: Address, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let says = flag == REPLY && self.bytes > 0;
        let data = if says { Self::NO_SHELL } else { [0; LENGTH] };
        SERIAL.write(&(0, 0, self.device, flag, self.bytes, data, Unused, to), payload)
    }
}

/// Writes a shell line that requires no reply.
pub(super) fn write_line(payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
    SERIAL.write(&(0, 0, SerialControl::SHELL, 0, 1, [b'\n'; LENGTH], Unused, Address::default()), payload)
}
