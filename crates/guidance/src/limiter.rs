//! Trajectory limiter: turns any target into a smooth flight within limits of speed, acceleration and jerk.
//!
//! A stream of targets passes through unchanged, to the bit, if it is itself a flight: its position, velocity and
//! acceleration fit one another and the limits, and the limiter has caught up with it. Between two messages of such a
//! stream, the limiter extrapolates with the velocity, the acceleration, and the jerk between the last two messages.

use crate::heading::{Heading, HeadingTarget, YawLimits};
use crate::settings::MotionLimits;
use crate::shaper::{MotionBounds, MotionGoal, MotionShaper, MotionState, capped};
use afbc_control::math::{max, min, sqrt, wrap_angle};
use afbc_types::{Declared, OutOfRange, ResetDelta, Setpoint, State};
use nalgebra::{Vector1, Vector2, Vector3};

/// Time constant with which the accumulated misfits of a passing stream decay \[s\]. A misfit is the difference between
/// a target and the present motion extrapolated to the target's time.
const MISFIT_S: f32 = 0.5;
/// Largest accumulated misfits of a passing stream: of position, as a distance \[m\] plus a time at the stream's speed
/// \[s\], and of velocity \[m/s\].
const MISFIT_M: f32 = 0.03;
const MISFIT_TIME_S: f32 = 0.02;
const MISFIT_M_S: f32 = 0.15;
/// Largest difference of acceleration that need not be explained by jerk \[m/s2\].
const MISFIT_M_S2: f32 = 0.1;
/// Errors at which the limiter has caught up with a moving target: position \[m\] and velocity \[m/s\], plus a time at
/// the target's speed and acceleration \[s\].
const CAUGHT_M: f32 = 5e-3;
const CAUGHT_M_S: f32 = 0.02;
const CAUGHT_TIME_S: f32 = 2e-3;
/// Errors at which the limiter has caught up with a target at rest: position \[m\], velocity \[m/s\], acceleration
/// \[m/s2\].
const STANDS_M: f32 = 1e-4;
const STANDS_M_S: f32 = 1e-3;
const STANDS_M_S2: f32 = 0.01;
/// Longest time between two messages of the same stream \[s\].
const INTERVAL_MAX_S: f32 = 0.5;

/// A target; NaN where nothing is given. The acceleration alone counts if neither position nor velocity is given. If
/// nothing is given, the vehicle stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimiterTarget {
    /// Position \[m\].
    pub position_m: Vector3<f32>,
    /// Velocity to fly at or, if a position is given, the velocity at which that position moves \[m/s\].
    pub velocity_m_s: Vector3<f32>,
    /// Acceleration, of the moving position if one is given \[m/s2\].
    pub acceleration_m_s2: Vector3<f32>,
    /// Heading \[rad\].
    pub yaw_rad: f32,
    /// Rate of the heading \[rad/s\].
    pub yaw_rate_rad_s: f32,
    /// Largest horizontal speed of approach \[m/s\].
    pub speed_m_s: f32,
    /// Largest speed of approach upwards \[m/s\].
    pub up_m_s: f32,
    /// Largest speed of approach downwards \[m/s\].
    pub down_m_s: f32,
    /// Time of the message \[us\], if the target is one of a stream.
    pub sent_us: Option<u64>,
}

impl LimiterTarget {
    /// Makes a target with nothing given: the vehicle stops.
    pub fn stop(speed_m_s: f32, up_m_s: f32, down_m_s: f32) -> Self {
        let none = Vector3::repeat(f32::NAN);
        LimiterTarget {
            position_m: none,
            velocity_m_s: none,
            acceleration_m_s2: none,
            yaw_rad: f32::NAN,
            yaw_rate_rad_s: f32::NAN,
            speed_m_s,
            up_m_s,
            down_m_s,
            sent_us: None,
        }
    }
}

/// The limiter with its present motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limiter {
    limits: MotionLimits,
    horizontal: MotionShaper,
    vertical: MotionShaper,
    now: Option<LimitedMotion>,
    stream: Option<TargetStream>,
}

