//! Results of flights: tables for the terminal; and CSV, JSON, figures and an HTML page in a folder.
//!
//! [`flights`], [`compare`], [`campaign`], [`replay`] and [`exact`] each have a function `write` for a folder and a
//! function `table`. The same flights give the same bytes: nothing depends on the time of day or the machine.
#![forbid(unsafe_code)]
#![cfg_attr(
    not(all(feature = "campaigns", feature = "replays")),
    allow(dead_code, unused_imports, reason = "some of what reports share is used by those left out only")
)]

#[cfg(feature = "campaigns")]
pub mod campaign;
pub mod claims;
#[cfg(feature = "campaigns")]
pub mod compare;
mod csv;
#[cfg(feature = "campaigns")]
mod differences;
#[cfg(feature = "replays")]
pub mod exact;
mod explore;
mod figures;
pub mod flights;
mod grid;
mod groups;
pub mod markers;
#[cfg(feature = "campaigns")]
pub mod random;
mod reality;
#[cfg(feature = "replays")]
pub mod replay;
mod report;
pub mod results;
#[cfg(feature = "campaigns")]
pub mod rough;
#[cfg(feature = "campaigns")]
pub mod suite;
mod summary;
mod table;
mod words;

pub use figures::contender_color;
pub use grid::TableFormat;
pub use table::for_terminal;
