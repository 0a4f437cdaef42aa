//! Boards: the facts about each that are needed to observe it from outside and to connect a world to it.

use crate::card::{LogStorage, SdSlot};
use crate::impairments::Impairments;
use crate::line_answers::MotorPort;
use crate::steady::Steady::{Output, PulledUp};
use crate::steady::SteadyPin;
use crate::wire::UartWire;
use rigless::chip::nmea;
use rigless::chip::uart::{Errors, Peer};
use rigless::edge::Edge;
use rigless::emulator::{Access, AccessKind};
use rigless::machine::Board;
use rigless::machine::flight::{Actuate, Actuator, Signals};
use rigless::machine::matekh743::{self, MatekH743};
use rigless::machine::pixracer::{self, Pixracer};
use rigless::mcu::{Mcu, Operate};
use rigless::session::Session;
use rigless::soc::stm32h743::generated::dbgmcu;
use rigless::soc::{Error, Width};
use rigless::time::VirtualNanos;
use std::ops::Range;

/// Signal on the motor outputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Signal {
    /// DSHOT600, the default, sent by the DMA of these timers.
    Dshot600(&'static [FrameTimer]),
    /// PWM at 400 Hz, for models in which no DMA serves a timer.
    Pwm400,
}

/// Timer whose frames are sent by DMA.
#[derive(Debug, PartialEq)]
pub struct FrameTimer {
    /// Address of the control register, whose lowest bit enables the counter.
    pub counter: u64,
    /// Address of the stream's control register, whose lowest bit starts a frame.
    pub stream: u64,
    /// Motors of the timer, counted from 0.
    pub motors: Range<usize>,
    /// Port of the motor pins, if motor controllers can answer there.
    pub lines: Option<MotorPort>,
}

/// Baud rate divider of a UART, and its clock.
#[derive(Clone, Copy, Debug)]
pub struct Divider {
    /// Address of the register.
    pub register: u64,
    /// Clock \[Hz\].
    pub clock_hz: u64,
}

/// Early revision of a chip, with an erratum that firmware must work around by a write to a register at its start.
#[derive(Clone, Copy, Debug)]
pub struct EarlyRevision {
    pub name: &'static str,
    /// Address of the register.
    pub register: u64,
    /// Value that the erratum's workaround writes.
    pub value: u64,
}

