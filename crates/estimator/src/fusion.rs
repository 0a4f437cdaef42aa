//! From the queue into the state: one scalar at a time.
//!
//! A scalar z = h'x + noise of variance r corrects by the gain K = P h/s, s = h' P h + r. Scalars of one fix follow one
//! another, each with the innovation against the state as corrected so far; their innovations' squares over s then add
//! up to the normalised innovation squared of the whole fix.

use crate::aid::{Aid, Trust, passes};
use crate::align::VAGUE;
use crate::errors::{Coordinate, Errors, Slows};
use crate::estimate::count;
use crate::estimator::Estimator;
use crate::horizon::{Expected, Horizon, Target};
use crate::measurement::Measurement;
use crate::memory::Memory;
use crate::queue::{Axes, Fix, Part, parts};
use crate::restart::reference;
use crate::rotation::{renormalized, small, twist};
use afbc_control::math::{abs_max, max, min, sqrt};
use nalgebra::Vector3;

/// Oldest measurement when its turn comes: 250 ms and the time to wait for it \[us\].
const LATE_US: u64 = 270_000;
/// Time in the future from which on a measurement is refused \[us\].
const EARLY_US: u64 = 20_000;
/// A scalar leaves at least this share of a variance: in `f32`, what remains of more is rounding.
const LEFT: f32 = 1e-4;
/// Rounding of the variance of a past position, in shares of those of the present position and of the way since: it is
/// their small difference when the velocity is not known.
const ROUNDING: f32 = 1e-6;
/// Waiting measurements from which on two scalars are fused in a step.
const CROWD: u8 = 3;
/// Time for which another aid counts as present \[us\].
const PRESENT_US: u64 = 1_000_000;
/// Interval of the pseudo-measurements of rest \[us\].
const STILL_US: u64 = 200_000;
/// Their standard deviation on the ground \[m/s\].
const STILL_M_S: f32 = 0.05;
/// Their standard deviation in the air without any aid \[m/s\]. A vehicle flies at some 5 m/s, and its velocity stays
/// what it is for some 2.5 s: noise that is correlated over a time tau, taken every T, counts as white noise of
/// sqrt(2 tau/T) = 5 times its standard deviation.
const UNAIDED_M_S: f32 = 25.0;
/// Largest velocity that may be that of a vehicle at rest, in standard deviations: less than the gate of a measurement,
/// since one that is driven straight on looks the same to the inertial sensor.
const STILL_SIGMAS: f32 = 3.0;
/// Time within which a second reset doubts the attitude \[us\].
const AGAIN_US: u64 = 10_000_000;
/// Time of rejections after which, at the earliest, an aid that comes back is followed \[us\].
const REJECTED_US: u64 = 1_000_000;
/// Variance of the velocity after a freeze, which has claimed for a while that the vehicle stands still: (0.1 m/s)^2,
/// since faster ones contradict it \[m2/s2\].
const FROZEN_VARIANCE: f32 = 0.01;

/// Share of the mean innovation that a scalar replaces, and the mean, in standard deviations, from which on biases are
/// doubted: six times that of white ones.
const LEANS: f32 = 0.05;
const LEANS_SIGMAS: f32 = 1.0;
/// Standard deviations of a slow error that an innovation may lean by for that alone.
const SLOW_SIGMAS: f32 = 1.0;

impl Estimator {
    /// Fuses one scalar, and a second one if measurements pile up; the first scalar of a fix is alone in its step.
    pub(crate) fn fuse(&self, memory: &mut Memory, now_us: u64) {
        let scalars = if memory.queue.waiting() >= CROWD { 2 } else { 1 };
        for _ in 0..scalars {
            let begins = memory.fix.is_none();
            if begins && !self.begin_fix(memory, now_us) {
                break;
            }
            // A receiver's velocity has gone through the bank of yaw filters: that is enough for a step.
            if begins && memory.fix.as_ref().is_some_and(Fix::is_gnss) {
                break;
            }
            if !self.fuse_scalar(memory) {
                memory.end_part();
            }
            // Its beginning has cost the look into the past and the gates: that is enough for a step.
            if begins {
                break;
            }
        }
    }

