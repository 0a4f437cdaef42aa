//! The capability of a vehicle and the demands of a reference on it. `docs/reference/suites.md` has the formulas.

use super::bisection::largest;
use super::mismatch::ModelMismatch;
use afbc_plant::BatteryModel;
use afbc_scenario::trajectory::SAMPLES;
use afbc_scenario::trajectory::polynomial::peaks;
use afbc_scenario::trajectory::{Reference, Trajectory};
use afbc_types::Rotor;
use afbc_vehicles::Vehicle;
use core::f64::consts::TAU;
use libm::{atan2, hypot, sqrt};

/// Fraction of the thrust beyond the weight that a path may ask for.
const THRUST_SHARE: f64 = 0.6;
/// Smallest thrust-to-weight ratio that a change may leave.
const RESERVE: f64 = 1.15;
/// Largest tilt that a path may ask for \[rad\].
const TILT_MAX_RAD: f64 = 1.0;
/// Fraction of the angular acceleration available in hover that a path may ask for.
const TURN_SHARE: f64 = 0.5;
/// Delay of a law in addition to the rotors' lag \[s\].
const LAW_S: f64 = 0.01;
/// Highest frequency of a path, multiplied by the sum of the rotors' lag and the law's delay.
const FREQUENCY_SHARE: f64 = 1.0 / 3.0;
/// Height of the paths \[m\]. Turbulence is no stronger above.
pub(super) const HEIGHT_M: f64 = 3.0;

/// Capability of a vehicle in the air, which only its rotors carry.
#[derive(Clone, Copy, Debug)]
pub(super) struct Power {
    gravity_m_s2: f64,
    arm_m: f64,
    /// Thrust of all rotors on a full battery, divided by the mass \[m/s2\].
    thrust_m_s2: f64,
    /// Smaller one of the roll and pitch angular accelerations available in hover \[rad/s2\].
    tilt_rad_s2: f64,
    yaw_rad_s2: f64,
    /// Highest frequency of a path \[rad/s\].
    frequency_rad_s: f64,
    /// Blade drag per airspeed, divided by the mass \[1/s\], and body drag per squared airspeed, divided by the mass
    /// \[1/m\].
    drag: [f64; 2],
    wind_m_s: f64,
}

impl Power {
    /// Returns the capability of `vehicle` in still air.
    pub(super) fn of(vehicle: &Vehicle) -> Self {
        let parameters = &vehicle.parameters;
        let (mass_kg, count) = (parameters.mass_kg, vehicle.rotors.len() as f64);
        let share = vehicle.realism.rotors.battery.map_or(1.0, |battery| speed_share(vehicle, &battery));
        let most_n = vehicle.force_max_n * share * share;
        let hover_n = parameters.weight_n() / count;
        // A rotor may gain as much thrust as another one loses.
        let change_n = (most_n - hover_n).min(hover_n).max(0.0);
        let sum = |lever: fn(&Rotor<f64>) -> f64| vehicle.rotors.iter().map(|rotor| lever(rotor).abs()).sum::<f64>();
        let inertia = &parameters.inertia_kg_m2;
        let roll = sum(|rotor| rotor.y) / inertia.x;
        let pitch = sum(|rotor| rotor.x) / inertia.y;
        let yaw_m = parameters.drag_factor_n_m_s2 / parameters.thrust_factor_n_s2;
        let drag = vehicle.realism.drag.map_or([0.0; 2], |drag| {
            let speed_rad_s = vehicle.realism.rotors.max_rad_s * share;
            let area_m2 = drag.area_m2.x.max(drag.area_m2.y);
            [count * drag.blade_n_s2_m * speed_rad_s / mass_kg, 0.5 * drag.air_density_kg_m3 * area_m2 / mass_kg]
        });
        Power {
            gravity_m_s2: parameters.gravity_m_s2,
            arm_m: parameters.arm_m,
            thrust_m_s2: count * most_n / mass_kg,
            tilt_rad_s2: change_n * parameters.arm_m * roll.min(pitch),
            yaw_rad_s2: change_n * yaw_m * count / inertia.z,
            frequency_rad_s: FREQUENCY_SHARE / (vehicle.realism.rotors.time_constant_s + LAW_S),
            drag,
            wind_m_s: 0.0,
        }
    }

    /// Returns the capability under this change.
    #[must_use]
    pub(super) fn under(mut self, change: &ModelMismatch) -> Self {
        match change {
            ModelMismatch::Wind(wind_m_s) => self.wind_m_s = wind_m_s.norm(),
            // The turbulence counts as a wind of two standard deviations.
            ModelMismatch::Turbulence(turbulence) => self.wind_m_s = 2.0 * turbulence.at(HEIGHT_M).horizontal_m_s,
            // The rotor on the payload's side carries more than the others.
            ModelMismatch::Payload { share, ahead_m, left_m, .. } => {
                self.thrust_m_s2 /= 1.0 + share + 2.0 * share * hypot(*ahead_m, *left_m) / self.arm_m;
            }
            ModelMismatch::Mass(factor) => self.thrust_m_s2 /= factor,
            // The other rotors cannot give more than the weak one without turning the vehicle.
            ModelMismatch::Rotor { efficiency, .. } => self.thrust_m_s2 *= efficiency,
            ModelMismatch::Drag(factor) => self.drag = self.drag.map(|drag| drag * factor),
            ModelMismatch::Nothing | ModelMismatch::Older(_) => {}
        }
        self
    }

