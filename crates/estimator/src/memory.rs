//! Memory of the estimator: everything that changes from step to step.

use crate::aid::{AidRecords, AidSet, AidSource, FrozenPoseDetector};
use crate::align::Alignment;
use crate::covariance::Covariance;
use crate::errors::PredictionInterval;
use crate::estimate::{DroppedMeasurements, Resets};
use crate::height_watch::HeightWatch;
use crate::history::StateHistory;
use crate::imu::{ImuMonitor, LowPassFilter2pMemory};
use crate::inertial::InertialState;
use crate::measurement::Measurement;
use crate::nominal::NominalState;
use crate::queue::{MeasurementQueue, PendingFusion};
use crate::rest::RestDetector;
use crate::rotation::identity;
use crate::settings::Settings;
use crate::yaw_bank::YawBank;
use afbc_types::Stamped;
use nalgebra::{Matrix3, Quaternion, Vector2, Vector3};

/// Memory of an estimator. The default is the memory before the first sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory {
    /// True once the filter runs.
    pub(crate) runs: bool,
    /// Whether the motors cannot carry the vehicle; `None` if unknown.
    pub(crate) on_ground: Option<bool>,
    pub(crate) rest: RestDetector,
    pub(crate) align: Alignment,
    pub(crate) monitor: ImuMonitor,
    pub(crate) smoothed: LowPassFilter2pMemory,
    pub(crate) nominal: NominalState,
    pub(crate) covariance: Covariance,
    /// Number of the covariance block that was checked last.
    pub(crate) watched: u8,
    /// Time of the covariance and of the history's newest entry \[us\].
    pub(crate) covariance_us: u64,
    /// Motion since `covariance_us`.
    pub(crate) interval: PredictionInterval,
    /// Rotation at `covariance_us`.
    pub(crate) rotation: Matrix3<f32>,
    /// Product of the attitude corrections since `covariance_us`.
    pub(crate) turned: Quaternion<f32>,
    /// Variances that the next prediction adds for clipped or missing samples: attitude and velocity.
    pub(crate) rough: (f32, f32),
    /// Sum of the variances for recent clipped or missing samples, and the time of the last such sample \[us\].
    pub(crate) lately: ((f32, f32), u64),
    pub(crate) history: StateHistory,
    /// Sum of the horizontal velocity changes by specific force, never corrected \[m/s\].
    pub(crate) pushed: Vector2<f32>,
    pub(crate) yaw_bank: YawBank,
    /// Time since which the yaw bank contradicts the heading \[us\].
    pub(crate) contradicted_us: Option<u64>,
    /// Time of the last rejected position while a fused velocity carried the old position on \[us\]. The validity of
    /// the position depends on it.
    pub(crate) carried_us: Option<u64>,
    /// Change of position \[m\] and velocity \[m/s\] by measurements in the last step.
    pub(crate) moved: (Vector3<f32>, Vector3<f32>),
    pub(crate) queue: MeasurementQueue,
    /// Fix that is being fused.
    pub(crate) fix: Option<PendingFusion>,
    /// Barometer offset \[m\], meaningful once it is known.
    pub(crate) height_offset: f32,
    pub(crate) knows: KnownStates,
    /// Strength and sine of the inclination of the magnetic field, `None` until measured.
    pub(crate) field: Option<(f32, f32)>,
    pub(crate) aids: AidRecords,
    /// Aids that were ignored when their last measurement was taken.
    pub(crate) ignored: AidSet,
    /// Mean innovations of motion and rotation along the earth's axes, in standard deviations.
    pub(crate) leaning: [Vector3<f32>; 2],
    /// True while the innovations about the vertical lean to one side: field or gyroscope bias drifts.
    pub(crate) doubts_field: bool,
    pub(crate) height_watch: HeightWatch,
    pub(crate) repeated: FrozenPoseDetector,
    pub(crate) repeated_field: FrozenPoseDetector,
    /// Time of the last zero-velocity fusion \[us\].
    pub(crate) still_us: u64,
    /// Time at which the vehicle was last held at rest \[us\].
    pub(crate) held_us: Option<u64>,
    /// Time of the last reset by a rejected aid \[us\].
    pub(crate) reset_us: Option<u64>,
    pub(crate) resets: Resets,
    pub(crate) dropped: DroppedMeasurements,
}

/// Parts of the state that were measured since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct KnownStates {
    pub(crate) position: bool,
    pub(crate) heading: bool,
    pub(crate) height_offset: bool,
}

/// Time for which rough samples are summed up, longer than the age of any measurement \[us\].
const LATELY_US: u64 = 300_000;

/// Interval of zero length.
pub(crate) const NO_INTERVAL: PredictionInterval = PredictionInterval {
    time_s: 0.0,
    turn: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    thrust: Vector3::new(0.0, 0.0, 0.0),
};

