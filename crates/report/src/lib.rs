//! What flights leave behind: tables for the terminal, and in a folder CSV, JSON, figures and a page.
//!
//! [`flights`], [`compare`] and [`campaign`] each `write` a folder and make a `table`. The same flights give the same bytes:
//! nothing here knows the time of day or the machine.
#![forbid(unsafe_code)]

pub mod campaign;
pub mod claims;
pub mod compare;
mod csv;
mod figures;
pub mod flights;
mod groups;
mod reality;
mod report;
pub mod results;
mod summary;
mod table;
mod words;
