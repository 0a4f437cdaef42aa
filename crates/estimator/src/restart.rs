//! Starts and restarts of the filter, and increases of its variances.

use crate::align::AlignmentResult;
use crate::covariance::{Covariance, angle_variance};
use crate::errors::{ErrorVector, SlowErrors, VectorComponent};
use crate::estimate::{Sigmas, count};
use crate::estimator::Estimator;
use crate::history::PastState;
use crate::horizon::magnetic;
use crate::memory::{KnownStates, Memory, NO_INTERVAL};
use crate::nominal::NominalState;
use crate::rest::RestDetector;
use crate::rotation::{identity, normalized};
use crate::settings::Settings;
use crate::yaw_bank::YawBank;
use afbc_control::math::{abs_max, max};
use afbc_types::State;
use nalgebra::{Matrix3, Quaternion, Vector2, Vector3};

/// Variance of a completely unknown angle, pi^2/3.
const ANY_ANGLE: f32 = 3.28;
/// Initial standard deviations of the velocity at rest \[m/s\] and of the position \[m\].
const REST_M_S: f32 = 2e-3;
const UNTOLD_M: f32 = 0.01;
/// Variance of levelling apart from noise \[rad2\].
const LEVEL: f32 = 1e-8;
/// Standard deviation added to roll and pitch when the tilt is doubted \[rad\].
const DOUBT_RAD: f32 = 0.2;
/// Standard deviations added to the biases when the tilt is doubted: gyroscope \[rad/s\], accelerometer \[m/s2\].
const DOUBT_RAD_S: f32 = 0.02;
const DOUBT_M_S2: f32 = 0.2;
/// Standard deviations added to the biases for each scalar while the mean innovation is too large.
const LEANING_RAD_S: f32 = 1e-3;
const LEANING_M_S2: f32 = 0.02;
/// Share of the variance about the vertical that the other axes get.
const LEANT: f32 = 0.01;

/// Factors that keep all errors.
pub(crate) const KEEP: ErrorVector = {
    const ONES: Vector3<f32> = Vector3::new(1.0, 1.0, 1.0);
    ErrorVector {
        theta: ONES,
        velocity: ONES,
        position: ONES,
        gyro: ONES,
        accel: ONES,
        baro: 1.0,
        slow: SlowErrors::new(1.0, 1.0, 1.0, 1.0, 1.0),
    }
};
pub(crate) const NONE: Vector3<f32> = Vector3::new(0.0, 0.0, 0.0);

/// Returns a diagonal block.
fn diagonal(variances: &Vector3<f32>) -> Matrix3<f32> {
    Matrix3::from_diagonal(variances)
}

fn squared(sigma: &Vector3<f32>) -> Vector3<f32> {
    sigma.component_mul(sigma)
}

