//! What a page in a browser sees of a [served vehicle](crate) and may do with it, as JSON. There is no socket,
//! clock or thread here: `sitl serve --web` and WebAssembly run the same code.
//!
//! # Reading order
//!
//! 1. [`PageHello`]: what does not change while the vehicle flies. [`PageFrame`]: what does, some thirty times a
//!    second.
//! 2. [`PageCommand`]: what the page may do. Weather, faults, laws and time are the lines of [`crate::command`];
//!    the rest is what ground stations do, by the same messages.
//! 3. [`Cockpit`]: the end of all this at the vehicle.
//!
//! Axes are those of the workspace: earth frame north, west, up; body frame forward, left, up. The earth frame is the
//! simulator's: what the vehicle estimates in a local frame of its own is shifted by where it stood when it was armed.

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
