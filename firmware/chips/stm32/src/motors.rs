//! Drives up to four motors on the channels of a timer: by DSHOT, sent by DMA, or by pulses. A board has one or more
//! timers for its motors, each with a task that [runs](Motors::run) it. Where DMA reaches the pins' port, motor
//! controllers can [answer](crate::answers) on the same lines.

pub use afbc_flight_core::numbering::{self, rotors_of_outputs};
pub use afbc_flight_core::protocol::MotorProtocol;

use crate::answers::{Lines, sample_counts};
use afbc_flight_core::dshot::{DshotRate, Timing};
use afbc_flight_core::protocol::MotorSignal;
use afbc_flight_core::pulse::{PulseFormat, PulseTiming};
use afbc_flight_core::timer_clock::TimerClock;
use core::cell::Cell;
use embassy_stm32::dma::word::Word;
use embassy_stm32::dma::{self, ChannelInstance};
use embassy_stm32::gpio::OutputType;
use embassy_stm32::interrupt::typelevel::Binding;
use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::pac::gpio::vals::Moder;
use embassy_stm32::timer::low_level::{CountingMode, OutputCompareMode, OutputPolarity, Timer};
use embassy_stm32::timer::simple_pwm::PwmPin;
use embassy_stm32::timer::{Ch1, Ch2, Ch3, Ch4, Channel, GeneralInstance4Channel, TimerChannel, TimerPin, UpDma};
use embassy_stm32::{Peri, rcc};
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Instant, with_deadline};
use firmware::escs;
use firmware::vehicle::ROTORS;

/// Largest number of motors per timer.
pub const CHANNELS: usize = 4;
/// Rows of a frame: sixteen bits and one row without a pulse.
const FRAME_ROWS: usize = 17;
/// All channels of a timer.
const EACH: [Channel; CHANNELS] = [Channel::Ch1, Channel::Ch2, Channel::Ch3, Channel::Ch4];
/// Longest transfer of a frame to the motors before it is aborted \[us\].
const TRANSFER_MAX_US: u64 = 2_000;

/// Newest throttles for a timer's task: 0, or 48 to 2047; 0 where there is no motor.
pub type Throttles = Signal<CriticalSectionRawMutex, [u16; CHANNELS]>;

/// Protocol of all motors, and true if their controllers answer.
static PROTOCOL: CriticalSectionMutex<Cell<(MotorProtocol, bool)>> =
    CriticalSectionMutex::new(Cell::new((MotorProtocol::Dshot600, false)));

/// Sets the protocol of all motors, and whether controllers on lines with reception answer. Must be called before the
/// first throttles.
pub fn set_protocol(protocol: MotorProtocol, answers: bool) {
    PROTOCOL.lock(|cell| cell.set((protocol, answers)));
}

/// Waveform of a frame: a row per bit and a column per channel. A DMA burst of four columns must not cross a 1 KiB
/// boundary.
// One row more than a frame: after its transfer, the last bit has ended.
#[repr(align(16))]
struct Rows<W>([[W; CHANNELS]; FRAME_ROWS + 1]);

/// Motors of a timer. `W` is `u16`, or `u32` on a 32-bit timer, where a narrower store would fill both halves of the
/// register.
pub struct Motors<T: GeneralInstance4Channel, D: UpDma<T>, I, W, A = ()> {
    timer: Timer<'static, T>,
    /// Pins of the motors. They are kept, since a dropped pin is no longer an output.
    _pins: Pins<T>,
    clock: TimerClock,
    dma: Peri<'static, D>,
    irqs: I,
    rows: Rows<W>,
    /// Lines on which the controllers answer; `()` without answers.
    answers: A,
}

type Pins<T> = (
    Option<PwmPin<'static, T, Ch1>>,
    Option<PwmPin<'static, T, Ch2>>,
    Option<PwmPin<'static, T, Ch3>>,
    Option<PwmPin<'static, T, Ch4>>,
);

