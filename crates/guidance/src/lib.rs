//! Guidance: turns flight modes, orders, targets and sticks into a setpoint for the control law.
//!
//! A station, a companion computer or a pilot selects a [flight mode](FlightMode) and gives [orders](Order), targets
//! and sticks. Frames and units are those of [`afbc_types`]. docs/modes.md describes every mode and transition,
//! docs/failsafes.md every failsafe.
//!
//! # Reading order
//!
//! 1. [`guidance`]: the tick.
//! 2. [`mode`], [`order`]: flight modes and orders; [`table`]: the transitions between modes.
//! 3. [`limiter`]: turns any target into a smooth flight.
//! 4. [`net`], [`fence`], [`battery`], [`notice`]: failsafe checks and announcements.
//! 5. [`settings`]: the parameters.
#![no_std]

pub mod actions;
pub mod battery;
mod course;
pub mod fence;
pub mod guidance;
mod heading;
pub mod lift;
pub mod limiter;
mod mission;
pub mod mode;
mod mode_io;
pub mod net;
pub mod notice;
mod orbit;
pub mod order;
mod place;
pub mod settings;
mod shaper;
mod sticks;
pub mod table;
mod targets;

pub use actions::{BatteryAction, FenceAction, SensorsAction, StationAction, SticksAction, TargetsAction};
pub use battery::BatteryReading;
pub use fence::FenceView;
pub use guidance::{Guidance, GuidanceInputs, Guided};
pub use lift::Lift;
pub use limiter::{Limiter, LimiterTarget};
pub use mode::FlightMode;
pub use net::{FailedSensors, Net};
pub use notice::{Cause, ModeReason, Notice, Notices, Severity};
pub use orbit::ORBIT_RADIUS_M;
pub use order::{
    AttitudeTarget, Item, Leg, MotionTarget, OffboardTarget, OrbitHeading, Order, OrderRefusal, Orders, Sticks,
};
pub use place::is_place;
pub use settings::{Flying, Limits, Settings};
pub use table::{FailsafeAction, TransitionInputs};
