//! Classes of sensor behaviour that the suite `rough-estimate` draws.

use super::builder::RoughFlightBuilder;
use afbc_plant::instruments::{FailureKind, TrackerModel};
use core::f64::consts::PI;
use nalgebra::Vector3;

/// Place of a flight, which decides which sensors aid the inertial sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Venue {
    /// The vehicle is tracked by a motion-capture system.
    Indoors,
    /// The vehicle has a GNSS receiver and a magnetometer.
    Outdoors,
}

impl Venue {
    /// Returns the name of the place.
    pub const fn name(self) -> &'static str {
        match self {
            Venue::Indoors => "indoors",
            Venue::Outdoors => "outdoors",
        }
    }
}

/// A class of sensor behaviour.
pub struct SensorClass {
    /// Name of the class.
    pub name: &'static str,
    /// Meaning in words.
    pub meaning: &'static str,
    /// True if the vehicle knows of the behaviour by data sheets, time stamps or missing data. Its estimate has to be
    /// consistent then.
    pub known: bool,
    /// Place that has the affected instruments; none for both places.
    pub place: Option<Venue>,
    put: fn(&mut RoughFlightBuilder<'_>),
}

/// Name of the class that combines two others.
pub const MIXTURE: &str = "mixture";
/// Description of the class of mixtures.
pub const MIXTURE_MEANING: &str = "two of the other classes at once";

const fn class(
    name: &'static str,
    place: Option<Venue>,
    known: bool,
    meaning: &'static str,
    put: fn(&mut RoughFlightBuilder<'_>),
) -> SensorClass {
    SensorClass { name, meaning, known, place, put }
}

const INDOORS: Option<Venue> = Some(Venue::Indoors);
const OUTDOORS: Option<Venue> = Some(Venue::Outdoors);

/// All classes except [`MIXTURE`].
pub static CLASSES: [SensorClass; 24] = [
    class("nothing", None, true, "every sensor behaves as the vehicle assumes", |_| {}),
    class(
        "vibration",
        None,
        false,
        "a hovering rotor shakes the IMU by 0.02 to 0.2 rad/s and 1 to 10 m/s2; the vehicle assumes 0.02 and 1",
        |d| {
            let (rate, force) = (d.logarithmic(0.02, 0.2), d.logarithmic(1.0, 10.0));
            d.imu(|imu| (imu.gyro.vibration_rad_s, imu.accel.vibration_m_s2) = (rate, force));
        },
    ),
    class(
        "clipping",
        None,
        false,
        "the IMU clips at 1 to 5 rad/s and 10.5 to 14 m/s2, up to five times for 10 ms to 2 s",
        |d| {
            for _ in 0..d.count(5) {
                let (rates_rad_s, specific_force_m_s2) = (d.between(1.0, 5.0), d.between(10.5, 14.0));
                let lasts_s = d.logarithmic(0.01, 2.0);
                d.fault(FailureKind::ImuClipped { rates_rad_s, specific_force_m_s2 }, lasts_s, 0.0);
            }
        },
    ),
    class("bumps", None, false, "up to five bumps of 160 to 400 m/s2 along an axis for 1 to 5 ms", |d| {
        for _ in 0..d.count(5) {
            d.bump();
        }
    }),
    class(
        "bias",
        None,
        false,
        "the IMU starts with biases of deviation 0.003 to 0.05 rad/s and 0.07 to 0.3 m/s2",
        |d| {
            let (rate, force) = (d.logarithmic(0.003, 0.05), d.logarithmic(0.07, 0.3));
            d.imu(|imu| (imu.gyro.bias_rad_s, imu.accel.bias_m_s2) = (rate, force));
        },
    ),
    class(
        "bias-step",
        None,
        false,
        "the IMU's biases jump by 0.001 to 0.03 rad/s and 0.01 to 0.3 m/s2 in any direction",
        |d| {
            let biased = biased(d, [0.001, 0.03], [0.01, 0.3]);
            d.fault(biased, f64::INFINITY, 0.0);
        },
    ),
    class(
        "bias-drift",
        None,
        false,
        "the IMU's biases drift by 0.001 to 0.01 rad/s and 0.01 to 0.2 m/s2 within 30 to 60 s",
        |d| {
            let (biased, rise_s) = (biased(d, [0.001, 0.01], [0.01, 0.2]), d.between(30.0, 60.0));
            d.fault(biased, f64::INFINITY, rise_s);
        },
    ),
    class("lever", None, false, "the IMU is up to 50 mm off the centre of mass, in any direction", |d| {
        let lever_m = d.direction() * d.between(0.0, 0.05);
        d.imu(|imu| imu.lever_m = lever_m);
    }),
    class("hard-iron", OUTDOORS, false, "hard iron has a deviation of 1 to 10 uT; the vehicle assumes 0.5", |d| {
        let iron = d.logarithmic(1.0, 10.0);
        d.magnetometer(|part| part.hard_iron_ut = iron);
    }),
    class(
        "motor-field",
        OUTDOORS,
        false,
        "the motors' currents add 1 to 10 uT in any direction when thrust equals weight",
        |d| {
            let field = d.direction() * d.logarithmic(1.0, 10.0);
            d.magnetometer(|part| part.motor_ut = field);
        },
    ),
    class(
        "field",
        OUTDOORS,
        false,
        "the field changes by 5 to 25 uT along a body axis, for at least 5 s or for good",
        |d| {
            let (field_ut, lasts_s) = (d.axis() * d.between(5.0, 25.0), d.lasting(5.0));
            d.fault(FailureKind::MagnetometerDisturbed { field_ut }, lasts_s, 0.0);
        },
    ),
    class("gnss-late", OUTDOORS, true, "fixes arrive 0.1 to 0.25 s late, with correct time stamps", |d| {
        let late_s = d.between(0.1, 0.25);
        d.gnss(|part| part.delay_s = late_s);
    }),
    class("gnss-stamps", OUTDOORS, false, "time stamps are wrong by 20 to 150 ms", |d| {
        let off_s = d.sign() * d.between(0.02, 0.15);
        d.gnss(|part| part.stamp_s = off_s);
    }),
    class(
        "gnss-jump",
        OUTDOORS,
        false,
        "the position jumps by 2 to 100 m along an axis, for at least 1 s or for good",
        |d| {
            let (by_m, lasts_s) = (d.axis() * d.logarithmic(2.0, 100.0), d.lasting(1.0));
            d.fault(FailureKind::GnssJumped { by_m }, lasts_s, 0.0);
        },
    ),
    class("gnss-ramp", OUTDOORS, false, "the position drifts by 2 to 30 m in any direction within 5 to 40 s", |d| {
        let (by_m, rise_s) = (d.direction() * d.logarithmic(2.0, 30.0), d.between(5.0, 40.0));
        d.fault(FailureKind::GnssJumped { by_m }, f64::INFINITY, rise_s);
    }),
    class("gnss-outage", OUTDOORS, true, "up to four outages of 0.5 to 8 s", |d| {
        for _ in 0..d.count(4) {
            let lasts_s = d.logarithmic(0.5, 8.0);
            d.fault(FailureKind::GnssLost, lasts_s, 0.0);
        }
    }),
    class(
        "multipath",
        OUTDOORS,
        false,
        "multipath wanders with a deviation of 2 to 10 m and a time constant of 1 to 20 s, for 10 to 60 s",
        |d| {
            let (deviation_m, correlation_time_s) = (d.logarithmic(2.0, 10.0), d.logarithmic(1.0, 20.0));
            let lasts_s = d.between(10.0, 60.0);
            d.fault(FailureKind::GnssMultipath { deviation_m, correlation_time_s }, lasts_s, 0.0);
        },
    ),
    class("gnss-accuracy", OUTDOORS, false, "the reported accuracy is 0.3 to 2 times the true one", |d| {
        let ratio = d.logarithmic(0.3, 2.0);
        d.gnss(|part| part.reported = ratio);
    }),
    class("tracker-rate", INDOORS, true, "10 to 100 Hz", |d| {
        let rate_hz = d.logarithmic(10.0, 100.0);
        d.tracker(|part| part.rate_hz = rate_hz);
    }),
    class("tracker-late", INDOORS, true, "poses arrive 10 to 250 ms late, with correct time stamps", |d| {
        let late_s = d.logarithmic(0.01, 0.25);
        d.tracker(|part| part.delay_s = late_s);
    }),
    class("tracker-stamps", INDOORS, false, "time stamps are wrong by 5 to 50 ms", |d| {
        let off_s = d.sign() * d.logarithmic(0.005, 0.05);
        d.tracker(|part: &mut TrackerModel| part.stamp_s = off_s);
    }),
    class(
        "tracker-slip",
        INDOORS,
        false,
        "the tracker's frame slips by 0.1 to 5 m in any direction within 5 to 30 s",
        |d| {
            let (by_m, rise_s) = (d.direction() * d.logarithmic(0.1, 5.0), d.between(5.0, 30.0));
            d.fault(FailureKind::TrackerJumped { by_m, yaw_rad: 0.0 }, f64::INFINITY, rise_s);
        },
    ),
    class(
        "tracker-turn",
        INDOORS,
        false,
        "the tracker's frame turns by 0.05 to 0.5 rad, at once or within 30 s",
        |d| {
            let yaw_rad = d.sign() * d.logarithmic(0.05, 0.5);
            let rise_s = (d.between(-30.0, 30.0)).max(0.0);
            d.fault(FailureKind::TrackerJumped { by_m: Vector3::zeros(), yaw_rad }, f64::INFINITY, rise_s);
        },
    ),
    class(
        "tracker-flip",
        INDOORS,
        false,
        "the tracker's frame is turned by 180 degrees, up to three times for 0.1 to 2 s",
        |d| {
            for _ in 0..d.count(3) {
                let lasts_s = d.logarithmic(0.1, 2.0);
                d.fault(FailureKind::TrackerJumped { by_m: Vector3::zeros(), yaw_rad: PI }, lasts_s, 0.0);
            }
        },
    ),
];

/// Returns the names of all classes, in the order of the rows.
pub fn names() -> impl Iterator<Item = &'static str> {
    CLASSES.iter().map(|class| class.name).chain([MIXTURE])
}

/// Draws a bias of the gyroscope and one of the accelerometer, within these bounds and in independent directions.
fn biased(
    d: &mut RoughFlightBuilder<'_>,
    [rate_min, rate_max]: [f64; 2],
    [force_min, force_max]: [f64; 2],
) -> FailureKind {
    let rates_bias_rad_s = d.direction() * d.logarithmic(rate_min, rate_max);
    let force_bias_m_s2 = d.direction() * d.logarithmic(force_min, force_max);
    FailureKind::ImuBiased { rates_bias_rad_s, force_bias_m_s2 }
}

impl SensorClass {
    /// Draws an instance of the class into a flight.
    pub(super) fn put(&self, drawing: &mut RoughFlightBuilder<'_>) {
        (self.put)(drawing);
    }

    /// True if the affected instruments exist at `place`.
    pub(super) fn is_at(&self, place: Venue) -> bool {
        self.place.is_none_or(|own| own == place)
    }
}
