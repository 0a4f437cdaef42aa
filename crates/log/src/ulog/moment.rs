//! Collects the data of a tick for the topics.

use crate::ulog::known::Known;
use afbc_estimator::GeodeticOrigin;
use afbc_onboard::{EscTelemetry, Report, TickDetails};
use afbc_types::State;
use nalgebra::Vector3;

/// Data that is logged with a tick but unknown to the control task.
#[derive(Clone, Copy, Debug, Default)]
pub struct BesideTick<'a> {
    /// Telemetry of the motor controllers (ESCs), if there is a telemetry line.
    pub escs: Option<&'a EscTelemetry>,
    /// Geographic origin of the GNSS fixes, once it is known.
    pub origin: Option<GeodeticOrigin>,
}

/// A tick of a vehicle with any number of rotors.
#[derive(Clone, Copy)]
pub(crate) struct Moment<'a> {
    pub(crate) report: &'a Report,
    pub(crate) details: &'a TickDetails,
    pub(crate) beside: BesideTick<'a>,
    pub(crate) known: &'a Known,
}

impl Moment<'_> {
    pub(crate) fn now_us(&self) -> u64 {
        self.report.time_us
    }

    /// Returns the state: the onboard estimate once it is ready, or the state from the link on vehicles without an
    /// estimator.
    pub(crate) fn state(&self) -> Option<State> {
        let TickDetails { estimate, state, .. } = self.details;
        match estimate {
            Some(estimate) => Some(estimate.state).filter(|_| estimate.unready.is_none()),
            None => *state,
        }
    }

    /// Returns the time for which the state is valid \[us\].
    pub(crate) fn state_us(&self) -> u64 {
        self.details.estimate.as_ref().map_or(self.now_us(), |estimate| estimate.at_us)
    }

    /// Returns the attitude as a quaternion w, x, y, z in PX4's frames.
    pub(crate) fn attitude(&self) -> Option<[f32; 4]> {
        let state = self.state()?;
        let quaternion = || {
            let q = state.quaternion().coords;
            [q.w, q.x, q.y, q.z]
        };
        Some(flip_turn(self.details.estimate.as_ref().map_or_else(quaternion, |estimate| estimate.attitude)))
    }

    /// Returns latitude \[deg\], longitude \[deg\] and height \[m\] of the local frame's origin.
    pub(crate) fn reference(&self) -> Option<[f64; 3]> {
        let origin = self.beside.origin?;
        Some(origin.global(&self.details.origin_m?))
    }
}

/// Converts a vector between this project's and PX4's frames, in either direction: half a turn about x.
pub(crate) fn flip(v: Vector3<f32>) -> [f32; 3] {
    [v.x, -v.y, -v.z]
}

/// Converts an attitude between this project's and PX4's frames, in either direction.
pub(crate) fn flip_turn([w, x, y, z]: [f32; 4]) -> [f32; 4] {
    [w, x, -y, -z]
}
