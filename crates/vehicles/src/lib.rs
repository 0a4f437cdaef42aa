//! Vehicles as data. Each has a file in `vehicles/` at the workspace's root; this crate reads and checks these files.
//!
//! `docs/vehicles.md` describes every key of the format. Frames, units and signs are those of [`afbc_types`].
#![forbid(unsafe_code)]

mod built_in;
pub mod data_sheet;
mod file;
mod image;
pub mod parts;
mod vehicle;

pub use built_in::{BUILT_IN, built_in, unknown};
pub use file::{load, parse};
pub use vehicle::{CASCADE, Vehicle};
