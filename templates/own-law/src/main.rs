//! A law of one's own beside the built-in ones: `cargo run --release -- compare --controllers afbc,pd`.

use afbc_scenario::{OwnController, OwnGain, OwnLaw, OwnVehicle};
use afbc_types::{Inputs, Setpoint, State};
use std::process::ExitCode;

/// PD on position and attitude, for small angles and a heading along x.
struct Pd {
    vehicle: OwnVehicle,
}

impl OwnController for Pd {
    fn step(&mut self, state: &State, setpoint: &Setpoint, _fresh: bool) -> Inputs {
        let [position_p, position_d, tilt_p, tilt_d, ..] = self.vehicle.gains;
        let parameters = &self.vehicle.parameters;
        let (e, e_dot) = (setpoint.position_m - state.position_m, setpoint.velocity_m_s - state.velocity_m_s);
        let acceleration = e * position_p + e_dot * position_d + setpoint.acceleration_m_s2;
        // Positive pitch tilts the thrust to +x, positive roll to -y.
        let tilt = |a: f32| (a / parameters.gravity_m_s2).clamp(-0.4, 0.4);
        let (eta, omega, per_newton) = (state.attitude_rad, state.rates_rad_s, parameters.effectiveness());
        let turn = |wanted: f32, angle: f32, rate: f32| tilt_p * (wanted - angle) - tilt_d * rate;
        Inputs {
            roll_n: turn(tilt(-acceleration.y), eta.x, omega.x) / per_newton.x,
            pitch_n: turn(tilt(acceleration.x), eta.y, omega.y) / per_newton.y,
            yaw_n: (2.0 * (setpoint.yaw_rad - eta.z) - 2.0 * omega.z) / per_newton.z,
            thrust_n: parameters.mass_kg * (parameters.gravity_m_s2 + acceleration.z),
        }
    }
}

fn main() -> ExitCode {
    let law = OwnLaw::new("pd", |vehicle| Pd { vehicle: *vehicle }).title("PD").gains([
        OwnGain::new("position_p_1_s2", "1/s2", 2.0, [0.1, 50.0]),
        OwnGain::new("position_d_1_s", "1/s", 2.5, [0.1, 50.0]),
        OwnGain::new("tilt_p_1_s2", "1/s2", 100.0, [5.0, 2000.0]),
        OwnGain::new("tilt_d_1_s", "1/s", 18.0, [1.0, 200.0]),
    ]);
    sitl::main_with([law])
}
