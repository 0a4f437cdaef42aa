//! A ground station's end of the link, for simulators, servers, tools and tests. It has no socket, clock or thread.
//!
//! # Reading order
//!
//! 1. [`Client`]: a station or companion computer. Messages, bytes and times go in; messages and bytes come out.
//! 2. Services of the client: commands that are repeated until they are answered ([`CommandState`]), uploads of
//!    missions, fences and rally points ([`UploadEnd`]), and parameters ([`VehicleParameters`]). [`RetryPolicy`] says
//!    how often and for how long to try. Commands have the names and numbers of [`afbc_mavlink::VehicleCommand`].
//! 3. [`VehicleState`]: the state that the vehicle reports.
//! 4. [`bring_up`]: first checks of a board, with the propellers off.
#![forbid(unsafe_code)]

pub mod bring_up;
mod client;
mod commands;
mod parameters;
mod retry;
mod uploads;
mod vehicle;

pub use client::Client;
pub use commands::{CommandState, PING};
pub use parameters::VehicleParameters;
pub use retry::RetryPolicy;
pub use uploads::UploadEnd;
pub use vehicle::{VehicleState, VehicleText};
