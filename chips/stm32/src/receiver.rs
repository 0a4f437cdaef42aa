//! A GNSS receiver on a UART.

use afbc_drivers::FixReading;
use afbc_drivers::nmea::{BAUDS, LATENCY_US, NmeaDecoder};
use embassy_futures::select::{Either, select};
use embassy_stm32::usart::BufferedUart;
use embassy_time::{Duration, Instant, Timer};
use embedded_io_async::Read;

/// Time without a fix after which another baud rate is tried: two epochs of a slow receiver \[s\].
const SILENT_S: u64 = 3;
/// Pause between two epochs, at least \[us\].
const PAUSE_US: u64 = 20_000;

/// Receives fixes for ever, at whichever baud rate the receiver has, and passes each on with its time \[us\], which is
/// some time before its first byte; none for an epoch without a fix.
pub async fn run(mut uart: BufferedUart<'static>, mut take: impl FnMut(u64, Option<FixReading>)) {
    let mut decoder = NmeaDecoder::new();
    let mut bytes = [0; 64];
    let (mut began_us, mut last_us) = (0, 0);
    for baud in BAUDS.into_iter().cycle() {
        // One that does not divide the clock is tried like the others, in vain.
        let _ = uart.set_baudrate(baud);
        let mut heard = Instant::now();
        while heard.elapsed() < Duration::from_secs(SILENT_S) {
            let length = match select(uart.read(&mut bytes), Timer::after(Duration::from_secs(1))).await {
                Either::First(Ok(length)) => length,
                _ => continue,
            };
            let now_us = Instant::now().as_micros();
            if now_us.saturating_sub(last_us) > PAUSE_US {
                began_us = now_us;
            }
            last_us = now_us;
            for byte in bytes.iter().take(length) {
                if let Some(fix) = decoder.take(*byte) {
                    heard = Instant::now();
                    take(began_us.saturating_sub(LATENCY_US.into()), fix);
                }
            }
        }
    }
}
