//! Results of flights: tables for the terminal, and in a folder CSV, JSON, figures and a page.
//!
//! [`flights`], [`compare`], [`campaign`], [`replay`] and [`exact`] each have a function `write` for a folder and a
//! function `table`. The same flights give the same bytes: nothing depends on the time of day or the machine.
#![forbid(unsafe_code)]

pub mod campaign;
pub mod claims;
pub mod compare;
mod csv;
mod differences;
pub mod exact;
mod explore;
mod figures;
pub mod flights;
mod grid;
mod groups;
pub mod markers;
pub mod random;
mod reality;
pub mod replay;
mod report;
pub mod results;
pub mod rough;
pub mod suite;
mod summary;
mod table;
mod words;

pub use figures::contender_color;
pub use grid::TableFormat;
pub use table::for_terminal;