impl Memory {
    /// Starts the filter from an alignment at rest.
    pub(crate) fn begin(&mut self, now_us: u64, aligned: &AlignmentResult, estimator: &Estimator) {
        let settings = &estimator.settings;
        let Settings { gravity_m_s2: gravity, accel_bias_m_s2: bias, .. } = *settings;
        let mut nominal = NominalState::new(aligned.attitude);
        nominal.gyro_bias = aligned.gyro_bias;
        // Levelling takes the accelerometer bias for a tilt, theta = (-(R a)_y, (R a)_x)/g, and an inclined field turns
        // that tilt into a heading error.
        let r = nominal.rotation;
        let (x, y) = (-r.row(1) * (1.0 / gravity), r.row(0) * (1.0 / gravity));
        let (dip_x, dip_y) = aligned.dip;
        let by_bias = Matrix3::from_rows(&[x, y, -(x * dip_x + y * dip_y)]);
        // Two effects are of second order. The bias along z changes gravity's measured size, and the heading error
        // changes the direction.
        let share = bias * bias / (gravity * gravity);
        let own = if aligned.by_field { estimator.magnetic_variance } else { 0.0 };
        let turned = aligned.heading_variance.unwrap_or(0.0) + own;
        let dips = 1.0 + dip_x * dip_x + dip_y * dip_y;
        let second = share * (share + turned + dips * share) + LEVEL;
        let of_mean = |noise: f32, seen: f32| max(noise * noise / aligned.time_s, seen);
        let tilt = of_mean(settings.accel_noise_m_s2_rthz, aligned.force_variance) / (gravity * gravity) + second;
        let heading = aligned.heading_variance.unwrap_or(ANY_ANGLE) + second * dips;
        let walk = settings.gyro_walk_rad_s_rts;
        let gyro = of_mean(settings.gyro_noise_rad_s_rthz, aligned.rates_variance) + walk * walk * aligned.time_s;
        self.covariance = Covariance {
            tt: by_bias * by_bias.transpose() * (bias * bias) + diagonal(&Vector3::new(tilt, tilt, heading)),
            ta: by_bias * (bias * bias),
            vv: diagonal(&Vector3::repeat(REST_M_S * REST_M_S)),
            pp: diagonal(&Vector3::repeat(UNTOLD_M * UNTOLD_M)),
            gg: diagonal(&Vector3::repeat(gyro)),
            aa: diagonal(&Vector3::repeat(bias * bias)),
            ..Covariance::default()
        };
        self.knows = KnownStates { heading: aligned.heading_variance.is_some(), ..KnownStates::default() };
        self.field = aligned.field.and_then(|field| reference(&field));
        self.run(now_us, nominal);
        self.rest = RestDetector::aligned(aligned.gyro_bias, aligned.force);
        if aligned.by_field {
            self.covariance.slow.set_field_variance(estimator.magnetic_variance);
            self.point(estimator.magnetic_north);
        }
    }

    /// Starts in the state `state` with the standard deviations `sigmas`, limited to what is possible.
    pub(crate) fn begin_at(&mut self, now_us: u64, state: &State, sigmas: &Sigmas) {
        let mut nominal = NominalState::new(normalized(&state.quaternion().into_inner()));
        nominal.velocity = state.velocity_m_s;
        nominal.move_to(state.position_m);
        let theta = squared(&sigmas.attitude_rad).map(angle_variance);
        self.covariance = Covariance {
            tt: diagonal(&theta),
            vv: diagonal(&squared(&sigmas.velocity_m_s)),
            pp: diagonal(&squared(&sigmas.position_m)),
            gg: diagonal(&squared(&sigmas.gyro_bias_rad_s)),
            aa: diagonal(&squared(&sigmas.accel_bias_m_s2)),
            ..Covariance::default()
        };
        let heading = theta.z < 1.0;
        let position = abs_max(&sigmas.position_m) < 1e3;
        self.knows = KnownStates { position, heading, height_offset: false };
        self.field = None;
        // The last sample does not belong to this state, so the next sample starts the integration.
        self.monitor.forget();
        self.run(now_us, nominal);
    }

    /// Restarts at the present state or, where that is not finite, at the last stored or a zero state.
    #[cold]
    #[inline(never)]
    pub(crate) fn restart(&mut self, now_us: u64) {
        count(&mut self.resets.restarts);
        let old = self.nominal;
        let past = self.history.newest();
        let sound = |q: &Quaternion<f32>| (q.norm_squared() - 1.0).abs() < 0.1;
        let attitude = [Some(old.attitude), past.map(|past| past.attitude)].into_iter().flatten().find(sound);
        let finite = |v: &Vector3<f32>, most: f32| abs_max(v) < most && v.norm_squared().is_finite();
        let or_none = |v: Vector3<f32>, most: f32| if finite(&v, most) { v } else { NONE };
        let mut nominal = NominalState::new(attitude.map_or(identity(), |attitude| normalized(&attitude)));
        nominal.velocity = or_none(old.velocity, 50.0);
        nominal.gyro_bias = or_none(old.gyro_bias, 1.0);
        nominal.accel_bias = or_none(old.accel_bias, 5.0);
        nominal.move_to(or_none(old.position, 5e4));
        self.covariance = Covariance {
            tt: diagonal(&Vector3::new(0.1, 0.1, ANY_ANGLE)),
            vv: diagonal(&Vector3::repeat(25.0)),
            pp: diagonal(&Vector3::repeat(100.0)),
            gg: diagonal(&Vector3::repeat(4e-4)),
            aa: diagonal(&Vector3::repeat(0.1)),
            ..Covariance::default()
        };
        self.knows = KnownStates::default();
        self.align.again(crate::align::Unready::Moving);
        self.run(now_us, nominal);
    }

