//! Desired roll and pitch: (40) within the limits, after the command filter, with the derivatives for (12) and (16).
//! Section III-D.
//!
//! The paper takes the derivatives from the filter. With feed-forward they come from the reference, and the filter's
//! input leads by the filter's lag, so that its output is the intended angle.

use crate::jump_filter::{JumpFilter, JumpMemory};
use crate::model::Attitude;
use crate::settings::Settings;
use crate::tilt::Tilt;
use afbc_control::command_filter::{CommandFilter, Filtered};
use afbc_control::drag::KnownDrag;
use afbc_control::math;
use afbc_types::{OutOfRange, Setpoint};
use nalgebra::Vector3;

/// Smallest ratio of vertical thrust to weight for the tilt computation, because a sinking vehicle must not tilt
/// further. Not in the paper.
pub const VERTICAL_MIN: f32 = 0.3;

/// Share of the rotors' largest thrust that the largest tilt counts on. The rest is left for moments. Not in the paper.
pub const THRUST_SHARE: f32 = 0.95;
/// Vertical thrust that the largest tilt leaves, if the law asks for it, as a share of the hover thrust: a climb has to
/// wait. Not in the paper.
pub const HOLDS_HEIGHT: f32 = 1.1;
/// Share of the hover thrust that the largest tilt leaves in addition per speed of a descent, enough to stop it in 0.2
/// seconds \[s/m\]. Not in the paper.
pub const STOPS_DESCENT_S_M: f32 = 0.5;
/// Share of the largest thrust that is kept for horizontal motion while the height needs all of it, as PX4's
/// MPC_THR_XY_MARG. Not in the paper.
pub const HORIZONTAL_MARGIN: f32 = 0.3;

/// The computation with its constants. Everything that changes in flight is in [`DesiredMemory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesiredAttitude {
    filter: CommandFilter,
    /// Lag 1/w of the command filter \[s\], and delay of its command, which is held for a step.
    lag_s: f32,
    half_step_s: f32,
    jump_filter: JumpFilter,
    drag: KnownDrag,
    gravity_m_s2: f32,
    inverse_gravity: f32,
    /// Largest total thrust of all rotors \[N\].
    thrust_max_n: f32,
    tilt_max_rad: f32,
    tilt_max_tan: f32,
    acceleration_max_m_s2: f32,
    /// Largest angular accelerations of roll and pitch that are fed forward: those that the rotors can give in hover
    /// \[rad/s2\].
    authority_rad_s2: [f32; 2],
    tilt_by_thrust: bool,
    by_rotation: bool,
    feed_forward: bool,
    bumpless: bool,
}

/// Memory of the desired attitude.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DesiredMemory {
    /// Angles of the last step, `None` before the first one.
    last: Option<LastAngles>,
    /// Jerk filter, `None` before the first step.
    jump_memory: Option<JumpMemory>,
}

/// Angles of the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LastAngles {
    /// phi_d, theta_d of (40) \[rad\].
    rad: [f32; 2],
    /// Angles given to the command filter \[rad\].
    commanded: [f32; 2],
    /// Output of the command filter.
    filtered: [Filtered; 2],
}

impl DesiredMemory {
    /// Returns true before the first step.
    pub(crate) fn is_first(&self) -> bool {
        self.last.is_none()
    }

    /// Returns phi_d and theta_d of (40) \[rad\] in the last step, before and after the command filter.
    #[inline]
    pub(crate) fn trace(&self) -> ([f32; 2], [Filtered; 2]) {
        self.last.map_or_else(Default::default, |LastAngles { rad, filtered, .. }| (rad, filtered))
    }
}

/// Desired roll and pitch in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesiredRollPitch {
    /// Roll and pitch with their first derivatives, after the command filter.
    pub filtered: [Filtered; 2],
    /// Second derivatives \[rad/s2\].
    pub accelerations_rad_s2: [f32; 2],
    /// Sine and cosine of the yaw for which roll and pitch are computed.
    pub heading: [f32; 2],
    /// Derivative of the thrust per mass that follows from the reference \[m/s3\].
    pub thrust_m_s3: f32,
    /// Part of u5, u6 beyond the limits of tilt and acceleration \[m/s2\].
    pub beyond_limits_m_s2: [f32; 2],
}

/// Returns desired roll and pitch (40) \[rad\] for the horizontal accelerations u5, u6 \[m/s2\] at yaw psi \[rad\].
/// `inverse_vertical` is the mass divided by the vertical thrust: 1/g in hover, as in (39).
pub fn desired_attitude(u5: f32, u6: f32, yaw_rad: f32, inverse_vertical: f32) -> [f32; 2] {
    Tilt::new(u5, u6, [math::sin(yaw_rad), math::cos(yaw_rad)], inverse_vertical).rad
}

