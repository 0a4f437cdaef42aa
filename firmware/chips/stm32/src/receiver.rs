//! Reads a GNSS receiver on a UART.

use afbc_drivers::GnssReading;
use afbc_drivers::ublox::{ReceiverAction, UbxCommand, UbxReceiver};
use embassy_futures::select::{Either, select};
use embassy_stm32::usart::BufferedUart;
use embassy_time::{Duration, Instant, Timer, with_timeout};
use embedded_io_async::{Read, Write};

/// Size of the UART's transmit ring: the driver refuses a command that does not fit as a whole.
pub const TX_RING: usize = UbxCommand::LENGTH_MAX;

/// Longest time between two polls of the receiver's protocol, and longest time for sending a command \[ms\]. The
/// longest command takes 46 ms at 9,600 baud.
const LOOK_MS: u64 = 50;
const SEND_MS: u64 = 100;
/// Bits of a byte on the line.
const BYTE_BITS: u64 = 10;

/// Receives fixes forever, at the receiver's baud rate, which is found by trying. Passes on each fix with the time of
/// its measurement \[us\], and none for an epoch without a fix.
pub async fn run(mut uart: BufferedUart<'static>, mut take: impl FnMut(u64, Option<GnssReading>)) {
    let mut receiver = UbxReceiver::new();
    // The buffer must hold at least half of the UART's ring, since the UART also wakes this task at half its ring.
    let mut bytes = [0; 512];
    let mut byte_us = 0;
    loop {
        while let Some(action) = receiver.poll(Instant::now().as_micros()) {
            match action {
                ReceiverAction::Baud(baud) => {
                    // A baud rate that does not divide the clock is tried in vain.
                    let _ = uart.set_baudrate(baud);
                    byte_us = BYTE_BITS * 1_000_000 / u64::from(baud.max(1));
                }
                ReceiverAction::Send(command) => {
                    let send = async {
                        uart.write_all(command.as_bytes()).await?;
                        uart.flush().await
                    };
                    // A command that is not sent gets no answer and is sent again.
                    let _ = with_timeout(Duration::from_millis(SEND_MS), send).await;
                }
            }
        }
        let Either::First(Ok(length)) = select(uart.read(&mut bytes), Timer::after_millis(LOOK_MS)).await else {
            continue;
        };
        // The UART wakes this task after the line has been idle for a byte.
        let first_us = Instant::now().as_micros().saturating_sub(byte_us * (length as u64 + 1));
        for (at, byte) in (0..).zip(bytes.iter().take(length)) {
            if let Some(fix) = receiver.take(first_us + at * byte_us, *byte) {
                take(fix.at_us, fix.value);
            }
        }
    }
}