impl<T, D, I, W> Motors<T, D, I, W>
where
    T: GeneralInstance4Channel,
    D: UpDma<T> + ChannelInstance,
    I: Binding<D::Interrupt, dma::InterruptHandler<D>> + Copy,
    W: Word + From<u16> + Into<T::Word>,
{
    /// Sets up a timer and its pins, low; a channel without a [`pin`] has no motor. Must be called at the start.
    ///
    /// # Panics
    /// If the timer's clock is out of range.
    pub fn new(
        timer: Peri<'static, T>,
        first: Option<PwmPin<'static, T, Ch1>>,
        second: Option<PwmPin<'static, T, Ch2>>,
        third: Option<PwmPin<'static, T, Ch3>>,
        fourth: Option<PwmPin<'static, T, Ch4>>,
        dma: Peri<'static, D>,
        irqs: I,
    ) -> Self {
        // `expect` is not used, since printing the error would take a tenth of the flash.
        let Ok(clock) = TimerClock::new(rcc::frequency::<T>().0) else { panic!("the timer's clock is out of range") };
        let timer = Timer::new(timer);
        timer.set_counting_mode(CountingMode::EdgeAlignedUp);
        timer.enable_outputs();
        for channel in EACH {
            timer.set_output_compare_mode(channel, OutputCompareMode::PwmMode1);
            // A new value takes effect in the next period, so that a pulse in progress keeps its length.
            timer.set_output_compare_preload(channel, true);
        }
        timer.set_autoreload_preload(true);
        let rows = Rows([[W::from(0); CHANNELS]; FRAME_ROWS + 1]);
        Motors { timer, _pins: (first, second, third, fourth), clock, dma, irqs, rows, answers: () }
    }

    /// Sends each new set of throttles. A frame also requests telemetry from the motor controller of the rotor that is
    /// [asked](firmware::escs::asked), if a channel of this timer drives it. `rotors` are the channels' rotors.
    pub async fn run(&mut self, throttles: &Throttles, rotors: [Option<usize>; CHANNELS]) -> ! {
        // The protocol is set before the first throttles arrive.
        let first = throttles.wait().await;
        let (protocol, _) = PROTOCOL.lock(Cell::get);
        match protocol.signal() {
            MotorSignal::Frames(rate) => self.send_frames(rate, first, throttles, &rotors).await,
            MotorSignal::Pulses(format) => self.send_pulses(format, first, throttles).await,
        }
    }

    /// Adds the lines on which the controllers can answer; they answer if [`set_protocol`] says so.
    pub fn answering(self, lines: Lines) -> Motors<T, D, I, W, Lines> {
        let Motors { timer, _pins, clock, dma, irqs, rows, .. } = self;
        Motors { timer, _pins, clock, dma, irqs, rows, answers: lines }
    }
}

impl<T, D, I, W, A> Motors<T, D, I, W, A>
where
    T: GeneralInstance4Channel,
    D: UpDma<T> + ChannelInstance,
    I: Binding<D::Interrupt, dma::InterruptHandler<D>> + Copy,
    W: Word + From<u16> + Into<T::Word>,
{
    /// Starts the timer; its outputs stay low while the compare values are 0.
    fn start(&mut self, divider: u16, period: u16) {
        let registers = self.timer.regs_core();
        // The registers hold divider - 1 and period - 1.
        registers.psc().write_value(divider.saturating_sub(1));
        registers.arr().write(|reload| reload.set_arr(period.saturating_sub(1)));
        for channel in EACH {
            self.timer.enable_channel(channel, true);
        }
        // Loads the registers from their preload registers.
        self.timer.generate_update_event();
        self.timer.start();
    }

    async fn send_frames(
        &mut self,
        rate: DshotRate,
        first: [u16; CHANNELS],
        throttles: &Throttles,
        rotors: &[Option<usize>; CHANNELS],
    ) -> ! {
        let timing = Timing::new(self.clock, rate);
        self.start(1, timing.period());
        let mut newest = first;
        loop {
            encode(&timing, newest, asked_channel(rotors), &mut self.rows);
            self.send_rows(FRAME_ROWS).await;
            newest = throttles.wait().await;
        }
    }

    /// Sends the first `count` rows; a frame to each motor takes 28 us at 600 kbit/s.
    async fn send_rows(&mut self, count: usize) {
        let rows = self.rows.0.get(..count).unwrap_or_default().as_flattened();
        let dma = self.dma.reborrow();
        self.timer.enable_update_dma(true);
        let transfer = self.timer.setup_update_dma_burst(dma, self.irqs, Channel::Ch1, Channel::Ch4, rows);
        // The addition wraps, because an overflow check (after 585,000 years) would be a panic.
        let deadline = Instant::from_micros(Instant::now().as_micros().wrapping_add(TRANSFER_MAX_US));
        if with_deadline(deadline, transfer).await.is_err() {
            // The next frame sets up the DMA again.
            defmt::warn!("the motors' DMA transfer has stopped");
        }
        // The timer runs on, and each of its updates would request a transfer.
        self.timer.enable_update_dma(false);
    }

    async fn send_pulses(&mut self, format: PulseFormat, first: [u16; CHANNELS], throttles: &Throttles) -> ! {
        let timing = PulseTiming::new(self.clock, format);
        self.start(timing.divider(), timing.period());
        let mut newest = first;
        loop {
            self.set_compare_values(newest.map(|throttle| timing.compare(throttle)));
            if format.is_one_shot {
                // Start the pulses now; the zeros, loaded at the end of the period, prevent further pulses.
                self.timer.generate_update_event();
                self.set_compare_values([0; CHANNELS]);
            }
            newest = throttles.wait().await;
        }
    }

    /// Sets the compare values for the time after the next update event.
    fn set_compare_values(&mut self, values: [u16; CHANNELS]) {
        for (channel, value) in EACH.into_iter().zip(values) {
            self.timer.set_compare_value(channel, W::from(value).into());
        }
    }
}

