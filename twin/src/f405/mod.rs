//! Boards with an STM32F405, on models of an STM32F427, which has nearly the same memory map and the same manual. Each
//! board is a row of [`wiring::WIRINGS`]. A common module with GNSS receiver and compass is connected to its I2C and
//! UART. The models differ from all of these boards as follows:
//!
//! | here | on the board |
//! |---|---|
//! | 2 MiB of flash, 256 KiB of RAM, 91 interrupts | 1 MiB, 192 KiB, 82 |
//! | identity of an STM32F42x (`DBGMCU_IDCODE`) | of an STM32F405 |
//! | DPS310 | SPL06-001 on two of them, with the same registers |
//! | no USB | USB on PA11 and PA12 |
//! | no line from the IMU's interrupt | a pin, by which it is read |

mod bmi270;
mod part;
mod relabelled;
mod wiring;

use crate::card::{FlashChip, LogStorage, SpiSlot};
use crate::impairments::Impairments;
use crate::machine::{Divider, Machine, Signal};
use crate::steady::SteadyPin;
use crate::wire::UartWire;
use bmi270::Bmi270Model;
use part::BoardChip;
use relabelled::RelabelledImu;
use rigless::chip::dps310::{Dps310, Sdo};
use rigless::chip::icm42688p::Icm42688p;
use rigless::chip::nmea;
use rigless::chip::qmc5883l::Qmc5883l;
use rigless::chip::uart::Peer;
use rigless::chip::{Placed, uart};
use rigless::cpu;
use rigless::device::Level;
use rigless::edge::{Edge, Field, Sensed};
use rigless::machine::armv7m;
use rigless::machine::flight::{AT_REST, Actuate, Actuator, Curve, Outputs, SIGNAL_FIELDS, Signals};
use rigless::machine::{Board, HostWire, Target};
use rigless::mcu::Mcu;
use rigless::snapshot::{Error as SnapshotError, Reader, Store, Writer};
use rigless::soc::Error;
use rigless::soc::stm32f427::peripherals::adc::Channel as AnalogChannel;
use rigless::soc::stm32f427::peripherals::gpio::Pin;
use rigless::soc::stm32f427::peripherals::spi::Select;
use rigless::soc::stm32f427::peripherals::tim::Channel;
use rigless::time::VirtualNanos;
use serde::{Deserialize, Serialize};
use std::num::{NonZeroU32, NonZeroU64};
use std::ops::Range;
use wiring::{InertialModel, LogWiring, Sensors, StorageKind, Timer, UART4, WIRINGS, Wiring};

const CRYSTAL_HZ: u64 = 8_000_000;
const RAIL_MV: u32 = 3_300;
const LINK_WIRE: HostWire = HostWire { name: "serial1", port: 5760 };
/// SPI1, and the IMU's place on it.
const SPI: usize = 0;
const IMU: usize = 0;
/// Battery voltage per volt at the converter's pin.
const DIVIDER: u32 = 11;
/// Place of the memory card or flash chip on its SPI.
const LOGS: usize = 0;
/// Places of barometer and compass on the I2C.
const BAROMETER: usize = 0;
const COMPASS: usize = 1;
const CURVE: Curve = Curve { zero: VirtualNanos(1_000_000), full: VirtualNanos(2_000_000) };
/// Names by which the noise of each quantity is drawn.
const RATE_NOISE: [&str; 3] = ["rate.noise.x", "rate.noise.y", "rate.noise.z"];
const FORCE_NOISE: [&str; 3] = ["force.noise.x", "force.noise.y", "force.noise.z"];
const FIELD_NOISE: [&str; 3] = ["field.noise.x", "field.noise.y", "field.noise.z"];
const PRESSURE_NOISE: [&str; 1] = ["pressure.noise"];

/// Newest readings given to the sensor models, in body axes.
#[derive(Debug, Default, Serialize, Deserialize)]
struct SensorReadings {
    rate: Sensed<i32, 3>,
    force: Sensed<i32, 3>,
    field: Sensed<i32, 3>,
    pressure: Sensed<u32, 1>,
}

/// Board described by a row of [`WIRINGS`].
#[derive(Debug)]
pub struct F405<const ROW: usize> {
    mcu: BoardChip,
    impairments: Impairments,
    handed: SensorReadings,
    sensed: Signals,
}

impl<const ROW: usize> F405<ROW> {
    const WIRING: Wiring = WIRINGS[ROW];

