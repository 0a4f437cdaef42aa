//! Alignment at rest: roll and pitch from the specific force, gyroscope bias from the mean rate, heading from a sensor
//! that measures it.

use crate::measurement::{ImuSample, Measurement};
use crate::rotation::{atan2, levelling, matrix, normalized, yaw_between};
use crate::settings::Settings;
use afbc_control::math::{abs_max, sqrt, tilt_cosine};
use core::fmt;
use nalgebra::{Quaternion, Vector3};

/// Heading variance above which the heading counts as unknown \[rad2\].
pub(crate) const VAGUE: f32 = 0.25;

/// Reason why the estimator has not started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Unready {
    /// No IMU sample within 20 ms.
    #[default]
    NoImu,
    /// The vehicle is at rest, but not yet for long enough. After a refusal, that refusal's reason is shown instead.
    Settling,
    /// Rates or specific force change.
    Moving,
    /// The mean rate is larger than any plausible bias.
    Turning,
    /// The norm of the specific force is not gravity: the vehicle falls or accelerates, or the scale is wrong.
    NotGravity,
    /// The tilt exceeds the limit.
    Tilted,
}

impl fmt::Display for Unready {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Unready::NoImu => "no samples of the inertial sensors",
            Unready::Settling => "at rest, but not yet for long enough",
            Unready::Moving => "the vehicle is moved: leave it at rest",
            Unready::Turning => "the vehicle turns, or the gyroscope's bias is too large: leave it at rest",
            Unready::NotGravity => {
                "the accelerometer does not show 1 g: leave the vehicle at rest, or calibrate the accelerometer"
            }
            Unready::Tilted => "the vehicle is tilted: put it on level ground",
        })
    }
}

/// Running mean and sum of squared deviations (Welford).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct RunningMean {
    mean: Vector3<f32>,
    squares: Vector3<f32>,
}

impl RunningMean {
    fn add(&mut self, value: &Vector3<f32>, share: f32) {
        let deviation = value - self.mean;
        self.mean += deviation * share;
        self.squares += deviation.component_mul(&(value - self.mean));
    }

    /// Returns true if no coordinate's standard deviation exceeds `limit`.
    fn is_still(&self, count: f32, limit: f32) -> bool {
        abs_max(&self.squares) <= limit * limit * count
    }
}

/// Sums over the samples and measurements since the vehicle came to rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Alignment {
    since_us: Option<u64>,
    count: f32,
    rates: RunningMean,
    force: RunningMean,
    /// Mean rates and specific force over the first half of the time at rest.
    half: Option<(Vector3<f32>, Vector3<f32>)>,
    /// Sum of the magnetic fields, number of fields, and variance of one field.
    field: (Vector3<f32>, f32, f32),
    /// Newest attitude from the tracker, with its standard deviation.
    pose: Option<(Quaternion<f32>, f32)>,
    /// Newest heading measured directly, with its standard deviation.
    heading: Option<(f32, f32)>,
    pub(crate) why: Unready,
}

/// Result of the alignment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AlignmentResult {
    pub(crate) attitude: Quaternion<f32>,
    pub(crate) gyro_bias: Vector3<f32>,
    /// Mean specific force, body frame \[m/s2\].
    pub(crate) force: Vector3<f32>,
    /// Variance of the heading for a known tilt, `None` if no sensor measured the heading.
    pub(crate) heading_variance: Option<f32>,
    /// Heading error per rotation about the earth's x and y if a magnetic field gave the heading: the field is
    /// inclined, so a tilt error turns the measured heading.
    pub(crate) dip: (f32, f32),
    /// True if a magnetic field gave the heading.
    pub(crate) by_field: bool,
    /// Mean field in the earth frame, if any was measured.
    pub(crate) field: Option<Vector3<f32>>,
    /// Variances per axis of the mean rates and of the mean specific force.
    pub(crate) rates_variance: f32,
    pub(crate) force_variance: f32,
    /// Time at rest \[s\].
    pub(crate) time_s: f32,
}

impl Alignment {
    /// Starts the alignment again and stores the reason.
    pub(crate) fn again(&mut self, why: Unready) {
        *self = Alignment { why, ..Alignment::default() };
    }

    /// Stores a measurement that shows the heading.
    pub(crate) fn add_heading(&mut self, measurement: &Measurement) {
        match measurement {
            Measurement::MagneticField { field, sigma } => {
                self.field.0 += field;
                self.field.1 += 1.0;
                self.field.2 = sigma * sigma;
            }
            Measurement::Pose { attitude: [w, x, y, z], attitude_sigma_rad, .. } => {
                self.pose = Some((normalized(&Quaternion::new(*w, *x, *y, *z)), *attitude_sigma_rad));
            }
            Measurement::Heading { heading_rad, sigma_rad } => self.heading = Some((*heading_rad, *sigma_rad)),
            _ => {}
        }
    }