    /// Starts the alignment again, for example because the axes have changed.
    pub fn align_again(&mut self) {
        self.runs = false;
        self.align.again(crate::align::Unready::Moving);
    }

    fn run(&mut self, now_us: u64, nominal: NominalState) {
        self.runs = true;
        self.nominal = nominal;
        self.rotation = nominal.rotation;
        self.interval = NO_INTERVAL;
        self.rough = (0.0, 0.0);
        self.turned = identity();
        self.fix = None;
        self.height_offset = 0.0;
        self.still_us = now_us;
        self.pushed = Vector2::zeros();
        self.yaw_bank = YawBank::default();
        self.contradicted_us = None;
        self.carried_us = None;
        self.leaning = [NONE; 2];
        self.doubts_field = false;
        self.height_watch.forget();
        self.held_us = None;
        self.rest = RestDetector::default();
        self.covariance.hold();
        self.history.clear();
        self.store_history(now_us);
    }

    /// Stores the present state in the history; the covariance has the same time.
    pub(crate) fn store_history(&mut self, at_us: u64) {
        self.covariance_us = at_us;
        self.history.store(&PastState {
            at_us: at_us as u32,
            attitude: self.nominal.attitude,
            velocity: self.nominal.velocity,
            position: self.nominal.position,
        });
    }

    /// Adds the error of the vehicle's own field to a heading that a magnetometer has measured at the start.
    fn point(&mut self, (x, y): (f32, f32)) {
        let row = magnetic(&self.nominal.rotation, &Vector3::new(x, y, 0.0));
        self.covariance.tt.m33 += self.covariance.slow.of_row(&row);
        self.covariance.slow.point(&row);
    }

    /// Raises the variance of roll and pitch, after the second reset in a row.
    pub(crate) fn inflate_tilt(&mut self) {
        count(&mut self.resets.tilt);
        let variance = DOUBT_RAD * DOUBT_RAD;
        let tt = &mut self.covariance.tt;
        tt.m11 += variance;
        tt.m22 += variance;
        // The cause is often a bias that has changed.
        self.covariance.gg += diagonal(&Vector3::repeat(DOUBT_RAD_S * DOUBT_RAD_S));
        self.covariance.aa += diagonal(&Vector3::repeat(DOUBT_M_S2 * DOUBT_M_S2));
        self.covariance.hold();
    }

    /// Raises the bias variances a little, once for each scalar with too large a mean innovation: the gyroscope's, and
    /// also the accelerometer's if the scalar measures motion rather than rotation.
    #[cold]
    pub(crate) fn doubt_biases(&mut self, turns: bool) {
        self.covariance.gg += diagonal(&Vector3::repeat(LEANING_RAD_S * LEANING_RAD_S));
        if !turns {
            self.covariance.aa += diagonal(&Vector3::repeat(LEANING_M_S2 * LEANING_M_S2));
        }
        self.covariance.hold();
    }

    /// Raises the variance of the gyroscope bias about the vertical, after a heading reset. The other axes get a little
    /// too; otherwise rounding of the large increase would swamp their small variance.
    pub(crate) fn inflate_vertical_gyro_bias(&mut self) {
        let up = VectorComponent::Z.row(&self.nominal.rotation) * DOUBT_RAD_S;
        self.covariance.gg += up * up.transpose() + diagonal(&Vector3::repeat(LEANT * DOUBT_RAD_S * DOUBT_RAD_S));
        self.covariance.hold();
    }
}

/// Returns the strength of a field in the earth frame and the sine of its inclination.
pub(crate) fn reference(field: &Vector3<f32>) -> Option<(f32, f32)> {
    let strength = afbc_control::math::sqrt(field.norm_squared());
    (strength > 0.0).then(|| (strength, field.z / strength))
}
