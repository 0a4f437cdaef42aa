//! Reading of a command's seven parameters, as numbered in MAVLink's common dialect. No parameter that requests
//! something is silently ignored. A test of the same name in `afbc-comms` checks what the vehicle does.

use crate::wire::{raw, read, theirs};
use afbc_mavlink::{Datum, GlobalPosition, Height, Storage, Uplink, VehicleCommand};
use mavlink::dialects::common::SET_HOME_POSITION_DATA;
use proptest::prelude::*;

const NAN: f32 = f32::NAN;

/// Returns the command read from a COMMAND_LONG (76): seven numbers, command and receiver.
fn long(id: u16, parameters: [f32; 7]) -> VehicleCommand {
    let mut payload = [0; 33];
    for (bytes, number) in payload.chunks_exact_mut(4).zip(parameters) {
        bytes.copy_from_slice(&number.to_le_bytes());
    }
    payload[28..30].copy_from_slice(&id.to_le_bytes());
    match read(&raw(76, &payload, 152)) {
        Ok(Uplink::Command(command)) => command,
        other => panic!("{other:?}"),
    }
}

/// Returns the command with these first two numbers; the others are 0.
fn two(id: u16, first: f32, second: f32) -> VehicleCommand {
    long(id, [first, second, 0.0, 0.0, 0.0, 0.0, 0.0])
}

/// Returns commands with valid numbers, and the indices of the numbers that they use.
fn valid() -> Vec<([f32; 7], VehicleCommand, &'static [usize])> {
    let place = GlobalPosition { latitude_e7: 470_000_000, longitude_e7: 80_000_000, height: at(500.0, Datum::Sea) };
    let (here, none): (_, &[usize]) = ([47.0, 8.0, 500.0], &[]);
    let moved = VehicleCommand::Reposition { place, yaw_rad: -0.5, speed_m_s: Some(3.0), changes_mode: true };
    vec![
        (first([0.0; 4]), VehicleCommand::Return, none),
        (first([0.0; 4]), VehicleCommand::Land, none),
        (first([0.0; 4]), VehicleCommand::CheckArming, none),
        (first([0.0; 4]), VehicleCommand::StopLogStream, none),
        (first([0.0; 4]), VehicleCommand::StartLogStream, &[0]),
        (first([3.0, 0.0, 0.0, 0.0]), VehicleCommand::SelectStandardMode(3), &[0]),
        (first([30.0, 0.0, 0.0, 0.0]), VehicleCommand::GetInterval(30), &[0]),
        (first([1.0, 0.0, 0.0, 0.0]), VehicleCommand::RequestProtocol, &[0]),
        (first([1.0, 0.0, 0.0, 0.0]), VehicleCommand::RequestCapabilities, &[0]),
        (first([30.0, 5e4, 0.0, 0.0]), VehicleCommand::SetInterval { message: 30, interval_us: 50_000 }, &[0, 1, 6]),
        (first([242.0, 7.0, 0.0, 0.0]), VehicleCommand::RequestMessage { message: 242, index: 7 }, &[0, 1, 6]),
        (first([2.0, 5.0, 0.0, 0.0]), VehicleCommand::StartMission(2, Some(5)), &[0, 1]),
        (first([4.0, 1.0, 0.0, 0.0]), VehicleCommand::SetCurrent(Some(4), true), &[0, 1]),
        (first([1.0, 0.0, 0.0, 0.0]), VehicleCommand::Storage(Storage::Save), &[0, 1]),
        (first([1.0, 6.0, -1.0, 0.0]), VehicleCommand::Speed(6.0), &[0, 1, 2]),
        (first([1.0, 0.0, 0.0, 0.0]), VehicleCommand::Home(None), &[0]),
        ([0.0, 0.0, 0.0, 0.0, here[0], here[1], here[2]], VehicleCommand::Home(Some(place)), &[0, 4, 5, 6]),
        ([3.0, 1.0, 0.0, 0.5, here[0], here[1], here[2]], moved, &[0, 1, 3, 4, 5, 6]),
        ([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 7.0], VehicleCommand::TakeOff(at(7.0, Datum::Here)), &[0, 6]),
    ]
}

