//! The estimator and its step: IMU sample, prediction or fusion, output.

use crate::align::Unready;
use crate::covariance::{BLOCKS, ProcessNoise, largest_sigma};
use crate::estimate::{Estimate, Sigmas, Validity, count};
use crate::imu::LowPassFilter2p;
use crate::measurement::ImuSample;
use crate::memory::{Memory, NO_INTERVAL};
use crate::nominal::NominalState;
use crate::rotation::{euler, identity, matrix, renormalized};
use crate::settings::Settings;
use afbc_control::math::{max, min, sqrt, wrap_angle};
use afbc_types::{Declared, OutOfRange, State};
use nalgebra::Vector3;

/// Period of the covariance prediction \[us\], less half a millisecond so that the sample at 4 ms is never late.
const PREDICT_US: u64 = 3_500;
/// Limits of a sample's time: at most this far in the future, and at most this old \[us\].
const EARLY_US: u64 = 50_000;
const OLD_US: u64 = 1_000_000;
/// Gap between samples that adds uncertainty, and gap that restarts the filter \[us\].
const GAP_US: u64 = 20_000;
const LOST_US: u64 = 250_000;
/// Motion assumed possible within a gap and unseen by the samples around it: rate \[rad/s\] and acceleration \[m/s2\].
const GAP_RAD_S: f32 = 0.5;
const GAP_M_S2: f32 = 3.0;
/// Time for which a second-order error keeps its value \[s\].
const BENT_S: f32 = 0.7;
/// Time after the last zero-velocity fusion for which the vehicle still counts as held at rest \[us\].
const HELD_US: u64 = 500_000;
/// Variances per second that a clipped gyroscope sample adds to the attitude and a clipped accelerometer sample adds to
/// the velocity: 0.8 rad and 2.4 m/s for 30 ms of clipping. The prediction derives all other effects from these two.
const CLIPPED: (f32, f32) = (20.0, 200.0);

/// The estimator's settings in the form that a step needs. Everything that changes is in [`Memory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimator {
    pub(crate) settings: Settings,
    growth: ProcessNoise,
    low_pass: LowPassFilter2p,
    pub(crate) gate_squared: f32,
    pub(crate) reacquire_us: u64,
    pub(crate) coast_us: u64,
    pub(crate) frozen_us: u64,
    stuck_us: u64,
    /// Direction of magnetic north in the earth frame, whose x is north and y west.
    pub(crate) magnetic_north_rad: f32,
    /// Cosine and sine of `magnetic_north_rad`.
    pub(crate) magnetic_north: (f32, f32),
    pub(crate) inclination_error_max: f32,
    /// Heading variance that the vehicle's own field along one body axis causes.
    pub(crate) magnetic_variance: f32,
}

impl Estimator {
    /// Creates an estimator.
    ///
    /// # Errors
    /// Returns the first setting that is out of range.
    pub fn new(settings: Settings) -> Result<Self, OutOfRange> {
        settings.validate()?;
        let square = |x: f32| x * x;
        let microseconds = |time_s: f32| (time_s * 1e6) as u64;
        // 0 means never: a time longer than any flight.
        let or_never = |time_s: f32| if time_s > 0.0 { microseconds(time_s) } else { u64::MAX };
        Ok(Estimator {
            growth: ProcessNoise {
                theta: square(settings.gyro_noise_rad_s_rthz),
                velocity: square(settings.accel_noise_m_s2_rthz),
                gyro: square(settings.gyro_walk_rad_s_rts),
                accel: square(settings.accel_walk_m_s2_rts),
                baro: square(settings.baro_walk_m_rts),
            },
            low_pass: LowPassFilter2p::new(settings.rates_cutoff_hz),
            gate_squared: square(settings.gate_sigmas),
            reacquire_us: microseconds(settings.reacquire_s),
            coast_us: microseconds(settings.coast_s),
            frozen_us: or_never(settings.frozen_s),
            stuck_us: or_never(settings.stuck_s),
            // The declination is negated, because the earth frame's y points west and declination is positive to the
            // east.
            magnetic_north_rad: wrap_angle(-settings.declination_rad),
            magnetic_north: (libm::cosf(settings.declination_rad), -libm::sinf(settings.declination_rad)),
            inclination_error_max: settings.inclination_error_max_rad,
            magnetic_variance: square(settings.mag_slow_rad),
            settings,
        })
    }

