//! What a flight knows, for logs.

use afbc_control::Trace;
use afbc_estimator::{Aids, Estimate};
use afbc_types::State;
use nalgebra::Vector3;

/// What a [`Flight`](crate::Flight) knows after a tick, beside the tick's [`Report`](crate::Report).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlightView {
    /// The law's internal signals: only inputs while blind, zeros while disarmed.
    pub trace: Trace,
    /// The estimate with its uncertainty and validity; none without an inertial sensor.
    pub estimate: Option<Estimate>,
    /// What the estimator makes of each kind of measurement.
    pub aids: Aids,
    /// The local frame's origin in the frame of the GNSS receiver, from the first usable fix on \[m\].
    pub origin_m: Option<Vector3<f32>>,
    /// The newest state that the flight core believes.
    pub state: Option<State>,
    /// True if an armed vehicle is to rest on the ground.
    pub idle_on_ground: bool,
}
