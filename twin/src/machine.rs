//! The boards: what of each is to be known to look at it from outside, and to put a world around it.

use crate::card::{LogStorage, SdSlot};
use crate::impairments::Impairments;
use crate::line_answers::Lines;
use crate::steady::Steady::{Output, PulledUp};
use crate::steady::SteadyPin;
use crate::wire::Wire;
use rigless::chip::nmea;
use rigless::chip::uart::{Errors, Peer};
use rigless::edge::Edge;
use rigless::emulator::{Access, AccessKind};
use rigless::machine::Board;
use rigless::machine::flight::{Actuate, Actuator, Signals};
use rigless::machine::matekh743::{self, MatekH743};
use rigless::machine::pixracer::{self, Pixracer};
use rigless::mcu::Operate;
use rigless::session::Session;
use rigless::soc::{Error, Width};
use rigless::time::VirtualNanos;
use std::ops::Range;

/// What the motors' outputs carry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Signal {
    /// DSHOT600, the default, by the DMA of these timers.
    Dshot600(&'static [FrameTimer]),
    /// PWM at 400 Hz, since no DMA of the models serves a timer.
    Pwm400,
}

/// A timer whose frames DMA sends.
#[derive(Debug, PartialEq)]
pub struct FrameTimer {
    /// Its control register, whose lowest bit lets it count.
    pub counter: u64,
    /// Control register of the stream; its lowest bit starts a frame.
    pub stream: u64,
    /// Its motors, from 0.
    pub motors: Range<usize>,
    /// Where the port of its pins is, if their motors' controllers can be heard there.
    pub lines: Option<Lines>,
}

/// A UART's divider and its clock.
#[derive(Clone, Copy, Debug)]
pub struct Divider {
    /// Address of the register.
    pub register: u64,
    /// The clock \[Hz\].
    pub clock_hz: u64,
}

/// A board.
pub trait Machine: Board + Edge<Signals = Signals> + Sized + 'static {
    /// Key register of the watchdog.
    const WATCHDOG: u64;
    /// First word of the parameters' flash.
    const STORE: u64;
    /// Bytes of the flash that a word of four bytes takes.
    const STORE_WORD: usize;
    /// True if the models have a flash that can be written.
    const STORES: bool;
    /// The outputs of its motors.
    const MOTORS: Range<usize>;
    /// What they carry.
    const SIGNAL: Signal;
    /// The divider of the GNSS receiver's UART.
    const RECEIVER: Divider;
    /// Its inertial sensors, in the order of the firmware, by their places among [`Edge::CHIPS`].
    const IMUS: &'static [usize];
    /// Interrupts of the UARTs of the first link and the GNSS receiver.
    const UART_INTERRUPTS: [u16; 2];

    /// What sensors, at a higher priority, may delay a tick by \[ns\]: most while IMUs are set up, at the start, and
    /// after a second in which nothing moves, as in `boot`, again.
    const JITTER: u64;
    /// Voltage of the battery that the models have at rest, if the image measures it \[mV\].
    const BATTERY_MV: Option<u16>;
    /// Registers that the chip has and the models do not.
    const UNMAPPED: &[u64];
    /// First register of the ports of pins, and the pins that must not float.
    const PORTS: u64;
    const STEADY: &'static [SteadyPin];
    /// Interrupt status of the USB core, if the models have it as a register only.
    const USB_STATUS: Option<u64> = None;

    /// Returns the board as it is built.
    fn built() -> Result<Box<Self>, Error>;

    /// Returns the pins of its motors.
    fn motors(&mut self) -> Vec<Actuator>;

    /// Hangs a wire on the first link.
    fn attach_link(&mut self, wire: Wire) -> bool {
        self.attach_host("serial1", Box::new(wire))
    }

    /// Hangs a wire on the second link; false if that is by USB.
    fn attach_second_link(&mut self, wire: Wire) -> bool;

    /// Hangs a radio receiver on a UART, and returns its `RC_PORT`; none if there is no such UART here.
    fn attach_radio(&mut self, wire: Wire) -> Option<f32> {
        self.attach_second_link(wire).then_some(2.0)
    }

    /// Hangs a wire on the UART that hears the motor controllers, if there is one.
    fn attach_escs(&mut self, wire: Wire) {
        drop(wire);
    }

    /// Hangs a GNSS receiver on its UART, in the place of the one that was there.
    fn attach_receiver(&mut self, receiver: Box<dyn Peer>);

    /// Puts a card of today into a slot that has another, or none.
    fn insert_card(&mut self) {}

    /// Returns where it keeps logs: in a card of ours, or in a chip.
    fn log_storage(&mut self) -> Option<&mut dyn LogStorage> {
        None
    }

    /// Adds to what an access does where the models leave something out.
    fn complete(session: &mut Session<Self>, access: &Access) {
        let _ = (session, access);
    }

    /// Lets this be wrong with its parts, and nothing else.
    fn impair(&mut self, impairments: &Impairments);

    /// Returns what is wrong with the wire of the first link to the board.
    fn link_errors(&mut self) -> &mut Errors;

    /// Feels the world, with a receiver of its own kind, which the board tells what it feels.
    fn sense_with_own_receiver(&mut self, signals: &Signals) {
        self.attach_receiver(Box::new(nmea::Receiver::new()));
        self.sense(signals);
    }
}

