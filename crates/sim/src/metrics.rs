//! Figures of merit of one flight.

use crate::flight::{EstimateErrors, Innovation, Sample};
pub use afbc_estimator::AidSource;

use nalgebra::{Vector3, Vector4};

/// Time from which errors are evaluated, since flights start far from the reference \[s\].
pub const SETTLED_S: f64 = 5.0;

/// Figures of merit. Vectors are \[x, y, z, psi\] in m and rad, or \[U1, U2, U3, U4\] in N.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Metrics {
    /// True if the flight reached [`SETTLED_S`]. Otherwise only [`Metrics::final_error`] was measured.
    pub settled: bool,
    /// Root mean square error from [`SETTLED_S`] to the end.
    pub rmse: Vector4<f64>,
    /// Largest absolute error from [`SETTLED_S`] to the end.
    pub max_abs: Vector4<f64>,
    /// Largest distance from the reference from [`SETTLED_S`] to the end \[m\].
    pub max_distance_m: f64,
    /// Error at the end, reference minus vehicle.
    pub final_error: Vector4<f64>,
    /// Mean |change of U| per step from [`SETTLED_S`] to the end: a measure of chatter.
    pub mean_abs_delta_u: Vector4<f64>,
    /// Accuracy of the vehicle's own estimate from [`SETTLED_S`] to the end; none without instruments.
    pub estimate: Option<EstimateMetrics>,
}

/// Accuracy of the vehicle's own estimate: root mean square errors of each coordinate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EstimateMetrics {
    /// Error of the position \[m\].
    pub position_m: Vector3<f64>,
    /// Error of the velocity \[m/s\].
    pub velocity_m_s: Vector3<f64>,
    /// Rotation error about the axes of the earth frame, the third being the heading \[rad\].
    pub attitude_rad: Vector3<f64>,
    /// Mean normalised estimation error squared of these nine errors: nine if the estimator is consistent.
    pub nees: f64,
    /// Share of the time in which the estimate was valid.
    pub valid_ratio: f64,
    /// Agreement of the measurements with the estimate, in the order of [`AidSource::ALL`].
    pub aids: [AidMetrics; AidSource::ALL.len()],
}

/// Agreement of one kind of measurements with the estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AidMetrics {
    /// Number of fused measurements.
    pub fused: u64,
    /// Number of scalars in the fused measurements.
    pub scalars: u64,
    /// Number of measurements that the gate rejected.
    pub rejected: u64,
    /// Mean normalised innovation squared per fused scalar: one if measurements and estimate are consistent.
    pub nis: f64,
}

/// Accumulates [`Metrics`] step by step.
#[derive(Clone, Debug, Default)]
pub struct Accumulator {
    errors: u64,
    changes: u64,
    sum_squares: Vector4<f64>,
    max_abs: Vector4<f64>,
    max_distance_m: f64,
    last_error: Vector4<f64>,
    sum_abs_delta_u: Vector4<f64>,
    last_u: Option<Vector4<f64>>,
    /// Sums over the steps with an estimate; errors are summed as squares.
    estimate: EstimateMetrics,
    estimates: u64,
}

/// Returns reference minus vehicle: \[x, y, z, psi\], with the yaw error wrapped to +-pi.
#[inline]
pub fn tracking_error(sample: &Sample) -> Vector4<f64> {
    use core::f64::consts::TAU;
    let position = sample.reference.position_m - sample.motion.position_m;
    let yaw = sample.reference.yaw_rad - sample.motion.attitude_rad.z;
    Vector4::new(position.x, position.y, position.z, yaw - TAU * libm::rint(yaw / TAU))
}

/// Returns the inputs U1..U4 that the rotors produce \[N\].
#[inline]
pub fn inputs(sample: &Sample) -> Vector4<f64> {
    let u = sample.action.given;
    Vector4::new(u.roll_n, u.pitch_n, u.yaw_n, u.thrust_n).cast()
}

