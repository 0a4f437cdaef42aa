//! Sensors without which the vehicle is not armed, and their self-tests.

use crate::services::health::sensor;
use crate::services::status::{AuxSensors, SensorBits};

/// Bits of the IMUs and the compass, with their texts: arming refused, self-test failed, self-test passed.
const SENSORS: [(u32, [&str; 3]); 3] = [
    (
        sensor::GYROSCOPE | sensor::ACCELEROMETER,
        ["arming refused: IMU 1 is faulty", "IMU 1 failed its self-test", "IMU 1 passed its self-test"],
    ),
    (
        sensor::GYROSCOPE_2 | sensor::ACCELEROMETER_2,
        ["arming refused: IMU 2 is faulty", "IMU 2 failed its self-test", "IMU 2 passed its self-test"],
    ),
    (
        sensor::MAGNETOMETER,
        [
            "arming refused: the compass is faulty",
            "the compass failed its self-test",
            "the compass passed its self-test",
        ],
    ),
];

/// Returns the text about the first sensor that is present but unhealthy. Returns none if all are healthy.
pub fn faulty(aux: &AuxSensors) -> Option<&'static str> {
    let SensorBits { present, healthy } = aux.sensors;
    let (_, [faulty, ..]) = first(present & !healthy)?;
    Some(faulty)
}

/// Returns the text about the self-test of the first sensor in `tested`, and the bits of that sensor.
pub fn tested(tested: u32, passes: bool) -> Option<(&'static str, u32)> {
    let (bits, [_, failed, passed]) = first(tested)?;
    Some((if passes { passed } else { failed }, bits))
}

fn first(bits: u32) -> Option<(u32, [&'static str; 3])> {
    SENSORS.into_iter().find(|(sensor, _)| bits & sensor != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each sensor has texts, and each text fits into STATUSTEXT.
    #[test]
    fn each_sensor_is_named() {
        let aux = |present, healthy| AuxSensors { sensors: SensorBits { present, healthy }, ..AuxSensors::default() };
        let all = SENSORS.iter().fold(0, |all, (bits, _)| all | bits);
        assert_eq!(all, super::super::health::NEEDED, "those without which it does not start");
        assert_eq!(faulty(&aux(all, all)), None);
        assert_eq!(faulty(&aux(0, 0)), None);
        // The guidance, not this module, checks the barometer.
        assert_eq!(faulty(&aux(all | sensor::BAROMETER, all)), None);
        for (bits, [text, failed, passed]) in SENSORS {
            assert_eq!(faulty(&aux(all, all & !bits)), Some(text));
            assert_eq!((tested(bits, false), tested(bits, true)), (Some((failed, bits)), Some((passed, bits))));
            assert!([text, failed, passed].iter().all(|text| text.len() <= 50), "{text}");
        }
        assert_eq!(tested(sensor::BAROMETER, false), None);
    }
}
