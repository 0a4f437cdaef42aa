//! Manual modes: turns the pilot's sticks into a mode's output.

use crate::available_thrust::AvailableThrust;
use crate::limiter::LimiterTarget;
use crate::mode::FlightMode;
use crate::mode_io::{ModeInputs, ModeOutput, Shaping};
use crate::order::Sticks;
use crate::settings::FlightModeSettings;
use afbc_control::math::{cos, max, min, sin, tan};
use afbc_flight_core::RateTarget;
use afbc_types::Setpoint;
use nalgebra::Vector3;

/// Throttle above which an armed vehicle on the ground takes off.
const LIFTS: f32 = 0.1;
/// Largest deflection that counts as centred.
const CENTRE: f32 = 0.03;

/// True if every stick is within -1 to 1.
pub(crate) fn is_plausible(sticks: &Sticks) -> bool {
    [sticks.roll, sticks.pitch, sticks.throttle, sticks.yaw].iter().all(|stick| stick.abs() <= 1.0)
}

/// Returns the output of a [manual](FlightMode::is_manual) mode for these sticks.
pub(crate) fn fly(mode: FlightMode, sticks: &Sticks, inputs: &ModeInputs<'_>, lift: &AvailableThrust) -> ModeOutput {
    let centred = |stick: f32| if stick.abs() <= CENTRE { 0.0 } else { stick };
    let (forward, left) = (centred(sticks.pitch), -centred(sticks.roll));
    let (throttle, yaw_rate_rad_s) = (centred(sticks.throttle), -centred(sticks.yaw) * inputs.limits.yaw_rate_rad_s);
    let yaw_rad = if mode == FlightMode::Stabilised { inputs.state.attitude_rad.z } else { inputs.present.yaw_rad };
    let (s, c) = (sin(yaw_rad), cos(yaw_rad));
    let turned = |forward: f32, left: f32| [c * forward - s * left, s * forward + c * left];
    let most_m_s = if throttle > 0.0 { inputs.limits.up_m_s } else { inputs.limits.down_m_s };
    let climb_m_s = throttle * most_m_s;
    let aim = LimiterTarget { yaw_rate_rad_s, ..inputs.stop() };
    let lifts = throttle > LIFTS;
    let tilt_m_s2 = |stick: f32| lift.gravity_m_s2 * tan(stick * inputs.flying.stick_tilt_rad);
    let thrust_m_s2 = || {
        let hover_m_s2 = lift.gravity_m_s2;
        let room_m_s2 = if throttle > 0.0 { max(lift.most_m_s2 - hover_m_s2, 0.0) } else { hover_m_s2 };
        min(hover_m_s2 + throttle * room_m_s2, lift.most_m_s2)
    };
    let shaping = match mode {
        FlightMode::Position => {
            let [x, y] = turned(forward * aim.speed_m_s, left * aim.speed_m_s);
            Shaping::Limited(LimiterTarget { velocity_m_s: Vector3::new(x, y, climb_m_s), ..aim })
        }
        FlightMode::Altitude => {
            let velocity_m_s = Vector3::new(f32::NAN, f32::NAN, climb_m_s);
            Shaping::Leaning(LimiterTarget { velocity_m_s, ..aim }, turned(tilt_m_s2(forward), tilt_m_s2(left)))
        }
        FlightMode::Acro => {
            let FlightModeSettings { acro_roll_deg_s, acro_pitch_deg_s, acro_yaw_deg_s, .. } = inputs.flying;
            // Sticks have no dead band around the centre here, because the pilot's transmitter may add its own.
            let rates_deg_s =
                [sticks.roll * acro_roll_deg_s, sticks.pitch * acro_pitch_deg_s, -sticks.yaw * acro_yaw_deg_s];
            let thrust = thrust_m_s2() / lift.most_m_s2;
            Shaping::Turning(RateTarget { rates_rad_s: Vector3::from(rates_deg_s).map(f32::to_radians), thrust })
        }
        _ => {
            let [x, y] = turned(tan(forward * inputs.flying.stick_tilt_rad), tan(left * inputs.flying.stick_tilt_rad));
            let up = Vector3::new(x, y, 1.0).normalize();
            Shaping::Direct(Setpoint { yaw_rate_rad_s, ..lift.setpoint(inputs.state, up, thrust_m_s2()) })
        }
    };
    ModeOutput { shaping, lifts, lands: false, done: false }
}
