//! Drives LED and buzzer.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, OutputOpenDrain, OutputType, Pin, Speed};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm};
use embassy_stm32::timer::{Ch1, GeneralInstance4Channel, TimerPin};
use firmware::indication::{self, IndicatorSignals};

/// Tone of a passive buzzer \[Hz\].
const TONE_HZ: u32 = 2_500;

/// An LED between supply and pin, the usual wiring: it is lit while the pin is low.
pub struct Led(OutputOpenDrain<'static>);

impl Led {
    /// Creates the LED at a pin, dark.
    pub fn new(pin: Peri<'static, impl Pin>) -> Self {
        // Open drain, since the supply may be 5 V.
        Led(OutputOpenDrain::new(pin, Level::High, Speed::Low))
    }
}

/// A buzzer.
pub trait Buzzer {
    /// Switches the sound on or off.
    fn sound(&mut self, sounds: bool);
}

/// A buzzer with its own oscillator, behind a transistor: it sounds while its pin is high. Betaflight calls this
/// inverted.
pub struct ActiveBuzzer(Output<'static>);

impl ActiveBuzzer {
    /// Creates the buzzer at a pin, silent.
    pub fn new(pin: Peri<'static, impl Pin>) -> Self {
        ActiveBuzzer(Output::new(pin, Level::Low, Speed::Low))
    }
}

impl Buzzer for ActiveBuzzer {
    fn sound(&mut self, sounds: bool) {
        self.0.set_level(if sounds { Level::High } else { Level::Low });
    }
}

/// A passive buzzer at the first channel of a timer; an active buzzer sounds there, too.
pub struct PassiveBuzzer<T: GeneralInstance4Channel>(SimplePwm<'static, T>);

impl<T: GeneralInstance4Channel> PassiveBuzzer<T> {
    /// Creates the buzzer at a pin, silent.
    pub fn new(timer: Peri<'static, T>, pin: Peri<'static, impl TimerPin<T, Ch1>>) -> Self {
        let pin = PwmPin::new(pin, OutputType::PushPull);
        let counting = CountingMode::EdgeAlignedUp;
        let mut pwm = SimplePwm::new(timer, Some(pin), None, None, None, Hertz(TONE_HZ), counting);
        pwm.ch1().set_duty_cycle(0);
        pwm.ch1().enable();
        PassiveBuzzer(pwm)
    }
}

impl<T: GeneralInstance4Channel> Buzzer for PassiveBuzzer<T> {
    fn sound(&mut self, sounds: bool) {
        let mut channel = self.0.ch1();
        let half = channel.max_duty_cycle() / 2;
        channel.set_duty_cycle(if sounds { half } else { 0 });
    }
}

/// Shows the vehicle's status forever. For a task of the lowest priority
/// ([`housekeeping`](firmware::executors::housekeeping)).
pub async fn run(mut led: Option<Led>, mut buzzer: impl Buzzer) -> ! {
    let show = |IndicatorSignals { led: lit, buzzer: sounds }| {
        if let Some(Led(pin)) = &mut led {
            pin.set_level(if lit { Level::Low } else { Level::High });
        }
        buzzer.sound(sounds);
    };
    indication::run(show).await
}
