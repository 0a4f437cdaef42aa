//! The image of a board: everything whose type depends on the board.

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
        async fn control(flight: &'static mut $crate::vehicle::Flight, mut board: $board) -> ! {
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
            flight: &'static mut $crate::vehicle::Flight,
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