/// The pins of the Matek H743's motors (RM0433, table 8, 11.4.4).
const PORT_A: Lines = Lines { pulls: 0x5802_000C, first: 0 };
const PORT_D: Lines = Lines { pulls: 0x5802_0C0C, first: 12 };

impl Machine for MatekH743 {
    /// RM0433, 45.4.
    const WATCHDOG: u64 = 0x5800_4800;
    const STORE: u64 = 0x0810_0000;
    const STORE_WORD: usize = 32;
    const STORES: bool = true;
    /// PWM3 to PWM10.
    const MOTORS: Range<usize> = 2..10;
    /// DMA1's streams 0 and 1, for TIM5 and TIM4 (RM0433, 15.5.5).
    const SIGNAL: Signal = Signal::Dshot600(&[
        FrameTimer { counter: 0x4000_0C00, stream: 0x4002_0010, motors: 0..4, lines: Some(PORT_A) },
        FrameTimer { counter: 0x4000_0800, stream: 0x4002_0028, motors: 4..8, lines: Some(PORT_D) },
    ]);
    /// USART2 (RM0433, 48.8.5).
    const RECEIVER: Divider = Divider { register: 0x4000_440C, clock_hz: 100_000_000 };
    const IMUS: &'static [usize] = &[0, 1];
    /// UART7 and USART2 (RM0433, table 147).
    const UART_INTERRUPTS: [u16; 2] = [82, 38];
    const JITTER: u64 = 150_000;
    const BATTERY_MV: Option<u16> = Some(16_800);
    const UNMAPPED: &[u64] = &[];
    /// RX of UART7, USART1, USART2 and UART8.
    const PORTS: u64 = 0x5802_0000;
    const STEADY: &'static [SteadyPin] = &[(4, 7, PulledUp), (0, 10, PulledUp), (3, 6, PulledUp), (4, 0, PulledUp)];
    /// RM0433, 57.14.6.
    const USB_STATUS: Option<u64> = Some(0x4008_0014);

    fn built() -> Result<Box<Self>, Error> {
        MatekH743::new().map(Box::new)
    }

    fn motors(&mut self) -> Vec<Actuator> {
        self.drive().actuators().get(Self::MOTORS).unwrap_or_default().to_vec()
    }

    /// USART1.
    fn attach_second_link(&mut self, wire: Wire) -> bool {
        self.mcu.usart[0].attach(wire);
        true
    }

    /// UART8.
    fn attach_escs(&mut self, wire: Wire) {
        self.mcu.usart[7].attach(wire);
    }

    /// USART2.
    fn attach_receiver(&mut self, receiver: Box<dyn Peer>) {
        self.mcu.usart[1].attach_boxed(receiver);
    }

    fn impair(&mut self, impairments: &Impairments) {
        let Impairments { imus: [first, second], barometer, compass, receiver } = *impairments;
        self.condition(&matekh743::Conditions {
            icm42688p_silent: first.silent,
            icm42688p_rate: first.rate,
            icm42688p_acceleration: first.force,
            icm42605_silent: second.silent,
            icm42605_rate: second.rate,
            icm42605_acceleration: second.force,
            dps310_silent: barometer.silent,
            dps310_pressure: barometer.pressure,
            qmc5883l_silent: compass.silent,
            qmc5883l_field: compass.field,
            gps_silent: receiver.silent,
            gps_noise_errors: receiver.noise_errors,
            gps_framing_errors: receiver.framing_errors,
        });
    }

    /// UART7.
    fn link_errors(&mut self) -> &mut Errors {
        self.mcu.usart[6].errors_mut()
    }
}

