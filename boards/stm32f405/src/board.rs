//! Link, motors and watchdog of the STM32F405RG; `docs/firmware.md` shows the wiring.
//!
//! | what | where |
//! |---|---|
//! | crystal | 8 MHz on PH0, PH1 ([`clocks`]) |
//! | link | USART1: TX on PA9, RX on PA10 |
//! | motors 1 to 4 | TIM8, channels 1 to 4: PC6, PC7, PC8, PC9; driven by DMA2's stream 1 |
//! | memory | `memory.x` at the workspace's root |
//! | parameters | sectors 1 and 2 of the flash |
//! | sensors | none yet, so no alignment: the state comes over the link |

use crate::{clocks, reset};
use afbc_flight_core::dshot::{BIT_RATE_HZ, Timing};
use core::future::poll_fn;
use core::pin::pin;
use core::sync::atomic::{AtomicBool, Ordering};
use core::task::{Poll, ready};
use embassy_executor::SendSpawner;
use embassy_futures::poll_once;
use embassy_stm32::flash::{Bank1Region1, Blocking, Flash};
use embassy_stm32::gpio::OutputType;
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::peripherals::{DMA2_CH1, IWDG, TIM8, USART1};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::Channel;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm};
use embassy_stm32::usart::{self, BufferedUart, BufferedUartRx, BufferedUartTx};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Peri, bind_interrupts, dma, pac};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Instant, with_deadline};
use embedded_io_async::{BufRead, Write};
use firmware::board::{self, Board, Link, Parts};
use firmware::executors::priority;
use firmware::ticks::Tick;
use firmware::vehicle::ROTORS;
use static_cell::StaticCell;

/// Parameters: sectors 1 and 2 of the flash, of 16 KiB each (`memory.x`).
const STORE: u32 = 16 * 1024;
/// Motors: the channels of one timer.
const OUTPUTS: usize = 4;
/// Bytes that wake the reader \[0.35 ms of a busy line\]. Fewer wake it when the line becomes idle, as after a message,
/// and it also runs after every control tick. Waking it for every byte would take most of the processor's time.
const READ_MIN: usize = 32;
/// The watchdog resets the chip if it is not fed for this long \[us\]: in fact 13.6 to 37.6 ms, since its oscillator's
/// nominal 32 kHz may be 17 to 47. Motor controllers stop sooner if the processor hangs, after some 20 ms without a
/// frame.
const WATCHDOG_US: u32 = 20_000;
/// Longest transfer of a frame to the motors before it is aborted \[us\].
const TRANSFER_MAX_US: u64 = 2_000;
/// Timers of the second peripheral bus run at the core's clock \[Hz\].
const MOTOR_TIMER_HZ: u32 = clocks::CORE_HZ;

bind_interrupts!(struct Irqs {
    USART1 => usart::BufferedInterruptHandler<USART1>;
    DMA2_STREAM1 => dma::InterruptHandler<DMA2_CH1>;
});

/// Ring buffers of the link.
static RX: StaticCell<[u8; 1024]> = StaticCell::new();
static TX: StaticCell<[u8; 1024]> = StaticCell::new();

/// Newest throttles, for the motors' task.
static THROTTLES: Signal<CriticalSectionRawMutex, [u16; OUTPUTS]> = Signal::new();

/// The board after start-up.
pub(crate) struct Stm32f405 {
    watchdog: IndependentWatchdog<'static, IWDG>,
}

impl Board for Stm32f405 {
    type Interrupt = pac::Interrupt;
    type Links = [Link<Receiver, Transmitter>; 1];
    type Memory = Bank1Region1<'static, Blocking>;
    const CORE_HZ: u32 = clocks::CORE_HZ;
    const STORE: u32 = STORE;
    const OUTPUTS: usize = OUTPUTS;

    fn start(control: SendSpawner) -> Parts<Self> {
        let p = clocks::start();
        reset::log();

        let mut config = usart::Config::default();
        config.eager_reads = Some(READ_MIN);
        let uart = BufferedUart::new(p.USART1, p.PA10, p.PA9, TX.init([0; 1024]), RX.init([0; 1024]), Irqs, config);
        let (transmitter, receiver) = uart.expect("the baud rate divides the clock").split();
        interrupt::USART1.set_priority(Priority::from(priority::UART));

        let pin = OutputType::PushPull;
        let pwm = SimplePwm::new(
            p.TIM8,
            Some(PwmPin::new(p.PC6, pin)),
            Some(PwmPin::new(p.PC7, pin)),
            Some(PwmPin::new(p.PC8, pin)),
            Some(PwmPin::new(p.PC9, pin)),
            Hertz(BIT_RATE_HZ),
            CountingMode::EdgeAlignedUp,
        );
        let motors = Motors {
            pwm,
            dma: p.DMA2_CH1,
            timing: Timing::new(MOTOR_TIMER_HZ).expect("the timer's clock is within its range"),
            rows: Rows([[0; OUTPUTS]; 17]),
        };
        interrupt::DMA2_STREAM1.set_priority(Priority::from(priority::MOTOR_DMA));
        control.spawn(self::motors(motors).expect("spawned once"));

        // A debugger that halts the core halts the watchdog.
        pac::DBGMCU.apb1fzr().modify(|freeze| freeze.set_iwdg(true));
        let watchdog = IndependentWatchdog::new(p.IWDG, WATCHDOG_US);
        let memory = Flash::new_blocking(p.FLASH).into_blocking_regions().bank1_region1;

        let link = Link { receiver: Receiver(receiver), transmitter: Transmitter(transmitter) };
        Parts { board: Stm32f405 { watchdog }, links: [link], memory }
    }