    /// Begins the next fix: the oldest measurement in the queue that is of the past, or a pseudo-measurement of rest;
    /// false if there is none.
    #[inline]
    fn begin_fix(&self, memory: &mut Memory, now_us: u64) -> bool {
        let newest_us = memory.covariance_us;
        // One that is too early is taken, too, to be dropped: it would occupy the queue until its time comes.
        let due = |at_us: u64| at_us <= newest_us || at_us > now_us.saturating_add(EARLY_US);
        let Some(measurement) = memory.queue.take(due) else {
            return self.rest(memory);
        };
        let at_us = measurement.at_us;
        if at_us > newest_us {
            count(&mut memory.dropped.early);
            return false;
        }
        // The history knows the lowest 32 bits of a time: the limit keeps out what is older than they reach. No
        // underflow: later ones have returned above.
        let past = memory.history.at(at_us as u32).filter(|_| newest_us - at_us <= LATE_US);
        let Some(past) = past else {
            count(&mut memory.dropped.late);
            return false;
        };
        let mut parts = parts(&measurement.value);
        // That of the fix before: the loop below overwrites it.
        let fix_us = memory.aids.gnss_position.newest_us;
        for part in &mut parts {
            let Some(aid) = part.and_then(|part| part.aid) else { continue };
            let record = memory.aids.of_mut(aid);
            // The same measurement, sent twice, would be averaged as two.
            if record.newest_us.is_some_and(|newest_us| at_us <= newest_us) {
                count(&mut memory.dropped.overtaken);
                *part = None;
            } else {
                record.newest_us = Some(at_us);
            }
        }
        match (&measurement.value, &mut parts) {
            (Measurement::Gnss { .. }, [Some(level), Some(height), _]) => {
                self.divide(memory, level, at_us.saturating_sub(fix_us.unwrap_or(0)));
                height.variance = level.variance;
            }
            // A field of which the vehicle's own may be as large as the earth's gives no heading.
            (Measurement::MagneticField { .. }, _) if self.magnetic_variance >= VAGUE => {
                count(&mut memory.dropped.disturbed);
                return false;
            }
            (Measurement::MagneticField { field, .. }, _)
                if memory.repeated_field.lasts_us(field, &[0.0; 4], at_us) > self.frozen_us =>
            {
                count(&mut memory.dropped.frozen);
                return false;
            }
            (Measurement::MagneticField { .. }, [Some(_), ..]) => {
                memory.covariance.slow.magnetize(self.magnetic_variance);
            }
            (Measurement::Pose { position_m, attitude, .. }, [Some(_), ..])
                if self.is_frozen(memory, position_m, attitude, at_us) =>
            {
                return false;
            }
            (Measurement::Position { position_m, .. }, [Some(_), ..])
                if self.is_frozen(memory, position_m, &[0.0; 4], at_us) =>
            {
                return false;
            }
            _ => {}
        }
        if let Measurement::Gnss { velocity_m_s, speed_sigma_m_s, .. } = &measurement.value
            && parts.iter().flatten().any(|part| part.aid == Some(Aid::GnssVelocity))
        {
            let variance = speed_sigma_m_s * speed_sigma_m_s;
            let pushed = memory.pushed - memory.history.thrust_since(&past, self.settings.gravity_m_s2).xy();
            memory.yaw_bank.fuse(&pushed, at_us, &velocity_m_s.xy(), variance);
            self.follow_bank(memory, at_us);
        }
        let any = parts.iter().any(Option::is_some);
        if any {
            memory.fix = Some(Fix { at_us, past, parts, next: 0, nis: 0.0 });
        }
        any
    }

