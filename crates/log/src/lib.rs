//! Logs of a flight, written beside its control ticks.
//!
//! - [`ulog`]: the black box, PX4's ULog of a flight, tick by tick into a ring of bytes.
//! - [`storage`]: where the black box is kept on board: files on a memory card, sectors of flash.
//! - [`exact`]: the exact log, from which the same ticks are flown again to the last bit.
#![no_std]

pub mod exact;
pub mod storage;
pub mod ulog;
