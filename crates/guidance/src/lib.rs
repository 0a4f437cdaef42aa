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
//! 4. [`failsafe`], [`fence`], [`battery`], [`notice`]: failsafe checks and announcements.
//! 5. [`settings`]: the parameters.
#![no_std]

pub mod actions;
pub mod available_thrust;
pub mod battery;
mod course;
pub mod failsafe;
pub mod fence;
pub mod guidance;
mod heading;
pub mod limiter;
mod mission;
pub mod mode;
mod mode_io;
pub mod notice;
mod offboard;
mod orbit;
pub mod order;
mod place;
pub mod settings;
mod shaper;
mod sticks;
pub mod table;

pub use actions::{BatteryAction, FenceAction, SensorsAction, StationAction, SticksAction, TargetsAction};
pub use available_thrust::AvailableThrust;
pub use battery::BatteryReading;
pub use failsafe::{FailedSensors, FailsafeSettings};
pub use fence::FenceStatus;
pub use guidance::{Guidance, GuidanceInputs, GuidanceOutputs};
pub use limiter::{Limiter, LimiterTarget};
pub use mode::FlightMode;
pub use notice::{FailsafeCause, GuidanceNotice, GuidanceNotices, ModeReason, Severity};
pub use orbit::ORBIT_RADIUS_M;
pub use order::{
    AttitudeTarget, Item, MotionTarget, OffboardTarget, OrbitHeading, Order, OrderRefusal, Orders, RequestedItem,
    Sticks,
};
pub use place::is_place;
pub use settings::{FlightModeSettings, MotionLimits, Settings};
pub use table::{FailsafeAction, TransitionInputs};