    /// True if a tracker has repeated this pose for too long. What it said meanwhile is no reason to believe it later.
    #[inline]
    fn is_frozen(&self, memory: &mut Memory, position: &Vector3<f32>, attitude: &[f32; 4], at_us: u64) -> bool {
        let is_frozen = memory.repeated.lasts_us(position, attitude, at_us) > self.frozen_us;
        if is_frozen {
            count(&mut memory.dropped.frozen);
            if !memory.repeated.doubted {
                memory.repeated.doubted = true;
                memory.doubt_velocity(&Vector3::repeat(FROZEN_VARIANCE));
            }
            memory.aids.tracker_position.rejected_since_us = None;
            memory.aids.tracker_attitude.rejected_since_us = None;
        }
        is_frozen
    }

    /// Divides the variance of a receiver's position, whose last fix was `since_us` before: noise, and the slow error.
    fn divide(&self, memory: &mut Memory, part: &mut Part, since_us: u64) {
        let noise = self.settings.gnss_noise_m * self.settings.gnss_noise_m;
        let white = part.variance.map(|variance| min(variance, noise));
        let kept = max(1.0 - since_us as f32 * 1e-6 / self.settings.gnss_slow_s, 0.0);
        memory.covariance.slow.follow(&(part.variance - white), kept);
        part.variance = white;
    }

    /// Begins a pseudo-measurement of rest if one is due: of a vehicle that stands; or in the air without any aid,
    /// where it keeps roll and pitch level in the long run.
    fn rest(&self, memory: &mut Memory) -> bool {
        let at_us = memory.covariance_us;
        if at_us.saturating_sub(memory.still_us) < STILL_US {
            return false;
        }
        let still = |memory: &Memory| {
            let variance = memory.covariance.variances().velocity.map(|variance| variance + STILL_M_S * STILL_M_S);
            passes(&memory.nominal.velocity, &variance, STILL_SIGMAS * STILL_SIGMAS)
        };
        let held = memory.stands() && still(memory);
        if !held && memory.aids.holds_velocity(at_us, self.coast_us) {
            return false;
        }
        let sigma = if held { STILL_M_S } else { UNAIDED_M_S };
        memory.still_us = at_us;
        if held {
            memory.held_us = Some(at_us);
        }
        let Some(past) = memory.history.newest_raw() else { return false };
        let variance = Vector3::repeat(sigma * sigma);
        let target = Target::Velocity(Vector3::zeros());
        let part = Part { aid: None, target, axes: Axes::All, variance, rough: 0.0 };
        memory.fix = Some(Fix { at_us, past, parts: [Some(part), None, None], next: 0, nis: 0.0 });
        true
    }

