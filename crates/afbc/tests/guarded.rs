//! AFBC with its monitor: the checks of every step, the switch to the fallback law and back, and that only a command
//! engages AFBC again. `tests/tests/guarded.rs` has closed loops.
#![allow(clippy::unwrap_used, missing_docs)] // a failed construction must stop the test

use crate::common::{Stepped, U, check_step, gains, measured, plausible, setpoint, settings, state, step, value};
use afbc::adaptive::Gains;
use afbc::disturbance::DisturbanceObserver;
use afbc::limits::PositionControlLimits;
use afbc::monitor::MonitorBounds;
use afbc::reference::ReferenceModel;
use afbc::standstill::LIFT_SHARE;
use afbc::{Adaptive, AdaptiveEstimate, Controller, Guarded, Profile, Settings, Trip, guarded};
use afbc_control::mixer::HOVER_MARGIN;
use afbc_control::{FlightController, Health, Smoothing, Validated};
use afbc_types::{Axis, Inputs, Parameters, PerAxis, Setpoint, State};
use nalgebra::Vector3;
use proptest::prelude::*;

/// Memory of a flight.
type Flight = Validated<guarded::Memory>;

const WEIGHT_N: f32 = 0.486 * 9.81;

/// Returns the profile's settings without reference model and input filters, whose memory would hide jumps. Also
/// without the moment observer, which would compensate every input of a vehicle that is held.
fn direct() -> Settings {
    let settings = Profile::Flight.settings();
    Settings {
        reference: ReferenceModel::DEFAULT,
        smoothing: Smoothing::DEFAULT,
        disturbance: DisturbanceObserver {
            // The vehicle of these tests does not fall, however small its thrust.
            disturbance_z_rad_s: 0.0,
            disturbance_tilt_rad_s: 0.0,
            disturbance_yaw_rad_s: 0.0,
            ..settings.disturbance
        },
        ..settings
    }
}

fn guarded(bounds: MonitorBounds) -> Guarded {
    Guarded::new(Parameters::PAPER.to_f32(), direct(), Profile::Flight.gains(), bounds).unwrap()
}

fn bounds() -> MonitorBounds {
    MonitorBounds::new(&Profile::Flight.gains(), &Parameters::PAPER.to_f32(), &direct())
}

/// Returns bounds that trip in the first step with an error of roll: any estimate above zero trips.
fn hair_trigger() -> MonitorBounds {
    MonitorBounds { theta: PerAxis { roll: 0.0, ..bounds().theta }, ..bounds() }
}

/// Returns bounds that never trip.
fn lax() -> MonitorBounds {
    let most = PerAxis::from_fn(|_| 1e9);
    MonitorBounds { theta: most, delta: most, error: most, saturation_share: 1.0, swing_n: 1e4, swings_hz: 1e4 }
}

/// Draws a state with errors that keep the fallback law within its integral's bounds.
fn near() -> impl Strategy<Value = State> {
    prop::array::uniform12(-0.05_f32..0.05).prop_map(|[x, y, z, u, v, w, a, b, c, p, q, r]| State {
        position_m: Vector3::new(x, y, z),
        velocity_m_s: Vector3::new(u, v, w),
        attitude_rad: Vector3::new(a, b, c),
        rates_rad_s: Vector3::new(p, q, r),
    })
}

