//! Motor controllers' telemetry on a UART of which only RX is wired.

use crate::link;
use afbc_drivers::esc_telemetry::BAUD;
use embassy_stm32::usart::{BufferedUart, Config};
use embedded_io_async::Read;

/// Size of the receive ring: three telemetry frames.
pub const RX_RING: usize = 32;
/// Size of the transmit ring: nothing is sent.
pub const TX_RING: usize = 1;

/// Returns the UART's settings.
pub fn config() -> Config {
    let mut config = link::uart();
    config.baudrate = BAUD;
    config
}

/// Receives forever. The UART wakes this task at the end of an answer, or when half of its ring is full.
#[embassy_executor::task]
pub async fn listen(mut uart: BufferedUart<'static>) {
    let mut bytes = [0; RX_RING];
    loop {
        // An overrun loses bytes; the checksum detects that.
        if let Ok(length) = uart.read(&mut bytes).await {
            firmware::escs::put(bytes.get(..length).unwrap_or_default());
        }
    }
}
