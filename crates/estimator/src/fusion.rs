//! Fuses queued measurements into the state, one scalar at a time.
//!
//! A scalar z = h'x + noise of variance r corrects the state with the gain K = P h/s, s = h' P h + r. The scalars of a
//! fix follow one another, and each innovation is relative to the state corrected so far. The sum of innovation^2/s is
//! then the normalised innovation squared of the whole fix.

use crate::aid::{AidSource, ResetDelay, passes};
use crate::align::VAGUE;
use crate::errors::{ErrorVector, SlowErrors, VectorComponent};
use crate::estimate::count;
use crate::estimator::Estimator;
use crate::horizon::{ExpectedReadings, FusionHorizon, ObservedQuantity};
use crate::measurement::Measurement;
use crate::memory::Memory;
use crate::queue::{AidObservation, FusedAxes, PendingFusion, parts};
use crate::restart::reference;
use crate::rotation::{renormalized, small, yaw_between};
use afbc_control::math::{abs_max, limited, max, min, sqrt};
use nalgebra::Vector3;

/// Maximum age of a measurement when its turn comes: 250 ms plus the waiting time \[us\].
const LATE_US: u64 = 270_000;
/// A measurement further in the future than this is dropped \[us\].
const EARLY_US: u64 = 20_000;
/// Smallest share of a variance that remains after one scalar; a smaller remainder would be rounding noise in `f32`.
const LEFT: f32 = 1e-4;
/// Rounding error of a past position's variance, as a share of the variances of present position and velocity: with an
/// unknown velocity, the past variance is a small difference of large numbers.
const ROUNDING: f32 = 1e-6;
/// Two scalars are fused per step when at least this many measurements wait.
const CROWD: u8 = 3;
/// An aid counts as present if it was fused within this time \[us\].
const PRESENT_US: u64 = 1_000_000;
/// Period of the zero-velocity fusion \[us\].
const STILL_US: u64 = 200_000;
/// Standard deviation of the zero-velocity fusion on the ground \[m/s\].
const STILL_M_S: f32 = 0.05;
/// Standard deviation of the zero-velocity fusion with the motors off, while a hand moves the vehicle \[m/s\].
const CARRIED_M_S: f32 = 3.0;
/// Standard deviation of the zero-velocity fusion in the air without any aid \[m/s\]. A vehicle flies at some 5 m/s and
/// keeps its velocity for some 2.5 s. Noise with the correlation time tau, sampled every T, acts like white noise of
/// sqrt(2 tau/T) = 5 times its standard deviation.
const UNAIDED_M_S: f32 = 25.0;
/// Zero velocity is fused only if the estimated velocity is below this many standard deviations. This is stricter than
/// the gate, because a vehicle that is driven straight on looks the same to the IMU.
const STILL_SIGMAS: f32 = 3.0;
/// A second reset within this time also raises the variance of roll and pitch \[us\].
const AGAIN_US: u64 = 10_000_000;
/// Shortest time of rejections after which an aid that comes back may be followed \[us\].
const REJECTED_US: u64 = 1_000_000;
/// Variance added to the velocity after a frozen tracker, which has claimed for a while that the vehicle stands still:
/// (0.1 m/s)^2, since the gate rejects it at higher speeds \[m2/s2\].
const FROZEN_VARIANCE: f32 = 0.01;

/// Weight of one scalar in the mean innovation, and the mean in standard deviations above which the bias variances are
/// raised: six times the mean's deviation for white innovations.
const LEANS: f32 = 0.05;
const LEANS_SIGMAS: f32 = 1.0;
/// Mean innovation of a doubted magnetic field below which the field counts again.
const UPRIGHT_SIGMAS: f32 = 0.1;
/// Variance added to the direction of a doubted field, so that motion by a receiver's velocity outweighs it: at 50 Hz,
/// 0.14 rad within a second \[rad2\].
const DOUBTED_FIELD: f32 = 1.0;
/// Additional mean that a slow error may cause, in its standard deviations.
const SLOW_SIGMAS: f32 = 1.0;

impl Estimator {
    /// Fuses one scalar, or two if many measurements wait. The first scalar of a fix is alone in its step.
    pub(crate) fn fuse(&self, memory: &mut Memory, now_us: u64) {
        let scalars = if memory.queue.waiting() >= CROWD { 2 } else { 1 };
        for _ in 0..scalars {
            let begins = memory.fix.is_none();
            if begins && !self.begin_fix(memory, now_us) {
                break;
            }
            // A receiver's velocity has also updated the bank of yaw filters, which is enough for a step.
            if begins && memory.fix.as_ref().is_some_and(PendingFusion::is_gnss) {
                break;
            }
            if !self.fuse_scalar(memory) {
                memory.end_part();
            }
            // The first scalar has also cost the history lookup and the gates, which is enough for a step.
            if begins {
                break;
            }
        }
    }