/// Checks that there is no jump, apart from rounding of a few operations and one step of learning.
fn same(before: &Stepped, after: &Stepped) -> Result<(), TestCaseError> {
    let (errors, gains) = (before.trace.errors, Profile::Flight.gains());
    // A vehicle that does not move although it is tilted by 0.05 rad about both axes shows this force.
    let force_m_s2 = 0.7 * f64::from(before.trace.inputs.thrust_n / WEIGHT_N);
    let (before, after) = (before.per_axis(), after.per_axis());
    for axis in Axis::ALL {
        let (before, after) = (f64::from(before[axis]), f64::from(after[axis]));
        let learnt = 1e-3 * f64::from(gains[axis].gamma * errors[axis].e2).abs();
        // The observed value of a force of 1 m/s2 changes by at most w/e per second.
        let w = f64::from(direct().disturbance.disturbance_rad_s);
        let observed =
            if matches!(axis, Axis::X | Axis::Y) { 1e-3 * w / core::f64::consts::E * force_m_s2.max(1.0) } else { 0.0 };
        let allowed = 16.0 * U * (before.abs() + 20.0) + 1.001 * learnt + observed;
        prop_assert!((before - after).abs() <= allowed, "{axis:?}: {before}, then {after}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any inputs give finite commands within limits and the right health flags, whether the monitor has tripped or
    /// AFBC is engaged again.
    #[test]
    fn any_input_gives_valid_motor_commands(
        gains in gains(),
        settings in settings(),
        trips: bool,
        inputs in prop::collection::vec((state(value), setpoint(value), prop::bool::weighted(0.1)), 50),
    ) {
        // The drawn vehicle must be able to hover.
        let (mut gains, mut settings) = (gains, settings);
        gains.z.safeguards.theta_max = gains.z.safeguards.theta_max.max(5.01 * WEIGHT_N);
        settings.common.rotor_force_max_n = settings.common.rotor_force_max_n.max(2.0);
        let bounds = if trips {
            MonitorBounds { error: PerAxis::from_fn(|_| 1.0), ..lax() }
        } else {
            MonitorBounds::new(&gains, &Parameters::PAPER.to_f32(), &settings)
        };
        let controller = Guarded::new(Parameters::PAPER.to_f32(), settings, gains, bounds).unwrap();
        let mut memory = Flight::default();
        for (state, setpoint, engage) in inputs {
            if engage {
                controller.engage(&mut memory.control);
                prop_assert_eq!(memory.control.trip(), None);
            }
            let tripped = memory.control.trip();
            let command = step(&controller, &mut memory, &state, &setpoint);
            check_step(&command, &settings)?;
            prop_assert_eq!(command.action.health.fallback, tripped.map(Trip::reason));
            prop_assert_eq!(command.action.health.state_rejected, !state.is_plausible());
            prop_assert_eq!(command.action.health.setpoint_rejected, !setpoint.is_plausible());
            prop_assert!(tripped.is_none() || memory.control.trip() == tripped, "re-engaged by itself");
            let learnt = memory.control.estimates();
            prop_assert!(Axis::ALL.iter().all(|axis| learnt[*axis].theta.iter().all(|theta| theta.is_finite())));
        }
    }

    /// Until the monitor trips, the guarded law equals AFBC bit for bit, and engaging has no effect.
    #[test]
    fn untripped_it_is_the_law(inputs in prop::collection::vec((state(plausible), setpoint(plausible)), 50)) {
        let settings = Profile::Flight.settings();
        let controller =
            Guarded::new(Parameters::PAPER.to_f32(), settings, Profile::Flight.gains(), lax()).unwrap();
        let law = Controller::new(
            Parameters::PAPER.to_f32(),
            settings,
            Adaptive::new(Profile::Flight.gains()).unwrap(),
        )
        .unwrap();
        prop_assert_eq!((controller.dt_s(), controller.mixer()), (law.dt_s(), law.mixer()));
        prop_assert_eq!(law.dt_s(), settings.common.dt_s);
        let (mut memory, mut other) = (Flight::default(), Validated::default());
        for (state, setpoint) in inputs {
            controller.engage(&mut memory.control);
            let command = step(&controller, &mut memory, &state, &setpoint);
            prop_assert_eq!(command, step(&law, &mut other, &state, &setpoint));
            prop_assert_eq!(memory.control.estimates(), other.control.estimates);
        }
        prop_assert_eq!(memory.control.trip(), None);
    }

    /// At a constant state, a trip and an engagement cause no jump: the last inputs of one law equal the first inputs
    /// of the other.
    #[test]
    fn hand_over_is_bumpless_in_both_directions(state in near(), setpoint in near(), lasting in 0_usize..300) {
        // Without a roll rate, there would be no roll error on which the monitor could trip.
        prop_assume!(state.rates_rad_s.x.abs() > 1e-3);
        let setpoint =
            Setpoint { position_m: setpoint.position_m, velocity_m_s: setpoint.velocity_m_s, ..Setpoint::default() };
        let controller = guarded(hair_trigger());
        let mut memory = Flight::default();
        let last_of_afbc = step(&controller, &mut memory, &measured(&state), &setpoint);
        prop_assert_eq!(
            (last_of_afbc.action.health.fallback, memory.control.trip()),
            (None, Some(Trip::Theta(Axis::Roll)))
        );

        // AFBC is engaged at once, before the first step of the fallback law.
        let mut at_once = memory;
        controller.engage(&mut at_once.control);
        let first_of_afbc = step(&controller, &mut at_once, &measured(&state), &setpoint);
        prop_assert_eq!(first_of_afbc.action.health.fallback, None);
        position_is_the_same(&last_of_afbc, &first_of_afbc)?;

        let mut last_of_fallback = step(&controller, &mut memory, &measured(&state), &setpoint);
        prop_assert_eq!(last_of_fallback.action.health.fallback, memory.control.trip().map(Trip::reason));
        position_is_the_same(&last_of_afbc, &last_of_fallback)?;
        for _ in 0..lasting {
            last_of_fallback = step(&controller, &mut memory, &measured(&state), &setpoint);
        }
        // With less thrust, the vehicle might stand on the ground by then, and the monitor does not trip on the ground.
        prop_assume!(last_of_fallback.trace.inputs.thrust_n >= LIFT_SHARE * WEIGHT_N);
        controller.engage(&mut memory.control);
        let first_of_afbc = step(&controller, &mut memory, &measured(&state), &setpoint);
        prop_assert_eq!((first_of_afbc.action.health.fallback, memory.control.trip().is_some()), (None, true));
        position_is_the_same(&last_of_fallback, &first_of_afbc)?;
    }

    /// The hand-over causes no jump of the attitude commands. The reference of roll and pitch usually changes from step
    /// to step, so a filter at rest holds it constant. The law has feed-forward, or also learns the weight.
    #[test]
    fn hand_over_at_rest_is_bumpless_in_all_axes(
        height in -0.2_f32..0.2, yaw in -0.2_f32..0.2, feed_forward: bool,
    ) {
        let state = State {
            position_m: Vector3::new(0.0, 0.0, height),
            attitude_rad: Vector3::new(0.0, 0.0, yaw),
            ..State::default()
        };
        let (settings, mut gains) = (Settings { feed_forward, ..direct() }, Profile::Flight.gains());
        gains.z.safeguards.theta_max = 8.0 * WEIGHT_N;
        let bounds = MonitorBounds::new(&gains, &Parameters::PAPER.to_f32(), &settings);
        let hasty = MonitorBounds { error: PerAxis { z: 0.0, ..bounds.error }, ..bounds };
        let controller = Guarded::new(Parameters::PAPER.to_f32(), settings, gains, hasty).unwrap();
        let mut memory = Flight::default();
        let mut commands = Vec::new();
        while memory.control.trip().is_none() && commands.len() < 12 {
            commands.push(step(&controller, &mut memory, &state, &Setpoint::default()));
        }
        prop_assume!(memory.control.trip() == Some(Trip::Error(Axis::Z)));
        let before = *commands.last().unwrap();
        let mut after = step(&controller, &mut memory, &state, &Setpoint::default());
        same(&before, &after)?;
        for _ in 0..100 {
            after = step(&controller, &mut memory, &state, &Setpoint::default());
        }
        controller.engage(&mut memory.control);
        same(&after, &step(&controller, &mut memory, &state, &Setpoint::default()))?;
    }
}

/// Checks z, x and y, whose references are constant at a constant state and setpoint.
fn position_is_the_same(before: &Stepped, after: &Stepped) -> Result<(), TestCaseError> {
    let only = |command: &Stepped| {
        let mut command = *command;
        let inputs = &mut command.trace.inputs;
        (inputs.roll_n, inputs.pitch_n, inputs.yaw_n) = (0.0, 0.0, 0.0);
        command
    };
    same(&only(before), &only(after))
}

/// If the last input exceeds the bound of the fallback law's integral, the integral stops at its bound.
#[test]
fn the_fallback_takes_over_no_more_than_its_bound() {
    let gains = Profile::Flight.gains();
    let controller = guarded(hair_trigger());
    let mut memory = Flight::default();
    let state = State { attitude_rad: Vector3::new(0.3, 0.0, 0.0), ..State::default() };
    // The filter starts at the attitude and returns to level, which gives errors and AFBC's first steps.
    let mut steps = 0;
    while memory.control.trip().is_none() {
        step(&controller, &mut memory, &state, &Setpoint::default());
        steps += 1;
        assert!(steps < 100);
    }
    for _ in 0..50_000 {
        let command = step(&controller, &mut memory, &state, &Setpoint::default());
        let bound = gains.roll.safeguards.theta_max + 10.0;
        assert!(command.trace.inputs.roll_n.abs() < bound, "{}", command.trace.inputs.roll_n);
    }
}

/// A vehicle that stands on the ground with a setpoint below it never trips the monitor, however saturated its rotors
/// are.
#[test]
fn the_ground_does_not_trip() {
    let controller = guarded(bounds());
    let mut memory = Flight::default();
    let below = Setpoint { position_m: Vector3::new(0.0, 0.0, -1.0), ..Setpoint::default() };
    for _ in 0..20_000 {
        let command = step(&controller, &mut memory, &State::default(), &below);
        assert!(command.action.health.saturated);
    }
    assert_eq!(memory.control.trip(), None);
    // A vehicle that sinks in the air trips the monitor.
    let sinking = State { velocity_m_s: Vector3::new(0.0, 0.0, -0.5), ..State::default() };
    for _ in 0..5_000 {
        step(&controller, &mut memory, &sinking, &below);
    }
    assert_eq!(memory.control.trip(), Some(Trip::Saturation));
}

#[test]
fn a_tripped_controller_learns_nothing_and_says_why() {
    let controller = guarded(hair_trigger());
    let mut memory = Flight::default();
    let state = State { attitude_rad: Vector3::new(0.1, 0.0, 0.0), ..State::default() };
    let setpoint = Setpoint { position_m: Vector3::new(0.3, 0.0, 0.2), ..Setpoint::default() };
    while memory.control.trip().is_none() {
        step(&controller, &mut memory, &state, &setpoint);
    }
    // The monitor has updated each subsystem's norms within the last six steps, so adaptation would change them.
    let seen = *memory.control.figures();
    assert!(Axis::ALL.iter().any(|axis| seen.norms[*axis].theta_squared > 0.0), "{seen:?}");
    for _ in 0..1000 {
        let health = step(&controller, &mut memory, &state, &setpoint).action.health;
        let mut expected = Health::default();
        (expected.fallback, expected.saturated) = (memory.control.trip().map(Trip::reason), health.saturated);
        assert_eq!(health, expected);
    }
    assert_eq!(*memory.control.figures(), seen);
    assert_eq!(memory.control.estimates(), PerAxis::<AdaptiveEstimate>::default(), "the other law flies");
}

#[test]
fn bounds_and_gains_out_of_range_are_refused_by_name() {
    let (vehicle, settings, gains) = (Parameters::PAPER.to_f32(), Profile::Flight.settings(), Profile::Flight.gains());
    let name = |settings, gains, bounds| Guarded::new(vehicle, settings, gains, bounds).unwrap_err().range.name;
    assert_eq!(name(settings, gains, MonitorBounds { swing_n: 0.0, ..bounds() }), "swing_n");
    let mut bad = gains;
    bad.z.gamma = f32::NAN;
    assert_eq!(name(settings, bad, bounds()), "gamma");
    assert_eq!(name(settings.with_dt_s(0.0), gains, bounds()), "dt_s");
}

/// The error must contain the required value.
#[test]
fn a_vehicle_that_cannot_hover_is_refused_by_name() {
    let settings = Profile::Flight.settings();
    let of_mass = |mass_kg: f32| Parameters { mass_kg, ..Parameters::PAPER.to_f32() };
    let refusal = |vehicle: Parameters, gains: PerAxis<Gains>| {
        let guarded = Guarded::new(vehicle, settings, gains, MonitorBounds::new(&gains, &vehicle, &settings));
        guarded.err().map(|error| (error.range.name, error.range.min as f32))
    };
    for mass_kg in [0.3, 0.486, 0.61, 0.8, 0.94, 0.95, 0.97, 1.22, 2.0, 50.0] {
        let vehicle = of_mass(mass_kg);
        let needed_n = HOVER_MARGIN * mass_kg * 9.81 / 4.0;
        match refusal(vehicle, Profile::Flight.gains_for(&vehicle, afbc::LAG_S)) {
            None => assert!(needed_n <= 3.0, "{mass_kg} kg"),
            Some((name, least)) => {
                assert!(needed_n > 3.0, "{mass_kg} kg");
                assert!(name == "rotor_force_max_n" && (-1e-6..2e-4).contains(&(least - needed_n)), "{name} {least}");
            }
        }
    }
    // A light vehicle with the paper's inertia turns too slowly.
    let light = of_mass(0.05);
    assert_eq!(refusal(light, Profile::Flight.gains_for(&light, afbc::LAG_S)), Some(("hover_authority_rad_s2", 80.0)));
    // With the gains of the paper's vehicle, the monitor of a heavier vehicle would trip in an ideal hover, even with
    // strong enough rotors.
    let strong = |mass_kg: f32| {
        let gains = Profile::Flight.gains();
        let settings = settings.with_rotor_force_max_n(100.0);
        Guarded::new(of_mass(mass_kg), settings, gains, MonitorBounds::new(&gains, &of_mass(mass_kg), &settings))
    };
    assert!(strong(0.55).is_ok());
    let error = strong(0.97).unwrap_err();
    assert_eq!((error.range.name, error.range.min), ("theta_max", 17.1283));
}

/// For the paper's vehicle the gains are the profile's own, bit for bit. If every input has half the effect, gains in
/// the input's unit are twice as large.
#[test]
fn gains_are_scaled_by_what_an_input_does() {
    for profile in Profile::ALL {
        let paper = Parameters::PAPER.to_f32();
        assert_eq!(profile.gains_for(&paper, afbc::LAG_S), profile.gains());
        let sluggish = Parameters { mass_kg: 2.0 * paper.mass_kg, inertia_kg_m2: 2.0 * paper.inertia_kg_m2, ..paper };
        for axis in Axis::ALL {
            let (own, other) = (profile.gains()[axis], profile.gains_for(&sluggish, afbc::LAG_S)[axis]);
            let times = if matches!(axis, Axis::X | Axis::Y) { 1.0 } else { 2.0 };
            assert_eq!(other.backstepping.alpha2, times * own.backstepping.alpha2);
            assert_eq!((other.gamma, other.eta), (times * own.gamma, times * own.eta));
            let bound = |bound: f32| (times * bound).min(1e6);
            assert_eq!(other.safeguards.theta_max, bound(own.safeguards.theta_max));
            assert_eq!(other.safeguards.delta_max, bound(own.safeguards.delta_max));
            assert_eq!((other.backstepping.alpha1, other.epsilon), (own.backstepping.alpha1, own.epsilon));
            assert_eq!((other.membership, other.safeguards.sigma), (own.membership, own.safeguards.sigma));
        }
    }
}

/// After engaging, the estimates are spread over the rules within the monitor's bounds, so it does not trip at once.
#[test]
fn engaging_does_not_trip_by_itself() {
    let bounds = bounds();
    for yaw_n in [0.5_f32, 1.5, -1.5, 2.4] {
        let (controller, (_, mut memory)) = (guarded(bounds), tripped(0, 0.0));
        step(&controller, &mut memory, &State::default(), &Setpoint::default());
        // The vehicle is held by force: the integral of gamma e_2 grows by 1 mN per step.
        let e2 = 1.0 / Profile::Flight.gains().yaw.gamma;
        let turning = Setpoint { yaw_rate_rad_s: e2.copysign(yaw_n), ..Setpoint::default() };
        for _ in 0..(yaw_n.abs() * 1e3) as usize {
            step(&controller, &mut memory, &State::default(), &turning);
        }
        let before = step(&controller, &mut memory, &State::default(), &Setpoint::default());
        assert!(
            (before.trace.inputs.yaw_n / yaw_n - 1.0).abs() < 0.05 && memory.control.trip().is_some(),
            "{before:?}"
        );
        controller.engage(&mut memory.control);
        for _ in 0..100 {
            let command = step(&controller, &mut memory, &State::default(), &Setpoint::default());
            assert_eq!((command.action.health.fallback, memory.control.trip()), (None, None), "{yaw_n} N");
            assert!((command.trace.inputs.yaw_n - before.trace.inputs.yaw_n).abs() < 5e-3, "{yaw_n} N: {command:?}");
            let learnt = memory.control.estimates().yaw.theta;
            assert!(learnt.norm() < bounds.theta.yaw && (yaw_n.abs() > 0.7 || learnt.max() - learnt.min() < 1e-2));
        }
    }
}

/// When the position is lost, the law keeps its observed disturbance, whatever the dead-reckoned motion looks like,
/// with and without the monitor.
#[test]
fn a_reckoned_motion_shows_no_disturbance() {
    fn push<C: FlightController>(controller: &C, position_lost: bool) -> [f32; 2] {
        let (mut memory, mut state) = (Validated::<C::Memory>::default(), State::default());
        // The vehicle is on its setpoint throughout, so AFBC learns nothing from errors.
        let mut fly = |accelerates_m_s2: f32, position_lost| {
            let mut asked = 0.0;
            for _ in 0..1000 {
                if position_lost {
                    controller.position_lost(&mut memory.control);
                }
                let (position_m, velocity_m_s) = (state.position_m, state.velocity_m_s);
                let setpoint = Setpoint { position_m, velocity_m_s, ..Setpoint::default() };
                [asked, _] = step(controller, &mut memory, &measured(&state), &setpoint).trace.virtual_m_s2;
                state.velocity_m_s.x += 1e-3 * accelerates_m_s2;
            }
            asked
        };
        [fly(1.0, false), fly(0.0, position_lost)]
    }
    fn check<C: FlightController>(controller: &C) {
        let [pushed, calm] = push(controller, false);
        assert!((pushed + 1.0).abs() < 0.02 && calm.abs() < 0.02, "{pushed}, then {calm} m/s2");
        let [pushed, position_lost] = push(controller, true);
        assert!((position_lost - pushed).abs() < 0.02, "{pushed}, then {position_lost} m/s2");
    }
    check(&guarded(bounds()));
    let law = Adaptive::new(Profile::Flight.gains()).unwrap();
    check(&Controller::new(Parameters::PAPER.to_f32(), direct(), law).unwrap());
}

/// The fallback law's observer is also told that the position is lost, so it does not take a dead-reckoned motion for
/// wind.
#[test]
fn a_reckoned_motion_shows_the_fallback_law_no_disturbance() {
    let controller = guarded(lax());
    let asked = [false, true].map(|position_lost| {
        let ((_, mut memory), mut state) = (tripped(50, 0.0), State::default());
        let mut asked = 0.0;
        // A measured motion like this would mean that the vehicle is first pushed, then not. The vehicle is on its
        // setpoint, so nothing is learnt from errors.
        for accelerates_m_s2 in [1.0, 0.0] {
            for _ in 0..1000 {
                if position_lost && accelerates_m_s2 == 0.0 {
                    controller.position_lost(&mut memory.control);
                }
                let (position_m, velocity_m_s) = (state.position_m, state.velocity_m_s);
                let setpoint = Setpoint { position_m, velocity_m_s, ..Setpoint::default() };
                let stepped = step(&controller, &mut memory, &measured(&state), &setpoint);
                assert!(stepped.action.health.fallback.is_some());
                [asked, _] = stepped.trace.virtual_m_s2;
                state.velocity_m_s.x += 1e-3 * accelerates_m_s2;
            }
        }
        asked
    });
    let [calm, reckoned] = asked;
    assert!((calm - reckoned - 1.0).abs() < 0.05, "{calm}, {reckoned} m/s2");
}

/// Large learnt inputs fit the bounds only if they are spread by the weights of the present rules, which depend on each
/// attitude's own angle and rate. The inputs do not change.
#[test]
fn engaging_is_bumpless_where_no_even_estimate_fits() {
    let (bounds, (_, mut memory), mut gains) = (bounds(), tripped(0, 0.0), Profile::Flight.gains());
    // Yaw does not adapt, because it would reach the rotors' limit first.
    gains.yaw.gamma = 0.0;
    // `tilt_by_thrust` is off, because with it the tilt would jump with the hover thrust, which only AFBC learns.
    let settings = Settings { tilt_by_thrust: false, ..direct() };
    let controller = Guarded::new(Parameters::PAPER.to_f32(), settings, gains, bounds).unwrap();
    // The vehicle is at rest, so the gyroscopic moment of the rotors is zero. Only the fallback law compensates this
    // moment.
    let state = State { attitude_rad: Vector3::new(-0.16, 0.15, 0.9), ..State::default() };
    // The jerk asks for angles ahead of the held ones, so that both integrals grow.
    let (sin, cos) = 0.9_f32.sin_cos();
    let jerk_m_s3 = Vector3::new(cos - sin, sin + cos, 0.0) * 10.0;
    let setpoint = Setpoint { yaw_rad: 0.9, jerk_m_s3, ..Setpoint::default() };
    let mut before = Stepped::default();
    for _ in 0..100_000 {
        before = step(&controller, &mut memory, &measured(&state), &setpoint);
        let Inputs { roll_n, pitch_n, .. } = before.trace.inputs;
        if roll_n.abs().min(pitch_n.abs()) > 1.4 {
            break;
        }
    }
    assert!(before.action.health.fallback.is_some() && !before.action.health.saturated, "{before:?}");
    assert!(controller.engage(&mut memory.control));
    let after = step(&controller, &mut memory, &measured(&state), &setpoint);
    same(&before, &after).unwrap();
    let learnt = memory.control.estimates();
    for axis in [Axis::Roll, Axis::Pitch] {
        let theta = learnt[axis].theta;
        assert!(theta.max() - theta.min() > 0.1 && theta.norm() < bounds.theta[axis], "{axis:?}: {theta}");
    }
}

/// The fallback law keeps AFBC's learnt hover thrust, so the tilt for an acceleration does not change.
#[test]
fn the_tilt_does_not_step_at_a_trip() {
    // Vertical acceleration by the thrust in (40) at yaw 0 [m/s2].
    let vertical = |command: &Stepped| command.trace.virtual_m_s2[0] / command.trace.desired_rad[1].tan();
    let (controller, (before, mut memory)) = (guarded(bounds()), tripped(300, 0.1));
    for _ in 0..20 {
        let aside = Setpoint { position_m: Vector3::new(0.1, 0.0, 0.0), ..Setpoint::default() };
        let after = step(&controller, &mut memory, &State::default(), &aside);
        assert!(after.action.health.fallback.is_some() && after.trace.inputs.thrust_n > 1.3 * WEIGHT_N, "{after:?}");
        assert!(
            (vertical(&after) / vertical(&before) - 1.0).abs() < 0.02,
            "{} then {}",
            vertical(&before),
            vertical(&after)
        );
    }
}

/// Flies a vehicle that sinks slightly for `steps`, then moves sideways, until errors of z trip. Returns the step that
/// tripped.
fn tripped(steps: usize, aside_m: f32) -> (Stepped, Flight) {
    let controller = guarded(bounds());
    let mut memory = Flight::default();
    let mut sinks = Setpoint { velocity_m_s: Vector3::new(0.0, 0.0, 0.05), ..Setpoint::default() };
    sinks.position_m.z = 1e-4;
    for _ in 0..steps {
        step(&controller, &mut memory, &State::default(), &sinks);
    }
    let touchy = guarded(MonitorBounds { error: PerAxis { z: 0.0, ..bounds().error }, ..bounds() });
    let aside = Setpoint { position_m: Vector3::new(aside_m, 0.0, 1e-4), ..sinks };
    let mut last = Stepped::default();
    while memory.control.trip().is_none() {
        last = step(&touchy, &mut memory, &State::default(), &aside);
    }
    (last, memory)
}

/// AFBC tilts up to the limit of its settings, the fallback law up to 45 degrees or that limit.
#[test]
fn the_fallback_tilts_by_45_degrees_at_most() {
    let far = Setpoint { position_m: Vector3::new(50.0, 0.0, 0.0), ..Setpoint::default() };
    for (tilt_max_rad, fallback_rad) in [(1.0, core::f32::consts::FRAC_PI_4), (0.5, 0.5)] {
        let limits = PositionControlLimits { tilt_max_rad, ..direct().limits };
        let settings = Settings { limits, ..direct() };
        for (bounds, expected_rad) in [(lax(), tilt_max_rad), (hair_trigger(), fallback_rad)] {
            let paper = Parameters::PAPER.to_f32();
            let controller = Guarded::new(paper, settings, Profile::Flight.gains(), bounds).unwrap();
            let (mut memory, mut last_rad) = (Flight::default(), 0.0_f32);
            let rolled = State { attitude_rad: Vector3::new(0.01, 0.0, 0.0), ..State::default() };
            for _ in 0..200 {
                let [_, pitch_rad] = step(&controller, &mut memory, &rolled, &far).trace.desired_rad;
                last_rad = pitch_rad;
            }
            assert_eq!(memory.control.trip().is_some(), bounds == hair_trigger());
            assert!((last_rad - expected_rad).abs() < 0.01, "{last_rad} rad, not {expected_rad}");
        }
    }
}

/// The next law keeps compensating an observed moment: no input jumps when the monitor trips or AFBC is engaged again.
#[test]
fn what_turns_the_vehicle_is_handed_over() {
    let paper = Parameters::PAPER.to_f32();
    let settings =
        Settings { reference: ReferenceModel::DEFAULT, smoothing: Smoothing::DEFAULT, ..Profile::Flight.settings() };
    let trips_after = |bounds| Guarded::new(paper, settings, Profile::Flight.gains(), bounds).unwrap();
    let moment = Vector3::new(3.0, -2.0, 0.5);
    let (calm, hasty) = (trips_after(lax()), trips_after(MonitorBounds { theta: PerAxis::from_fn(|_| 0.0), ..lax() }));
    let (mut memory, mut rates) = (Flight::default(), Vector3::zeros());
    // The vehicle turns by its rotors and the moment, but stays in place.
    let mut fly = |controller: &Guarded, engage: bool| {
        if engage {
            assert!(controller.engage(&mut memory.control));
        }
        let state = State { rates_rad_s: rates, ..State::default() };
        let stepped = step(controller, &mut memory, &state, &Setpoint::default());
        let Inputs { roll_n, pitch_n, yaw_n, .. } = stepped.action.given;
        rates += (Vector3::new(roll_n, pitch_n, yaw_n).component_mul(&paper.effectiveness()) + moment) * 1e-3;
        (Vector3::new(roll_n, pitch_n, yaw_n), stepped.action.health.fallback)
    };
    let mut last = Vector3::zeros();
    for _ in 0..2000 {
        (last, _) = fly(&calm, false);
    }
    let against = moment.component_div(&paper.effectiveness());
    assert!((last + against).abs().max() < 0.2 * against.abs().max(), "{last:?} against {against:?}");
    for (controller, engage, lasting) in [(&hasty, false, 200), (&calm, true, 200)] {
        for k in 0..lasting {
            let (now, _) = fly(controller, engage && k == 0);
            assert!((now - last).abs().max() < 0.02 * against.abs().max(), "step {k}: {now:?} after {last:?}");
            last = now;
        }
    }
    assert_eq!(memory.control.trip(), None);
}
