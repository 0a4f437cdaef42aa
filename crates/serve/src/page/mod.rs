//! State and commands of a [served vehicle](crate) for a web page, as JSON. This code has no socket, clock or thread:
//! `sitl serve --web` and WebAssembly both run it.
//!
//! # Reading order
//!
//! 1. [`PageHello`]: the data that stay the same during a flight. [`PageFrame`]: the data that change, some thirty
//!    times a second.
//! 2. [`PageCommand`]: the commands of the page. Weather, faults, laws and time are lines of [`crate::command`]; the
//!    others are sent as a ground station's MAVLink messages.
//! 3. [`Cockpit`]: connects these messages to the vehicle.
//!
//! Axes: earth frame north, west, up; body frame forward, left, up. The earth frame is the simulator's. A vehicle may
//! estimate positions in a local frame of its own; these are shifted by its true position when it was armed.

mod cockpit;
mod command;
mod frame;
mod hello;
mod local_frame;
mod outlook;
mod plan;
mod station;

pub use cockpit::{Cockpit, PageReply};
pub use command::PageCommand;
pub use frame::{
    Adaptation, AxisAdaptation, BatteryView, EstimateView, MotionView, PageFrame, PageText, ReferenceView, RotorView,
};
pub use hello::{PageHello, PageLaw, RotorPlace};
pub use plan::{FenceArea, MissionPoint};
