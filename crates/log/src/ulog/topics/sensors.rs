//! Topics of the sensor readings.

use crate::ulog::layout::message;
use crate::ulog::moment::{Moment, flip, flip_turn};
use afbc_estimator::{ImuSample, Measurement};
use afbc_onboard::Aged;
use nalgebra::Vector3;

/// Integration time of a first sample or of one after a gap. Then the longest interval that is no gap, in a usual and
/// in a small log \[us\].
const USUAL_US: u64 = 1_000;
const GAP_US: u64 = 10_000;
const SMALL_GAP_US: u64 = 20_000;
/// Microtesla per gauss.
const UT_PER_GAUSS: f32 = 100.0;
/// GNSS fix type: three-dimensional.
const FIX_3D: u8 = 3;
/// Pose frame: north-east-down, though north may be arbitrary. Velocity frame: unknown, as there is no velocity.
const FRAME_NED: u8 = 1;
const FRAME_UNKNOWN: u8 = 0;

message! {
    /// The inertial sensor, calibrated, at the centre of mass. The time is the end of the integration, of which the
    /// sample is the mean.
    "sensor_combined" SensorCombined {
        gyro_rad: [f32; 3] = "rad/s",
        gyro_integral_dt: u32 = "us",
        accelerometer_timestamp_relative: i32 = "us",
        accelerometer_m_s2: [f32; 3] = "m/s2",
        accelerometer_integral_dt: u32 = "us",
        accelerometer_clipping: u8 = "bit per axis",
        gyro_clipping: u8 = "bit per axis",
    }
}

/// Mean of inertial samples.
#[derive(Clone, Debug)]
pub(crate) struct MeanSample {
    first_us: u64,
    sum: ImuSample,
    count: u16,
    clips: bool,
}

impl MeanSample {
    /// Adds a sample to a mean, or begins a new mean.
    pub(crate) fn with(before: Option<Self>, sample: &ImuSample, clips: bool) -> Self {
        // The mean of one sample is that sample, to the last bit.
        let Some(mut mean) = before else {
            return MeanSample { first_us: sample.at_us, sum: *sample, count: 1, clips };
        };
        mean.sum.rates_rad_s += sample.rates_rad_s;
        mean.sum.specific_force_m_s2 += sample.specific_force_m_s2;
        mean.sum.at_us = sample.at_us;
        mean.count = mean.count.saturating_add(1);
        mean.clips |= clips;
        mean
    }

    /// Returns the mean, valid at the middle of its samples' times.
    fn sample(&self) -> ImuSample {
        let share = 1.0 / f32::from(self.count);
        ImuSample {
            at_us: self.first_us + self.sum.at_us.saturating_sub(self.first_us) / 2,
            rates_rad_s: self.sum.rates_rad_s * share,
            specific_force_m_s2: self.sum.specific_force_m_s2 * share,
        }
    }
}

impl SensorCombined {
    /// Returns the message and the time of its sample. `last` is the same pair of the previous message.
    pub(crate) fn of(mean: &MeanSample, last: Option<&(Self, u64)>, small: bool) -> (Self, u64) {
        let (sample, gap_us) = (mean.sample(), if small { SMALL_GAP_US } else { GAP_US });
        (Self::of_sample(&sample, last.map(|(message, at_us)| (message, *at_us)), mean.clips, gap_us), sample.at_us)
    }

    fn of_sample(sample: &ImuSample, last: Option<(&Self, u64)>, clips: bool, gap_us: u64) -> Self {
        let since_us = last.and_then(|(_, last_us)| sample.at_us.checked_sub(last_us));
        let since_us = since_us.filter(|since_us| (1..=gap_us).contains(since_us)).unwrap_or(USUAL_US);
        // A long integration time puts `timestamp` later. The next one must then be long, too: messages stay in order,
        // and each still says when its sample was valid.
        let behind_us = last.map_or(0, |(message, _)| message.timestamp.saturating_sub(sample.at_us));
        let dt_us = since_us.max(2 * behind_us.min(gap_us)) as u32;
        let clipping = if clips { 7 } else { 0 };
        SensorCombined {
            timestamp: sample.at_us.saturating_add(u64::from(dt_us / 2)),
            gyro_rad: flip(sample.rates_rad_s),
            gyro_integral_dt: dt_us,
            accelerometer_timestamp_relative: 0,
            accelerometer_m_s2: flip(sample.specific_force_m_s2),
            accelerometer_integral_dt: dt_us,
            accelerometer_clipping: clipping,
            gyro_clipping: clipping,
        }
    }
}

message! {
    /// The barometer.
    "vehicle_air_data" VehicleAirData {
        timestamp_sample: u64 = "us",
        baro_alt_meter: f32 = "m",
    }
}

message! {
    /// The magnetometer, calibrated.
    "vehicle_magnetometer" VehicleMagnetometer {
        timestamp_sample: u64 = "us",
        magnetometer_ga: [f32; 3] = "gauss",
    }
}