    /// Returns the settings.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Starts in a given state: in the air after a restart, or at the start of a simulation. Biases are zero. A
    /// position with a sigma of 1 km or more, or a heading with one of 1 rad or more, counts as unknown: the first
    /// measurement sets it. Returns false and changes nothing if the state is not [plausible](State::is_plausible) or a
    /// sigma is negative or not finite.
    pub fn start_at(&self, memory: &mut Memory, now_us: u64, state: &State, sigmas: &Sigmas) -> bool {
        let valid = |v: &Vector3<f32>| v.iter().all(|sigma| (0.0..=1e4).contains(sigma));
        let Sigmas { attitude_rad, velocity_m_s, position_m, gyro_bias_rad_s, accel_bias_m_s2, .. } = sigmas;
        let all = [attitude_rad, velocity_m_s, position_m, gyro_bias_rad_s, accel_bias_m_s2].into_iter().all(valid);
        let usable = all && state.is_plausible();
        if usable {
            memory.begin_at(now_us, state, sigmas);
        }
        usable
    }

    /// Runs one step; call it every millisecond. Takes the newest IMU sample if there is one, predicts the covariance
    /// or fuses measurements, and returns the estimate at the time of the last sample. `now_us` is the time since
    /// power-up. The step cannot fail: the estimate is finite for any input.
    // This function is always inlined, so that the caller computes only the parts of the estimate that it uses and
    // copies none.
    #[inline(always)]
    #[must_use = "the estimate is its only result"]
    pub fn step(&self, memory: &mut Memory, now_us: u64, imu: Option<&ImuSample>) -> Estimate {
        self.advance(memory, now_us, imu);
        self.report(memory, now_us)
    }

    /// Returns the estimate of the last [step](Self::step), which was called at `now_us`.
    #[must_use]
    pub fn estimate(&self, memory: &Memory, now_us: u64) -> Estimate {
        self.report(memory, now_us)
    }

    /// Takes a sample, then predicts or fuses.
    #[inline(never)]
    fn advance(&self, memory: &mut Memory, now_us: u64, imu: Option<&ImuSample>) {
        let predicted = imu.is_some_and(|sample| self.take_sample(memory, now_us, sample));
        memory.moved = (Vector3::zeros(), Vector3::zeros());
        if memory.runs {
            // The history settles only between fixes, because a fix refers to a stored state.
            if predicted {
                // The prediction has used this step's time; the history settles in a later step.
            } else if memory.fix.is_none() && memory.history.is_unsettled() {
                memory.history.settle(self.settings.gravity_m_s2);
            } else {
                let NominalState { position, velocity, .. } = memory.nominal;
                self.fuse(memory, now_us);
                memory.moved = (memory.nominal.position - position, memory.nominal.velocity - velocity);
            }
        } else {
            self.feed_alignment(memory, now_us);
        }
    }

