//! The sensors' own tests, which a station asks a disarmed vehicle for: from the links' task to the sensors' and back.

use crate::control;
pub use afbc_station::services::health::sensor;
use afbc_station::services::sensors;
use afbc_station::services::status::SensorBits;
use core::sync::atomic::{AtomicU32, Ordering};

/// The first inertial sensor, or the only one.
pub const FIRST_IMU: u32 = sensor::GYROSCOPE | sensor::ACCELEROMETER;
/// The second one.
pub const SECOND_IMU: u32 = sensor::GYROSCOPE_2 | sensor::ACCELEROMETER_2;

/// Number of the newest request.
static ASKED: AtomicU32 = AtomicU32::new(0);
/// Sensors that have failed their last test, and those whose newest results, failed or passed, are to be told, as
/// `MAV_SYS_STATUS_SENSOR`.
static FAILED: AtomicU32 = AtomicU32::new(0);
static NEWS: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];

/// What a sensor's task remembers of the requests.
#[derive(Default)]
pub struct Asked(u32);

impl Asked {
    /// True once for each request, if the vehicle is disarmed.
    pub fn is_new(&mut self) -> bool {
        // Noted while armed, too: a test must not begin when the vehicle is disarmed later on.
        let asked = ASKED.load(Ordering::Relaxed);
        core::mem::replace(&mut self.0, asked) != asked && !control::armed()
    }
}

/// Has every sensor run its test.
pub(crate) fn ask() {
    ASKED.fetch_add(1, Ordering::Relaxed);
}

/// Puts the result of the test of the sensor with these bits.
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

/// Makes sensors that have failed their test unhealthy, and returns what is to be told of one result.
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
