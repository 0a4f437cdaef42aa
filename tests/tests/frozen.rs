//! Trackers that freeze in flight. The firmware's code on the host flies the rigid body above a ground; MAVLink frames
//! connect them.

use afbc_flight_core::{EndReason, Mode};
use afbc_hil::{Host, Station};
use afbc_mavlink::VehicleCommand;
use afbc_plant::{Contact, Environment, Motion, Plant, PlantModel, Realism};
use afbc_types::{Parameters, State};
use nalgebra::Vector3;

/// Time of arming \[ms\]. `FREEZES_MS` is the time of the freeze.
const ARM_MS: u64 = 2_100;
const FREEZES_MS: u64 = 9_100;

/// Output of a frozen tracker.
#[derive(Clone, Copy, Debug)]
enum Frozen {
    /// Repeats the last state, bit for bit.
    Bits,
    /// Repeats the last state with noise.
    Noisy,
    /// Sends nothing for this many ms, then repeats the last state, bit for bit or with noise.
    After(u64, bool),
}

#[derive(Debug, Default)]
struct Seen {
    modes: Vec<(u64, Mode)>,
    ended: Option<EndReason>,
    /// Height at the end of the flight \[m\]. `tilt_rad` is the largest tilt from the freeze on.
    ended_m: f64,
    tilt_rad: f64,
    /// Speed at the first ground contact \[m/s\].
    touchdown_m_s: Option<f64>,
}

/// Climbs to `height_m`, flies along x at `speed_m_s`, and then freezes the tracker.
fn fly(height_m: f64, speed_m_s: f64, frozen: Frozen) -> Seen {
    let ground = Realism { contact: Some(Contact::PAPER), ..Realism::default() };
    let start = Motion { position_m: Vector3::new(0.0, 0.0, 0.02), ..Motion::default() };
    let environment = Environment::calm(Parameters::PAPER).unwrap();
    let mut plant = Plant::with_realism(PlantModel::RigidBody, start, environment, &ground, 0.001).unwrap();
    let (mut station, mut host) = (Station::new(), Host::new().unwrap());
    let (mut seen, mut last) = (Seen::default(), State::default());
    for now_ms in 0..20_000_u64 {
        let t = now_ms.saturating_sub(ARM_MS) as f64 * 1e-3;
        let motion = plant.motion();
        if now_ms < FREEZES_MS {
            last = motion.measure();
        }
        let noisy = |mut state: State| {
            state.position_m.x += ((now_ms * 7919 % 1000) as f32 - 500.0) * 2e-6;
            state.rates_rad_s.y += ((now_ms * 6029 % 1000) as f32 - 500.0) * 1e-5;
            state
        };
        let sent = match frozen {
            _ if now_ms < FREEZES_MS => Some(last),
            Frozen::Bits => Some(last),
            Frozen::Noisy => Some(noisy(last)),
            Frozen::After(gap_ms, _) if now_ms < FREEZES_MS + gap_ms => None,
            Frozen::After(_, noise) => Some(if noise { noisy(last) } else { last }),
        };
        if let Some(state) = sent {
            station.track(now_ms * 1000, state);
        }
        let mut setpoint = afbc_types::Setpoint::default();
        setpoint.position_m.z = height_m as f32;
        setpoint.position_m.x = ((t - 2.0).max(0.0) * speed_m_s) as f32;
        setpoint.velocity_m_s.x = if t > 2.0 { speed_m_s as f32 } else { 0.0 };
        station.lead(setpoint);
        if now_ms == ARM_MS {
            station.follow();
            station.command(VehicleCommand::Arm);
        }
        let tick = host.next_tick(&station.take());
        station.hear(&tick.bytes);
        let mode = tick.report.mode;
        if seen.modes.last().is_none_or(|(_, last)| *last != mode) {
            seen.modes.push((now_ms, mode));
        }
        if mode.armed() && now_ms > FREEZES_MS {
            let eta = motion.attitude_rad;
            seen.tilt_rad = seen.tilt_rad.max(eta.x.abs()).max(eta.y.abs());
        }
        if tick.report.ended.is_some() {
            seen.ended = tick.report.ended;
            seen.ended_m = motion.position_m.z;
        }
        let on_ground = plant.telemetry().is_some_and(|telemetry| telemetry.on_ground);
        if now_ms > FREEZES_MS && on_ground && seen.touchdown_m_s.is_none() {
            seen.touchdown_m_s = Some(motion.velocity_m_s.norm());
        }
        plant.step(&station.heard().speeds, 0.001);
        if seen.ended.is_some() && on_ground {
            break;
        }
    }
    seen
}

/// Without the protection, a pose repeated at 1 m/s turned the vehicle upside down within a second, in mode Flying.
#[test]
fn a_repeated_state_is_coasted_through_and_ends_in_a_descent() {
    for speed_m_s in [0.0, 0.5, 1.0, 2.0] {
        let seen = fly(1.5, speed_m_s, Frozen::Bits);
        println!("{speed_m_s} m/s: {seen:?}");
        let modes: Vec<_> = seen.modes.iter().map(|(_, mode)| *mode).collect();
        assert_eq!(modes, [Mode::Disarmed, Mode::Flying, Mode::Coasting, Mode::Descending, Mode::Disarmed]);
        let coasting_ms = seen.modes.get(2).unwrap().0 - FREEZES_MS;
        assert!(coasting_ms <= 25, "{coasting_ms} ms");
        assert_eq!(seen.ended, Some(EndReason::StateLost));
        assert!(seen.tilt_rad < 0.6, "{} rad", seen.tilt_rad);
        assert!(seen.touchdown_m_s.unwrap() < 3.5, "{seen:?}");
    }
}

/// With noise, the contradiction to the twist reveals the frozen pose. This comes late, when the attitude is already
/// lost, but the motors stop.
#[test]
fn a_noisy_constant_pose_with_a_moving_twist_is_distrusted() {
    for speed_m_s in [1.0, 2.0] {
        let seen = fly(3.0, speed_m_s, Frozen::Noisy);
        println!("{speed_m_s} m/s: {seen:?}");
        assert_eq!(seen.ended, Some(EndReason::StateLost));
        let not_flying = seen.modes.iter().find(|(at, mode)| *at > FREEZES_MS && *mode != Mode::Flying).unwrap();
        assert!(not_flying.0 - FREEZES_MS <= 525, "{seen:?}");
    }
}

/// A frozen pose after an outage was once mistaken for a landing at 5 m, which stopped the motors.
#[test]
fn a_frozen_pose_after_an_outage_is_no_landing() {
    for gap_ms in [300, 1_000] {
        for noise in [false, true] {
            let seen = fly(5.0, 0.0, Frozen::After(gap_ms, noise));
            println!("{gap_ms} ms, noise {noise}: {seen:?}");
            assert_eq!(seen.ended, Some(EndReason::StateLost), "{seen:?}");
        }
    }
}
