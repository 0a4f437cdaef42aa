//! CRSF telemetry for the pilot's transmitter: battery, attitude, mode and position in turn. A frame has address,
//! length, type, big-endian numbers and a checksum.

use crate::common::Bench;
use afbc_comms::services::origin::EarthOrigin;
use afbc_comms::services::status::GnssReceiver;
use afbc_comms::{AuxSensors, RadioControl};
use afbc_mavlink::telemetry::BatteryStatus;
use afbc_types::State;
use nalgebra::Vector3;

/// CRC-8 with polynomial 0xD5.
fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |crc, byte| {
        (0..8).fold(crc ^ byte, |crc: u8, _| if crc & 0x80 == 0 { crc << 1 } else { crc << 1 ^ 0xD5 })
    })
}

/// Returns the type and the payload of a frame.
fn parts(frame: &[u8]) -> (u8, Vec<u8>) {
    assert_eq!(usize::from(frame[1]) + 2, frame.len());
    assert_eq!(checksum(&frame[2..frame.len() - 1]), frame[frame.len() - 1]);
    (frame[2], frame[3..frame.len() - 1].to_vec())
}

fn number(bytes: &[u8]) -> i64 {
    bytes.iter().fold(0, |number, byte| number << 8 | i64::from(*byte))
}

#[test]
fn the_transmitter_is_told_in_turn() {
    let mut bench = Bench::new();
    let battery =
        BatteryStatus { voltage_mv: 15_400, current_ca: 1_230, remaining_percent: -1, consumed_mah: 456, charge: 0 };
    bench.comms.set_aux_sensors(AuxSensors { battery: Some(battery), ..AuxSensors::default() });
    let state = State { attitude_rad: Vector3::new(0.1, -0.2, 0.3), ..State::default() };
    let (mut radio, mut told) = (RadioControl::default(), Vec::new());
    for tick in 1..=2_000_u64 {
        bench.tick(&state);
        if let Some(frame) = bench.comms.radio_telemetry(&mut radio) {
            told.push((tick, parts(&frame)));
        }
        // A second call in the same tick returns nothing.
        assert_eq!(bench.comms.radio_telemetry(&mut radio), None);
    }
    let of = |kind| told.iter().filter(move |(_, (it, _))| *it == kind).collect::<Vec<_>>();
    let (batteries, attitudes, modes) = (of(0x08), of(0x1E), of(0x21));
    // Each of the four kinds is due five times in two seconds. Without an origin there is no position.
    assert_eq!((batteries.len(), attitudes.len(), modes.len(), told.len()), (5, 5, 5, 15), "{told:?}");
    for kind in [&batteries, &attitudes, &modes] {
        assert!(kind.windows(2).all(|two| two[1].0 - two[0].0 == 400), "{told:?}");
    }
    for (_, (_, numbers)) in batteries {
        assert_eq!((number(&numbers[..2]), number(&numbers[2..4]), number(&numbers[4..7])), (154, 123, 456));
    }
    // CRSF sends pitch, roll and yaw in 1e-4 rad.
    for (_, (_, numbers)) in attitudes.iter().skip(1) {
        let angles = numbers.chunks_exact(2).map(|two| i16::from_be_bytes([two[0], two[1]])).collect::<Vec<_>>();
        for (angle, expected) in angles.iter().zip([2000, 1000, -3000]) {
            assert!((angle - expected).abs() <= 1, "{angles:?}");
        }
    }
    assert!(modes.iter().all(|(_, (_, name))| name.ends_with(&[0]) && name.len() > 3));
}

/// Position, ground speed, course, altitude and satellites are sent in the protocol's units once they are known.
#[test]
fn the_transmitter_is_told_the_place() {
    let mut bench = Bench::new();
    let origin = EarthOrigin::new(EarthOrigin::SIMULATED).expect("possible");
    let receiver = GnssReceiver { kind: GnssReceiver::FIX_3D, satellites: 17, sigma_mm: [0; 2] };
    bench.comms.set_aux_sensors(AuxSensors { origin: Some(origin), receiver: Some(receiver), ..AuxSensors::default() });
    // The velocity is 3 m/s north and 4 m/s east.
    let velocity_m_s = Vector3::new(3.0, -4.0, 1.0);
    let state = State { position_m: Vector3::new(0.0, 0.0, 12.0), velocity_m_s, ..State::default() };
    let mut radio = RadioControl::default();
    let mut told = Vec::new();
    for _ in 0..1_000 {
        bench.tick(&state);
        told.extend(bench.comms.radio_telemetry(&mut radio).map(|frame| parts(&frame)));
    }
    let places: Vec<_> = told.iter().filter(|(kind, _)| *kind == 0x02).collect();
    assert!(places.len() >= 2, "{told:?}");
    for (_, numbers) in places {
        assert_eq!(numbers.len(), 15);
        let [latitude, longitude] = [&numbers[..4], &numbers[4..8]].map(number);
        assert!((latitude - 473_977_420).abs() <= 2 && (longitude - 85_455_940).abs() <= 2, "{latitude} {longitude}");
        // The numbers are the speed in 0.1 km/h, the course in 0.01 degrees, and the altitude in metres plus 1000.
        let [speed, course, height] = [&numbers[8..10], &numbers[10..12], &numbers[12..14]].map(number);
        assert!((speed - 180).abs() <= 1 && (course - 5_313).abs() <= 1, "{speed} {course}");
        assert_eq!((height, numbers[14]), (1_500, 17));
    }
}
