//! What a station, a companion computer or a pilot may ask for.

use crate::fence::FenceView;
use crate::mode::FlightMode;
use afbc_flight_core::{Queue, Stamped};
use nalgebra::{UnitQuaternion, Vector2, Vector3};

/// Where the vehicle heads on a circle: `ORBIT_YAW_BEHAVIOUR` of MAVLink.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum OrbitHeading {
    /// To the centre.
    #[default]
    Centre,
    /// Where it headed before.
    Kept,
    /// Along the circle.
    Along,
}

/// Something to be done, answered once.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Order {
    /// Fly in this mode.
    Select(FlightMode),
    /// Take off to this height above where it stands, or to that of the parameters \[m\].
    TakeOff(Option<f32>),
    /// Fly to this place and hold there; NaN keeps a coordinate \[m\].
    GoTo {
        /// Place in the local frame \[m\].
        position_m: Vector3<f32>,
        /// Heading; NaN keeps it \[rad\].
        yaw_rad: f32,
        /// Horizontal speed; none for that of the parameters \[m/s\].
        speed_m_s: Option<f32>,
    },
    /// Fly a circle in mode hold.
    Orbit {
        /// Its centre, at its height; NaN keeps a coordinate \[m\].
        centre_m: Vector3<f32>,
        /// Its radius, positive if it goes to the left \[m\].
        radius_m: f32,
        /// Speed along it; NaN for that of the parameters \[m/s\].
        speed_m_s: f32,
        /// Angle to fly; 0 for ever \[deg\].
        angle_deg: u16,
        /// Where the vehicle heads.
        heading: OrbitHeading,
    },
    /// Fly at most at this horizontal speed, until the mode changes \[m/s\].
    Speed(f32),
    /// Home is here, or at this place of the local frame \[m\].
    Home(Option<Vector3<f32>>),
    /// Go on with the mission at this item.
    Resume(u16),
}

/// Why an order is not carried out. The numbers are part of the link's protocol, beside those of
/// [`Refusal`](afbc_flight_core::Refusal).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum OrderRefusal {
    /// The vehicle does not know where it is.
    NoPosition = 32,
    /// The mode needs an armed vehicle.
    NotArmed = 33,
    /// The vehicle is on the ground.
    OnGround = 34,
    /// The vehicle flies already.
    InFlight = 35,
    /// No fresh targets of a companion computer.
    NoTargets = 36,
    /// No fresh sticks of a pilot.
    NoSticks = 37,
    /// No mission, or no such item.
    NoMission = 38,
    /// The place is outside the geofence.
    OutsideFence = 39,
    /// A number is out of range.
    OutOfRange = 40,
    /// A failsafe has the vehicle, and this mode is not above it.
    Failsafe = 41,
}

/// A companion computer's target.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum OffboardTarget {
    /// A motion.
    Motion(MotionTarget),
    /// An attitude and a thrust.
    Attitude(AttitudeTarget),
}

/// A target of position, velocity or acceleration: NaN where there is none.
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
    /// True if position and axes are those of the vehicle, level: forward, left, up.
    pub body: bool,
}

/// A target of attitude and thrust.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AttitudeTarget {
    /// Attitude.
    pub attitude: UnitQuaternion<f32>,
    /// Rate of the heading, NaN if the heading is the attitude's \[rad/s\].
    pub yaw_rate_rad_s: f32,
    /// Thrust, 0 to 1 of the most that the rotors give.
    pub thrust: f32,
}

/// A pilot's sticks, -1 to 1: to the right, forward, up, to the right.
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

/// An item of a mission, in the local frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Item {
    /// Take off to this height \[m\], local frame.
    TakeOff {
        /// Height in the local frame \[m\].
        height_m: f32,
    },
    /// Fly to a place.
    Waypoint {
        /// Place in the local frame \[m\].
        position_m: Vector3<f32>,
        /// Heading; NaN: towards the place \[rad\].
        yaw_rad: f32,
        /// Time to stay there \[s\].
        hold_s: f32,
        /// Distance at which it counts as reached; 0 for that of the parameters \[m\].
        within_m: f32,
        /// True if the vehicle need not stop there.
        fly_through: bool,
    },
    /// Land at a place; NaN: where it is.
    Land {
        /// Place in the local frame \[m\].
        position_m: Vector3<f32>,
    },
    /// Return home and land.
    Return,
    /// Change the horizontal speed \[m/s\].
    Speed(f32),
    /// Stay where it is for a time \[s\].
    Wait(f32),
    /// Fly circles around a place.
    Turns {
        /// Their centre in the local frame \[m\].
        centre_m: Vector3<f32>,
        /// Their radius, positive if they go to the left; 0 for the usual one \[m\].
        radius_m: f32,
        /// Their number.
        turns: f32,
    },
    /// Turn where it is.
    Yaw {
        /// Heading, or the angle to turn by, positive to the left \[rad\].
        yaw_rad: f32,
        /// True if it is an angle to turn by.
        relative: bool,
        /// Direction to turn in: to the left if positive, to the right if negative, the shorter one if 0.
        direction: i8,
    },
    /// Head for a place from now on, in whatever follows; NaN: no longer \[m\].
    Look {
        /// Place in the local frame \[m\].
        at_m: Vector3<f32>,
    },
    /// Go on with the item of this number.
    Jump(u16),
    /// Nothing: there is no mission any more.
    None,
    /// Climb straight up to a place's height, then fly there.
    TakeOffTo {
        /// Place in the local frame \[m\].
        position_m: Vector3<f32>,
    },
}

/// The item of a mission that the guidance [wants](crate::Order::Resume), and what follows.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Leg {
    /// Number of the item.
    pub number: u16,
    /// Which upload of the mission it belongs to.
    pub upload: u16,
    /// The item.
    pub item: Item,
    /// True if none follows.
    pub is_last: bool,
}

/// What the link brings for the guidance.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Orders {
    /// Newest target.
    pub target: Option<Stamped<OffboardTarget>>,
    /// Newest sticks.
    pub sticks: Option<Stamped<Sticks>>,
    /// Item of the mission that was wanted last.
    pub leg: Option<Leg>,
    /// Time at which the station in control was last heard; none before \[us\].
    pub heard_us: Option<u64>,
    /// What is known of the uploaded geofence; none if there is none.
    pub fence: Option<FenceView>,
    /// Where a return lands: the nearest of home and rally points; none for home \[m\].
    pub safe_m: Option<Vector2<f32>>,
    /// Orders; a tick of the guidance answers the oldest.
    pub given: Queue<Order>,
}