    /// Returns `change`, reduced as far as needed to leave a reserve of thrust.
    pub(super) fn fitted(&self, change: &ModelMismatch) -> ModelMismatch {
        change.scaled(largest(1.0, |share| self.under(&change.scaled(share)).hovers()))
    }

    /// True if the vehicle can hover with a reserve.
    fn hovers(&self) -> bool {
        let gravity_m_s2 = self.gravity_m_s2;
        self.thrust_m_s2 >= RESERVE * gravity_m_s2 && self.asked(&Reference::default()) <= 1.0
    }

    /// Returns the largest fraction of the capability that `trajectory` asks for at any of `times_s`.
    pub(super) fn asked_by(&self, trajectory: &Trajectory, times_s: &[f64]) -> f64 {
        let frequency = fastest_rad_s(trajectory) / self.frequency_rad_s;
        times_s.iter().map(|time_s| self.asked(&trajectory.at(*time_s))).fold(frequency, f64::max)
    }

    /// Returns the fraction of the capability that a reference asks for.
    fn asked(&self, reference: &Reference) -> f64 {
        let g = self.gravity_m_s2;
        let airspeed_m_s = reference.velocity_m_s.norm() + self.wind_m_s;
        let [blades, body] = self.drag;
        // Assumes the worst case: the wind always blows against the vehicle.
        let level = reference.acceleration_m_s2.xy().norm() + (blades + body * airspeed_m_s) * airspeed_m_s;
        let up = g + reference.acceleration_m_s2.z;
        // The minimum avoids a division by zero. Without spare thrust, any demand beyond the weight is then far too
        // large.
        let spare = (self.thrust_m_s2 - g).max(f64::MIN_POSITIVE);
        [
            (hypot(level, up) - g) / (THRUST_SHARE * spare),
            atan2(level, up) / TILT_MAX_RAD,
            reference.snap_m_s4.norm() / g / (TURN_SHARE * self.tilt_rad_s2),
            reference.yaw_acceleration_rad_s2.abs() / (TURN_SHARE * self.yaw_rad_s2),
        ]
        .into_iter()
        // 0/0 means that nothing is asked of a capability that the vehicle lacks, which counts as no demand.
        .filter(|share| !share.is_nan())
        .fold(0.0, f64::max)
    }
}

/// Returns the fraction of their largest speed that the rotors reach when a full battery drives all of them.
fn speed_share(vehicle: &Vehicle, battery: &BatteryModel) -> f64 {
    let speed_rad_s = vehicle.realism.rotors.max_rad_s;
    let torque = vehicle.parameters.drag_factor_n_m_s2 * vehicle.rotors.len() as f64;
    let full_w = torque * speed_rad_s * speed_rad_s * speed_rad_s;
    let half_v = 0.5 * (battery.empty_v + (battery.full_v - battery.empty_v) * battery.initial_charge);
    let reached = |share: f64| {
        let power_w = full_w * share * share * share / battery.efficiency + battery.avionics_w;
        // The voltage is the larger root of V^2 - V_open V + R P = 0. Beyond the battery's largest power, it is half of
        // V_open.
        let voltage_v = half_v + sqrt((half_v * half_v - battery.resistance_ohm * power_w).max(0.0));
        voltage_v / battery.full_v
    };
    largest(1.0, |share| share <= reached(share))
}

/// Returns the highest frequency in a path \[rad/s\].
fn fastest_rad_s(trajectory: &Trajectory) -> f64 {
    match trajectory {
        Trajectory::Circle { period_s, .. } => TAU / period_s,
        Trajectory::Lissajous { sines, .. } => {
            let moving = sines.iter().filter(|sine| sine.amplitude_m != 0.0);
            moving.map(|sine| TAU / sine.period_s).fold(0.0, f64::max)
        }
        // The acceleration along a leg resembles one period of a sine.
        Trajectory::Waypoints(waypoints) => {
            let legs = waypoints.iter().zip(waypoints.iter().skip(1));
            legs.map(|(from, to)| TAU / (to.time_s - from.time_s)).fold(0.0, f64::max)
        }
        // The largest jerk and the largest acceleration are treated as if they belonged to a single sine.
        Trajectory::Polynomials(pieces) => {
            let [_, acceleration, jerk, _] = peaks(pieces, SAMPLES);
            if acceleration > 0.0 { jerk / acceleration } else { 0.0 }
        }
        Trajectory::Paper | Trajectory::Hover { .. } | Trajectory::Step { .. } => 0.0,
    }
}
