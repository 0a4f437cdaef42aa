//! What is logged of a tick.

use crate::ulog::known::Known;
use afbc_estimator::Origin;
use afbc_onboard::{EscTelemetry, Report, TickDetails};
use afbc_types::{ROTORS_MAX, State};
use nalgebra::Vector3;

/// What is logged beside a tick: the control task does not know it.
#[derive(Clone, Copy, Debug, Default)]
pub struct BesideTick<'a> {
    /// What the motor controllers have told, if there is a line for it.
    pub escs: Option<&'a EscTelemetry>,
    /// Place on the earth from which fixes of a GNSS receiver are measured, once it is known.
    pub origin: Option<Origin>,
}

/// A tick of a vehicle with any number of rotors.
#[derive(Clone, Copy)]
pub(crate) struct Moment<'a> {
    pub(crate) report: &'a Report<ROTORS_MAX>,
    pub(crate) details: &'a TickDetails,
    pub(crate) beside: BesideTick<'a>,
    pub(crate) known: &'a Known,
}

impl Moment<'_> {
    pub(crate) fn now_us(&self) -> u64 {
        self.report.time_us
    }

    /// Returns the state: the vehicle's own estimate of it once there is one, or what the flight core flies on.
    pub(crate) fn state(&self) -> Option<State> {
        let TickDetails { estimate, state, .. } = self.details;
        match estimate {
            Some(estimate) => Some(estimate.state).filter(|_| estimate.unready.is_none()),
            None => *state,
        }
    }

    /// Returns the time at which the state was true.
    pub(crate) fn state_us(&self) -> u64 {
        self.details.estimate.as_ref().map_or(self.now_us(), |estimate| estimate.at_us)
    }

    /// Returns the attitude as a quaternion w, x, y, z, between PX4's frames.
    pub(crate) fn attitude(&self) -> Option<[f32; 4]> {
        let state = self.state()?;
        let quaternion = || {
            let q = state.quaternion().coords;
            [q.w, q.x, q.y, q.z]
        };
        Some(flip_turn(self.details.estimate.as_ref().map_or_else(quaternion, |estimate| estimate.attitude)))
    }

    /// Returns where on the earth the local frame's origin is.
    pub(crate) fn reference(&self) -> Option<[f64; 3]> {
        let origin = self.beside.origin?;
        Some(origin.global(&self.details.origin_m?))
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
