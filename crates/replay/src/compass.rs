//! How far the magnetometer of a recording is from the earth's field.

use crate::earth::Field;
use crate::recording::{Recording, SampleSource, Sensor};
use afbc_estimator::{Measurement, Settings};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Topic of fields that are not calibrated.
const RAW: &str = "sensor_mag";
/// Age of an attitude of the log at which a field is levelled by it \[us\].
const FRESH_US: u64 = 100_000;
/// How many times the third part may be as large as both others: nine tenths are within it (Student's distribution of
/// two degrees of freedom). It need not be larger than usual for that.
const UNSEEN: f32 = 3.0;
/// Least error of a heading by a magnetometer \[rad\].
const LEAST_RAD: f32 = 0.05;
/// Error of the heading from which on it is reported \[rad\].
const TOLD_RAD: f32 = 0.35;

/// Sets what the recording's magnetometer makes of the heading. Where its field differs from that of the `earth`, the
/// two parts that the heading does not change, level and down, show how large the third may be. One that nobody has
/// calibrated, and that cannot be compared, gives no heading.
pub(crate) fn doubt(recording: &mut Recording, earth: Option<&Field>) {
    let most_rad = Settings::MAG_SLOW.range.max as f32;
    let (Some([level, down]), Some(earth)) = (parts(recording), earth) else {
        let is_raw = |source: &SampleSource| source.sensor == Sensor::Magnetometer && source.topic == RAW;
        recording.mag_slow_rad = recording.sources.iter().any(is_raw).then_some(most_rad);
        return;
    };
    // The root mean square of the two that are seen stands for the one that is not.
    let off = libm::hypotf(level - earth.horizontal_gauss, down - earth.down_gauss) * core::f32::consts::FRAC_1_SQRT_2;
    // Near the magnetic poles nothing is left level.
    let error_rad = off / earth.horizontal_gauss.max(1e-3);
    let unseen_rad = (UNSEEN * error_rad).clamp(LEAST_RAD, Settings::DEFAULT.mag_slow_rad);
    recording.mag_slow_rad = Some(error_rad.max(unseen_rad).min(most_rad));
    if error_rad > TOLD_RAD {
        recording.notes.push(format!(
            "The magnetometer shows {level:.2} gauss level and {down:.2} down, the earth's field there has {:.2} and \
             {:.2}: its heading means nothing; calibrate it away from iron.",
            earth.horizontal_gauss, earth.down_gauss,
        ));
    }
}

/// Returns the medians of the parts of the field, level and downwards \[gauss\], in the log's attitude.
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

/// Returns the direction of the earth's z in the body.
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