    /// Fuses the next scalar; false if the part of the fix that it belongs to is done.
    #[inline(always)]
    fn fuse_scalar(&self, memory: &mut Memory) -> bool {
        let Some(Fix { at_us, past, parts: [Some(part), ..], next, .. }) = &memory.fix else { return false };
        let Some(present) = memory.history.newest() else { return false };
        let gravity = self.settings.gravity_m_s2;
        let Some(past) = memory.history.corrected(past, gravity) else { return false };
        let (at_us, mut part, next) = (*at_us, *part, *next);
        let horizon = Horizon::new(&present, &past, gravity);
        // On the copy: the next scalar of the part begins with the measurement's own variances.
        part.roughen(memory.roughened_since(at_us), horizon.tau_s());
        if next == 0 && !self.admits(memory, at_us, &part, &horizon) {
            return false;
        }
        let coordinate = part.axes.coordinate(next);
        let expected = self.expected(memory);
        // In place, since the copy of a large struct is a call of a slow loop.
        let mut seen = horizon.row(&part.target, coordinate, &expected);
        let Some((innovation, row)) = &mut seen else { return false };
        let innovation = *innovation;
        if part.is_slow() {
            row.slow = Some(slow_position(coordinate));
        }
        let slow = row.slow.map_or(0.0, |slow| memory.covariance.slow.of_row(&slow));
        let y = memory.covariance.times(row);
        // Negative by rounding only.
        let hph = max(row.dot(&y), 0.0);
        let r = match &part.target {
            Target::Field(field) => field_variance(&horizon.field(field), part.variance.x) + part.rough,
            _ => coordinate.of(&part.variance),
        };
        // Above zero, since each variance has a floor: it may divide.
        let s = hph + max(r, max(LEFT * hph, ROUNDING * memory.covariance.motion_variance(row)));
        let nis = innovation * innovation / s;
        let scalars = part.scalars();
        // Several scalars have passed the gate together, before the first of them changed the state.
        if scalars == 1 && nis > self.gate_squared {
            self.reject(memory, at_us, &part, nis, &horizon);
            return false;
        }
        match part.target {
            // The field corrects what it measures, the heading, and the gyroscope's bias that turned it: a disturbed
            // one must not tilt the vehicle.
            Target::Field(_) => {
                let zero = Vector3::zeros();
                let k = Errors {
                    theta: Vector3::new(0.0, 0.0, y.theta.z),
                    velocity: zero,
                    position: zero,
                    gyro: y.gyro,
                    accel: zero,
                    baro: 0.0,
                    slow: Slows::zeros(),
                };
                let k = k.scaled(1.0 / s);
                memory.covariance.fuse_with(&k, &y, s);
                self.correct(memory, &k.scaled(innovation));
            }
            _ => {
                memory.covariance.fuse(&y, s);
                self.correct(memory, &y.scaled(innovation / s));
            }
        }
        if part.aid.is_some() {
            memory.suspect(&part.target, coordinate, innovation / sqrt(s), (slow, s));
        }
        let Some(fix) = &mut memory.fix else { return false };
        fix.next += 1;
        fix.nis += nis;
        if fix.next < scalars {
            return true;
        }
        if let Some(aid) = part.aid {
            let record = memory.aids.of_mut(aid);
            (record.nis, record.scalars) = (fix.nis, scalars);
            record.accept(at_us);
        }
        false
    }

    /// Adds corrections to the state.
    fn correct(&self, memory: &mut Memory, by: &Errors) {
        let limited = |bias: Vector3<f32>, most: f32| bias.map(|x| max(-most, min(x, most)));
        let turn = small(&by.theta);
        let nominal = &mut memory.nominal;
        nominal.turn_to(renormalized(&(turn * nominal.attitude)));
        nominal.velocity += by.velocity;
        // The correction is of the covariance's time, the state of up to 3 ms later.
        let moved = by.position + by.velocity * memory.interval.time_s;
        nominal.move_by(&moved);
        nominal.gyro_bias = limited(nominal.gyro_bias + by.gyro, self.settings.gyro_bias_max_rad_s);
        nominal.accel_bias = limited(nominal.accel_bias + by.accel, self.settings.accel_bias_max_m_s2);
        memory.height_offset += by.baro;
        memory.turned = turn * memory.turned;
        memory.yaw_bank.turn(by.theta.z);
        memory.history.correct(&turn, &by.theta, &by.velocity, &by.position);
    }