    /// Returns the board at rest.
    fn new() -> Result<Self, Error> {
        let mut board = F405 {
            mcu: BoardChip::new(&Self::WIRING)?,
            impairments: Impairments::default(),
            handed: SensorReadings::default(),
            sensed: AT_REST,
        };
        let part = &mut board.mcu.stm32;
        part.rcc.attach_crystals(CRYSTAL_HZ, 0);
        part.set_supply(RAIL_MV);
        for converter in &mut part.adc {
            converter.set_reference(RAIL_MV);
        }
        if let Some(Sensors { imu, select: (port, pin), i2c, receiver, .. }) = Self::WIRING.sensors {
            let select = Select { port, pin: Pin::new(pin).expect("a pin's number is 0 to 15"), active: Level::Low };
            match imu {
                InertialModel::Icm42688p => part.spi[SPI].attach_selected(Icm42688p::new(), select),
                InertialModel::Bmi270 => part.spi[SPI].attach_selected(Bmi270Model::new(), select),
                InertialModel::Relabelled(identity) => {
                    part.spi[SPI].attach_selected(RelabelledImu::new(identity), select);
                }
            }
            part.i2c[i2c].attach(Dps310::new(Sdo::Low));
            part.i2c[i2c].attach(Qmc5883l::new());
            part.usart[receiver.index].attach(nmea::Receiver::new());
        }
        if let Some(LogWiring { storage, spi, select: (port, pin) }) = Self::WIRING.logs {
            let select = Select { port, pin: Pin::new(pin).expect("a pin's number is 0 to 15"), active: Level::Low };
            match storage {
                StorageKind::Card => part.spi[spi].attach_selected(SpiSlot::new(), select),
                StorageKind::Flash => part.spi[spi].attach_selected(FlashChip::new(), select),
            }
        }
        board.sense(&AT_REST);
        Ok(board)
    }

    /// Returns the configuration of the core, the same for every STM32F4 (PM0214).
    fn config(&self) -> armv7m::Config {
        let bus = self.mcu.bus();
        let core = armv7m::Core {
            variant: armv7m::Variant::M4,
            clock_hz: NonZeroU64::new(168_000_000).expect("a clock"),
            interrupt_lines: NonZeroU32::new(bus.cpu().interrupt_lines.into()).expect("interrupts"),
            priority_bits: 4,
            refclk_divider: NonZeroU32::new(8).expect("a divider"),
            instructions_per_second: armv7m::INSTRUCTIONS_PER_SECOND,
            boot: "flash",
        };
        let mut config = armv7m::Config::new(core, &cpu::armv7m::windows(bus));
        config.fpu = armv7m::Fpu::FpV4Sp;
        config.mpu_regions = armv7m::MpuRegions::Eight;
        config
    }
}

impl<const ROW: usize> Store for F405<ROW> {
    fn store(&self, to: &mut Writer) -> Result<(), SnapshotError> {
        to.put(&self.impairments)?;
        to.put(&self.handed)?;
        to.put(&self.sensed)?;
        self.mcu.stm32.store(to)
    }

    fn load(&mut self, from: &mut Reader) -> Result<(), SnapshotError> {
        self.impairments = from.take()?;
        self.handed = from.take()?;
        self.sensed = from.take()?;
        self.mcu.stm32.load(from)
    }
}

impl<const ROW: usize> Board for F405<ROW> {
    fn name(&self) -> &'static str {
        Self::WIRING.name
    }

    fn target_names(&self) -> Vec<&'static str> {
        vec!["stm32f405"]
    }

    fn mcu(&mut self, target: usize) -> Option<&mut dyn Mcu> {
        (target == 0).then_some(&mut self.mcu)
    }

    fn targets(&mut self) -> Vec<Target<'_>> {
        let core = self.config().spec();
        vec![Target::new("stm32f405", &mut self.mcu, core)]
    }

    fn hosts(&self) -> Vec<HostWire> {
        vec![LINK_WIRE]
    }

    fn attach_host(&mut self, name: &str, peer: Box<dyn Peer>) -> bool {
        let is_link = name == LINK_WIRE.name;
        if is_link {
            self.mcu.stm32.usart[Self::WIRING.link.index].attach_boxed(peer);
        }
        is_link
    }

    fn host_mut(&mut self, name: &str) -> Option<&mut dyn Peer> {
        if name == LINK_WIRE.name { self.mcu.stm32.usart[Self::WIRING.link.index].peer_mut() } else { None }
    }
}

/// Rotates body axes (forward, right, down) into those of an inertial sensor (x, y to the left of x, z up) that is
/// turned clockwise by this many quarter turns, seen from above.
fn of_imu([x, y, z]: [i32; 3], quarter_turns: u8) -> [i32; 3] {
    let turn = |[x, y]: [i32; 2], _| [y, x.saturating_neg()];
    let [x, y] = (0..quarter_turns).fold([x, y], turn);
    [x, y.saturating_neg(), z.saturating_neg()]
}