impl<T, D, I, W> Motors<T, D, I, W, Lines>
where
    T: GeneralInstance4Channel,
    D: UpDma<T> + ChannelInstance,
    I: Binding<D::Interrupt, dma::InterruptHandler<D>> + Copy,
    W: Word + From<u16> + Into<u32> + Into<T::Word>,
{
    /// Sends like [`Motors::run`], and passes the controllers' answers to [`answered`](firmware::escs::answered).
    pub async fn exchange(&mut self, throttles: &Throttles, rotors: [Option<usize>; CHANNELS]) -> ! {
        let first = throttles.wait().await;
        let (protocol, answers) = PROTOCOL.lock(Cell::get);
        match protocol.signal() {
            // Answers are received only if a rotor of the vehicle is on this timer.
            MotorSignal::Frames(rate) if answers && rotors.iter().flatten().any(|rotor| *rotor < ROTORS) => {
                self.exchange_frames(rate, first, throttles, &rotors).await
            }
            MotorSignal::Frames(rate) => self.send_frames(rate, first, throttles, &rotors).await,
            MotorSignal::Pulses(format) => self.send_pulses(format, first, throttles).await,
        }
    }

    /// Sends frames and receives the controllers' answers.
    async fn exchange_frames(
        &mut self,
        rate: DshotRate,
        first: [u16; CHANNELS],
        throttles: &Throttles,
        rotors: &[Option<usize>; CHANNELS],
    ) -> ! {
        let timing = Timing::new(self.clock, rate);
        let sample_counts = sample_counts(self.clock, rate);
        // Bidirectional DSHOT idles high.
        EACH.iter().for_each(|channel| self.timer.set_output_polarity(*channel, OutputPolarity::ActiveLow));
        self.answers.pull_up();
        self.start(1, timing.period());
        let mut newest = first;
        loop {
            encode(&timing, newest, asked_channel(rotors), &mut self.rows);
            let [frame @ .., _] = &mut self.rows.0;
            timing.complement_checksums(frame);
            // Send the extra row, after which the frame's last bit has ended.
            self.send_rows(self.rows.0.len()).await;
            self.set_period(sample_counts);
            let is_sampled = self.sample().await;
            self.set_period(timing.period());
            // After a failed sampling, old samples would be taken for an answer to this frame.
            if is_sampled {
                for (channel, speed) in self.answers.speeds_rev_min() {
                    if let (Some(Some(rotor)), Some(speed)) = (rotors.get(channel), speed) {
                        escs::answered(*rotor, speed);
                    }
                }
            }
            newest = throttles.wait().await;
        }
    }

    /// Sets the time between two updates, effective at once.
    fn set_period(&mut self, counts: u16) {
        self.timer.regs_core().arr().write(|reload| reload.set_arr(counts.saturating_sub(1)));
        // An update event loads the register from its preload register.
        self.timer.generate_update_event();
    }

    /// Releases the lines and samples them, for 75 us at 600 kbit/s. Returns false if the sampling failed.
    #[expect(unsafe_code, reason = "DMA reads the port of the pins")]
    async fn sample(&mut self) -> bool {
        self.answers.let_go(true);
        let (port, samples) = self.answers.sampling();
        let request = self.dma.request();
        let mut channel = dma::Channel::new(self.dma.reborrow(), self.irqs);
        // Each update requests one transfer, instead of the burst that sends a row.
        self.timer.regs_gp16().dcr().modify(|burst| burst.set_dbl(0));
        self.timer.enable_update_dma(true);
        // SAFETY: the address belongs to a register that may be read at any time. Nothing else writes to the samples
        // during the transfer, which ends at the latest when it is dropped.
        let transfer = unsafe { channel.read(request, port, samples, dma::TransferOptions::default()) };
        let deadline = Instant::from_micros(Instant::now().as_micros().wrapping_add(TRANSFER_MAX_US));
        let is_sampled = with_deadline(deadline, transfer).await.is_ok();
        if !is_sampled {
            defmt::warn!("the sampling of the motors' lines has stopped");
        }
        self.timer.enable_update_dma(false);
        self.answers.let_go(false);
        is_sampled
    }
}

