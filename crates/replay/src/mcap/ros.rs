//! Makes ROS 2 messages from PX4's topics that tools draw without any setup: frames for a 3-D view, a place for a map,
//! texts.
//!
//! Frames follow [REP 103](https://www.ros.org/reps/rep-0103.html): `map` is east-north-up, `base_link` and `setpoint`
//! are forward-left-up.

use super::topic::time_us;
use crate::ulog::{FieldType, UlogFormat};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::Serialize;
use std::f64::consts::FRAC_1_SQRT_2;

/// A message that is added to those of the log.
pub(super) struct RosMessage {
    pub(super) topic: &'static str,
    /// Name of the message's schema.
    pub(super) kind: &'static str,
    /// Text of the schema, with the schemas of its parts.
    pub(super) schema: &'static str,
    pub(super) content: RosContent,
}

/// Content of an added message.
#[derive(Serialize)]
#[serde(untagged)]
pub(super) enum RosContent {
    Frames(Vec<TransformStamped>),
    Fix(NavSatFix),
}

macro_rules! with_header {
    ($($text:literal),*) => {
        concat!(
            $($text,)*
            "================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n",
            "================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
        )
    };
}

const FRAMES: &str = with_header!(
    "geometry_msgs/TransformStamped[] transforms\n",
    "================\nMSG: geometry_msgs/TransformStamped\n",
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
    "================\nMSG: geometry_msgs/Transform\n",
    "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    "================\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n",
    "================\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
);
const FIX: &str = with_header!(
    "std_msgs/Header header\nsensor_msgs/NavSatStatus status\nfloat64 latitude\nfloat64 longitude\nfloat64 altitude\n",
    "float64[9] position_covariance\nuint8 position_covariance_type\n",
    "================\nMSG: sensor_msgs/NavSatStatus\nint8 status\nuint16 service\n"
);

/// `builtin_interfaces/RosTime`, counted from power-up.
#[derive(Clone, Copy, Serialize)]
struct RosTime {
    sec: i32,
    nanosec: u32,
}

impl RosTime {
    fn of(time_us: u64) -> Self {
        let sec = i32::try_from(time_us / 1_000_000).unwrap_or(i32::MAX);
        RosTime { sec, nanosec: (time_us % 1_000_000) as u32 * 1000 }
    }
}

/// `std_msgs/RosHeader`.
#[derive(Serialize)]
struct RosHeader {
    stamp: RosTime,
    frame_id: &'static str,
}

/// `geometry_msgs/TransformStamped`.
#[derive(Serialize)]
pub(super) struct TransformStamped {
    header: RosHeader,
    child_frame_id: &'static str,
    /// Position \[m\].
    translation: [f64; 3],
    /// Quaternion x, y, z, w.
    rotation: [f64; 4],
}

/// `sensor_msgs/NavSatFix`.
#[derive(Serialize)]
pub(super) struct NavSatFix {
    header: RosHeader,
    /// 0: the receiver has a fix.
    status: i8,
    /// 1: GPS.
    service: u16,
    latitude_deg: f64,
    longitude_deg: f64,
    altitude_m: f64,
    /// Order east, north, up \[m2\].
    position_covariance: [f64; 9],
    /// 2: the diagonal of the covariance is known.
    position_covariance_type: u8,
}

/// `rcl_interfaces/Log`: a text message from the vehicle.
#[derive(Serialize)]
pub(super) struct RosLog {
    stamp: RosTime,
    level: u8,
    name: &'static str,
    text: String,
    file: &'static str,
    function: &'static str,
    line: u32,
}

impl RosLog {
    pub(super) const TOPIC: &'static str = "/rosout";
    pub(super) const KIND: &'static str = "rcl_interfaces/msg/Log";
    pub(super) const SCHEMA: &'static str = concat!(
        "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\n",
        "uint32 line\n================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    );

    /// Makes the message for a text of the log. `level` is a syslog level, 0 (emergency) to 7 (debug), possibly as an
    /// ASCII digit.
    pub(super) fn of(time_us: u64, level: u8, text: &str) -> Self {
        // ROS 2's levels are debug 10, information 20, warning 30, error 40, fatal 50.
        let level = match level & 7 {
            0..=2 => 50,
            3 => 40,
            4 => 30,
            5 | 6 => 20,
            _ => 10,
        };
        let (name, file, function, line) = ("vehicle", "", "", 0);
        RosLog { stamp: RosTime::of(time_us), level, name, text: text.to_owned(), file, function, line }
    }
}

/// A parameter that was changed during the log.
#[derive(Serialize)]
pub(super) struct RosParameterChange {
    pub(super) name: String,
    pub(super) value: f64,
}

