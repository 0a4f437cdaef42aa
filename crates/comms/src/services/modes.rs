//! Flight modes in MAVLink: PX4's custom modes and the standard modes.

use afbc_guidance::FlightMode;
use afbc_mavlink::{AvailableMode, CurrentMode};

/// Returns a `custom_mode`: main mode in bits 16 to 23, sub mode in bits 24 to 31.
const fn custom_of(main: u8, sub: u8) -> u32 {
    u32::from_le_bytes([0, 0, main, sub])
}

/// PX4's main mode "auto".
const AUTO: u8 = 4;

/// Returns the `custom_mode` of a flight mode, for HEARTBEAT.
pub const fn custom(mode: FlightMode) -> u32 {
    match mode {
        FlightMode::Altitude => custom_of(2, 0),
        FlightMode::Position => custom_of(3, 0),
        FlightMode::Takeoff => custom_of(AUTO, 2),
        FlightMode::Hold => custom_of(AUTO, 3),
        FlightMode::Mission => custom_of(AUTO, 4),
        FlightMode::Return => custom_of(AUTO, 5),
        FlightMode::Land => custom_of(AUTO, 6),
        FlightMode::Acro => custom_of(5, 0),
        FlightMode::Offboard => custom_of(6, 0),
        FlightMode::Stabilised => custom_of(7, 0),
    }
}

/// Returns the flight mode with this `custom_mode`.
pub fn of_custom(custom_mode: u32) -> Option<FlightMode> {
    FlightMode::ALL.into_iter().find(|mode| custom(*mode) == custom_mode)
}

/// Returns the `MAV_STANDARD_MODE` of a flight mode, 0 for a non-standard mode.
pub const fn standard(mode: FlightMode) -> u8 {
    match mode {
        FlightMode::Position => 1,
        FlightMode::Altitude => 4,
        FlightMode::Return => 5,
        FlightMode::Mission => 6,
        FlightMode::Land => 7,
        FlightMode::Takeoff => 8,
        FlightMode::Hold | FlightMode::Offboard | FlightMode::Stabilised | FlightMode::Acro => 0,
    }
}

/// Returns the flight mode with this `MAV_STANDARD_MODE`.
pub fn of_standard(standard_mode: u8) -> Option<FlightMode> {
    FlightMode::ALL.into_iter().find(|mode| standard_mode != 0 && standard(*mode) == standard_mode)
}

/// `MAV_MODE_PROPERTY_AUTO_MODE`: the vehicle flies by itself.
const AUTOMATIC: u32 = 4;
/// `MAV_MODE_PROPERTY_ADVANCED`: the mode is not for beginners.
const ADVANCED: u32 = 1;

/// Number of flight modes.
pub const COUNT: u8 = FlightMode::ALL.len() as u8;

/// Returns AVAILABLE_MODES for the mode with this index, counted from 1.
pub fn available(place: u8) -> Option<AvailableMode> {
    let mode = *FlightMode::ALL.get(usize::from(place.checked_sub(1)?))?;
    let properties = match mode {
        FlightMode::Offboard => AUTOMATIC | ADVANCED,
        FlightMode::Acro => ADVANCED,
        _ if mode.is_manual() => 0,
        _ => AUTOMATIC,
    };
    let mut name = [0; 35];
    name.iter_mut().zip(mode.name().bytes()).for_each(|(to, from)| *to = from);
    Some(AvailableMode { count: COUNT, index: place, standard: standard(mode), custom: custom(mode), properties, name })
}

/// Bit of a request's index that requests all following modes too.
const ALL: u32 = 1 << 31;

/// Returns the index of a request for this mode and all following ones.
pub(crate) fn all_from(place: u8) -> u32 {
    ALL | u32::from(place)
}

/// Returns the mode that a request's index stands for, and true if all following modes are requested too. 0 requests
/// all.
pub(crate) fn place(index: u32) -> (u8, bool) {
    let place = u8::try_from(index & !ALL).unwrap_or(0);
    if index == 0 { (1, true) } else { (place, index & ALL != 0) }
}

