//! Resets a part of the state to a measurement, when that part is unknown or was contradicted for too long.
//!
//! The new error is the measurement's: its noise, plus the effect of the other errors on the measurement. A reset keeps
//! exactly the covariances that follow from these errors, so the matrix stays valid
//! ([`crate::covariance::Covariance::replace`]).

use crate::errors::{ErrorVector, JacobianRow, NO_ROW, ReplacedError, VectorComponent};
use crate::estimate::count;
use crate::estimator::Estimator;
use crate::fusion::{field_variance, slow_position};
use crate::horizon::{FusionHorizon, ObservedQuantity};
use crate::memory::Memory;
use crate::queue::{AidObservation, FusedAxes};
use crate::restart::{KEEP, NONE};
use crate::rotation::{about_z, atan2, identity, matrix, normalized, yaw_between};
use afbc_control::math::{max, min, wrap_angle};
use nalgebra::Vector3;

/// The yaw bank's heading is used only if its standard deviation is below this \[rad\].
const SURE_RAD: f32 = 0.2;
/// The yaw bank contradicts the heading if both differ by more than this many standard deviations, and by more than
/// this angle \[rad\].
const FAR_SIGMAS: f32 = 3.0;
const FAR_RAD: f32 = 0.35;
/// Time for which the bank must contradict the heading before a reset \[us\].
const CONTRADICTED_US: u64 = 2_000_000;
/// Error of the yaw bank's heading by effects that the bank neglects: tilt error and sensor biases \[rad\].
const HEADED_RAD: f32 = 0.1;

impl Estimator {
    /// Resets the state to the measurement in `part`.
    pub(crate) fn follow(&self, memory: &mut Memory, part: &AidObservation, horizon: &FusionHorizon) {
        let past = horizon.past();
        match &part.target {
            ObservedQuantity::Position(position) => {
                memory.put(&part.axes.only(&(position - past.position)));
                self.replace_motion(memory, part, horizon);
                memory.knows.position = true;
                if part.axes != FusedAxes::Level {
                    memory.height_watch.forget();
                    // The barometer's offset belonged to the old height.
                    memory.covariance.forget(&ErrorVector { baro: 0.0, ..KEEP });
                    memory.covariance.hold();
                    memory.knows.height_offset = false;
                }
            }
            ObservedQuantity::Velocity(velocity) => {
                memory.push(&part.axes.only(&(velocity - past.velocity)));
                self.replace_motion(memory, part, horizon);
            }
            ObservedQuantity::Height(height) => {
                count(&mut memory.resets.height);
                memory.height_watch.forget();
                memory.height_offset = height - past.position.z;
                memory.knows.height_offset = true;
                if let Some((_, mut row)) = horizon.row(&part.target, VectorComponent::Z, &self.expected(memory)) {
                    row.baro = 0.0;
                    memory.covariance.replace(ReplacedError::Offset, &row, part.variance.x);
                }
            }
            ObservedQuantity::Attitude(attitude) => {
                // The heading is no better than roll and pitch, because the errors mix.
                let tilt = memory.covariance.variances().theta.xy().max();
                self.reset_heading(
                    memory,
                    part,
                    horizon,
                    yaw_between(attitude, &past.attitude),
                    part.variance.z + tilt,
                );
            }
            ObservedQuantity::Heading(heading) => {
                self.reset_heading(memory, part, horizon, wrap_angle(heading - horizon.heading()), part.variance.x);
            }
            ObservedQuantity::Field(field) => {
                let field = horizon.field(field);
                let turn = wrap_angle(self.magnetic_north_rad - atan2(field.y, field.x));
                self.reset_heading(memory, part, horizon, turn, field_variance(&field, part.variance.x));
            }
        }
    }

