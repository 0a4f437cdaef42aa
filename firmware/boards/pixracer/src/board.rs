//! Pixracer, with an STM32F427VI; `docs/boards/pixracer.md` shows the wiring.
//!
//! | what | where |
//! |---|---|
//! | crystal | 24 MHz on PH0, PH1 |
//! | first link (TELEM1) | USART2: TX on PD5, RX on PD6 |
//! | second link (TELEM2) | USART3: TX on PD8, RX on PD9 |
//! | third link | USB: D- on PA11, D+ on PA12 |
//! | radio receiver (RCIN) | USART6: RX on PC7; PC13 switches the inverter before it |
//! | heater of the sensors | PC6, held low: off; also TX of USART6, which sends nothing |
//! | motors 1 to 4 | TIM1, channels 4 to 1: PE14, PE13, PE11, PE9; driven by DMA2's stream 5 |
//! | motors 5 and 6 | TIM4, channels 2 and 3: PD13, PD14; driven by DMA1's stream 6 |
//! | memory | `memory.x` beside this folder |
//! | parameters | sectors 1 and 2 of the flash |
//! | SPI of IMUs and compass | SPI1: SCK on PA5, MISO on PA6, MOSI on PA7 |
//! | first IMU | ICM-20608-G, select PC15, interrupt PC14 |
//! | second IMU | MPU-9250, select PC2, interrupt PD15 |
//! | compass | LIS3MDL, select PE15 |
//! | barometer | MS5611 on SPI2: SCK on PB10, MISO on PB14, MOSI on PB15, select PD7; with a memory, select PD10 |
//! | compass, outside | QMC5883L on I2C1: SCL on PB8, SDA on PB9 |
//! | GNSS receiver, outside | u-blox or NMEA on UART4: TX on PA0, RX on PA1 |
//! | battery | voltage on PA2, current on PA3: ADC1, by a power module |
//! | memory card | SDIO: CK on PC12, CMD on PD2, D0 to D3 on PC8, PC9, PC10, PC11; driven by DMA2's stream 6 |
//! | LED, green | PB1, open drain, lit if low |
//! | buzzer, without a tone of its own | PA15: TIM2, channel 1 |
//! | supply of the sensors | PE3, on if high |
//! | supply of 3.3 V of what is connected | PC5, on if high |

use crate::sensors::{Aids, Inside};
use afbc_drivers::battery::BatteryScale;
use afbc_drivers::ms5611::Ms5611;
use afbc_drivers::qmc5883l::Qmc5883l;
use afbc_drivers::{Driver, I2cRegisters, SensorPart, SpiRegisters};
use chip_stm32::battery::BatteryConverter;
use chip_stm32::indicator::{Led, PassiveBuzzer};
use chip_stm32::line::Line;
use chip_stm32::link::{self, RADIO_RINGS, Receiver, Transmitter};
use chip_stm32::motors::{
    MotorProtocol, Motors, Throttles, hold_low, numbering, of_channels, of_outputs, pin, rotors_of_outputs,
    set_protocol,
};
use chip_stm32::receiver::TX_RING;
use chip_stm32::sd_card::{self, SdCardLog};
use chip_stm32::sensors::{Device, InterruptPin, Polled, SELECT, StampHandler};
use chip_stm32::{crystal, faults, usb, watchdog};
use chip_stm32f4::converter::SLOWLY;
use chip_stm32f4::{boot_loader, clocks, reset};
use embassy_executor::SendSpawner;
use embassy_stm32::adc::Adc;
use embassy_stm32::flash::{Bank1Region1, Blocking, Flash};
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::i2c::{self, I2c};
use embassy_stm32::interrupt::typelevel::EXTI15_10;
use embassy_stm32::interrupt::{Interrupt, InterruptExt, Priority};
use embassy_stm32::peripherals::{
    DMA1_CH0, DMA1_CH3, DMA1_CH4, DMA1_CH6, DMA1_CH7, DMA2_CH0, DMA2_CH3, DMA2_CH5, DMA2_CH6, I2C1, IWDG, SDIO, SPI1,
    SPI2, TIM1, TIM2, TIM4, UART4, USART2, USART3, USART6, USB_OTG_FS,
};
use embassy_stm32::sdmmc::{self, Sdmmc};
use embassy_stm32::spi::Spi;
use embassy_stm32::usart::{self, BufferedUart};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{bind_interrupts, dma, exti, pac, rcc};
use firmware::board::{Board, BoardLink, Parts, ROTORS_MAX};
use firmware::executors::{self, priority};
use firmware::vehicle::CONFIGURATION;
use static_cell::StaticCell;