impl Machine for Pixracer {
    /// RM0090, 21.4.
    const WATCHDOG: u64 = 0x4000_3000;
    const STORE: u64 = 0x0800_4000;
    const STORE_WORD: usize = 4;
    const STORES: bool = false;
    const MOTORS: Range<usize> = 0..6;
    const SIGNAL: Signal = Signal::Pwm400;
    /// UART4 (RM0090, 30.6.3), on APB1.
    const RECEIVER: Divider = Divider { register: 0x4000_4C08, clock_hz: 42_000_000 };
    /// ICM-20608-G and MPU-9250.
    const IMUS: &'static [usize] = &[0, 1];
    /// USART2 and UART4 (RM0090, table 63).
    const UART_INTERRUPTS: [u16; 2] = [38, 52];
    /// Two IMUs on one SPI.
    const JITTER: u64 = 350_000;
    const BATTERY_MV: Option<u16> = Some(16_800);
    /// USB: the core's fourth hardware configuration register.
    const UNMAPPED: &[u64] = &[0x5000_0050];
    /// RX of USART2, USART3, UART4 and USART6; the supplies of sensors and of what is connected, and the heater.
    const PORTS: u64 = 0x4002_0000;
    const STEADY: &'static [SteadyPin] = &[
        (3, 6, PulledUp),
        (3, 9, PulledUp),
        (0, 1, PulledUp),
        (2, 7, PulledUp),
        (4, 3, Output(true)),
        (2, 5, Output(true)),
        (2, 6, Output(false)),
    ];
    /// RM0090, 34.16.2.
    const USB_STATUS: Option<u64> = Some(0x5000_0014);

    fn built() -> Result<Box<Self>, Error> {
        Pixracer::new().map(Box::new)
    }

    fn insert_card(&mut self) {
        self.mcu.sdio.attach(SdSlot::new());
    }

    /// The interface of a memory card waits for the block that it reads; the models' looks for one when its data path
    /// is switched on, and not again if the command for it comes later.
    fn complete(session: &mut Session<Self>, access: &Access) {
        if access.kind == AccessKind::Write && access.address == SDIO_COMMAND {
            let at = access.virtual_time;
            let mcu = session.mcu();
            let Ok(control) = mcu.read(at, SDIO_DATA_CONTROL, Width::W32) else { return };
            if control & READS == READS {
                let _ = mcu.write(at, SDIO_DATA_CONTROL, Width::W32, control & !1);
                let _ = mcu.write(at, SDIO_DATA_CONTROL, Width::W32, control);
            }
        }
    }

    fn log_storage(&mut self) -> Option<&mut dyn LogStorage> {
        let card = self.mcu.sdio.card_mut::<SdSlot>()?;
        Some(&mut card.slot)
    }

    fn motors(&mut self) -> Vec<Actuator> {
        self.drive().actuators().get(Self::MOTORS).unwrap_or_default().to_vec()
    }

    /// USART3.
    fn attach_second_link(&mut self, wire: Wire) -> bool {
        self.mcu.usart[2].attach(wire);
        true
    }

    /// USART6, the board's own for it.
    fn attach_radio(&mut self, wire: Wire) -> Option<f32> {
        self.mcu.usart[3].attach(wire);
        Some(0.0)
    }

    /// UART4.
    fn attach_receiver(&mut self, receiver: Box<dyn Peer>) {
        self.mcu.usart[6].attach_boxed(receiver);
    }

    fn impair(&mut self, impairments: &Impairments) {
        let Impairments { imus: [first, second], barometer, compass, receiver } = *impairments;
        self.condition(&pixracer::Conditions {
            icm20608_silent: first.silent,
            icm20608_rate: first.rate,
            icm20608_acceleration: first.force,
            mpu9250_silent: second.silent,
            mpu9250_rate: second.rate,
            mpu9250_acceleration: second.force,
            lis3mdl_silent: compass.silent,
            lis3mdl_field: compass.field,
            ms5611_silent: barometer.silent,
            ms5611_pressure: barometer.pressure,
            gps_silent: receiver.silent,
            gps_noise_errors: receiver.noise_errors,
            gps_framing_errors: receiver.framing_errors,
            ..pixracer::Conditions::default()
        });
    }

    /// USART2.
    fn link_errors(&mut self) -> &mut Errors {
        self.mcu.usart[1].errors_mut()
    }
}

/// Registers of the interface to memory cards: its command and the control of its data path (RM0090, 31.9.4 and
/// 31.9.8), with the bits that switch it on and that read.
const SDIO_COMMAND: u64 = 0x4001_2C0C;
const SDIO_DATA_CONTROL: u64 = 0x4001_2C2C;
const READS: u64 = 0b11;

/// What the register before the interrupt status, which resets the core, reads like once that is done.
const USB_IDLE: u64 = 1 << 31;

/// Keeps USB still where the models have registers of it, but not what they do: a flag that is cleared by writing a
/// one stays set, and a reset never ends; the driver, which looks at them, would never end, and nothing else of its
/// priority or below begin.
pub fn quiet_usb<M: Machine>(session: &mut Session<M>, at: VirtualNanos) {
    if let Some(status) = M::USB_STATUS {
        // Nothing to be done about a core that is not clocked.
        let _ = session.mcu().write(at, status, Width::W32, 0);
        let _ = session.mcu().write(at, status - 4, Width::W32, USB_IDLE);
    }
}
