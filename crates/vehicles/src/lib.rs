//! Vehicles as data: a file for each, in `vehicles/` at the workspace's root, read and checked here.
//!
//! The format is described, key by key, in `docs/vehicles.md`. Frames, units and signs are those of [`afbc_types`].
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
