//! Data of each board on which its times depend: its core, links and parts. `tests/timing.rs` compares the data with
//! `firmware/boards/`.

use super::bus::{BusKind, BusScript, script};
use super::cycles::{CORTEX_M4F, CORTEX_M7, CoreCycles};
use super::known::{self, KnownLateness};
use afbc_drivers::bmi270::Bmi270;
use afbc_drivers::bmp280::Bmp280;
use afbc_drivers::dps310::{Dps310, Spl06};
use afbc_drivers::icm426xx::{Icm42605, Icm42688p};
use afbc_drivers::lis3mdl::Lis3mdl;
use afbc_drivers::mpu::{Icm20602, Icm20608, Icm20689, Mpu6000, Mpu6500, Mpu9250};
use afbc_drivers::ms5611::Ms5611;
use afbc_drivers::qmc5883l::Qmc5883l;

/// Baud rate of a GNSS receiver: the highest that is tried.
const GNSS_BAUD: u64 = 230_400;
/// Bits per byte on a line: start, eight data bits, stop.
const BYTE_BITS: u64 = 10;
/// FIFO size of a UART of the STM32H743 \[bytes\] (RM0433, 48.3); `embassy-stm32` turns the FIFO on.
const FIFO_H743: u64 = 16;

/// Byte rate of a UART, with an interrupt for each byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RateOfUart {
    /// A link, with the baud rate of SER_TEL1_BAUD.
    Link,
    /// A GNSS receiver.
    Gnss,
}

impl RateOfUart {
    /// Returns the time per byte \[ns\]; `link_baud` is the links' baud rate.
    #[must_use]
    pub fn byte_ns(self, link_baud: u64) -> u64 {
        let baud = match self {
            RateOfUart::Link => link_baud,
            RateOfUart::Gnss => GNSS_BAUD,
        };
        BYTE_BITS * 1_000_000_000 / baud.max(1)
    }
}

/// Returns the links' default baud rate.
#[must_use]
pub fn default_baud() -> u64 {
    afbc_onboard::Link::default().baud.into()
}

/// Name of the boards defined by a pin table, which count as one board with all of their parts.
pub const TABLES: &str = "flight controllers with an STM32F405";

/// A kind of board.
#[derive(Debug)]
pub struct BoardTimes {
    /// Folder name in `firmware/boards/`, or [`TABLES`] for the boards defined by a pin table.
    pub name: &'static str,
    /// Core of the board.
    pub core: &'static CoreCycles,
    /// Number of links by UART.
    pub links: usize,
    /// Bytes that a UART keeps until its interrupt runs, in addition to the byte that is arriving.
    pub uart_keeps: u64,
    /// True if the board has sensors.
    pub senses: bool,
    /// Number of timers with motors.
    pub timers: u64,
    /// True if the board receives the motor controllers' answers (bidirectional DSHOT).
    pub answers: bool,
    /// Instructions of the sampling task and everything that it can reach, each counted once.
    pub sampling: u64,
    /// Instructions of the slow sensors' task and everything that it can reach, each counted once.
    pub aiding: u64,
    /// Functions that return the readings of the board's parts, including all candidates.
    parts: &'static [fn() -> BusScript],
    /// Number of parts, from the first on, that the sampling task reads.
    pub sampled: usize,
    /// True if only one of the sampled parts is on the board.
    pub is_one: bool,
    /// Rows that are known to be late.
    pub known: &'static [KnownLateness],
}

impl BoardTimes {
    /// Returns the readings of the board's parts.
    #[must_use]
    pub fn scripts(&self) -> Vec<BusScript> {
        self.parts.iter().map(|part| part()).collect()
    }
}

/// Clock of APB2 on an STM32F405 or F427, which feeds SPI1 \[Hz\].
const SPI1_HZ: u32 = 84_000_000;
/// Clock of APB1, which feeds SPI2 \[Hz\].
const SPI2_HZ: u32 = 42_000_000;
/// SPI input clock on the STM32H743 \[Hz\]: the board divides it by eight.
const SPI_H743_HZ: u32 = 25_000_000;

macro_rules! parts {
    ($($part:ty: $wire:expr),+ $(,)?) => { &[$(|| script::<$part>($wire)),+] };
}

/// All boards. The tasks' instruction counts are from the images of commit 464c7b1.
pub static BOARDS: [BoardTimes; 4] = [
    BoardTimes {
        name: "stm32f405",
        core: &CORTEX_M4F,
        links: 1,
        uart_keeps: 1,
        senses: false,
        timers: 1,
        answers: false,
        sampling: 0,
        aiding: 0,
        parts: &[],
        sampled: 0,
        is_one: false,
        known: &known::COMMON,
    },
    BoardTimes {
        name: TABLES,
        core: &CORTEX_M4F,
        links: 1,
        uart_keeps: 1,
        senses: true,
        timers: 2,
        answers: false,
        sampling: 7_096,
        aiding: 23_085,
        parts: parts![
            Icm42688p<true>: BusKind::Spi(SPI1_HZ),
            Bmi270: BusKind::Spi(SPI1_HZ),
            Icm20602: BusKind::Spi(SPI1_HZ),
            Icm20689: BusKind::Spi(SPI1_HZ),
            Mpu6000: BusKind::Spi(SPI1_HZ),
            Mpu6500: BusKind::Spi(SPI1_HZ),
            Spl06: BusKind::I2c,
            Dps310: BusKind::I2c,
            Bmp280: BusKind::I2c,
            Qmc5883l: BusKind::I2c,
        ],
        sampled: 6,
        is_one: true,
        known: &known::COMMON,
    },
    BoardTimes {
        name: "pixracer",
        core: &CORTEX_M4F,
        links: 2,
        uart_keeps: 1,
        senses: true,
        timers: 2,
        answers: false,
        sampling: 12_624,
        aiding: 24_825,
        parts: parts![
            Icm20608: BusKind::Spi(SPI1_HZ),
            Mpu9250: BusKind::Spi(SPI1_HZ),
            Lis3mdl: BusKind::Spi(SPI1_HZ),
            Ms5611: BusKind::Spi(SPI2_HZ),
            Qmc5883l: BusKind::I2c,
        ],
        sampled: 3,
        is_one: false,
        known: &known::PIXRACER,
    },
    BoardTimes {
        name: "stm32h743",
        core: &CORTEX_M7,
        links: 2,
        uart_keeps: FIFO_H743,
        senses: true,
        timers: 2,
        answers: true,
        sampling: 7_552,
        aiding: 23_515,
        parts: parts![
            Icm42688p<true>: BusKind::Spi(SPI_H743_HZ),
            Icm42605<true>: BusKind::Spi(SPI_H743_HZ),
            Dps310: BusKind::I2c,
            Qmc5883l: BusKind::I2c,
        ],
        sampled: 2,
        is_one: false,
        known: &known::COMMON,
    },
];
