//! What boards with an STM32H743 or a relative (H750, H753) share. The chip's name is a feature of `embassy-stm32` that
//! the board sets.
#![no_std]

pub mod clocks;
pub mod flash;
pub mod reset;
