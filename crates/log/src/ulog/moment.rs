//! What is logged of a tick.

use crate::ulog::known::Known;
use afbc_estimator::Origin;
use afbc_guidance::{BatteryReading, Sticks};
use afbc_onboard::{ControlInputs, EscTelemetry, FlightView, Readings, Report};
use afbc_types::{Pose, ROTORS_MAX, Stamped, State};
use nalgebra::Vector3;

/// Inputs of a tick that are logged, to be taken before it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TakenInputs {
    pub(crate) pose: Option<Stamped<Pose>>,
    pub(crate) sticks: Option<Stamped<Sticks>>,
    pub(crate) battery: Option<BatteryReading>,
}

impl TakenInputs {
    /// Returns those of a tick's inputs.
    pub fn of(inputs: &ControlInputs) -> Self {
        TakenInputs { pose: inputs.inbox.pose().copied(), sticks: inputs.orders.sticks, battery: inputs.battery }
    }
}

/// A tick: what it took, and what it gave.
#[derive(Clone, Copy, Debug)]
pub struct LoggedTick<'a, const N: usize = 4> {
    /// Its report.
    pub report: &'a Report<N>,
    /// What the sensors had read.
    pub readings: &'a Readings,
    /// What messages had brought.
    pub taken: TakenInputs,
    /// What the flight knows after it.
    pub view: &'a FlightView,
    /// What the motor controllers have told, if there is a line for it.
    pub escs: Option<&'a EscTelemetry>,
    /// Place on the earth from which fixes of a GNSS receiver are measured, once it is known.
    pub origin: Option<Origin>,
}

/// A tick of a vehicle with any number of rotors.
#[derive(Clone, Copy)]
pub(crate) struct Moment<'a> {
    pub(crate) report: &'a Report<ROTORS_MAX>,
    pub(crate) readings: &'a Readings,
    pub(crate) taken: &'a TakenInputs,
    pub(crate) view: &'a FlightView,
    pub(crate) escs: Option<&'a EscTelemetry>,
    pub(crate) origin: Option<Origin>,
    pub(crate) known: &'a Known,
}

impl Moment<'_> {
    pub(crate) fn now_us(&self) -> u64 {
        self.report.time_us
    }

    /// Returns the state: the vehicle's own estimate of it once there is one, or what the flight core flies on.
    pub(crate) fn state(&self) -> Option<State> {
        let FlightView { estimate, state, .. } = self.view;
        match estimate {
            Some(estimate) => Some(estimate.state).filter(|_| estimate.unready.is_none()),
            None => *state,
        }
    }

    /// Returns the time at which the state was true.
    pub(crate) fn state_us(&self) -> u64 {
        self.view.estimate.as_ref().map_or(self.now_us(), |estimate| estimate.at_us)
    }

    /// Returns the attitude as a quaternion w, x, y, z, between PX4's frames.
    pub(crate) fn attitude(&self) -> Option<[f32; 4]> {
        let state = self.state()?;
        let quaternion = || {
            let q = state.quaternion().coords;
            [q.w, q.x, q.y, q.z]
        };
        Some(flip_turn(self.view.estimate.as_ref().map_or_else(quaternion, |estimate| estimate.attitude)))
    }

    /// Returns where on the earth the local frame's origin is.
    pub(crate) fn reference(&self) -> Option<[f64; 3]> {
        let origin = self.origin?;
        Some(origin.global(&self.view.origin_m?))
    }
}

/// Turns a vector from either frame into the other, by half a turn about x.
pub(crate) fn flip(v: Vector3<f32>) -> [f32; 3] {
    [v.x, -v.y, -v.z]
}

/// Turns an attitude from either pair of frames into the other.
pub(crate) fn flip_turn([w, x, y, z]: [f32; 4]) -> [f32; 4] {
    [w, x, -y, -z]
}
