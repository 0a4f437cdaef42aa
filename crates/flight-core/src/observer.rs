//! Flight on a tracker's poses, after the inertial sensor has failed. Not in the paper.
//!
//! A pose is position and attitude of some milliseconds ago; a law needs velocity and body rates too, and all of
//! them now. An observer predicts them with the inputs commanded,
//!
//! ```text
//! dp/dt = v,          dv/dt = (T_a/T_trim) g R e3 - g e3 + d
//! dR/dt = R Omega^,   d Omega/dt = (m g/T_trim) (l/I) (U_a - U_trim)
//! ```
//!
//! where T_a and U_a lag behind the inputs and are trimmed as in [`crate::dead_reckoning`], d is whatever pushes the
//! vehicle, and rotors that need more than m g to hover count as weaker in their moments too. Each pose is compared
//! with the prediction for its own time. With w the bandwidth, T the time between two poses and beta = 1/(1 + w T), the
//! difference corrects
//!
//! ```text
//! R by 1 - beta^2,  Omega by (1 - beta)^2/T
//! p by 1 - beta^3,  v by 1.5 (1 - beta)^2 (1 + beta)/T,  d by (1 - beta)^3/T^2
//! ```
//!
//! of it: filters of the second and third order with a fading memory, all poles of which are at beta, whatever T.
//! A single outlier counts little, and a tracker whose frame has jumped is followed.

use crate::dead_reckoning::{DeadReckoning, Reckoning};
use afbc_control::math::{abs_max, max, min, settled, sqrt};
use afbc_types::{Inputs, Pose, Stamped, State};
use nalgebra::{Quaternion, Vector3};

/// w of the attitude \[rad/s\]: as fast as the noise of trackers allows, since the law, which is fast too, must not act
/// for long on what a wrong model predicts.
pub const ATTITUDE_RAD_S: f32 = 50.0;
/// w of the position \[rad/s\].
pub const POSITION_RAD_S: f32 = 6.0;
/// Age on arrival up to which a pose is used \[us\].
pub const LATE_US: u32 = 50_000;
/// Age of the last pose up to which the prediction is flown on \[us\].
pub const HOLD_US: u32 = 100_000;
/// Largest standard deviations of a pose that is used \[m, rad\].
pub const SIGMAS_MAX: (f32, f32) = (0.05, 0.05);
/// Largest difference along or about any axis that counts \[m and rad\], and that per time between two poses \[m/s and
/// rad/s\]: a tracker's noise, and what a vehicle may do that is not predicted. More is an outlier, and counts as this.
pub const OUTLIER: (f32, f32) = (0.02, 3.0);
/// Outliers in a row after which the tracker's frame has jumped, and position and attitude are set to the pose.
pub const OUTLIERS_MAX: u8 = 3;
/// Share of m g that T_trim counts as, at least and at most.
pub const TRIM_SHARE: (f32, f32) = (0.4, 2.5);
/// Largest d, along any axis \[m/s2\].
pub const PUSH_MAX_M_S2: f32 = 10.0;

/// Observed motion, at the time of the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseObserver {
    position_m: Vector3<f32>,
    velocity_m_s: Vector3<f32>,
    /// From body to earth.
    attitude: Quaternion<f32>,
    rates_rad_s: Vector3<f32>,
    /// d \[m/s2\].
    push_m_s2: Vector3<f32>,
    /// Accelerations in the last step \[m/s2, rad/s2\].
    acceleration_m_s2: Vector3<f32>,
    angular_rad_s2: Vector3<f32>,
    /// T_a, and U_a of yaw \[N\].
    thrust_n: f32,
    yaw_n: f32,
    /// Outliers since the last pose that was none.
    outliers: u8,
    /// The last pose used; before the first, when the state was measured.
    pose: Stamped<Pose>,
}

