//! DSHOT600 on up to four channels of a timer, sent by DMA. A board has one timer or more for its motors, each with a
//! task that [runs](Motors::run) it.

pub use afbc_flight_core::numbering::{self, rotors_of_outputs};

use afbc_flight_core::dshot::{BIT_RATE_HZ, Timing};
use embassy_stm32::dma::word::Word;
use embassy_stm32::dma::{self, ChannelInstance};
use embassy_stm32::gpio::OutputType;
use embassy_stm32::interrupt::typelevel::Binding;
use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::pac::gpio::vals::Moder;
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm};
use embassy_stm32::timer::{Ch1, Ch2, Ch3, Ch4, Channel, GeneralInstance4Channel, TimerChannel, TimerPin, UpDma};
use embassy_stm32::{Peri, rcc};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Instant, with_deadline};

/// Most motors of a timer.
pub const CHANNELS: usize = 4;
/// Longest transfer of a frame to the motors before it is aborted \[us\].
const TRANSFER_MAX_US: u64 = 2_000;

/// Newest throttles of a timer's motors, for its task: 0, or 48 to 2047; 0 where there is no motor.
pub type Throttles = Signal<CriticalSectionRawMutex, [u16; CHANNELS]>;

/// The waveform, with a row for each bit and a column for each channel. A DMA burst of four columns must not cross
/// 1 KiB.
#[repr(align(16))]
struct Rows<W>([[W; CHANNELS]; 17]);

/// Motors of a timer. `W` is `u16`, or `u32` on a timer of 32 bits: a narrower store would fill both halves of its
/// register.
pub struct Motors<T: GeneralInstance4Channel, D: UpDma<T>, I, W> {
    pwm: SimplePwm<'static, T>,
    dma: Peri<'static, D>,
    irqs: I,
    timing: Timing,
    rows: Rows<W>,
}

impl<T, D, I, W> Motors<T, D, I, W>
where
    T: GeneralInstance4Channel,
    D: UpDma<T> + ChannelInstance,
    I: Binding<D::Interrupt, dma::InterruptHandler<D>> + Copy,
    W: Word + From<u16> + Into<T::Word>,
{
    /// Sets up a timer and its pins, low; a channel without a [`pin`] is none. To be called at the start.
    ///
    /// # Panics
    /// If the timer's clock is out of DSHOT's range.
    pub fn new(
        timer: Peri<'static, T>,
        first: Option<PwmPin<'static, T, Ch1>>,
        second: Option<PwmPin<'static, T, Ch2>>,
        third: Option<PwmPin<'static, T, Ch3>>,
        fourth: Option<PwmPin<'static, T, Ch4>>,
        dma: Peri<'static, D>,
        irqs: I,
    ) -> Self {
        let counting = CountingMode::EdgeAlignedUp;
        let pwm = SimplePwm::new(timer, first, second, third, fourth, Hertz(BIT_RATE_HZ), counting);
        // Not `expect`: to print the error would take a tenth of the flash.
        let Ok(timing) = Timing::new(rcc::frequency::<T>().0) else { panic!("the timer's clock is out of range") };
        Motors { pwm, dma, irqs, timing, rows: Rows([[W::from(0); CHANNELS]; 17]) }
    }

    /// Sends a frame for each new set of throttles.
    pub async fn run(&mut self, throttles: &Throttles) -> ! {
        loop {
            self.send(throttles.wait().await).await;
        }
    }

    /// Sends one frame to each motor; takes 28 us.
    async fn send(&mut self, throttles: [u16; CHANNELS]) {
        encode(&self.timing, throttles, &mut self.rows);
        let rows = self.rows.0.as_flattened();
        let dma = self.dma.reborrow();
        let transfer = self.pwm.waveform_up_multi_channel(dma, self.irqs, Channel::Ch1, Channel::Ch4, rows);
        // Wrapping, without a check for an overflow after 585,000 years that could panic.
        let deadline = Instant::from_micros(Instant::now().as_micros().wrapping_add(TRANSFER_MAX_US));
        if with_deadline(deadline, transfer).await.is_err() {
            // The next frame sets up the stream again.
            defmt::warn!("the motors' DMA transfer has stopped");
        }
    }
}

/// The output of a motor on a channel, low.
pub fn pin<T: GeneralInstance4Channel, C: TimerChannel>(
    pin: Peri<'static, impl TimerPin<T, C>>,
) -> Option<PwmPin<'static, T, C>> {
    Some(PwmPin::new(pin, OutputType::PushPull))
}

/// Returns what the outputs send, each for the rotor with its index in `rotors`; 0 if the vehicle does not have it.
pub fn of_outputs<const OUTPUTS: usize>(rotors: &[usize; OUTPUTS], throttles: &[u16]) -> [u16; OUTPUTS] {
    rotors.map(|rotor| throttles.get(rotor).copied().unwrap_or(0))
}

/// Returns what the channels of a timer send: what the outputs with these numbers do, 0 for the number 0.
pub fn of_channels(motors: [usize; CHANNELS], outputs: &[u16]) -> [u16; CHANNELS] {
    motors.map(|motor| motor.checked_sub(1).and_then(|at| outputs.get(at)).copied().unwrap_or(0))
}

/// Encodes a frame for each channel. Out of line, like the control tick, to be counted.
#[inline(never)]
fn encode<W: Copy + From<u16>>(timing: &Timing, throttles: [u16; CHANNELS], rows: &mut Rows<W>) {
    timing.rows(throttles, &mut rows.0);
}

/// Holds pins of a port low, whatever state the program is in. Motor controllers then stop by themselves.
pub fn hold_low(port: Gpio, pins: impl IntoIterator<Item = usize>) {
    // They become plain outputs, whose output register is 0 since start-up.
    port.moder().modify(|mode| pins.into_iter().for_each(|pin| mode.set_moder(pin, Moder::OUTPUT)));
}
