//! Reference model: smooths jumps of the setpoint into motion that the vehicle can follow, so that the error of a step
//! is not learnt as a disturbance. Not in the paper.
//!
//! The law tracks x_1d = setpoint + d. The offset d absorbs every jump of the setpoint in position and velocity, and
//! decays by
//!
//! ```text
//! d^3 d/dt^3 = 3w (a_c - d^2 d/dt^2)     a_c = sat(w (v_c - dd/dt), a_max)     v_c = -sat(w/3 d, v_max)
//! ```
//!
//! which is (s + w)^3 d = 0 within the limits. Further away, v_c leaves half of a_max for braking. A setpoint that
//! moves consistently with its derivatives does not jump, and is tracked unchanged. Of a jump, the offset absorbs only
//! the part that keeps the reference nearer to the vehicle. So after an interruption in which vehicle and setpoint
//! moved on, the reference moves on too.
//!
//! Reference models of this kind: Ioannou and Sun, *Robust Adaptive Control*, 1996, chapter 5 (model reference
//! control); Landau 1974 for the error that an adaptive law should see.

use crate::limits::PositionControlLimits;
use afbc_control::math;
use afbc_types::{Setpoint, State, parameters};

parameters! {
    /// The reference model. The default is none.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct ReferenceModel {
        /// w: bandwidth of the reference model of x and y; 0 for none.
        #[parameter(REF_XY, "rad/s", 0.0..=50.0, tuned)]
        pub reference_xy_rad_s: f32 = 0.0,
        /// w: bandwidth of the reference model of z; 0 for none.
        #[parameter(REF_Z, "rad/s", 0.0..=50.0, tuned)]
        pub reference_z_rad_s: f32 = 0.0,
        /// w: bandwidth of the reference model of yaw; 0 for none.
        #[parameter(REF_YAW, "rad/s", 0.0..=50.0, tuned)]
        pub reference_yaw_rad_s: f32 = 0.0,
        /// a_max: largest acceleration of the reference model along x, y and z, each.
        #[parameter(REF_ACC, "m/s2", 0.1..=1e3)]
        pub reference_acceleration_m_s2: f32 = 1e3,
        /// a_max: largest angular acceleration of yaw in the reference model.
        #[parameter(REF_TURN, "rad/s2", 0.1..=1e3, tuned)]
        pub reference_turn_rad_s2: f32 = 1e3,
        /// v_max: largest yaw rate of the reference model. For x, y and z, v_max is the cascade's speed limit.
        #[parameter(REF_YAWRATE, "rad/s", 0.1..=1e3)]
        pub reference_yaw_rate_rad_s: f32 = 1e3,
    }
}

impl ReferenceModel {
    /// Returns the reference model for a vehicle that is `slowness` times slower.
    #[must_use]
    pub(crate) fn slowed(self, slowness: f32) -> Self {
        ReferenceModel {
            reference_xy_rad_s: self.reference_xy_rad_s / slowness,
            reference_z_rad_s: self.reference_z_rad_s / slowness,
            reference_yaw_rad_s: self.reference_yaw_rad_s / slowness,
            ..self
        }
    }
}

/// Offset of one coordinate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct ReferenceOffset {
    /// d, dd/dt, d^2 d/dt^2
    d: [f32; 3],
    /// Expected position and velocity of the next setpoint.
    expected: [f32; 2],
}

/// Memory of the reference model.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReferenceMemory {
    x: ReferenceOffset,
    y: ReferenceOffset,
    z: ReferenceOffset,
    yaw: ReferenceOffset,
}

/// Constants of one coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ReferenceAxis {
    /// w \[rad/s\].
    bandwidth: f32,
    /// w/3 \[rad/s\].
    approach: f32,
    acceleration_max: f32,
    speed_max: f32,
    /// Distance beyond which v_c is a braking curve; up to it v_c is w/3 d. At that distance w/3 d brakes with half of
    /// a_max.
    far: f32,
}

/// One coordinate of the setpoint with three derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ReferencePoint {
    x: f32,
    v: f32,
    a: f32,
    j: f32,
}

