//! Sensors that a vehicle does not start with, and their own tests.

use crate::services::health::sensor;
use crate::services::status::{AuxSensors, SensorBits};

/// Inertial sensors and magnetometer: bits, and what is told when one is faulty, has failed its own test or passed it.
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

/// Returns what is told of the first of these sensors that is there and not well; none if all are.
pub fn faulty(aux: &AuxSensors) -> Option<&'static str> {
    let SensorBits { present, healthy } = aux.sensors;
    let (_, [faulty, ..]) = first(present & !healthy)?;
    Some(faulty)
}

/// Returns what is told of the first of the sensors that are `tested`, after its own test, and its bits.
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

    /// Each sensor is named, and every text fits into STATUSTEXT.
    #[test]
    fn each_sensor_is_named() {
        let aux = |present, healthy| AuxSensors { sensors: SensorBits { present, healthy }, ..AuxSensors::default() };
        let all = SENSORS.iter().fold(0, |all, (bits, _)| all | bits);
        assert_eq!(all, super::super::health::NEEDED, "those without which it does not start");
        assert_eq!(faulty(&aux(all, all)), None);
        assert_eq!(faulty(&aux(0, 0)), None);
        // A barometer is the guidance's.
        assert_eq!(faulty(&aux(all | sensor::BAROMETER, all)), None);
        for (bits, [text, failed, passed]) in SENSORS {
            assert_eq!(faulty(&aux(all, all & !bits)), Some(text));
            assert_eq!((tested(bits, false), tested(bits, true)), (Some((failed, bits)), Some((passed, bits))));
            assert!([text, failed, passed].iter().all(|text| text.len() <= 50), "{text}");
        }
        assert_eq!(tested(sensor::BAROMETER, false), None);
    }
}
