//! Wire to a UART of the board.

use rigless::chip::Timeline;
use rigless::chip::uart::Peer;
use rigless::snapshot::{Error, Reader, Store, Writer};
use rigless::time::VirtualNanos;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

/// Bytes on their way to and from the board.
#[derive(Debug, Default)]
struct WireBytes {
    to_board: VecDeque<u8>,
    from_board: Vec<u8>,
    /// Time at which the last queued byte to the board was begun; `None` while bytes wait, and not stored in snapshots
    /// \[ns\].
    emptied_ns: Option<u64>,
}

/// Wire whose bytes move at the pace of the board's UART. Clones share one wire.
#[derive(Clone, Debug, Default)]
pub struct UartWire(Arc<Mutex<WireBytes>>);

impl UartWire {
    fn with<T>(&self, change: impl FnOnce(&mut WireBytes) -> T) -> T {
        change(&mut self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner))
    }

    /// Sends bytes to the board.
    pub fn send(&self, bytes: &[u8]) {
        self.with(|wire| {
            wire.to_board.extend(bytes);
            wire.emptied_ns = None;
        });
    }

    /// Returns the time at which the last queued byte was begun; `None` while bytes wait \[ns\].
    pub fn emptied_ns(&self) -> Option<u64> {
        self.with(|wire| wire.emptied_ns)
    }

    /// Takes the bytes that the board has sent.
    pub fn take(&self) -> Vec<u8> {
        self.with(|wire| std::mem::take(&mut wire.from_board))
    }

    /// Acts as the board's end: takes all bytes on their way to the board, and sends `from_board`.
    pub fn exchange(&self, from_board: &[u8]) -> Vec<u8> {
        self.with(|wire| {
            wire.from_board.extend(from_board);
            wire.to_board.drain(..).collect()
        })
    }
}

impl Store for UartWire {
    fn store(&self, to: &mut Writer) -> Result<(), Error> {
        self.with(|wire| to.put(&(&wire.to_board, &wire.from_board)))
    }

    fn load(&mut self, from: &mut Reader) -> Result<(), Error> {
        let (to_board, from_board) = from.take()?;
        self.with(|wire| *wire = WireBytes { to_board, from_board, emptied_ns: None });
        Ok(())
    }
}

impl Peer for UartWire {
    fn receive(&mut self, word: u16, _: &mut Timeline<'_, '_>) {
        self.with(|wire| wire.from_board.push(word as u8));
    }

    fn transmit(&mut self, at: VirtualNanos) -> Option<u16> {
        self.with(|wire| {
            let byte = wire.to_board.pop_front();
            if byte.is_some() && wire.to_board.is_empty() {
                wire.emptied_ns = Some(at.0);
            }
            byte
        })
        .map(u16::from)
    }
}
