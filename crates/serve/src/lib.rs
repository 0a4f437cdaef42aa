//! The vehicle as a server: the firmware's code on the simulated plant and its instruments, for the ground stations and
//! companion computers of other projects.
//!
//! # Reading order
//!
//! 1. [`ServedVehicle`]: one vehicle in its world, which stands on the ground until somebody flies it by MAVLink. Bytes
//!    in, bytes out, a millisecond at a time.
//! 2. [`Server`]: several vehicles, and [commands](command) that change weather and faults while they fly. Neither has
//!    a clock or a socket: the same lines and bytes at the same milliseconds give the same bytes.
//! 3. [`QgcPlan`]: a file of QGroundControl, and [`fly_plan`], a station that flies it.
//! 4. [`Ports`]: their UDP and TCP ports. [`Door`]: another way to them, such as a page. [`Pace`]: real time. [`run`]:
//!    all of it together. [`LineOutput`]: lines to whoever reads them, or does not.
//! 5. [`page`]: what a page in a browser sees and may do. `web`, a feature: the server that carries it to browsers.
#![forbid(unsafe_code)]

pub mod command;
mod door;
mod frames;
mod guide;
mod hand;
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
mod stand;
mod systems;
mod tcp;
mod udp;
mod vehicle;
mod waypoint_file;
#[cfg(feature = "web")]
pub mod web;
mod world_changes;

pub use door::{Door, TimeFlow, TimeRate};
pub use guide::guide;
pub use output::LineOutput;
pub use pace::{BEHIND_MAX, Pace, Wait};
pub use parameter_file::ParameterFile;
pub use plan_file::QgcPlan;
pub use plan_flight::{PlanEnd, fly_plan};
pub use ports::{Addresses, Ports};
pub use run::{Lines, RunEnd, run};
pub use server::{Reply, Server, Then};
pub use stand::{VEHICLES_MAX, fleet};
pub use vehicle::ServedVehicle;
pub use waypoint_file::is_waypoint_file;