/// Returns CURRENT_MODE.
pub fn current(mode: FlightMode, intended: FlightMode) -> CurrentMode {
    CurrentMode { standard: standard(mode), custom: custom(mode), intended: custom(intended) }
}

#[cfg(test)]
#[allow(clippy::expect_used, reason = "a test that cannot go on should say why")]
mod tests {
    use super::*;

    /// The custom modes are PX4's, as MAVSDK and QGroundControl read them.
    #[test]
    fn custom_modes_are_px4s() {
        let expected = [
            (FlightMode::Hold, 0x0304_0000),
            (FlightMode::Takeoff, 0x0204_0000),
            (FlightMode::Mission, 0x0404_0000),
            (FlightMode::Return, 0x0504_0000),
            (FlightMode::Land, 0x0604_0000),
            (FlightMode::Offboard, 0x0006_0000),
            (FlightMode::Position, 0x0003_0000),
            (FlightMode::Altitude, 0x0002_0000),
            (FlightMode::Stabilised, 0x0007_0000),
            (FlightMode::Acro, 0x0005_0000),
        ];
        assert_eq!(expected.len(), FlightMode::ALL.len());
        for (mode, number) in expected {
            assert_eq!((custom(mode), of_custom(number)), (number, Some(mode)));
        }
        assert_eq!([of_custom(0), of_custom(0x0004_0000), of_custom(u32::MAX)], [None; 3]);
    }

    #[test]
    fn every_mode_is_offered_once() {
        let offered = (0..=u8::MAX).filter_map(available).collect::<heapless::Vec<_, 16>>();
        assert_eq!(offered.len(), FlightMode::ALL.len());
        for (mode, place) in FlightMode::ALL.into_iter().zip(1..) {
            let reported = offered.iter().find(|reported| reported.custom == custom(mode));
            assert_eq!(
                reported.map(|reported| (reported.index, reported.count, reported.standard)),
                Some((place, COUNT, standard(mode)))
            );
            assert!(standard(mode) == 0 || of_standard(standard(mode)) == Some(mode));
        }
        assert_eq!(of_standard(0), None);
    }

    /// `MAV_MODE_PROPERTY`: Acro and Offboard are advanced, other manual modes have no property, and the rest are
    /// automatic, as is Offboard.
    #[test]
    fn properties_and_names_are_the_modes() {
        for (mode, place) in FlightMode::ALL.into_iter().zip(1..) {
            let reported = available(place).expect("offered");
            let properties = match mode {
                FlightMode::Position | FlightMode::Altitude | FlightMode::Stabilised => 0,
                FlightMode::Offboard => 5,
                FlightMode::Acro => 1,
                _ => 4,
            };
            assert_eq!((reported.index, reported.properties), (place, properties), "{mode:?}");
            let end = reported.name.iter().position(|byte| *byte == 0).expect("short");
            assert_eq!(core::str::from_utf8(reported.name.get(..end).expect("within")), Ok(mode.name()));
            let now = current(mode, FlightMode::Hold);
            assert_eq!((now.standard, now.custom, now.intended), (standard(mode), custom(mode), 0x0304_0000));
        }
        for (mode, number) in [
            (FlightMode::Position, 1),
            (FlightMode::Altitude, 4),
            (FlightMode::Return, 5),
            (FlightMode::Mission, 6),
            (FlightMode::Land, 7),
            (FlightMode::Takeoff, 8),
        ] {
            assert_eq!((standard(mode), of_standard(number)), (number, Some(mode)));
        }
        assert_eq!([2, 3, 9, 255].map(of_standard), [None; 4]);
    }

    /// 0 requests all modes, any other number one mode. With the top bit set, all following modes are requested too.
    #[test]
    fn an_index_asks_for_one_mode_or_for_all_that_follow() {
        assert_eq!(place(0), (1, true));
        for number in 1..=u8::MAX {
            assert_eq!(place(number.into()), (number, false));
            assert_eq!(all_from(number), 0x8000_0000 + u32::from(number));
            assert_eq!(place(all_from(number)), (number, true));
        }
        assert_eq!(place(256), (0, false));
        assert_eq!(available(0), None);
    }
}
