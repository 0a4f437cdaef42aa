//! Links, motors and watchdog of an STM32H743VI with the pins of the Matek H743; `docs/boards/stm32h743.md` shows
//! the wiring.
//!
//! | what | where |
//! |---|---|
//! | crystal | 8 MHz on PH0, PH1 |
//! | first link | UART7: TX on PE8, RX on PE7 |
//! | second link | USART1: TX on PA9, RX on PA10 |
//! | third link | USB: D- on PA11, D+ on PA12 |
//! | motors 1 to 4 (S3 to S6) | TIM5, channels 1 to 4: PA0, PA1, PA2, PA3; driven by DMA1's stream 0 |
//! | motors 5 to 8 (S7 to S10) | TIM4, channels 1 to 4: PD12, PD13, PD14, PD15; driven by DMA1's stream 1 |
//! | memory | `memory.x` beside this folder |
//! | parameters | sectors 0 and 1 of the flash's second bank |
//! | first IMU | ICM-42688-P, SPI1: SCK PA5, MISO PA6, MOSI PD7, select PC15, interrupt PB2; turned by 180 degrees |
//! | second IMU | ICM-42605, SPI4: SCK PE12, MISO PE13, MOSI PE14, select PC13, interrupt PE15; turned by 270 degrees |
//! | barometer | DPS310 on I2C2 at 0x76: SCL on PB10, SDA on PB11 |
//! | compass | QMC5883L on I2C1, outside: SCL on PB6, SDA on PB7 |
//! | battery | voltage on PC0, current on PC1: ADC1 |
//! | GNSS receiver | u-blox or NMEA on USART2, outside: TX on PD5, RX on PD6 |
//! | motor controllers' telemetry | RX of UART8: PE0 (pad Rx8); its TX, PE1, sends nothing |
//! | memory card | SDMMC1: CK on PC12, CMD on PD2, D0 to D3 on PC8, PC9, PC10, PC11; it reaches the AXI RAM by itself |
//! | LED, blue | PE3, lit if low |
//! | buzzer | PA15: TIM2, channel 1 |

use crate::sensors::{Aids, Imus};
use afbc_drivers::battery::BatteryScale;
use afbc_drivers::dps310::Dps310;
use afbc_drivers::icm426xx::{Icm42605, Icm42688p};
use afbc_drivers::qmc5883l::Qmc5883l;
use afbc_drivers::{Driver, I2cRegisters, SensorPart, SpiRegisters};
use chip_stm32::answers::Lines;
use chip_stm32::battery::BatteryConverter;
use chip_stm32::indicator::{Led, PassiveBuzzer};
use chip_stm32::line::Line;
use chip_stm32::link::{self, Receiver, Transmitter};
use chip_stm32::motors::{CHANNELS, MotorProtocol, Motors, Throttles, hold_low, pin, set_protocol};
use chip_stm32::sd_card::{self, SdCardLog};
use chip_stm32::sensors::{Device, InterruptPin, Interrupted, Polled, StampHandler, interrupted};
use chip_stm32::{crystal, escs, faults, usb, watchdog};
use chip_stm32h7::flash::WordFlash;
use chip_stm32h7::{boot_loader, clocks, reset};
use embassy_executor::SendSpawner;
use embassy_stm32::adc::{Adc, SampleTime};
use embassy_stm32::i2c::{self, I2c};
use embassy_stm32::interrupt::typelevel::{EXTI2, EXTI15_10};
use embassy_stm32::interrupt::{self, Interrupt, InterruptExt, Priority};
use embassy_stm32::peripherals::{
    DMA1_CH0, DMA1_CH1, DMA1_CH2, DMA1_CH3, DMA1_CH4, DMA1_CH5, DMA1_CH6, DMA1_CH7, DMA2_CH0, DMA2_CH1, I2C1, I2C2,
    IWDG1, SDMMC1, TIM2, TIM4, TIM5, UART7, UART8, USART1, USART2, USB_OTG_FS,
};
use embassy_stm32::sdmmc::{self, Sdmmc};
use embassy_stm32::spi::Spi;
use embassy_stm32::usart::{self, BufferedUart};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{bind_interrupts, dma, exti, pac};
use firmware::board::{Board, BoardLink, Parts, ROTORS_MAX};
use firmware::executors::{self, priority};
use static_cell::StaticCell;

