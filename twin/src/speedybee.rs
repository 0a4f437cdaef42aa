//! The SpeedyBee F405 V4, of the models of an STM32F427, which has nearly the STM32F405's map and shares its manual.
//!
//! Wired as ArduPilot's description of the board (`speedybeef4v4`) and its maker's manual have it; the alignment of the
//! inertial sensor is Betaflight's `CW90`. At I2C1 and USART6 there is the usual module with receiver and compass.
//! Where the part differs from the board's:
//!
//! | here | on the board |
//! |---|---|
//! | 2 MiB of flash, 256 KiB of RAM, 91 interrupts | 1 MiB, 192 KiB, 82 |
//! | identity of an STM32F42x (`DBGMCU_IDCODE`) | of an STM32F405 |
//! | DPS310 | SPL06-001, with the same registers |
//! | no USB | USB on PA11 and PA12 |

use crate::machine::{Divider, FrameTimer, Machine, Signal};
use crate::wire::Wire;
use rigless::chip::dps310::{Dps310, Sdo};
use rigless::chip::icm42688p::Icm42688p;
use rigless::chip::nmea;
use rigless::chip::qmc5883l::Qmc5883l;
use rigless::chip::uart::Peer;
use rigless::chip::{Placed, uart};
use rigless::cpu;
use rigless::device::{ErasedDevice, Level, ResetCause};
use rigless::edge::{Condition, Edge, Field, Sensed};
use rigless::machine::armv7m;
use rigless::machine::flight::{AT_REST, Actuate, Actuator, Curve, Outputs, SIGNAL_FIELDS, Signals};
use rigless::machine::{Board, HostWire, Target};
use rigless::mcu::Mcu;
use rigless::snapshot::Store;
use rigless::soc::stm32f427::Stm32f427;
use rigless::soc::stm32f427::generated::dma2::{self, s0cr};
use rigless::soc::stm32f427::generated::i2c3::{self, cr1, cr2};
use rigless::soc::stm32f427::peripherals::CONTROLLERS;
use rigless::soc::stm32f427::peripherals::dma::Dma;
use rigless::soc::stm32f427::peripherals::gpio::Pin;
use rigless::soc::stm32f427::peripherals::spi::Select;
use rigless::soc::stm32f427::peripherals::tim::{Channel, UPDATE_REQUEST};
use rigless::soc::{Bus, Error};
use rigless::time::VirtualNanos;
use std::num::{NonZeroU32, NonZeroU64};
use std::ops::Range;
use std::sync::LazyLock;

type Wiring = rigless::soc::stm32f427::peripherals::dma::Wire;

const CRYSTAL_HZ: u64 = 8_000_000;
const RAIL_MV: u32 = 3_300;
/// SPI1 with its select, PA4; I2C1; USART3; USART6.
const IMU: usize = 0;
const SELECT: (&str, u8) = ("GPIOA", 4);
const I2C: usize = 0;
const LINK: usize = 2;
const RECEIVER: usize = 3;
const LINK_WIRE: HostWire = HostWire { name: "serial1", port: 5760 };
/// Barometer and compass on I2C1.
const BAROMETER: usize = 0;
const COMPASS: usize = 1;
/// Motors 1 to 4: TIM4, channels 1 and 2; TIM3, channels 3 and 4. Of the timers 2 to 5.
const MOTORS: [(&str, usize, u8); 4] = [("PWM1", 2, 1), ("PWM2", 2, 2), ("PWM3", 1, 3), ("PWM4", 1, 4)];
const CURVE: Curve = Curve { zero: VirtualNanos(1_000_000), full: VirtualNanos(2_000_000) };

/// What the updates of TIM3 and TIM4 ask of DMA1 (RM0090, table 42), which the models leave out; and what they have.
static DMA1: LazyLock<Vec<Wiring>> = LazyLock::new(|| {
    let timer = |instance, channel, streams| Wiring { instance, request: UPDATE_REQUEST, channel, streams };
    let timers = [timer("TIM3", 5, &[2]), timer("TIM4", 2, &[6])];
    CONTROLLERS[0].wiring.iter().copied().chain(timers).collect()
});

/// The microcontroller, with what the models of its relative leave out: DMA serves the motors' timers, and an I2C does
/// not acknowledge the last byte that DMA reads (`LAST`: RM0090, 27.3.7), without which it reads one byte more, which
/// the next transfer takes for its first.
#[derive(Debug)]
pub struct Part {
    stm32: Stm32f427,
    /// Where I2C1 and DMA1 are on its bus.
    i2c: usize,
    dma: usize,
}

impl Part {
    fn new() -> Result<Self, Error> {
        let stm32 = Stm32f427::new()?;
        let [i2c, dma] = [stm32.bus().slot("I2C1")?, stm32.bus().slot("DMA1")?];
        let mut part = Part { stm32, i2c, dma };
        part.wire();
        Ok(part)
    }