/// Rotates body axes into those of the module's compass: x to the right, z down.
fn of_compass([x, y, z]: [i32; 3]) -> [i32; 3] {
    [y, x.saturating_neg(), z]
}

impl<const ROW: usize> Edge for F405<ROW> {
    type Signals = Signals;
    type Outputs = Outputs<4>;
    type Conditions = Impairments;
    const FIELDS: &'static [Field] = SIGNAL_FIELDS;
    const OUTPUT_FIELDS: &'static [Field] = Outputs::<4>::FIELDS;
    const REST: Signals = AT_REST;
    const CHIPS: &'static [&'static str] = &["imu"];

    fn place(&mut self, chip: usize) -> Option<&mut dyn Placed> {
        if chip == 0 { self.mcu.stm32.spi[SPI].place_mut(IMU) } else { None }
    }

    fn sense(&mut self, signals: &Signals) {
        self.sensed = *signals;
        let Some(Sensors { imu, quarter_turns, i2c, receiver, battery, .. }) = Self::WIRING.sensors else { return };
        let F405 { mcu: BoardChip { stm32: part, .. }, impairments, handed, .. } = self;
        let rate = of_imu(handed.rate.hand(signals.angular_rate, &impairments.imus[0].rate), quarter_turns);
        let force = of_imu(handed.force.hand(signals.specific_force, &impairments.imus[0].force), quarter_turns);
        match imu {
            InertialModel::Icm42688p => {
                let chip: &mut Icm42688p = part.spi[SPI].chip_mut(IMU).expect("attached");
                chip.set_rate(rate[0], rate[1], rate[2]);
                chip.set_acceleration(force[0], force[1], force[2]);
                chip.set_temperature(signals.temperature);
            }
            InertialModel::Bmi270 => {
                let chip: &mut Bmi270Model = part.spi[SPI].chip_mut(IMU).expect("attached");
                chip.set_motion(rate, force, signals.temperature);
            }
            InertialModel::Relabelled(_) => {
                let chip: &mut RelabelledImu = part.spi[SPI].chip_mut(IMU).expect("attached");
                chip.inner.set_rate(rate[0], rate[1], rate[2]);
                chip.inner.set_acceleration(force[0], force[1], force[2]);
                chip.inner.set_temperature(signals.temperature);
            }
        }
        let current_ma = u32::try_from(signals.battery_current).unwrap_or(0);
        let pins_mv = [signals.battery_voltage / DIVIDER, current_ma * 10 / battery.deciamperes_per_volt];
        for (number, pin_mv) in battery.channels.into_iter().zip(pins_mv) {
            part.adc[0].set_input(AnalogChannel::new(number).expect("one of sixteen"), pin_mv);
        }
        let barometer: &mut Dps310 = part.i2c[i2c].chip_mut(BAROMETER).expect("attached");
        let [pressure] = handed.pressure.hand([signals.pressure], &impairments.barometer.pressure);
        barometer.set_pressure(pressure);
        barometer.set_temperature(signals.temperature);
        let compass: &mut Qmc5883l = part.i2c[i2c].chip_mut(COMPASS).expect("attached");
        let [x, y, z] = of_compass(handed.field.hand(signals.magnetic_field, &impairments.compass.field));
        compass.set_field(x, y, z);
        compass.set_temperature(signals.temperature);
        let receiver: &mut nmea::Receiver = part.usart[receiver.index].chip_mut().expect("attached");
        receiver.set_position(signals.position);
        receiver.set_velocity(signals.velocity);
    }

    fn condition(&mut self, impairments: &Impairments) {
        self.impairments = *impairments;
        let Some(Sensors { i2c, receiver, .. }) = Self::WIRING.sensors else { return };
        let part = &mut self.mcu.stm32;
        let are_there = [
            part.spi[SPI].silence(IMU, impairments.imus[0].silent),
            part.i2c[i2c].silence(BAROMETER, impairments.barometer.silent),
            part.i2c[i2c].silence(COMPASS, impairments.compass.silent),
            part.usart[receiver.index].silence(impairments.receiver.silent),
        ];
        // A fault of a part that is missing would do nothing, and its test flight would pass.
        assert_eq!(are_there, [true; 4]);
        let errors = part.usart[receiver.index].errors_mut();
        errors.noise = uart::Rate { name: "gps.noise_errors", per_million: impairments.receiver.noise_errors };
        errors.framing = uart::Rate { name: "gps.framing_errors", per_million: impairments.receiver.framing_errors };
        let sensed = self.sensed;
        self.sense(&sensed);
    }

    fn draw(&mut self, seed: u64, index: u64) {
        let F405 { impairments, handed, .. } = self;
        let moved = [
            handed.rate.draw(&impairments.imus[0].rate, &RATE_NOISE, seed, index),
            handed.force.draw(&impairments.imus[0].force, &FORCE_NOISE, seed, index),
            handed.field.draw(&impairments.compass.field, &FIELD_NOISE, seed, index),
            handed.pressure.draw(&impairments.barometer.pressure, &PRESSURE_NOISE, seed, index),
        ];
        if let Some(Sensors { receiver, .. }) = Self::WIRING.sensors {
            self.mcu.stm32.usart[receiver.index].errors_mut().seed = seed;
        }
        if moved.contains(&true) {
            let sensed = self.sensed;
            self.sense(&sensed);
        }
    }

    fn drive(&mut self) -> Outputs<4> {
        let part = &mut self.mcu.stm32;
        Outputs(Self::WIRING.motors.map(|(name, timer, channel)| {
            let channel = Channel::new(channel).expect("one of four");
            let pulse = match timer {
                Timer::General(nth) => {
                    let (timer, registers) = part.timer(nth);
                    timer.pulse(channel, registers)
                }
                Timer::Advanced(nth) => {
                    let (timer, registers) = part.advanced_timer(nth);
                    timer.pulse(channel, registers)
                }
            };
            Actuator::on(name, pulse, CURVE)
        }))
    }
}

