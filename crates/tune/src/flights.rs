//! Flights that evaluate gains, made from a vehicle's own data.
//!
//! Every flight is based on the built-in scenario `hardware`: rotors with a lag of 20 ms, a delay of 1 ms and at most 3
//! N each, and a noisy state. The first flight is `hardware` itself; each of the others adds one disturbance. Three
//! flights use an estimate from the sensors of the built-in scenarios `mocap` and `outdoor`. Three are fast, and one
//! turns corners.
//!
//! On another vehicle, rotors, battery, drag and ground are the vehicle's own. [`VehicleScale`] scales the flights:
//! times by the rotors' lag, lengths and accelerations by the spare thrust, and wind by the drag. Losses of thrust and
//! payloads leave the same share of the reserve.

use crate::builder::{FlightBuilder, ONSET_S, TrainingFlight, read};
use crate::fast;
use crate::scale::VehicleScale;
use afbc_plant::instruments::{BarometerModel, GnssModel, ImuModel, MagnetometerModel, TrackerModel};
use afbc_plant::{
    BatteryModel, Contact, Environment, GroundEffect, Gust, GustKind, InstrumentSuite, Payload, PlantParameter,
    RotorFault, Sensing, Turbulence,
};
use afbc_scenario::trajectory::{Sine, Trajectory, Waypoint};
use afbc_scenario::{Outage, Scenario};
use afbc_types::Axis;
use afbc_vehicles::Vehicle;
use nalgebra::Vector3;
use std::error::Error;

/// A step of the reference comes this long before errors count, so that mainly the settling counts, on the paper's
/// vehicle \[s\].
const SETTLING_S: f64 = 0.5;

/// Returns the flights used in the search for gains, on the paper's vehicle.
///
/// # Errors
/// None in practice, since a test flies these flights.
pub fn training() -> Result<Vec<Scenario>, Box<dyn Error>> {
    FlightBuilder::new(None).training()
}

/// Returns the flights used in the search for gains of `vehicle`. For the paper's vehicle, with any gains in its file,
/// these are the flights of [`training`].
///
/// # Errors
/// The first number out of range, if the vehicle cannot fly such a flight.
pub fn training_on(vehicle: &Vehicle) -> Result<Vec<Scenario>, Box<dyn Error>> {
    FlightBuilder::new(Some(vehicle)).training()
}

/// Returns the held-out flights on the paper's vehicle. The search does not use them, so they show overfitting.
///
/// # Errors
/// None in practice, since a test flies these flights.
pub fn held_out() -> Result<Vec<Scenario>, Box<dyn Error>> {
    FlightBuilder::new(None).held_out()
}