/// Frequency of the crystal \[Hz\].
const CRYSTAL_HZ: u32 = 24_000_000;
/// Number of motor outputs: four channels of TIM1 and two of TIM4.
const OUTPUTS: usize = 6;
/// Motor number of each timer channel, from 1; 0 for none.
const CHANNELS_OF_TIM1: [usize; 4] = [4, 3, 2, 1];
const CHANNELS_OF_TIM4: [usize; 4] = [0, 5, 6, 0];

bind_interrupts!(struct Irqs {
    USART2 => usart::BufferedInterruptHandler<USART2>;
    USART3 => usart::BufferedInterruptHandler<USART3>;
    UART4 => usart::BufferedInterruptHandler<UART4>;
    USART6 => usart::BufferedInterruptHandler<USART6>;
    DMA2_STREAM0 => dma::InterruptHandler<DMA2_CH0>;
    DMA2_STREAM3 => dma::InterruptHandler<DMA2_CH3>;
    DMA1_STREAM3 => dma::InterruptHandler<DMA1_CH3>;
    DMA1_STREAM4 => dma::InterruptHandler<DMA1_CH4>;
    I2C1_EV => i2c::EventInterruptHandler<I2C1>;
    I2C1_ER => i2c::ErrorInterruptHandler<I2C1>;
    DMA1_STREAM0 => dma::InterruptHandler<DMA1_CH0>;
    DMA1_STREAM7 => dma::InterruptHandler<DMA1_CH7>;
    DMA2_STREAM5 => dma::InterruptHandler<DMA2_CH5>;
    DMA1_STREAM6 => dma::InterruptHandler<DMA1_CH6>;
    SDIO => sdmmc::InterruptHandler<SDIO>;
    DMA2_STREAM6 => dma::InterruptHandler<DMA2_CH6>;
    EXTI15_10 => StampHandler<EXTI15_10>, exti::InterruptHandler<EXTI15_10>;
    OTG_FS => embassy_stm32::usb::InterruptHandler<USB_OTG_FS>;
});

/// Interrupts and their priorities.
const PRIORITIES: [(Interrupt, u8); 17] = [
    (Interrupt::USART2, priority::UART),
    (Interrupt::USART3, priority::UART),
    (Interrupt::UART4, priority::UART),
    (Interrupt::USART6, priority::UART),
    (Interrupt::DMA2_STREAM0, priority::SAMPLING),
    (Interrupt::DMA2_STREAM3, priority::SAMPLING),
    (Interrupt::EXTI15_10, priority::SAMPLING),
    (Interrupt::DMA1_STREAM3, priority::AIDING),
    (Interrupt::DMA1_STREAM4, priority::AIDING),
    (Interrupt::I2C1_EV, priority::AIDING),
    (Interrupt::I2C1_ER, priority::AIDING),
    (Interrupt::DMA1_STREAM0, priority::AIDING),
    (Interrupt::DMA1_STREAM7, priority::AIDING),
    (Interrupt::DMA2_STREAM5, priority::MOTOR_DMA),
    (Interrupt::DMA1_STREAM6, priority::MOTOR_DMA),
    (Interrupt::SDIO, priority::LOGGING),
    (Interrupt::DMA2_STREAM6, priority::LOGGING),
];

/// Ring buffers of the links and of the GNSS receiver.
static RX: [StaticCell<[u8; 1024]>; 3] = [const { StaticCell::new() }; 3];
static TX: [StaticCell<[u8; 1024]>; 2] = [const { StaticCell::new() }; 2];
static GNSS_TX: StaticCell<[u8; TX_RING]> = StaticCell::new();
static RADIO_TX: StaticCell<[u8; RADIO_RINGS[0]]> = StaticCell::new();
static RADIO_RX: StaticCell<[u8; RADIO_RINGS[1]]> = StaticCell::new();

/// Newest throttles, one signal for each motor task.
static THROTTLES: [Throttles; 2] = [const { Throttles::new() }; 2];