impl<const ROW: usize> Machine for F405<ROW> {
    /// IWDG_KR (RM0090, 21.4).
    const WATCHDOG: u64 = 0x4000_3000;
    const STORE: u64 = 0x0800_4000;
    const STORE_WORD: usize = 4;
    const STORES: bool = false;
    const MOTORS: Range<usize> = 0..4;
    const SIGNAL: Signal = Signal::Dshot600(Self::WIRING.timers);
    const IMUS: &'static [usize] = if Self::WIRING.sensors.is_some() { &[0] } else { &[] };
    const UART_INTERRUPTS: [u16; 2] = [Self::WIRING.link.interrupt, Self::WIRING.receiver().interrupt];
    const RECEIVER: Divider = Self::WIRING.receiver().divider;
    const JITTER: u64 = 300_000;
    const BATTERY_MV: Option<u16> = if Self::WIRING.sensors.is_some() { Some(16_800) } else { None };
    /// The USB core's fourth hardware configuration register.
    const UNMAPPED: &[u64] = &[0x5000_0050];
    const PORTS: u64 = 0x4002_0000;
    const STEADY: &'static [SteadyPin] = Self::WIRING.steady;
    /// OTG_FS_GINTSTS (RM0090, 34.16.2).
    const USB_STATUS: Option<u64> = Some(0x5000_0014);

    fn built() -> Result<Box<Self>, Error> {
        F405::new().map(Box::new)
    }

    fn motors(&mut self) -> Vec<Actuator> {
        self.drive().actuators().to_vec()
    }

    /// The second link is on USB.
    fn attach_second_link(&mut self, _: UartWire) -> bool {
        false
    }

    /// Attaches the wire to the UART that the board reserves for a radio receiver.
    fn attach_radio(&mut self, wire: UartWire) -> Option<f32> {
        self.mcu.stm32.usart[Self::WIRING.radio?].attach(wire);
        Some(0.0)
    }

    /// UART5, on all boards that have a UART for motor controllers.
    fn attach_escs(&mut self, wire: UartWire) {
        if Self::WIRING.sensors.is_some() {
            self.mcu.stm32.usart[7].attach(wire);
        }
    }

    fn attach_receiver(&mut self, receiver: Box<dyn Peer>) {
        self.mcu.stm32.usart[Self::WIRING.receiver().index].attach_boxed(receiver);
    }

    fn log_storage(&mut self) -> Option<&mut dyn LogStorage> {
        let LogWiring { storage, spi, .. } = Self::WIRING.logs?;
        let bus = &mut self.mcu.stm32.spi[spi];
        match storage {
            StorageKind::Card => bus.chip_mut::<SpiSlot>(LOGS).map(|card| &mut card.slot as &mut dyn LogStorage),
            StorageKind::Flash => bus.chip_mut::<FlashChip>(LOGS).map(|chip| chip as &mut dyn LogStorage),
        }
    }

    fn impair(&mut self, impairments: &Impairments) {
        self.condition(impairments);
    }

    fn link_errors(&mut self) -> &mut uart::Errors {
        self.mcu.stm32.usart[Self::WIRING.link.index].errors_mut()
    }
}

impl Wiring {
    /// Returns the GNSS receiver's UART. A board without a receiver returns one for which it has no pads.
    const fn receiver(&self) -> wiring::Uart {
        match self.sensors {
            Some(sensors) => sensors.receiver,
            None => UART4,
        }
    }
}
