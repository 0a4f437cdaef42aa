//! Tests that a reply's head and the sensors' readings are read as they were written.
#![allow(missing_docs, clippy::unwrap_used)]

use afbc_estimator::Measurement;
use afbc_onboard::{AIDS_MAX, Aged, Readings, ReplyHead};
use nalgebra::Vector3;
use proptest::prelude::*;

proptest! {
    #[test]
    fn heads_cross(time_us: u64, cycles: u32, stack_bytes: u32, length: u32, throttles: [u16; 8]) {
        let head = ReplyHead { time_us, cycles, stack_bytes, length, throttles };
        prop_assert_eq!(ReplyHead::from_bytes(&head.to_bytes()), head);
    }
}

/// The bytes have the order that another program expects.
#[test]
fn fields_are_little_endian_and_in_order() {
    let throttles = [0x0102, 0, 0, 0, 0, 0, 0, 0x0304];
    let head = ReplyHead { time_us: 0x0807_0605_0403_0201, cycles: 9, stack_bytes: 10, length: 0x0100, throttles };
    let bytes = head.to_bytes();
    assert_eq!(bytes[..20], [1, 2, 3, 4, 5, 6, 7, 8, 9, 0, 0, 0, 10, 0, 0, 0, 0, 1, 0, 0]);
    assert_eq!((&bytes[20..22], &bytes[34..]), (&[2, 1][..], &[4, 3][..]));
}

fn number() -> impl Strategy<Value = f32> {
    // The number may have any bits, including numbers that no sensor gives.
    any::<f32>().prop_filter("a NaN equals nothing", |x| !x.is_nan())
}

fn vector() -> impl Strategy<Value = Vector3<f32>> {
    [number(), number(), number()].prop_map(Vector3::from)
}

fn aid() -> impl Strategy<Value = Measurement> {
    let four = || [number(), number(), number(), number()];
    prop_oneof![
        (vector(), four(), number(), number()).prop_map(
            |(position_m, attitude, position_sigma_m, attitude_sigma_rad)| {
                Measurement::Pose { position_m, attitude, position_sigma_m, attitude_sigma_rad }
            }
        ),
        (vector(), number()).prop_map(|(position_m, sigma_m)| Measurement::Position { position_m, sigma_m }),
        (vector(), vector(), four()).prop_map(|(position_m, velocity_m_s, sigmas)| {
            let [horizontal_sigma_m, vertical_sigma_m, speed_sigma_m_s, climb_sigma_m_s] = sigmas;
            Measurement::Gnss {
                position_m,
                velocity_m_s,
                horizontal_sigma_m,
                vertical_sigma_m,
                speed_sigma_m_s,
                climb_sigma_m_s,
            }
        }),
        (number(), number()).prop_map(|(height_m, sigma_m)| Measurement::Height { height_m, sigma_m }),
        (vector(), number()).prop_map(|(field, sigma)| Measurement::MagneticField { field, sigma }),
        (number(), number()).prop_map(|(heading_rad, sigma_rad)| Measurement::Heading { heading_rad, sigma_rad }),
    ]
}

proptest! {
    #[test]
    fn readings_cross(
        imu in prop::option::of(([vector(), vector()], any::<u32>())),
        aids in prop::collection::vec((aid(), any::<u32>()), 0..=AIDS_MAX),
    ) {
        let mut readings = Readings::NONE;
        readings.imu = imu.map(|(value, age_us)| Aged { value, age_us });
        for (slot, (value, age_us)) in readings.aids.iter_mut().zip(aids) {
            *slot = Some(Aged { value, age_us });
        }
        prop_assert_eq!(Readings::from_bytes(&readings.to_bytes()), readings);
    }

    #[test]
    fn any_bytes_are_readings(bytes in prop::collection::vec(any::<u8>(), Readings::LEN)) {
        let bytes: [u8; Readings::LEN] = bytes.try_into().unwrap();
        let readings = Readings::from_bytes(&bytes);
        let present = readings.aids.map(|aid| aid.is_some());
        prop_assert!(present.is_sorted_by_key(|present| !present), "a gap: {present:?}");
        // Measurements that were understood are written again with the same bits, even NaN.
        let again = readings.to_bytes();
        prop_assert_eq!(Readings::from_bytes(&again).to_bytes(), again);
    }
}