impl Default for Memory {
    fn default() -> Self {
        Memory {
            runs: false,
            on_ground: None,
            rest: RestDetector::default(),
            align: Alignment::default(),
            monitor: ImuMonitor::default(),
            smoothed: LowPassFilter2pMemory::default(),
            nominal: NominalState::default(),
            covariance: Covariance::default(),
            watched: 0,
            covariance_us: 0,
            interval: NO_INTERVAL,
            rotation: Matrix3::identity(),
            turned: identity(),
            rough: (0.0, 0.0),
            lately: ((0.0, 0.0), 0),
            history: StateHistory::default(),
            pushed: Vector2::zeros(),
            yaw_bank: YawBank::default(),
            contradicted_us: None,
            carried_us: None,
            moved: (Vector3::zeros(), Vector3::zeros()),
            queue: MeasurementQueue::default(),
            fix: None,
            height_offset: 0.0,
            knows: KnownStates::default(),
            field: None,
            aids: AidRecords::default(),
            ignored: AidSet::default(),
            leaning: [Vector3::zeros(); 2],
            doubts_field: false,
            height_watch: HeightWatch::default(),
            repeated: FrozenPoseDetector::default(),
            repeated_field: FrozenPoseDetector::default(),
            still_us: 0,
            held_us: None,
            reset_us: None,
            resets: Resets::default(),
            dropped: DroppedMeasurements::default(),
        }
    }
}

impl Memory {
    /// Queues a measurement, which one of the next steps fuses. An implausible one ([`Measurement::is_plausible`]) is
    /// refused. If eight measurements wait, the oldest is dropped. Both are counted.
    pub fn offer(&mut self, measurement: &Stamped<Measurement>) {
        if !measurement.value.is_plausible() {
            self.dropped.implausible = self.dropped.implausible.saturating_add(1);
        } else if self.queue.push(measurement) {
            self.dropped.crowded = self.dropped.crowded.saturating_add(1);
        }
    }

    /// Tells the filter whether the motors cannot carry the vehicle (off, or idle on the ground). If they cannot, the
    /// filter fuses zero velocity whenever the IMU shows rest, which also holds attitude, position and biases. A
    /// vehicle moved by hand is not held. Without this call, the vehicle is held from the alignment until it first
    /// moves: later, rest may be a hover in calm air.
    pub fn set_on_ground(&mut self, on_ground: bool) {
        self.on_ground = Some(on_ground);
    }

    /// Returns true if IMU and motors show that the vehicle stands.
    pub(crate) fn stands(&self) -> bool {
        self.rest.is_still() && self.on_ground.unwrap_or(self.rest.unmoved)
    }

    /// Adds variances of attitude and velocity for a clipped sample or a gap at `at_us`.
    #[cold]
    pub(crate) fn inflate_variances(&mut self, at_us: u64, theta: f32, velocity: f32) {
        self.rough = (self.rough.0 + theta, self.rough.1 + velocity);
        let (sum, last_us) = self.lately;
        let (before, soon) = (sum, at_us.saturating_sub(last_us) <= LATELY_US);
        let (old_theta, old_velocity) = if soon { before } else { (0.0, 0.0) };
        self.lately = ((old_theta + theta, old_velocity + velocity), at_us);
    }

    /// Returns an upper bound of the variances of attitude and velocity added by clipping and gaps since `at_us`.
    pub(crate) fn roughened_since(&self, at_us: u64) -> (f32, f32) {
        if at_us < self.lately.1 { self.lately.0 } else { (0.0, 0.0) }
    }

    /// Returns the fusion records of the aiding sensors.
    #[must_use]
    pub fn aids(&self) -> &AidRecords {
        &self.aids
    }

    /// Returns the aids that contradict the state: their measurements arrive, but none was fused for 1.2 s, or only as
    /// a weak hint (a magnetic field that seems to drift). An aid that falls silent then stays in the set.
    #[must_use]
    pub fn ignored(&self) -> AidSet {
        if self.doubts_field { self.ignored.with(AidSource::Heading) } else { self.ignored }
    }

    /// Returns the numbers of measurements dropped before the gate.
    #[must_use]
    pub fn dropped(&self) -> &DroppedMeasurements {
        &self.dropped
    }

    /// Returns true once the filter runs.
    #[must_use]
    pub fn runs(&self) -> bool {
        self.runs
    }

    /// Returns the state at the last IMU sample, `None` before the filter runs. `to_body` is the IMU's rotation
    /// ([`ImuCalibration::to_body`](crate::ImuCalibration::to_body)).
    #[must_use]
    pub fn inertial(&self, settings: &Settings, to_body: Matrix3<f32>) -> Option<InertialState> {
        let NominalState { rotation, velocity, rates, force, gyro_bias, accel_bias, .. } = self.nominal;
        let at_us = self.monitor.at_us().filter(|_| self.runs)?;
        let gravity = settings.gravity_m_s2;
        Some(InertialState { at_us, rotation, velocity, rates, force, gyro_bias, accel_bias, gravity, to_body })
    }

    /// Returns the covariance of the errors (truth minus estimate) as symmetric rows, in the order: rotation in the
    /// earth frame \[rad\], velocity \[m/s\], position \[m\], gyroscope bias \[rad/s\], accelerometer bias \[m/s2\],
    /// barometer offset \[m\]. For tests and logs; the call is slow.
    #[must_use]
    pub fn covariance(&self) -> [[f32; 16]; 16] {
        self.covariance.rows()
    }

    /// Returns the first nine rows and columns of [`Self::covariance`]: rotation, velocity, position.
    #[must_use]
    pub fn covariance_of_motion(&self) -> [[f32; 9]; 9] {
        self.covariance.of_motion()
    }
}