/// Returns the vector shortened to a norm of at most `max`.
#[inline]
fn within([x, y]: [f32; 2], max: f32) -> [f32; 2] {
    let square = x * x + y * y;
    let scale = if square > max * max { max / math::sqrt(square) } else { 1.0 };
    [x * scale, y * scale]
}

impl DesiredAttitude {
    /// Creates the computation from valid settings, for rotors that give at most `thrust_max_n` together, and in hover
    /// at most these angular accelerations of roll and pitch.
    ///
    /// # Errors
    /// Returns the first bandwidth or rate that is out of range.
    pub fn new(
        settings: &Settings,
        gravity_m_s2: f32,
        thrust_max_n: f32,
        authority_rad_s2: [f32; 2],
    ) -> Result<Self, OutOfRange> {
        let Settings { command_filter_rad_s, limits, tilt_by_thrust, by_rotation, feed_forward, bumpless, .. } =
            *settings;
        let dt_s = settings.common.dt_s;
        Ok(DesiredAttitude {
            jump_filter: JumpFilter::new(settings.forward_rad_s, dt_s)?,
            filter: CommandFilter::new(command_filter_rad_s, dt_s)?.limited(limits.tilt_rate_max_rad_s)?,
            lag_s: 1.0 / command_filter_rad_s,
            half_step_s: 0.5 * dt_s,
            drag: settings.common.drag,
            gravity_m_s2,
            inverse_gravity: 1.0 / gravity_m_s2,
            thrust_max_n,
            tilt_max_rad: limits.tilt_max_rad,
            tilt_max_tan: math::tan(limits.tilt_max_rad),
            acceleration_max_m_s2: limits.acceleration_max_m_s2,
            authority_rad_s2,
            tilt_by_thrust,
            by_rotation,
            feed_forward,
            bumpless,
        })
    }

    /// Returns roll and pitch for u5, u6 \[m/s2\] and U4 \[N\], and advances the memory by one step. `low_tan` is the
    /// tangent of the largest tilt allowed near the ground; the vehicle climbs with `climb_m_s`.
    #[inline(always)]
    pub fn advance(
        &self,
        memory: &mut DesiredMemory,
        [u5, u6, u4]: [f32; 3],
        [hover_n, low_tan, climb_m_s]: [f32; 3],
        attitude: &Attitude,
        [reference, setpoint]: [&Setpoint; 2],
    ) -> DesiredRollPitch {
        // (40) must not count on more thrust than the rotors can give.
        let thrust_n = math::min(u4, self.thrust_max_n);
        let tilt_cosine = attitude.roll_pitch.tilt_cosine();
        let (vertical, inverse_vertical) = self.vertical(thrust_n * tilt_cosine, hover_n);
        let tilt_max_tan = self.room_tan(
            math::min(self.tilt_max_tan, low_tan),
            u4 * tilt_cosine,
            hover_n * (HOLDS_HEIGHT + STOPS_DESCENT_S_M * math::max(-climb_m_s, 0.0)),
        );
        // The direction is kept.
        let [a5, a6] = within([u5, u6], math::min(vertical * tilt_max_tan, self.acceleration_max_m_s2));
        // With the reference's yaw, the desired attitude does not depend on the measured yaw.
        let heading = if self.by_rotation {
            [math::sin(reference.yaw_rad), math::cos(reference.yaw_rad)]
        } else {
            attitude.heading
        };
        let tilt = Tilt::new(a5, a6, heading, inverse_vertical);
        let (share, up) = (thrust_n / hover_n, attitude.up());
        let forward = if self.feed_forward {
            Some(self.derivatives(&mut memory.jump_memory, &tilt, share, &up, [reference, setpoint]))
        } else {
            None
        };
        let commanded = match forward {
            Some((derivatives, _)) => self.ahead(tilt.rad, derivatives),
            None => tilt.rad,
        };
        // The filter takes the last step's command, which was held until now; `half_step_s` accounts for that delay.
        let filtered = match &memory.last {
            Some(LastAngles { commanded: [phi_d, theta_d], filtered: [roll, pitch], .. }) => {
                [self.filter.advance(roll, *phi_d), self.filter.advance(pitch, *theta_d)]
            }
            None => {
                let start = if self.bumpless { attitude.roll_pitch_rad } else { tilt.rad };
                start.map(|angle| Filtered { angle, rate: 0.0 })
            }
        };
        let accelerations_rad_s2 = match forward {
            Some(([_, accelerations], _)) => accelerations,
            None => {
                let ([roll, pitch], [phi_d, theta_d]) = (&filtered, commanded);
                [self.filter.acceleration(roll, phi_d), self.filter.acceleration(pitch, theta_d)]
            }
        };
        memory.last = Some(LastAngles { rad: tilt.rad, commanded, filtered });
        let thrust_m_s3 = forward.map_or(0.0, |(_, thrust_m_s3)| thrust_m_s3);
        DesiredRollPitch {
            filtered,
            accelerations_rad_s2,
            heading,
            thrust_m_s3,
            beyond_limits_m_s2: [u5 - a5, u6 - a6],
        }
    }