/// Returns the new offset after a jump: of the values between `d` and `d - jump`, the nearest to `vehicle`.
#[inline]
fn absorbed_offset(d: f32, jump: f32, vehicle: f32) -> f32 {
    // With `rest` the reference stays where it was; with `d` it jumps with the setpoint.
    let rest = d - jump;
    if jump > 0.0 {
        if vehicle >= d { d } else { math::max(vehicle, rest) }
    } else if vehicle <= d {
        d
    } else {
        math::min(vehicle, rest)
    }
}

impl ReferenceAxis {
    fn new(bandwidth: f32, acceleration_max: f32, speed_max: f32) -> Self {
        let approach = bandwidth / 3.0;
        // A coordinate without a bandwidth is never advanced; it only must not divide by zero.
        let far = if approach > 0.0 { 0.5 * acceleration_max / (approach * approach) } else { 0.0 };
        ReferenceAxis { bandwidth, approach, acceleration_max, speed_max, far }
    }

    /// Returns v_c.
    #[inline]
    fn speed(&self, d: f32) -> f32 {
        let distance = d.abs();
        let speed = if distance > self.far {
            // v^2 = a_max (d - far/2) brakes with a_max/2, and meets w/3 d at `far` in value and slope.
            math::sqrt(self.acceleration_max * (distance - 0.5 * self.far))
        } else {
            self.approach * distance
        };
        let speed = math::min(speed, self.speed_max);
        if d < 0.0 { speed } else { -speed }
    }

    /// Adds the offset to `point` and advances by one step. `jump` is the distance of `point` from the expected
    /// position; `from` and `rate` are the vehicle's position and velocity relative to `point`.
    #[inline(always)]
    fn advance(
        &self,
        offset: &mut ReferenceOffset,
        point: ReferencePoint,
        [jump, from, rate]: [f32; 3],
        dt_s: f32,
    ) -> ReferencePoint {
        let ReferenceOffset { d: [d, d_dot, d_ddot], expected } = offset;
        *d = absorbed_offset(*d, jump, from);
        *d_dot = absorbed_offset(*d_dot, point.v - expected[1], rate);
        let a_max = self.acceleration_max;
        let a_c = math::limited(self.bandwidth * (self.speed(*d) - *d_dot), a_max);
        // The offset may not raise the reference's total acceleration above a_max.
        *d_ddot = if *d_ddot > 0.0 {
            math::min(*d_ddot, math::max(a_max - point.a, 0.0))
        } else {
            math::max(*d_ddot, math::min(-a_max - point.a, 0.0))
        };
        let d_dddot = 3.0 * self.bandwidth * (a_c - *d_ddot);
        let half = 0.5 * dt_s;
        // To second order: the remainder of a first-order step would count as a jump of an accelerating setpoint.
        *expected = [point.x + dt_s * (point.v + half * point.a), point.v + dt_s * (point.a + half * point.j)];
        let reference =
            ReferencePoint { x: point.x + *d, v: point.v + *d_dot, a: point.a + *d_ddot, j: point.j + d_dddot };
        *d = math::settled(*d + dt_s * (*d_dot + half * *d_ddot));
        *d_dot = math::settled(*d_dot + dt_s * *d_ddot);
        *d_ddot = math::settled(*d_ddot + dt_s * d_dddot);
        reference
    }
}

/// Reference model with its constants. Everything that changes in flight is in [`ReferenceMemory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceFilter {
    xy: ReferenceAxis,
    z: ReferenceAxis,
    yaw: ReferenceAxis,
    dt_s: f32,
}

impl ReferenceFilter {
    /// Creates the model from valid settings, advanced every `dt_s` seconds. `None` if every bandwidth is 0.
    pub fn new(model: &ReferenceModel, limits: &PositionControlLimits, dt_s: f32) -> Option<Self> {
        let ReferenceModel { reference_acceleration_m_s2: acceleration, .. } = *model;
        let (turn, yaw_rate) = (model.reference_turn_rad_s2, model.reference_yaw_rate_rad_s);
        (model.reference_xy_rad_s + model.reference_z_rad_s + model.reference_yaw_rad_s > 0.0).then(|| {
            ReferenceFilter {
                xy: ReferenceAxis::new(model.reference_xy_rad_s, acceleration, limits.speed_max_m_s),
                z: ReferenceAxis::new(model.reference_z_rad_s, acceleration, limits.climb_max_m_s),
                yaw: ReferenceAxis::new(model.reference_yaw_rad_s, turn, yaw_rate),
                dt_s,
            }
        })
    }

