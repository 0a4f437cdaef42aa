//! Writes logs of a flight, beside the control ticks.
//!
//! - [`ulog`]: the black box, a log in PX4's ULog format, written tick by tick into a ring of bytes.
//! - [`storage`]: keeps the black box on board, in files on a memory card or in sectors of flash.
//! - [`exact`]: the exact log, from which the same ticks can be flown again to the last bit.
#![no_std]

pub mod exact;
pub mod storage;
pub mod ulog;
