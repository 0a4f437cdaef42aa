//! The black box on a memory card.
//!
//! A [`LogWriter`], beside the task that hears of every tick, decides when there is a log ([`LogMode`]), lets an
//! [`afbc_ulog::BlackBox`] write it, and cuts it into [`LogBlock`]s. A [`LogKeeper`], in a task that may wait for its
//! card, writes blocks into the files `LOG001.ULG`, `LOG002.ULG` and so on of a FAT volume. Between them is a queue of
//! blocks of the shell's; back comes what is known of the card ([`CardState`]). Back come also logs, to be
//! downloaded and erased: [`CardLogs`] asks the keeper for pages of them. Whatever a card does costs log: a queue
//! that is full, records, which the log counts as dropouts; a card that fails, the end of its file.
//!
//! FAT is `embedded-sdmmc`'s, which can panic on a volume that is none; so a volume is checked before it is opened, and
//! the number of blocks that one call may touch is limited.
#![no_std]

mod block;
mod card;
mod keeper;
mod query;
mod reader;
mod volume;
mod writer;

pub use block::{BLOCK_BYTES, BlockSink, LogBlock};
pub use card::{CardError, CardState, LogCard};
pub use embedded_sdmmc;
pub use keeper::{LogKeeper, log_name};
pub use query::{CardAnswer, CardLogs, LogPage, LogPages, LogQuery, PAGE_BYTES};
pub use writer::{LogWriter, STAGING};

pub use afbc_onboard::LogMode;
