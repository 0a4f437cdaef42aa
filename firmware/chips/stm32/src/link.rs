//! Links by UART, with ring buffers that its interrupt fills and empties, and by [`usb`].

use crate::line::Line;
use crate::usb::{self, UsbPort};
use core::cell::Cell;
use core::future::poll_fn;
use core::pin::pin;
use core::task::{Poll, ready};
use embassy_futures::poll_once;
use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, Pin, Pull, Speed};
use embassy_stm32::usart::{BufferedUart, BufferedUartRx, BufferedUartTx, Config, Parity, StopBits};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embedded_io_async::{BufRead, Write};
use firmware::board::{self, BoardLink};
use firmware::ticks::Tick;

/// Number of bytes that wakes the reader: 0.35 ms of a busy line. Fewer bytes wake the reader when the line becomes
/// idle, as after a message. The reader also runs after every control tick. Waking it for every byte would take most of
/// the processor's time.
const READ_MIN: usize = 32;

/// Sizes of the rings of a radio receiver's UART \[bytes\]: transmit, and receive for 10 ms.
pub const RADIO_RINGS: [usize; 2] = [128, 512];

/// Returns settings common to all UARTs. RX is pulled up, so that an undriven line is idle and no noise is read.
pub fn uart() -> Config {
    let mut config = Config::default();
    config.rx_pull = Pull::Up;
    config
}

/// Returns the settings for a link's UART; its baud rate is a parameter.
pub fn config() -> Config {
    let mut config = uart();
    config.eager_reads = Some(READ_MIN);
    config
}

/// Returns the settings for a radio receiver's UART until its protocol is known.
pub fn radio() -> Config {
    config()
}

/// Returns the settings for SBUS. On chips without inverting UARTs, the board has an inverter before the pin.
fn sbus() -> Config {
    let mut config = config();
    config.baudrate = 100_000;
    config.parity = Parity::ParityEven;
    config.stop_bits = StopBits::STOP2;
    #[cfg(feature = "inverting-uart")]
    {
        config.invert_rx = true;
    }
    config
}

/// Pin that switches the inverter before the radio receiver's RX.
static INVERTER: Mutex<CriticalSectionRawMutex, Cell<Option<Output<'static>>>> = Mutex::new(Cell::new(None));

/// Registers the pin that switches SBUS inversion; the pin is low until then. Must be called before [`set_sbus`].
///
/// [`set_sbus`]: board::Transmitter::set_sbus
pub fn invert_by(pin: Peri<'static, impl Pin>) {
    let pin = Output::new(pin, Level::Low, Speed::Low);
    INVERTER.lock(|inverter| inverter.set(Some(pin)));
}

/// Switches the inverter on forever, if there is one.
fn invert() {
    if let Some(mut pin) = INVERTER.lock(Cell::take) {
        pin.set_high();
        // Dropping the pin would make it an input again.
        core::mem::forget(pin);
    }
}

/// Makes a link from a UART.
pub fn new(uart: BufferedUart<'static>) -> BoardLink<Receiver, Transmitter> {
    split(uart, None)
}

/// Makes a link from a UART that inverts its line itself for SBUS. An SBUS line idles low, so RX is pulled down then.
pub fn inverting(uart: BufferedUart<'static>, rx: Line) -> BoardLink<Receiver, Transmitter> {
    split(uart, Some(rx))
}

fn split(uart: BufferedUart<'static>, inverts: Option<Line>) -> BoardLink<Receiver, Transmitter> {
    let (transmitter, receiver) = uart.split();
    BoardLink { receiver: Receiver::Uart(receiver), transmitter: Transmitter::Uart(transmitter, inverts) }
}

/// Makes a link from the USB port.
pub fn of_usb(_started: UsbPort) -> BoardLink<Receiver, Transmitter> {
    BoardLink { receiver: Receiver::Usb, transmitter: Transmitter::Usb }
}

/// Receiving side of a link.
pub enum Receiver {
    /// A UART.
    Uart(BufferedUartRx<'static>),
    /// The USB port, read from its ring.
    Usb,
}

impl board::Receiver for Receiver {
    fn receive(&mut self, buffer: &mut [u8]) -> impl Future<Output = usize> {
        // A new read in each poll, since polling a finished one would panic. An overrun loses bytes; the decoder
        // detects that.
        poll_fn(move |context| {
            let uart = match self {
                Receiver::Uart(uart) => uart,
                Receiver::Usb => return pin!(usb::RECEIVED.read(buffer)).poll(context),
            };
            let length = ready!(pin!(uart.fill_buf()).poll(context)).map_or(0, |bytes| {
                buffer.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
                bytes.len().min(buffer.len())
            });
            uart.consume(length);
            Poll::Ready(length)
        })
    }

    fn is_wired(&self) -> bool {
        matches!(self, Receiver::Usb)
    }
}

/// Sending side of a link.
pub enum Transmitter {
    /// A UART, with its RX line if it inverts the line itself for SBUS.
    Uart(BufferedUartTx<'static>, Option<Line>),
    /// The USB port, written through its ring.
    Usb,
}

impl board::Transmitter for Transmitter {
    fn set_baud(&mut self, baud: u32) {
        if let Transmitter::Uart(uart, _) = self
            && uart.set_baudrate(baud).is_err()
        {
            defmt::warn!("no divider of the clock gives {=u32} baud", baud);
        }
    }

    fn set_sbus(&mut self) {
        if let Transmitter::Uart(uart, inverts) = self {
            if uart.set_config(&sbus()).is_err() {
                defmt::warn!("no divider of the clock gives the baud rate of SBUS");
            }
            if let Some(rx) = inverts {
                rx.pull_down();
            }
        }
        invert();
    }

    fn transmit(&mut self, _tick: &Tick, bytes: &[u8]) -> bool {
        match self {
            // Accepts all bytes or, if the ring is full, none; the driver does not wake tasks that wait for room.
            Transmitter::Uart(uart, _) if !bytes.is_empty() => {
                matches!(poll_once(uart.write(bytes)), Poll::Ready(Ok(_)))
            }
            Transmitter::Uart(..) => true,
            Transmitter::Usb => usb::send(bytes),
        }
    }
}
