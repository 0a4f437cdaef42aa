//! Register access over SPI or I2C.

use embedded_hal_async::i2c::I2c;
use embedded_hal_async::spi::{Operation, SpiDevice};

/// Longest answer to a [`ScriptStep::Read`](crate::ScriptStep::Read) \[bytes\].
pub const READ_MAX: usize = 32;
/// Longest block for a write over I2C \[bytes\].
const BLOCK_MAX: usize = 31;

/// Registers of a part.
#[allow(async_fn_in_trait, reason = "used generically, never boxed")]
pub trait Registers {
    /// Reads consecutive registers, beginning with `register`.
    ///
    /// # Errors
    /// If the transfer fails.
    async fn read(&mut self, register: u8, into: &mut [u8]) -> Result<(), BusError>;

    /// Writes consecutive registers, beginning with `register`, in one transfer. Without bytes, sends `register` as a
    /// command.
    ///
    /// # Errors
    /// If the transfer fails.
    async fn write(&mut self, register: u8, bytes: &[u8]) -> Result<(), BusError>;
}

/// A failed transfer: no acknowledgement, lost arbitration or an overrun.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusError;

/// Frame format of a part on SPI.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpiFormat {
    /// Bits set in the first byte of a read.
    pub read: u8,
    /// Bits set in the first byte of a write.
    pub write: u8,
    /// Dummy bytes before the answer, at most 1.
    pub dummies: usize,
    /// Highest clock for all registers \[Hz\].
    pub clock_hz: u32,
}

/// Registers behind SPI. All parts of this crate work in mode 3.
#[derive(Debug)]
pub struct SpiRegisters<D> {
    device: D,
    format: SpiFormat,
}

impl<D> SpiRegisters<D> {
    /// Creates access to the registers of a device.
    pub fn new(device: D, format: SpiFormat) -> Self {
        SpiRegisters { device, format }
    }
}

impl<D: SpiDevice> Registers for SpiRegisters<D> {
    async fn read(&mut self, register: u8, into: &mut [u8]) -> Result<(), BusError> {
        // A single transfer, since each one costs a DMA set-up.
        let mut frame = [0; 2 + READ_MAX];
        let head = 1 + self.format.dummies;
        let frame = frame.get_mut(..head + into.len()).ok_or(BusError)?;
        frame.iter_mut().take(1).for_each(|first| *first = register | self.format.read);
        self.device.transfer_in_place(frame).await.map_err(|_| BusError)?;
        into.iter_mut().zip(frame.iter().skip(head)).for_each(|(to, from)| *to = *from);
        Ok(())
    }

    async fn write(&mut self, register: u8, bytes: &[u8]) -> Result<(), BusError> {
        let head = register | self.format.write;
        match *bytes {
            [] => self.device.write(&[head]).await,
            [byte] => self.device.write(&[head, byte]).await,
            // Two operations avoid copying the block, since the BMI270's has 8 KiB.
            _ => self.device.transaction(&mut [Operation::Write(&[head]), Operation::Write(bytes)]).await,
        }
        .map_err(|_| BusError)
    }
}

/// Registers behind I2C.
#[derive(Debug)]
pub struct I2cRegisters<I> {
    bus: I,
    /// Seven-bit address.
    address: u8,
}

impl<I> I2cRegisters<I> {
    /// Creates access to the part at the seven-bit `address`.
    pub fn new(bus: I, address: u8) -> Self {
        I2cRegisters { bus, address }
    }
}

impl<I: I2c> Registers for I2cRegisters<I> {
    async fn read(&mut self, register: u8, into: &mut [u8]) -> Result<(), BusError> {
        self.bus.write_read(self.address, &[register], into).await.map_err(|_| BusError)
    }

    async fn write(&mut self, register: u8, bytes: &[u8]) -> Result<(), BusError> {
        let mut block = [0; 1 + BLOCK_MAX];
        let (head, tail) = block.split_at_mut(1);
        head.fill(register);
        tail.get_mut(..bytes.len()).ok_or(BusError)?.copy_from_slice(bytes);
        let block = block.get(..=bytes.len()).ok_or(BusError)?;
        self.bus.write(self.address, block).await.map_err(|_| BusError)
    }
}