    /// Takes a sample. Returns true if the covariance was predicted.
    fn take_sample(&self, memory: &mut Memory, now_us: u64, sample: &ImuSample) -> bool {
        let last_us = memory.monitor.at_us();
        let possible = sample.at_us <= now_us.saturating_add(EARLY_US) && sample.at_us.saturating_add(OLD_US) >= now_us;
        let newer = last_us.is_none_or(|last_us| sample.at_us > last_us);
        if !(sample.is_plausible() && possible && (newer || memory.monitor.is_lost())) {
            memory.monitor.refuse();
            return false;
        }
        // A repeated sample is not integrated: the attitude would turn at the repeated rate for as long as the sensor
        // is stuck.
        if memory.monitor.repeats(sample, self.stuck_us) {
            return false;
        }
        let clipped = memory.monitor.take(sample, &self.settings);
        let rates = sample.rates_rad_s - memory.nominal.gyro_bias;
        self.low_pass.advance(&mut memory.smoothed, &rates);
        let since_us = last_us.and_then(|last_us| sample.at_us.checked_sub(last_us));
        if !memory.runs {
            self.align(memory, sample);
            return false;
        }
        let Some(gap_us) = since_us.filter(|since_us| *since_us < LOST_US) else {
            // This is the first sample after a start in the air, after lost samples or after a jump of the sample
            // clock.
            if last_us.is_some() {
                memory.restart(sample.at_us);
            }
            memory.covariance_us = sample.at_us;
            memory.history.clear();
            memory.store_history(sample.at_us);
            memory.nominal.begin(sample);
            return false;
        };
        // The gap is shorter than a quarter of a second.
        let dt_s = gap_us as u32 as f32 * 1e-6;
        if gap_us > GAP_US {
            let (turn, speed) = (GAP_RAD_S * dt_s, GAP_M_S2 * dt_s);
            memory.inflate_variances(sample.at_us, turn * turn, speed * speed);
        }
        if clipped.gyro || clipped.accel {
            let of = |clipped, rate: f32| if clipped { rate * dt_s } else { 0.0 };
            memory.inflate_variances(sample.at_us, of(clipped.gyro, CLIPPED.0), of(clipped.accel, CLIPPED.1));
        }
        memory.rest.advance(sample, dt_s, &self.settings);
        memory.interval.thrust += memory.nominal.advance(sample, dt_s, self.settings.gravity_m_s2);
        memory.interval.time_s += dt_s;
        let due = sample.at_us.saturating_sub(memory.covariance_us) >= PREDICT_US;
        if due {
            self.predict(memory, sample);
        }
        due
    }

    /// Predicts the covariance up to the present and stores the state in the history.
    fn predict(&self, memory: &mut Memory, sample: &ImuSample) {
        let mut interval = memory.interval;
        interval.turn = (memory.rotation + memory.nominal.rotation) * (0.5 * interval.time_s);
        let mut growth = self.growth;
        growth.velocity += self.linearization_error(memory);
        // The covariance is rotated before the prediction, because the corrections were made at the beginning of the
        // interval.
        memory.covariance.turn(&matrix(&renormalized(&memory.turned)));
        memory.turned = identity();
        memory.covariance.predict(&interval, &growth);
        memory.covariance.inflate_variances(memory.rough);
        memory.history.advance(interval.time_s, &interval.thrust);
        memory.pushed += interval.thrust.xy();
        memory.rotation = memory.nominal.rotation;
        memory.interval = NO_INTERVAL;
        memory.rough = (0.0, 0.0);
        memory.watched = if memory.watched + 1 < BLOCKS { memory.watched + 1 } else { 0 };
        if memory.nominal.is_sound() && memory.covariance.is_sound() {
            if !memory.covariance.is_possible(memory.watched) {
                memory.covariance.decorrelate();
                count(&mut memory.resets.covariance);
            }
            memory.store_history(sample.at_us);
        } else {
            memory.restart(sample.at_us);
            memory.nominal.begin(sample);
        }
    }

    /// Returns the velocity variance per second that the linear model misses: the second-order acceleration error g
    /// theta_tilt theta. It matters at the start, when levelling has left an angle error of 0.01 rad and the model's
    /// own noise is below 1e-3 m/s2.
    fn linearization_error(&self, memory: &Memory) -> f32 {
        let theta = memory.covariance.variances().theta;
        let tilt = max(theta.x, theta.y);
        let gravity = self.settings.gravity_m_s2;
        BENT_S * gravity * gravity * min(tilt * (tilt + min(theta.z, 1.0)), 0.1)
    }

