//! Any input gives finite rotor speeds within their limits.

use crate::harness::{SETTINGS, vehicle};
use afbc_control::{FlightController, Settings, Validated};
use afbc_laws::{Dfbc, Geometric, Indi, L1, Mpc, Pid, dfbc, geometric, indi, l1, mpc, pid};
use afbc_types::{Declared, DeclaredValueMut, Range, Setpoint, State};
use core::convert::Infallible;
use nalgebra::Vector3;
use proptest::prelude::*;

/// Draws any bits, and often values that pass the screen: small, or exactly at its bounds.
fn number() -> impl Strategy<Value = f32> {
    prop_oneof![
        1 => any::<u32>().prop_map(f32::from_bits),
        4 => -4.0f32..4.0,
        2 => -1e3f32..1e3,
        1 => prop::sample::select(
            vec![0.0, -0.0, 1e3, -1e3, 1e5, -1e5, f32::MIN_POSITIVE, 1e-45, f32::NAN, f32::INFINITY],
        ),
    ]
}

fn vector() -> impl Strategy<Value = Vector3<f32>> {
    [number(), number(), number()].prop_map(Vector3::from)
}

fn motion() -> impl Strategy<Value = (State, Setpoint)> {
    let state =
        (vector(), vector(), vector(), vector()).prop_map(|(position_m, velocity_m_s, attitude_rad, rates_rad_s)| {
            State { position_m, velocity_m_s, attitude_rad, rates_rad_s }
        });
    let setpoint = [vector(), vector(), vector(), vector(), vector(), vector()].prop_map(
        |[position_m, velocity_m_s, acceleration_m_s2, jerk_m_s3, snap_m_s4, yaw]| Setpoint {
            position_m,
            velocity_m_s,
            acceleration_m_s2,
            jerk_m_s3: jerk_m_s3 * 100.0,
            snap_m_s4: snap_m_s4 * 1e4,
            yaw_rad: yaw.x,
            yaw_rate_rad_s: yaw.y,
            yaw_acceleration_rad_s2: yaw.z,
        },
    );
    (state, setpoint)
}

/// Sets each gain within its range, by the given shares.
fn anywhere(gains: &mut impl Declared, shares: &[f64]) {
    let mut shares = shares.iter();
    let Ok(()) = gains.visit_mut(&mut |declaration, value| {
        let (DeclaredValueMut::Single([gain]), Some(share)) = (value, shares.next()) else { panic!("{declaration:?}") };
        let Range { min, max, .. } = declaration.range;
        *gain = (min + share * (max - min)) as f32;
        Ok::<(), Infallible>(())
    });
}

fn harmless<C: FlightController>(controller: &C, settings: &Settings, inputs: &[(State, Setpoint)]) {
    let mut memory = Validated::<C::Memory>::default();
    let fastest = libm::sqrtf(settings.rotor_force_max_n / vehicle().thrust_factor_n_s2) * 1.000_001;
    for (state, setpoint) in inputs {
        let command = controller.step(&mut memory, Some(state), setpoint);
        for (speed, force) in command.speeds.0.iter().zip(command.forces.0.iter()) {
            assert!(*speed >= 0.0 && *speed <= fastest, "{command:?}");
            assert!(*force >= 0.0 && *force <= settings.rotor_force_max_n, "{command:?}");
        }
        let trace = C::trace(&memory.control);
        let u = trace.inputs;
        assert!([u.roll_n, u.pitch_n, u.yaw_n, u.thrust_n].iter().all(|u| u.is_finite()), "{trace:?}");
        assert!(trace.desired_rad.iter().all(|angle| angle.is_finite()), "{trace:?}");
        assert_eq!(command.health.state_rejected, !state.is_plausible());
        assert_eq!(command.health.setpoint_rejected, !setpoint.is_plausible());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn any_input_gives_feasible_rotor_speeds(
        inputs in prop::collection::vec(motion(), 1..30),
        shares in prop::collection::vec(0.0..=1.0, 32),
        force_max in prop_oneof![Just(3.0f32), Just(1e4), Just(1e-3)],
    ) {
        let settings = Settings { rotor_force_max_n: force_max, ..SETTINGS };
        let mut gains = pid::Gains::PAPER_VEHICLE;
        harmless(&Pid::new(vehicle(), settings, gains).unwrap(), &settings, &inputs);
        anywhere(&mut gains, &shares);
        harmless(&Pid::new(vehicle(), settings, gains).unwrap(), &settings, &inputs);

        let mut gains = geometric::Gains::GOODARZI_2013;
        harmless(&Geometric::new(vehicle(), settings, gains).unwrap(), &settings, &inputs);
        anywhere(&mut gains, &shares);
        harmless(&Geometric::new(vehicle(), settings, gains).unwrap(), &settings, &inputs);

        let mut gains = indi::Gains::PAPER_VEHICLE;
        harmless(&Indi::new(vehicle(), settings, gains).unwrap(), &settings, &inputs);
        anywhere(&mut gains, &shares);
        harmless(&Indi::new(vehicle(), settings, gains).unwrap(), &settings, &inputs);

        let mut gains = l1::Gains::BY_HAND;
        harmless(&L1::new(vehicle(), settings, gains).unwrap(), &settings, &inputs);
        anywhere(&mut gains, &shares);
        harmless(&L1::new(vehicle(), settings, gains).unwrap(), &settings, &inputs);

        let mut gains = dfbc::Gains::PAPER_VEHICLE;
        harmless(&Dfbc::new(vehicle(), settings, gains).unwrap(), &settings, &inputs);
        anywhere(&mut gains, &shares);
        harmless(&Dfbc::new(vehicle(), settings, gains).unwrap(), &settings, &inputs);

        let mut gains = mpc::Gains::PAPER_VEHICLE;
        harmless(&Mpc::new(vehicle(), settings, gains).unwrap(), &settings, &inputs);
        anywhere(&mut gains, &shares);
        harmless(&Mpc::new(vehicle(), settings, gains).unwrap(), &settings, &inputs);
    }
}

#[test]
fn the_same_input_gives_the_same_bits() {
    fn twice<C: FlightController>(controller: &C) {
        let state = State { position_m: Vector3::new(0.1, 0.2, 0.3), ..State::default() };
        let run = || {
            let mut memory = Validated::<C::Memory>::default();
            (0..100).map(|_| controller.step(&mut memory, Some(&state), &Setpoint::default())).collect::<Vec<_>>()
        };
        assert_eq!(run(), run());
    }
    twice(&Indi::new(vehicle(), SETTINGS, indi::Gains::PAPER_VEHICLE).unwrap());
    twice(&L1::new(vehicle(), SETTINGS, l1::Gains::BY_HAND).unwrap());
    twice(&Dfbc::new(vehicle(), SETTINGS, dfbc::Gains::PAPER_VEHICLE).unwrap());
    twice(&Mpc::new(vehicle(), SETTINGS, mpc::Gains::PAPER_VEHICLE).unwrap());
}
