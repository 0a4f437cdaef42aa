//! Interface between firmware and board. A crate in `boards/` implements it and builds an image by
//! [`image!`](crate::image!), the only place where firmware and board meet.

use crate::ticks::Tick;
use crate::vehicle::ROTORS;
use afbc_onboard::Readings;
use embassy_executor::SendSpawner;
use embedded_storage::nor_flash::NorFlash;

/// A board: motors, watchdog and health.
pub trait Board: Sized + 'static {
    /// Receiving side of the link.
    type Receiver: Receiver + 'static;
    /// Sending side of the link.
    type Transmitter: Transmitter + 'static;
    /// Flash with two sectors for the parameters, from [`STORE`](Self::STORE) on.
    type Memory: NorFlash + Send + 'static;
    /// Offset of these sectors \[bytes\].
    const STORE: u32;
    /// Most motors that it drives.
    const OUTPUTS: usize;

    /// Brings up clocks and peripherals; the core runs at [`CORE_HZ`](crate::time::CORE_HZ) from then on. To be called
    /// once. A board's task spawned on `control` runs right after the control tick.
    fn start(control: SendSpawner) -> (Self, Self::Receiver, Self::Transmitter, Self::Memory);

    /// Starts the watchdog, if there is one; nothing is erased from now on.
    fn unleash_watchdog(&mut self);

    /// Waits for the next interrupt, or a part of that time.
    fn idle();

    /// True if the crystal has failed and another clock has taken over.
    fn clock_has_failed(&self) -> bool;

    /// True if a task that is not needed in flight has panicked.
    fn task_has_failed(&self) -> bool;

    /// Sets `readings` to what the sensors have read since the last tick; nothing from a board without them.
    fn sense(&mut self, readings: &mut Readings) {
        readings.clear();
    }

    /// Outputs throttles to the motors: 0, or 48 to 2047.
    fn drive(&mut self, throttles: [u16; ROTORS]);

    /// Feeds the watchdog.
    fn feed_watchdog(&mut self);
}

/// Receiving side of the link.
pub trait Receiver {
    /// Reads the next bytes and returns their number; waits for at least one.
    fn receive(&mut self, buffer: &mut [u8]) -> impl Future<Output = usize> + Send;
}

/// Sending side of the link.
pub trait Transmitter {
    /// Sets the baud rate of the line in both directions, before anything is sent; nothing if there is no such line.
    fn set_baud(&mut self, _baud: u32) {}

    /// Sends the messages after `tick`, without waiting for the line.
    fn transmit(&mut self, tick: &Tick, bytes: &[u8]);
}
