//! Checks a recording's magnetometer against the earth's magnetic field.

use crate::earth::EarthField;
use crate::recording::{Recording, SampleSource, Sensor};
use afbc_estimator::{Measurement, Settings};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Topic of uncalibrated fields.
const RAW: &str = "sensor_mag";
/// A field is levelled with an attitude of the log that is at most this old \[us\].
const FRESH_US: u64 = 100_000;
/// Ratio of the assumed error along the field's third, unseen axis to the error seen in the other two: nine tenths are
/// within this ratio (Student's distribution with two degrees of freedom). The ratio raises the error to the
/// estimator's default at most.
const UNSEEN: f32 = 3.0;
/// Smallest error of a magnetometer's heading \[rad\].
const LEAST_RAD: f32 = 0.05;
/// A heading error larger than this is reported \[rad\].
const TOLD_RAD: f32 = 0.35;

/// Sets the recording's heading error due to its magnetometer. The heading does not change the horizontal and the
/// downward part of the field, so their differences from the `earth`'s field show how large the error of the third part
/// may be. A magnetometer that is neither calibrated nor comparable gives no heading.
pub(crate) fn doubt(recording: &mut Recording, earth: Option<&EarthField>) {
    let most_rad = Settings::MAG_SLOW.range.max as f32;
    let (Some([level, down]), Some(earth)) = (parts(recording), earth) else {
        let is_raw = |source: &SampleSource| source.sensor == Sensor::Magnetometer && source.topic == RAW;
        recording.mag_slow_rad = recording.sources.iter().any(is_raw).then_some(most_rad);
        return;
    };
    // The root mean square of the two visible errors stands for the third.
    let off = libm::hypotf(level - earth.horizontal_gauss, down - earth.down_gauss) * core::f32::consts::FRAC_1_SQRT_2;
    // Near the magnetic poles the field has hardly any horizontal part.
    let error_rad = off / earth.horizontal_gauss.max(1e-3);
    let unseen_rad = (UNSEEN * error_rad).clamp(LEAST_RAD, Settings::DEFAULT.mag_slow_rad);
    recording.mag_slow_rad = Some(error_rad.max(unseen_rad).min(most_rad));
    if error_rad > TOLD_RAD {
        recording.notes.push(format!(
            "The magnetometer shows {level:.2} gauss horizontally and {down:.2} down, but the earth's field at this \
             place has {:.2} and {:.2}. The compass heading is useless; calibrate the magnetometer away from iron.",
            earth.horizontal_gauss, earth.down_gauss,
        ));
    }
}

/// Returns the medians of the field's horizontal and downward part \[gauss\], levelled by the log's attitude.
fn parts(recording: &Recording) -> Option<[f32; 2]> {
    let fields = recording.aiding.iter().filter_map(|aiding| {
        let Measurement::MagneticField { field, .. } = aiding.measurement.value else { return None };
        let up = up(recording, aiding.measurement.at_us)?;
        let down = -field.dot(&up);
        Some([libm::sqrtf((field.norm_squared() - down * down).max(0.0)), down])
    });
    let (level, down): (Vec<f32>, Vec<f32>) = fields.map(|[level, down]| (level, down)).unzip();
    Some([middle(level)?, middle(down)?])
}

/// Returns the direction of the earth's z axis in the body frame.
fn up(recording: &Recording, at_us: u64) -> Option<Vector3<f32>> {
    let states = &recording.states;
    let until = states.partition_point(|state| state.at_us <= at_us);
    let near = states.iter().take(until).rev().take_while(|state| state.at_us + FRESH_US >= at_us);
    let [w, x, y, z] = near.filter_map(|state| state.attitude).next()?;
    Some(UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).inverse_transform_vector(&Vector3::z()))
}

fn middle(mut values: Vec<f32>) -> Option<f32> {
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).copied()
}
