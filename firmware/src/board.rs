//! What the firmware asks of a board. A folder of `boards/` implements it and makes an image by [`image!`](crate::image):
//! the one place where the two meet.

use crate::control::Tick;
use embassy_executor::SendSpawner;

/// A board: motors, watchdog, and whether it is well.
pub trait Board: Sized + 'static {
    /// The link, in.
    type Receiver: Receiver + 'static;
    /// The link, out.
    type Transmitter: Transmitter + 'static;

    /// Brings up clocks and peripherals; the core runs at [`CORE_HZ`](crate::time::CORE_HZ) from then on. To be called once.
    /// A task of the board's own on `control` runs with the control tick, right after it.
    fn start(control: SendSpawner) -> (Self, Self::Receiver, Self::Transmitter);

    /// Passes the time until the next interrupt, or a part of it.
    fn idle();

    /// True if the clock has failed and another has taken over.
    fn clock_has_failed(&self) -> bool;

    /// True if a task that is not needed to fly has panicked.
    fn task_has_failed(&self) -> bool;

    /// Gives the motors their throttle: 0, or 48 to 2047.
    fn drive(&mut self, throttles: [u16; 4]);

    /// Keeps the chip from being reset.
    fn feed_watchdog(&mut self);
}

/// The link, in.
pub trait Receiver {
    /// Reads the next bytes, and tells how many: waits for at least one.
    fn receive(&mut self, buffer: &mut [u8]) -> impl Future<Output = usize> + Send;
}

/// The link, out.
pub trait Transmitter {
    /// Sends what there was to say after `tick`; never waits for the line.
    fn transmit(&mut self, tick: &Tick, bytes: &[u8]);
}

/// Makes an image for a type that implements [`Board`](crate::board::Board): the program's entry, and the tasks whose type
/// depends on the board. What happens on a panic or a fault is the board's own.
#[macro_export]
macro_rules! image {
    ($board:ty) => {
        #[embassy_executor::task]
        async fn control(mut flight: $crate::control::Flight, mut board: $board) -> ! {
            $crate::control::run(&mut flight, &mut board).await
        }

        #[embassy_executor::task]
        async fn comms(
            mut comms: $crate::comms::Comms,
            mut receiver: <$board as $crate::board::Board>::Receiver,
            mut transmitter: <$board as $crate::board::Board>::Transmitter,
        ) -> ! {
            $crate::comms::run(&mut comms, &mut receiver, &mut transmitter).await
        }

        // Out of line: neither takes its stack while the other does.
        #[inline(never)]
        fn spawn_control(spawner: embassy_executor::SendSpawner, board: $board) {
            spawner.spawn(control($crate::control::flight(), board).expect("spawned once"));
        }

        #[inline(never)]
        fn spawn_comms(
            spawner: embassy_executor::SendSpawner,
            receiver: <$board as $crate::board::Board>::Receiver,
            transmitter: <$board as $crate::board::Board>::Transmitter,
        ) {
            spawner.spawn(comms($crate::comms::Comms::new(), receiver, transmitter).expect("spawned once"));
        }

        #[cortex_m_rt::entry]
        fn main() -> ! {
            $crate::run(cortex_m::Peripherals::take().expect("taken once"), spawn_control, spawn_comms)
        }
    };
}