/// Present limited motion.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LimitedMotion {
    horizontal: MotionState<2>,
    vertical: MotionState<1>,
    heading: Heading,
    /// Accumulated misfits of a passing stream; none while no stream passes.
    misfit: Option<Misfit>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Misfit {
    position_m: Vector3<f32>,
    velocity_m_s: Vector3<f32>,
}

/// A target whose position, velocity and acceleration are all known.
#[derive(Clone, Copy, Debug, PartialEq)]
struct CompleteTarget {
    position_m: Vector3<f32>,
    velocity_m_s: Vector3<f32>,
    acceleration_m_s2: Vector3<f32>,
}

/// A stream of target messages.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TargetStream {
    sent_us: u64,
    /// Newest message, and the target extrapolated from it to the present.
    last: CompleteTarget,
    present: CompleteTarget,
    /// Time since the newest message, and between the last two messages \[s\].
    since_s: f32,
    interval_s: f32,
    /// Jerk between the last two messages \[m/s3\].
    jerk_m_s3: Vector3<f32>,
    /// True if the last two messages fit each other in position and velocity.
    fits: bool,
}

impl Limiter {
    /// Makes a limiter with these limits.
    ///
    /// # Errors
    /// The first limit out of range.
    pub fn new(limits: MotionLimits) -> Result<Self, OutOfRange> {
        limits.validate()?;
        Ok(Limiter::of(limits))
    }

    fn of(limits: MotionLimits) -> Self {
        Limiter {
            horizontal: MotionShaper::new(limits.acceleration_m_s2, limits.jerk_m_s3),
            vertical: MotionShaper::new(limits.vertical_acceleration_m_s2, limits.jerk_m_s3),
            limits,
            now: None,
            stream: None,
        }
    }

    /// Changes the limits, which must be valid. The present motion continues.
    pub(crate) fn set(&mut self, limits: MotionLimits) {
        *self = Limiter { now: self.now, stream: self.stream, ..Limiter::of(limits) };
    }

    /// Restarts at the vehicle's position with its velocity, capped to the limits.
    pub fn anchor(&mut self, state: &State) {
        let (position, velocity) = (state.position_m, state.velocity_m_s);
        let MotionLimits { speed_m_s, up_m_s, down_m_s, .. } = self.limits;
        let climb = min(max(velocity.z, -down_m_s), up_m_s);
        self.now = Some(LimitedMotion {
            horizontal: MotionState::new(position.xy(), capped(velocity.xy(), speed_m_s)),
            vertical: MotionState::new(Vector1::new(position.z), Vector1::new(climb)),
            heading: Heading::new(state.attitude_rad.z),
            misfit: None,
        });
        self.stream = None;
    }

    /// Restarts at the vehicle's position, at rest.
    pub fn rest(&mut self, state: &State) {
        self.anchor(&State { velocity_m_s: Vector3::zeros(), ..*state });
    }

    /// Shifts the motion by an estimator reset.
    pub(crate) fn shift(&mut self, reset: &ResetDelta) {
        if let Some(now) = &mut self.now {
            now.horizontal.position += reset.position_m.xy();
            now.vertical.position.x += reset.position_m.z;
            now.heading.yaw_rad = wrap_angle(now.heading.yaw_rad + reset.yaw_rad);
        }
    }

    /// Sets the horizontal motion to the vehicle's own, for modes that fly it without the limiter. The heading
    /// continues.
    pub fn follow(&mut self, state: &State) {
        let capped_m_s = capped(state.velocity_m_s.xy(), self.limits.speed_m_s);
        if let Some(now) = &mut self.now {
            now.horizontal = MotionState::new(state.position_m.xy(), capped_m_s);
        }
    }

    /// Returns the present setpoint; `None` before the first [`anchor`](Self::anchor).
    pub fn setpoint(&self) -> Option<Setpoint> {
        let LimitedMotion { horizontal: h, vertical: v, heading, .. } = self.now.as_ref()?;
        let joined = |h: Vector2<f32>, v: Vector1<f32>| Vector3::new(h.x, h.y, v.x);
        Some(Setpoint {
            position_m: joined(h.position, v.position),
            velocity_m_s: joined(h.velocity, v.velocity),
            acceleration_m_s2: joined(h.acceleration, v.acceleration),
            jerk_m_s3: joined(h.jerk, v.jerk),
            yaw_rad: heading.yaw_rad,
            yaw_rate_rad_s: heading.rate_rad_s,
            yaw_acceleration_rad_s2: heading.acceleration_rad_s2,
            ..Setpoint::default()
        })
    }

