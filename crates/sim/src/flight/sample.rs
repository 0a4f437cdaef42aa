//! What a flight shows of each step.

use crate::trajectory::Reference;
use afbc_control::{Action, Estimate, Trace};
use afbc_plant::{Measurement, Motion, Telemetry};
use afbc_types::PerAxis;

/// Everything there is to know at one step.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// \[s\]
    pub time_s: f64,
    /// True motion.
    pub motion: Motion,
    /// What the sensors made of it; none if they are perfect.
    pub measurement: Option<Measurement>,
    /// What rotors, air and ground did in the step before; none of an ideal plant.
    pub telemetry: Option<Telemetry>,
    /// Where the vehicle should be.
    pub reference: Reference,
    /// What the controller decided.
    pub action: Action,
    /// Why.
    pub trace: Trace,
    /// What the law has learnt; zero for one that learns nothing.
    pub estimates: PerAxis<Estimate>,
}
