//! What the page may do.

use serde::{Deserialize, Serialize};

/// Something that the page wants done. Places are in the earth frame of the simulator: north, west, up.
///
/// Braces without a field: of what has none, serde would take any.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub enum PageCommand {
    /// Start the motors.
    Arm {},
    /// Stop the motors of a vehicle on the ground.
    Disarm {},
    /// Stop the motors, also in flight.
    Kill {},
    /// Arm, if need be, and climb to this height above where it stands.
    TakeOff {
        /// Height \[m\].
        height_m: f32,
    },
    /// Land where it is.
    Land {},
    /// Fly home and land.
    Return {},
    /// Hold where it is.
    Hold {},
    /// Fly to this place and hold there.
    GoTo {
        /// Place \[m\].
        position_m: [f32; 3],
    },
    /// Replace mission and geofence.
    Plan {
        /// Places of the mission, in order; none for no mission \[m\].
        #[serde(default)]
        waypoints_m: Vec<[f32; 3]>,
        /// Corners of the geofence; none for no fence \[m\].
        #[serde(default)]
        fence_m: Vec<[f32; 2]>,
    },
    /// Arm, if need be, and fly the mission.
    StartMission {},
    /// Set a parameter.
    Parameter {
        /// Its name.
        name: String,
        /// The value.
        value: f32,
    },
    /// Send the values of all parameters.
    Values {},
    /// Let AFBC fly again after its monitor has switched to the fallback law.
    Engage {},
    /// A line of the text protocol: weather, faults, laws, time.
    Line {
        /// The line.
        text: String,
    },
}
