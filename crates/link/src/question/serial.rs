//! Serial ports and shells: SERIAL_CONTROL, in both directions.

use crate::address::Address;
use crate::message::{Fault, MessageFormat, PAYLOAD_MAX};
use crate::wire::{Layout, Unused};
use mavlink::MessageData;
use mavlink::dialects::common::SERIAL_CONTROL_DATA;

/// SERIAL_CONTROL (126), without its data but for what a vehicle without a shell says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Serial {
    /// `SERIAL_CONTROL_DEV`.
    pub device: u8,
    /// Number of bytes.
    pub bytes: u8,
}

/// `SERIAL_CONTROL_FLAG`: a reply.
pub(super) const REPLY: u8 = 1;
/// `SERIAL_CONTROL_FLAG`: a reply is wanted.
pub(super) const RESPOND: u8 = 2;
pub(super) const ID: u32 = SERIAL_CONTROL_DATA::ID;

/// Baud rate, time limit, device, flags, number of bytes, data, receiver.
const SERIAL: Layout<SERIAL_CONTROL_DATA, (u32, u16, u8, u8, u8, [u8; LENGTH], Unused<60>, Address)> = Layout::NEW;
const LENGTH: usize = Serial::NO_SHELL.len();

pub(super) fn format() -> MessageFormat {
    SERIAL.format()
}

impl Serial {
    /// What a vehicle without a shell says.
    pub const NO_SHELL: [u8; 10] = *b"no shell\r\n";
    /// Number of the shell among the devices.
    pub const SHELL: u8 = 10;

    /// Reads one with this of the two flags, and without the other.
    pub(super) fn read(payload: &[u8], flag: u8) -> Result<(Self, Address), Fault> {
        let (_, _, device, flags, bytes, _, _, to) = SERIAL.read(payload);
        if flags & (REPLY | RESPOND) != flag {
            return Err(Fault::Unsupported);
        }
        Ok((Serial { device, bytes }, to))
    }

    /// Returns the receiver of a line for the shell that wants no reply, if it is one.
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

/// Writes a line for the shell that wants no reply.
pub(super) fn write_line(payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
    SERIAL.write(&(0, 0, Serial::SHELL, 0, 1, [b'\n'; LENGTH], Unused, Address::default()), payload)
}
