//! Keeps the black box on a memory card or in flash.
//!
//! A [`LogWriter`] runs beside the task that receives every tick's record. It decides when to log ([`LogMode`]), has a
//! [`crate::ulog::BlackBox`] write the log, and cuts the log into [`LogBlock`]s. A [`LogKeeper`] stores the blocks, in
//! a task that may block. A [`CardKeeper`] writes the files `LOG001.ULG`, `LOG002.ULG` and so on into a card's FAT
//! volume; a [`FlashKeeper`] writes sectors of flash. The firmware or host provides the queue of blocks between the two
//! tasks, and carries the storage's state back ([`StorageState`]). [`KeptLogs`] asks the keeper for pages of stored
//! logs, so that stations can download and erase them.
//!
//! A slow or failed storage never delays a tick. When the queue is full, records are dropped, and the log counts them
//! as dropouts. When the storage fails, the log ends.
//!
//! The FAT library, `embedded-sdmmc`, can panic on an invalid volume. Therefore a volume is checked before it is
//! opened, and the number of blocks that one call may touch is limited.

mod block;
mod card;
mod card_keeper;
mod card_reader;
mod flash;
mod flash_keeper;
mod keeper;
mod nor_chip;
mod query;
mod sector;
mod volume;
mod writer;

pub use block::{BLOCK_BYTES, BlockSink, LogBlock};
pub use card::{CardError, LogCard};
pub use card_keeper::{CardKeeper, log_name};
pub use embedded_sdmmc;
pub use flash::{FlashFailed, LogFlash, PROGRAM_BYTES, SECTOR_BYTES};
pub use flash_keeper::FlashKeeper;
pub use keeper::{LogKeeper, StorageState};
pub use nor_chip::NorChip;
pub use query::{KeeperAnswer, KeptLogs, LogPage, LogPages, LogQuery, PAGE_BYTES};
pub use writer::{LogWriter, STAGING};

pub use afbc_onboard::LogMode;