    /// True while the targets pass through unchanged.
    pub fn passes(&self) -> bool {
        self.now.as_ref().is_some_and(|now| now.misfit.is_some())
    }

    /// Advances by one step towards `aim`, whose given values must be plausible. Does nothing before the first
    /// [`anchor`](Self::anchor).
    pub fn advance(&mut self, aim: &LimiterTarget, dt_s: f32) {
        let complete = complete(aim);
        let (target, jerk_m_s3, interval_s, fits) = match (&complete, aim.sent_us) {
            (Some(complete), Some(sent_us)) => {
                let stream = match &mut self.stream {
                    Some(stream) => {
                        stream.advance(complete, sent_us, dt_s, self.limits.jerk_max_m_s3);
                        stream
                    }
                    none => none.insert(TargetStream::new(complete, sent_us)),
                };
                (Some(stream.present), stream.jerk_m_s3, stream.interval_s, stream.fits)
            }
            _ => {
                self.stream = None;
                (complete, Vector3::zeros(), 0.0, false)
            }
        };
        let limits = &self.limits;
        let Some(now) = &mut self.now else { return };
        let turn = match (aim.yaw_rad.is_nan(), aim.yaw_rate_rad_s.is_nan()) {
            (true, true) => HeadingTarget::By(0.0),
            (true, false) => HeadingTarget::By(aim.yaw_rate_rad_s),
            (false, true) => HeadingTarget::To(aim.yaw_rad, 0.0),
            (false, false) => HeadingTarget::To(aim.yaw_rad, aim.yaw_rate_rad_s),
        };
        let MotionLimits { yaw_rate_rad_s, yaw_acceleration_rad_s2, .. } = *limits;
        let turning = YawLimits { rate_rad_s: yaw_rate_rad_s, acceleration_rad_s2: yaw_acceleration_rad_s2 };
        // The heading advances before the check whether a stream may pass, since a passing stream's heading is limited,
        // too.
        now.heading.advance(&turn, &turning, dt_s);
        if let Some(target) = &target
            && now.pass(target, jerk_m_s3, limits, interval_s, dt_s)
        {
            return;
        }
        let one = |vector: Vector3<f32>| Vector1::new(vector.z);
        let (goal, climb) = match target {
            Some(CompleteTarget { position_m: p, velocity_m_s: v, acceleration_m_s2 }) => {
                // An acceleration that fits no flight would only drive the vehicle away from the target.
                let a = if fits { acceleration_m_s2 } else { Vector3::zeros() };
                let goal = MotionGoal {
                    position: Some(p.xy()),
                    velocity: Some(v.xy()),
                    acceleration: a.xy(),
                    jerk: jerk_m_s3.xy(),
                };
                let climb = MotionGoal {
                    position: Some(one(p)),
                    velocity: Some(one(v)),
                    acceleration: one(a),
                    jerk: one(jerk_m_s3),
                };
                (goal, climb)
            }
            None => {
                let LimiterTarget { position_m: p, velocity_m_s: v, acceleration_m_s2: a, .. } = *aim;
                (goal(p.xy(), v.xy(), a.xy()), goal(one(p), one(v), one(a)))
            }
        };
        let (speed_m_s, approach_m_s) = (limits.speed_m_s, min(aim.speed_m_s, limits.speed_m_s));
        let reach = MotionBounds {
            approach: (approach_m_s, approach_m_s),
            speed: (speed_m_s, speed_m_s),
            acceleration: limits.acceleration_max_m_s2,
            jerk: limits.jerk_max_m_s3,
        };
        self.horizontal.advance(&mut now.horizontal, &goal, &reach, dt_s);
        let reach = MotionBounds {
            approach: (min(aim.up_m_s, limits.up_m_s), min(aim.down_m_s, limits.down_m_s)),
            speed: (limits.up_m_s, limits.down_m_s),
            acceleration: limits.vertical_acceleration_m_s2,
            jerk: limits.jerk_max_m_s3,
        };
        self.vertical.advance(&mut now.vertical, &climb, &reach, dt_s);
    }
}

