//! Sensor calibration with PX4's protocol: MAV_CMD_PREFLIGHT_CALIBRATION and texts that QGroundControl and MAVSDK
//! parse.

use crate::services::texts::Words;
use afbc_calibration::{
    AccelerometerCalibration, CalibrationEvent, CalibrationFailure, GyroscopeCalibration, LevelCalibration,
    MagnetometerCalibration, RawSample, Side, Sides,
};
use afbc_mavlink::CalibrationRequest;
use afbc_onboard::Configuration;
use afbc_store::RecordName;
use heapless::Vec;
use nalgebra::Vector3;

/// A calibration fails after this silence of the sensors \[us\].
const SILENT_US: u64 = 1_000_000;
/// Largest number of values that a calibration finds.
const VALUES_MAX: usize = 9;

/// The calibration that a station has asked for.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CalibrationState {
    /// Number of calibrations begun so far, to tell one from the next.
    pub(crate) number: u8,
    /// Sensor that is being calibrated.
    pub(crate) active: Option<CalibrationRequest>,
}

/// Calibrates the vehicle's sensors for [`Comms`](crate::Comms::calibrate). A shell without sensors has no calibrator.
#[derive(Debug, Default)]
pub struct Calibrator {
    /// Number of the present calibration.
    number: u8,
    heard_us: u64,
    procedure: Option<Procedure>,
    /// Names and values of the parameters found.
    found: Vec<(RecordName, f32), VALUES_MAX>,
    /// Number of found parameters that have been returned.
    given: usize,
}

#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "only one procedure exists at a time, and there is no heap")]
enum Procedure {
    Gyroscope(GyroscopeCalibration),
    Accelerometer(AccelerometerCalibration),
    Level(LevelCalibration),
    Magnetometer(MagnetometerCalibration),
}

/// Result of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Step {
    /// The calibration continues.
    Continue,
    /// This parameter is to be set. The calibration continues with the next step.
    Set(RecordName, f32),
    /// All parameters have been found and returned.
    Finished,
    /// The calibration has failed for this reason.
    Failed(&'static str),
}

impl Calibrator {
    /// Creates an idle calibrator.
    pub fn new() -> Self {
        Calibrator::default()
    }

    /// Aborts the calibration.
    pub(crate) fn stop(&mut self) {
        self.procedure = None;
        self.found.clear();
        self.given = 0;
    }

    /// Begins a calibration.
    fn begin(&mut self, what: CalibrationRequest, configuration: &Configuration, now_us: u64) {
        self.stop();
        self.heard_us = now_us;
        let Configuration { imu, calibration, estimation, .. } = configuration;
        self.procedure = match what {
            CalibrationRequest::Gyroscope => Some(Procedure::Gyroscope(GyroscopeCalibration::default())),
            CalibrationRequest::Accelerometer => {
                Some(Procedure::Accelerometer(AccelerometerCalibration::new(imu, estimation.gravity_m_s2)))
            }
            CalibrationRequest::Level => Some(Procedure::Level(LevelCalibration::new(imu, calibration))),
            CalibrationRequest::Magnetometer => {
                Some(Procedure::Magnetometer(MagnetometerCalibration::new(imu, calibration)))
            }
            CalibrationRequest::Cancel => None,
        };
    }

    /// Advances calibration `what`, numbered `number`, with the sensors' next sample, if there is one.
    pub(crate) fn step(
        &mut self,
        (number, what): (u8, CalibrationRequest),
        sample: Option<RawSample>,
        (configuration, now_us): (&Configuration, u64),
        say: impl FnMut(&Words),
    ) -> Step {
        if number != self.number {
            self.number = number;
            self.begin(what, configuration, now_us);
        }
        // A sample that is no number is none.
        let Some(sample) = sample.filter(RawSample::is_finite) else {
            let silent_us = now_us.saturating_sub(self.heard_us);
            return if silent_us >= SILENT_US { Step::Failed("no sensor readings") } else { Step::Continue };
        };
        self.heard_us = now_us;
        match self.find(&sample, say) {
            Some(Ok(())) => self.procedure = None,
            Some(Err(failure)) => return Step::Failed(reason(failure)),
            None if self.procedure.is_some() => return Step::Continue,
            None => (),
        }
        // One value is returned per sample, so that writing to flash keeps up.
        match self.found.get(self.given) {
            Some((name, value)) => {
                self.given += 1;
                Step::Set(*name, *value)
            }
            None => Step::Finished,
        }
    }

    /// Returns all parameters that were found.
    pub(crate) fn found(&self) -> impl Iterator<Item = (RecordName, f32)> {
        self.found.iter().copied()
    }