    /// True if the part of a fix is to be fused. Otherwise it was rejected, or the state was set to it.
    #[inline]
    fn admits(&self, memory: &mut Memory, at_us: u64, part: &Part, horizon: &Horizon) -> bool {
        let variances = memory.covariance.variances();
        let past = horizon.past();
        let (innovation, variance) = match &part.target {
            Target::Position(position) => {
                let innovation = position - past.position;
                if !memory.knows.position {
                    self.follow(memory, &Part { axes: Axes::All, ..*part }, horizon);
                    self.accept(memory, at_us, part);
                    memory.end_height(at_us);
                    return false;
                }
                if part.axes == Axes::Vertical {
                    return true;
                }
                let tau_s = horizon.tau_s();
                let along = memory.covariance.vp.diagonal();
                // Of p_past = p - tau v; what a tilt adds to it, D x theta, is left out.
                let variance = variances.position - along * (2.0 * tau_s) + variances.velocity * (tau_s * tau_s);
                let slow = if part.is_slow() { memory.covariance.slow.of_position(tau_s) } else { Vector3::zeros() };
                (innovation, (variance + slow).map(|variance| max(variance, 0.0)))
            }
            Target::Velocity(velocity) => (velocity - past.velocity, variances.velocity),
            Target::Attitude(attitude) => {
                if !memory.knows.heading {
                    self.follow(memory, part, horizon);
                    self.accept(memory, at_us, part);
                    return false;
                }
                (crate::rotation::difference(attitude, &past.attitude), variances.theta)
            }
            Target::Height(_) => {
                if !memory.knows.height_offset {
                    self.follow(memory, part, horizon);
                    self.accept(memory, at_us, part);
                    return false;
                }
                return true;
            }
            Target::Field(field) => {
                let field = horizon.field(field);
                let Some((strength, inclination)) = reference(&field) else { return false };
                let (usual, steep) = *memory.field.get_or_insert((strength, inclination));
                // Sines are compared, which an angle changes by its cosine: but for the floor, a steep field would be
                // refused for its noise.
                let slope = self.inclination_error_max * max(0.2, sqrt(1.0 - steep * steep));
                if (strength - usual).abs() > self.settings.field_error_max * usual
                    || (inclination - steep).abs() > slope
                {
                    count(&mut memory.dropped.disturbed);
                    return false;
                }
                if !memory.knows.heading {
                    self.follow(memory, part, horizon);
                    self.accept(memory, at_us, part);
                    return false;
                }
                return true;
            }
            Target::Heading(_) => {
                if !memory.knows.heading {
                    self.follow(memory, part, horizon);
                    self.accept(memory, at_us, part);
                    return false;
                }
                return true;
            }
        };
        let (innovation, s) = (part.axes.only(&innovation), variance + part.variance);
        let passes = passes(&innovation, &s, self.gate_squared);
        if !passes {
            let nis = innovation.x * innovation.x / s.x;
            let nis = max(nis, max(innovation.y * innovation.y / s.y, innovation.z * innovation.z / s.z));
            self.reject(memory, at_us, part, nis, horizon);
        }
        passes
    }

    /// Returns what is expected of a barometer, and the direction of the magnetic field in the earth frame.
    #[inline]
    pub(crate) fn expected(&self, memory: &Memory) -> Expected {
        let steep = memory.field.map_or(0.0, |(_, steep)| steep);
        let level = sqrt(max(1.0 - steep * steep, 0.0));
        let field = Vector3::new(level * self.magnetic_north.0, level * self.magnetic_north.1, steep);
        Expected { height_offset: memory.height_offset, field }
    }

    fn accept(&self, memory: &mut Memory, at_us: u64, part: &Part) {
        if let Some(aid) = part.aid {
            memory.aids.of_mut(aid).accept(at_us);
        }
    }

    /// Records a rejection; after too long, sets the state to the measurement, unless another aid contradicts it.
    #[cold]
    fn reject(&self, memory: &mut Memory, at_us: u64, part: &Part, nis: f32, horizon: &Horizon) {
        let Some(aid) = part.aid else { return };
        let is_carried = memory.aids.gnss_velocity.is_live(at_us, PRESENT_US);
        if is_carried && matches!(part.target, Target::Position(_)) {
            memory.carried_us = Some(at_us);
        }
        let record = memory.aids.of_mut(aid);
        (record.nis, record.scalars) = (nis, part.scalars());
        let lasted_us = record.reject(at_us);
        // Of one that has never agreed, since it began.
        let alone_us = record.accepted_us.map_or(lasted_us, |accepted_us| at_us.saturating_sub(accepted_us));
        let wait_us = match memory.aids.trust(aid, is_carried, at_us, PRESENT_US) {
            Trust::Never => return,
            Trust::Late => self.reacquire_us,
            Trust::Soon => self.reacquire_us.min(self.coast_us / 5 * 3),
        };
        if lasted_us < wait_us.min(REJECTED_US) || alone_us < wait_us {
            return;
        }
        if let Target::Attitude(attitude) = &part.target {
            // Roll and pitch are the IMU's; a tracker that contradicts them stays rejected.
            let turn = twist(attitude, &horizon.past().attitude);
            if turn * turn <= self.gate_squared * (memory.covariance.tt.m33 + part.variance.z) {
                return;
            }
        }
        if let Target::Position(position) = &part.target
            && !is_carried
        {
            // An error of the velocity that has grown steadily since the last position has made twice the speed that
            // leads here.
            let alone_s = max(alone_us as f32 * 1e-6, 0.1);
            let by = part.axes.only(&(position - horizon.past().position)) * (2.0 / alone_s);
            memory.doubt_velocity(&by.component_mul(&by));
        }
        self.follow(memory, part, horizon);
        match part.target {
            Target::Position(_) => {
                self.doubt(memory, at_us);
                // The same tracker contradicts the attitude too.
                if memory.aids.tracker_attitude.rejected_since_us.is_some() && aid == Aid::TrackerPosition {
                    memory.doubt_tilt();
                }
            }
            Target::Velocity(_) => self.doubt(memory, at_us),
            // A bias that is not what it was turns the heading away from what measures it.
            Target::Attitude(_) | Target::Heading(_) | Target::Field(_) => memory.doubt_turn(),
            Target::Height(_) => {}
        }
        self.accept(memory, at_us, part);
    }