    /// Begins the next fix: the oldest queued measurement that is not in the future, or a zero-velocity fusion. Returns
    /// false if there is neither.
    #[inline]
    fn begin_fix(&self, memory: &mut Memory, now_us: u64) -> bool {
        let newest_us = memory.covariance_us;
        // Too early measurements are also taken, to be dropped: they would occupy the queue until their time comes.
        let due = |at_us: u64| at_us <= newest_us || at_us > now_us.saturating_add(EARLY_US);
        let Some(measurement) = memory.queue.take(due) else {
            return self.rest(memory);
        };
        let at_us = measurement.at_us;
        if at_us > newest_us {
            count(&mut memory.dropped.early);
            return false;
        }
        // The history stores the lowest 32 bits of a time, and the limit excludes older times. The subtraction cannot
        // underflow, because later times have returned above.
        let past = memory.history.at(at_us as u32).filter(|_| newest_us - at_us <= LATE_US);
        let Some(past) = past else {
            count(&mut memory.dropped.late);
            return false;
        };
        let mut parts = parts(&measurement.value);
        // Time of the previous fix, before the loop overwrites it.
        let fix_us = memory.aids.gnss_position.newest_us;
        for part in &mut parts {
            let Some(aid) = part.and_then(|part| part.aid) else { continue };
            let record = memory.aids.of_mut(aid);
            // A measurement that is sent twice must not be averaged as two.
            if record.newest_us.is_some_and(|newest_us| at_us <= newest_us) {
                count(&mut memory.dropped.overtaken);
                *part = None;
            } else {
                // The earlier measurements of this kind have been fused or rejected by now.
                memory.ignored.set(aid, record.is_ignored(at_us));
                record.newest_us = Some(at_us);
            }
        }
        match (&measurement.value, &mut parts) {
            (Measurement::Gnss { .. }, [Some(level), receiver_height @ Some(_), _]) => {
                let since_us = at_us.saturating_sub(fix_us.unwrap_or(0));
                let trusted = self.trusts_height(memory, level, &past, at_us, since_us);
                self.divide(memory, level, since_us);
                if let Some(height) = receiver_height {
                    height.variance = level.variance;
                }
                if !trusted {
                    *receiver_height = None;
                    memory.aids.gnss_height.reject(at_us);
                }
            }
            // This field gives no heading, because the vehicle's own field may be as large as the earth's.
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
                memory.covariance.slow.set_field_variance(self.magnetic_variance);
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
            && parts.iter().flatten().any(|part| part.aid == Some(AidSource::GnssVelocity))
        {
            let variance = speed_sigma_m_s * speed_sigma_m_s;
            let pushed = memory.pushed - memory.history.thrust_since(&past, self.settings.gravity_m_s2).xy();
            memory.yaw_bank.fuse(&pushed, at_us, &velocity_m_s.xy(), variance);
            self.follow_bank(memory, at_us);
        }
        let any = parts.iter().any(Option::is_some);
        if any {
            memory.fix = Some(PendingFusion { at_us, past, parts, next: 0, nis: 0.0 });
        }
        any
    }

    /// Returns true if the tracker has repeated this pose for too long. The repeated poses do not count towards
    /// following the tracker later.
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

    /// Splits the variance of a receiver's position into noise and slow error. The previous fix was `since_us` earlier.
    fn divide(&self, memory: &mut Memory, part: &mut AidObservation, since_us: u64) {
        let noise = self.settings.gnss_noise_m * self.settings.gnss_noise_m;
        let white = part.variance.map(|variance| min(variance, noise));
        let kept = max(1.0 - since_us as f32 * 1e-6 / self.settings.gnss_slow_s, 0.0);
        memory.covariance.slow.follow(&(part.variance - white), kept);
        part.variance = white;
    }

    /// Begins a zero-velocity fusion if one is due: for a vehicle at rest, or in the air without any aid, where it
    /// keeps roll and pitch level in the long run.
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
        let sigma = match (held, memory.on_ground == Some(true)) {
            (true, _) => STILL_M_S,
            (false, true) => CARRIED_M_S,
            (false, false) => UNAIDED_M_S,
        };
        memory.still_us = at_us;
        if held {
            memory.held_us = Some(at_us);
        }
        let Some(past) = memory.history.newest_raw() else { return false };
        let variance = Vector3::repeat(sigma * sigma);
        let target = ObservedQuantity::Velocity(Vector3::zeros());
        let part = AidObservation { aid: None, target, axes: FusedAxes::All, variance, rough: 0.0 };
        memory.fix = Some(PendingFusion { at_us, past, parts: [Some(part), None, None], next: 0, nis: 0.0 });
        true
    }