/// Returns the target with missing velocities and accelerations set to zero; `None` if a part of the position is
/// missing.
fn complete(aim: &LimiterTarget) -> Option<CompleteTarget> {
    let or_zero = |vector: Vector3<f32>| vector.map(|value| if value.is_nan() { 0.0 } else { value });
    let LimiterTarget { position_m, velocity_m_s, acceleration_m_s2, .. } = *aim;
    let given = !position_m.iter().any(|value| value.is_nan());
    given.then(|| CompleteTarget {
        position_m,
        velocity_m_s: or_zero(velocity_m_s),
        acceleration_m_s2: or_zero(acceleration_m_s2),
    })
}

/// Returns the goal of one or two coordinates, without jerk. A vector with any NaN counts as not given.
fn goal<const D: usize>(
    position: nalgebra::SVector<f32, D>,
    velocity: nalgebra::SVector<f32, D>,
    acceleration: nalgebra::SVector<f32, D>,
) -> MotionGoal<D> {
    let given = |vector: nalgebra::SVector<f32, D>| (!vector.iter().any(|value| value.is_nan())).then_some(vector);
    let zero = nalgebra::SVector::zeros();
    let (position, velocity, acceleration) = (given(position), given(velocity), given(acceleration));
    match (position, velocity, acceleration) {
        (None, None, Some(acceleration)) => MotionGoal { position: None, velocity: None, acceleration, jerk: zero },
        _ => MotionGoal {
            position,
            velocity: Some(velocity.unwrap_or(zero)),
            acceleration: acceleration.unwrap_or(zero),
            jerk: zero,
        },
    }
}

impl CompleteTarget {
    fn advance(&mut self, jerk_m_s3: Vector3<f32>, dt_s: f32) {
        let CompleteTarget { velocity_m_s, acceleration_m_s2, .. } = *self;
        self.position_m += (velocity_m_s + acceleration_m_s2 * (0.5 * dt_s)) * dt_s;
        self.velocity_m_s += (acceleration_m_s2 + jerk_m_s3 * (0.5 * dt_s)) * dt_s;
        self.acceleration_m_s2 += jerk_m_s3 * dt_s;
    }
}

impl TargetStream {
    /// Starts a stream with this message.
    fn new(target: &CompleteTarget, sent_us: u64) -> Self {
        TargetStream {
            sent_us,
            last: *target,
            present: *target,
            since_s: 0.0,
            interval_s: 0.0,
            jerk_m_s3: Vector3::zeros(),
            fits: false,
        }
    }

    /// Advances the stream by one step. The target is a new message if `sent_us` has changed.
    fn advance(&mut self, target: &CompleteTarget, sent_us: u64, dt_s: f32, jerk_max_m_s3: f32) {
        // Counts ticks, because `sent_us` only tells messages apart: an orbit sends a running number in it.
        self.since_s += dt_s;
        if self.sent_us == sent_us {
            if self.fits {
                self.present.advance(self.jerk_m_s3, dt_s);
            }
            return;
        }
        // Positive, since at least this tick has passed: safe to divide by.
        let interval_s = self.since_s;
        if interval_s > INTERVAL_MAX_S {
            *self = TargetStream::new(target, sent_us);
            return;
        }
        let last = &self.last;
        let mean_m_s = (last.velocity_m_s + target.velocity_m_s) * 0.5;
        let misfit_m = target.position_m - last.position_m - mean_m_s * interval_s;
        let misfit_m_s = {
            let mean_m_s2 = (last.acceleration_m_s2 + target.acceleration_m_s2) * 0.5;
            target.velocity_m_s - last.velocity_m_s - mean_m_s2 * interval_s
        };
        let allowed_m = MISFIT_M * 0.5 + MISFIT_TIME_S * 0.5 * sqrt(mean_m_s.norm_squared());
        let fits =
            misfit_m.norm_squared() <= allowed_m * allowed_m && misfit_m_s.norm_squared() <= MISFIT_M_S * MISFIT_M_S;
        let change_m_s2 = target.acceleration_m_s2 - last.acceleration_m_s2;
        let jerk_m_s3 = if fits { capped(change_m_s2 / interval_s, jerk_max_m_s3) } else { Vector3::zeros() };
        *self = TargetStream { interval_s, jerk_m_s3, fits, ..TargetStream::new(target, sent_us) };
    }
}

