//! Tests every transition of the mode, every answer, and every reason against arming.

use afbc_flight_core::supervisor::{
    ArmingInputs, COAST_US, DESCEND_US, GIVE_UP_US, REST_US, RESUME_US, STEADY_US, SupervisorInputs,
};
use afbc_flight_core::{ArmingLimits, EndReason, Mode, Reasons, Refusal, Request};
use afbc_types::{Declared, Setpoint, State};
use nalgebra::Vector3;

const MODES: [Mode; 4] = [Mode::Disarmed, Mode::Flying, Mode::Coasting, Mode::Descending];
const REQUESTS: [Option<Request>; 5] =
    [None, Some(Request::Arm), Some(Request::Disarm), Some(Request::Kill), Some(Request::Engage)];

/// Ages on both sides of each limit.
const AGES_US: [u32; 8] = [0, COAST_US, COAST_US + 1, DESCEND_US, DESCEND_US + 1, GIVE_UP_US, GIVE_UP_US + 1, u32::MAX];

/// Inputs of a vehicle in the air, with states that have been fresh for long and without a request.
const CALM: SupervisorInputs = SupervisorInputs {
    request: None,
    kill: false,
    ready: Ok(()),
    state_age_us: 0,
    attitude_age_us: 0,
    steady_us: u32::MAX,
    airborne: true,
    stands: false,
    tumbled: false,
};

/// Returns all combinations of mode and observations.
fn all() -> impl Iterator<Item = (Mode, SupervisorInputs)> {
    let flags = |n: usize| (n & 1 == 1, n & 2 == 2, n & 4 == 4);
    let cases = MODES.into_iter().flat_map(|mode| REQUESTS.into_iter().map(move |request| (mode, request)));
    let cases = cases.flat_map(|case| AGES_US.into_iter().map(move |age| (case, age)));
    let cases = cases.flat_map(|case| [0, STEADY_US - 1, STEADY_US].into_iter().map(move |steady| (case, steady)));
    let cases = cases.flat_map(|case| [Ok(()), Err(Refusal::TiltTooLarge)].into_iter().map(move |ready| (case, ready)));
    cases
        .flat_map(move |((((mode, request), state_age_us), steady_us), ready)| {
            (0..8).map(move |n| {
                let (waits, airborne, tumbled) = flags(n);
                let kill = waits || request == Some(Request::Kill);
                let seen =
                    SupervisorInputs { request, kill, ready, state_age_us, steady_us, airborne, tumbled, ..CALM };
                (mode, seen)
            })
        })
        // The attitude is as old as the state, or newer.
        .flat_map(|(mode, seen)| {
            AGES_US
                .into_iter()
                .filter(move |age| *age <= seen.state_age_us)
                .map(move |attitude_age_us| (mode, SupervisorInputs { attitude_age_us, ..seen }))
        })
}

#[test]
fn disarmed_at_power_up() {
    assert_eq!(Mode::default(), Mode::Disarmed);
    assert!(!Mode::default().armed());
}

/// In flight, the age of the state alone decides the mode. The table has a row per mode and a column per age of
/// `AGES_US`.
#[test]
fn in_flight_the_age_decides() {
    use Mode::{Coasting, Descending, Disarmed, Flying};
    let table = [
        (Disarmed, [Disarmed; 8]),
        (Flying, [Flying, Flying, Coasting, Coasting, Descending, Descending, Disarmed, Disarmed]),
        (Coasting, [Flying, Flying, Coasting, Coasting, Descending, Descending, Disarmed, Disarmed]),
        (Descending, [Flying, Flying, Descending, Descending, Descending, Descending, Disarmed, Disarmed]),
    ];
    for (mode, row) in table {
        for (state_age_us, expected) in AGES_US.into_iter().zip(row) {
            for ready in [Ok(()), Err(Refusal::TiltTooLarge)] {
                let observed = SupervisorInputs { ready, state_age_us, attitude_age_us: state_age_us, ..CALM };
                assert_eq!(mode.next(&observed), expected, "{mode:?}, {observed:?}");
                // With a known attitude, the descent may take as long as it needs.
                let attitude_lost = SupervisorInputs { attitude_age_us: GIVE_UP_US, ..observed };
                let given_up = state_age_us > GIVE_UP_US && mode.armed();
                let next = if given_up { Descending } else { expected };
                assert_eq!(mode.next(&attitude_lost), next, "{mode:?}, {attitude_lost:?}");
            }
        }
    }
}

#[test]
fn coasting_ends_once_states_have_been_fresh_for_a_while() {
    for (steady_us, expected) in [(0, Mode::Coasting), (STEADY_US - 1, Mode::Coasting), (STEADY_US, Mode::Flying)] {
        assert_eq!(Mode::Coasting.next(&SupervisorInputs { steady_us, ..CALM }), expected);
        assert_eq!(Mode::Flying.next(&SupervisorInputs { steady_us, ..CALM }), Mode::Flying);
    }
}

