//! Compares channel scaling with its description in whole microseconds, at and next to every bound.
#![allow(clippy::indexing_slicing, reason = "tests")]

extern crate std;
use super::*;
use crate::switches::is_on;
use afbc_types::Declared;
use proptest::prelude::*;
use std::vec;

fn calibration() -> impl Strategy<Value = ChannelCalibration> {
    let numbers = [0..8_u16, 0..8_u16, 0..8_u16, 0..11_u16].prop_map(|numbers| numbers.map(|n| f32::from(100 * n)));
    (numbers, prop::sample::select(vec![-1.0_f32, -0.5, 0.0, 0.5, 1.0])).prop_map(
        |([min, trim, max, dead], direction)| ChannelCalibration {
            min_us: 800.0 + min.min(700.0),
            trim_us: 1_100.0 + trim,
            max_us: 1_500.0 + max,
            dead_band_us: 0.1 * dead,
            direction,
        },
    )
}

/// Returns pulses on the bounds, next to them and anywhere between.
fn pulse() -> impl Strategy<Value = u16> {
    (0..15_u16, prop_oneof![Just(0), Just(1), 0..100_u16]).prop_map(|(hundreds, more)| 800 + 100 * hundreds + more)
}

/// Returns the share of the travel beyond the dead band, from the trim to either end, in the channel's direction.
fn described(channel: &ChannelCalibration, us: u16, trim_us: f64) -> f64 {
    let [min_us, max_us, dead_us] = [channel.min_us, channel.max_us, channel.dead_band_us].map(f64::from);
    let off_us = f64::from(us) - trim_us;
    let room_us = if off_us > 0.0 { max_us - trim_us } else { trim_us - min_us } - dead_us;
    let way = off_us.signum() * f64::from(channel.direction.signum());
    if off_us.abs() <= dead_us || room_us <= 0.0 { 0.0 } else { way * ((off_us.abs() - dead_us) / room_us).min(1.0) }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_stick_is_a_share_of_its_way(channel in calibration(), us in pulse()) {
        prop_assume!(channel.validate().is_ok());
        let [stick, switch] = [channel.stick(us), channel.centred(us)].map(f64::from);
        prop_assert!((stick - described(&channel, us, channel.trim_us.into())).abs() < 1e-6, "{stick}");
        let middle_us = 0.5 * (f64::from(channel.min_us) + f64::from(channel.max_us));
        prop_assert!((switch - described(&channel, us, middle_us)).abs() < 1e-6, "{switch}");
    }

    /// A switch is on above its threshold, or below a negative one; exactly at the threshold it is off.
    #[test]
    fn a_switch_is_on_beyond_its_share(number in 0..=20_u32, us in pulse(), tenths in -4..=4_i8) {
        let settings = RadioSettings::DEFAULT;
        let mut channels = Channels { us: [1_500; crate::CHANNELS] };
        channels.us[4] = us;
        channels.us[17] = 0;
        let share = 0.25 * f32::from(tenths);
        let found = is_on(&settings, &channels, number, share);
        if number == 0 || number > 17 {
            prop_assert_eq!(found, None);
            return Ok(());
        }
        let us = if number == 5 { us } else { 1_500 };
        // With the default calibration, the switch's position is one half at 1500 us, with a dead band of 10 us on
        // either side.
        let way = 0.5 + 0.5 * described(&ChannelCalibration::DEFAULT, us, 1_500.0);
        let beyond = if share < 0.0 { f64::from(-share) - way } else { way - f64::from(share) };
        prop_assume!(beyond == 0.0 || beyond.abs() > 1e-6);
        prop_assert_eq!(found, Some(beyond > 0.0));
    }

    /// The link is lost by a pulse beyond a threshold that the sticks cannot reach.
    #[test]
    fn a_threshold_beyond_the_way_tells_a_lost_link(
        channel in calibration(),
        us in pulse(),
        threshold in prop_oneof![Just(0), pulse(), 1..900_u16],
        failsafe in prop::sample::select(vec![0_u32, 3, 7, 18]),
    ) {
        let functions =
            RadioFunctions { failsafe, failsafe_us: threshold.into(), ..RadioFunctions::DEFAULT };
        let settings = RadioSettings { functions, channel_3: channel, ..RadioSettings::DEFAULT };
        let mut channels = Channels { us: [1_500; crate::CHANNELS] };
        let by_throttle = matches!(failsafe, 0 | 3);
        channels.us[if by_throttle { 2 } else { 6 }] = us;
        channels.us[17] = 0;
        let way = if by_throttle { channel } else { ChannelCalibration::DEFAULT };
        let (threshold, pulse) = (f32::from(threshold), f32::from(us));
        let below = threshold < way.min_us && pulse < threshold;
        let above = threshold > way.max_us && pulse > threshold;
        let lost = failsafe != 18 && threshold > 0.0 && (below || above);
        prop_assert_eq!(settings.has_failed(&channels), lost);
    }
}

/// Six equal parts of the travel select the six modes in order.
#[test]
fn six_positions_have_six_modes() {
    let modes = SwitchModes { first: 0, second: 1, third: 2, fourth: 3, fifth: 4, sixth: 5, ..SwitchModes::DEFAULT };
    for step in 0..=600_i16 {
        let wanted = mode_of((u32::from(step.unsigned_abs()) / 100).min(5));
        // Tests between whole hundredths, so that rounding alone cannot reach the end of a position.
        let stick = (f32::from(step) + if step < 600 { 0.5 } else { 0.0 }) / 300.0 - 1.0;
        assert_eq!(modes.mode(stick), wanted, "{step}");
    }
    assert_eq!((modes.mode(-1.0), modes.mode(1.0)), (mode_of(0), mode_of(5)));
}

#[test]
fn modes_have_px4s_numbers() {
    use FlightMode::{Acro, Altitude, Hold, Land, Mission, Offboard, Position, Return, Stabilised, Takeoff};
    let modes = [Some(Stabilised), Some(Altitude), Some(Position), Some(Mission), Some(Hold), Some(Return), Some(Acro)];
    let more = [Some(Offboard), Some(Stabilised), None, Some(Takeoff), Some(Land), None];
    assert!((0..).map(mode_of).zip(modes.into_iter().chain(more)).all(|(found, wanted)| found == wanted));
}