message! {
    /// The satellite receiver.
    "vehicle_gps_position" VehicleGpsPosition {
        timestamp_sample: u64 = "us",
        latitude_deg: f64 = "degrees",
        longitude_deg: f64 = "degrees",
        altitude_msl_m: f64 = "m",
        s_variance_m_s: f32 = "m/s",
        eph: f32 = "m",
        epv: f32 = "m",
        vel_m_s: f32 = "m/s",
        vel_n_m_s: f32 = "m/s",
        vel_e_m_s: f32 = "m/s",
        vel_d_m_s: f32 = "m/s",
        fix_type: u8 = "3: in three dimensions",
        vel_ned_valid: bool = "",
    }
}

message! {
    /// A tracker's pose.
    "vehicle_visual_odometry" VisualOdometry {
        timestamp_sample: u64 = "us",
        position: [f32; 3] = "m",
        q: [f32; 4] = "w, x, y, z from body to earth",
        velocity: [f32; 3] = "m/s; not a number",
        angular_velocity: [f32; 3] = "rad/s; not a number",
        position_variance: [f32; 3] = "m2",
        orientation_variance: [f32; 3] = "rad2",
        velocity_variance: [f32; 3] = "m2/s2; not a number",
        pose_frame: u8 = "1: north-east-down",
        velocity_frame: u8 = "0: unknown",
        reset_counter: u8 = "",
        quality: i8 = "",
    }
}

/// A reading of an aiding sensor, as a message of its topic.
pub(crate) enum Aiding {
    Air(VehicleAirData),
    Field(VehicleMagnetometer),
    Gnss(VehicleGpsPosition),
    Pose(VisualOdometry),
}

impl Aiding {
    /// Returns a corrected reading as a message. Returns none for a heading, and for a GNSS fix until the origin is
    /// known.
    pub(crate) fn of(moment: &Moment<'_>, aid: &Aged<Measurement>) -> Option<Self> {
        let timestamp = moment.now_us();
        let timestamp_sample = timestamp.saturating_sub(aid.age_us.into());
        Some(match aid.value {
            Measurement::Height { height_m, .. } => {
                Aiding::Air(VehicleAirData { timestamp, timestamp_sample, baro_alt_meter: height_m })
            }
            Measurement::MagneticField { field, .. } => Aiding::Field(VehicleMagnetometer {
                timestamp,
                timestamp_sample,
                magnetometer_ga: flip(field / UT_PER_GAUSS),
            }),
            Measurement::Gnss {
                position_m,
                velocity_m_s,
                horizontal_sigma_m,
                vertical_sigma_m,
                speed_sigma_m_s,
                ..
            } => {
                let [latitude_deg, longitude_deg, altitude_msl_m] = moment.beside.origin?.global(&position_m);
                let [vel_n_m_s, vel_e_m_s, vel_d_m_s] = flip(velocity_m_s);
                Aiding::Gnss(VehicleGpsPosition {
                    timestamp,
                    timestamp_sample,
                    latitude_deg,
                    longitude_deg,
                    altitude_msl_m,
                    s_variance_m_s: speed_sigma_m_s,
                    eph: horizontal_sigma_m,
                    epv: vertical_sigma_m,
                    vel_m_s: afbc_control::math::sqrt(vel_n_m_s * vel_n_m_s + vel_e_m_s * vel_e_m_s),
                    vel_n_m_s,
                    vel_e_m_s,
                    vel_d_m_s,
                    fix_type: FIX_3D,
                    vel_ned_valid: true,
                })
            }
            Measurement::Pose { position_m, attitude, position_sigma_m, attitude_sigma_rad } => {
                let q = flip_turn(attitude);
                Aiding::Pose(odometry(
                    [timestamp, timestamp_sample],
                    &position_m,
                    q,
                    [position_sigma_m, attitude_sigma_rad],
                ))
            }
            Measurement::Position { position_m, sigma_m } => {
                Aiding::Pose(odometry([timestamp, timestamp_sample], &position_m, [f32::NAN; 4], [sigma_m, f32::NAN]))
            }
            Measurement::Heading { .. } => return None,
        })
    }
}

fn odometry(
    [timestamp, timestamp_sample]: [u64; 2],
    position_m: &Vector3<f32>,
    q: [f32; 4],
    sigmas: [f32; 2],
) -> VisualOdometry {
    let [position_variance, orientation_variance] = sigmas.map(|sigma| [sigma * sigma; 3]);
    let none = [f32::NAN; 3];
    VisualOdometry {
        timestamp,
        timestamp_sample,
        position: flip(*position_m),
        q,
        velocity: none,
        angular_velocity: none,
        position_variance,
        orientation_variance,
        velocity_variance: none,
        pose_frame: FRAME_NED,
        velocity_frame: FRAME_UNKNOWN,
        reset_counter: 0,
        quality: 0,
    }
}