/// The board after start-up.
pub(crate) struct Pixracer {
    watchdog: IndependentWatchdog<'static, IWDG>,
    /// Index of the rotor at each output.
    rotors: [usize; OUTPUTS],
    /// Outputs held high: both supplies, and the chip select of the memory on the barometer's SPI, which stays
    /// deselected.
    _held: [Output<'static>; 3],
}

impl Board for Pixracer {
    type Interrupt = pac::Interrupt;
    type Sampler = Inside;
    type Aids = Aids;
    type Links = [BoardLink<Receiver, Transmitter>; 4];
    type Log = SdCardLog;
    type Memory = Bank1Region1<'static, Blocking>;
    const CORE_HZ: u32 = clocks::CORE_HZ;
    /// The parameters are in sectors 1 and 2, of 16 KiB each (`memory.x`), so they begin at 16 KiB.
    const STORE: u32 = 16 * 1024;
    const HARDWARE: &'static str = "pixracer";
    const OUTPUTS: usize = OUTPUTS;
    const INDICATES: bool = true;
    const RADIO_LINK: Option<usize> = Some(3);
    const HAS_LOG: bool = true;
    const BOOT_LOADER: Option<fn() -> !> = Some(boot_loader::restart);

    fn after_reset() {
        boot_loader::enter_if_wanted();
    }

    fn start(_core: &mut cortex_m::Peripherals, control: SendSpawner) -> Parts<Self> {
        let mut p = clocks::start::<CRYSTAL_HZ>();
        reset::log();
        for (line, priority) in PRIORITIES {
            line.set_priority(Priority::from(priority));
        }
        // The sensors must have their supply before a line to them is high.
        let held = [
            Output::new(p.PE3, Level::High, Speed::Low),
            Output::new(p.PC5, Level::High, Speed::Low),
            Output::new(p.PD10, Level::High, Speed::Low),
        ];

        let [tx, tx2] = TX.each_ref().map(|ring| ring.init([0; 1024]));
        let [rx, rx2, rx3] = RX.each_ref().map(|ring| ring.init([0; 1024]));
        let first = BufferedUart::new(p.USART2, p.PD6, p.PD5, tx, rx, Irqs, link::config());
        let second = BufferedUart::new(p.USART3, p.PD9, p.PD8, tx2, rx2, Irqs, link::config());
        let (tx, rx) = (RADIO_TX.init([0; RADIO_RINGS[0]]), RADIO_RX.init([0; RADIO_RINGS[1]]));
        link::invert_by(p.PC13);
        let heater = Line::of(p.PC6.reborrow());
        let radio = BufferedUart::new(p.USART6, p.PC7, p.PC6, tx, rx, Irqs, link::radio());
        // An idle TX would be high and switch the heater on.
        heater.hold_low();
        let uarts = [first, second, radio];
        let [first, second, radio] = uarts.map(|uart| link::new(uart.expect("the UART should run at this baud rate")));
        let links = [first, second, link::of_usb(usb::start(p.USB_OTG_FS, p.PA12, p.PA11, Irqs)), radio];
        let tx = GNSS_TX.init([0; TX_RING]);
        let receiver = BufferedUart::new(p.UART4, p.PA1, p.PA0, tx, rx3, Irqs, link::uart());

        let kernel_hz = rcc::frequency::<SPI1>().0;
        let config = chip_stm32::sensors::spi(kernel_hz / 256);
        let spi = Spi::new(p.SPI1, p.PA5, p.PA7, p.PA6, p.DMA2_CH3, p.DMA2_CH0, Irqs, config);
        let selects = [
            Output::new(p.PC15, Level::High, SELECT),
            Output::new(p.PC2, Level::High, SELECT),
            Output::new(p.PE15, Level::High, SELECT),
        ];
        let ready = [InterruptPin::new(p.PC14, p.EXTI14, Irqs), InterruptPin::new(p.PD15, p.EXTI15, Irqs)];
        let sampler = Inside { spi, kernel_hz, selects, ready };

        let kernel_hz = rcc::frequency::<SPI2>().0;
        let config = chip_stm32::sensors::spi(kernel_hz / 256);
        let spi = Spi::new(p.SPI2, p.PB10, p.PB15, p.PB14, p.DMA1_CH4, p.DMA1_CH3, Irqs, config);
        let format = Ms5611::SPI.expect("a part on SPI");
        let mut barometer = Device::new(spi, p.PD7);
        barometer.set_clock(kernel_hz, format.clock_hz);
        let lines = [Line::of(p.PB8.reborrow()), Line::of(p.PB9.reborrow())];
        let config = chip_stm32::sensors::i2c();
        let outside = I2c::new(p.I2C1, p.PB8, p.PB9, p.DMA1_CH7, p.DMA1_CH0, Irqs, config);
        let outside = chip_stm32::i2c::bus(outside, lines, || chip_stm32f4::i2c::restart(pac::I2C1));
        let aids = Aids {
            barometer: Driver::new(Ms5611::default(), SpiRegisters::new(barometer, format), Polled),
            compass: Driver::new(Qmc5883l, I2cRegisters::new(outside, 0x0D), Polled),
            receiver: receiver.expect("the UART should run at this baud rate"),
            // Scale of the common power module. The board's page lists another module's.
            battery: BatteryConverter::new(
                Adc::new(p.ADC1),
                p.PA2,
                p.PA3,
                SLOWLY,
                BatteryScale { volts_per_volt: 10.1, amperes_per_volt: 17.0 },
            ),
        };

        let interface = Sdmmc::new_4bit(
            p.SDIO,
            p.DMA2_CH6,
            Irqs,
            p.PC12,
            p.PD2,
            p.PC8,
            p.PC9,
            p.PC10,
            p.PC11,
            sdmmc::Config::default(),
        );

        let motors = Motors::new(p.TIM1, pin(p.PE9), pin(p.PE11), pin(p.PE13), pin(p.PE14), p.DMA2_CH5, Irqs);
        control.spawn(executors::once(motors_1_to_4(motors)));
        let motors = Motors::new(p.TIM4, None, pin(p.PD13), pin(p.PD14), None, p.DMA1_CH6, Irqs);
        control.spawn(executors::once(motors_5_and_6(motors)));

        let (led, buzzer) = (Led::new(p.PB1), PassiveBuzzer::new(p.TIM2, p.PA15));
        executors::housekeeping().spawn(executors::once(indicator(led, buzzer)));

        // While a debugger halts the core, the watchdog is halted too.
        pac::DBGMCU.apb1fzr().modify(|freeze| freeze.set_iwdg(true));
        let rotors = rotors_of_outputs(numbering::ARDUPILOT, &CONFIGURATION.rotors);
        Parts {
            board: Pixracer { watchdog: watchdog(p.IWDG), rotors, _held: held },
            sampler,
            aids,
            links,
            memory: Flash::new_blocking(p.FLASH).into_blocking_regions().bank1_region1,
            log: sd_card::new(interface),
        }
    }