/// Board in the emulator, with the facts and connections that the twin needs.
pub trait Machine: Board + Edge<Signals = Signals> + Sized + 'static {
    /// Address of the watchdog's key register.
    const WATCHDOG: u64;
    /// Address of the parameters' flash.
    const STORE: u64;
    /// Bytes of flash that a word of 4 bytes takes.
    const STORE_WORD: usize;
    /// True if the models' flash can be written.
    const STORES: bool;
    /// Indices of the motor outputs in use.
    const MOTORS: Range<usize>;
    /// Signal on the motor outputs.
    const SIGNAL: Signal;
    /// Divider of the GNSS receiver's UART.
    const RECEIVER: Divider;
    /// Inertial sensors in the order of the firmware, as indices of [`Edge::CHIPS`].
    const IMUS: &'static [usize];
    /// Interrupts of the UARTs of the first link and the GNSS receiver.
    const UART_INTERRUPTS: [u16; 2];

    /// Longest delay of a tick by sensor tasks, which have a higher priority \[ns\]. The delay is longest while IMUs
    /// are set up: at the start, and again after a second without motion, as in `boot`.
    const JITTER: u64;
    /// Battery voltage of the models at rest, if the image measures it \[mV\].
    const BATTERY_MV: Option<u16>;
    /// Registers that the chip has and the models lack.
    const UNMAPPED: &[u64];
    /// Address of the first GPIO port, and the pins that must not float.
    const PORTS: u64;
    const STEADY: &'static [SteadyPin];
    /// Interrupt status register of the USB core, if the models have it as plain memory.
    const USB_STATUS: Option<u64> = None;

    /// Early revision of the board's chip, if firmware must work around its errata.
    const EARLY_REVISION: Option<EarlyRevision> = None;

    /// Creates the board.
    fn built() -> Result<Box<Self>, Error>;

    /// Gives the chip the identity of [`EARLY_REVISION`](Self::EARLY_REVISION).
    ///
    /// # Errors
    /// The models lack the register with the identity.
    fn set_early_revision(&mut self) -> Result<(), Error> {
        Ok(())
    }

    /// Returns the motor outputs.
    fn motors(&mut self) -> Vec<Actuator>;

    /// Connects a wire to the first link.
    fn attach_link(&mut self, wire: UartWire) -> bool {
        self.attach_host("serial1", Box::new(wire))
    }

    /// Connects a wire to the second link; returns false if that is on USB.
    fn attach_second_link(&mut self, wire: UartWire) -> bool;

    /// Connects a radio receiver to a UART, and returns its `RC_PORT`; `None` if there is no such UART.
    fn attach_radio(&mut self, wire: UartWire) -> Option<f32> {
        self.attach_second_link(wire).then_some(2.0)
    }

    /// Connects a wire to the UART for motor controller telemetry, if there is one.
    fn attach_escs(&mut self, wire: UartWire) {
        drop(wire);
    }

    /// Replaces the GNSS receiver on its UART.
    fn attach_receiver(&mut self, receiver: Box<dyn Peer>);

    /// Inserts a card that follows today's specification, in place of the models' card or none.
    fn insert_card(&mut self) {}

    /// Returns the log storage: a memory card of this crate, or a flash chip. Boards without either return `None`.
    fn log_storage(&mut self) -> Option<&mut dyn LogStorage> {
        None
    }

    /// Adds effects of an access that the models leave out.
    fn complete(session: &mut Session<Self>, access: &Access) {
        let _ = (session, access);
    }

    /// Sets the faults of the board's parts, replacing earlier ones.
    fn impair(&mut self, impairments: &Impairments);

    /// Returns the transmission errors of the first link's wire to the board.
    fn link_errors(&mut self) -> &mut Errors;

    /// Connects the GNSS receiver that comes with the models, because `sense` needs a receiver. Then passes the signals
    /// on.
    fn sense_with_own_receiver(&mut self, signals: &Signals) {
        self.attach_receiver(Box::new(nmea::Receiver::new()));
        self.sense(signals);
    }
}

/// Ports of the Matek H743's motor pins (RM0433, table 8, 11.4.4).
const PORT_A: MotorPort = MotorPort { pulls: 0x5802_000C, first: 0 };
const PORT_D: MotorPort = MotorPort { pulls: 0x5802_0C0C, first: 12 };

impl Machine for MatekH743 {
    /// IWDG1_KR (RM0433, 45.4).
    const WATCHDOG: u64 = 0x5800_4800;
    const STORE: u64 = 0x0810_0000;
    const STORE_WORD: usize = 32;
    const STORES: bool = true;
    /// Outputs PWM3 to PWM10.
    const MOTORS: Range<usize> = 2..10;
    /// Streams 0 and 1 of DMA1, for TIM5 and TIM4 (RM0433, 15.5.5).
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
    /// RX pins of UART7, USART1, USART2 and UART8.
    const PORTS: u64 = 0x5802_0000;
    const STEADY: &'static [SteadyPin] = &[(4, 7, PulledUp), (0, 10, PulledUp), (3, 6, PulledUp), (4, 0, PulledUp)];
    /// OTG_GINTSTS (RM0433, 57.14.6).
    const USB_STATUS: Option<u64> = Some(0x4008_0014);

    /// Revision Y returns wrong data when its AXI RAM handles two reads at once (ES0392: "Reading from AXI SRAM may
    /// lead to data read corruption"). AXI_TARG7_FN_MOD limits the RAM to one read at a time. The models are of
    /// revision V.
    const EARLY_REVISION: Option<EarlyRevision> =
        Some(EarlyRevision { name: "STM32H743 revision Y", register: 0x5100_8108, value: 1 });

