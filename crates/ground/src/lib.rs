//! A ground station's end of the link, for simulators, servers, tools and tests: without socket, clock or thread.
//!
//! # Reading order
//!
//! 1. [`Client`]: a station or companion computer. Messages, bytes and times in, messages and bytes out.
//! 2. What it does for whoever uses it: commands that are repeated until they are answered ([`CommandState`]), uploads
//!    of missions, fences and rally points ([`UploadEnd`]), [`VehicleParameters`] read and set. [`Patience`]: for how
//!    long, and how often. Commands have the names and numbers of [`afbc_link::Command`].
//! 3. [`VehicleState`]: what the vehicle says of itself.
//! 4. [`bring_up`]: first steps with a board, propellers off.
#![forbid(unsafe_code)]

pub mod bring_up;
mod client;
mod commands;
mod parameters;
mod repeated;
mod uploads;
mod vehicle;

pub use client::Client;
pub use commands::{CommandState, PING};
pub use parameters::VehicleParameters;
pub use repeated::Patience;
pub use uploads::UploadEnd;
pub use vehicle::{VehicleState, VehicleText};