/// Returns the channel whose motor controller is asked for telemetry in the next frame.
fn asked_channel(rotors: &[Option<usize>; CHANNELS]) -> Option<usize> {
    let channel = |rotor| rotors.iter().position(|other| *other == Some(rotor));
    escs::asked(|rotor| channel(rotor).is_some()).and_then(channel)
}

/// Makes the output pin of a motor's channel, low.
pub fn pin<T: GeneralInstance4Channel, C: TimerChannel>(
    pin: Peri<'static, impl TimerPin<T, C>>,
) -> Option<PwmPin<'static, T, C>> {
    Some(PwmPin::new(pin, OutputType::PushPull))
}

/// Returns the throttle of each output. `rotors` has the rotor index of each output; an output whose rotor the vehicle
/// lacks gets 0.
pub fn of_outputs<const OUTPUTS: usize>(rotors: &[usize; OUTPUTS], throttles: &[u16]) -> [u16; OUTPUTS] {
    rotors.map(|rotor| throttles.get(rotor).copied().unwrap_or(0))
}

/// Returns the throttle of each channel of a timer. `motors` has the output number of each channel, counted from 1;
/// number 0 gets throttle 0.
pub fn of_channels(motors: [usize; CHANNELS], outputs: &[u16]) -> [u16; CHANNELS] {
    motors.map(|motor| motor.checked_sub(1).and_then(|at| outputs.get(at)).copied().unwrap_or(0))
}

/// Returns the rotor of each channel of a timer. `motors` has the output number of each channel, counted from 1; number
/// 0 has no rotor.
pub fn rotors_of_channels(motors: [usize; CHANNELS], rotors: &[usize]) -> [Option<usize>; CHANNELS] {
    motors.map(|motor| motor.checked_sub(1).and_then(|at| rotors.get(at)).copied())
}

/// Encodes a frame for each channel. Not inlined, like the control tick, so that its instructions can be counted.
#[inline(never)]
fn encode<W: Copy + From<u16>>(timing: &Timing, throttles: [u16; CHANNELS], asked: Option<usize>, rows: &mut Rows<W>) {
    let [frame @ .., _] = &mut rows.0;
    timing.rows(throttles, asked, frame);
}

/// Holds pins of a port low, in any state of the program. Motor controllers then stop by themselves.
pub fn hold_low(port: Gpio, pins: impl IntoIterator<Item = usize>) {
    // The pins become plain outputs; the port's output register is 0 since start-up.
    port.moder().modify(|mode| pins.into_iter().for_each(|pin| mode.set_moder(pin, Moder::OUTPUT)));
}
