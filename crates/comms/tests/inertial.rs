//! HIGHRES_IMU has the IMU's readings with the calibration applied, in the body frame.

use crate::common::{Bench, STATION};
use afbc_calibration::RawSample;
use afbc_comms::{Calibrator, Comms, Setup};
use afbc_mavlink::{Decoder, InertialSample, Uplink, VehicleCommand};
use afbc_onboard::Configuration;
use afbc_onboard::parameters::ParameterTable;
use afbc_types::{Mounting, SensorCalibration};
use nalgebra::{Matrix3, Rotation3, Vector3};
use proptest::prelude::*;

/// Message number of HIGHRES_IMU.
const MESSAGE: u32 = 105;

fn vector(least: f32, most: f32) -> impl Strategy<Value = Vector3<f32>> {
    prop::array::uniform3(least..most).prop_map(Vector3::from)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    /// A requested sample is sent once. Offsets are subtracted from the readings, and then scale and mounting are
    /// applied.
    #[test]
    fn a_sample_is_the_corrected_reading(
        [attitude_rad, gyro_offset_rad_s, accel_offset_m_s2] in prop::array::uniform3(vector(-0.9, 0.9)),
        [accel_scale, mag_scale] in prop::array::uniform2(vector(0.85, 1.2)),
        mag_off_diagonal in vector(-0.4, 0.4),
        [rates_rad_s, specific_force_m_s2, mag_offset_ut, field_ut] in prop::array::uniform4(vector(-30.0, 30.0)),
        has_field in any::<bool>(),
    ) {
        let calibration = SensorCalibration {
            gyro_offset_rad_s,
            accel_offset_m_s2,
            accel_scale,
            mag_offset_ut,
            mag_scale,
            mag_off_diagonal,
        };
        let imu = Mounting { attitude_rad, ..Mounting::PLAIN };
        let table = ParameterTable::new(Configuration { imu, calibration, ..Configuration::default() });
        let mut bench = Bench::new();
        bench.comms = Comms::with(Setup { calibrates: true, ..Setup::default() });
        bench.hear(Uplink::Command(VehicleCommand::RequestMessage { message: MESSAGE, index: 0 }));
        bench.step();
        let sample = RawSample {
            at_us: 1_234,
            rates_rad_s,
            specific_force_m_s2,
            field_ut: Some(field_ut).filter(|_| has_field),
        };
        let (mut calibrator, mut decoder, mut samples) = (Calibrator::default(), Decoder::new(STATION), Vec::new());
        for _ in 0..2 {
            bench.comms.calibrate(&mut calibrator, Some(sample), &table, |bytes| {
                decoder.feed_accepted(bytes, |_| true, |_, sample: InertialSample| samples.push(sample));
            });
        }
        let [sent] = samples.as_slice() else { panic!("{samples:?}") };
        let turned = Rotation3::from_euler_angles(attitude_rad.x, attitude_rad.y, attitude_rad.z);
        let force = turned * (specific_force_m_s2 - accel_offset_m_s2).component_mul(&accel_scale);
        let rates = turned * (rates_rad_s - gyro_offset_rad_s);
        let [[sx, sy, sz], [xy, xz, yz]] = [mag_scale, mag_off_diagonal].map(<[f32; 3]>::from);
        let field = Matrix3::new(sx, xy, xz, xy, sy, yz, xz, yz, sz) * (field_ut - mag_offset_ut);
        prop_assert_eq!(sent.time_us, 1_234);
        prop_assert!((sent.specific_force_m_s2 - force).amax() < 1e-3, "{sent:?}, not {force}");
        prop_assert!((sent.rates_rad_s - rates).amax() < 1e-3, "{sent:?}, not {rates}");
        prop_assert_eq!(sent.field_ut.is_some(), has_field);
        prop_assert!(sent.field_ut.is_none_or(|sent| (sent - field).amax() < 1e-3), "{sent:?}, not {field}");
    }
}
