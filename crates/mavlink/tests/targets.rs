//! Targets of a companion computer and mission items, written by the `mavlink` crate's own serialiser: which numbers a
//! type mask removes, and which numbers are refused.

use crate::wire::{read, theirs};
use afbc_mavlink::{ExternalTarget, MissionMessage, Uplink};
use mavlink::dialects::common::{
    AttitudeTargetTypemask, MISSION_ITEM_DATA, MavFrame, PositionTargetTypemask, SET_ATTITUDE_TARGET_DATA,
    SET_POSITION_TARGET_GLOBAL_INT_DATA,
};
use proptest::prelude::*;

/// Returns the target read for an attitude, yaw rate and thrust with this type mask.
fn attitude(q: [f32; 4], body_yaw_rate: f32, thrust: f32, mask: u8) -> Option<ExternalTarget> {
    let type_mask = AttitudeTargetTypemask::from_bits_retain(mask);
    let data = SET_ATTITUDE_TARGET_DATA { q, body_yaw_rate, thrust, type_mask, ..SET_ATTITUDE_TARGET_DATA::DEFAULT };
    match read(&theirs(&data)) {
        Ok(Uplink::Target(target)) => Some(target),
        _ => None,
    }
}

/// Returns the target read for a position with this type mask; velocity, acceleration and yaw are 0.
fn place(mask: u16, [lat_int, lon_int]: [i32; 2], alt: f32) -> Option<ExternalTarget> {
    let data = SET_POSITION_TARGET_GLOBAL_INT_DATA {
        lat_int,
        lon_int,
        alt,
        coordinate_frame: MavFrame::MAV_FRAME_GLOBAL,
        type_mask: PositionTargetTypemask::from_bits_retain(mask),
        ..SET_POSITION_TARGET_GLOBAL_INT_DATA::DEFAULT
    };
    match read(&theirs(&data)) {
        Ok(Uplink::Target(target)) => Some(target),
        _ => None,
    }
}

const LEVEL: [f32; 4] = [1.0, 0.0, 0.0, 0.0];
/// Type mask that ignores the rates of roll and pitch; bit 2 ignores the yaw rate.
const NO_RATES: u8 = 0b11;
const NO_YAW_RATE: u8 = 0b100;

#[test]
fn a_rate_that_is_ignored_may_be_anything() {
    for (rate, is_taken) in [(0.5, true), (-0.5, true), (1e3, true), (1.1e3, false), (f32::NAN, false)] {
        let given = attitude(LEVEL, rate, 0.5, NO_RATES);
        assert_eq!(given.is_some(), is_taken, "{rate}");
        if let Some(target) = given {
            let ExternalTarget::Attitude(target) = target else { panic!("{target:?}") };
            assert_eq!(target.yaw_rate_rad_s, -rate, "to the other side on the wire");
        }
        let ignored = attitude(LEVEL, rate, 0.5, NO_RATES | NO_YAW_RATE);
        let Some(ExternalTarget::Attitude(target)) = ignored else { panic!("{ignored:?}") };
        assert!(target.yaw_rate_rad_s.is_nan());
    }
    // A target without thrust, without attitude, or with thrust along all axes is not supported.
    for mask in [0b10_0000, 0b100_0000, 0b1000_0000] {
        assert!(attitude(LEVEL, 0.0, 0.5, NO_RATES | mask).is_none(), "{mask:b}");
    }
    for (thrust, is_taken) in [(0.0, true), (1.0, true), (-0.01, false), (1.01, false), (f32::NAN, false)] {
        assert_eq!(attitude(LEVEL, 0.0, thrust, NO_RATES).is_some(), is_taken, "{thrust}");
    }
    // A quaternion's norm may be off by a factor of two; beyond that it is refused.
    for (w, is_taken) in [(1.0, true), (0.51, true), (1.99, true), (0.49, false), (2.01, false), (f32::NAN, false)] {
        assert_eq!(attitude([w, 0.0, 0.0, 0.0], 0.0, 0.5, NO_RATES).is_some(), is_taken, "{w}");
    }
}

/// Type mask: bits 0 to 2 remove latitude, longitude and height, 3 to 8 velocity and acceleration, 10 and 11 yaw.
#[test]
fn a_mask_takes_away_what_it_says() {
    const NO_MOTION: u16 = 0b1101_1111_1000;
    for level in 0..4_u16 {
        for no_height in [false, true] {
            let mask = NO_MOTION | level | u16::from(no_height) << 2;
            let target = place(mask, [470_000_000, 80_000_000], 500.0);
            let given = |bit: u16, number: i32| if level & 1 << bit == 0 { number } else { i32::MAX };
            if level == 3 && no_height {
                assert!(target.is_none(), "a target of nothing: {target:?}");
                continue;
            }
            let Some(ExternalTarget::GlobalPosition(place, motion)) = target else { panic!("{mask:b}: {target:?}") };
            assert_eq!([place.latitude_e7, place.longitude_e7], [given(0, 470_000_000), given(1, 80_000_000)]);
            assert_eq!(place.height.metres.is_nan(), no_height);
            let rest = [motion.position_m, motion.velocity_m_s, motion.acceleration_m_s2];
            assert!(rest.iter().flatten().all(|number| number.is_nan()), "{motion:?}");
            assert!(motion.yaw_rad.is_nan() && motion.yaw_rate_rad_s.is_nan());
        }
    }
    // A used height must be a number; an ignored one may be NaN.
    assert!(place(NO_MOTION, [470_000_000, 80_000_000], f32::NAN).is_none());
    assert!(place(NO_MOTION | 4, [470_000_000, 80_000_000], f32::NAN).is_some());
}

proptest! {
    /// Old ground stations send degrees, or metres in a local frame, as floats. They are rounded to the nearest unit on
    /// both sides of zero.
    #[test]
    fn items_of_old_stations_are_rounded(x in -90.0..90.0_f32, y in -180.0..180.0_f32, seq: u16, current in 0..2_u8) {
        for (frame, units) in [(MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT, 1e7), (MavFrame::MAV_FRAME_LOCAL_NED, 1e4)] {
            let item = MISSION_ITEM_DATA { x, y, z: 12.5, seq, current, frame, ..MISSION_ITEM_DATA::DEFAULT };
            let data = MISSION_ITEM_DATA { autocontinue: 1, ..item };
            let Ok(Uplink::Mission(MissionMessage::Item(item, _))) = read(&theirs(&data)) else { panic!("no item") };
            let nearest = |number: f32| (f64::from(number) * units).round() as i32;
            prop_assert_eq!([item.x, item.y], [nearest(x), nearest(y)]);
            prop_assert_eq!((item.number, item.is_current, item.goes_on, item.z), (seq, current == 1, true, 12.5));
        }
    }
}
