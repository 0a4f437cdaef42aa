//! Mode offboard: follows the targets of a companion computer.

use crate::available_thrust::AvailableThrust;
use crate::limiter::LimiterTarget;
use crate::mode_io::{ModeInputs, ModeOutput, Shaping};
use crate::order::{AttitudeTarget, MotionTarget, OffboardTarget};
use afbc_control::math::{cos, min, sin};
use afbc_flight_core::Stamped;
use afbc_types::Setpoint;
use nalgebra::Vector3;

/// Largest accepted values of position, velocity, acceleration, angle and rate \[m, m/s, m/s2, rad, rad/s\].
const MOST: [f32; 5] = [1e5, 1e3, 1e2, 1e3, 1e2];
/// A target means take-off if it is this far above the vehicle \[m\], or moves up this fast \[m/s\] (as an
/// acceleration: m/s2), or if its thrust carries this share of the weight.
const LIFTS_M: f32 = 0.1;
const LIFTS_M_S: f32 = 0.05;
const LIFTS_SHARE: f32 = 0.8;

/// Memory of mode offboard.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct OffboardMemory {
    /// Last target in body coordinates: time of its message \[us\], place \[m\] and heading \[rad\] in the local frame.
    body: Option<(u64, Vector3<f32>, f32)>,
}

/// True if every value is plausible, or NaN where allowed.
pub(crate) fn is_plausible(target: &OffboardTarget) -> bool {
    let [position, velocity, acceleration, angle, rate] = MOST;
    // True for infinite numbers, false for NaN.
    let is_beyond = |value: f32, most: f32| value.abs() > most;
    let all = |vector: &Vector3<f32>, most: f32| !vector.iter().any(|value| is_beyond(*value, most));
    match target {
        OffboardTarget::Motion(motion) => {
            all(&motion.position_m, position)
                && all(&motion.velocity_m_s, velocity)
                && all(&motion.acceleration_m_s2, acceleration)
                && !is_beyond(motion.yaw_rad, angle)
                && !is_beyond(motion.yaw_rate_rad_s, rate)
        }
        OffboardTarget::Attitude(target) => {
            (target.attitude.norm_squared() - 1.0).abs() <= 0.1
                && (0.0..=1.0).contains(&target.thrust)
                && !is_beyond(target.yaw_rate_rad_s, rate)
        }
    }
}

impl OffboardMemory {
    pub(crate) fn fly(
        &mut self,
        target: &Stamped<OffboardTarget>,
        inputs: &ModeInputs<'_>,
        lift: &AvailableThrust,
    ) -> ModeOutput {
        match &target.value {
            OffboardTarget::Motion(motion) => self.motion(motion, target.at_us, inputs),
            OffboardTarget::Attitude(target) => attitude(target, inputs, lift),
        }
    }

    fn motion(&mut self, motion: &MotionTarget, at_us: u64, inputs: &ModeInputs<'_>) -> ModeOutput {
        let MotionTarget { yaw_rad, yaw_rate_rad_s, .. } = *motion;
        let MotionTarget { mut position_m, mut velocity_m_s, mut acceleration_m_s2, .. } = *motion;
        let mut aim_yaw_rad = yaw_rad;
        if motion.body {
            let (s, c) = (sin(inputs.present.yaw_rad), cos(inputs.present.yaw_rad));
            let turned = |v: Vector3<f32>| Vector3::new(c * v.x - s * v.y, s * v.x + c * v.y, v.z);
            (velocity_m_s, acceleration_m_s2) = (turned(velocity_m_s), turned(acceleration_m_s2));
            // The place is relative to the vehicle at the arrival of the message. Keep it for later ticks.
            let (sent_us, place_m, place_yaw_rad) = self.body.filter(|(sent_us, ..)| *sent_us == at_us).unwrap_or((
                at_us,
                inputs.state.position_m + turned(position_m),
                inputs.present.yaw_rad + yaw_rad,
            ));
            self.body = Some((sent_us, place_m, place_yaw_rad));
            (position_m, aim_yaw_rad) = (place_m, place_yaw_rad);
        }
        let up_m = position_m.z - inputs.state.position_m.z;
        let lifts = if up_m.is_nan() {
            if velocity_m_s.z.is_nan() { acceleration_m_s2.z > LIFTS_M_S } else { velocity_m_s.z > LIFTS_M_S }
        } else {
            up_m > LIFTS_M
        };
        // A sender of a complete trajectory has begun it, so take off. The sum is NaN if any part is not given;
        // plausible parts are finite.
        let complete = !(position_m + velocity_m_s + acceleration_m_s2).sum().is_nan();
        let lifts = lifts || complete;
        let aim = LimiterTarget {
            position_m,
            velocity_m_s,
            acceleration_m_s2,
            yaw_rad: aim_yaw_rad,
            yaw_rate_rad_s,
            // Body-frame places follow the vehicle, and form no trajectory that could pass the limiter.
            sent_us: (!motion.body).then_some(at_us),
            ..inputs.stop()
        };
        // Offboard targets are not bound to the cruise speed.
        let aim = LimiterTarget { speed_m_s: min(inputs.limits.speed_m_s, inputs.speed_m_s), ..aim };
        ModeOutput { lifts, ..ModeOutput::fly(aim) }
    }
}

fn attitude(target: &AttitudeTarget, inputs: &ModeInputs<'_>, lift: &AvailableThrust) -> ModeOutput {
    let q = target.attitude;
    let (w, x, y, z) = (q.w, q.i, q.j, q.k);
    let up = Vector3::new(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
    let thrust_m_s2 = target.thrust * lift.most_m_s2;
    let held = lift.setpoint(inputs.state, up, thrust_m_s2);
    let setpoint = if target.yaw_rate_rad_s.is_nan() {
        Setpoint { yaw_rad: libm::atan2f(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)), ..held }
    } else {
        Setpoint { yaw_rate_rad_s: target.yaw_rate_rad_s, ..held }
    };
    let lifts = thrust_m_s2 > LIFTS_SHARE * lift.gravity_m_s2;
    ModeOutput { shaping: Shaping::Direct(setpoint), lifts, lands: false, done: false }
}
