//! Another way to the vehicles than their ports and lines.

use crate::server::{Server, Then};
use std::time::Duration;

/// How time goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimeRate {
    /// At so many times real time; 0: as fast as possible.
    Times(f64),
    /// By the command `step` alone.
    Lockstep,
}

/// How time goes on, and whether it stands still for now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeFlow {
    /// How it goes on.
    pub rate: TimeRate,
    /// True if it stands still until somebody says otherwise.
    pub paused: bool,
}

/// Another way to the vehicles than their ports and lines, such as a page. It never waits.
pub trait Door {
    /// Takes what has come, and sends what is due, at `now` since the start; returns what is left to do. Called between
    /// any two steps, and several times a second while time stands still.
    fn turn(&mut self, server: &mut Server, flow: TimeFlow, now: Duration, log: &mut dyn FnMut(&str)) -> Then;

    /// Takes what the vehicle at this place has sent in a step.
    fn sent(&mut self, vehicle: usize, bytes: &[u8]);
}

/// No such way.
impl Door for () {
    fn turn(&mut self, _: &mut Server, _: TimeFlow, _: Duration, _: &mut dyn FnMut(&str)) -> Then {
        Then::Nothing
    }

    fn sent(&mut self, _: usize, _: &[u8]) {}
}