    fn unleash_watchdog(&mut self) {
        self.watchdog.unleash();
    }

    /// Sleeps until the next interrupt.
    fn idle() {
        cortex_m::asm::wfi();
    }

    /// True if the crystal has failed and the chip's own oscillator has taken over.
    fn clock_has_failed(&self) -> bool {
        clocks::have_failed()
    }

    fn task_has_failed(&self) -> bool {
        TASK_FAILED.load(Ordering::Relaxed)
    }

    fn drive(&mut self, throttles: [u16; ROTORS]) {
        // An output without a motor stays at 0.
        let mut outputs = [0; OUTPUTS];
        outputs.iter_mut().zip(throttles).for_each(|(output, throttle)| *output = throttle);
        THROTTLES.signal(outputs);
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.pet();
    }
}

/// The motors' waveform, with a row for each bit and a column for each motor. A DMA burst of four columns must not
/// cross 1 KiB.
#[repr(align(8))]
struct Rows([[u16; OUTPUTS]; 17]);

/// DSHOT600 on TIM8, channels 1 to 4, sent by DMA.
struct Motors {
    pwm: SimplePwm<'static, TIM8>,
    dma: Peri<'static, DMA2_CH1>,
    timing: Timing,
    rows: Rows,
}

impl Motors {
    /// Sends one frame to each motor; takes 28 us.
    async fn send(&mut self, throttles: [u16; OUTPUTS]) {
        encode(&self.timing, throttles, &mut self.rows);
        let rows = self.rows.0.as_flattened();
        let dma = self.dma.reborrow();
        let transfer = self.pwm.waveform_up_multi_channel(dma, Irqs, Channel::Ch1, Channel::Ch4, rows);
        // Wrapping, without a check for an overflow after 585,000 years that could panic.
        let deadline = Instant::from_micros(Instant::now().as_micros().wrapping_add(TRANSFER_MAX_US));
        if with_deadline(deadline, transfer).await.is_err() {
            // The next frame sets up the stream again.
            defmt::warn!("the motors' DMA transfer has stopped");
        }
    }
}

/// Encodes a frame for each motor. Out of line, like the control tick, to be counted.
#[inline(never)]
fn encode(timing: &Timing, throttles: [u16; OUTPUTS], rows: &mut Rows) {
    timing.rows(throttles, &mut rows.0);
}

#[embassy_executor::task]
async fn motors(mut motors: Motors) {
    loop {
        motors.send(THROTTLES.wait().await).await;
    }
}

/// Stops the motors' signals, whatever state the program is in. The motor controllers then stop by themselves.
pub(crate) fn stop_motors() {
    use pac::gpio::vals::Moder;
    // The pins become plain outputs, whose output register is 0 since start-up.
    pac::GPIOC.moder().modify(|mode| (6..=9).for_each(|pin| mode.set_moder(pin, Moder::OUTPUT)));
}

/// True if a task that is not needed in flight has panicked.
static TASK_FAILED: AtomicBool = AtomicBool::new(false);

/// Ends a task that is not needed in flight after its panic; everything of higher priority continues.
pub(crate) fn park() -> ! {
    TASK_FAILED.store(true, Ordering::Relaxed);
    loop {
        // The task may have panicked with interrupts disabled.
        #[expect(unsafe_code, reason = "it ends a critical section that is never returned to")]
        // SAFETY: the data that it protected is borrowed by try_borrow everywhere: the inbox, the ticks, the alarms.
        unsafe {
            cortex_m::interrupt::enable()
        };
        cortex_m::asm::wfi();
    }
}

/// Receiving side of the link.
pub(crate) struct Receiver(BufferedUartRx<'static>);

impl board::Receiver for Receiver {
    fn receive(&mut self, buffer: &mut [u8]) -> impl Future<Output = usize> {
        // A new read each time, since polling one that has ended would panic. An overrun loses bytes, which the decoder
        // notices.
        poll_fn(move |context| {
            let length = ready!(pin!(self.0.fill_buf()).poll(context)).map_or(0, |bytes| {
                buffer.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
                bytes.len().min(buffer.len())
            });
            self.0.consume(length);
            Poll::Ready(length)
        })
    }
}

/// Sending side of the link.
pub(crate) struct Transmitter(BufferedUartTx<'static>);

impl board::Transmitter for Transmitter {
    fn set_baud(&mut self, baud: u32) {
        if self.0.set_baudrate(baud).is_err() {
            defmt::warn!("{=u32} baud do not divide the clock", baud);
        }
    }

    /// Drops the bytes if the line is too far behind.
    fn transmit(&mut self, _tick: &Tick, bytes: &[u8]) {
        // Accepts all bytes or, if the ring is full, none; the driver does not wake those who wait for room.
        if !bytes.is_empty() {
            let _ = poll_once(self.0.write(bytes));
        }
    }
}