    /// Takes a sample, and returns the alignment once the vehicle has been at rest for long enough.
    pub(crate) fn advance(&mut self, sample: &ImuSample, settings: &Settings) -> Option<AlignmentResult> {
        let Some(since_us) = self.since_us else {
            let why = if self.why == Unready::NoImu { Unready::Settling } else { self.why };
            self.again(why);
            self.since_us = Some(sample.at_us);
            return None;
        };
        let elapsed_s = sample.at_us.saturating_sub(since_us) as f32 * 1e-6;
        let (rate, force) = (settings.still_rate_rad_s, settings.still_accel_m_s2);
        self.count += 1.0;
        let share = 1.0 / self.count;
        self.rates.add(&sample.rates_rad_s, share);
        self.force.add(&sample.specific_force_m_s2, share);

        // One sample far from the mean, or too large a spread, starts the alignment again at once.
        let far = |value: &Vector3<f32>, mean: &RunningMean, limit: f32| abs_max(&(value - mean.mean)) > 6.0 * limit;
        let moves = far(&sample.rates_rad_s, &self.rates, rate)
            || far(&sample.specific_force_m_s2, &self.force, force)
            || (self.count >= 20.0
                && !(self.rates.is_still(self.count, rate) && self.force.is_still(self.count, force)));
        // Slow motion shows as a difference between the means of the two halves.
        if elapsed_s >= 0.5 * settings.align_s && self.half.is_none() {
            self.half = Some((self.rates.mean, self.force.mean));
        }
        // The mean of the whole time differs from the first half's mean by half the difference between the halves.
        let drifts = elapsed_s >= settings.align_s
            && self.half.is_some_and(|(rates, specific)| {
                abs_max(&(self.rates.mean - rates)) > 0.25 * rate
                    || abs_max(&(self.force.mean - specific)) > 0.25 * force
            });
        // The tilt check also uses this norm instead of gravity, so that a scale error does not look like a tilt.
        let norm = sqrt(self.force.mean.norm_squared());
        // With fewer than 20 samples the mean is too noisy to refuse a start.
        let refused = if moves || drifts {
            Some(Unready::Moving)
        } else if abs_max(&self.rates.mean) > settings.gyro_bias_max_rad_s && self.count >= 20.0 {
            Some(Unready::Turning)
        } else if (norm - settings.gravity_m_s2).abs() > 2.0 * force + settings.accel_bias_m_s2 && self.count >= 20.0 {
            Some(Unready::NotGravity)
        } else if self.count >= 20.0 && self.force.mean.z < tilt_cosine(settings.align_tilt_rad, 0.0) * norm {
            Some(Unready::Tilted)
        } else {
            None
        };
        if let Some(why) = refused {
            self.again(why);
            return None;
        }
        // `why` keeps the reason of the last refusal for the user.
        (elapsed_s >= settings.align_s).then(|| self.result(norm, elapsed_s, settings)).flatten()
    }

    fn result(&self, norm: f32, time_s: f32, settings: &Settings) -> Option<AlignmentResult> {
        let level = levelling(&(self.force.mean * (1.0 / norm)))?;
        let (sum, count, variance) = self.field;
        let field = (count > 0.0).then(|| matrix(&level) * (sum * (1.0 / count)));
        // Turn about z that gives the heading, its variance, and whether it is by the field. A tracker's attitude comes
        // first, then a measured heading, then the field.
        let nose = matrix(&level);
        let given = self.heading.map(|(heading, sigma)| (heading - atan2(nose.m21, nose.m11), sigma * sigma, false));
        let by_field = field.map(|field| {
            let horizontal = field.x * field.x + field.y * field.y;
            // The declination is negated because the earth frame's y points west and declination is positive to the
            // east. If the field has no horizontal part, the variance is infinite and the heading is unknown.
            (-settings.declination_rad - atan2(field.y, field.x), variance / (count * horizontal), true)
        });
        let pose = self.pose.map(|(attitude, sigma)| (yaw_between(&attitude, &level), sigma * sigma, false));
        let by_field = by_field.filter(|_| settings.mag_slow_rad * settings.mag_slow_rad < VAGUE);
        let turn = pose.or(given).or(by_field).filter(|(turn, variance, _)| turn.is_finite() && *variance < VAGUE);
        let about_z = crate::rotation::about_z(turn.map_or(0.0, |(turn, ..)| turn));
        let field = field.map(|field| matrix(&about_z) * field);
        let dip = field.filter(|_| turn.is_some_and(|(_, _, by_field)| by_field)).map_or((0.0, 0.0), |field| {
            let slope = -field.z / (field.x * field.x + field.y * field.y);
            (slope * field.x, slope * field.y)
        });
        // `squares / count` is the variance of a sample. The variance of the mean is smaller by another factor of
        // `count`.
        let of_mean = |mean: &RunningMean| abs_max(&mean.squares) / (self.count * self.count);
        Some(AlignmentResult {
            attitude: normalized(&(about_z * level)),
            gyro_bias: self.rates.mean,
            force: self.force.mean,
            heading_variance: turn.map(|(_, variance, _)| variance),
            dip,
            by_field: turn.is_some_and(|(_, _, by_field)| by_field),
            field,
            rates_variance: of_mean(&self.rates),
            force_variance: of_mean(&self.force),
            time_s,
        })
    }
}
