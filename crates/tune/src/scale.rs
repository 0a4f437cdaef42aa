//! Scales of a vehicle's flights, computed from its own data.
//!
//! Every factor is 1 for the paper's vehicle on the rotors of the built-in scenario `hardware`.

use afbc::slowness;
use afbc_plant::Drag;
use afbc_types::Parameters;
use afbc_vehicles::Vehicle;
use libm::{hypot, sqrt, tan};

/// Largest force of a rotor of the paper's vehicle \[N\]. `PAPER_ROTORS` is the number of its rotors.
const PAPER_FORCE_MAX_N: f64 = 3.0;
const PAPER_ROTORS: f64 = 4.0;
/// Wind speed at which the drag of vehicles is compared \[m/s\].
const WIND_M_S: f64 = 5.0;
/// Largest length factor, to be multiplied by the square root of the arm factor.
const LENGTH_MAX: f64 = 3.0;
/// Largest tilt of a fast flight \[rad\]. `THRUST_SHARE` is the largest fraction of the thrust.
const TILT_MAX_RAD: f64 = 1.1;
const THRUST_SHARE: f64 = 0.85;

/// Factors from the paper's vehicle to another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct VehicleScale {
    /// Factor of times: slowness of the vehicle, from the lag of its rotors.
    pub(crate) time: f64,
    /// Factor of lengths: the factor of horizontal accelerations times the square of `time`, but at most three times
    /// the square root of `arm`.
    pub(crate) length: f64,
    /// Factor of accelerations: `length` divided by the square of `time`.
    pub(crate) acceleration: f64,
    /// Factor of lengths on the vehicle itself: ratio of the arms.
    pub(crate) arm: f64,
    /// Factor of forces: ratio of the weights.
    pub(crate) weight: f64,
    /// Factor of wind speeds, at most 1.5. With it, drag takes no larger share of the horizontal acceleration that the
    /// rotors allow than on the paper's vehicle.
    pub(crate) wind: f64,
    /// Thrust-to-weight ratio with all rotors at their largest force.
    thrust_to_weight: f64,
    /// Thrust-to-weight ratio with the battery's charge down to seven eighths.
    sustained: f64,
    gravity_m_s2: f64,
}

impl VehicleScale {
    /// Returns the factors of the paper's vehicle.
    pub(crate) fn paper() -> Self {
        VehicleScale {
            time: 1.0,
            length: 1.0,
            acceleration: 1.0,
            arm: 1.0,
            weight: 1.0,
            wind: 1.0,
            thrust_to_weight: paper_thrust_to_weight(),
            sustained: paper_thrust_to_weight(),
            gravity_m_s2: Parameters::<f64>::PAPER.gravity_m_s2,
        }
    }

    /// Returns the factors of `vehicle`; for none, those of the paper's vehicle.
    pub(crate) fn of(vehicle: Option<&Vehicle>) -> Self {
        let Some(vehicle) = vehicle else { return VehicleScale::paper() };
        let (own, paper) = (&vehicle.parameters, &Parameters::<f64>::PAPER);
        let thrust_to_weight = vehicle.force_max_n * vehicle.rotors.len() as f64 / own.weight_n();
        let time = f64::from(slowness(vehicle.lag_s()));
        let arm = own.arm_m / paper.arm_m;
        // Horizontal acceleration that the thrust allows in addition to carrying the weight. Never zero, since all
        // lengths would be zero then.
        let left = |ratio: f64, gravity_m_s2| gravity_m_s2 * sqrt((ratio * ratio - 1.0).max(0.1));
        let share = left(thrust_to_weight, own.gravity_m_s2) / left(paper_thrust_to_weight(), paper.gravity_m_s2);
        let length = (share * time * time).min(LENGTH_MAX * sqrt(arm));
        let drag = vehicle.realism.drag.as_ref().map(|drag| rates(drag, own, vehicle.rotors.len() as f64));
        let [linear, square] = rates(&Drag::PAPER, paper, PAPER_ROTORS);
        let taken_m_s2 = share * (linear + square * WIND_M_S) * WIND_M_S;
        let wind = drag.map_or(1.0, |rates| speed(rates, taken_m_s2) / WIND_M_S);
        VehicleScale {
            time,
            length,
            acceleration: length / (time * time),
            arm,
            weight: own.weight_n() / paper.weight_n(),
            wind: wind.min(1.5),
            thrust_to_weight,
            sustained: thrust_to_weight * sag(vehicle),
            gravity_m_s2: own.gravity_m_s2,
        }
    }

    /// Returns the factor on the thrust that matches `factor` on the paper's vehicle: both leave the same share of the
    /// thrust beyond the weight. The result is not less than `factor`.
    pub(crate) fn thrust(&self, factor: f64) -> f64 {
        let (ratio, paper) = (self.sustained, paper_thrust_to_weight());
        if ratio >= paper || factor >= 1.0 {
            return factor;
        }
        let share = (paper * factor - 1.0) / (paper - 1.0);
        ((1.0 + share * (ratio - 1.0)) / ratio).clamp(factor, 1.0)
    }

