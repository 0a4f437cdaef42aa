//! Calibration of the magnetometer's offset and matrix.

use crate::ellipsoid::{FieldFit, FieldSums};
use crate::rest::{RestLimits, RestSamples};
use crate::side::{Side, Sides};
use crate::{CalibrationEvent, CalibrationFailure, RawSample};
use afbc_types::{Mounting, SensorCalibration};
use nalgebra::{Matrix3, Vector3};

/// Time at rest after which the side is detected \[us\].
const DETECT_US: u64 = 500_000;
/// Time allowed for the next side, and for the turn on it \[us\].
const PATIENCE_US: u64 = 90_000_000;
const TURN_US: u64 = 40_000_000;
/// Number of parts of a turn, in each of which one reading is taken, and number of parts that finish a side.
const PARTS: u8 = 24;
const PARTS_MIN: u32 = 22;
/// Readings are taken only if the cosine of the tilt from the side is at least this.
const ALONG_MIN: f32 = 0.6;
/// Longest time between samples over which a rate is integrated \[us\].
const GAP_US: u64 = 100_000;
/// Time without a reading after which the magnetometer counts as missing \[us\].
const SILENT_US: u64 = 1_000_000;

/// Measures the magnetometer's errors while the vehicle is turned about the vertical by a whole turn on each of its six
/// sides. The gyroscope measures the turn, so that readings are spread evenly.
#[derive(Clone, Debug)]
pub struct MagnetometerCalibration {
    to_body: Matrix3<f32>,
    errors: SensorCalibration,
    sums: FieldSums,
    /// Time at which the last side was finished, and time of the last field reading \[us\].
    done_us: Option<u64>,
    read_us: u64,
    last_us: u64,
    rest: RestSamples,
    /// True if the present rest was already reported.
    told: bool,
    turn: Option<SideTurn>,
    pending: Sides,
}

/// Turn on one side.
#[derive(Clone, Copy, Debug)]
struct SideTurn {
    side: Side,
    began_us: u64,
    /// Net angle \[turns\], and the parts that have a reading, one bit each.
    turns: f32,
    parts: u32,
}

impl MagnetometerCalibration {
    /// Creates the calibration for an IMU with this mounting and these errors.
    #[must_use]
    pub fn new(mounting: &Mounting, errors: &SensorCalibration) -> Self {
        MagnetometerCalibration {
            to_body: mounting.r_body_sensor(),
            errors: *errors,
            sums: FieldSums::default(),
            done_us: None,
            read_us: 0,
            last_us: 0,
            rest: RestSamples::default(),
            told: false,
            turn: None,
            pending: Sides::ALL,
        }
    }

    /// Takes a sample. Returns the errors, or the failure, at the end.
    pub fn step(
        &mut self,
        sample: &RawSample,
        mut tell: impl FnMut(CalibrationEvent),
    ) -> Option<Result<FieldFit, CalibrationFailure>> {
        let at_us = sample.at_us;
        let done_us = *self.done_us.get_or_insert_with(|| {
            tell(CalibrationEvent::Pending(Sides::ALL));
            (self.read_us, self.last_us) = (at_us, at_us);
            at_us
        });
        // A sample that is no number is left out, as if it had not arrived.
        if !sample.is_finite() {
            return (at_us.saturating_sub(done_us) >= PATIENCE_US).then_some(Err(CalibrationFailure::TimedOut));
        }
        if sample.field_ut.is_some() {
            self.read_us = at_us;
        } else if at_us.saturating_sub(self.read_us) >= SILENT_US {
            return Some(Err(CalibrationFailure::NoField));
        }
        let step_us = core::mem::replace(&mut self.last_us, at_us);
        let step_us = at_us.saturating_sub(step_us);
        let up = self.to_body * self.errors.specific_force(&sample.specific_force_m_s2);
        let rates_rad_s = self.to_body * (sample.rates_rad_s - self.errors.gyro_offset_rad_s);
        if let Some(turn) = &mut self.turn {
            if step_us <= GAP_US {
                turn.turns += turn.side.up().dot(&rates_rad_s) * (step_us as f32 * 1e-6) / core::f32::consts::TAU;
            }
            if turn.side.up().dot(&up) >= ALONG_MIN * up.norm()
                && let Some(field_ut) = sample.field_ut
            {
                turn.take(&field_ut, &mut self.sums);
            }
            let late = at_us.saturating_sub(turn.began_us) >= TURN_US;
            if turn.parts.count_ones() < PARTS_MIN {
                return late.then_some(Err(CalibrationFailure::NotRotated));
            }
            let side = turn.side;
            self.turn = None;
            self.done_us = Some(at_us);
            self.pending = self.pending.without(side);
            // The vehicle still rests on the finished side, which need not be reported again.
            self.told = true;
            tell(CalibrationEvent::Done(side));
            tell(CalibrationEvent::Progress(self.pending.done_percent()));
            if self.pending.is_empty() {
                return Some(self.sums.fit());
            }
            tell(CalibrationEvent::Pending(self.pending));
            return None;
        }
        if !self.rest.add(sample, &RestLimits::HELD) {
            self.told = false;
        }
        if self.rest.elapsed_us() >= DETECT_US && !self.told {
            self.told = true;
            match Side::of(&(self.to_body * self.rest.specific_force_m_s2())) {
                None => tell(CalibrationEvent::Askew),
                Some(side) if !self.pending.contains(side) => tell(CalibrationEvent::Repeated(side)),
                Some(side) => {
                    self.turn = Some(SideTurn { side, began_us: at_us, turns: 0.0, parts: 0 });
                    tell(CalibrationEvent::Detected(side));
                    tell(CalibrationEvent::Rotate);
                }
            }
        }
        (at_us.saturating_sub(done_us) >= PATIENCE_US).then_some(Err(CalibrationFailure::TimedOut))
    }
}

impl SideTurn {
    /// Takes the first reading of each part of the turn.
    fn take(&mut self, field_ut: &Vector3<f32>, sums: &mut FieldSums) {
        let share = self.turns - libm::floorf(self.turns);
        // Just below a whole turn the share rounds to 1.
        let part = 1 << ((share * f32::from(PARTS)) as u8).min(PARTS - 1);
        if self.parts & part == 0 {
            self.parts |= part;
            sums.add(field_ut);
        }
    }
}