/// Frequency of the crystal \[Hz\].
const CRYSTAL_HZ: u32 = 8_000_000;
/// Clock of the IMUs' SPI buses \[Hz\], an eighth of their kernel clock. The parts allow 24 MHz.
const SPI_HZ: u32 = 12_500_000;
/// Interrupts of the IMUs and of their transfers. `AID_INTERRUPTS` has those of the other sensors.
const IMU_INTERRUPTS: [Interrupt; 6] = [
    Interrupt::DMA1_STREAM2,
    Interrupt::DMA1_STREAM3,
    Interrupt::DMA1_STREAM4,
    Interrupt::DMA1_STREAM5,
    Interrupt::EXTI2,
    Interrupt::EXTI15_10,
];
const AID_INTERRUPTS: [Interrupt; 8] = [
    Interrupt::DMA1_STREAM6,
    Interrupt::DMA1_STREAM7,
    Interrupt::DMA2_STREAM0,
    Interrupt::DMA2_STREAM1,
    Interrupt::I2C1_EV,
    Interrupt::I2C1_ER,
    Interrupt::I2C2_EV,
    Interrupt::I2C2_ER,
];
/// Number of motor outputs: the channels of two timers.
const OUTPUTS: usize = 2 * CHANNELS;

bind_interrupts!(struct Irqs {
    UART7 => usart::BufferedInterruptHandler<UART7>;
    USART1 => usart::BufferedInterruptHandler<USART1>;
    UART8 => usart::BufferedInterruptHandler<UART8>;
    DMA1_STREAM0 => dma::InterruptHandler<DMA1_CH0>;
    DMA1_STREAM1 => dma::InterruptHandler<DMA1_CH1>;
    USART2 => usart::BufferedInterruptHandler<USART2>;
    DMA1_STREAM2 => dma::InterruptHandler<DMA1_CH2>;
    DMA1_STREAM3 => dma::InterruptHandler<DMA1_CH3>;
    DMA1_STREAM4 => dma::InterruptHandler<DMA1_CH4>;
    DMA1_STREAM5 => dma::InterruptHandler<DMA1_CH5>;
    DMA2_STREAM0 => dma::InterruptHandler<DMA2_CH0>;
    DMA2_STREAM1 => dma::InterruptHandler<DMA2_CH1>;
    DMA1_STREAM6 => dma::InterruptHandler<DMA1_CH6>;
    DMA1_STREAM7 => dma::InterruptHandler<DMA1_CH7>;
    I2C1_EV => i2c::EventInterruptHandler<I2C1>;
    I2C1_ER => i2c::ErrorInterruptHandler<I2C1>;
    I2C2_EV => i2c::EventInterruptHandler<I2C2>;
    I2C2_ER => i2c::ErrorInterruptHandler<I2C2>;
    EXTI2 => StampHandler<EXTI2>, exti::InterruptHandler<EXTI2>;
    EXTI15_10 => StampHandler<EXTI15_10>, exti::InterruptHandler<EXTI15_10>;
    SDMMC1 => sdmmc::InterruptHandler<SDMMC1>;
    OTG_FS => embassy_stm32::usb::InterruptHandler<USB_OTG_FS>;
});

/// Ring buffers of the links and of the GNSS receiver.
static RX: [StaticCell<[u8; 1024]>; 3] = [const { StaticCell::new() }; 3];
static TX: [StaticCell<[u8; 1024]>; 3] = [const { StaticCell::new() }; 3];
/// Ring buffers of the ESC telemetry line.
static ESCS_RX: StaticCell<[u8; escs::RX_RING]> = StaticCell::new();
static ESCS_TX: StaticCell<[u8; escs::TX_RING]> = StaticCell::new();

/// Newest throttles, one signal for each motor task.
static THROTTLES: [Throttles; 2] = [const { Throttles::new() }; 2];

/// Returns the driver of an IMU with its interrupt pin.
fn imu<P: SensorPart>(part: P, device: Device, ready: InterruptPin) -> Driver<P, SpiRegisters<Device>, Interrupted> {
    Driver::new(part, SpiRegisters::new(device, P::SPI.expect("an IMU on SPI")), interrupted(ready))
}

