//! The black box on a memory card, or in flash.
//!
//! A [`LogWriter`], beside the task that hears of every tick, decides when there is a log ([`LogMode`]), lets an
//! [`crate::ulog::BlackBox`] write it, and cuts it into [`LogBlock`]s. A [`LogKeeper`], in a task that may wait for it,
//! keeps them: a [`CardKeeper`] in the files `LOG001.ULG`, `LOG002.ULG` and so on of a card's FAT volume, a
//! [`FlashKeeper`] in sectors of flash. Between them is a queue of blocks of the shell's; back comes what is known of
//! the storage ([`StorageState`]). Back come also logs, to be downloaded and erased: [`KeptLogs`] asks the keeper for
//! pages of them. Whatever a card or flash does costs log: a queue that is full, records, which the log counts as
//! dropouts; a failure, the end of its log.
//!
//! FAT is `embedded-sdmmc`'s, which can panic on a volume that is none; so a volume is checked before it is opened, and
//! the number of blocks that one call may touch is limited.

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
