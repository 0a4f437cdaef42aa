//! Flight on a tracker's poses alone, after the inertial sensor has failed. Not in the paper.
//!
//! A pose is the position and attitude of some milliseconds ago. A law needs the present state, including velocity and
//! body rates. An observer predicts it with the commanded inputs by
//!
//! ```text
//! dp/dt = v,          dv/dt = (T_a/T_trim) g R e3 - g e3 + d
//! dR/dt = R Omega^,   d Omega/dt = (m g/T_trim) (l/I) (U_a - U_trim)
//! ```
//!
//! where T_a and U_a lag behind the inputs and are trimmed as in [`crate::dead_reckoning`], and d is the disturbing
//! acceleration. Rotors that need more than m g to hover count as weaker in their moments too. Each pose is compared
//! with the prediction for the time of the pose. Let w be the bandwidth, T the time between two poses and beta = 1/(1 +
//! w T). The difference, multiplied by these factors, corrects
//!
//! ```text
//! R by 1 - beta^2,  Omega by (1 - beta)^2/T
//! p by 1 - beta^3,  v by 1.5 (1 - beta)^2 (1 + beta)/T,  d by (1 - beta)^3/T^2
//! ```
//!
//! These are fading-memory filters of second and third order, with all poles at beta for any T. A single outlier has
//! little effect, and after a jump of the tracker's frame the observer follows.

use crate::dead_reckoning::{DeadReckoning, Reckoning};
use afbc_control::math::{abs_max, max, min, settled, sqrt};
use afbc_types::{Inputs, Pose, Stamped, State};
use nalgebra::{Quaternion, Vector3};

/// Bandwidth w of the attitude's observer \[rad/s\]. It is as high as the noise of trackers allows, because the fast
/// attitude loop must not act for long on predictions of a wrong model.
pub const ATTITUDE_RAD_S: f32 = 50.0;
/// Bandwidth w of the position's observer \[rad/s\].
pub const POSITION_RAD_S: f32 = 6.0;
/// Largest age on arrival of a pose that is used \[us\].
pub const LATE_US: u32 = 50_000;
/// Largest age of the last pose at which the prediction is still flown \[us\].
pub const HOLD_US: u32 = 100_000;
/// Largest standard deviations of a pose that is used \[m, rad\].
pub const SIGMAS_MAX: (f32, f32) = (0.05, 0.05);
/// Largest difference that counts, along or about any axis: a constant \[m and rad\] for the tracker's noise, plus a
/// rate \[m/s and rad/s\] times the time between two poses for unpredicted motion. A larger one is an outlier, and is
/// limited to this.
pub const OUTLIER: (f32, f32) = (0.02, 3.0);
/// Outliers in a row after which the tracker's frame counts as jumped: position and attitude are set to the pose.
pub const OUTLIERS_MAX: u8 = 3;
/// Smallest and largest T_trim, as a share of m g.
pub const TRIM_SHARE: (f32, f32) = (0.4, 2.5);
/// Largest d along any axis \[m/s2\].
pub const PUSH_MAX_M_S2: f32 = 10.0;

/// Observed motion at the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseObserver {
    position_m: Vector3<f32>,
    velocity_m_s: Vector3<f32>,
    /// Attitude, from body to earth coordinates.
    attitude: Quaternion<f32>,
    rates_rad_s: Vector3<f32>,
    /// Disturbance d \[m/s2\].
    push_m_s2: Vector3<f32>,
    /// Accelerations in the last step \[m/s2, rad/s2\].
    acceleration_m_s2: Vector3<f32>,
    angular_rad_s2: Vector3<f32>,
    /// Lagged thrust T_a and yaw input U_a \[N\].
    thrust_n: f32,
    yaw_n: f32,
    /// Number of outliers since the last good pose.
    outliers: u8,
    /// Last pose used. Before the first, only its time is valid: that of the last measured state.
    pose: Stamped<Pose>,
}

impl PoseObserver {
    /// True if `pose` may be used at `now_us`: it is not too old, and states no large standard deviation.
    #[must_use]
    pub fn takes(pose: &Stamped<Pose>, now_us: u64) -> bool {
        let within = |sigma: Option<f32>, most: f32| sigma.is_none_or(|sigma| sigma <= most);
        let sigmas = &pose.value.sigmas;
        pose.age_us(now_us) <= LATE_US
            && within(sigmas.position_m, SIGMAS_MAX.0)
            && within(sigmas.attitude_rad, SIGMAS_MAX.1)
    }

    /// Starts in `state`, last measured at `at_us`, with rotors that have reached their commands.
    #[must_use]
    pub fn new(state: &State, applied: &Inputs, at_us: u64) -> Self {
        let zero = Vector3::zeros();
        PoseObserver {
            position_m: state.position_m,
            velocity_m_s: state.velocity_m_s,
            attitude: state.quaternion().into_inner(),
            rates_rad_s: state.rates_rad_s,
            push_m_s2: zero,
            acceleration_m_s2: zero,
            angular_rad_s2: zero,
            thrust_n: applied.thrust_n,
            yaw_n: applied.yaw_n,
            outliers: 0,
            pose: Stamped { value: Pose::default(), at_us },
        }
    }

    /// True if `pose` is newer than the last pose and differs from it. A tracker that repeats its pose has frozen.
    #[must_use]
    pub fn is_news(&self, pose: &Stamped<Pose>) -> bool {
        pose.at_us > self.pose.at_us && pose.value != self.pose.value
    }

    /// Returns the time since the last pose used \[us\].
    #[must_use]
    pub fn age_us(&self, now_us: u64) -> u32 {
        self.pose.age_us(now_us)
    }

