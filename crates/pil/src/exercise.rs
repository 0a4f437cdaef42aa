//! A test flight with every kind of event, as the bytes that reach the vehicle. Used for comparisons and budgets.

use afbc_hil::Station;
use afbc_mavlink::{Uplink, VehicleCommand};
use afbc_types::{Setpoint, State};
use nalgebra::Vector3;

/// Tick before which the arm command is sent.
const ARMED: u64 = 1_500;
/// Number of ticks in the flight.
pub const TICKS: u64 = 6_000;

/// Returns the bytes that reach the link before `tick`: a flight with every kind of link fault. Must be called for
/// consecutive ticks from 0 on.
pub fn bytes_of_tick(station: &mut Station, tick: u64) -> Vec<u8> {
    // The vehicle is at rest until it is armed.
    let (state, setpoint) = motion(tick.saturating_sub(ARMED) as f32 * 1e-3);
    // The states have two gaps: a short gap that ends while coasting, and a long gap that ends in a descent.
    let tracked = !(2_500..2_600).contains(&tick) && !(4_000..5_000).contains(&tick);
    if tracked {
        station.track(tick * 1000, state);
    }
    if tick.is_multiple_of(10) {
        station.say(&Uplink::Setpoint(setpoint));
    }
    // Request the mode repeatedly, since the gaps end it.
    if tick > 100 && tick.is_multiple_of(250) {
        station.follow();
    }
    match tick {
        // The first request is refused, since the tick rate is not known yet.
        100 | ARMED => station.say(&Uplink::Command(VehicleCommand::Arm)),
        // The motion does not follow the rotors, so AFBC's monitor trips repeatedly.
        3_000 | 5_200 => station.say(&Uplink::Command(VehicleCommand::Engage)),
        5_900 => station.say(&Uplink::Command(VehicleCommand::Kill)),
        _ => (),
    }
    let mut bytes = station.take();
    // 97 is coprime with the other periods, so that faults hit each of their phases.
    match tick % 97 {
        13 => bytes.truncate(bytes.len() / 2),
        31 => bytes.extend_from_slice(b"\xFD\xFDnoise\x00\xFF"),
        53 => bytes.iter_mut().skip(20).take(1).for_each(|byte| *byte ^= 0x10),
        _ => (),
    }
    bytes
}

/// Returns a motion near hover that excites every subsystem; `t` is in seconds.
pub fn motion(t: f32) -> (State, Setpoint) {
    let wave = |rate: f32| (rate * t).sin();
    let state = State {
        position_m: Vector3::new(0.5 * wave(0.7), 0.4 * wave(1.1), 0.3 * wave(0.9)),
        velocity_m_s: Vector3::new(0.6 * wave(1.7), 0.5 * wave(1.3), 0.4 * wave(2.3)),
        attitude_rad: Vector3::new(0.2 * wave(3.1), 0.2 * wave(2.7), 0.5 * wave(0.6)),
        rates_rad_s: Vector3::new(0.8 * wave(5.1), 0.7 * wave(4.7), 0.4 * wave(3.9)),
    };
    let setpoint = Setpoint {
        position_m: Vector3::new(0.3 * wave(0.4), 0.3 * wave(0.5), 0.5),
        velocity_m_s: Vector3::new(0.2 * wave(0.8), 0.2 * wave(0.6), 0.0),
        yaw_rad: 0.5 * wave(0.3),
        ..Setpoint::default()
    };
    (state, setpoint)
}