    /// Returns the memory for a flight that begins with this state and setpoint: the reference starts at the vehicle.
    pub fn start(&self, state: &State, setpoint: &Setpoint) -> ReferenceMemory {
        let offset = |x1: f32, x2: f32, x: f32, v: f32| ReferenceOffset { d: [x1 - x, x2 - v, 0.0], expected: [x, v] };
        let (at, speed) = (&state.position_m, &state.velocity_m_s);
        let (p, v) = (&setpoint.position_m, &setpoint.velocity_m_s);
        let turn = math::wrap_angle(state.attitude_rad.z - setpoint.yaw_rad);
        ReferenceMemory {
            x: offset(at.x, speed.x, p.x, v.x),
            y: offset(at.y, speed.y, p.y, v.y),
            z: offset(at.z, speed.z, p.z, v.z),
            yaw: ReferenceOffset {
                d: [turn, state.rates_rad_s.z - setpoint.yaw_rate_rad_s, 0.0],
                expected: [setpoint.yaw_rad, setpoint.yaw_rate_rad_s],
            },
        }
    }

    /// Restarts x and y at the vehicle: after sliding on the ground it returns as after a jump of the setpoint.
    pub fn restart_horizontal(&self, memory: &mut ReferenceMemory, state: &State, setpoint: &Setpoint) {
        let ReferenceMemory { x, y, .. } = self.start(state, setpoint);
        (memory.x, memory.y) = (x, y);
    }

    /// Adds the offset along one axis.
    #[inline(always)]
    fn add_offset(
        &self,
        model: &ReferenceAxis,
        offset: &mut ReferenceOffset,
        x1: f32,
        x2: f32,
        [x, v, a, j]: [&mut f32; 4],
    ) {
        if model.bandwidth > 0.0 {
            let point = ReferencePoint { x: *x, v: *v, a: *a, j: *j };
            let [from, rate, jump] = [x1 - *x, x2 - *v, *x - offset.expected[0]];
            let point = model.advance(offset, point, [jump, from, rate], self.dt_s);
            (*x, *v, *a, *j) = (point.x, point.v, point.a, point.j);
        }
    }

    /// Returns `setpoint` with the offsets added, and advances the offsets by one step.
    // One copy for both laws, not inlined, so that it can use all registers.
    #[inline(never)]
    pub fn advance(&self, memory: &mut ReferenceMemory, state: &State, setpoint: &Setpoint) -> Setpoint {
        let mut reference = *setpoint;
        let Setpoint { position_m: p, velocity_m_s: v, acceleration_m_s2: a, jerk_m_s3: j, .. } = &mut reference;
        let (at, speed) = (&state.position_m, &state.velocity_m_s);
        self.add_offset(&self.xy, &mut memory.x, at.x, speed.x, [&mut p.x, &mut v.x, &mut a.x, &mut j.x]);
        self.add_offset(&self.xy, &mut memory.y, at.y, speed.y, [&mut p.y, &mut v.y, &mut a.y, &mut j.y]);
        self.add_offset(&self.z, &mut memory.z, at.z, speed.z, [&mut p.z, &mut v.z, &mut a.z, &mut j.z]);
        if self.yaw.bandwidth > 0.0 {
            let Setpoint { yaw_rad, yaw_rate_rad_s, yaw_acceleration_rad_s2, .. } = &mut reference;
            let point = ReferencePoint { x: *yaw_rad, v: *yaw_rate_rad_s, a: *yaw_acceleration_rad_s2, j: 0.0 };
            // The shorter way round: a heading that passes from pi to -pi does not jump.
            let from = math::wrap_angle(state.attitude_rad.z - point.x);
            let jump = math::wrap_angle(point.x - memory.yaw.expected[0]);
            let rate = state.rates_rad_s.z - point.v;
            let point = self.yaw.advance(&mut memory.yaw, point, [jump, from, rate], self.dt_s);
            (*yaw_rad, *yaw_rate_rad_s, *yaw_acceleration_rad_s2) = (point.x, point.v, point.a);
        }
        reference
    }
}