    /// Advances the procedure by one sample.
    fn find(&mut self, sample: &RawSample, mut say: impl FnMut(&Words)) -> Option<Result<(), CalibrationFailure>> {
        let found = &mut self.found;
        let mut put = |name: &str, values: Vector3<f32>| keep(found, name, &values);
        let tell = |event| words(event, &mut say);
        Some(match self.procedure.as_mut()? {
            Procedure::Gyroscope(it) => it.step(sample, tell)?.map(|offset| put("CAL_GYRO0_OFF_", offset)),
            Procedure::Level(it) => it.step(sample, tell)?.map(|attitude| put("IMU_ATT_", attitude)),
            Procedure::Accelerometer(it) => it.step(sample, tell)?.map(|errors| {
                put("CAL_ACC0_OFF_", errors.offset_m_s2);
                put("CAL_ACC0_SCALE_", errors.scale);
            }),
            Procedure::Magnetometer(it) => it.step(sample, tell)?.map(|fit| {
                put("CAL_MAG0_OFF_", fit.offset_ut);
                put("CAL_MAG0_SCALE_", fit.scale);
                put("CAL_MAG0_ODIAG_", fit.off_diagonal);
            }),
        })
    }
}

/// Adds the parameters of the three axes.
#[inline(never)]
fn keep(found: &mut Vec<(RecordName, f32), VALUES_MAX>, name: &str, values: &Vector3<f32>) {
    for (axis, value) in ['X', 'Y', 'Z'].into_iter().zip(values.iter()) {
        // The names fit and there is room: a test looks up each of them.
        found.extend(RecordName::of(name.chars().chain([axis])).map(|name| (name, *value)));
    }
}

/// Returns the name by which stations know a calibration.
pub(crate) fn name(what: CalibrationRequest) -> &'static str {
    match what {
        CalibrationRequest::Gyroscope => "gyro",
        CalibrationRequest::Accelerometer => "accel",
        CalibrationRequest::Level => "level",
        CalibrationRequest::Magnetometer => "mag",
        CalibrationRequest::Cancel => "",
    }
}

fn side_name(side: Side) -> &'static str {
    match side {
        Side::Back => "back",
        Side::Front => "front",
        Side::Left => "left",
        Side::Right => "right",
        Side::Up => "up",
        Side::Down => "down",
    }
}

/// Announces an event, in PX4's words where stations parse them. Not inlined because each procedure's step calls it.
#[inline(never)]
fn words(event: CalibrationEvent, say: &mut dyn FnMut(&Words)) {
    let cal = Words::of("[cal] ");
    match event {
        CalibrationEvent::Progress(percent) => say(&cal.and("progress <").number(percent.into()).and(">")),
        CalibrationEvent::Moved => say(&cal.and("detected motion, hold still...")),
        CalibrationEvent::Pending(sides) => {
            say(&pending(sides));
            say(&Words::of("[cal] hold vehicle still on a pending side"));
        }
        CalibrationEvent::Askew => say(&cal.and("no side faces down, rotate to one")),
        CalibrationEvent::Detected(side) => say(&cal.and(side_name(side)).and(" orientation detected")),
        CalibrationEvent::Repeated(side) => say(&cal.and(side_name(side)).and(" side already completed")),
        CalibrationEvent::Rotate => say(&cal.and("rotate vehicle around the vertical")),
        CalibrationEvent::Done(side) => say(&cal.and(side_name(side)).and(" side done, rotate to a different side")),
        _ => (),
    }
}

fn pending(sides: Sides) -> Words {
    sides.iter().fold(Words::of("[cal] pending:"), |words, side| words.and(" ").and(side_name(side)))
}

/// Returns the reason of a failure, in at most 24 characters: the text has no more room.
fn reason(failure: CalibrationFailure) -> &'static str {
    match failure {
        CalibrationFailure::Moving => "vehicle moved",
        CalibrationFailure::TimedOut => "no side held in time",
        CalibrationFailure::NotRotated => "not rotated in time",
        CalibrationFailure::NoField => "no magnetometer readings",
        CalibrationFailure::NotLevel => "tilted above 15 degrees",
        CalibrationFailure::TooFewDirections => "too few directions",
        CalibrationFailure::TooLarge => "sensor errors too large",
        CalibrationFailure::FieldStrength => "not the earth's field",
        CalibrationFailure::FieldUneven => "field uneven: iron near?",
        _ => "unknown",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAILURES: [CalibrationFailure; 9] = [
        CalibrationFailure::Moving,
        CalibrationFailure::TimedOut,
        CalibrationFailure::NotRotated,
        CalibrationFailure::NoField,
        CalibrationFailure::NotLevel,
        CalibrationFailure::TooFewDirections,
        CalibrationFailure::TooLarge,
        CalibrationFailure::FieldStrength,
        CalibrationFailure::FieldUneven,
    ];

    /// No text is truncated: a STATUSTEXT has 50 characters.
    #[test]
    fn texts_fit() {
        let of_sides = Side::ALL.into_iter().flat_map(|side| {
            [CalibrationEvent::Detected, CalibrationEvent::Repeated, CalibrationEvent::Done].map(|it| it(side))
        });
        let others = [
            CalibrationEvent::Progress(100),
            CalibrationEvent::Moved,
            CalibrationEvent::Pending(Sides::ALL),
            CalibrationEvent::Askew,
            CalibrationEvent::Rotate,
        ];
        for event in of_sides.chain(others) {
            words(event, &mut |words| {
                let longer = words.clone().and("!");
                assert_ne!(*words, longer, "{event:?} has no room for another character");
            });
        }
        for failure in FAILURES.map(reason) {
            assert!("[cal] calibration failed: ".len() + failure.len() <= 50, "{failure}");
            assert_ne!(failure, "unknown");
        }
    }
}