    /// Resets the heading to the yaw bank's if the heading is unknown or was contradicted for long enough.
    pub(crate) fn follow_bank(&self, memory: &mut Memory, at_us: u64) {
        let Some((by, variance)) = memory.yaw_bank.error().filter(|(_, variance)| *variance < SURE_RAD * SURE_RAD)
        else {
            memory.contradicted_us = None;
            return;
        };
        let both = variance + memory.covariance.variances().theta.z;
        let contradicts = by * by > max(FAR_RAD * FAR_RAD, FAR_SIGMAS * FAR_SIGMAS * both);
        if memory.knows.heading && !contradicts {
            memory.contradicted_us = None;
            return;
        }
        let since_us = *memory.contradicted_us.get_or_insert(at_us);
        if memory.knows.heading && at_us.saturating_sub(since_us) < CONTRADICTED_US {
            return;
        }
        memory.contradicted_us = None;
        memory.turn_heading(by);
        memory.covariance.replace(ReplacedError::Heading, &NO_ROW, variance + HEADED_RAD * HEADED_RAD);
        // The wrong heading has integrated accelerations in wrong directions, which has put errors into velocity and
        // tilt.
        if memory.knows.heading {
            memory.doubt_velocity(&Vector3::repeat(1.0));
            memory.inflate_tilt();
        }
        memory.knows.heading = true;
    }

    /// Replaces the errors of a position or velocity by the measurement's errors.
    fn replace_motion(&self, memory: &mut Memory, part: &AidObservation, horizon: &FusionHorizon) {
        let expected = self.expected(memory);
        for at in VectorComponent::ALL.into_iter().filter(|at| part.axes.contain(*at)) {
            let Some((_, mut row)) = horizon.row(&part.target, at, &expected) else { continue };
            let which = if row.position == 0.0 { ReplacedError::Velocity(at) } else { ReplacedError::Position(at) };
            match which {
                ReplacedError::Velocity(_) => row.velocity = 0.0,
                _ => row.position = 0.0,
            }
            row.slow = part.is_slow().then(|| slow_position(at));
            memory.covariance.replace(which, &row, at.of(&part.variance));
        }
    }

    /// Turns the heading by `by`, and replaces its error by the error of `part`, with the noise variance `variance`.
    fn reset_heading(
        &self,
        memory: &mut Memory,
        part: &AidObservation,
        horizon: &FusionHorizon,
        by: f32,
        variance: f32,
    ) {
        let turn = about_z(by);
        memory.turn_heading(by);
        // Without a row of the measurement, as with the nose or the field almost vertical, the heading error is taken
        // to be up to ten times the tilt error.
        let tilt = memory.covariance.variances().theta.xy().max();
        let row = horizon.turned(&turn).row(&part.target, VectorComponent::Z, &self.expected(memory));
        let (row, variance) = match row {
            Some((_, row)) => (row, variance),
            None => (NO_ROW, variance + 100.0 * tilt),
        };
        let row = JacobianRow { theta: Vector3::new(row.theta.x, row.theta.y, 0.0), ..row };
        memory.covariance.replace(ReplacedError::Heading, &row, min(variance, 100.0));
        memory.knows.heading = true;
    }
}

impl Memory {
    /// Resets the position by `by`.
    fn put(&mut self, by: &Vector3<f32>) {
        count(&mut self.resets.position);
        self.nominal.move_to(self.nominal.position + by);
        // The stored past states shift too; otherwise a late fix would report the same jump again.
        self.history.correct(&identity(), &NONE, &NONE, by);
    }

    /// Resets the velocity by `by`.
    fn push(&mut self, by: &Vector3<f32>) {
        count(&mut self.resets.velocity);
        self.nominal.velocity += by;
        self.history.correct(&identity(), &NONE, by, &NONE);
    }

    /// Resets the heading by `by`. The caller must then replace its error.
    pub(crate) fn turn_heading(&mut self, by: f32) {
        count(&mut self.resets.heading);
        let turn = about_z(by);
        self.nominal.turn_to(normalized(&(turn * self.nominal.attitude)));
        // Rotates the attitude at the covariance's time too, since the next prediction averages both.
        self.rotation = matrix(&turn) * self.rotation;
        // The turn is not added to the linear sum of corrections, for which it may be too large. Position and velocity
        // stay.
        self.history.correct(&turn, &NONE, &NONE, &NONE);
        self.covariance.turn(&matrix(&turn));
        self.yaw_bank.turn_at_once(by);
        // Earlier innovations say nothing of the new heading.
        (self.leaning[1].z, self.doubts_field) = (0.0, false);
    }

    /// Adds a variance to each coordinate of the velocity.
    pub(crate) fn doubt_velocity(&mut self, variance: &Vector3<f32>) {
        let vv = &mut self.covariance.vv;
        (vv.m11, vv.m22, vv.m33) = (vv.m11 + variance.x, vv.m22 + variance.y, vv.m33 + variance.z);
        self.covariance.hold();
    }
}
