//! Boards that are a table (`chip_stm32f4::flight_controller!`): reading it, and its page's table of wires.

mod page;
mod read;

pub(crate) use page::{row, wiring};
pub(crate) use read::{Battery, BoardTable, LogBus, Motor, Stream, Timer};