/// A descent is not ended by states that return only for moments, nor by a vehicle that stands on the ground.
#[test]
fn a_descent_ends_once_states_have_been_fresh_for_a_second_in_the_air() {
    for (steady_us, stands, expected) in [
        (0, false, Mode::Descending),
        (RESUME_US - 1, false, Mode::Descending),
        (RESUME_US, true, Mode::Descending),
        (RESUME_US, false, Mode::Flying),
    ] {
        assert_eq!(Mode::Descending.next(&SupervisorInputs { steady_us, stands, ..CALM }), expected);
        let grounded = SupervisorInputs { steady_us, stands, airborne: false, ..CALM };
        assert_eq!(Mode::Descending.next(&grounded), Mode::Disarmed);
    }
}

/// Reasons for the end of a flight, in order of precedence.
#[test]
fn a_flight_ends_for_the_reason_of_highest_precedence() {
    for (mode, seen) in all() {
        let reasons = [
            (seen.kill, EndReason::Killed),
            (seen.request == Some(Request::Disarm) && !seen.airborne, EndReason::Disarmed),
            (seen.tumbled, EndReason::Tumbled),
            (seen.attitude_age_us > GIVE_UP_US, EndReason::StateLost),
            (mode == Mode::Descending && !seen.airborne, EndReason::Landed),
        ];
        let end = reasons.into_iter().find(|(holds, _)| *holds && mode.armed()).map(|(_, end)| end);
        assert_eq!(mode.end(&seen), end, "{mode:?}, {seen:?}");
        assert!(end.is_none() || mode.next(&seen) == Mode::Disarmed);
        assert!(end.is_some() || !mode.armed() || mode.next(&seen).armed(), "no end without a reason: {seen:?}");
    }
}

/// Only a granted request to arm starts the motors, and a refused request has no effect.
#[test]
fn what_is_refused_changes_nothing() {
    for (mode, seen) in all() {
        let without = mode.next(&SupervisorInputs { request: None, ..seen });
        let granted = seen.request.is_some_and(|request| mode.answer(request, &seen).is_ok());
        if !granted {
            assert_eq!(mode.next(&seen), without, "{mode:?}, {seen:?}");
        }
        if mode == Mode::Disarmed {
            let arms = seen.request == Some(Request::Arm) && granted;
            assert_eq!(mode.next(&seen), if arms { Mode::Flying } else { Mode::Disarmed }, "{seen:?}");
        }
    }
}

#[test]
fn every_request_is_answered() {
    for (mode, seen) in all() {
        let Some(request) = seen.request else { continue };
        let expected = match (request, mode.armed()) {
            (Request::Kill, _) => Ok(()),
            _ if seen.kill => Err(Refusal::Overtaken),
            (Request::Arm, true) => Err(Refusal::AlreadyArmed),
            (Request::Arm, false) => seen.ready,
            (Request::Disarm, true) if seen.airborne => Err(Refusal::InFlight),
            (Request::Disarm, _) => Ok(()),
            (Request::Engage, true) => Ok(()),
            (Request::Engage, false) => Err(Refusal::NotArmed),
        };
        assert_eq!(mode.answer(request, &seen), expected, "{mode:?}, {seen:?}");
    }
}

#[test]
fn readiness_names_the_first_reason_against_it() {
    let limits = ArmingLimits { tilt_max_rad: 0.2, setpoint_distance_max_m: 2.0, ..ArmingLimits::default() };
    let at = |x, y, z| Some(Setpoint { position_m: Vector3::new(x, y, z), ..Setpoint::default() });
    let tilted = |roll, pitch, yaw| Some(State { attitude_rad: Vector3::new(roll, pitch, yaw), ..State::default() });
    let level = tilted(0.0, 0.0, 3.0);
    let cases = [
        (level, at(0.0, 0.0, 0.0), true, REST_US, Ok(())),
        (tilted(0.2, -0.2, 3.0), at(0.0, 0.0, 2.0), true, u32::MAX, Ok(())),
        (None, at(0.0, 0.0, 0.0), true, REST_US, Err(Refusal::StateStale)),
        (None, None, false, 0, Err(Refusal::StateStale)),
        (tilted(0.21, 0.0, 0.0), None, false, 0, Err(Refusal::TiltTooLarge)),
        (tilted(0.0, -0.21, 0.0), at(0.0, 0.0, 0.0), true, REST_US, Err(Refusal::TiltTooLarge)),
        (level, None, false, 0, Err(Refusal::SetpointMissing)),
        (level, at(0.0, 0.0, -2.01), false, 0, Err(Refusal::SetpointTooFar)),
        (level, at(1.5, 1.5, 0.0), true, REST_US, Err(Refusal::SetpointTooFar)),
        (level, at(1.0, 1.0, 1.0), false, 0, Err(Refusal::Unhealthy)),
        (level, at(1.0, 1.0, 1.0), true, REST_US - 1, Err(Refusal::NotAtRest)),
    ];
    for (state, setpoint, healthy, rest_us, expected) in cases {
        let (state, setpoint) = (state.as_ref(), setpoint.as_ref());
        let standing = ArmingInputs { state, missing: None, setpoint, healthy, rest_us, inhibited: Reasons::NONE };
        assert_eq!(limits.against(&standing).verdict(), expected, "{standing:?}");
        // Reasons from outside the flight core come last.
        let inhibited = ArmingInputs { inhibited: Refusal::OutsideFence.into(), ..standing };
        assert_eq!(limits.against(&inhibited).verdict(), expected.and(Err(Refusal::OutsideFence)));
        // A vehicle with its own estimator names what the estimate lacks.
        let missing = Some(Refusal::HeadingUnknown);
        let unknown = ArmingInputs { state: None, missing, ..standing };
        assert_eq!(limits.against(&unknown).verdict(), Err(Refusal::HeadingUnknown));
    }
    // All reasons are listed in order.
    let (state, setpoint) = (tilted(1.0, 0.0, 0.0), at(9.0, 0.0, 0.0));
    let standing = ArmingInputs {
        state: state.as_ref(),
        missing: None,
        setpoint: setpoint.as_ref(),
        healthy: false,
        rest_us: 0,
        inhibited: Reasons::from(Refusal::WrongMode).and(Refusal::BatteryLow.into()),
    };
    let all = [
        Refusal::TiltTooLarge,
        Refusal::SetpointTooFar,
        Refusal::Unhealthy,
        Refusal::NotAtRest,
        Refusal::BatteryLow,
        Refusal::WrongMode,
    ];
    assert!(limits.against(&standing).iter().eq(all));
}