    /// Returns the factor on the mass that matches `factor` on the paper's vehicle.
    pub(crate) fn mass(&self, factor: f64) -> f64 {
        let light = self.thrust(1.0 / factor);
        if light > 1.0 / factor { 1.0 / light } else { factor }
    }

    /// Returns the largest horizontal acceleration of a fast flight \[m/s2\], which uses 85 % of the thrust and at most
    /// 1.1 rad of tilt.
    pub(crate) fn horizontal_m_s2(&self) -> f64 {
        let ratio = (THRUST_SHARE * self.thrust_to_weight).max(1.02);
        self.gravity_m_s2 * sqrt(ratio * ratio - 1.0).min(tan(TILT_MAX_RAD))
    }

    /// Returns the tilt that this horizontal acceleration needs \[rad\].
    pub(crate) fn tilt_rad(&self, acceleration_m_s2: f64) -> f64 {
        libm::atan2(acceleration_m_s2, self.gravity_m_s2)
    }
}

fn paper_thrust_to_weight() -> f64 {
    PAPER_FORCE_MAX_N * PAPER_ROTORS / Parameters::<f64>::PAPER.weight_n()
}

/// Returns the share of the largest thrust that remains when the battery is down to seven eighths of its charge and
/// carries the vehicle.
fn sag(vehicle: &Vehicle) -> f64 {
    let Some(battery) = &vehicle.realism.rotors.battery else { return 1.0 };
    let (own, rotors) = (&vehicle.parameters, vehicle.rotors.len() as f64);
    let hover_rad_s = sqrt(own.weight_n() / rotors / own.thrust_factor_n_s2);
    let shafts_w = rotors * own.drag_factor_n_m_s2 * hover_rad_s * hover_rad_s * hover_rad_s;
    let open_v = battery.full_v - 0.125 * (battery.full_v - battery.empty_v);
    let current_a = (shafts_w / battery.efficiency + battery.avionics_w) / open_v;
    let share = (open_v - battery.resistance_ohm * current_a) / battery.full_v;
    (share * share).clamp(0.1, 1.0)
}

/// Returns the horizontal deceleration of a hovering vehicle per airspeed \[1/s\] and per squared airspeed \[1/m\].
fn rates(drag: &Drag, vehicle: &Parameters<f64>, rotors: f64) -> [f64; 2] {
    let hover_rad_s = sqrt(vehicle.weight_n() / rotors / vehicle.thrust_factor_n_s2);
    let area_m2 = hypot(drag.area_m2.x, drag.area_m2.y) / core::f64::consts::SQRT_2;
    [
        drag.blade_n_s2_m * rotors * hover_rad_s / vehicle.mass_kg,
        0.5 * drag.air_density_kg_m3 * area_m2 / vehicle.mass_kg,
    ]
}

/// Returns the airspeed at which drag of these `rates` decelerates by this much \[m/s\]; infinite without drag.
fn speed([linear, square]: [f64; 2], deceleration_m_s2: f64) -> f64 {
    // This form of the root also holds for drag without a square term, where the usual form gives 0/0.
    2.0 * deceleration_m_s2 / (linear + sqrt(linear * linear + 4.0 * square * deceleration_m_s2))
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]
    use super::*;

    #[test]
    fn every_factor_is_1_for_the_papers_vehicle() {
        let paper = afbc_vehicles::built_in("paper").unwrap().read().unwrap();
        let scale = VehicleScale::of(Some(&paper));
        let factors = [scale.time, scale.length, scale.acceleration, scale.arm, scale.weight, scale.wind];
        // The file's largest force is computed from a rotor speed, so it differs by rounding.
        assert!(factors.iter().all(|factor| (factor - 1.0).abs() < 1e-12), "{scale:?}");
        let scale = VehicleScale::paper();
        assert_eq!((scale.thrust(0.6), scale.mass(1.3), scale.mass(0.8)), (0.6, 1.3, 0.8));
    }

    #[test]
    fn weak_rotors_lose_less_and_carry_less() {
        for vehicle in ["crazyflie", "iris"] {
            let vehicle = afbc_vehicles::built_in(vehicle).unwrap().read().unwrap();
            let scale = VehicleScale::of(Some(&vehicle));
            assert!(scale.thrust(0.6) * scale.sustained > 1.1, "{}", vehicle.name);
            assert!(scale.sustained / scale.mass(1.3) > 1.1, "{}", vehicle.name);
            assert!((0.6..1.0).contains(&scale.thrust(0.6)) && (1.0..1.3).contains(&scale.mass(1.3)));
            assert!(scale.wind <= 1.0, "{}", vehicle.name);
        }
    }
}
