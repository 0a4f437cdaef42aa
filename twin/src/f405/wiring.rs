//! Wiring of the boards with an STM32F405, as far as the models need it.
//!
//! Sources: ArduPilot's and Betaflight's descriptions of the boards, and the manufacturers' manuals. The rotations of
//! the inertial sensors are Betaflight's alignments.

use crate::machine::{Divider, FrameTimer};
use crate::steady::Steady::{Output, PulledUp};
use crate::steady::SteadyPin;

/// Wiring of a board.
#[derive(Clone, Copy, Debug)]
pub struct Wiring {
    pub name: &'static str,
    pub link: Uart,
    /// Index of the UART left for a radio receiver, among the chip's UARTs.
    pub radio: Option<usize>,
    /// Sensors; `None` for a board whose state comes over the link.
    pub sensors: Option<Sensors>,
    /// Storage of the logs.
    pub logs: Option<LogWiring>,
    /// Pins that must not float: RX of the board's UARTs, and the switch of its Bluetooth module.
    pub steady: &'static [SteadyPin],
    /// Timers of the motors, with their DMA.
    pub timers: &'static [FrameTimer],
    /// Name, timer and channel of motors 1 to 4.
    pub motors: [(&'static str, Timer, u8); 4],
}

/// UART of a board.
#[derive(Clone, Copy, Debug)]
pub struct Uart {
    /// Index among the chip's UARTs.
    pub index: usize,
    pub divider: Divider,
    pub interrupt: u16,
}

/// Sensors of a board: the IMU on SPI1, the others on one I2C.
#[derive(Clone, Copy, Debug)]
pub struct Sensors {
    pub imu: InertialModel,
    /// Port and pin of its chip select.
    pub select: (&'static str, u8),
    /// Clockwise quarter turns of the IMU, seen from above.
    pub quarter_turns: u8,
    /// Index of the I2C among the chip's, and number of the DMA1 stream that receives from it.
    pub i2c: usize,
    pub i2c_stream: usize,
    pub receiver: Uart,
    pub battery: BatteryWiring,
}

/// Converter channels of the battery's voltage (by a divider of 11) and current, and the current per volt at the pin
/// \[0.1 A/V\].
#[derive(Clone, Copy, Debug)]
pub struct BatteryWiring {
    pub channels: [u8; 2],
    pub deciamperes_per_volt: u32,
}

/// Storage of logs on an SPI: its kind, index of the SPI among the chip's, and port and pin of its chip select.
#[derive(Clone, Copy, Debug)]
pub struct LogWiring {
    pub storage: StorageKind,
    pub spi: usize,
    pub select: (&'static str, u8),
}

/// Kind of log storage: a memory card or a flash chip.
#[derive(Clone, Copy, Debug)]
pub enum StorageKind {
    Card,
    Flash,
}

/// Model of inertial sensor.
#[derive(Clone, Copy, Debug)]
pub enum InertialModel {
    Icm42688p,
    Bmi270,
    /// An ICM-20608-G with the identity of another part of its family.
    Relabelled(u8),
}

/// Timer, with its index among the chip's timers of its kind: TIM2 to TIM5, or TIM1 and TIM8.
#[derive(Clone, Copy, Debug)]
pub enum Timer {
    General(usize),
    Advanced(usize),
}

/// RX pins of USART2, USART3, UART5 and USART6 (RM0090).
const RX2: SteadyPin = (0, 3, PulledUp);
const RX3: SteadyPin = (2, 11, PulledUp);
const RX5: SteadyPin = (3, 2, PulledUp);
const RX6: SteadyPin = (2, 7, PulledUp);
/// RX pins of USART1 and UART4.
const RX1: SteadyPin = (0, 10, PulledUp);
const RX4: SteadyPin = (0, 1, PulledUp);
/// Enable pin of the Bluetooth module, held low.
const QUIET_PB11: SteadyPin = (1, 11, Output(false));
const QUIET_PC3: SteadyPin = (2, 3, Output(false));

const TIM3: Timer = Timer::General(1);
const TIM4: Timer = Timer::General(2);
const TIM5: Timer = Timer::General(3);
const TIM8: Timer = Timer::Advanced(1);

/// Divider registers and interrupts: RM0090, 30.6.3 and table 62.
const USART1: Uart = uart(0, 0x4001_1008, 84_000_000, 37);
const USART3: Uart = uart(2, 0x4000_4808, 42_000_000, 39);
const USART6: Uart = uart(3, 0x4001_1408, 84_000_000, 71);
pub const UART4: Uart = uart(6, 0x4000_4C08, 42_000_000, 52);

const fn uart(index: usize, register: u64, clock_hz: u64, interrupt: u16) -> Uart {
    Uart { index, divider: Divider { register, clock_hz }, interrupt }
}

/// Motor timers: TIM3 with stream 2 of DMA1, TIM4 and TIM5 with its stream 6, TIM8 with stream 1 of DMA2 (RM0090,
/// 10.5.5).
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
        imu: InertialModel::Bmi270,
        select: ("GPIOA", 4),
        quarter_turns: 0,
        i2c: 1,
        i2c_stream: 3,
        receiver: USART6,
        battery: BatteryWiring { channels: [10, 11], deciamperes_per_volt: 259 },
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
        imu: InertialModel::Icm42688p,
        select: ("GPIOA", 4),
        quarter_turns: 1,
        i2c: 0,
        i2c_stream: 0,
        receiver: USART6,
        battery: BatteryWiring { channels: [10, 11], deciamperes_per_volt: 250 },
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
        imu: InertialModel::Icm42688p,
        select: ("GPIOA", 4),
        quarter_turns: 3,
        i2c: 0,
        i2c_stream: 0,
        receiver: USART6,
        battery: BatteryWiring { channels: [10, 11], deciamperes_per_volt: 400 },
    }),
    logs: Some(LogWiring { storage: StorageKind::Flash, spi: 2, select: ("GPIOC", 14) }),
    motors: [("M1", TIM4, 1), ("M2", TIM4, 2), ("M3", TIM3, 4), ("M4", TIM3, 3)],
    ..SPEEDYBEE_V4
};

/// ArduPilot's `MatekF405-SE`. Its MPU-6000 is modelled by an ICM-20608-G with the MPU-6000's identity.
const MATEK_SE: Wiring = Wiring {
    name: "matekf405se",
    link: USART1,
    radio: Some(1),
    sensors: Some(Sensors {
        imu: InertialModel::Relabelled(0x68),
        select: ("GPIOA", 4),
        quarter_turns: 3,
        i2c: 0,
        i2c_stream: 0,
        receiver: USART6,
        battery: BatteryWiring { channels: [10, 11], deciamperes_per_volt: 559 },
    }),
    logs: Some(LogWiring { storage: StorageKind::Card, spi: 2, select: ("GPIOC", 14) }),
    steady: &[RX1, RX2, RX5, RX6],
    timers: TIM4_TIM3,
    motors: [("M1", TIM4, 2), ("M2", TIM4, 1), ("M3", TIM3, 3), ("M4", TIM3, 4)],
};

/// ArduPilot's `MatekF405-STD`, with the newest of the IMUs that it has been sold with.
const MATEK_STD: Wiring = Wiring {
    name: "matekf405std",
    link: USART1,
    radio: Some(1),
    sensors: Some(Sensors {
        imu: InertialModel::Icm42688p,
        select: ("GPIOC", 2),
        quarter_turns: 2,
        i2c: 0,
        i2c_stream: 0,
        receiver: USART3,
        battery: BatteryWiring { channels: [15, 14], deciamperes_per_volt: 559 },
    }),
    logs: Some(LogWiring { storage: StorageKind::Card, spi: 2, select: ("GPIOC", 1) }),
    steady: &[RX1, RX2, RX3, RX5],
    timers: &[TIM8_ALL],
    motors: ALL_OF_TIM8,
};

/// Betaflight's `KAKUTEF4V2`. Its ICM-20689 is modelled by an ICM-20608-G with the ICM-20689's identity.
const KAKUTE: Wiring = Wiring {
    name: "kakutef4v2",
    link: USART1,
    radio: Some(2),
    sensors: Some(Sensors {
        imu: InertialModel::Relabelled(0x98),
        select: ("GPIOC", 4),
        quarter_turns: 3,
        i2c: 0,
        i2c_stream: 5,
        receiver: UART4,
        battery: BatteryWiring { channels: [13, 12], deciamperes_per_volt: 364 },
    }),
    logs: None,
    steady: &[RX1, (1, 11, PulledUp), RX4, RX5],
    timers: &[tim3([0, 2]), TIM5_LAST],
    motors: [("M1", TIM3, 3), ("M2", TIM3, 4), ("M3", TIM5, 4), ("M4", TIM5, 3)],
};

/// Board of `firmware/boards/stm32f405`, without sensors.
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

/// All boards; the index is the row of `F405`.
pub const WIRINGS: [Wiring; 7] = [SPEEDYBEE_V3, SPEEDYBEE_V4, SPEEDYBEE_MINI, MATEK_SE, MATEK_STD, KAKUTE, PLAIN];