fn at(metres: f32, above: Datum) -> Height {
    Height { metres, above }
}

fn first([a, b, c, d]: [f32; 4]) -> [f32; 7] {
    [a, b, c, d, 0.0, 0.0, 0.0]
}

/// Every number that a command does not use may be 0 or NaN; any other value denies the command.
#[test]
fn no_number_is_ignored_in_silence() {
    for (parameters, expected, used) in valid() {
        let id = expected.id();
        assert_eq!(long(id, parameters), expected);
        for place in (0..7).filter(|place| !used.contains(place)) {
            for (value, is_neutral) in [(0.0, true), (-0.0, true), (NAN, true), (1.0, false), (-1.0, false)] {
                let mut changed = parameters;
                changed[place] = value;
                let read = long(id, changed);
                assert_eq!(read, if is_neutral { expected } else { VehicleCommand::Denied(id) }, "{place}: {value}");
            }
        }
    }
}

#[test]
fn numbers_that_are_none_of_a_commands_deny_it() {
    // (command, pairs of first and second number)
    for (id, numbers) in [
        (262, vec![(-1.0, 0.0), (256.0, 0.0), (0.5, 0.0), (NAN, 0.0)]),
        (510, vec![(-1.0, 0.0), (0.5, 0.0), (16_777_217.5, 0.0), (NAN, 0.0)]),
        (519, vec![(0.0, 0.0), (2.0, 0.0), (NAN, 0.0)]),
        (520, vec![(0.0, 0.0), (2.0, 0.0), (NAN, 0.0)]),
        (511, vec![(-1.0, 0.0), (0.5, 0.0), (30.0, 3e9), (30.0, -3e9), (NAN, 0.0)]),
        (512, vec![(-1.0, 0.0), (30.0, -1.0), (30.0, 0.5)]),
        (300, vec![(3.0, 2.0), (-1.0, 0.0), (0.5, 0.0), (0.0, 65_536.0)]),
        (224, vec![(-2.0, 0.0), (65_536.0, 0.0), (0.5, 0.0), (1.0, 2.0), (1.0, -1.0), (NAN, 0.0)]),
        (245, vec![(3.0, 0.0), (-1.0, 0.0), (0.5, 0.0), (0.0, 1.0), (1.0, 2.0), (2.0, 0.5), (NAN, 0.0)]),
        (178, vec![(2.0, 5.0), (-1.0, 5.0), (0.0, -1.0), (1.0, 1.1e3), (1.0, NAN), (NAN, 5.0)]),
        (179, vec![(2.0, 0.0), (-1.0, 0.0), (0.5, 0.0), (NAN, 0.0)]),
        (2510, vec![(1.0, 0.0), (-1.0, 0.0), (NAN, 0.0)]),
        (22, vec![(1.0, 0.0), (-2.0, 0.0)]),
    ] {
        for (first, second) in numbers {
            assert_eq!(two(id, first, second), VehicleCommand::Denied(id), "{id}: {first} {second}");
        }
    }
}

