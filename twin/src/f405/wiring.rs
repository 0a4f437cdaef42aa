//! The boards with an STM32F405: what of each matters to its models.
//!
//! Wired as ArduPilot's and Betaflight's descriptions of the boards and their makers' manuals have them. An inertial
//! sensor's turns are Betaflight's alignments.

use crate::machine::{Divider, FrameTimer};
use crate::steady::Steady::{Output, PulledUp};
use crate::steady::SteadyPin;

/// A board.
#[derive(Clone, Copy, Debug)]
pub struct Wiring {
    pub name: &'static str,
    pub link: Uart,
    /// The UART that is left to a radio receiver, among the part's.
    pub radio: Option<usize>,
    /// None has sensors of its own: its state comes over the link.
    pub sensors: Option<Sensors>,
    /// Where it keeps logs.
    pub logs: Option<LogWiring>,
    /// Pins that must not float: RX of its UARTs, and what switches its Bluetooth.
    pub steady: &'static [SteadyPin],
    /// The timers of its motors, with DMA.
    pub timers: &'static [FrameTimer],
    /// Name, timer and channel of motors 1 to 4.
    pub motors: [(&'static str, Timer, u8); 4],
}

/// A UART.
#[derive(Clone, Copy, Debug)]
pub struct Uart {
    /// Its place among the part's.
    pub index: usize,
    pub divider: Divider,
    pub interrupt: u16,
}

/// Sensors: the IMU on SPI1, the others on one I2C.
#[derive(Clone, Copy, Debug)]
pub struct Sensors {
    pub imu: Inertial,
    /// Port and pin that select it.
    pub select: (&'static str, u8),
    /// Quarters by which it is turned clockwise, seen from above.
    pub quarter_turns: u8,
    /// The I2C among the part's, and the stream of DMA1 that receives from it.
    pub i2c: usize,
    pub i2c_stream: usize,
    pub receiver: Uart,
    pub battery: Battery,
}

/// Where the battery's voltage, by a divider of 11, and current come in: channels of the converter, and amperes of a
/// volt, in tenths.
#[derive(Clone, Copy, Debug)]
pub struct Battery {
    pub channels: [u8; 2],
    pub deciamperes_per_volt: u32,
}

/// What keeps logs on an SPI: its place among the part's, and port and pin that select it.
#[derive(Clone, Copy, Debug)]
pub struct LogWiring {
    pub storage: StorageKind,
    pub spi: usize,
    pub select: (&'static str, u8),
}

/// A slot of a memory card, or a flash chip.
#[derive(Clone, Copy, Debug)]
pub enum StorageKind {
    Card,
    Flash,
}

/// An inertial sensor.
#[derive(Clone, Copy, Debug)]
pub enum Inertial {
    Icm42688p,
    Bmi270,
    /// An ICM-20608-G that calls itself another part of its family.
    Relabelled(u8),
}

/// A timer among those of the part of its kind: TIM2 to TIM5, or TIM1 and TIM8.
#[derive(Clone, Copy, Debug)]
pub enum Timer {
    General(usize),
    Advanced(usize),
}

/// RX of the usual UARTs: of USART2, USART3, UART5 and USART6 (RM0090).
const RX2: SteadyPin = (0, 3, PulledUp);
const RX3: SteadyPin = (2, 11, PulledUp);
const RX5: SteadyPin = (3, 2, PulledUp);
const RX6: SteadyPin = (2, 7, PulledUp);
/// And of USART1 and UART4.
const RX1: SteadyPin = (0, 10, PulledUp);
const RX4: SteadyPin = (0, 1, PulledUp);
/// The enable pin of Bluetooth.
const QUIET_PB11: SteadyPin = (1, 11, Output(false));
const QUIET_PC3: SteadyPin = (2, 3, Output(false));

const TIM3: Timer = Timer::General(1);
const TIM4: Timer = Timer::General(2);
const TIM5: Timer = Timer::General(3);
const TIM8: Timer = Timer::Advanced(1);

/// Registers and interrupts: RM0090, 30.6.3 and table 62.
const USART1: Uart = uart(0, 0x4001_1008, 84_000_000, 37);
const USART3: Uart = uart(2, 0x4000_4808, 42_000_000, 39);
const USART6: Uart = uart(3, 0x4001_1408, 84_000_000, 71);
pub const UART4: Uart = uart(6, 0x4000_4C08, 42_000_000, 52);

const fn uart(index: usize, register: u64, clock_hz: u64, interrupt: u16) -> Uart {
    Uart { index, divider: Divider { register, clock_hz }, interrupt }
}

/// Of TIM3 with DMA1's stream 2, TIM4 and TIM5 with its stream 6, TIM8 with DMA2's stream 1 (RM0090, 10.5.5).
const fn tim3(motors: [usize; 2]) -> FrameTimer {
    FrameTimer { counter: 0x4000_0400, stream: 0x4002_6040, motors: motors[0]..motors[1], lines: None }
}

const fn tim4(motors: [usize; 2]) -> FrameTimer {
    FrameTimer { counter: 0x4000_0800, stream: 0x4002_60A0, motors: motors[0]..motors[1], lines: None }
}

const TIM5_LAST: FrameTimer = FrameTimer { counter: 0x4000_0C00, stream: 0x4002_60A0, motors: 2..4, lines: None };
const TIM8_ALL: FrameTimer = FrameTimer { counter: 0x4001_0400, stream: 0x4002_6428, motors: 0..4, lines: None };
const TIM4_ALL: FrameTimer = tim4([0, 4]);
const TIM4_TIM3: &[FrameTimer] = &[tim4([0, 2]), tim3([2, 4])];
const ALL_OF_TIM8: [(&str, Timer, u8); 4] = [("M1", TIM8, 1), ("M2", TIM8, 2), ("M3", TIM8, 3), ("M4", TIM8, 4)];

/// ArduPilot's `speedybeef4v3`.
const SPEEDYBEE_V3: Wiring = Wiring {
    name: "speedybeef405v3",
    link: USART3,
    radio: Some(1),
    sensors: Some(Sensors {
        imu: Inertial::Bmi270,
        select: ("GPIOA", 4),
        quarter_turns: 0,
        i2c: 1,
        i2c_stream: 3,
        receiver: USART6,
        battery: Battery { channels: [10, 11], deciamperes_per_volt: 259 },
    }),
    logs: Some(LogWiring { storage: StorageKind::Card, spi: 1, select: ("GPIOA", 15) }),
    steady: &[RX2, RX3, RX5, RX6, QUIET_PC3],
    timers: &[TIM4_ALL],
    motors: [("M1", TIM4, 1), ("M2", TIM4, 2), ("M3", TIM4, 3), ("M4", TIM4, 4)],
};

/// ArduPilot's `speedybeef4v4`.
const SPEEDYBEE_V4: Wiring = Wiring {
    name: "speedybeef405v4",
    link: USART3,
    radio: Some(1),
    sensors: Some(Sensors {
        imu: Inertial::Icm42688p,
        select: ("GPIOA", 4),
        quarter_turns: 1,
        i2c: 0,
        i2c_stream: 0,
        receiver: USART6,
        battery: Battery { channels: [10, 11], deciamperes_per_volt: 250 },
    }),
    logs: Some(LogWiring { storage: StorageKind::Card, spi: 2, select: ("GPIOC", 14) }),
    steady: &[RX2, RX3, RX5, RX6, QUIET_PB11],
    timers: TIM4_TIM3,
    motors: [("M1", TIM4, 1), ("M2", TIM4, 2), ("M3", TIM3, 3), ("M4", TIM3, 4)],
};

/// Betaflight's `SPEEDYBEEF405MINI`.
const SPEEDYBEE_MINI: Wiring = Wiring {
    name: "speedybeef405mini",
    sensors: Some(Sensors {
        imu: Inertial::Icm42688p,
        select: ("GPIOA", 4),
        quarter_turns: 3,
        i2c: 0,
        i2c_stream: 0,
        receiver: USART6,
        battery: Battery { channels: [10, 11], deciamperes_per_volt: 400 },
    }),
    logs: Some(LogWiring { storage: StorageKind::Flash, spi: 2, select: ("GPIOC", 14) }),
    motors: [("M1", TIM4, 1), ("M2", TIM4, 2), ("M3", TIM3, 4), ("M4", TIM3, 3)],
    ..SPEEDYBEE_V4
};

/// ArduPilot's `MatekF405-SE`. Its MPU-6000 is an ICM-20608-G by another name.
const MATEK_SE: Wiring = Wiring {
    name: "matekf405se",
    link: USART1,
    radio: Some(1),
    sensors: Some(Sensors {
        imu: Inertial::Relabelled(0x68),
        select: ("GPIOA", 4),
        quarter_turns: 3,
        i2c: 0,
        i2c_stream: 0,
        receiver: USART6,
        battery: Battery { channels: [10, 11], deciamperes_per_volt: 559 },
    }),
    logs: Some(LogWiring { storage: StorageKind::Card, spi: 2, select: ("GPIOC", 14) }),
    steady: &[RX1, RX2, RX5, RX6],
    timers: TIM4_TIM3,
    motors: [("M1", TIM4, 2), ("M2", TIM4, 1), ("M3", TIM3, 3), ("M4", TIM3, 4)],
};

/// ArduPilot's `MatekF405-STD`, with the newest of the IMUs that it is sold with.
const MATEK_STD: Wiring = Wiring {
    name: "matekf405std",
    link: USART1,
    radio: Some(1),
    sensors: Some(Sensors {
        imu: Inertial::Icm42688p,
        select: ("GPIOC", 2),
        quarter_turns: 2,
        i2c: 0,
        i2c_stream: 0,
        receiver: USART3,
        battery: Battery { channels: [15, 14], deciamperes_per_volt: 559 },
    }),
    logs: Some(LogWiring { storage: StorageKind::Card, spi: 2, select: ("GPIOC", 1) }),
    steady: &[RX1, RX2, RX3, RX5],
    timers: &[TIM8_ALL],
    motors: ALL_OF_TIM8,
};

/// Betaflight's `KAKUTEF4V2`. Its ICM-20689 is an ICM-20608-G by another name.
const KAKUTE: Wiring = Wiring {
    name: "kakutef4v2",
    link: USART1,
    radio: Some(2),
    sensors: Some(Sensors {
        imu: Inertial::Relabelled(0x98),
        select: ("GPIOC", 4),
        quarter_turns: 3,
        i2c: 0,
        i2c_stream: 5,
        receiver: UART4,
        battery: Battery { channels: [13, 12], deciamperes_per_volt: 364 },
    }),
    logs: None,
    steady: &[RX1, (1, 11, PulledUp), RX4, RX5],
    timers: &[tim3([0, 2]), TIM5_LAST],
    motors: [("M1", TIM3, 3), ("M2", TIM3, 4), ("M3", TIM5, 4), ("M4", TIM5, 3)],
};

/// `firmware/boards/stm32f405`: no sensors.
const PLAIN: Wiring = Wiring {
    name: "stm32f405",
    link: USART1,
    radio: None,
    sensors: None,
    logs: None,
    steady: &[RX1],
    timers: &[TIM8_ALL],
    motors: ALL_OF_TIM8,
};

/// All.
pub const WIRINGS: [Wiring; 7] = [SPEEDYBEE_V3, SPEEDYBEE_V4, SPEEDYBEE_MINI, MATEK_SE, MATEK_STD, KAKUTE, PLAIN];
