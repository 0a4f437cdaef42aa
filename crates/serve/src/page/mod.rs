//! State and commands of a [served vehicle](crate) for a web page, as JSON. This code has no socket, clock or thread:
//! `sitl serve --web` and WebAssembly both run it.
//!
//! # Reading order
//!
//! 1. [`VehicleDescription`]: the data that stay the same during a flight. [`PageFrame`]: the data that change, some
//!    thirty times a second.
//! 2. [`PageCommand`]: the commands of the page. Weather, faults, laws and time are lines of [`crate::command`]; the
//!    others are sent as a ground station's MAVLink messages.
//! 3. [`PageBackend`]: connects these messages to the vehicle.
//!
//! Axes: earth frame north, west, up; body frame forward, left, up. The earth frame is the simulator's. A vehicle may
//! estimate positions in a local frame of its own; these are shifted by its true position when it was armed.

mod backend;
mod command;
mod description;
mod frame;
mod local_frame;
mod plan;
mod station;
mod views;

pub use backend::{PageBackend, PageReply};
pub use command::PageCommand;
pub use description::{PageLaw, RotorPosition, VehicleDescription};
pub use frame::{
    Adaptation, AxisAdaptation, BatteryView, EstimateView, MotionView, PageFrame, PageText, ReferenceView, RotorView,
};
pub use plan::{FenceArea, MissionPoint};
