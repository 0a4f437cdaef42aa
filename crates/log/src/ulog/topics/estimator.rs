//! Topics of the estimator: its state, its validity, and the measurements that it was offered.

use crate::ulog::layout::message;
use crate::ulog::moment::{Moment, flip, flip_turn};
use afbc_estimator::{AidSource, Estimate, Measurement};

const NUMBERS: usize = Measurement::NUMBERS;
/// Number of kinds of aiding measurements.
const AIDS: usize = AidSource::ALL.len();
/// Number of the estimator's states, and the sizes of the state and variance arrays in PX4's message.
const STATES: usize = 16;
const PX4_STATES: usize = 24;
const PX4_COVARIANCES: usize = 23;

message! {
    /// The estimated state, with variances of its errors.
    "estimator_states" EstimatorVector {
        timestamp_sample: u64 = "us",
        states: [f32; PX4_STATES] = "quaternion, velocity m/s, position m, biases rad/s and m/s2; then zeros",
        covariances: [f32; PX4_COVARIANCES] = "variances in the order of `states`, rotation (three) first; then zeros",
        n_states: u8 = "",
    }
}

impl EstimatorVector {
    /// Returns none before the estimator has started.
    pub(crate) fn of(moment: &Moment<'_>) -> Option<Self> {
        let estimate = moment.details.estimate.filter(|estimate| estimate.unready.is_none())?;
        let Estimate { state, sigmas, .. } = &estimate;
        let vectors = [state.velocity_m_s, state.position_m, estimate.gyro_bias_rad_s, estimate.accel_bias_m_s2];
        let all = flip_turn(estimate.attitude).into_iter().chain(vectors.into_iter().flat_map(flip));
        let mut states = [0.0; PX4_STATES];
        states.iter_mut().zip(all).for_each(|(to, from)| *to = from);
        let sigmas = [
            sigmas.attitude_rad,
            sigmas.velocity_m_s,
            sigmas.position_m,
            sigmas.gyro_bias_rad_s,
            sigmas.accel_bias_m_s2,
        ];
        let mut covariances = [0.0; PX4_COVARIANCES];
        let squares = sigmas.iter().flat_map(|sigmas| [sigmas.x, sigmas.y, sigmas.z]).map(|sigma| sigma * sigma);
        covariances.iter_mut().zip(squares).for_each(|(to, from)| *to = from);
        Some(EstimatorVector {
            timestamp: moment.now_us(),
            timestamp_sample: estimate.at_us,
            states,
            covariances,
            n_states: STATES as u8,
        })
    }
}

message! {
    /// Flags and accuracy of the estimate: which of its parts are valid.
    "estimator_status" EstimatorFlags {
        timestamp_sample: u64 = "us",
        pos_horiz_accuracy: f32 = "m",
        pos_vert_accuracy: f32 = "m",
        solution_status_flags: u16 = "ESTIMATOR_STATUS_FLAGS of MAVLink",
        reset_count_vel_ne: u8 = "",
        reset_count_vel_d: u8 = "",
        reset_count_pos_ne: u8 = "",
        reset_count_pod_d: u8 = "",
        reset_count_quat: u8 = "",
    }
}

impl EstimatorFlags {
    /// Returns none without an inertial sensor.
    pub(crate) fn of(moment: &Moment<'_>) -> Option<Self> {
        let estimate = moment.details.estimate?;
        let (validity, resets, sigmas) = (estimate.validity, estimate.resets, estimate.sigmas);
        let is_global = validity.position && moment.reference().is_some();
        // Attitude; horizontal and vertical velocity; relative and absolute horizontal position; absolute height.
        let flags = [
            (validity.attitude, 1),
            (validity.velocity, 2),
            (validity.velocity || validity.height, 4),
            (validity.position, 8),
            (is_global, 16),
            (validity.height, 32),
        ];
        Some(EstimatorFlags {
            timestamp: moment.now_us(),
            timestamp_sample: estimate.at_us,
            pos_horiz_accuracy: sigmas.position_m.x.max(sigmas.position_m.y),
            pos_vert_accuracy: sigmas.position_m.z,
            solution_status_flags: flags.iter().filter(|(is, _)| *is).map(|(_, flag)| flag).sum(),
            reset_count_vel_ne: resets.velocity as u8,
            reset_count_vel_d: resets.velocity as u8,
            reset_count_pos_ne: resets.position as u8,
            reset_count_pod_d: resets.height as u8,
            reset_count_quat: resets.heading as u8,
        })
    }
}

message! {
    /// The estimator's judgement of each kind of measurement. The order is a tracker's position and attitude, a
    /// receiver's position, height and velocity, the height, and the heading. Also, whether the estimator holds the
    /// vehicle at rest.
    "afbc_estimator" EstimatorFigures {
        nis: [f32; AIDS] = "normalised innovation squared of the last measurement; a lower bound if it was rejected",
        accepted: [u32; AIDS] = "",
        rejected: [u32; AIDS] = "",
        heading_sigma_rad: f32 = "rad",
        height_offset_m: f32 = "m",
        vibration_m_s2: f32 = "m/s2",
        scalars: [u8; AIDS] = "scalars in the last measurement, the expected value of `nis`",
        on_ground: bool = "whether the motors give too little thrust to lift the vehicle in this tick",
        at_rest: bool = "",
    }
}

impl EstimatorFigures {
    /// Returns none without an inertial sensor.
    pub(crate) fn of(moment: &Moment<'_>) -> Option<Self> {
        let (estimate, aids) = (moment.details.estimate?, &moment.details.aids);
        let records = AidSource::ALL.map(|aid| *aids.of(aid));
        Some(EstimatorFigures {
            timestamp: moment.now_us(),
            nis: records.map(|record| record.nis),
            accepted: records.map(|record| record.accepted),
            rejected: records.map(|record| record.rejected),
            heading_sigma_rad: estimate.sigmas.attitude_rad.z,
            height_offset_m: estimate.height_offset_m,
            vibration_m_s2: estimate.imu.vibration_m_s2,
            scalars: records.map(|record| record.scalars),
            on_ground: moment.details.on_ground,
            at_rest: estimate.at_rest,
        })
    }

    /// Returns true if both agree on `on_ground` and `at_rest`.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        (self.on_ground, self.at_rest) == (other.on_ground, other.at_rest)
    }
}

message! {
    /// A measurement as the estimator was offered it, in the local frame, in this project's frames.
    "afbc_aid" AidOffered {
        timestamp_sample: u64 = "us",
        numbers: [f32; NUMBERS] = "numbers of the measurement; their meaning depends on `kind`",
        kind: u8 = "1 pose, 2 position, 3 GNSS, 4 height, 5 magnetic field, 6 heading",
    }
}

impl AidOffered {
    pub(crate) fn of(timestamp: u64, timestamp_sample: u64, measurement: &Measurement) -> Self {
        let (kind, numbers) = measurement.numbers();
        AidOffered { timestamp, timestamp_sample, numbers, kind }
    }
}