    fn set_motor_protocol(&mut self, protocol: MotorProtocol, answers: bool) {
        set_protocol(protocol, answers);
    }

    fn unleash_watchdog(&mut self) {
        self.watchdog.unleash();
    }

    /// Returns true if the crystal has failed and the chip's own oscillator has taken over.
    fn clock_has_failed(&self) -> bool {
        crystal::has_failed()
    }

    fn task_has_failed(&self) -> bool {
        faults::task_has_failed()
    }

    fn drive(&mut self, throttles: &[u16; ROTORS_MAX]) {
        let outputs = of_outputs(&self.rotors, throttles);
        let [main, auxiliary] = &THROTTLES;
        main.signal(of_channels(CHANNELS_OF_TIM1, &outputs));
        auxiliary.signal(of_channels(CHANNELS_OF_TIM4, &outputs));
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.pet();
    }
}

#[embassy_executor::task]
async fn motors_1_to_4(mut motors: Motors<TIM1, DMA2_CH5, Irqs, u16>) {
    let [throttles, _] = &THROTTLES;
    // No telemetry line is connected for these motors.
    motors.run(throttles, [None; 4]).await
}

#[embassy_executor::task]
async fn motors_5_and_6(mut motors: Motors<TIM4, DMA1_CH6, Irqs, u16>) {
    let [_, throttles] = &THROTTLES;
    // No telemetry line is connected for these motors.
    motors.run(throttles, [None; 4]).await
}

#[embassy_executor::task]
async fn indicator(led: Led, buzzer: PassiveBuzzer<TIM2>) {
    chip_stm32::indicator::run(Some(led), buzzer).await
}

/// Stops the motors' signals in any state of the program.
pub(crate) fn stop_motors() {
    hold_low(pac::GPIOE, [9, 11, 13, 14]);
    hold_low(pac::GPIOD, [13, 14]);
}
