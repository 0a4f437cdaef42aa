//! Sets a part of the state to a measurement, where it is not known, or was contradicted for too long.
//!
//! The new error is then that of the measurement: its noise, and what the other errors make of it. So each reset keeps
//! the covariances that it has by these, and the matrix stays one ([`crate::covariance::Covariance::replace`]).

use crate::errors::{Coordinate, Errors, NO_ROW, Replaced, Row};
use crate::estimate::count;
use crate::estimator::Estimator;
use crate::fusion::{field_variance, slow_position};
use crate::horizon::{Horizon, Target};
use crate::memory::Memory;
use crate::queue::{Axes, Part};
use crate::restart::{KEEP, NONE};
use crate::rotation::{about_z, atan2, identity, matrix, normalized, twist};
use afbc_control::math::{max, min, wrap_angle};
use nalgebra::Vector3;

/// Standard deviation of the bank's heading below which it counts \[rad\].
const SURE_RAD: f32 = 0.2;
/// Difference from the heading that contradicts it, in standard deviations of both and at least \[rad\].
const FAR_SIGMAS: f32 = 3.0;
const FAR_RAD: f32 = 0.35;
/// Time for which it must \[us\].
const CONTRADICTED_US: u64 = 2_000_000;
/// Error of the bank's heading by what it leaves out, the tilt's and the sensor's biases \[rad\].
const HEADED_RAD: f32 = 0.1;

impl Estimator {
    /// Sets what `part` measures to it.
    pub(crate) fn follow(&self, memory: &mut Memory, part: &Part, horizon: &Horizon) {
        let past = horizon.past();
        match &part.target {
            Target::Position(position) => {
                memory.put(&part.axes.only(&(position - past.position)));
                self.replace_motion(memory, part, horizon);
                memory.knows.position = true;
                if part.axes != Axes::Level {
                    // The barometer's offset was that of another height.
                    memory.covariance.forget(&Errors { baro: 0.0, ..KEEP });
                    memory.covariance.hold();
                    memory.knows.height_offset = false;
                }
            }
            Target::Velocity(velocity) => {
                memory.push(&part.axes.only(&(velocity - past.velocity)));
                self.replace_motion(memory, part, horizon);
            }
            Target::Height(height) => {
                count(&mut memory.resets.height);
                memory.height_offset = height - past.position.z;
                memory.knows.height_offset = true;
                if let Some((_, mut row)) = horizon.row(&part.target, Coordinate::Z, &self.expected(memory)) {
                    row.baro = 0.0;
                    memory.covariance.replace(Replaced::Offset, &row, part.variance.x);
                }
            }
            Target::Attitude(attitude) => {
                // As good as roll and pitch are: they mix with it.
                let tilt = memory.covariance.variances().theta.xy().max();
                self.head(memory, part, horizon, twist(attitude, &past.attitude), part.variance.z + tilt);
            }
            Target::Heading(heading) => {
                self.head(memory, part, horizon, wrap_angle(heading - horizon.heading()), part.variance.x);
            }
            Target::Field(field) => {
                let field = horizon.field(field);
                let turn = wrap_angle(self.magnetic_north_rad - atan2(field.y, field.x));
                self.head(memory, part, horizon, turn, field_variance(&field, part.variance.x));
            }
        }
    }

    /// Looks at the heading that a receiver's velocity shows, and sets the heading to it if that is unknown, or has
    /// been contradicted for long enough.
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
        memory.covariance.replace(Replaced::Heading, &NO_ROW, variance + HEADED_RAD * HEADED_RAD);
        // The wrong heading has made velocities of accelerations to other sides, and a tilt of them.
        if memory.knows.heading {
            memory.doubt_velocity(&Vector3::repeat(1.0));
            memory.doubt_tilt();
        }
        memory.knows.heading = true;
    }

    /// Replaces the errors of a position or velocity.
    fn replace_motion(&self, memory: &mut Memory, part: &Part, horizon: &Horizon) {
        let expected = self.expected(memory);
        for at in Coordinate::ALL.into_iter().filter(|at| part.axes.contain(*at)) {
            let Some((_, mut row)) = horizon.row(&part.target, at, &expected) else { continue };
            let which = if row.position == 0.0 { Replaced::Velocity(at) } else { Replaced::Position(at) };
            match which {
                Replaced::Velocity(_) => row.velocity = 0.0,
                _ => row.position = 0.0,
            }
            row.slow = part.is_slow().then(|| slow_position(at));
            memory.covariance.replace(which, &row, at.of(&part.variance));
        }
    }

    /// Turns the heading by `by`, and replaces its error by that of `part`, whose noise has this variance.
    fn head(&self, memory: &mut Memory, part: &Part, horizon: &Horizon, by: f32, variance: f32) {
        let turn = about_z(by);
        memory.turn_heading(by);
        // A field that is too steep for a row turns with the tilt by up to ten times as much.
        let tilt = memory.covariance.variances().theta.xy().max();
        let row = horizon.turned(&turn).row(&part.target, Coordinate::Z, &self.expected(memory));
        let (row, variance) = match row {
            Some((_, row)) => (row, variance),
            None => (NO_ROW, variance + 100.0 * tilt),
        };
        let row = Row { theta: Vector3::new(row.theta.x, row.theta.y, 0.0), ..row };
        memory.covariance.replace(Replaced::Heading, &row, min(variance, 100.0));
        memory.knows.heading = true;
    }
}

impl Memory {
    /// Moves the position by `by`.
    fn put(&mut self, by: &Vector3<f32>) {
        count(&mut self.resets.position);
        self.nominal.move_to(self.nominal.position + by);
        // The past moves with it, or a late fix would report the same jump once more.
        self.history.correct(&identity(), &NONE, &NONE, by);
    }

    /// Changes the velocity by `by`.
    fn push(&mut self, by: &Vector3<f32>) {
        count(&mut self.resets.velocity);
        self.nominal.velocity += by;
        self.history.correct(&identity(), &NONE, by, &NONE);
    }

    /// Turns the heading by `by`; its error is to be replaced.
    pub(crate) fn turn_heading(&mut self, by: f32) {
        count(&mut self.resets.heading);
        let turn = about_z(by);
        self.nominal.turn_to(normalized(&(turn * self.nominal.attitude)));
        // That of the covariance's time, too: the next prediction takes the mean of both.
        self.rotation = matrix(&turn) * self.rotation;
        // Not into the linear sum, for which the turn may be too large: position and velocity stay.
        self.history.correct(&turn, &NONE, &NONE, &NONE);
        self.covariance.turn(&matrix(&turn));
        self.yaw_bank.turn_at_once(by);
    }

    /// Doubts the velocity by this variance of each coordinate.
    pub(crate) fn doubt_velocity(&mut self, variance: &Vector3<f32>) {
        let vv = &mut self.covariance.vv;
        (vv.m11, vv.m22, vv.m33) = (vv.m11 + variance.x, vv.m22 + variance.y, vv.m33 + variance.z);
        self.covariance.hold();
    }
}