    /// Withholds the acknowledgement of the byte that I2C1 is reading, if it is the last for the stream that DMA1 has
    /// for it, 0. Asked for before the model is told that the byte has come.
    fn withhold_acknowledgement(&mut self, slot: usize) {
        if slot != self.i2c {
            return;
        }
        let bus = self.stm32.bus_mut();
        let stream = bus.slots()[self.dma].registers();
        let is_last = s0cr::EN.is_set(stream.get(dma2::Register::S0cr)) && stream.get(dma2::Register::S0ndtr) == 1;
        let registers = bus.slot_mut(self.i2c).registers_mut();
        let control = registers.get(i2c3::Register::Cr2);
        if is_last && cr2::LAST.is_set(control) && cr2::DMAEN.is_set(control) {
            let control = registers.get(i2c3::Register::Cr1);
            registers.set(i2c3::Register::Cr1, cr1::ACK.set(control, 0));
        }
    }

    fn wire(&mut self) {
        self.stm32.dma[0] = Dma::new(&DMA1, CONTROLLERS[0].last_data, CONTROLLERS[0].reaches_memory);
    }
}

impl Mcu for Part {
    fn bus(&self) -> &Bus {
        self.stm32.bus()
    }

    fn bus_mut(&mut self) -> &mut Bus {
        self.stm32.bus_mut()
    }

    fn reset(&mut self, at: VirtualNanos, cause: ResetCause) {
        self.stm32.reset(at, cause);
        self.wire();
    }

    fn poll(&mut self, now: VirtualNanos) {
        self.stm32.poll(now);
    }

    fn split(&mut self, slot: usize) -> (&mut Bus, Option<&mut dyn ErasedDevice>) {
        self.withhold_acknowledgement(slot);
        self.stm32.split(slot)
    }
}

/// What can be wrong with the board's chips.
#[derive(Clone, Copy, Debug, Default)]
pub struct Conditions {
    pub icm42688p_silent: bool,
    pub icm42688p_rate: Condition<3>,
    pub icm42688p_acceleration: Condition<3>,
    pub dps310_silent: bool,
    pub dps310_pressure: Condition<1>,
    pub qmc5883l_silent: bool,
    pub qmc5883l_field: Condition<3>,
    pub gps_silent: bool,
    /// Words in a million that arrive from the receiver with noise.
    pub gps_noise_errors: u32,
}

/// What the chips were given last, on the body's axes.
#[derive(Debug, Default)]
struct Handed {
    rate: Sensed<i32, 3>,
    acceleration: Sensed<i32, 3>,
    field: Sensed<i32, 3>,
    pressure: Sensed<u32, 1>,
}

/// The board.
#[derive(Debug)]
pub struct SpeedyBeeF405V4 {
    pub mcu: Part,
    conditions: Conditions,
    handed: Handed,
    sensed: Signals,
}

impl SpeedyBeeF405V4 {
    /// Returns the board as it is built, at rest.
    pub fn new() -> Result<Self, Error> {
        let mut board = SpeedyBeeF405V4 {
            mcu: Part::new()?,
            conditions: Conditions::default(),
            handed: Handed::default(),
            sensed: AT_REST,
        };
        let part = &mut board.mcu.stm32;
        part.rcc.attach_crystals(CRYSTAL_HZ, 0);
        part.set_supply(RAIL_MV);
        let (port, pin) = SELECT;
        let select = Select { port, pin: Pin::new(pin).expect("one of sixteen pins"), active: Level::Low };
        part.spi[IMU].attach_selected(Icm42688p::new(), select);
        part.i2c[I2C].attach(Dps310::new(Sdo::Low));
        part.i2c[I2C].attach(Qmc5883l::new());
        part.usart[RECEIVER].attach(nmea::Receiver::new());
        board.sense(&AT_REST);
        Ok(board)
    }

    /// The core, as that of every STM32F4 (PM0214).
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

/// No snapshots are taken of it.
impl Store for SpeedyBeeF405V4 {}

impl Board for SpeedyBeeF405V4 {
    fn name(&self) -> &'static str {
        "speedybeef405v4"
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
            self.mcu.stm32.usart[LINK].attach_boxed(peer);
        }
        is_link
    }

    fn host_mut(&mut self, name: &str) -> Option<&mut dyn Peer> {
        if name == LINK_WIRE.name { self.mcu.stm32.usart[LINK].peer_mut() } else { None }
    }
}

/// The body's axes as the inertial sensor has them: its x points to the right, its z up.
fn of_imu([x, y, z]: [i32; 3]) -> [i32; 3] {
    [y, x, z.saturating_neg()]
}

/// The body's axes as the compass of the module has them: its x points to the right, its z down.
fn of_compass([x, y, z]: [i32; 3]) -> [i32; 3] {
    [y, x.saturating_neg(), z]
}

