//! Code shared by boards with an STM32H743 in any package. The board selects the chip by a feature of `embassy-stm32`.
#![no_std]

pub mod boot_loader;
pub mod clocks;
pub mod flash;
pub mod i2c;
pub mod reset;