    /// Predicts one step with the commanded inputs. `reckoning` comes from the last step, in which it has
    /// [measured](DeadReckoning::measure) this observer's state.
    pub fn advance(&mut self, dead_reckoning: &DeadReckoning, reckoning: &Reckoning, applied: &Inputs) {
        let DeadReckoning { dt_s, rotor_share, .. } = *dead_reckoning;
        let (least, most) = (TRIM_SHARE.0 * dead_reckoning.weight_n, TRIM_SHARE.1 * dead_reckoning.weight_n);
        // The trim is a divisor below, so it must not be zero. The trimmed thrust may fall to nothing.
        let trim_n = min(max(reckoning.trim.thrust_n, least), most);
        self.thrust_n = settled(self.thrust_n + (applied.thrust_n - self.thrust_n) * rotor_share);
        self.yaw_n = settled(self.yaw_n + (applied.yaw_n - self.yaw_n) * rotor_share);

        // A copy, since the tick itself advances the reckoning later.
        let mut ahead = *reckoning;
        dead_reckoning.advance(&mut ahead, applied);
        let tipping = (ahead.rate_rad_s - reckoning.rate_rad_s) / dt_s;
        let yawing = dead_reckoning.yaw_authority * (self.yaw_n - reckoning.trim.yaw_n);
        self.angular_rad_s2 = Vector3::new(tipping.x, tipping.y, yawing) * (dead_reckoning.weight_n / trim_n);
        self.rates_rad_s += self.angular_rad_s2 * dt_s;
        self.attitude = turned(&self.attitude, &(self.rates_rad_s * dt_s));

        let q = &self.attitude;
        let up = Vector3::new(q.i * q.k + q.w * q.j, q.j * q.k - q.w * q.i, 0.5 - q.i * q.i - q.j * q.j) * 2.0;
        let gravity_m_s2 = dead_reckoning.gravity_m_s2;
        self.acceleration_m_s2 = up * (gravity_m_s2 * self.thrust_n / trim_n) + self.push_m_s2;
        self.acceleration_m_s2.z -= gravity_m_s2;
        self.velocity_m_s += self.acceleration_m_s2 * dt_s;
        self.position_m += self.velocity_m_s * dt_s;
    }

    /// Corrects the prediction by `pose`.
    pub fn correct(&mut self, pose: &Stamped<Pose>, now_us: u64) {
        let since_us = pose.at_us.saturating_sub(self.pose.at_us);
        self.pose = *pose;
        let [w, x, y, z] = pose.value.attitude;
        // The period is a divisor, so it must not be zero. The first pose may be older than the starting state.
        let since_s = since_us.max(1_000) as f32 * 1e-6;
        // Extrapolate back to the time of the pose.
        let late_s = pose.age_us(now_us).min(LATE_US) as f32 * 1e-6;
        let back = |rate: &Vector3<f32>, change: &Vector3<f32>| change * (0.5 * late_s * late_s) - rate * late_s;
        let position_m = self.position_m + back(&self.velocity_m_s, &self.acceleration_m_s2);
        let attitude = turned(&self.attitude, &back(&self.rates_rad_s, &self.angular_rad_s2));

        let turn = attitude.conjugate() * Quaternion::new(w, x, y, z);
        // q and -q are the same attitude: use the shorter turn.
        let turn_rad = turn.imag() * if turn.w < 0.0 { -2.0 } else { 2.0 };
        let off_m = pose.value.position_m - position_m;
        let most = OUTLIER.0 + OUTLIER.1 * since_s;
        let is_outlier = abs_max(&turn_rad) > most || abs_max(&off_m) > most;
        self.outliers = if is_outlier { self.outliers + 1 } else { 0 };
        if self.outliers >= OUTLIERS_MAX {
            // Keep velocity and rates: the tracker's frame has jumped, not the vehicle.
            self.outliers = 0;
            self.position_m += off_m;
            self.attitude = turned(&self.attitude, &turn_rad);
            return;
        }

        let (turn_rad, off_m) = (limited(turn_rad, most), limited(off_m, most));
        let beta = 1.0 / (1.0 + ATTITUDE_RAD_S * since_s);
        let rates_rad_s = turn_rad * ((1.0 - beta) * (1.0 - beta) / since_s);
        self.rates_rad_s += rates_rad_s;
        self.attitude = turned(&self.attitude, &(turn_rad * (1.0 - beta * beta) + rates_rad_s * late_s));

        let beta = 1.0 / (1.0 + POSITION_RAD_S * since_s);
        let faded = 1.0 - beta;
        let velocity_m_s = off_m * (1.5 * faded * faded * (1.0 + beta) / since_s);
        self.position_m += off_m * (1.0 - beta * beta * beta) + velocity_m_s * late_s;
        self.velocity_m_s += velocity_m_s;
        self.push_m_s2 = limited(self.push_m_s2 + off_m * (faded * faded * faded / (since_s * since_s)), PUSH_MAX_M_S2);
    }

    /// Returns the observed state; `None` if it is not [plausible](State::is_plausible).
    #[must_use]
    pub fn state(&self) -> Option<State> {
        State::from_quaternion(self.position_m, self.velocity_m_s, &self.attitude, self.rates_rad_s)
    }
}

/// Returns the attitude, turned by a small rotation about the body's axes \[rad\] and normalised.
fn turned(attitude: &Quaternion<f32>, turn_rad: &Vector3<f32>) -> Quaternion<f32> {
    let q = attitude * Quaternion::from_parts(1.0, turn_rad * 0.5);
    q * (1.0 / sqrt(q.norm_squared()))
}

/// Limits each coordinate to within +-`most`.
fn limited(vector: Vector3<f32>, most: f32) -> Vector3<f32> {
    vector.map(|x| min(max(x, -most), most))
}