    /// Doubts the attitude if this reset is the second within ten seconds.
    fn doubt(&self, memory: &mut Memory, at_us: u64) {
        if memory.reset_us.is_some_and(|reset_us| at_us.saturating_sub(reset_us) < AGAIN_US) {
            memory.doubt_tilt();
        }
        memory.reset_us = Some(at_us);
    }
}

impl Memory {
    /// Looks at innovations, in standard deviations, in the long run: those of a right filter are white, so that a mean
    /// of many is small, but for what a slow error makes of them, of this variance and this one in all. One that is not
    /// is due to a bias that has changed by more than was told of it.
    #[inline]
    fn suspect(&mut self, target: &Target, at: Coordinate, sigmas: f32, (slow, all): (f32, f32)) {
        let [motion, rotation] = &mut self.leaning;
        let (mean, turns) = match target {
            Target::Position(_) | Target::Velocity(_) => (motion, false),
            Target::Attitude(_) | Target::Field(_) | Target::Heading(_) => (rotation, true),
            Target::Height(_) => return,
        };
        let at = if matches!(target, Target::Field(_) | Target::Heading(_)) { Coordinate::Z } else { at };
        let before = at.of(mean);
        let now = before + LEANS * (sigmas - before);
        at.set(mean, now);
        let leans = now.abs();
        if leans > LEANS_SIGMAS && leans > LEANS_SIGMAS + SLOW_SIGMAS * sqrt(max(slow / all, 0.0)) {
            self.doubt_biases(turns);
        }
    }

    /// Ends the part of the fix that is being fused, and the fix with its last one.
    fn end_part(&mut self) {
        let Some(fix) = &mut self.fix else { return };
        let [_, second, third] = fix.parts;
        (fix.next, fix.nis) = (0, 0.0);
        fix.parts = if second.is_some() { [second, third, None] } else { [third, None, None] };
        if fix.parts[0].is_none() {
            self.fix = None;
        }
    }

    /// Leaves out the receiver's height, which the position was set to.
    fn end_height(&mut self, at_us: u64) {
        if let Some(Fix { parts: [_, height @ Some(Part { aid: Some(Aid::GnssHeight), .. }), _], .. }) = &mut self.fix {
            *height = None;
            self.aids.gnss_height.accept(at_us);
        }
    }
}

/// The share of a receiver's slow error in a coordinate of its position.
pub(crate) fn slow_position(at: Coordinate) -> Slows {
    let unit = at.unit();
    Slows::new(unit.x, unit.y, unit.z, 0.0, 0.0)
}

/// Variance of the direction of a field's horizontal part; that of its coordinates is `variance`.
pub(crate) fn field_variance(field: &Vector3<f32>, variance: f32) -> f32 {
    let horizontal = field.x * field.x + field.y * field.y;
    let floor = 1e-6 * abs_max(field) * abs_max(field);
    variance / max(horizontal, floor) + 1e-6
}