impl RosParameterChange {
    pub(super) const TOPIC: &'static str = "/parameter_change";
    pub(super) const KIND: &'static str = "afbc_msgs/msg/ParameterChange";
    pub(super) const SCHEMA: &'static str = "string name\nfloat64 value\n";
}

/// Newest attitudes of the vehicle and of its setpoint, as rotations from forward-right-down to north-east-down.
#[derive(Default)]
pub(super) struct SceneAttitudes {
    attitude: Option<Quaternion<f64>>,
    desired: Option<Quaternion<f64>>,
}

impl SceneAttitudes {
    /// Takes a message of the log; returns a message to add, if the log's message gives one.
    pub(super) fn update(&mut self, format: &UlogFormat, data: &[u8]) -> Option<RosMessage> {
        let fields = FieldReader { format, data };
        match format.name.as_str() {
            "vehicle_attitude" => self.attitude = fields.quaternion(["q[0]", "q[1]", "q[2]", "q[3]"]),
            "vehicle_attitude_setpoint" => self.desired = fields.quaternion(["q_d[0]", "q_d[1]", "q_d[2]", "q_d[3]"]),
            "vehicle_local_position" => return fields.frame("base_link", self.attitude?),
            "vehicle_local_position_setpoint" => return fields.frame("setpoint", self.desired?),
            "vehicle_global_position" => return fields.fix(),
            _ => {}
        }
        None
    }
}

/// Fields of one message.
struct FieldReader<'a> {
    format: &'a UlogFormat,
    data: &'a [u8],
}

impl FieldReader<'_> {
    fn float(&self, name: &str) -> Option<f64> {
        let from = self.data.get(self.format.place(name, FieldType::Float)?..)?;
        Some(f32::from_le_bytes(*from.first_chunk()?).into())
    }

    fn double(&self, name: &str) -> Option<f64> {
        let from = self.data.get(self.format.place(name, FieldType::Double)?..)?;
        Some(f64::from_le_bytes(*from.first_chunk()?))
    }

    fn time(&self) -> Option<RosTime> {
        time_us(self.format, self.data).map(RosTime::of)
    }

    fn vector(&self, names: [&str; 3]) -> Option<Vector3<f64>> {
        let [x, y, z] = names.map(|name| self.float(name).filter(|value| value.is_finite()));
        Some(Vector3::new(x?, y?, z?))
    }

    fn quaternion(&self, names: [&str; 4]) -> Option<Quaternion<f64>> {
        let [w, x, y, z] = names.map(|name| self.float(name).filter(|value| value.is_finite()));
        Some(Quaternion::new(w?, x?, y?, z?))
    }

    /// Returns a frame with the message's position and the given attitude.
    fn frame(&self, child_frame_id: &'static str, attitude: Quaternion<f64>) -> Option<RosMessage> {
        let ned = self.vector(["x", "y", "z"])?;
        // NED to ENU is half a turn about the bisector of x and y, FLU to FRD half a turn about x.
        let to_enu = Quaternion::new(0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0);
        let from_flu = Quaternion::new(0.0, 1.0, 0.0, 0.0);
        // A message whose quaternion is zero gives no frame.
        let rotation = UnitQuaternion::try_new(to_enu * attitude * from_flu, 1e-3)?;
        let frame = TransformStamped {
            header: RosHeader { stamp: self.time()?, frame_id: "map" },
            child_frame_id,
            translation: [ned.y, ned.x, -ned.z],
            rotation: rotation.coords.into(),
        };
        let content = RosContent::Frames(vec![frame]);
        Some(RosMessage { topic: "/tf", kind: "tf2_msgs/msg/TFMessage", schema: FRAMES, content })
    }

    fn fix(&self) -> Option<RosMessage> {
        let degrees = |name| self.double(name).filter(|value| value.is_finite());
        let variance = |name| self.float(name).map_or(0.0, |sigma| sigma * sigma);
        let (horizontal, vertical) = (variance("eph"), variance("epv"));
        let fix = NavSatFix {
            header: RosHeader { stamp: self.time()?, frame_id: "base_link" },
            status: 0,
            service: 1,
            latitude_deg: degrees("lat")?,
            longitude_deg: degrees("lon")?,
            altitude_m: self.float("alt")?,
            position_covariance: [horizontal, 0.0, 0.0, 0.0, horizontal, 0.0, 0.0, 0.0, vertical],
            position_covariance_type: 2,
        };
        let (topic, kind) = ("/fix", "sensor_msgs/msg/NavSatFix");
        Some(RosMessage { topic, kind, schema: FIX, content: RosContent::Fix(fix) })
    }
}
