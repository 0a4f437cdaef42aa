//! Code shared by boards with an STM32F405 or a relative (F407, F415, F427). The board selects the chip by a feature of
//! `embassy-stm32`.
#![no_std]

pub mod boot_loader;
pub mod clocks;
pub mod converter;
mod flight_controller;
pub mod i2c;
pub mod reset;
