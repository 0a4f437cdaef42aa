//! A link by UART, with ring buffers that its interrupt fills and empties.

use core::future::poll_fn;
use core::pin::pin;
use core::task::{Poll, ready};
use embassy_futures::poll_once;
use embassy_stm32::usart::{BufferedUart, BufferedUartRx, BufferedUartTx, Config};
use embedded_io_async::{BufRead, Write};
use firmware::board::{self, BoardLink};
use firmware::ticks::Tick;

/// Bytes that wake the reader \[0.35 ms of a busy line\]. Fewer wake it when the line becomes idle, as after a message,
/// and it also runs after every control tick. Waking it for every byte would take most of the processor's time.
const READ_MIN: usize = 32;

/// Returns how the UART of a link is set up; its baud rate is a parameter.
pub fn config() -> Config {
    let mut config = Config::default();
    config.eager_reads = Some(READ_MIN);
    config
}

/// Makes a link of a UART.
pub fn new(uart: BufferedUart<'static>) -> BoardLink<Receiver, Transmitter> {
    let (transmitter, receiver) = uart.split();
    BoardLink { receiver: Receiver(receiver), transmitter: Transmitter(transmitter) }
}

/// Receiving side.
pub struct Receiver(BufferedUartRx<'static>);

impl board::Receiver for Receiver {
    fn receive(&mut self, buffer: &mut [u8]) -> impl Future<Output = usize> {
        // A new read each time, since polling one that has ended would panic. An overrun loses bytes, which the decoder
        // notices.
        poll_fn(move |context| {
            let length = ready!(pin!(self.0.fill_buf()).poll(context)).map_or(0, |bytes| {
                buffer.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
                bytes.len().min(buffer.len())
            });
            self.0.consume(length);
            Poll::Ready(length)
        })
    }
}

/// Sending side.
pub struct Transmitter(BufferedUartTx<'static>);

impl board::Transmitter for Transmitter {
    fn set_baud(&mut self, baud: u32) {
        if self.0.set_baudrate(baud).is_err() {
            defmt::warn!("{=u32} baud do not divide the clock", baud);
        }
    }

    /// Drops the bytes if the line is too far behind.
    fn transmit(&mut self, _tick: &Tick, bytes: &[u8]) {
        // Accepts all bytes or, if the ring is full, none; the driver does not wake those who wait for room.
        if !bytes.is_empty() {
            let _ = poll_once(self.0.write(bytes));
        }
    }
}