/// Returns the held-out flights on `vehicle`. For the paper's vehicle, these are the flights of [`held_out`].
///
/// # Errors
/// Those of [`training_on`].
pub fn held_out_on(vehicle: &Vehicle) -> Result<Vec<Scenario>, Box<dyn Error>> {
    FlightBuilder::new(Some(vehicle)).held_out()
}
impl FlightBuilder<'_> {
    fn training(&self) -> Result<Vec<Scenario>, Box<dyn Error>> {
        let VehicleScale { length, time, .. } = self.scale;
        let to = Vector3::new(0.6, -0.4, 1.0) * length;
        let eight =
            |name, change| TrainingFlight { trajectory: self.eight(8.0), change, ..TrainingFlight::new(name, 15.0) };
        let mut late = self.windy(eight("late", None))?;
        late.realism.rotors.delay_s = 0.004 * time;
        let mut turbulent = self.scenario(TrainingFlight::new("turbulence", 20.0))?;
        self.drag(&mut turbulent);
        turbulent.realism.wind.turbulence = Some(self.turbulence(Turbulence::MODERATE));
        let weak = Some((PlantParameter::ThrustFactor, self.scale.thrust(0.6)));
        let heavy = Some((PlantParameter::Mass, self.scale.mass(1.3)));
        let old_s = 0.02 * time;
        let [lemniscate, circle] = fast::training(self)?;
        Ok(vec![
            self.hardware()?,
            self.scenario(TrainingFlight { trajectory: self.step(to, 1.0), ..TrainingFlight::new("step", 12.0) })?,
            turbulent,
            self.scenario(TrainingFlight { change: weak, ..TrainingFlight::new("weak", 8.0) })?,
            self.windy(eight("heavy", heavy))?,
            late,
            // An outage begins at the onset of each gust and parameter change.
            Scenario {
                name: "outages".into(),
                duration_s: 45.0,
                ..blind(self.hardware()?, &[7.45, 14.95, 19.9, 22.45, 29.95, 37.45])
            },
            blind(
                self.scenario(TrainingFlight {
                    trajectory: self.step(-to, -1.0),
                    ..TrainingFlight::new("blind-step", 12.0)
                })?,
                &[self.step_s() + 0.5],
            ),
            self.landing("landing", 2.0)?,
            self.upset("upset", 1.0)?,
            self.course("course", 1.5)?,
            self.flight(Hardware { state_delay_s: old_s, ..Hardware::default() }, "old", eight("", None))?,
            self.flight(Hardware { lag: 1.0 + 1.0 / time, ..Hardware::default() }, "slow", eight("", None))?,
            self.flight(Hardware { rate_noise_rad_s: 0.05, ..Hardware::default() }, "noisy", eight("", None))?,
            self.flight(
                Hardware { tracker: true, state_delay_s: old_s, ..Hardware::default() },
                "tracker",
                eight("", None),
            )?,
            self.rotor("rotor", eight("", None), 0.65)?,
            self.payload("payload", eight("", None), 0.1)?,
            self.sensed("mocap", eight("", None), |_| {})?,
            self.sensed("outdoor", eight("", None), |_| {})?,
            lemniscate,
            circle,
            self.legs("legs", 2.5)?,
            tracked(fast::circle(self, "circle-mocap", 2.0, 0.3)?)?,
        ])
    }

    fn held_out(&self) -> Result<Vec<Scenario>, Box<dyn Error>> {
        let VehicleScale { length, time, wind: air, .. } = self.scale;
        let fast =
            |name, change| TrainingFlight { trajectory: self.eight(6.0), change, ..TrainingFlight::new(name, 20.0) };
        let mut delayed = self.windy(fast("delayed", None))?;
        delayed.sensing.delay_s = 0.003 * time;
        let mut wind = self.scenario(fast("wind", None))?;
        self.drag(&mut wind);
        wind.realism.wind.steady_m_s = Vector3::new(4.0, 2.0, 0.0) * air;
        wind.realism.wind.turbulence = Some(self.turbulence(Turbulence::LIGHT));
        let heavy = Some((PlantParameter::Mass, self.scale.mass(1.15)));
        let [lemniscate, circle] = fast::held_out(self)?;
        let mut flights = vec![
            Scenario { seed: 1001, ..self.hardware()? },
            self.scenario(TrainingFlight {
                trajectory: self.step(Vector3::new(-0.4, 0.8, -0.3) * length, 1.5),
                ..TrainingFlight::new("step-back", 12.0)
            })?,
            wind,
            self.windy(fast("light", Some((PlantParameter::Mass, 0.8))))?,
            self.windy(fast("inert", Some((PlantParameter::Inertia, 1.75))))?,
            delayed,
            blind(self.scenario(fast("outages", heavy))?, &[ONSET_S - 0.05, 8.3, 11.0, 13.7, 16.4]),
            self.landing("landing-fast", 1.2)?,
            self.upset("upset-back", -0.8)?,
            self.course("course-back", -1.2)?,
            self.flight(Hardware { state_delay_s: 0.012 * time, ..Hardware::default() }, "old", fast("", None))?,
            self.flight(Hardware { lag: 0.5, ..Hardware::default() }, "quick", fast("", None))?,
            self.flight(Hardware { lag: 1.5, rate_noise_rad_s: 0.02, ..Hardware::default() }, "noisy", fast("", None))?,
            self.flight(
                Hardware { tracker: true, state_delay_s: 0.01 * time, rate_noise_rad_s: 0.02, ..Hardware::default() },
                "tracker",
                fast("", None),
            )?,
            self.rotor("rotor", fast("", None), 0.8)?,
            self.payload("payload", fast("", None), -0.06)?,
            self.sensed("mocap", fast("", None), |suite| {
                suite.imu = suite.imu.map(|imu| ImuModel { gyro: ImuModel::MPU_6000.gyro, ..imu });
                suite.tracker = Some(TrackerModel { delay_s: 0.03, ..TrackerModel::MOCAP_100 });
            })?,
            self.sensed("outdoor", fast("", None), |suite| {
                (suite.barometer, suite.magnetometer) =
                    (Some(BarometerModel::BMP388), Some(MagnetometerModel::QMC5883L));
            })?,
            lemniscate,
            circle,
            self.legs("legs-back", -1.8)?,
            tracked(fast::circle(self, "circle-mocap-wide", 3.0, 0.25)?)?,
        ];
        // The rotors of `hardware` have no battery.
        let battery = self.vehicle.and_then(|vehicle| vehicle.realism.rotors.battery);
        if let Some(battery) = battery {
            let mut low = self.windy(fast("battery", None))?;
            low.realism.rotors.battery = Some(low_battery(battery, self.scale.thrust(0.75)));
            flights.push(low);
        }
        Ok(flights)
    }

    /// Returns the time of the reference's step \[s\].
    fn step_s(&self) -> f64 {
        5.0 - SETTLING_S * self.scale.time
    }

    /// Returns a flight with short pushes of at most 0.1 s. Each changes the velocity by about `strength` times 2 m/s,
    /// or the rates by about `strength` times 2 rad/s.
    fn upset(&self, name: &'static str, strength: f64) -> Result<Scenario, Box<dyn Error>> {
        let VehicleScale { length, time, .. } = self.scale;
        let (speed, rate) = (length / time, 1.0 / time);
        let pushes = [
            (Axis::Roll, 60.0 * rate, 0.03),
            (Axis::X, 20.0 * speed, 0.1),
            (Axis::Pitch, 60.0 * rate, 0.03),
            (Axis::Z, 20.0 * speed, 0.1),
            (Axis::Yaw, 20.0 * rate, 0.1),
        ];
        let push = |((axis, size, length_s), k): ((Axis, f64, f64), u32)| {
            let start_s = ONSET_S + 3.0 * time * f64::from(k);
            Gust { axis, kind: GustKind::Acceleration, size: size * strength, start_s, end_s: start_s + length_s }
        };
        let pushes = pushes.into_iter().zip(0..).map(push).collect();
        let scenario = self.scenario(TrainingFlight::new(name, ONSET_S + 14.0 * time))?;
        let environment = Environment::new(*scenario.environment.nominal(), Vec::new(), pushes)?;
        Ok(Scenario { environment, ..scenario })
    }

    /// Returns a course with corners in wind. Each leg takes one second and is followed by a stop of two.
    fn course(&self, name: &'static str, leg_m: f64) -> Result<Scenario, Box<dyn Error>> {
        let VehicleScale { length, time, wind, .. } = self.scale;
        let leg_m = leg_m * length;
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)];
        let corner = |(k, (x, y)): (u32, (f64, f64))| {
            let (position_m, yaw_rad) = (Vector3::new(x * leg_m, y * leg_m, 3.0), f64::from(k));
            let arrived_s = ONSET_S + 3.0 * time * f64::from(k);
            [arrived_s, arrived_s + 2.0 * time].map(|time_s| Waypoint { time_s, position_m, yaw_rad })
        };
        let waypoints = (0..).zip(corners).flat_map(corner).collect();
        let mut scenario = self.scenario(TrainingFlight {
            trajectory: Trajectory::Waypoints(waypoints),
            ..TrainingFlight::new(name, ONSET_S + 16.0 * time)
        })?;
        self.drag(&mut scenario);
        scenario.realism.wind.steady_m_s = Vector3::new(4.0, -2.0, 0.0) * wind;
        scenario.realism.wind.turbulence = Some(self.turbulence(Turbulence::LIGHT));
        Ok(scenario)
    }

    /// Returns a tour of five corners in still air. Each leg takes two seconds, without a stop.
    fn legs(&self, name: &'static str, leg_m: f64) -> Result<Scenario, Box<dyn Error>> {
        let VehicleScale { length, time, .. } = self.scale;
        let corners = [(0.0, 0.0, 0.0), (1.0, 0.2, 0.2), (0.3, -0.8, 0.0), (-0.5, 0.3, -0.2), (0.4, 0.6, 0.1)];
        let corner = |(k, (x, y, z)): (u32, (f64, f64, f64))| Waypoint {
            time_s: 4.0 + 2.0 * time * f64::from(k),
            position_m: Vector3::new(x, y, z) * (leg_m * length) + Vector3::new(0.0, 0.0, 3.0),
            yaw_rad: 0.3 * f64::from(k),
        };
        let waypoints = (0..).zip(corners.into_iter().chain([(0.0, 0.0, 0.0)])).map(corner).collect();
        let trajectory = Trajectory::Waypoints(waypoints);
        self.scenario(TrainingFlight { trajectory, ..TrainingFlight::new(name, 4.0 + 12.0 * time) })
    }

    /// Returns a flight in light wind that lands within `length_s`, stays on the ground for 3 s with the reference
    /// slightly below the ground, and takes off again.
    fn landing(&self, name: &'static str, length_s: f64) -> Result<Scenario, Box<dyn Error>> {
        let time = self.scale.time;
        let contact = self.vehicle.and_then(|vehicle| vehicle.realism.contact).unwrap_or(Contact::PAPER);
        let depth_m = contact.foot_depth_m;
        let low_m = depth_m - (0.375 * depth_m).min(0.03);
        let at = |time_s, height_m| Waypoint { time_s, position_m: Vector3::new(0.0, 0.0, height_m), yaw_rad: 0.0 };
        let down_s = ONSET_S + length_s * time;
        let up_s = down_s + 3.0;
        let waypoints = vec![at(ONSET_S, 1.0), at(down_s, low_m), at(up_s, low_m), at(up_s + 2.0 * time, 1.0)];
        let mut scenario = self.scenario(TrainingFlight {
            trajectory: Trajectory::Waypoints(waypoints),
            ..TrainingFlight::new(name, 9.0 + 7.0 * time)
        })?;
        scenario.realism.contact = Some(contact);
        if self.vehicle.is_none_or(|vehicle| vehicle.realism.contact.is_none()) {
            scenario.realism.ground_effect = Some(GroundEffect::PAPER);
        }
        self.drag(&mut scenario);
        scenario.realism.wind.turbulence = Some(self.turbulence(Turbulence::LIGHT));
        Ok(scenario)
    }

    /// Returns `flight` in moderate turbulence with a rotor that loses thrust at the onset. On the paper's vehicle, the
    /// fraction `efficiency` remains.
    fn rotor(&self, name: &'static str, flight: TrainingFlight, efficiency: f64) -> Result<Scenario, Box<dyn Error>> {
        let mut scenario = self.windy(TrainingFlight { name, ..flight })?;
        let efficiency = self.scale.thrust(efficiency);
        scenario.realism.rotors.faults = vec![RotorFault { rotor: 2, efficiency, start_s: ONSET_S }];
        Ok(scenario)
    }

    /// Returns `flight` in moderate turbulence with a payload of a fifth of the mass from the onset on, `ahead_m` ahead
    /// of the centre of mass on the paper's vehicle.
    fn payload(&self, name: &'static str, flight: TrainingFlight, ahead_m: f64) -> Result<Scenario, Box<dyn Error>> {
        let scenario = self.windy(TrainingFlight { name, ..flight })?;
        let VehicleScale { arm, .. } = self.scale;
        // The payload is scaled like 20 % more mass, so that it takes the same share of the reserve.
        let share = 0.2 * ((self.scale.mass(1.2) - 1.0) / (1.2 - 1.0));
        let payload = Payload {
            mass_kg: share * scenario.vehicle.mass_kg,
            below_m: 0.05 * arm,
            ahead_m: ahead_m * arm,
            left_m: 0.5 * ahead_m * arm,
            start_s: ONSET_S,
            end_s: f64::INFINITY,
        };
        let environment = scenario.environment.clone().with_payloads(vec![payload])?;
        Ok(Scenario { environment, ..scenario })
    }

    /// Returns `flight` in moderate turbulence.
    fn windy(&self, flight: TrainingFlight) -> Result<Scenario, Box<dyn Error>> {
        let mut scenario = self.scenario(flight)?;
        self.drag(&mut scenario);
        scenario.realism.wind.turbulence = Some(self.turbulence(Turbulence::MODERATE));
        Ok(scenario)
    }

    /// Returns `flight` in moderate turbulence with these sensors and rotors.
    fn flight(
        &self,
        hardware: Hardware,
        name: &'static str,
        flight: TrainingFlight,
    ) -> Result<Scenario, Box<dyn Error>> {
        let mut scenario = self.windy(TrainingFlight { name, ..flight })?;
        scenario.sensing.delay_s = hardware.state_delay_s;
        if hardware.tracker {
            (scenario.sensing.period_s, scenario.sensing.gyro) = (0.01, true);
        }
        scenario.sensing.noise.rates_rad_s = hardware.rate_noise_rad_s;
        scenario.realism.rotors.time_constant_s *= hardware.lag;
        Ok(scenario)
    }

    /// Returns `flight` in moderate turbulence, flown on an estimate from the [`instruments`] of the scenario `name`.
    fn sensed(
        &self,
        name: &'static str,
        flight: TrainingFlight,
        change: impl FnOnce(&mut InstrumentSuite),
    ) -> Result<Scenario, Box<dyn Error>> {
        let scenario = self.windy(TrainingFlight { name, ..flight })?;
        Ok(Scenario { instruments: instruments(name, change)?, sensing: Sensing::default(), ..scenario })
    }

    fn step(&self, by_m: Vector3<f64>, turn_rad: f64) -> Trajectory {
        let from_m = Vector3::new(0.0, 0.0, 3.0);
        Trajectory::Step { from_m, to_m: from_m + by_m, at_s: self.step_s(), yaw_rad: 0.5, turn_rad }
    }

    /// Returns a nearly horizontal figure of eight. Its period is `period_s` on the paper's vehicle.
    fn eight(&self, period_s: f64) -> Trajectory {
        let VehicleScale { length, time, .. } = self.scale;
        let period_s = period_s * time;
        let sine = |amplitude_m, period_s| Sine { amplitude_m: amplitude_m * length, period_s, phase_rad: 0.0 };
        let sines = [sine(1.5, period_s), sine(0.75, 0.5 * period_s), sine(0.3, period_s)];
        Trajectory::Lissajous { centre_m: Vector3::new(0.0, 0.0, 3.0), sines, yaw_rad: 0.0 }
    }
}

