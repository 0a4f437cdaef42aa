//! Commands that a web page may send.

use serde::{Deserialize, Serialize};

/// A command of the page. Places are in the simulator's earth frame: north, west, up.
///
/// Variants without fields have braces because serde would accept unknown fields for a unit variant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub enum PageCommand {
    /// Starts the motors.
    Arm {},
    /// Stops the motors of a vehicle on the ground.
    Disarm {},
    /// Stops the motors, also in flight.
    Kill {},
    /// Arms the vehicle if needed, and climbs.
    TakeOff {
        /// Height above the place where the vehicle stands \[m\].
        height_m: f32,
    },
    /// Lands at the current place.
    Land {},
    /// Flies home and lands.
    Return {},
    /// Holds the current position.
    Hold {},
    /// Flies to a place and holds there.
    GoTo {
        /// The place \[m\].
        position_m: [f32; 3],
    },
    /// Replaces the mission and the geofence.
    Plan {
        /// Places of the mission, in order; an empty list deletes the mission \[m\].
        #[serde(default)]
        waypoints_m: Vec<[f32; 3]>,
        /// Corners of the geofence; an empty list deletes the fence \[m\].
        #[serde(default)]
        fence_m: Vec<[f32; 2]>,
    },
    /// Arms the vehicle if needed, and flies the mission.
    StartMission {},
    /// Sets a parameter.
    Parameter {
        /// Name of the parameter.
        name: String,
        /// New value of the parameter.
        value: f32,
    },
    /// Requests the values of all parameters.
    Values {},
    /// Lets AFBC fly again after its monitor has switched to the fallback law.
    Engage {},
    /// Sends a line of the text protocol: weather, faults, laws, time.
    Line {
        /// Text of the line.
        text: String,
    },
}
