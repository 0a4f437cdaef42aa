//! Orders, targets, sticks and mission items that a station, a companion computer or a pilot may send.

use crate::fence::FenceStatus;
use crate::mode::FlightMode;
use afbc_flight_core::{Queue, Stamped};
use nalgebra::{UnitQuaternion, Vector2, Vector3};

/// Heading on an orbit: MAVLink's `ORBIT_YAW_BEHAVIOUR`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum OrbitHeading {
    /// Towards the centre.
    #[default]
    Centre,
    /// Keep the heading from before the orbit.
    Kept,
    /// Along the circle.
    Along,
}

/// A command that is answered once.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Order {
    /// Select this mode.
    Select(FlightMode),
    /// Take off to this height above the ground; `None` for the parameter's height \[m\].
    TakeOff(Option<f32>),
    /// Fly to this place and hold there. A NaN coordinate keeps its present value \[m\].
    GoTo {
        /// Place in the local frame \[m\].
        position_m: Vector3<f32>,
        /// Heading; NaN keeps the present one \[rad\].
        yaw_rad: f32,
        /// Horizontal speed; `None` for the parameter's \[m/s\].
        speed_m_s: Option<f32>,
    },
    /// Fly an orbit in mode hold.
    Orbit {
        /// Centre, at the orbit's height. A NaN coordinate keeps its present value \[m\].
        centre_m: Vector3<f32>,
        /// Radius, positive to fly counter-clockwise (to the left) \[m\].
        radius_m: f32,
        /// Speed along the circle; NaN for the parameter's \[m/s\].
        speed_m_s: f32,
        /// Angle to fly; 0 for an endless orbit \[deg\].
        angle_deg: u16,
        /// Heading on the orbit.
        heading: OrbitHeading,
    },
    /// Limit the horizontal speed until the mode changes \[m/s\].
    Speed(f32),
    /// Set home to this place of the local frame, or to the present one \[m\].
    Home(Option<Vector3<f32>>),
    /// Continue the mission at this item.
    Resume(u16),
}

/// Reason for refusing an order. The numbers are part of the link's protocol, together with those of
/// [`Refusal`](afbc_flight_core::Refusal).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum OrderRefusal {
    /// The position is not known.
    NoPosition = 32,
    /// The mode needs an armed vehicle.
    NotArmed = 33,
    /// The vehicle is on the ground.
    OnGround = 34,
    /// The vehicle is already flying.
    InFlight = 35,
    /// No fresh targets of a companion computer.
    NoTargets = 36,
    /// No fresh sticks of a pilot.
    NoSticks = 37,
    /// No mission, or no item of this number.
    NoMission = 38,
    /// The place is outside the geofence.
    OutsideFence = 39,
    /// A number is out of range.
    OutOfRange = 40,
    /// A failsafe is active, and this mode does not replace it.
    Failsafe = 41,
}

/// A target from a companion computer.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum OffboardTarget {
    /// A motion.
    Motion(MotionTarget),
    /// An attitude and a thrust.
    Attitude(AttitudeTarget),
}

/// A target of position, velocity or acceleration; NaN where not given.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MotionTarget {
    /// Position \[m\].
    pub position_m: Vector3<f32>,
    /// Velocity \[m/s\].
    pub velocity_m_s: Vector3<f32>,
    /// Acceleration \[m/s2\].
    pub acceleration_m_s2: Vector3<f32>,
    /// Heading \[rad\].
    pub yaw_rad: f32,
    /// Rate of the heading \[rad/s\].
    pub yaw_rate_rad_s: f32,
    /// True if the target is in the vehicle's level frame: forward, left and up, from the vehicle's position and
    /// heading.
    pub body: bool,
}

/// A target of attitude and thrust.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AttitudeTarget {
    /// Attitude.
    pub attitude: UnitQuaternion<f32>,
    /// Yaw rate; NaN to fly the attitude's heading \[rad/s\].
    pub yaw_rate_rad_s: f32,
    /// Thrust as a share of the rotors' largest, 0 to 1.
    pub thrust: f32,
}

/// Positions of a pilot's sticks, -1 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sticks {
    /// Roll: positive to the right.
    pub roll: f32,
    /// Pitch: positive forward.
    pub pitch: f32,
    /// Throttle: 0 holds the height.
    pub throttle: f32,
    /// Yaw: positive clockwise, seen from above.
    pub yaw: f32,
}

/// A mission item. Places are in the local frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Item {
    /// Take off to a height.
    TakeOff {
        /// Height in the local frame \[m\].
        height_m: f32,
    },
    /// Fly to a place.
    Waypoint {
        /// Place in the local frame \[m\].
        position_m: Vector3<f32>,
        /// Heading; NaN heads towards the place \[rad\].
        yaw_rad: f32,
        /// Time to stay at the place \[s\].
        hold_s: f32,
        /// Distance at which the place counts as reached; 0 for the parameter's \[m\].
        within_m: f32,
        /// True if the vehicle need not stop at the place.
        fly_through: bool,
    },
    /// Land at a place; NaN to land where the vehicle is.
    Land {
        /// Place in the local frame \[m\].
        position_m: Vector3<f32>,
    },
    /// Return home and land.
    Return,
    /// Set the horizontal speed \[m/s\].
    Speed(f32),
    /// Hold the place for a time \[s\].
    Wait(f32),
    /// Fly circles around a place.
    Turns {
        /// Centre in the local frame \[m\].
        centre_m: Vector3<f32>,
        /// Radius, positive to fly counter-clockwise (to the left); 0 for the default \[m\].
        radius_m: f32,
        /// Number of turns.
        turns: f32,
    },
    /// Turn in place.
    Yaw {
        /// Heading, or the angle to turn by, positive to the left \[rad\].
        yaw_rad: f32,
        /// True if `yaw_rad` is an angle to turn by.
        relative: bool,
        /// Direction: left if positive, right if negative, the shorter one if 0.
        direction: i8,
    },
    /// Set a region of interest that all later items head for; NaN ends it \[m\].
    Look {
        /// Place in the local frame \[m\].
        at_m: Vector3<f32>,
    },
    /// Continue with the item of this number.
    Jump(u16),
    /// No item: the mission was cleared.
    None,
    /// Climb straight up to a place's height, then fly there.
    TakeOffTo {
        /// Place in the local frame \[m\].
        position_m: Vector3<f32>,
    },
}

/// Mission item that the guidance has [requested](crate::Order::Resume).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RequestedItem {
    /// Number of the item.
    pub number: u16,
    /// Number of the upload of the mission, which tells missions apart.
    pub upload: u16,
    /// The item.
    pub item: Item,
    /// True for the mission's last item.
    pub is_last: bool,
}

/// Everything that the communication code passes to the guidance in a tick.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Orders {
    /// Newest target of a companion computer.
    pub target: Option<Stamped<OffboardTarget>>,
    /// Newest sticks of a pilot.
    pub sticks: Option<Stamped<Sticks>>,
    /// Mission item requested last.
    pub leg: Option<RequestedItem>,
    /// Time at which the controlling station was last heard; `None` if never \[us\].
    pub heard_us: Option<u64>,
    /// State of the uploaded geofence; `None` without one.
    pub fence: Option<FenceStatus>,
    /// Place where a return lands: the nearest of home and the rally points; `None` for home \[m\].
    pub safe_m: Option<Vector2<f32>>,
    /// Pending orders. Each tick of the guidance answers the oldest.
    pub given: Queue<Order>,
}
