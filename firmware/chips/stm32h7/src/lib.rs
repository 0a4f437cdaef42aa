//! What boards with an STM32H743 share, in whatever package. The chip's name is a feature of `embassy-stm32` that the
//! board sets.
#![no_std]

pub mod boot_loader;
pub mod clocks;
pub mod flash;
pub mod i2c;
pub mod reset;