/// The board after start-up.
pub(crate) struct Stm32h743 {
    watchdog: IndependentWatchdog<'static, IWDG1>,
}

impl Board for Stm32h743 {
    type Interrupt = pac::Interrupt;
    type Sampler = Imus;
    type Aids = Aids;
    type Links = [BoardLink<Receiver, Transmitter>; 3];
    type Log = SdCardLog;
    type Memory = WordFlash;
    const CORE_HZ: u32 = clocks::CORE_HZ;
    const STORE: u32 = 0;
    const HARDWARE: &'static str = "stm32h743";
    const OUTPUTS: usize = OUTPUTS;
    const INDICATES: bool = true;
    const HAS_LOG: bool = true;
    const ESCS: bool = true;
    const ANSWERS: bool = true;
    const BOOT_LOADER: Option<fn() -> !> = Some(boot_loader::restart);

    fn after_reset() {
        boot_loader::enter_if_wanted();
    }

    fn start(core: &mut cortex_m::Peripherals, control: SendSpawner) -> Parts<Self> {
        let mut p = clocks::start::<CRYSTAL_HZ>(&mut core.SCB);
        reset::log();

        let [tx, tx2, tx3] = TX.each_ref().map(|ring| ring.init([0; 1024]));
        let [rx, rx2, rx3] = RX.each_ref().map(|ring| ring.init([0; 1024]));
        let receiving = [Line::of(p.PE7.reborrow()), Line::of(p.PA10.reborrow())];
        let first = BufferedUart::new(p.UART7, p.PE7, p.PE8, tx, rx, Irqs, link::config());
        let second = BufferedUart::new(p.USART1, p.PA10, p.PA9, tx2, rx2, Irqs, link::config());
        let [first, second] = [first, second].map(|uart| uart.expect("the UART should run at this baud rate"));
        let [first_rx, second_rx] = receiving;
        let (first, second) = (link::inverting(first, first_rx), link::inverting(second, second_rx));
        let links = [first, second, link::of_usb(usb::start(p.USB_OTG_FS, p.PA12, p.PA11, Irqs))];
        interrupt::UART7.set_priority(Priority::from(priority::UART));
        interrupt::USART1.set_priority(Priority::from(priority::UART));

        let (tx, rx) = (ESCS_TX.init([0; escs::TX_RING]), ESCS_RX.init([0; escs::RX_RING]));
        let line = BufferedUart::new(p.UART8, p.PE0, p.PE1, tx, rx, Irqs, escs::config());
        let line = line.expect("the UART should run at this baud rate");
        interrupt::UART8.set_priority(Priority::from(priority::UART));
        executors::housekeeping().spawn(executors::once(escs::listen(line)));

        let config = chip_stm32::sensors::spi(SPI_HZ);
        let first = Spi::new(p.SPI1, p.PA5, p.PD7, p.PA6, p.DMA1_CH3, p.DMA1_CH2, Irqs, config);
        let second = Spi::new(p.SPI4, p.PE12, p.PE14, p.PE13, p.DMA1_CH5, p.DMA1_CH4, Irqs, config);
        let receiver = BufferedUart::new(p.USART2, p.PD6, p.PD5, tx3, rx3, Irqs, link::uart());
        let inside_lines = [Line::of(p.PB10.reborrow()), Line::of(p.PB11.reborrow())];
        let outside_lines = [Line::of(p.PB6.reborrow()), Line::of(p.PB7.reborrow())];
        let config = chip_stm32::sensors::i2c();
        let inside = I2c::new(p.I2C2, p.PB10, p.PB11, p.DMA2_CH0, p.DMA2_CH1, Irqs, config);
        let outside = I2c::new(p.I2C1, p.PB6, p.PB7, p.DMA1_CH6, p.DMA1_CH7, Irqs, config);
        let inside = chip_stm32::i2c::bus(inside, inside_lines, || chip_stm32h7::i2c::restart(pac::I2C2));
        let outside = chip_stm32::i2c::bus(outside, outside_lines, || chip_stm32h7::i2c::restart(pac::I2C1));
        let sampler = Imus {
            first: imu(Icm42688p {}, Device::new(first, p.PC15), InterruptPin::new(p.PB2, p.EXTI2, Irqs)),
            second: imu(Icm42605 {}, Device::new(second, p.PC13), InterruptPin::new(p.PE15, p.EXTI15, Irqs)),
        };
        let aids = Aids {
            compass: Driver::new(Qmc5883l, I2cRegisters::new(outside, 0x0D), Polled),
            barometer: Driver::new(Dps310::default(), I2cRegisters::new(inside, 0x76), Polled),
            battery: BatteryConverter::new(
                Adc::new(p.ADC1),
                p.PC0,
                p.PC1,
                // 16 bits is the ADC's resolution after a reset.
                (u16::MAX, |adc, pin| adc.blocking_read(pin, SampleTime::CYCLES387_5)),
                BatteryScale { volts_per_volt: 11.0, amperes_per_volt: 40.0 },
            ),
            receiver: receiver.expect("the UART should run at this baud rate"),
        };
        for line in IMU_INTERRUPTS {
            line.set_priority(Priority::from(priority::SAMPLING));
        }
        for line in AID_INTERRUPTS {
            line.set_priority(Priority::from(priority::AIDING));
        }
        interrupt::USART2.set_priority(Priority::from(priority::UART));

        let motors = Motors::new(p.TIM5, pin(p.PA0), pin(p.PA1), pin(p.PA2), pin(p.PA3), p.DMA1_CH0, Irqs);
        let motors = motors.answering(Lines::new(pac::GPIOA, [0, 1, 2, 3]));
        control.spawn(executors::once(motors_1_to_4(motors)));
        let motors = Motors::new(p.TIM4, pin(p.PD12), pin(p.PD13), pin(p.PD14), pin(p.PD15), p.DMA1_CH1, Irqs);
        let motors = motors.answering(Lines::new(pac::GPIOD, [12, 13, 14, 15]));
        control.spawn(executors::once(motors_5_to_8(motors)));
        interrupt::DMA1_STREAM0.set_priority(Priority::from(priority::MOTOR_DMA));
        interrupt::DMA1_STREAM1.set_priority(Priority::from(priority::MOTOR_DMA));

        let config = sdmmc::Config::default();
        let interface = Sdmmc::new_4bit(p.SDMMC1, Irqs, p.PC12, p.PD2, p.PC8, p.PC9, p.PC10, p.PC11, config);
        interrupt::SDMMC1.set_priority(Priority::from(priority::LOGGING));

        let (led, buzzer) = (Led::new(p.PE3), PassiveBuzzer::new(p.TIM2, p.PA15));
        executors::housekeeping().spawn(executors::once(indicator(led, buzzer)));

        // While a debugger halts the core, the watchdog is halted too.
        pac::DBGMCU.apb4fzr1().modify(|freeze| freeze.set_iwdg1(true));
        let board = Stm32h743 { watchdog: watchdog(p.IWDG1) };
        Parts { board, sampler, aids, links, memory: WordFlash::new(p.FLASH), log: sd_card::new(interface) }
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
        // Outputs without a motor stay at 0.
        let mut outputs = [[0; CHANNELS]; 2];
        outputs.as_flattened_mut().iter_mut().zip(throttles).for_each(|(output, throttle)| *output = *throttle);
        THROTTLES.iter().zip(outputs).for_each(|(throttles, outputs)| throttles.signal(outputs));
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.pet();
    }
}

#[embassy_executor::task]
async fn motors_1_to_4(mut motors: Motors<TIM5, DMA1_CH0, Irqs, u32, Lines>) {
    let [throttles, _] = &THROTTLES;
    motors.exchange(throttles, [0, 1, 2, 3].map(Some)).await
}

#[embassy_executor::task]
async fn motors_5_to_8(mut motors: Motors<TIM4, DMA1_CH1, Irqs, u16, Lines>) {
    let [_, throttles] = &THROTTLES;
    motors.exchange(throttles, [4, 5, 6, 7].map(Some)).await
}

#[embassy_executor::task]
async fn indicator(led: Led, buzzer: PassiveBuzzer<TIM2>) {
    chip_stm32::indicator::run(Some(led), buzzer).await
}

/// Stops the motors' signals in any state of the program.
pub(crate) fn stop_motors() {
    hold_low(pac::GPIOA, 0..=3);
    hold_low(pac::GPIOD, 12..=15);
}
