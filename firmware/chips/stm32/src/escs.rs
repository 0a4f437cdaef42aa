//! The motor controllers' telemetry on a UART of which only RX is wired.

use crate::link;
use afbc_drivers::esc_telemetry::BAUD;
use embassy_stm32::usart::{BufferedUart, Config};
use embedded_io_async::Read;

/// Size of the UART's rings: of what comes, three answers; nothing is sent.
pub const RX_RING: usize = 32;
/// See [`RX_RING`].
pub const TX_RING: usize = 1;

/// Returns how the UART is set up.
pub fn config() -> Config {
    let mut config = link::uart();
    config.baudrate = BAUD;
    config
}

/// Receives for ever. The UART wakes this task when an answer has ended, or half of its ring is full.
#[embassy_executor::task]
pub async fn listen(mut uart: BufferedUart<'static>) {
    let mut bytes = [0; RX_RING];
    loop {
        // An overrun loses bytes, which the checksum notices.
        if let Ok(length) = uart.read(&mut bytes).await {
            firmware::escs::put(bytes.get(..length).unwrap_or_default());
        }
    }
}