    fn built() -> Result<Box<Self>, Error> {
        MatekH743::new().map(Box::new)
    }

    fn set_early_revision(&mut self) -> Result<(), Error> {
        /// DBGMCU_IDC of revision Y (RM0433, 60.5.8).
        const REVISION_Y: u64 = 0x1003_6450;
        let bus = self.mcu.bus_mut();
        let unit = bus.slot("DBGMCU")?;
        bus.slot_mut(unit).registers_mut().set(dbgmcu::Register::Idc, REVISION_Y);
        Ok(())
    }

    fn motors(&mut self) -> Vec<Actuator> {
        self.drive().actuators().get(Self::MOTORS).unwrap_or_default().to_vec()
    }

    /// The second link is on USART1.
    fn attach_second_link(&mut self, wire: UartWire) -> bool {
        self.mcu.usart[0].attach(wire);
        true
    }

    /// Motor controller telemetry comes in on UART8.
    fn attach_escs(&mut self, wire: UartWire) {
        self.mcu.usart[7].attach(wire);
    }

    /// The GNSS receiver is on USART2.
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

    /// The first link is on UART7.
    fn link_errors(&mut self) -> &mut Errors {
        self.mcu.usart[6].errors_mut()
    }
}

impl Machine for Pixracer {
    /// IWDG_KR (RM0090, 21.4).
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
    /// Longer, since two IMUs share one SPI.
    const JITTER: u64 = 350_000;
    const BATTERY_MV: Option<u16> = Some(16_800);
    /// The USB core's fourth hardware configuration register.
    const UNMAPPED: &[u64] = &[0x5000_0050];
    /// RX pins of USART2, USART3, UART4 and USART6; power switches of sensors and peripherals; switch of the heater.
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
    /// OTG_FS_GINTSTS (RM0090, 34.16.2).
    const USB_STATUS: Option<u64> = Some(0x5000_0014);

    fn built() -> Result<Box<Self>, Error> {
        Pixracer::new().map(Box::new)
    }

    fn insert_card(&mut self) {
        self.mcu.sdio.attach(SdSlot::new());
    }

    /// Restarts a data path that reads, after each command. The real interface waits for the block that it reads. The
    /// model looks for a block only when the data path is enabled, so it misses one whose command comes later.
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

    /// The second link is on USART3.
    fn attach_second_link(&mut self, wire: UartWire) -> bool {
        self.mcu.usart[2].attach(wire);
        true
    }

    /// Attaches the wire to USART6, which the board reserves for a radio receiver.
    fn attach_radio(&mut self, wire: UartWire) -> Option<f32> {
        self.mcu.usart[3].attach(wire);
        Some(0.0)
    }

    /// The GNSS receiver is on UART4.
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

    /// The first link is on USART2.
    fn link_errors(&mut self) -> &mut Errors {
        self.mcu.usart[1].errors_mut()
    }
}

/// Registers of the memory card interface: command, and control of the data path (RM0090, 31.9.4 and 31.9.8), with the
/// bits that enable it and select reading.
const SDIO_COMMAND: u64 = 0x4001_2C0C;
const SDIO_DATA_CONTROL: u64 = 0x4001_2C2C;
const READS: u64 = 0b11;

/// Value of the USB core's reset register, just before the interrupt status, once a reset has finished.
const USB_IDLE: u64 = 1 << 31;

/// Keeps the USB driver idle on models that have the USB registers as plain memory. There, a flag cleared by writing
/// one stays set, and a reset never ends. The driver would wait for ever, and no task of its priority or below would
/// run.
pub fn quiet_usb<M: Machine>(session: &mut Session<M>, at: VirtualNanos) {
    if let Some(status) = M::USB_STATUS {
        // Fails only if the USB core has no clock, which needs no handling.
        let _ = session.mcu().write(at, status, Width::W32, 0);
        let _ = session.mcu().write(at, status - 4, Width::W32, USB_IDLE);
    }
}
