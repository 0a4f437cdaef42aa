//! Link, motors and watchdog of the STM32F405RG; `docs/boards/stm32f405.md` shows the wiring.
//!
//! | what | where |
//! |---|---|
//! | crystal | 8 MHz on PH0, PH1 |
//! | first link | USART1: TX on PA9, RX on PA10 |
//! | second link | USB: D- on PA11, D+ on PA12 |
//! | motors 1 to 4 | TIM8, channels 1 to 4: PC6, PC7, PC8, PC9; driven by DMA2's stream 1 |
//! | memory | `memory.x` at the workspace's root |
//! | parameters | sectors 1 and 2 of the flash |
//! | sensors | none yet, so no alignment: the state comes over the link |

use chip_stm32::link::{self, Receiver, Transmitter};
use chip_stm32::motors::{CHANNELS, MotorProtocol, Motors, Throttles, hold_low, pin, set_protocol};
use chip_stm32::{crystal, faults, usb, watchdog};
use chip_stm32f4::{boot_loader, clocks, reset};
use embassy_executor::SendSpawner;
use embassy_stm32::flash::{Bank1Region1, Blocking, Flash};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::peripherals::{DMA2_CH1, IWDG, TIM8, USART1, USB_OTG_FS};
use embassy_stm32::usart::{self, BufferedUart};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{bind_interrupts, dma, pac};
use firmware::board::{Board, BoardLink, Parts, ROTORS_MAX};
use firmware::executors::{self, priority};
use firmware::samples::NoSensors;
use static_cell::StaticCell;

/// Frequency of the crystal \[Hz\].
const CRYSTAL_HZ: u32 = 8_000_000;

bind_interrupts!(struct Irqs {
    USART1 => usart::BufferedInterruptHandler<USART1>;
    DMA2_STREAM1 => dma::InterruptHandler<DMA2_CH1>;
    OTG_FS => embassy_stm32::usb::InterruptHandler<USB_OTG_FS>;
});

/// Ring buffers of the first link.
static RX: StaticCell<[u8; 1024]> = StaticCell::new();
static TX: StaticCell<[u8; 1024]> = StaticCell::new();

/// Newest throttles for the motor task.
static THROTTLES: Throttles = Throttles::new();

/// The board after start-up.
pub(crate) struct Stm32f405 {
    watchdog: IndependentWatchdog<'static, IWDG>,
}

impl Board for Stm32f405 {
    type Interrupt = pac::Interrupt;
    type Sampler = NoSensors;
    type Aids = NoSensors;
    type Links = [BoardLink<Receiver, Transmitter>; 2];
    type Log = firmware::logging::NoLog;
    type Memory = Bank1Region1<'static, Blocking>;
    const CORE_HZ: u32 = clocks::CORE_HZ;
    /// The parameters are in sectors 1 and 2, of 16 KiB each (`memory.x`), so they begin at 16 KiB.
    const STORE: u32 = 16 * 1024;
    const HARDWARE: &'static str = "stm32f405";
    /// The channels of one timer drive all motors.
    const OUTPUTS: usize = CHANNELS;
    const BOOT_LOADER: Option<fn() -> !> = Some(boot_loader::restart);

    fn after_reset() {
        boot_loader::enter_if_wanted();
    }

    fn start(_core: &mut cortex_m::Peripherals, control: SendSpawner) -> Parts<Self> {
        let p = clocks::start::<CRYSTAL_HZ>();
        reset::log();

        let (tx, rx) = (TX.init([0; 1024]), RX.init([0; 1024]));
        let uart = BufferedUart::new(p.USART1, p.PA10, p.PA9, tx, rx, Irqs, link::config());
        let link = link::new(uart.expect("the UART should run at this baud rate"));
        interrupt::USART1.set_priority(Priority::from(priority::UART));

        let motors = Motors::new(p.TIM8, pin(p.PC6), pin(p.PC7), pin(p.PC8), pin(p.PC9), p.DMA2_CH1, Irqs);
        interrupt::DMA2_STREAM1.set_priority(Priority::from(priority::MOTOR_DMA));
        control.spawn(executors::once(self::motors(motors)));

        // While a debugger halts the core, the watchdog is halted too.
        pac::DBGMCU.apb1fzr().modify(|freeze| freeze.set_iwdg(true));
        let board = Stm32f405 { watchdog: watchdog(p.IWDG) };
        Parts {
            board,
            sampler: NoSensors,
            aids: NoSensors,
            links: [link, link::of_usb(usb::start(p.USB_OTG_FS, p.PA12, p.PA11, Irqs))],
            memory: Flash::new_blocking(p.FLASH).into_blocking_regions().bank1_region1,
            log: firmware::logging::NoLog,
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
        // Outputs without a motor stay at 0.
        let mut outputs = [0; CHANNELS];
        outputs.iter_mut().zip(throttles).for_each(|(output, throttle)| *output = *throttle);
        THROTTLES.signal(outputs);
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.pet();
    }
}

#[embassy_executor::task]
async fn motors(mut motors: Motors<TIM8, DMA2_CH1, Irqs, u16>) {
    // No telemetry line is connected for these motors.
    motors.run(&THROTTLES, [None; CHANNELS]).await
}

/// Stops the motors' signals in any state of the program.
pub(crate) fn stop_motors() {
    hold_low(pac::GPIOC, 6..=9);
}
