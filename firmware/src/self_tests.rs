//! Self-tests of the sensors: passes a station's request from the link task to the sensor tasks, and the results back.

use crate::control;
pub use afbc_comms::services::health::sensor;
use afbc_comms::services::sensors;
use afbc_comms::services::status::SensorBits;
use core::sync::atomic::{AtomicU32, Ordering};

/// Bits of the first, or only, inertial sensor.
pub const FIRST_IMU: u32 = sensor::GYROSCOPE | sensor::ACCELEROMETER;
/// Bits of the second inertial sensor.
pub const SECOND_IMU: u32 = sensor::GYROSCOPE_2 | sensor::ACCELEROMETER_2;

/// Number of requests so far.
static ASKED: AtomicU32 = AtomicU32::new(0);
/// Sensors that failed their last self-test, and sensors with a new result (failed, passed) to report, as
/// `MAV_SYS_STATUS_SENSOR` bits.
static FAILED: AtomicU32 = AtomicU32::new(0);
static NEWS: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];

/// Number of the last request that a sensor's task has seen.
#[derive(Default)]
pub struct Asked(u32);

impl Asked {
    /// True once per request, if the vehicle is disarmed.
    pub fn is_new(&mut self) -> bool {
        // The request is also stored while armed, so that the self-test does not begin later, when the vehicle disarms.
        let asked = ASKED.load(Ordering::Relaxed);
        core::mem::replace(&mut self.0, asked) != asked && !control::armed()
    }
}

/// Requests a self-test of every sensor.
pub(crate) fn ask() {
    ASKED.fetch_add(1, Ordering::Relaxed);
}

/// Stores the self-test result of the sensor with these bits.
pub fn put(bits: u32, passes: bool) {
    let [failed, passed] = &NEWS;
    if passes {
        FAILED.fetch_and(!bits, Ordering::Relaxed);
        passed.fetch_or(bits, Ordering::Relaxed);
    } else {
        FAILED.fetch_or(bits, Ordering::Relaxed);
        failed.fetch_or(bits, Ordering::Relaxed);
    }
}

/// Marks sensors that failed their self-test as unhealthy, and returns the text of one new result and whether it
/// passed.
pub(crate) fn report(reported: &mut SensorBits) -> Option<(&'static str, bool)> {
    let failed = FAILED.load(Ordering::Relaxed);
    reported.present |= failed;
    reported.healthy &= !failed;
    NEWS.iter().zip([false, true]).find_map(|(news, passes)| {
        let bits = news.load(Ordering::Relaxed);
        let (text, sensor) = sensors::tested(bits, passes)?;
        news.fetch_and(!sensor, Ordering::Relaxed);
        Some((text, passes))
    })
}
