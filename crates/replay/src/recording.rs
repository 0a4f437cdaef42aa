//! The contents of a log, in this project's frames and units.

use afbc_estimator::{GeodeticOrigin, ImuSample, Measurement, Settings, Stamped};
use nalgebra::Vector3;

/// A sensor, or a part of the log's own estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {
    /// Gyroscope and accelerometer.
    Imu,
    /// Motion-capture system, or another tracker.
    Tracker,
    /// GNSS receiver.
    Gnss,
    /// Barometer.
    Barometer,
    /// Magnetometer.
    Magnetometer,
    /// The log's estimate of the attitude.
    Attitude,
    /// The log's estimate of velocity and position.
    Motion,
}

impl Sensor {
    /// Returns the sensor's name for people.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Sensor::Imu => "inertial sensor",
            Sensor::Tracker => "tracker",
            Sensor::Gnss => "GNSS",
            Sensor::Barometer => "barometer",
            Sensor::Magnetometer => "magnetometer",
            Sensor::Attitude => "the log's attitude",
            Sensor::Motion => "the log's velocity and position",
        }
    }
}

/// Origin of a sensor's samples in the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SampleSource {
    /// Sensor of the samples.
    pub sensor: Sensor,
    /// Topic, or kind of line, that has the samples. If the log has none, the topic or line that is missing.
    pub topic: String,
    /// Number of samples used.
    pub used: usize,
    /// Number of samples not used: not finite, out of order, without a fix, or more than needed.
    pub skipped: usize,
}

/// A measurement and its time of arrival.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AidingSample {
    /// Time of arrival \[us\].
    pub arrived_us: u64,
    /// The measurement with the time of its sample.
    pub measurement: Stamped<Measurement>,
}

/// The log's own estimate at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoggedState {
    /// Time \[us\].
    pub at_us: u64,
    /// Quaternion w, x, y, z from body to earth.
    pub attitude: Option<[f32; 4]>,
    /// Velocity in the earth frame, if the log calls it valid \[m/s\].
    pub velocity_m_s: Option<Vector3<f32>>,
    /// Position from the recording's origin, if the log calls it valid \[m\].
    pub position_m: Option<Vector3<f32>>,
}

/// A jump of the log's own estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoggedReset {
    /// Time \[us\].
    pub at_us: u64,
    /// Name of the quantity that jumped.
    pub what: &'static str,
    /// Size of the jump; NaN if the log does not state it.
    pub by: f64,
    /// Unit of the jump.
    pub unit: &'static str,
}

/// A recorded flight.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// Kind of log.
    pub format: &'static str,
    /// IMU samples in the order of time, at least one.
    pub imu: Vec<ImuSample>,
    /// Measurements in the order of their arrival.
    pub aiding: Vec<AidingSample>,
    /// The log's own estimate in the order of time.
    pub states: Vec<LoggedState>,
    /// Jumps of the log's own estimate.
    pub resets: Vec<LoggedReset>,
    /// Times \[us\] at which the log's landed flag has a new value, and that value.
    pub landed: Vec<(u64, bool)>,
    /// Times \[us\] at which the log's disarmed flag has a new value, and that value.
    pub disarmed: Vec<(u64, bool)>,
    /// Origin of all positions, if there is one.
    pub origin: Option<GeodeticOrigin>,
    /// True if the log's positions start at `origin`; false if they start at an origin that the log does not state.
    pub knows_origin: bool,
    /// Direction of magnetic north, positive to the east \[rad\].
    pub declination_rad: f32,
    /// Heading error from the vehicle's own magnetic field, if known: standard deviation along each of body x and y
    /// \[rad\].
    pub mag_slow_rad: Option<f32>,
    /// Settings of the estimator that flew, if the log has them.
    pub settings: Option<Settings>,
    /// Sources of the samples.
    pub sources: Vec<SampleSource>,
    /// Further remarks for the report, one sentence each.
    pub notes: Vec<String>,
}

impl Recording {
    /// Returns the length of the recording \[s\].
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        let ends = (self.imu.first(), self.imu.last());
        if let (Some(first), Some(last)) = ends { (last.at_us - first.at_us) as f64 * 1e-6 } else { 0.0 }
    }

    /// Returns the median rate of the IMU \[Hz\]; 0 for a single sample.
    #[must_use]
    pub fn imu_rate_hz(&self) -> f64 {
        let mut steps: Vec<u64> =
            self.imu.iter().zip(self.imu.iter().skip(1)).map(|(a, b)| b.at_us - a.at_us).collect();
        let middle = steps.len() / 2;
        let median = (middle < steps.len()).then(|| *steps.select_nth_unstable(middle).1);
        median.map_or(0.0, |step_us| 1e6 / step_us as f64)
    }

    /// Returns the sources that the log lacks.
    pub fn missing(&self) -> impl Iterator<Item = &SampleSource> {
        self.sources.iter().filter(|source| source.used + source.skipped == 0)
    }

    /// Returns the sources that are in the log but have no usable sample.
    pub fn unusable(&self) -> impl Iterator<Item = &SampleSource> {
        self.sources.iter().filter(|source| source.used == 0 && source.skipped > 0)
    }
}

/// Returns a vector of PX4's frames, north-east-down or forward-right-down, in this project's frames.
pub(crate) fn flip([x, y, z]: [f64; 3]) -> Vector3<f32> {
    Vector3::new(x as f32, -y as f32, -z as f32)
}

/// Returns a rotation between PX4's frames as a rotation between this project's; none if the quaternion is not of unit
/// length.
pub(crate) fn flip_rotation([w, x, y, z]: [f64; 4]) -> Option<[f32; 4]> {
    let norm = libm::sqrt(w * w + x * x + y * y + z * z);
    // NaN makes this false.
    ((norm - 1.0).abs() < 0.05).then(|| [w, x, -y, -z].map(|part| (part / norm) as f32))
}
