//! Every transition of the mode, and every reason against arming.

use airframe::{Setpoint, State};
use nalgebra::Vector3;
use vehicle::supervisor::{DESCEND_US, GIVE_UP_US, Observed, RIDE_US};
use vehicle::{ArmingLimits, Mode, Refusal, Request};

const MODES: [Mode; 4] = [Mode::Disarmed, Mode::Flying, Mode::Riding, Mode::Descending];

/// Ages on both sides of each limit.
const AGES_US: [u64; 8] = [0, RIDE_US, RIDE_US + 1, DESCEND_US, DESCEND_US + 1, GIVE_UP_US, GIVE_UP_US + 1, u64::MAX];

#[test]
fn disarmed_at_power_up() {
    assert_eq!(Mode::default(), Mode::Disarmed);
    assert!(!Mode::default().armed());
}

/// What follows in flight from the age of the state alone, one row a mode, one column an age of `AGES_US`.
#[test]
fn in_flight_the_age_decides() {
    use Mode::{Descending as D, Disarmed as X, Flying as F, Riding as R};
    let table = [
        (Mode::Disarmed, [X, X, X, X, X, X, X, X]),
        (Mode::Flying, [F, F, R, R, D, D, X, X]),
        (Mode::Riding, [F, F, R, R, D, D, X, X]),
        (Mode::Descending, [D, D, D, D, D, D, X, X]),
    ];
    for (mode, row) in table {
        for (state_age_us, expected) in AGES_US.into_iter().zip(row) {
            for (request, ready) in [(None, Ok(())), (None, Err(Refusal::TiltTooLarge))] {
                let observed = Observed { request, ready, state_age_us, landed: false };
                assert_eq!(mode.next(&observed), expected, "{mode:?}, {observed:?}");
            }
        }
    }
}

#[test]
fn disarming_stops_the_motors_whatever_else_is_true() {
    for mode in MODES {
        for state_age_us in AGES_US {
            for landed in [false, true] {
                for ready in [Ok(()), Err(Refusal::Unhealthy)] {
                    let request = Some(Request::Disarm);
                    assert_eq!(mode.next(&Observed { request, ready, state_age_us, landed }), Mode::Disarmed);
                    assert_eq!(mode.answer(Request::Disarm, ready), Ok(Request::Disarm));
                }
            }
        }
    }
}

#[test]
fn arming_needs_readiness_and_changes_nothing_in_flight() {
    for mode in MODES {
        for ready in [Ok(()), Err(Refusal::SetpointTooFar)] {
            let observed = Observed { request: Some(Request::Arm), ready, state_age_us: 0, landed: false };
            let expected = match (mode, ready) {
                (Mode::Disarmed, Ok(())) => Mode::Flying,
                _ => mode.next(&Observed { request: None, ..observed }),
            };
            assert_eq!(mode.next(&observed), expected, "{mode:?}, {ready:?}");
            let answer = if mode.armed() { Err(Refusal::AlreadyArmed) } else { ready.map(|()| Request::Arm) };
            assert_eq!(mode.answer(Request::Arm, ready), answer, "{mode:?}, {ready:?}");
        }
    }
}

#[test]
fn landing_ends_a_descent_and_nothing_else() {
    for mode in MODES {
        let observed = Observed { request: None, ready: Ok(()), state_age_us: 0, landed: true };
        let expected = match mode {
            Mode::Descending => Mode::Disarmed,
            _ => mode.next(&Observed { landed: false, ..observed }),
        };
        assert_eq!(mode.next(&observed), expected, "{mode:?}");
    }
}

#[test]
fn readiness_names_the_first_reason_against_it() {
    let limits = ArmingLimits { tilt_max_rad: 0.2, setpoint_distance_max_m: 2.0 };
    let at = |x, y, z| Some(Setpoint { position_m: Vector3::new(x, y, z), ..Setpoint::default() });
    let tilted = |roll, pitch, yaw| Some(State { attitude_rad: Vector3::new(roll, pitch, yaw), ..State::default() });
    let level = tilted(0.0, 0.0, 3.0);
    let cases = [
        (level, at(0.0, 0.0, 0.0), true, Ok(())),
        (tilted(0.2, -0.2, 3.0), at(0.0, 0.0, 2.0), true, Ok(())),
        (None, at(0.0, 0.0, 0.0), true, Err(Refusal::StateStale)),
        (None, None, false, Err(Refusal::StateStale)),
        (tilted(0.21, 0.0, 0.0), None, false, Err(Refusal::TiltTooLarge)),
        (tilted(0.0, -0.21, 0.0), at(0.0, 0.0, 0.0), true, Err(Refusal::TiltTooLarge)),
        (level, None, false, Err(Refusal::SetpointMissing)),
        (level, at(0.0, 0.0, -2.01), false, Err(Refusal::SetpointTooFar)),
        (level, at(1.5, 1.5, 0.0), true, Err(Refusal::SetpointTooFar)),
        (level, at(1.0, 1.0, 1.0), false, Err(Refusal::Unhealthy)),
    ];
    for (state, setpoint, healthy, expected) in cases {
        assert_eq!(limits.ready(state.as_ref(), setpoint.as_ref(), healthy), expected, "{state:?}, {setpoint:?}");
    }
}

#[test]
fn every_refusal_has_a_number_of_its_own_and_fits_a_status_text() {
    for (index, refusal) in Refusal::ALL.into_iter().enumerate() {
        assert_eq!(refusal as usize, index + 1);
        assert!(refusal.reason().len() <= 50);
    }
}

#[test]
fn limits_are_validated_by_name() {
    assert_eq!(ArmingLimits::default().validate(), Ok(()));
    for (tilt_max_rad, setpoint_distance_max_m, name) in [
        (0.9, 2.0, "tilt_max_rad"),
        (f32::NAN, 2.0, "tilt_max_rad"),
        (0.2, 0.0, "setpoint_distance_max_m"),
        (0.2, f32::INFINITY, "setpoint_distance_max_m"),
    ] {
        let refused = ArmingLimits { tilt_max_rad, setpoint_distance_max_m }.validate();
        assert_eq!(refused.map_err(|error| error.range.name), Err(name));
    }
}
