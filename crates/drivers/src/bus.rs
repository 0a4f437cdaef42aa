//! Registers behind SPI or I2C.

use embedded_hal_async::i2c::I2c;
use embedded_hal_async::spi::{Operation, SpiDevice};

/// Longest answer to a [`Step::Read`](crate::Step::Read) \[bytes\].
pub const READ_MAX: usize = 32;
/// Longest block that I2C writes \[bytes\].
const BLOCK_MAX: usize = 31;

/// A part's registers.
#[allow(async_fn_in_trait, reason = "used generically, never boxed")]
pub trait Registers {
    /// Reads from `register` on.
    ///
    /// # Errors
    /// The transfer fails.
    async fn read(&mut self, register: u8, into: &mut [u8]) -> Result<(), BusError>;

    /// Writes from `register` on, in one transfer; without bytes it is a command.
    ///
    /// # Errors
    /// The transfer fails.
    async fn write(&mut self, register: u8, bytes: &[u8]) -> Result<(), BusError>;
}

/// A transfer has failed: no answer, a collision, an overrun.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusError;

/// How a part is read over SPI.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpiFormat {
    /// Bits of the first byte that make a read of it.
    pub read: u8,
    /// Bits of the first byte that make a write of several registers of it.
    pub write: u8,
    /// Bytes that the part sends in front of its answer, at most 1.
    pub dummies: usize,
    /// Highest clock at which all of its registers work \[Hz\].
    pub clock_hz: u32,
}

/// Registers behind SPI. Mode 3 suits every part of this crate.
#[derive(Debug)]
pub struct SpiRegisters<D> {
    device: D,
    format: SpiFormat,
}

impl<D> SpiRegisters<D> {
    /// The registers of a device.
    pub fn new(device: D, format: SpiFormat) -> Self {
        SpiRegisters { device, format }
    }
}

impl<D: SpiDevice> Registers for SpiRegisters<D> {
    async fn read(&mut self, register: u8, into: &mut [u8]) -> Result<(), BusError> {
        // One transfer, since each costs a DMA's set-up.
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
            // In two parts, so that a block stays where it is: the BMI270's has 8 KiB.
            _ => self.device.transaction(&mut [Operation::Write(&[head]), Operation::Write(bytes)]).await,
        }
        .map_err(|_| BusError)
    }
}

/// Registers behind I2C.
#[derive(Debug)]
pub struct I2cRegisters<I> {
    bus: I,
    /// Seven bits.
    address: u8,
}

impl<I> I2cRegisters<I> {
    /// The registers of the part at `address`, of seven bits.
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
