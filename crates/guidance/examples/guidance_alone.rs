//! Flies the guidance alone, with a vehicle that follows the setpoint exactly: takes off, flies to a place, holds
//! there.
//! `cargo run -p afbc-guidance --example guidance_alone`.
#![allow(clippy::unwrap_used, reason = "an example whose settings are not valid should say so")]

use afbc_flight_core::{Mode, Ticketed};
use afbc_guidance::{AvailableThrust, FailedSensors, Guidance, GuidanceInputs, Order, Orders, Settings};
use afbc_types::State;
use nalgebra::Vector3;

fn main() {
    let mut guidance = Guidance::new(Settings::DEFAULT).unwrap();
    let (mut orders, mut state) = (Orders::default(), State::default());
    let lift = AvailableThrust { most_m_s2: 20.0, gravity_m_s2: 9.81, given_m_s2: Some(9.81) };
    for ms in 1..=20_000_u64 {
        let order = match ms {
            1500 => Some(Order::TakeOff(Some(2.0))),
            8000 => Some(Order::GoTo { position_m: Vector3::new(5.0, 0.0, 2.0), yaw_rad: f32::NAN, speed_m_s: None }),
            _ => None,
        };
        if let Some(order) = order {
            orders.given.push_back(Ticketed { value: order, ticket: 0 }).unwrap();
        }
        let inputs = GuidanceInputs {
            now_us: 1000 * ms,
            dt_s: 1e-3,
            state: Some(&state),
            reset: None,
            core: if ms < 1200 { Mode::Disarmed } else { Mode::Flying },
            airborne: state.position_m.z > 0.1,
            rested: ms > 1000,
            battery: None,
            sensors: FailedSensors::default(),
            available_thrust: lift,
        };
        let guided = guidance.tick(&inputs, &orders);
        orders.given.pop_front();
        if let Some((_, answer)) = guided.answer {
            println!("{ms:5} ms: answer {answer:?}");
        }
        // While armed on the ground, the setpoint is where the vehicle stands.
        if let (true, Some(setpoint)) = (ms > 1500, guided.setpoint) {
            (state.position_m, state.velocity_m_s) = (setpoint.position_m, setpoint.velocity_m_s);
        }
        if ms.is_multiple_of(2000) {
            println!("{ms:5} ms: {:?} at {:.2?} m", guidance.mode(), state.position_m.as_slice());
        }
    }
    assert!((state.position_m - Vector3::new(5.0, 0.0, 2.0)).norm() < 0.01);
}
