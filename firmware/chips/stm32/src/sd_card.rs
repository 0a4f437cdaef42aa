//! A memory card on the chip's SDMMC interface, over four data lines.

use afbc_log::storage::embedded_sdmmc::Block;
use afbc_log::storage::{CardError, CardKeeper, LogCard};
use core::pin::pin;
use core::task::{Context, Poll, Waker};
use embassy_stm32::sdmmc::sd::{Addressable as _, Card, CmdBlock, DataBlock, StorageDevice};
use embassy_stm32::sdmmc::{Error, Sdmmc};
use embassy_stm32::time::{Hertz, mhz};
use embassy_time::{Duration, Instant};
use static_cell::StaticCell;

/// Highest clock: the default speed of every card (SD Physical Layer Simplified Specification, 3.9.1). A start begins
/// at 400 kHz.
const CLOCK: Hertz = mhz(24);
/// Longest wait for a transfer; the interface itself gives up after a card has been silent for 0.2 to 0.3 s.
const PATIENCE: Duration = Duration::from_secs(1);

/// DMA buffers: static, since DMA does not reach the stack.
struct Buffers {
    data: DataBlock,
    registers: CmdBlock,
}

/// Keeps logs on a card on the SDMMC interface.
pub type SdCardLog = CardKeeper<'static>;

/// A card on SDMMC. Every call polls until the card is done, so the calling task must have a lower priority than all
/// others.
pub struct SdCard {
    device: StorageDevice<'static, 'static, Card>,
    buffers: &'static mut Buffers,
}

/// Creates the log on the card of this interface. Must be called only once.
///
/// # Panics
/// At a second call.
pub fn new(interface: Sdmmc<'static>) -> SdCardLog {
    static CARD: StaticCell<SdCard> = StaticCell::new();
    CardKeeper::new(CARD.init(SdCard::new(interface)))
}

impl SdCard {
    fn new(interface: Sdmmc<'static>) -> Self {
        static INTERFACE: StaticCell<Sdmmc<'static>> = StaticCell::new();
        static BUFFERS: StaticCell<Buffers> = StaticCell::new();
        let device = StorageDevice::new_uninit_sd_card(INTERFACE.init(interface));
        SdCard { device, buffers: BUFFERS.init(Buffers { data: DataBlock::new(), registers: CmdBlock::new() }) }
    }
}

/// Polls a transfer until it has ended or [`PATIENCE`] is over. Embassy's timers cannot limit the wait, since they only
/// wake tasks.
fn finish(transfer: impl Future<Output = Result<(), Error>>) -> Result<(), Error> {
    let mut transfer = pin!(transfer);
    let since = Instant::now();
    loop {
        match transfer.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(done) => return done,
            Poll::Pending if since.elapsed() > PATIENCE => return Err(Error::SoftwareTimeout),
            Poll::Pending => (),
        }
    }
}

impl LogCard for SdCard {
    fn start(&mut self) -> Result<u32, CardError> {
        finish(self.device.reacquire(&mut self.buffers.registers, CLOCK)).map_err(|error| match error {
            // An empty slot answers no command.
            Error::Timeout => CardError::Absent,
            _ => CardError::Failed,
        })?;
        let blocks = self.device.card().size() / size_of::<DataBlock>() as u64;
        Ok(blocks.try_into().unwrap_or(u32::MAX))
    }

    fn read(&mut self, number: u32, block: &mut Block) -> Result<(), CardError> {
        finish(self.device.read_block(number, &mut self.buffers.data)).map_err(|_| CardError::Failed)?;
        for (bytes, word) in block.contents.as_chunks_mut().0.iter_mut().zip(&self.buffers.data.0) {
            *bytes = word.to_ne_bytes();
        }
        Ok(())
    }

    fn write(&mut self, number: u32, block: &Block) -> Result<(), CardError> {
        for (word, bytes) in self.buffers.data.0.iter_mut().zip(block.contents.as_chunks().0) {
            *word = u32::from_ne_bytes(*bytes);
        }
        finish(self.device.write_block(number, &self.buffers.data)).map_err(|_| CardError::Failed)
    }
}
