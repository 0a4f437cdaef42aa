//! Reader of boards that are tables (`chip_stm32f4::flight_controller!`), and writer of the wiring tables on their
//! pages.

mod page;
mod read;

pub(crate) use page::{row, wiring};
pub(crate) use read::{Battery, BoardTable, LogBus, Motor, Stream, Timer};