impl LimitedMotion {
    /// True if `target` passes unchanged. Then the present motion is set to it.
    fn pass(
        &mut self,
        target: &CompleteTarget,
        jerk_m_s3: Vector3<f32>,
        limits: &MotionLimits,
        interval_s: f32,
        dt_s: f32,
    ) -> bool {
        let (h, v) = (&self.horizontal, &self.vertical);
        let joined = |h: Vector2<f32>, v: Vector1<f32>| Vector3::new(h.x, h.y, v.x);
        let acceleration_m_s2 = joined(h.acceleration, v.acceleration);
        let velocity_m_s = joined(h.velocity, v.velocity);
        let place = |v: Vector3<f32>| (v.xy(), Vector1::new(v.z));
        let (place_h, place_v) = place(target.position_m);
        let step_m = (velocity_m_s + acceleration_m_s2 * (0.5 * dt_s)) * dt_s;
        let off_m = joined(h.to(&place_h), v.to(&place_v)) - step_m;
        let off_m_s = target.velocity_m_s - velocity_m_s - acceleration_m_s2 * dt_s;
        let off_m_s2 = target.acceleration_m_s2 - acceleration_m_s2;
        let within = |vector: &Vector3<f32>, most: f32| vector.norm_squared() <= most * most;
        // A change of acceleration that the largest jerk can cause between two messages, with a reserve of 25 %, is no
        // misfit.
        let jerk_m_s2 = 1.25 * limits.jerk_max_m_s3 * max(interval_s, dt_s);
        let misfit = match self.misfit {
            Some(Misfit { position_m, velocity_m_s }) => {
                let left = 1.0 - dt_s / MISFIT_S;
                let misfit =
                    Misfit { position_m: position_m * left + off_m, velocity_m_s: velocity_m_s * left + off_m_s };
                let most_m = MISFIT_M + MISFIT_TIME_S * sqrt(target.velocity_m_s.norm_squared());
                let fits = within(&misfit.position_m, most_m)
                    && within(&misfit.velocity_m_s, MISFIT_M_S)
                    && within(&off_m_s2, MISFIT_M_S2 + jerk_m_s2);
                fits.then_some(misfit)
            }
            None => {
                let stands = target.velocity_m_s == Vector3::zeros() && target.acceleration_m_s2 == Vector3::zeros();
                let caught = if stands {
                    within(&off_m, STANDS_M) && within(&off_m_s, STANDS_M_S) && within(&off_m_s2, STANDS_M_S2)
                } else {
                    let size = |vector: &Vector3<f32>| sqrt(vector.norm_squared());
                    within(&off_m, CAUGHT_M + CAUGHT_TIME_S * size(&target.velocity_m_s))
                        && within(&off_m_s, CAUGHT_M_S + CAUGHT_TIME_S * size(&target.acceleration_m_s2))
                        && within(&off_m_s2, MISFIT_M_S2 + jerk_m_s2)
                };
                caught.then_some(Misfit { position_m: off_m, velocity_m_s: off_m_s })
            }
        };
        self.misfit = misfit.filter(|_| allowed(target, limits));
        if self.misfit.is_none() {
            return false;
        }
        let ((vh, vv), (ah, av)) = (place(target.velocity_m_s), place(target.acceleration_m_s2));
        let (jh, jv) = place(jerk_m_s3);
        self.horizontal = MotionState::moving(place_h, vh, ah, jh);
        self.vertical = MotionState::moving(place_v, vv, av, jv);
        true
    }
}

/// True if the target's speed and acceleration are within the limits.
fn allowed(target: &CompleteTarget, limits: &MotionLimits) -> bool {
    let CompleteTarget { velocity_m_s: v, acceleration_m_s2: a, .. } = target;
    let within = |vector: Vector2<f32>, most: f32| vector.norm_squared() <= most * most;
    within(v.xy(), limits.speed_m_s)
        && (-limits.down_m_s..=limits.up_m_s).contains(&v.z)
        && within(a.xy(), limits.acceleration_max_m_s2)
        && a.z.abs() <= limits.vertical_acceleration_m_s2
}

#[cfg(test)]
mod tests;