/// Returns true if errors are evaluated at this time.
#[inline]
pub fn is_settled(time_s: f64) -> bool {
    // The tolerance is half a microsecond, since times are decimal and steps binary.
    time_s >= SETTLED_S - 5e-7
}

impl Metrics {
    /// Returns `figure`, one of those evaluated from [`SETTLED_S`] on; none if the flight ended before.
    pub fn measured(&self, figure: f64) -> Option<f64> {
        self.settled.then_some(figure)
    }
}

impl Accumulator {
    /// Adds one step.
    // This function is inlined, so that only the used parts of a sample are ever built.
    #[inline(always)]
    pub fn add(&mut self, sample: &Sample) {
        self.last_error = tracking_error(sample);
        if is_settled(sample.time_s) {
            self.add_error(inputs(sample));
            if let Some(estimated) = &sample.estimated {
                self.add_estimate(estimated);
            }
        }
    }

    /// Adds the last tracking error and the inputs of the same step.
    #[inline(never)]
    fn add_error(&mut self, u: Vector4<f64>) {
        let error = self.last_error;
        self.errors += 1;
        self.sum_squares += error.component_mul(&error);
        self.max_abs = self.max_abs.sup(&error.abs());
        self.max_distance_m = self.max_distance_m.max(error.xyz().norm());
        if let Some(last) = self.last_u.replace(u) {
            self.changes += 1;
            self.sum_abs_delta_u += (u - last).abs();
        }
    }

    #[inline(never)]
    fn add_estimate(&mut self, estimated: &EstimateErrors) {
        let square = |error: &Vector3<f32>| error.cast::<f64>().map(|x| x * x);
        self.estimates += 1;
        self.estimate.position_m += square(&estimated.position_error_m);
        self.estimate.velocity_m_s += square(&estimated.velocity_error_m_s);
        self.estimate.attitude_rad += square(&estimated.attitude_error_rad);
        self.estimate.nees += f64::from(estimated.nees);
        self.estimate.valid_ratio += f64::from(u8::from(estimated.valid));
        estimated.innovation.iter().for_each(|innovation| self.add_innovation(innovation));
    }

    fn add_innovation(&mut self, innovation: &Innovation) {
        let of_aid = AidSource::ALL.iter().zip(&mut self.estimate.aids).find(|(aid, _)| **aid == innovation.aid);
        let Some((_, metrics)) = of_aid else { return };
        if innovation.fused {
            metrics.fused += 1;
            metrics.scalars += u64::from(innovation.scalars);
            metrics.nis += f64::from(innovation.nis);
        } else {
            metrics.rejected += 1;
        }
    }

    /// Returns the metrics so far; zero where nothing was measured.
    pub fn finish(&self) -> Metrics {
        let mean = |sum: Vector4<f64>, count: u64| if count == 0 { sum } else { sum / count as f64 };
        let EstimateMetrics { position_m, velocity_m_s, attitude_rad, nees, valid_ratio, aids } = self.estimate;
        let count = self.estimates as f64;
        let root = |sum: Vector3<f64>| (sum / count).map(libm::sqrt);
        Metrics {
            settled: self.errors > 0,
            rmse: mean(self.sum_squares, self.errors).map(libm::sqrt),
            max_abs: self.max_abs,
            max_distance_m: self.max_distance_m,
            final_error: self.last_error,
            mean_abs_delta_u: mean(self.sum_abs_delta_u, self.changes),
            estimate: (self.estimates > 0).then(|| EstimateMetrics {
                position_m: root(position_m),
                velocity_m_s: root(velocity_m_s),
                attitude_rad: root(attitude_rad),
                nees: nees / count,
                valid_ratio: valid_ratio / count,
                // An aid without fused measurements has a sum of 0: its mean becomes 0, not NaN.
                aids: aids.map(|aid| AidMetrics { nis: aid.nis / aid.scalars.max(1) as f64, ..aid }),
            }),
        }
    }
}