#[test]
fn what_leaves_something_alone_is_read_so() {
    assert_eq!(two(224, -1.0, 0.0), VehicleCommand::SetCurrent(None, false));
    assert_eq!(two(224, 9.0, NAN), VehicleCommand::SetCurrent(Some(9), false));
    assert_eq!(two(300, NAN, NAN), VehicleCommand::StartMission(0, None));
    assert_eq!(two(300, 4.0, 4.0), VehicleCommand::StartMission(4, Some(4)));
    for plans in [0.0, -1.0, NAN] {
        assert_eq!(two(245, 0.0, plans), VehicleCommand::Storage(Storage::Load));
        assert_eq!(two(245, 2.0, plans), VehicleCommand::Storage(Storage::Reset));
    }
    // An interval of never, the default rate or a given rate; p7 selects the receiver and must be 0, 1 or 2.
    for (number, interval_us) in [(-1.0, -1), (-7.0, -1), (0.0, 0), (NAN, 0), (2e4, 20_000)] {
        assert_eq!(two(511, 30.0, number), VehicleCommand::SetInterval { message: 30, interval_us });
    }
    for (to, is_known) in [(0.0, true), (1.0, true), (2.0, true), (NAN, true), (3.0, false), (-1.0, false)] {
        for (id, known) in [
            (511, VehicleCommand::SetInterval { message: 30, interval_us: 0 }),
            (512, VehicleCommand::RequestMessage { message: 30, index: 0 }),
        ] {
            let read = long(id, [30.0, 0.0, 0.0, 0.0, 0.0, 0.0, to]);
            assert_eq!(read, if is_known { known } else { VehicleCommand::Denied(id) }, "{id} to {to}");
        }
    }
    // Airspeed or ground speed with unchanged throttle; -2 is the default speed or throttle.
    for kind in [0.0, 1.0] {
        for throttle in [0.0, -1.0, -2.0, NAN] {
            assert_eq!(long(178, first([kind, 5.0, throttle, 0.0])), VehicleCommand::Speed(5.0));
        }
        assert!(matches!(two(178, kind, -2.0), VehicleCommand::Speed(usual) if usual > 5.0));
        assert_eq!(long(178, first([kind, 5.0, 50.0, 0.0])), VehicleCommand::Denied(178));
    }
}

/// SET_HOME_POSITION (243), which old ground stations send, has millimetres above the sea.
#[test]
fn a_home_of_old_stations_is_a_place_above_the_sea() {
    let [latitude, longitude] = [470_000_000, -80_000_000];
    for altitude in [500_250, 0, -20_500] {
        let data = SET_HOME_POSITION_DATA {
            latitude,
            longitude,
            altitude,
            target_system: 1,
            ..SET_HOME_POSITION_DATA::DEFAULT
        };
        let Ok(Uplink::Command(VehicleCommand::Home(Some(place)))) = read(&theirs(&data)) else { panic!("no home") };
        assert_eq!([place.latitude_e7, place.longitude_e7], [latitude, longitude]);
        assert_eq!(place.height.above, Datum::Sea);
        assert!((f64::from(place.height.metres) - f64::from(altitude) * 1e-3).abs() < 1e-3);
    }
}

/// The angle of an orbit is rounded to whole degrees.
#[test]
fn a_circles_angle_is_rounded() {
    for (angle_deg, rounded) in [(0.0_f32, 0), (0.4, 0), (0.6, 1), (89.6, 90), (359.4, 359), (720.3, 720)] {
        let read = long(34, [10.0, 2.0, 0.0, angle_deg.to_radians(), 47.0, 8.0, 500.0]);
        let VehicleCommand::Orbit { angle_deg, .. } = read else { panic!("{read:?}") };
        assert_eq!(angle_deg, rounded);
    }
}

proptest! {
    /// Positions in COMMAND_LONG are given in degrees; they are converted within 1e-7 degrees.
    #[test]
    fn degrees_become_whole_numbers(latitude in -89.0..89.0_f32, longitude in -179.0..179.0_f32) {
        let read = long(192, [-1.0, 0.0, 0.0, NAN, latitude, longitude, 500.0]);
        let VehicleCommand::Reposition { place, yaw_rad, speed_m_s, changes_mode } = read else { panic!("{read:?}") };
        prop_assert!((f64::from(latitude) * 1e7 - f64::from(place.latitude_e7)).abs() <= 1.0);
        prop_assert!((f64::from(longitude) * 1e7 - f64::from(place.longitude_e7)).abs() <= 1.0);
        prop_assert!(yaw_rad.is_nan() && speed_m_s.is_none() && !changes_mode);
    }
}
