//! Interface between firmware and board. A crate in `boards/` implements it and builds an image by
//! [`image!`](crate::image), the only place where firmware and board meet.

use crate::control::Tick;
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

/// Builds an image for a type that implements [`Board`](crate::board::Board): the program's entry, and the tasks whose
/// type depends on the board. The board handles panics and faults.
#[macro_export]
macro_rules! image {
    ($board:ty) => {
        const _: () = assert!(
            $crate::vehicle::ROTORS <= <$board as $crate::board::Board>::OUTPUTS,
            "the vehicle has more rotors than this board has outputs for motors; choose another VEHICLE"
        );

        #[embassy_executor::task]
        async fn control(flight: &'static mut $crate::control::Flight, mut board: $board) -> ! {
            $crate::control::run(flight, &mut board).await
        }

        #[embassy_executor::task]
        async fn comms(
            desk: &'static mut $crate::comms::Desk,
            mut receiver: <$board as $crate::board::Board>::Receiver,
            mut transmitter: <$board as $crate::board::Board>::Transmitter,
        ) -> ! {
            $crate::comms::run(desk, &mut receiver, &mut transmitter).await
        }

        #[embassy_executor::task]
        async fn parameters(mut keeper: $crate::parameters::Keeper<<$board as $crate::board::Board>::Memory>) -> ! {
            $crate::parameters::run(&mut keeper).await
        }

        // Out of line, so that their stacks are not used at the same time.
        #[inline(never)]
        fn spawn_control(
            spawner: embassy_executor::SendSpawner,
            flight: &'static mut $crate::control::Flight,
            board: $board,
        ) {
            spawner.spawn(control(flight, board).expect("spawned once"));
        }

        #[inline(never)]
        fn spawn_comms(
            spawner: embassy_executor::SendSpawner,
            desk: &'static mut $crate::comms::Desk,
            receiver: <$board as $crate::board::Board>::Receiver,
            transmitter: <$board as $crate::board::Board>::Transmitter,
        ) {
            spawner.spawn(comms(desk, receiver, transmitter).expect("spawned once"));
        }

        #[inline(never)]
        fn spawn_parameters(
            spawner: embassy_executor::SendSpawner,
            keeper: $crate::parameters::Keeper<<$board as $crate::board::Board>::Memory>,
        ) {
            spawner.spawn(parameters(keeper).expect("spawned once"));
        }

        #[cortex_m_rt::entry]
        fn main() -> ! {
            let core = cortex_m::Peripherals::take().expect("taken once");
            $crate::run(core, spawn_control, spawn_comms, spawn_parameters)
        }
    };
}