    /// Runs the alignment, and starts the filter when it is complete.
    fn align(&self, memory: &mut Memory, sample: &ImuSample) {
        if let Some(aligned) = memory.align.advance(sample, &self.settings) {
            memory.begin(sample.at_us, &aligned, self);
            memory.nominal.begin(sample);
        }
    }

    /// Before the start: passes queued measurements to the alignment, which takes the heading from them.
    fn feed_alignment(&self, memory: &mut Memory, now_us: u64) {
        if memory.monitor.health(now_us, &self.settings, self.stuck_us).missing {
            memory.align.again(Unready::NoImu);
        }
        let recent = now_us.saturating_sub(OLD_US);
        // Measurements of any time are taken: before the start there is no history to wait for.
        while let Some(measurement) = memory.queue.take(|_| true) {
            if measurement.at_us >= recent {
                memory.align.add_heading(&measurement.value);
            }
        }
    }

    /// Builds the estimate from the memory.
    #[inline(always)]
    fn report(&self, memory: &Memory, now_us: u64) -> Estimate {
        let imu = memory.monitor.health(now_us, &self.settings, self.stuck_us);
        let Memory { nominal, aids, resets, .. } = memory;
        let mut estimate = Estimate { imu, resets: *resets, ..Estimate::default() };
        estimate.at_us = memory.monitor.at_us().unwrap_or(now_us);
        estimate.attitude = [1.0, 0.0, 0.0, 0.0];
        estimate.state.rates_rad_s = memory.smoothed.output;
        if !memory.runs {
            estimate.unready = Some(memory.align.why);
            return estimate;
        }
        let q = &nominal.attitude;
        estimate.attitude = [q.w, q.i, q.j, q.k];
        estimate.state.attitude_rad = euler(q);
        estimate.state.velocity_m_s = nominal.velocity;
        estimate.state.position_m = nominal.position;
        estimate.gyro_bias_rad_s = nominal.gyro_bias;
        estimate.accel_bias_m_s2 = nominal.accel_bias;
        estimate.height_offset_m = memory.height_offset;
        (estimate.moved_m, estimate.moved_m_s) = memory.moved;
        let variances = memory.covariance.variances();
        let root = |v: &Vector3<f32>| v.map(sqrt);
        estimate.sigmas = Sigmas {
            attitude_rad: root(&variances.theta),
            velocity_m_s: root(&variances.velocity),
            position_m: root(&variances.position),
            gyro_bias_rad_s: root(&variances.gyro),
            accel_bias_m_s2: root(&variances.accel),
            height_offset_m: sqrt(variances.baro),
        };
        let s = &self.settings;
        let at_us = estimate.at_us;
        let tilt = estimate.sigmas.attitude_rad.xy().max();
        let attitude = imu.is_usable() && tilt <= s.tilt_sigma_max_rad;
        let heading = attitude && memory.knows.heading && estimate.sigmas.attitude_rad.z <= s.heading_sigma_max_rad;
        let held_us = memory.held_us.map(|held_us| at_us.saturating_sub(held_us));
        estimate.at_rest = memory.stands() && held_us.is_some_and(|held_us| held_us < HELD_US);
        let held = held_us.is_some_and(|held_us| held_us <= self.coast_us) || aids.holds_velocity(at_us, self.coast_us);
        let (fast, far) = (largest_sigma(&variances.velocity), largest_sigma(&variances.position));
        let velocity = attitude && held && fast <= s.velocity_sigma_max_m_s;
        let carried = || memory.carried_us.is_some_and(|carried_us| at_us.saturating_sub(carried_us) <= self.coast_us);
        let placed = aids.holds_position(at_us, self.coast_us) || carried();
        let position = velocity && placed && memory.knows.position && far <= s.position_sigma_max_m;
        let height = position
            || attitude
                && aids.height.is_live(at_us, self.coast_us)
                && estimate.sigmas.position_m.z <= s.position_sigma_max_m
                && estimate.sigmas.velocity_m_s.z <= s.velocity_sigma_max_m_s;
        estimate.validity = Validity { attitude, heading, velocity, position, height };
        estimate
    }
}
