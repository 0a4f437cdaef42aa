//! The boards that `rigless` models, and what of each is to be known to look at it from outside.

use rigless::edge::Edge;
use rigless::machine::Board;
use rigless::machine::flight::{Actuate, Actuator};
use rigless::machine::matekh743::MatekH743;
use rigless::machine::pixracer::Pixracer;
use rigless::mcu::Operate;
use rigless::session::Session;
use rigless::soc::{Error, Width};
use rigless::time::VirtualNanos;
use std::ops::Range;

/// What the motors' outputs carry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Signal {
    /// DSHOT600, the default.
    Dshot600,
    /// PWM at 400 Hz, since no DMA of the models serves a timer; the value of `MOT_PROTOCOL`.
    Pwm400(f32),
}

/// A board.
pub trait Machine: Board + Sized + 'static {
    /// Key register of the watchdog.
    const WATCHDOG: u64;
    /// First word of the parameters' flash.
    const STORE: u64;
    /// The outputs of its motors.
    const MOTORS: Range<usize>;
    /// What they carry.
    const SIGNAL: Signal;

    /// What sensors, at a higher priority, may delay a tick by \[ns\]: most while an IMU is set up.
    const JITTER: u64;
    /// Voltage of the battery that the models have at rest, if the image measures it \[mV\].
    const BATTERY_MV: Option<u16>;
    /// Registers that the chip has and the models do not.
    const UNMAPPED: &[u64];

    /// Returns the board as it is built.
    fn built() -> Result<Box<Self>, Error>;

    /// Returns the pins of its motors.
    fn motors(&mut self) -> Vec<Actuator>;
}

impl Machine for MatekH743 {
    /// RM0433, 45.4.
    const WATCHDOG: u64 = 0x5800_4800;
    const STORE: u64 = 0x0810_0000;
    /// PWM3 to PWM10.
    const MOTORS: Range<usize> = 2..10;
    const SIGNAL: Signal = Signal::Dshot600;
    const JITTER: u64 = 150_000;
    const BATTERY_MV: Option<u16> = Some(16_800);
    const UNMAPPED: &[u64] = &[];

    fn built() -> Result<Box<Self>, Error> {
        MatekH743::new().map(Box::new)
    }

    fn motors(&mut self) -> Vec<Actuator> {
        self.drive().actuators().get(Self::MOTORS).unwrap_or_default().to_vec()
    }
}

impl Machine for Pixracer {
    /// RM0090, 21.4.
    const WATCHDOG: u64 = 0x4000_3000;
    const STORE: u64 = 0x0800_4000;
    const MOTORS: Range<usize> = 0..6;
    const SIGNAL: Signal = Signal::Pwm400(4.0);
    const JITTER: u64 = 300_000;
    const BATTERY_MV: Option<u16> = None;
    /// USB: the core's fourth hardware configuration register.
    const UNMAPPED: &[u64] = &[0x5000_0050];

    fn built() -> Result<Box<Self>, Error> {
        Pixracer::new().map(Box::new)
    }

    fn motors(&mut self) -> Vec<Actuator> {
        self.drive().actuators().get(Self::MOTORS).unwrap_or_default().to_vec()
    }
}

/// Interrupt status of the Matek H743's USB core (RM0433, 57.14.6).
const GINTSTS: u64 = 0x4008_0014;

/// Keeps USB still: the models have registers of it, but not what they do, and a flag that is cleared by writing a one
/// stays set. Its driver would never end, and nothing else of its priority begin.
pub fn quiet_usb(session: &mut Session<MatekH743>, at: VirtualNanos) {
    // Nothing to be done about a core that is not clocked.
    let _ = session.mcu().write(at, GINTSTS, Width::W32, 0);
}
