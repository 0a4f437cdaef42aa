//! Flies a new control law, PD on position and attitude, in a closed loop with the plant: `cargo run --example
//! own_law`.
#![allow(clippy::unwrap_used, reason = "an example whose parameters are not valid should say so")]

use afbc_control::{Action, FlightController, Mixer, Trace};
use afbc_sim::flight::{LawOnly, World, lockstep};
use afbc_types::{Inputs, Parameters, Setpoint, State};
use core::ops::ControlFlow;

/// The law's fixed parameters. State that changes in flight belongs in the type `Memory`.
struct OwnLaw {
    vehicle: Parameters,
    mixer: Mixer,
}

impl FlightController for OwnLaw {
    type Memory = ();

    fn dt_s(&self) -> f32 {
        0.001
    }

    fn mixer(&self) -> &Mixer {
        &self.mixer
    }

    fn decide(&self, (): &mut (), state: &State, setpoint: &Setpoint, _fresh: bool) -> Action {
        let Parameters { mass_kg, gravity_m_s2, .. } = self.vehicle;
        let effectiveness = self.vehicle.effectiveness();
        let (e, e_dot) = (setpoint.position_m - state.position_m, setpoint.velocity_m_s - state.velocity_m_s);
        let acceleration = e * 2.0 + e_dot * 2.5 + setpoint.acceleration_m_s2;
        // At small angles and with the heading along x, positive pitch tilts the thrust to +x, and positive roll to -y.
        let tilt_rad = [-acceleration.y, acceleration.x].map(|a| (a / gravity_m_s2).clamp(-0.4, 0.4));
        let (eta, omega) = (state.attitude_rad, state.rates_rad_s);
        let moment = |error: f32, rate: f32| 100.0 * error - 18.0 * rate;
        self.mixer.action(&Inputs {
            roll_n: moment(tilt_rad[0] - eta.x, omega.x) / effectiveness.x,
            pitch_n: moment(tilt_rad[1] - eta.y, omega.y) / effectiveness.y,
            yaw_n: 0.5 * (setpoint.yaw_rad - eta.z) - 0.5 * omega.z,
            thrust_n: mass_kg * (gravity_m_s2 + acceleration.z),
        })
    }

    fn trace((): &()) -> Trace {
        Trace::default()
    }
}

fn main() {
    let scenario = afbc_scenario::built_in("hover").unwrap().read().unwrap();
    let vehicle = scenario.vehicle.to_f32();
    let law = OwnLaw { vehicle, mixer: Mixer::new(vehicle, 3.0).unwrap() };
    let (mut world, mut distance_m) = (World::new(&scenario, 0.001).unwrap(), 0.0);
    let Ok(end) = lockstep(&mut world, &mut LawOnly::new(law), scenario.duration_s, |sample| {
        distance_m = (sample.motion.position_m - sample.reference.position_m).norm();
        ControlFlow::Continue(())
    });
    println!("{}: {:?}, {distance_m:.4} m from its setpoint at the end", scenario.name, end.lost);
    assert!(end.lost.is_none() && distance_m < 0.05);
}