    /// Fuses the next scalar. Returns false if the current part of the fix is finished.
    #[inline(always)]
    fn fuse_scalar(&self, memory: &mut Memory) -> bool {
        let Some(PendingFusion { at_us, past, parts: [Some(part), ..], next, .. }) = &memory.fix else { return false };
        let Some(present) = memory.history.newest() else { return false };
        let gravity = self.settings.gravity_m_s2;
        let Some(past) = memory.history.corrected(past, gravity) else { return false };
        let (at_us, mut part, next) = (*at_us, *part, *next);
        let horizon = FusionHorizon::new(&present, &past, gravity);
        // Changes the copy only: the part's next scalar starts again from the measurement's own variances.
        part.inflate_variances(memory.roughened_since(at_us), horizon.tau_s());
        if next == 0 && !self.gate_or_follow(memory, at_us, &part, &horizon) {
            return false;
        }
        let coordinate = part.axes.coordinate(next);
        let expected = self.expected(memory);
        // Bound by reference, because copying a large struct calls a slow loop.
        let mut seen = horizon.row(&part.target, coordinate, &expected);
        let Some((innovation, row)) = &mut seen else { return false };
        let innovation = *innovation;
        if part.is_slow() {
            row.slow = Some(slow_position(coordinate));
        }
        let slow = row.slow.map_or(0.0, |slow| memory.covariance.slow.of_row(&slow));
        let y = memory.covariance.times(row);
        // The product is negative only by rounding.
        let hph = max(row.dot(&y), 0.0);
        let r = match &part.target {
            ObservedQuantity::Field(field) => field_variance(&horizon.field(field), part.variance.x) + part.rough,
            _ => coordinate.of(&part.variance),
        };
        // Above zero, since each variance has a floor, so the division is safe.
        let s = hph + max(r, max(LEFT * hph, ROUNDING * memory.covariance.motion_variance(row)));
        let nis = innovation * innovation / s;
        let scalars = part.scalars();
        // The scalars of a fix have passed the gate together, before the first of them changed the state.
        if scalars == 1 && nis > self.gate_squared {
            self.reject(memory, at_us, &part, nis, &horizon);
            return false;
        }
        match part.target {
            // A field corrects only the heading and the gyroscope bias that turned it: a disturbed field must not tilt
            // the vehicle.
            ObservedQuantity::Field(_) => {
                let zero = Vector3::zeros();
                let k = ErrorVector {
                    theta: Vector3::new(0.0, 0.0, y.theta.z),
                    velocity: zero,
                    position: zero,
                    gyro: y.gyro,
                    accel: zero,
                    baro: 0.0,
                    slow: SlowErrors::zeros(),
                };
                // A field that drifts looks like a gyroscope that drifts. Motion decides, if a receiver shows it.
                let is_weak = memory.doubts_field && memory.aids.gnss_velocity.is_live(at_us, PRESENT_US);
                let s = if is_weak { s + DOUBTED_FIELD } else { s };
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
            memory.inflate_bias_variances(&part.target, coordinate, innovation / sqrt(s), (slow, s));
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

    /// Adds a correction to the state.
    fn correct(&self, memory: &mut Memory, by: &ErrorVector) {
        let within = |bias: Vector3<f32>, most: f32| bias.map(|x| limited(x, most));
        let turn = small(&by.theta);
        let nominal = &mut memory.nominal;
        nominal.turn_to(renormalized(&(turn * nominal.attitude)));
        nominal.velocity += by.velocity;
        // The correction belongs to the covariance's time. The nominal state is up to 3 ms newer.
        let moved = by.position + by.velocity * memory.interval.time_s;
        nominal.move_by(&moved);
        nominal.gyro_bias = within(nominal.gyro_bias + by.gyro, self.settings.gyro_bias_max_rad_s);
        nominal.accel_bias = within(nominal.accel_bias + by.accel, self.settings.accel_bias_max_m_s2);
        memory.height_offset += by.baro;
        memory.turned = turn * memory.turned;
        memory.yaw_bank.turn(by.theta.z);
        memory.history.correct(&turn, &by.theta, &by.velocity, &by.position);
    }

    /// Returns true if the part of a fix is to be fused. Otherwise it was rejected, or the state was reset to it.
    #[inline]
    fn gate_or_follow(&self, memory: &mut Memory, at_us: u64, part: &AidObservation, horizon: &FusionHorizon) -> bool {
        let variances = memory.covariance.variances();
        let past = horizon.past();
        let (innovation, variance) = match &part.target {
            ObservedQuantity::Position(position) => {
                let innovation = position - past.position;
                if !memory.knows.position {
                    self.follow(memory, &AidObservation { axes: FusedAxes::All, ..*part }, horizon);
                    self.accept(memory, at_us, part);
                    memory.end_height(at_us);
                    return false;
                }
                if part.axes == FusedAxes::Vertical {
                    return true;
                }
                let tau_s = horizon.tau_s();
                let along = memory.covariance.vp.diagonal();
                // Variance of p_past = p - tau v. The effect of a tilt error, D x theta, is left out.
                let variance = variances.position - along * (2.0 * tau_s) + variances.velocity * (tau_s * tau_s);
                let slow = if part.is_slow() { memory.covariance.slow.of_position(tau_s) } else { Vector3::zeros() };
                (innovation, (variance + slow).map(|variance| max(variance, 0.0)))
            }
            ObservedQuantity::Velocity(velocity) => (velocity - past.velocity, variances.velocity),
            ObservedQuantity::Attitude(attitude) => {
                if !memory.knows.heading {
                    self.follow(memory, part, horizon);
                    self.accept(memory, at_us, part);
                    return false;
                }
                (crate::rotation::difference(attitude, &past.attitude), variances.theta)
            }
            ObservedQuantity::Height(_) => {
                if !memory.knows.height_offset {
                    self.follow(memory, part, horizon);
                    self.accept(memory, at_us, part);
                    return false;
                }
                return true;
            }
            ObservedQuantity::Field(field) => {
                let field = horizon.field(field);
                let Some((strength, inclination)) = reference(&field) else { return false };
                let (usual, steep) = *memory.field.get_or_insert((strength, inclination));
                // The sines of the inclinations are compared, and a sine changes with the cosine of the angle. The
                // floor keeps a steep field from being refused because of its noise.
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
            ObservedQuantity::Heading(_) => {
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

    /// Returns the expected barometer offset and the expected direction of the magnetic field in the earth frame.
    #[inline]
    pub(crate) fn expected(&self, memory: &Memory) -> ExpectedReadings {
        let steep = memory.field.map_or(0.0, |(_, steep)| steep);
        let level = sqrt(max(1.0 - steep * steep, 0.0));
        let field = Vector3::new(level * self.magnetic_north.0, level * self.magnetic_north.1, steep);
        ExpectedReadings { height_offset: memory.height_offset, field }
    }

    fn accept(&self, memory: &mut Memory, at_us: u64, part: &AidObservation) {
        if let Some(aid) = part.aid {
            memory.aids.of_mut(aid).accept(at_us);
        }
    }

    /// Records a rejection. After too long a time, resets the state to the measurement unless another aid contradicts
    /// that.
    #[cold]
    fn reject(&self, memory: &mut Memory, at_us: u64, part: &AidObservation, nis: f32, horizon: &FusionHorizon) {
        let Some(aid) = part.aid else { return };
        let is_carried = memory.aids.gnss_velocity.is_live(at_us, PRESENT_US);
        if is_carried && matches!(part.target, ObservedQuantity::Position(_)) {
            memory.carried_us = Some(at_us);
        }
        let record = memory.aids.of_mut(aid);
        (record.nis, record.scalars) = (nis, part.scalars());
        let lasted_us = record.reject(at_us);
        // If the aid was never accepted, the time since its first rejection.
        let alone_us = record.accepted_us.map_or(lasted_us, |accepted_us| at_us.saturating_sub(accepted_us));
        let wait_us = match memory.aids.reset_delay(aid, is_carried, at_us, PRESENT_US) {
            ResetDelay::Never => return,
            ResetDelay::Late => self.reacquire_us,
            ResetDelay::Soon => self.reacquire_us.min(self.coast_us / 5 * 3),
        };
        if lasted_us < wait_us.min(REJECTED_US) || alone_us < wait_us {
            return;
        }
        if let ObservedQuantity::Attitude(attitude) = &part.target {
            // Roll and pitch come from the IMU. A tracker that contradicts only these stays rejected.
            let turn = yaw_between(attitude, &horizon.past().attitude);
            if turn * turn <= self.gate_squared * (memory.covariance.tt.m33 + part.variance.z) {
                return;
            }
        }
        if let ObservedQuantity::Position(position) = &part.target
            && !is_carried
        {
            // A velocity error that has grown steadily since the last accepted position is now twice the mean velocity
            // error.
            let alone_s = max(alone_us as f32 * 1e-6, 0.1);
            let by = part.axes.only(&(position - horizon.past().position)) * (2.0 / alone_s);
            memory.doubt_velocity(&by.component_mul(&by));
        }
        self.follow(memory, part, horizon);
        match part.target {
            ObservedQuantity::Position(_) => {
                self.inflate_tilt_after_second_reset(memory, at_us);
                // The same tracker also contradicts the attitude.
                if memory.aids.tracker_attitude.rejected_since_us.is_some() && aid == AidSource::TrackerPosition {
                    memory.inflate_tilt();
                }
            }
            ObservedQuantity::Velocity(_) => self.inflate_tilt_after_second_reset(memory, at_us),
            // The gyroscope bias has changed and turns the heading away from the measured one.
            ObservedQuantity::Attitude(_) | ObservedQuantity::Heading(_) | ObservedQuantity::Field(_) => {
                memory.inflate_vertical_gyro_bias()
            }
            ObservedQuantity::Height(_) => {}
        }
        self.accept(memory, at_us, part);
    }

    /// Raises the variance of roll and pitch if this reset is the second within ten seconds.
    fn inflate_tilt_after_second_reset(&self, memory: &mut Memory, at_us: u64) {
        if memory.reset_us.is_some_and(|reset_us| at_us.saturating_sub(reset_us) < AGAIN_US) {
            memory.inflate_tilt();
        }
        memory.reset_us = Some(at_us);
    }
}

impl Memory {
    /// Watches the running mean of the innovations in standard deviations. The innovations of a correct filter are
    /// white, so their mean is small, apart from the effect of a slow error (`slow` is its part of the innovation
    /// variance `all`). A larger mean shows a bias that has changed by more than its random walk allows, and raises the
    /// bias variances.
    #[inline]
    fn inflate_bias_variances(
        &mut self,
        target: &ObservedQuantity,
        at: VectorComponent,
        sigmas: f32,
        (slow, all): (f32, f32),
    ) {
        let [motion, rotation] = &mut self.leaning;
        let (mean, turns) = match target {
            ObservedQuantity::Position(_) | ObservedQuantity::Velocity(_) => (motion, false),
            ObservedQuantity::Attitude(_) | ObservedQuantity::Field(_) | ObservedQuantity::Heading(_) => {
                (rotation, true)
            }
            ObservedQuantity::Height(_) => return,
        };
        let at = if matches!(target, ObservedQuantity::Field(_) | ObservedQuantity::Heading(_)) {
            VectorComponent::Z
        } else {
            at
        };
        let before = at.of(mean);
        let now = before + LEANS * (sigmas - before);
        at.set(mean, now);
        let leans = now.abs();
        if let ObservedQuantity::Field(_) = target {
            self.doubts_field = leans > if self.doubts_field { UPRIGHT_SIGMAS } else { LEANS_SIGMAS };
        }
        if leans > LEANS_SIGMAS && leans > LEANS_SIGMAS + SLOW_SIGMAS * sqrt(max(slow / all, 0.0)) {
            self.doubt_biases(turns);
        }
    }

    /// Ends the current part of the fix, and the whole fix after its last part.
    fn end_part(&mut self) {
        let Some(fix) = &mut self.fix else { return };
        let [_, second, third] = fix.parts;
        (fix.next, fix.nis) = (0, 0.0);
        fix.parts = if second.is_some() { [second, third, None] } else { [third, None, None] };
        if fix.parts[0].is_none() {
            self.fix = None;
        }
    }

    /// Skips the receiver's height, because the position reset has already used it.
    fn end_height(&mut self, at_us: u64) {
        if let Some(PendingFusion {
            parts: [_, height @ Some(AidObservation { aid: Some(AidSource::GnssHeight), .. }), _],
            ..
        }) = &mut self.fix
        {
            *height = None;
            self.aids.gnss_height.accept(at_us);
        }
    }
}

/// Returns the derivative of one position coordinate by the slow errors.
pub(crate) fn slow_position(at: VectorComponent) -> SlowErrors {
    let unit = at.unit();
    SlowErrors::new(unit.x, unit.y, unit.z, 0.0, 0.0)
}

/// Returns the variance of the direction of a field's horizontal part. `variance` is the variance of one field
/// coordinate.
pub(crate) fn field_variance(field: &Vector3<f32>, variance: f32) -> f32 {
    let horizontal = field.x * field.x + field.y * field.y;
    let floor = 1e-6 * abs_max(field) * abs_max(field);
    variance / max(horizontal, floor) + 1e-6
}
