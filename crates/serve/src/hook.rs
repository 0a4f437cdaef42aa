//! The interface through which something other than ports and text lines reaches the vehicles.

use crate::server::{Server, ServerAction};
use std::time::Duration;

/// Speed of the simulated time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimeRate {
    /// This multiple of real time; 0: as fast as possible.
    Times(f64),
    /// Time advances only by the command `step`.
    Lockstep,
}

/// Speed of the simulated time, and whether it is paused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeFlow {
    /// Speed of the simulated time.
    pub rate: TimeRate,
    /// True while the simulation is paused.
    pub paused: bool,
}

/// Access to the vehicles other than by ports and text lines, such as by a web page. It must never block.
pub trait ServerHook {
    /// Handles what has arrived and sends what is due. `now` is the time since the start. Returns what the caller must
    /// do. Called between any two steps, and several times a second during a pause.
    fn update(&mut self, server: &mut Server, flow: TimeFlow, now: Duration, log: &mut dyn FnMut(&str))
    -> ServerAction;

    /// Takes the bytes that the vehicle with this index sent in a step.
    fn sent(&mut self, vehicle: usize, bytes: &[u8]);
}

/// A hook that does nothing.
impl ServerHook for () {
    fn update(&mut self, _: &mut Server, _: TimeFlow, _: Duration, _: &mut dyn FnMut(&str)) -> ServerAction {
        ServerAction::Nothing
    }

    fn sent(&mut self, _: usize, _: &[u8]) {}
}
