//! Stores a few named values in two sectors of NOR flash: a vehicle's parameters that differ from the image's defaults.
//!
//! A value is a record of 28 bytes with a checksum, appended to the active sector. The last record of a name counts.
//! When the sector is full, its current records are copied to the other sector. That sector's header is written last
//! and makes it the active one. So after a power cut the store holds either the old values or the new one, and only a
//! sector that is not active is ever erased.
//!
//! **Only [`Store::make_room`] erases.** Call it at start-up: a processor that runs from the same flash stops during an
//! erase. Until the next start there is room for at least some hundred changes; after that [`Store::set`] returns an
//! error.
//!
//! The flash may be anything with the traits of `embedded-storage` and words of at most four bytes: a chip's own flash,
//! [`Ram`], or a file.
//!
//! ```
//! use afbc_store::{Ram, RecordName, Store};
//!
//! let mass = RecordName::new("V_MASS").unwrap();
//! let mut store = Store::open(Ram::<1024>::BLANK, 0, 42)?;
//! store.make_room()?;
//! store.set(mass, 0, Some(0.5_f32.to_bits()))?;
//!
//! let mut store = Store::open(store.into_flash(), 0, 42)?; // tomorrow
//! assert_eq!(store.get(mass)?.map(|(_, bits)| f32::from_bits(bits)), Some(0.5));
//! # Ok::<(), afbc_store::Error<embedded_storage::nor_flash::NorFlashErrorKind>>(())
//! ```
#![no_std]

mod ram;
mod record;
mod store;

pub use ram::Ram;
pub use record::{NAME_MAX, RecordName, hash};
pub use store::{Error, Store, StoreCondition};