impl PoseObserver {
    /// True if `pose` may be used at `now_us`: it is not too late, and states no large standard deviation.
    #[must_use]
    pub fn takes(pose: &Stamped<Pose>, now_us: u64) -> bool {
        let within = |sigma: Option<f32>, most: f32| sigma.is_none_or(|sigma| sigma <= most);
        let sigmas = &pose.value.sigmas;
        pose.age_us(now_us) <= LATE_US
            && within(sigmas.position_m, SIGMAS_MAX.0)
            && within(sigmas.attitude_rad, SIGMAS_MAX.1)
    }

    /// Starts in `state`, which was measured last at `at_us`, of a vehicle whose rotors do as asked.
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

    /// True if `pose` is newer than the last one, and does not repeat it: a tracker that repeats itself is frozen.
    #[must_use]
    pub fn is_news(&self, pose: &Stamped<Pose>) -> bool {
        pose.at_us > self.pose.at_us && pose.value != self.pose.value
    }

    /// Returns the time since the last pose used \[us\].
    #[must_use]
    pub fn age_us(&self, now_us: u64) -> u32 {
        self.pose.age_us(now_us)
    }

    /// Predicts over one step with the inputs asked of the rotors. `reckoning` is that of the last step, which has
    /// [measured](DeadReckoning::measure) this observer's state.
    pub fn advance(&mut self, dead_reckoning: &DeadReckoning, reckoning: &Reckoning, applied: &Inputs) {
        let DeadReckoning { dt_s, rotor_share, .. } = *dead_reckoning;
        let (least, most) = (TRIM_SHARE.0 * dead_reckoning.weight_n, TRIM_SHARE.1 * dead_reckoning.weight_n);
        // Not zero, by which it is divided below: a trim may fall to nothing.
        let trim_n = min(max(reckoning.trim.thrust_n, least), most);
        self.thrust_n = settled(self.thrust_n + (applied.thrust_n - self.thrust_n) * rotor_share);
        self.yaw_n = settled(self.yaw_n + (applied.yaw_n - self.yaw_n) * rotor_share);

        // A copy: the tick itself advances the reckoning, later.
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
        // Not zero, by which it is divided: the first pose may be older than the state from which the observer began.
        let since_s = since_us.max(1_000) as f32 * 1e-6;
        // Back to the time of the pose.
        let late_s = pose.age_us(now_us).min(LATE_US) as f32 * 1e-6;
        let back = |rate: &Vector3<f32>, change: &Vector3<f32>| change * (0.5 * late_s * late_s) - rate * late_s;
        let position_m = self.position_m + back(&self.velocity_m_s, &self.acceleration_m_s2);
        let attitude = turned(&self.attitude, &back(&self.rates_rad_s, &self.angular_rad_s2));

        let turn = attitude.conjugate() * Quaternion::new(w, x, y, z);
        // q and -q are one attitude: of the two turns the shorter one counts.
        let turn_rad = turn.imag() * if turn.w < 0.0 { -2.0 } else { 2.0 };
        let off_m = pose.value.position_m - position_m;
        let most = OUTLIER.0 + OUTLIER.1 * since_s;
        let is_outlier = abs_max(&turn_rad) > most || abs_max(&off_m) > most;
        self.outliers = if is_outlier { self.outliers + 1 } else { 0 };
        if self.outliers >= OUTLIERS_MAX {
            // Velocity and rates stay: the tracker's frame has jumped, and not the vehicle.
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

    /// Returns the state; none if it is not [plausible](State::is_plausible).
    #[must_use]
    pub fn state(&self) -> Option<State> {
        State::from_quaternion(self.position_m, self.velocity_m_s, &self.attitude, self.rates_rad_s)
    }
}

/// Returns the attitude turned by a small rotation about the body's axes \[rad\], of norm 1.
fn turned(attitude: &Quaternion<f32>, turn_rad: &Vector3<f32>) -> Quaternion<f32> {
    let q = attitude * Quaternion::from_parts(1.0, turn_rad * 0.5);
    q * (1.0 / sqrt(q.norm_squared()))
}

/// Limits each coordinate to +-`most`.
fn limited(vector: Vector3<f32>, most: f32) -> Vector3<f32> {
    vector.map(|x| min(max(x, -most), most))
}