/// Returns the instruments of the built-in scenario `name`, changed by `change`. The slow error of a GNSS receiver is
/// left out: no law can know it, and it would hide differences between laws.
fn instruments(name: &str, change: impl FnOnce(&mut InstrumentSuite)) -> Result<InstrumentSuite, Box<dyn Error>> {
    let mut suite = read(name)?.instruments;
    change(&mut suite);
    let steady = |gnss| GnssModel { horizontal_m: 0.0, vertical_m: 0.0, ..gnss };
    suite.gnss = suite.gnss.map(steady);
    Ok(suite)
}

/// Returns `scenario`, flown on an estimate from the instruments of the scenario `mocap`.
fn tracked(scenario: Scenario) -> Result<Scenario, Box<dyn Error>> {
    Ok(Scenario { instruments: instruments("mocap", |_| {})?, sensing: Sensing::default(), ..scenario })
}

/// Returns `scenario` with an outage of the link of 240 ms at each of these times. The flight core coasts through the
/// outages.
fn blind(scenario: Scenario, starts_s: &[f64]) -> Scenario {
    let outages = starts_s.iter().map(|&start_s| Outage { start_s, end_s: start_s + 0.24 }).collect();
    Scenario { outages, flight_core: true, ..scenario }
}

/// Returns the battery with the charge at which the rotors give the fraction `thrust` of their largest thrust.
fn low_battery(battery: BatteryModel, thrust: f64) -> BatteryModel {
    // Thrust grows with the square of the voltage.
    let voltage_v = battery.full_v * libm::sqrt(thrust);
    let charge = (voltage_v - battery.empty_v) / (battery.full_v - battery.empty_v).max(1e-9);
    BatteryModel { initial_charge: charge.clamp(0.05, 1.0), ..battery }
}

/// Differences from the sensors and rotors of `hardware`.
struct Hardware {
    /// True if states come from a tracker at 100 Hz and rates from a gyroscope.
    tracker: bool,
    /// Delay of every state \[s\].
    state_delay_s: f64,
    /// Standard deviation of the rates' noise \[rad/s\].
    rate_noise_rad_s: f64,
    /// Factor on the time constant of the rotors.
    lag: f64,
}

impl Default for Hardware {
    fn default() -> Self {
        Hardware { tracker: false, state_delay_s: 0.0, rate_noise_rad_s: 0.001, lag: 1.0 }
    }
}
