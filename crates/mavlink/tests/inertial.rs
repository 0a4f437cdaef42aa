//! HIGHRES_IMU, compared with the `mavlink` crate's own decoding.

use afbc_mavlink::{Address, Decoder, Downlink, Encoder, FRAME_MAX, InertialSample};
use mavlink::dialects::common::HIGHRES_IMU_DATA;
use mavlink::{MavlinkVersion, MessageData};
use nalgebra::Vector3;
use proptest::prelude::*;

const VEHICLE: Address = Address { system: 1, component: 1 };
const STATION: Address = Address { system: 255, component: 190 };

fn sample(field_ut: Option<Vector3<f32>>) -> InertialSample {
    InertialSample {
        time_us: 5_000_123,
        specific_force_m_s2: Vector3::new(0.25, -0.5, 9.75),
        rates_rad_s: Vector3::new(0.125, 0.0625, -2.0),
        field_ut,
    }
}

/// Axes are forward, right, down; the field is in gauss; only measured fields count as updated.
#[test]
fn it_is_what_others_read() {
    for (field_ut, [x, y, z], updated) in
        [(Some(Vector3::new(20.0, -5.0, -45.0)), [0.2, 0.05, 0.45], 0o777), (None, [0.0, 0.0, 0.0], 0o77)]
    {
        let mut buffer = [0; FRAME_MAX];
        let frame = Encoder::new(VEHICLE).send(&sample(field_ut), &mut buffer);
        let read = HIGHRES_IMU_DATA::deser(MavlinkVersion::V2, &frame[10..frame.len() - 2]).unwrap();
        assert_eq!(read.time_usec, 5_000_123);
        assert_eq!([read.xacc, read.yacc, read.zacc], [0.25, 0.5, -9.75]);
        assert_eq!([read.xgyro, read.ygyro, read.zgyro], [0.125, -0.0625, 2.0]);
        let field = Vector3::new(read.xmag - x, read.ymag - y, read.zmag - z);
        assert!(field.norm() < 1e-6, "{read:?}");
        assert_eq!(read.fields_updated.bits(), updated);
    }
}

/// A sample survives encoding and decoding, only by its own decoder. Samples with infinite or NaN numbers are dropped.
#[test]
fn it_is_read_again() {
    let mut buffer = [0; FRAME_MAX];
    let with_field = sample(Some(Vector3::new(32.0, -16.0, 8.0)));
    let bytes = Encoder::new(VEHICLE).send(&with_field, &mut buffer);
    let (mut own, mut others) = (Decoder::<InertialSample>::new(STATION), Decoder::<Downlink>::new(STATION));
    let mut read = Vec::new();
    own.feed(bytes, |from, sample| read.push((from, sample)));
    others.feed(bytes, |_, message| unreachable!("{message:?}"));
    assert_eq!(read.len(), 1);
    assert_eq!(read[0].0, VEHICLE);
    assert!((read[0].1.field_ut.unwrap() - with_field.field_ut.unwrap()).norm() < 1e-4);
    assert_eq!(InertialSample { field_ut: with_field.field_ut, ..read[0].1 }, with_field);
    let broken = InertialSample { rates_rad_s: Vector3::new(f32::NAN, 0.0, 0.0), ..with_field };
    let bytes = Encoder::new(VEHICLE).send(&broken, &mut buffer);
    own.feed(bytes, |_, sample| unreachable!("{sample:?}"));
    assert_eq!(own.counters().implausible, 1);
}

proptest! {
    /// Any bytes cause no panic, and give only samples of finite numbers.
    #[test]
    fn any_bytes_are_taken(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        let mut decoder = Decoder::<InertialSample>::new(STATION);
        decoder.feed(&bytes, |_, sample| assert!(sample.rates_rad_s.iter().all(|it| it.is_finite())));
    }
}
