//! Macro that defines everything in an image whose type depends on the board.

/// Builds an image for a type that implements [`Board`](crate::board::Board): the program's entry, the time base, the
/// executors' interrupts and the tasks whose type depends on the board. The board handles panics and faults.
///
/// `control`, `comms` and `housekeeping` each name an interrupt line that the board leaves unused. A board also names
/// `sampling` if it has inertial sensors, `aiding` if it has slow sensors, and `logging` if it keeps logs:
/// `image!(board::Mine, control: LINE_A, comms: LINE_B, housekeeping: LINE_C, sampling: LINE_D, aiding: LINE_E)`.
#[macro_export]
macro_rules! image {
    (
        $board:ty, control: $control:ident, comms: $comms:ident, housekeeping: $housekeeping:ident
        $(, sampling: $sampling:ident)? $(, aiding: $aiding:ident)? $(, logging: $logging:ident)? $(,)?
    ) => {
        const _: () = assert!(
            $crate::vehicle::ROTORS <= <$board as $crate::board::Board>::OUTPUTS,
            "the vehicle has more rotors than this board has outputs for motors; choose another VEHICLE"
        );

        const _: () = {
            let sampling: &[&str] = &[$(stringify!($sampling))?];
            let aiding: &[&str] = &[$(stringify!($aiding))?];
            let logging: &[&str] = &[$(stringify!($logging))?];
            assert!(
                <$board as $crate::board::Board>::HAS_LOG != logging.is_empty(),
                "name an interrupt line for the executor `logging` if the board keeps logs, and only then"
            );
            assert!(
                <<$board as $crate::board::Board>::Sampler as $crate::samples::Sampler>::SENSES != sampling.is_empty()
                    && <<$board as $crate::board::Board>::Aids as $crate::samples::Sampler>::SENSES
                        != aiding.is_empty(),
                "name interrupt lines for the executors `sampling` and `aiding` if the board has sensors, and only then"
            )
        };

        // Tasks are defined here because an embassy task cannot be generic in the board.
        #[embassy_executor::task]
        async fn sampling(sampler: <$board as $crate::board::Board>::Sampler) {
            $crate::samples::Sampler::run(sampler).await
        }

        #[embassy_executor::task]
        async fn control(flight: &'static mut $crate::vehicle::Flight, mut board: $board) -> ! {
            $crate::control::run(flight, &mut board).await
        }

        #[embassy_executor::task]
        async fn comms(
            parts: &'static mut $crate::comms::CommsParts,
            mut links: <$board as $crate::board::Board>::Links,
        ) -> ! {
            const OTHERS: usize = <<$board as $crate::board::Board>::Links as $crate::board::Links>::COUNT - 1;
            $crate::comms::run::<$board, OTHERS>(parts, &mut links).await
        }

        #[embassy_executor::task]
        async fn parameters(mut keeper: $crate::parameters::Keeper<<$board as $crate::board::Board>::Memory>) -> ! {
            $crate::parameters::run(&mut keeper).await
        }

        // The task is spawned from within its executor, because the futures of sensor transfers are not Send.
        #[embassy_executor::task]
        async fn start_sampling(sampler: <$board as $crate::board::Board>::Sampler) {
            let task = $crate::executors::once(sampling(sampler));
            $crate::executors::spawner().await.spawn(task);
        }

        #[embassy_executor::task]
        async fn aiding(aids: <$board as $crate::board::Board>::Aids) {
            $crate::samples::Sampler::run(aids).await
        }

        #[embassy_executor::task]
        async fn start_aiding(aids: <$board as $crate::board::Board>::Aids) {
            let task = $crate::executors::once(aiding(aids));
            $crate::executors::spawner().await.spawn(task);
        }

        #[embassy_executor::task]
        async fn logging(
            blocks: $crate::logging::LogEnds,
            log: &'static mut <$board as $crate::board::Board>::Log,
        ) -> ! {
            $crate::logging::run(blocks, log).await
        }

        #[embassy_executor::task]
        async fn start_logging(
            blocks: $crate::logging::LogEnds,
            log: &'static mut <$board as $crate::board::Board>::Log,
        ) {
            let task = $crate::executors::once(logging(blocks, log));
            $crate::executors::spawner().await.spawn(task);
        }

        fn spawn_logging(
            spawner: embassy_executor::SendSpawner,
            blocks: $crate::logging::LogEnds,
            log: <$board as $crate::board::Board>::Log,
        ) {
            // In a static, since passing it through both tasks by value would store it twice.
            static LOG: $crate::StaticCell<<$board as $crate::board::Board>::Log> = $crate::StaticCell::new();
            spawner.spawn($crate::executors::once(start_logging(blocks, LOG.init(log))));
        }

        fn spawn_aiding(spawner: embassy_executor::SendSpawner, aids: <$board as $crate::board::Board>::Aids) {
            spawner.spawn($crate::executors::once(start_aiding(aids)));
        }

        fn spawn_sampling(
            spawner: embassy_executor::SendSpawner,
            sampler: <$board as $crate::board::Board>::Sampler,
        ) {
            spawner.spawn($crate::executors::once(start_sampling(sampler)));
        }

        // These functions are not inlined, so that their stacks are not used at the same time.
        #[inline(never)]
        fn spawn_control(
            spawner: embassy_executor::SendSpawner,
            flight: &'static mut $crate::vehicle::Flight,
            board: $board,
        ) {
            spawner.spawn($crate::executors::once(control(flight, board)));
        }

        #[inline(never)]
        fn spawn_comms(
            spawner: embassy_executor::SendSpawner,
            parts: &'static mut $crate::comms::CommsParts,
            links: <$board as $crate::board::Board>::Links,
        ) {
            spawner.spawn($crate::executors::once(comms(parts, links)));
        }

        #[inline(never)]
        fn spawn_parameters(
            spawner: embassy_executor::SendSpawner,
            keeper: $crate::parameters::Keeper<<$board as $crate::board::Board>::Memory>,
        ) {
            spawner.spawn($crate::executors::once(parameters(keeper)));
        }

        // The driver is defined here because its type contains the core's clock rate.
        $crate::time::time_driver_impl!(
            static TIME: $crate::time::SysTickDriver<{ <$board as $crate::board::Board>::CORE_HZ / 1_000_000 }> =
                $crate::time::SysTickDriver
        );

        #[allow(unsafe_code, reason = "an executor must be polled from its own interrupt")]
        mod executors {
            #[unsafe(no_mangle)]
            extern "C" fn $control() {
                // SAFETY: `main` starts the executor with this interrupt line.
                unsafe { $crate::executors::on_control() }
            }

            $(
                #[unsafe(no_mangle)]
                extern "C" fn $sampling() {
                    // SAFETY: as above.
                    unsafe { $crate::executors::on_sampling() }
                }
            )?

            $(
                #[unsafe(no_mangle)]
                extern "C" fn $aiding() {
                    // SAFETY: as above.
                    unsafe { $crate::executors::on_aiding() }
                }
            )?

            $(
                #[unsafe(no_mangle)]
                extern "C" fn $logging() {
                    // SAFETY: as above.
                    unsafe { $crate::executors::on_logging() }
                }
            )?

            #[unsafe(no_mangle)]
            extern "C" fn $comms() {
                // SAFETY: as above.
                unsafe { $crate::executors::on_comms() }
            }

            #[unsafe(no_mangle)]
            extern "C" fn $housekeeping() {
                // SAFETY: as above.
                unsafe { $crate::executors::on_housekeeping() }
            }
        }

        #[cortex_m_rt::entry]
        fn main() -> ! {
            <$board as $crate::board::Board>::after_reset();
            type Line = <$board as $crate::board::Board>::Interrupt;
            let core = cortex_m::Peripherals::take().expect("taken once");
            let lines = $crate::executors::InterruptLines {
                control: Line::$control,
                comms: Line::$comms,
                housekeeping: Line::$housekeeping,
                sampling: None::<Line>$(.or(Some(Line::$sampling)))?,
                aiding: None::<Line>$(.or(Some(Line::$aiding)))?,
                logging: None::<Line>$(.or(Some(Line::$logging)))?,
            };
            $crate::run(
                core,
                lines,
                spawn_sampling,
                spawn_aiding,
                spawn_control,
                spawn_comms,
                spawn_parameters,
                spawn_logging,
            )
        }
    };
}