    /// Returns the tangent of the largest tilt, `tilt_max_tan` or the smaller one at which the rotors still give the
    /// vertical thrust `upward_n` that the law asks for, up to `enough_n`: height comes before horizontal motion.
    #[inline(always)]
    fn room_tan(&self, tilt_max_tan: f32, upward_n: f32, enough_n: f32) -> f32 {
        if !self.tilt_by_thrust {
            return tilt_max_tan;
        }
        let upward_n = math::max(math::min(upward_n, enough_n), 0.0);
        let most_n = THRUST_SHARE * self.thrust_max_n;
        let most = most_n * most_n;
        if upward_n * upward_n * (1.0 + tilt_max_tan * tilt_max_tan) <= most {
            return tilt_max_tan;
        }
        // Positive, since so is `most`.
        let upward = math::min(upward_n * upward_n, most * (1.0 - HORIZONTAL_MARGIN * HORIZONTAL_MARGIN));
        math::min(tilt_max_tan, math::sqrt((most - upward) / upward))
    }

    /// Returns the vertical part of the thrust per mass \[m/s2\], g in hover as in (39), and its inverse.
    #[inline(always)]
    fn vertical(&self, upward_n: f32, hover_n: f32) -> (f32, f32) {
        if self.tilt_by_thrust {
            let share = math::max(upward_n / hover_n, VERTICAL_MIN);
            (self.gravity_m_s2 * share, self.inverse_gravity / share)
        } else {
            (self.gravity_m_s2, self.inverse_gravity)
        }
    }

    /// Returns the first and second derivatives of roll and pitch \[rad/s, rad/s2\] that follow from the reference at
    /// `share` of the hover thrust along `up`, and the first derivative of the thrust per mass \[m/s3\].
    #[inline(always)]
    fn derivatives(
        &self,
        followed: &mut Option<JumpMemory>,
        tilt: &Tilt,
        share: f32,
        up: &Vector3<f32>,
        [reference, setpoint]: [&Setpoint; 2],
    ) -> ([[f32; 2]; 2], f32) {
        let Setpoint { velocity_m_s: v, acceleration_m_s2: a, jerk_m_s3: jerk, .. } = reference;
        let turn = [reference.yaw_rate_rad_s, reference.yaw_acceleration_rad_s2];
        // Jumps of the setpoint's jerk are smoothed; the reference model has none.
        let [followed, snap] = self.jump_filter.advance(followed, setpoint);
        let offset = jerk - setpoint.jerk_m_s3;
        let gradual = followed + offset;
        // Drag depends on the velocity, so it turns the thrust as the velocity changes.
        let thrust = [share, share * self.gravity_m_s2];
        let [turning, snap] = self.drag.followed(v, up, thrust, [a, jerk, &snap]);
        // The offset after a step or a jump starts at once and is not known ahead. Its vertical part is left out of the
        // turn: a_z may fall to little, and its snap is unknown.
        let thrust_m_s3 = up.dot(&(turning - offset));
        let turning = turning - Vector3::z() * offset.z;
        let [rates, _] = tilt.turned(&turning, &snap, turn);
        let [_, mut accelerations] = tilt.turned(&(turning + (gradual - jerk)), &snap, turn);
        for (acceleration, most) in accelerations.iter_mut().zip(self.authority_rad_s2) {
            *acceleration = math::limited(*acceleration, most);
        }
        ([rates, accelerations], thrust_m_s3)
    }

    /// Returns angles that lead by the lag of the command filter, shortened to a norm of at most the tilt limit.
    #[inline(always)]
    fn ahead(&self, mut rad: [f32; 2], [rates, accelerations]: [[f32; 2]; 2]) -> [f32; 2] {
        for ((angle, rate), acceleration) in rad.iter_mut().zip(rates).zip(accelerations) {
            let late_s = self.lag_s + self.half_step_s;
            // (1 + s/w) (1 + s (1/w + dt/2)): inverse of the filter, with the hold's delay in one factor.
            *angle += (self.lag_s + late_s) * rate + self.lag_s * late_s * acceleration;
        }
        within(rad, self.tilt_max_rad)
    }
}