impl Edge for SpeedyBeeF405V4 {
    type Signals = Signals;
    type Outputs = Outputs<4>;
    type Conditions = Conditions;
    const FIELDS: &'static [Field] = SIGNAL_FIELDS;
    const OUTPUT_FIELDS: &'static [Field] = Outputs::<4>::FIELDS;
    const REST: Signals = AT_REST;
    const CHIPS: &'static [&'static str] = &["icm42688p", "gps"];

    fn place(&mut self, chip: usize) -> Option<&mut dyn Placed> {
        match chip {
            0 => self.mcu.stm32.spi[IMU].place_mut(0),
            1 => self.mcu.stm32.usart[RECEIVER].place_mut(),
            _ => None,
        }
    }

    fn sense(&mut self, signals: &Signals) {
        self.sensed = *signals;
        let SpeedyBeeF405V4 { mcu: Part { stm32: part, .. }, conditions, handed, .. } = self;
        let imu: &mut Icm42688p = part.spi[IMU].chip_mut(0).expect("attached");
        let [x, y, z] = of_imu(handed.rate.hand(signals.angular_rate, &conditions.icm42688p_rate));
        imu.set_rate(x, y, z);
        let force = handed.acceleration.hand(signals.specific_force, &conditions.icm42688p_acceleration);
        let [x, y, z] = of_imu(force);
        imu.set_acceleration(x, y, z);
        imu.set_temperature(signals.temperature);
        let barometer: &mut Dps310 = part.i2c[I2C].chip_mut(BAROMETER).expect("attached");
        let [pressure] = handed.pressure.hand([signals.pressure], &conditions.dps310_pressure);
        barometer.set_pressure(pressure);
        barometer.set_temperature(signals.temperature);
        let compass: &mut Qmc5883l = part.i2c[I2C].chip_mut(COMPASS).expect("attached");
        let [x, y, z] = of_compass(handed.field.hand(signals.magnetic_field, &conditions.qmc5883l_field));
        compass.set_field(x, y, z);
        compass.set_temperature(signals.temperature);
        let receiver: &mut nmea::Receiver = part.usart[RECEIVER].chip_mut().expect("attached");
        receiver.set_position(signals.position);
        receiver.set_velocity(signals.velocity);
    }

    fn condition(&mut self, conditions: &Conditions) {
        self.conditions = *conditions;
        let part = &mut self.mcu.stm32;
        let are_there = [
            part.spi[IMU].silence(0, conditions.icm42688p_silent),
            part.i2c[I2C].silence(BAROMETER, conditions.dps310_silent),
            part.i2c[I2C].silence(COMPASS, conditions.qmc5883l_silent),
            part.usart[RECEIVER].silence(conditions.gps_silent),
        ];
        assert_eq!(are_there, [true; 4]);
        part.usart[RECEIVER].errors_mut().noise =
            uart::Rate { name: "gps.noise_errors", per_million: conditions.gps_noise_errors };
        let sensed = self.sensed;
        self.sense(&sensed);
    }

    fn drive(&mut self) -> Outputs<4> {
        let part = &mut self.mcu.stm32;
        Outputs(MOTORS.map(|(name, timer, channel)| {
            let (timer, registers) = part.timer(timer);
            Actuator::on(name, timer.pulse(Channel::new(channel).expect("one of four"), registers), CURVE)
        }))
    }
}

impl Machine for SpeedyBeeF405V4 {
    /// RM0090, 21.4.
    const WATCHDOG: u64 = 0x4000_3000;
    const STORE: u64 = 0x0800_4000;
    const STORE_WORD: usize = 4;
    const STORES: bool = false;
    const MOTORS: Range<usize> = 0..4;
    /// DMA1's streams 6 and 2, for TIM4 and TIM3 (RM0090, 10.5.5).
    const SIGNAL: Signal = Signal::Dshot600(&[
        FrameTimer { counter: 0x4000_0800, stream: 0x4002_60A0, motors: 0..2 },
        FrameTimer { counter: 0x4000_0400, stream: 0x4002_6040, motors: 2..4 },
    ]);
    /// USART6 (RM0090, 30.6.3), on APB2.
    const RECEIVER: Divider = Divider { register: 0x4001_1408, clock_hz: 84_000_000 };
    const JITTER: u64 = 300_000;
    const BATTERY_MV: Option<u16> = None;
    /// USB: the core's fourth hardware configuration register.
    const UNMAPPED: &[u64] = &[0x5000_0050];

    fn built() -> Result<Box<Self>, Error> {
        SpeedyBeeF405V4::new().map(Box::new)
    }

    fn motors(&mut self) -> Vec<Actuator> {
        self.drive().actuators().to_vec()
    }

    /// The second link is by USB.
    fn attach_second_link(&mut self, _: Wire) -> bool {
        false
    }

    fn attach_receiver(&mut self, receiver: Box<dyn Peer>) {
        self.mcu.stm32.usart[RECEIVER].attach_boxed(receiver);
    }
}
