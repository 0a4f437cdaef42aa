//! Builds a usual flight controller from a table of its pins.

/// Builds the image of a usual flight controller with an STM32F405 or a relative: implements
/// [`Board`](firmware::board::Board) for it. The program must be called `flight-` and the board's name, and its package
/// must have all of the dependencies.
///
/// * `escs` is the UART whose RX is wired to the motor controllers' telemetry, if there is one; its TX sends nothing.
/// * USB is on PA11 and PA12, as on every such chip.
/// * Each peripheral has the streams of its DMA, such as `DMA1_CH6` for stream 6, with their interrupts.
/// * The IMU's interrupt has a pin, the EXTI line of the pin's number, such as `EXTI5`, and the line's interrupt, such
///   as `EXTI9_5`.
/// * A radio receiver has its own UART as the last link, if there is one to spare. An SBUS receiver is on the pad named
///   there. The board has an inverter before that pad, since the chip has none. If the pad is also used for CRSF, a pin
///   switches the inverter: high for SBUS.
/// * IMU and barometer are [candidates](chip_stm32::candidates): the part that answers is read. The IMU's alignment is
///   one of `afbc_drivers::alignment`.
/// * The battery's voltage and current are on ADC pins, scaled by the board's divider and amplifier.
/// * The buzzer sounds while its pin is high; the LED, if there is one, is lit while its pin is low.
/// * The enable pin of the board's Bluetooth, if there is one, is held low: Bluetooth is not used and would transmit
///   near the radio receiver.
/// * The memory card for logs, if there is one, has its own SPI; `quiet` are the select pins of the other parts on it.
///   On a board without a card, a flash chip for logs has its own SPI.
/// * `motors` is the number of outputs and their [`numbering`](chip_stm32::motors::numbering). Each timer has a line
///   with the width of its registers, the DMA stream of its updates, and its channels 1 to 4. A channel has the motor's
///   pin, the same pin as port and number, and the number of the motor.
///
/// The compiler checks that a pin belongs to its peripheral and a stream to its direction, and that nothing is used
/// twice. The linker checks that no interrupt has two handlers. Priorities follow from the purpose of each interrupt.
#[macro_export]
macro_rules! flight_controller {
    (
        crystal_hz: $crystal_hz:literal,
        link: $link:ident { tx: $link_tx:ident, rx: $link_rx:ident },
        gnss: $gnss:ident { tx: $gnss_tx:ident, rx: $gnss_rx:ident },
        $(radio: $radio:ident {
            tx: $radio_tx:ident, rx: $radio_rx:ident, sbus: $sbus:literal $(, inverter: $inverter:ident)?
        },)?
        $(escs: $escs:ident { tx: $escs_tx:ident, rx: $escs_rx:ident },)?
        imu: $spi:ident {
            clock: $sck:ident, out: $mosi:ident, in: $miso:ident, select: $select:ident,
            dma: $spi_tx:ident by $spi_tx_line:ident, $spi_rx:ident by $spi_rx_line:ident,
            ready: $ready:ident on $exti:ident by $exti_line:ident,
            parts: $imu:ty, alignment: $alignment:ident
        },
        i2c: $i2c:ident {
            clock: $scl:ident, data: $sda:ident, interrupts: $event:ident, $error:ident,
            dma: $i2c_tx:ident by $i2c_tx_line:ident, $i2c_rx:ident by $i2c_rx_line:ident,
            barometer: $barometer:ty
        },
        battery: ADC1 {
            voltage: $voltage:ident, current: $current:ident,
            volts_per_volt: $volts_per_volt:literal, amperes_per_volt: $amperes_per_volt:literal
        },
        indicator: { $(led: $led:ident,)? buzzer: $buzzer:ident },
        $(bluetooth: $bluetooth:ident,)?
        $(card: $card:ident {
            clock: $card_sck:ident, out: $card_mosi:ident, in: $card_miso:ident, select: $card_select:ident,
            quiet: [$($quiet:ident),*]
        },)?
        $(flash: $flash:ident {
            clock: $flash_sck:ident, out: $flash_mosi:ident, in: $flash_miso:ident, select: $flash_select:ident
        },)?
        motors: $outputs:literal as $numbering:ident {
            $($task:ident: $timer:ident<$word:ty>, $dma:ident by $line:ident { $($channel:tt),+ },)+
        },
    ) => {
        use defmt_rtt as _;
        use embassy_stm32::interrupt::{self, InterruptExt, Priority};
        use embassy_stm32::{i2c, pac, peripherals, usart};

        embassy_stm32::bind_interrupts!(struct Irqs {
            $link => usart::BufferedInterruptHandler<peripherals::$link>;
            $gnss => usart::BufferedInterruptHandler<peripherals::$gnss>;
            $($radio => usart::BufferedInterruptHandler<peripherals::$radio>;)?
            $($escs => usart::BufferedInterruptHandler<peripherals::$escs>;)?
            $spi_tx_line => embassy_stm32::dma::InterruptHandler<peripherals::$spi_tx>;
            $spi_rx_line => embassy_stm32::dma::InterruptHandler<peripherals::$spi_rx>;
            $exti_line => chip_stm32::sensors::StampHandler<embassy_stm32::interrupt::typelevel::$exti_line>,
                embassy_stm32::exti::InterruptHandler<embassy_stm32::interrupt::typelevel::$exti_line>;
            $event => i2c::EventInterruptHandler<peripherals::$i2c>;
            $error => i2c::ErrorInterruptHandler<peripherals::$i2c>;
            $i2c_tx_line => embassy_stm32::dma::InterruptHandler<peripherals::$i2c_tx>;
            $i2c_rx_line => embassy_stm32::dma::InterruptHandler<peripherals::$i2c_rx>;
            $($line => embassy_stm32::dma::InterruptHandler<peripherals::$dma>;)+
            OTG_FS => embassy_stm32::usb::InterruptHandler<peripherals::USB_OTG_FS>;
        });

        /// Interrupts with their priorities.
        const PRIORITIES: &[(interrupt::Interrupt, u8)] = {
            use firmware::executors::priority;
            use interrupt::Interrupt;
            &[
                (Interrupt::$link, priority::UART),
                (Interrupt::$gnss, priority::UART),
                $((Interrupt::$radio, priority::UART),)?
                $((Interrupt::$escs, priority::UART),)?
                (Interrupt::$spi_tx_line, priority::SAMPLING),
                (Interrupt::$spi_rx_line, priority::SAMPLING),
                (Interrupt::$exti_line, priority::SAMPLING),
                (Interrupt::$event, priority::AIDING),
                (Interrupt::$error, priority::AIDING),
                (Interrupt::$i2c_tx_line, priority::AIDING),
                (Interrupt::$i2c_rx_line, priority::AIDING),
                $((Interrupt::$line, priority::MOTOR_DMA),)+
            ]
        };

        /// Number of links: a UART, USB, and the radio receiver's UART if there is one.
        const LINKS: usize = 2 $(+ { let _ = stringify!($radio); 1 })?;

        chip_stm32f4::flight_controller!(@image $(card $card)? $(flash $flash)?);
        chip_stm32::faults!(stop_motors);

        /// The board after start-up.
        struct FlightController {
            watchdog: embassy_stm32::wdg::IndependentWatchdog<'static, peripherals::IWDG>,
            /// Rotor index of each output.
            rotors: [usize; $outputs],
        }

        impl firmware::board::Board for FlightController {
            type Interrupt = pac::Interrupt;
            type Sampler = chip_stm32::sensor_set::Imu<$imu>;
            type Aids = chip_stm32::sensor_set::SlowSensors<$barometer>;
            type Links = [firmware::board::BoardLink<chip_stm32::link::Receiver, chip_stm32::link::Transmitter>; LINKS];
            type Log = chip_stm32f4::flight_controller!(@log $(card $card)? $(flash $flash)?);
            type Memory = embassy_stm32::flash::Bank1Region1<'static, embassy_stm32::flash::Blocking>;
            const CORE_HZ: u32 = chip_stm32f4::clocks::CORE_HZ;
            /// Size of sectors 1 and 2, of 16 KiB each (`memory.x`).
            const STORE: u32 = 16 * 1024;
            const OUTPUTS: usize = $outputs;
            const INDICATES: bool = true;
            const RADIO_LINK: Option<usize> = if LINKS > 2 { Some(2) } else { None };
            const ESCS: bool = {
                let escs: &[&str] = &[$(stringify!($escs))?];
                !escs.is_empty()
            };
            const HARDWARE: &'static str = env!("CARGO_BIN_NAME").split_at("flight-".len()).1;
            const SMALL_LOGS: bool = {
                let flash: &[&str] = &[$(stringify!($flash))?];
                !flash.is_empty()
            };
            const HAS_LOG: bool = {
                let storages: &[&str] = &[$(stringify!($card),)? $(stringify!($flash))?];
                !storages.is_empty()
            };
            const BOOT_LOADER: Option<fn() -> !> = Some(chip_stm32f4::boot_loader::restart);

            fn after_reset() {
                chip_stm32f4::boot_loader::enter_if_wanted();
            }

            fn start(
                _core: &mut cortex_m::Peripherals,
                control: embassy_executor::SendSpawner,
            ) -> firmware::board::Parts<Self> {
                use embassy_stm32::usart::BufferedUart;
                use static_cell::StaticCell;

                use chip_stm32::line::Line;
                use chip_stm32::receiver::TX_RING;

                // Ring buffers of the link's UART.
                static RINGS: [StaticCell<[u8; 1024]>; 2] = [const { StaticCell::new() }; 2];
                // The buffer has room for 15 ms at the fastest baud rate. With a larger buffer, less than a quarter of
                // a SpeedyBee F405 V4's RAM would be free.
                static GNSS_RX: StaticCell<[u8; 352]> = StaticCell::new();
                static GNSS_TX: StaticCell<[u8; TX_RING]> = StaticCell::new();

                let mut p = chip_stm32f4::clocks::start::<$crystal_hz>();
                chip_stm32f4::reset::log();
                for (line, priority) in PRIORITIES {
                    line.set_priority(Priority::from(*priority));
                }

                let [tx, rx] = RINGS.each_ref().map(|ring| ring.init([0; 1024]));
                let config = chip_stm32::link::config();
                let link = BufferedUart::new(p.$link, p.$link_rx, p.$link_tx, tx, rx, Irqs, config);
                let (tx, rx) = (GNSS_TX.init([0; TX_RING]), GNSS_RX.init([0; 352]));
                let config = chip_stm32::link::uart();
                let gnss = BufferedUart::new(p.$gnss, p.$gnss_rx, p.$gnss_tx, tx, rx, Irqs, config);

                $(
                    use chip_stm32::link::RADIO_RINGS;

                    static RADIO_TX: StaticCell<[u8; RADIO_RINGS[0]]> = StaticCell::new();
                    static RADIO_RX: StaticCell<[u8; RADIO_RINGS[1]]> = StaticCell::new();
                    let (tx, rx) = (RADIO_TX.init([0; RADIO_RINGS[0]]), RADIO_RX.init([0; RADIO_RINGS[1]]));
                    let config = chip_stm32::link::radio();
                    $(chip_stm32::link::invert_by(p.$inverter);)?
                    let radio = BufferedUart::new(p.$radio, p.$radio_rx, p.$radio_tx, tx, rx, Irqs, config);
                )?
                $(
                    static ESCS_RX: StaticCell<[u8; chip_stm32::escs::RX_RING]> = StaticCell::new();
                    static ESCS_TX: StaticCell<[u8; chip_stm32::escs::TX_RING]> = StaticCell::new();
                    let tx = ESCS_TX.init([0; chip_stm32::escs::TX_RING]);
                    let rx = ESCS_RX.init([0; chip_stm32::escs::RX_RING]);
                    let config = chip_stm32::escs::config();
                    let line = BufferedUart::new(p.$escs, p.$escs_rx, p.$escs_tx, tx, rx, Irqs, config);
                    let line = line.expect("the UART should run at this baud rate");
                    let task = firmware::executors::once(chip_stm32::escs::listen(line));
                    firmware::executors::housekeeping().spawn(task);
                )?

                let kernel_hz = embassy_stm32::rcc::frequency::<peripherals::$spi>().0;
                // The bus starts with its slowest clock. Each candidate sets its own clock.
                let config = chip_stm32::sensors::spi(kernel_hz / 256);
                let spi = embassy_stm32::spi::Spi::new(
                    p.$spi, p.$sck, p.$mosi, p.$miso, p.$spi_tx, p.$spi_rx, Irqs, config,
                );
                let device = chip_stm32::sensors::Device::new(spi, p.$select);
                let ready = chip_stm32::sensors::InterruptPin::new(p.$ready, p.$exti, Irqs);
                let lines = [Line::of(p.$scl.reborrow()), Line::of(p.$sda.reborrow())];
                let config = chip_stm32::sensors::i2c();
                let bus = i2c::I2c::new(p.$i2c, p.$scl, p.$sda, p.$i2c_tx, p.$i2c_rx, Irqs, config);
                let bus = chip_stm32::i2c::bus(bus, lines, || chip_stm32f4::i2c::restart(pac::$i2c));

                let battery = chip_stm32::battery::BatteryConverter::new(
                    embassy_stm32::adc::Adc::new(p.ADC1),
                    p.$voltage,
                    p.$current,
                    chip_stm32f4::converter::SLOWLY,
                    afbc_drivers::battery::BatteryScale {
                        volts_per_volt: $volts_per_volt,
                        amperes_per_volt: $amperes_per_volt,
                    },
                );

                let log = chip_stm32f4::flight_controller!(
                    @new_log p
                    $(, card $card, $card_sck, $card_mosi, $card_miso, $card_select, $($quiet),*)?
                    $(, flash $flash, $flash_sck, $flash_mosi, $flash_miso, $flash_select)?
                );

                $(
                    let motors = chip_stm32f4::flight_controller!(@motors p, $timer, $dma, $($channel),+);
                    control.spawn(firmware::executors::once($task::run(motors)));
                )+

                $(Line::of(p.$bluetooth).hold_low();)?
                let led = None$(.or(Some(chip_stm32::indicator::Led::new(p.$led))))?;
                let buzzer = chip_stm32::indicator::ActiveBuzzer::new(p.$buzzer);
                firmware::executors::housekeeping().spawn(firmware::executors::once(indicator(led, buzzer)));

                // A debugger that halts the core also halts the watchdog.
                pac::DBGMCU.apb1fzr().modify(|freeze| freeze.set_iwdg(true));
                let rotors = chip_stm32::motors::rotors_of_outputs(
                    chip_stm32::motors::numbering::$numbering,
                    &firmware::vehicle::CONFIGURATION.rotors,
                );
                firmware::board::Parts {
                    board: FlightController { watchdog: chip_stm32::watchdog(p.IWDG), rotors },
                    sampler: chip_stm32::sensor_set::Imu::new(
                        device,
                        ready,
                        kernel_hz,
                        afbc_drivers::alignment::$alignment,
                    ),
                    aids: chip_stm32::sensor_set::SlowSensors::new(
                        bus,
                        gnss.expect("the UART should run at this baud rate"),
                        battery,
                    ),
                    links: [
                        chip_stm32::link::new(link.expect("the UART should run at this baud rate")),
                        chip_stm32::link::of_usb(chip_stm32::usb::start(p.USB_OTG_FS, p.PA12, p.PA11, Irqs)),
                        $({
                            // The pad's name is for the board's documentation page; a test compares the page with this
                            // table.
                            let _: &str = $sbus;
                            chip_stm32::link::new(radio.expect("the UART should run at this baud rate"))
                        },)?
                    ],
                    memory: embassy_stm32::flash::Flash::new_blocking(p.FLASH).into_blocking_regions().bank1_region1,
                    log,
                }
            }

            fn set_motor_protocol(&mut self, protocol: chip_stm32::motors::MotorProtocol, answers: bool) {
                chip_stm32::motors::set_protocol(protocol, answers);
            }

            fn unleash_watchdog(&mut self) {
                self.watchdog.unleash();
            }

            /// Returns true if the crystal has failed and the internal oscillator has taken over.
            fn clock_has_failed(&self) -> bool {
                chip_stm32::crystal::has_failed()
            }

            fn task_has_failed(&self) -> bool {
                chip_stm32::faults::task_has_failed()
            }

            fn drive(&mut self, throttles: &[u16; firmware::board::ROTORS_MAX]) {
                let throttles = chip_stm32::motors::of_outputs(&self.rotors, throttles);
                $(
                    let motors = [$(chip_stm32f4::flight_controller!(@motor $channel)),+];
                    $task::THROTTLES.signal(chip_stm32::motors::of_channels(motors, &throttles));
                )+
            }

            fn feed_watchdog(&mut self) {
                self.watchdog.pet();
            }
        }

        $(
            mod $task {
                use embassy_stm32::peripherals::{$dma, $timer};

                /// Newest throttles for the task.
                pub(super) static THROTTLES: chip_stm32::motors::Throttles = chip_stm32::motors::Throttles::new();

                #[embassy_executor::task]
                pub(super) async fn run(mut motors: chip_stm32::motors::Motors<$timer, $dma, super::Irqs, $word>) {
                    let numbers = [$(chip_stm32f4::flight_controller!(@motor $channel)),+];
                    let rotors: [usize; $outputs] = chip_stm32::motors::rotors_of_outputs(
                        chip_stm32::motors::numbering::$numbering,
                        &firmware::vehicle::CONFIGURATION.rotors,
                    );
                    motors.run(&THROTTLES, chip_stm32::motors::rotors_of_channels(numbers, &rotors)).await
                }
            }
        )+

        #[embassy_executor::task]
        async fn indicator(led: Option<chip_stm32::indicator::Led>, buzzer: chip_stm32::indicator::ActiveBuzzer) -> ! {
            chip_stm32::indicator::run(led, buzzer).await
        }

        /// Stops the motors' signals, in any state of the program.
        fn stop_motors() {
            $($(chip_stm32f4::flight_controller!(@stop $channel);)+)+
        }
    };
    // The executors use the interrupts of CAN1 and CAN2, which this firmware does not need otherwise.
    (@image $storage:ident $bus:ident) => {
        firmware::image!(
            FlightController, control: CAN2_TX, comms: CAN2_RX0, housekeeping: CAN2_RX1, sampling: CAN1_TX,
            aiding: CAN1_RX0, logging: CAN1_RX1
        );
    };
    (@image) => {
        firmware::image!(
            FlightController, control: CAN2_TX, comms: CAN2_RX0, housekeeping: CAN2_RX1, sampling: CAN1_TX,
            aiding: CAN1_RX0
        );
    };
    (@log) => { firmware::logging::NoLog };
    (@log card $card:ident) => { chip_stm32::card::CardLog };
    (@log flash $flash:ident) => { chip_stm32::log_flash::FlashLog };
    (@new_log $p:ident) => { firmware::logging::NoLog };
    (
        @new_log $p:ident, card $card:ident, $sck:ident, $mosi:ident, $miso:ident, $select:ident, $($quiet:ident),*
    ) => {{
        $(
            // The pin is kept forever, since dropping it would make it an input again.
            core::mem::forget(embassy_stm32::gpio::Output::new(
                $p.$quiet,
                embassy_stm32::gpio::Level::High,
                embassy_stm32::gpio::Speed::Low,
            ));
        )*
        let kernel_hz = embassy_stm32::rcc::frequency::<peripherals::$card>().0;
        let config = chip_stm32::card::config(kernel_hz / 256);
        let spi = embassy_stm32::spi::Spi::new_blocking($p.$card, $p.$sck, $p.$mosi, $p.$miso, config);
        chip_stm32::card::new(spi, $p.$select, kernel_hz, chip_stm32f4::clocks::CORE_HZ)
    }};
    (@new_log $p:ident, flash $flash:ident, $sck:ident, $mosi:ident, $miso:ident, $select:ident) => {{
        let config = chip_stm32::log_flash::config(embassy_stm32::rcc::frequency::<peripherals::$flash>().0);
        let spi = embassy_stm32::spi::Spi::new_blocking($p.$flash, $p.$sck, $p.$mosi, $p.$miso, config);
        chip_stm32::log_flash::new(spi, $p.$select)
    }};
    (@motors $p:ident, $timer:ident, $dma:ident, $first:tt, $second:tt, $third:tt, $fourth:tt) => {
        chip_stm32::motors::Motors::new(
            $p.$timer,
            chip_stm32f4::flight_controller!(@pin $p, $first),
            chip_stm32f4::flight_controller!(@pin $p, $second),
            chip_stm32f4::flight_controller!(@pin $p, $third),
            chip_stm32f4::flight_controller!(@pin $p, $fourth),
            $p.$dma,
            Irqs,
        )
    };
    (@pin $p:ident, ()) => { None };
    (@pin $p:ident, ($pin:ident: $port:ident $number:literal, motor $motor:literal)) => {
        chip_stm32::motors::pin($p.$pin)
    };
    (@motor ()) => { 0 };
    (@motor ($pin:ident: $port:ident $number:literal, motor $motor:literal)) => { $motor };
    (@stop ()) => {};
    (@stop ($pin:ident: $port:ident $number:literal, motor $motor:literal)) => {
        chip_stm32::motors::hold_low(pac::$port, [$number])
    };
}