#[test]
fn at_rest_is_neither_moving_nor_turning() {
    let limits = ArmingLimits { speed_max_m_s: 0.5, rate_max_rad_s: 0.25, ..ArmingLimits::default() };
    let state = |v: [f32; 3], w: [f32; 3]| State { velocity_m_s: v.into(), rates_rad_s: w.into(), ..State::default() };
    for axis in 0..3 {
        let along = |size: f32| core::array::from_fn(|i| if i == axis { size } else { 0.0 });
        for sign in [1.0, -1.0] {
            assert!(limits.at_rest(&state(along(0.5 * sign), along(0.25 * sign))));
            assert!(!limits.at_rest(&state(along(0.51 * sign), [0.0; 3])));
            assert!(!limits.at_rest(&state([0.0; 3], along(0.26 * sign))));
        }
    }
    assert!(!limits.at_rest(&state([0.3, 0.3, 0.3], [0.0; 3])), "the speed counts, not its parts");
}

#[test]
fn every_refusal_has_a_number_of_its_own_and_fits_a_status_text() {
    for (index, refusal) in Refusal::ALL.into_iter().enumerate() {
        assert_eq!(refusal as usize, index + 1);
        let reason = refusal.reason();
        assert!(reason.len() <= 50 && reason.contains("refused: "), "{reason}");
        assert_eq!(Refusal::ALL.iter().filter(|other| other.reason() == reason).count(), 1, "{reason}");
    }
}

#[test]
fn limits_are_validated_by_name() {
    let limits = ArmingLimits::default();
    assert_eq!(limits.validate(), Ok(()));
    assert_eq!(ArmingLimits::NONE.validate(), Ok(()));
    for (limits, name) in [
        (ArmingLimits { tilt_max_rad: 0.9, ..limits }, "tilt_max_rad"),
        (ArmingLimits { tilt_max_rad: f32::NAN, ..limits }, "tilt_max_rad"),
        (ArmingLimits { setpoint_distance_max_m: 0.0, ..limits }, "setpoint_distance_max_m"),
        (ArmingLimits { setpoint_distance_max_m: f32::INFINITY, ..limits }, "setpoint_distance_max_m"),
        (ArmingLimits { speed_max_m_s: 0.0, ..limits }, "speed_max_m_s"),
        (ArmingLimits { rate_max_rad_s: -1.0, ..limits }, "rate_max_rad_s"),
    ] {
        assert_eq!(limits.validate().map_err(|error| error.range.name), Err(name));
    }
}

#[test]
fn reasons_are_a_set_in_the_order_of_arming() {
    assert_eq!((Reasons::NONE.verdict(), Reasons::NONE.is_empty()), (Ok(()), true));
    for (place, reason) in Refusal::ARMING.into_iter().enumerate() {
        let one = Reasons::from(reason);
        assert_eq!((one.verdict(), one.is_empty()), (Err(reason), false));
        for (other_place, other) in Refusal::ARMING.into_iter().enumerate() {
            assert_eq!(one.contains(other), reason == other);
            let mut both = one;
            both.note(false, other);
            assert_eq!(both, one);
            both.note(true, other);
            assert_eq!(both, one.and(other.into()));
            assert_eq!(both.verdict(), Err(if place < other_place { reason } else { other }));
            assert_eq!(both.iter().count(), if reason == other { 1 } else { 2 });
        }
    }
}

/// Every reason that is noted prevents arming, even a reason that the order of refusals does not list.
#[test]
fn any_reason_speaks_against_arming() {
    for reason in Refusal::ALL {
        assert_eq!(Reasons::from(reason).verdict(), Err(reason));
    }
}
