//! Simulated vehicles as a server: the firmware's code flies a simulated plant with its instruments, and ground
//! stations and companion computers of other projects connect to it.
//!
//! # Reading order
//!
//! 1. [`ServedVehicle`]: one vehicle in its world. It stands on the ground until somebody flies it by MAVLink. It takes
//!    and returns bytes, one millisecond at a time.
//! 2. [`Server`]: several vehicles, and [commands](command) that change weather and faults while they fly. Neither has
//!    a clock or a socket: the same lines and bytes at the same milliseconds give the same bytes.
//! 3. [`QgcPlan`]: a QGroundControl plan, and [`fly_plan`], a ground station that flies it.
//! 4. [`Ports`]: the vehicles' UDP and TCP ports. [`ServerHook`]: other access to the vehicles, such as a web page.
//!    [`Pace`]: real time. [`run`]: all of these together. [`LineOutput`]: output lines that never block.
//! 5. [`page`]: what a web page shows and may command. `web` (a feature): the HTTP server that brings it to browsers.
#![forbid(unsafe_code)]

pub mod command;
mod fleet;
mod frames;
mod guide;
mod handheld;
mod hook;
mod output;
mod pace;
pub mod page;
mod parameter_file;
mod peer;
mod plan_file;
mod plan_flight;
mod ports;
mod reported_sensors;
mod run;
mod server;
mod systems;
mod tcp;
mod udp;
mod vehicle;
mod waypoint_file;
#[cfg(feature = "web")]
pub mod web;
mod world_changes;

pub use fleet::{VEHICLES_MAX, fleet};
pub use guide::guide;
pub use hook::{ServerHook, TimeFlow, TimeRate};
pub use output::LineOutput;
pub use pace::{BEHIND_MAX, Pace, Wait};
pub use parameter_file::ParameterFile;
pub use plan_file::QgcPlan;
pub use plan_flight::{PlanEnd, fly_plan};
pub use ports::{Addresses, Ports};
pub use run::{InputLines, Interfaces, RunEnd, run};
pub use server::{LineReply, Server, ServerAction};
pub use vehicle::ServedVehicle;
pub use waypoint_file::is_waypoint_file;
