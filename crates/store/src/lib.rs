//! A few named values in two sectors of NOR flash: those of a vehicle's parameters that differ from its image's.
//!
//! A value is a record of 28 bytes with a checksum, appended to the active sector; the last one of a name counts. When
//! the sector is full, the records that count are copied to the other sector, whose header is written last: it makes
//! that sector the active one. So whatever a cut of power leaves of the last write, the store holds what it held before
//! or what was to be written, and an erase only ever concerns a sector that does not count.
//!
//! **Only [`Store::make_room`] erases**, to be called at start-up: a processor that runs from the same flash stands
//! still for as long as an erase takes. Until the next start there is room for some hundred changes at least, and
//! [`Store::set`] then says that there is none.
//!
//! The flash may be anything with the traits of `embedded-storage` and words of at most four bytes, such as a chip's
//! own, [`Ram`], or a file.
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
pub use store::{Error, Found, Store};
