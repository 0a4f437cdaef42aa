//! A vehicle with sensors in still air, from which random flights are drawn.

use super::flight::{DrawnFlight, FeedbackSource};
use super::mismatch::ModelMismatch;
use super::path::{DURATION_S, UntimedPath};
use super::power::{HEIGHT_M, Power};
use crate::draw::mix;
use afbc::Profile;
use afbc_files::read::FileError;
use afbc_files::read::words::out_of_range;
use afbc_plant::noise::{Noise, NoiseStream};
use afbc_plant::{Environment, Motion, RotorStart, Wind};
use afbc_scenario::trajectory::Trajectory;
use afbc_scenario::{Scenario, built_in};
use afbc_types::OutOfRange;
use afbc_vehicles::Vehicle;
use libm::{atan2, hypot, sincos, tan};
use nalgebra::Vector3;

/// Smallest fraction of the vehicle's possible acceleration that a path asks for.
const BOLDNESS_MIN: f64 = 0.2;
/// Height of outdoor paths, where the height estimate is wrong by metres \[m\].
const HIGH_M: f64 = 10.0;
/// Largest tilt at the start of a flight that uses the vehicle's own estimate \[rad\].
const LEVEL_RAD: f64 = 0.6;

/// A vehicle with its sensors in still air.
pub(super) struct BaseVehicle<'a> {
    vehicle: &'a Vehicle,
    seen: FeedbackSource,
    power: Power,
    /// Scenario without contenders.
    scenario: Scenario,
}

impl<'a> BaseVehicle<'a> {
    /// Equips `vehicle` with the sensors that `seen` asks for.
    ///
    /// # Errors
    /// One line about the first value that the vehicle cannot fly with.
    pub(super) fn new(vehicle: &'a Vehicle, seen: FeedbackSource) -> Result<Self, FileError> {
        let name = seen.scenario();
        let known = built_in(name).ok_or_else(|| FileError::whole(name, "no such scenario"))?.read()?;
        let calm = Environment::calm(known.vehicle).map_err(|error| FileError::whole(name, out_of_range(&error)))?;
        let mut still = Scenario { duration_s: DURATION_S, environment: calm, contenders: Vec::new(), ..known };
        still.realism.wind = Wind::default();
        Ok(BaseVehicle { vehicle, seen, power: Power::of(vehicle), scenario: still.on(vehicle, Profile::Flight)? })
    }

    /// Draws flight `number` of `seed`.
    ///
    /// # Errors
    /// One line about the first value that the vehicle cannot fly with.
    pub(super) fn flight(&self, seed: u64, number: u64) -> Result<DrawnFlight, FileError> {
        let vehicle = self.vehicle;
        // The vehicle's name enters the draw, not its index, so that other vehicles in the list change nothing.
        let of_vehicle = vehicle.name.bytes().fold(mix(seed), |hash, byte| mix(hash ^ u64::from(byte)));
        let bits = mix(of_vehicle.wrapping_add(number)) >> 11;
        let mut noise = Noise::new(bits, NoiseStream::Scenario);
        let boldness = BOLDNESS_MIN + (1.0 - BOLDNESS_MIN) * noise.uniform();
        let change = self.power.fitted(&ModelMismatch::draw(&mut noise, vehicle));
        // Outdoors the estimate is wrong by metres, and a vehicle that stands on the ground with a wrong position would
        // tip over.
        let ground = vehicle.realism.contact.filter(|_| self.seen == FeedbackSource::Mocap);
        let stands_m = ground.map(|ground| ground.foot_depth_m - ground.sink_m);
        let height_m = if self.seen == FeedbackSource::Outdoor { HIGH_M } else { HEIGHT_M };
        let path = UntimedPath::draw(&mut noise, vehicle.parameters.arm_m, height_m, stands_m);
        let (kind, stands) = (path.kind(), path.stands());
        let trajectory = path.flown(&self.power.under(&change), boldness);
        let [speed_m_s, acceleration_m_s2] = peaks(&trajectory);

        let speed = if speed_m_s > 0.0 { format!(" up to {speed_m_s:.1} m/s") } else { String::new() };
        let from = if stands { ", from the ground" } else { "" };
        let mut scenario = Scenario {
            name: format!("{}-{seed}-{number}", vehicle.name),
            description: format!("{kind}{speed}{from}, {change}"),
            seed: bits,
            initial: start(&trajectory, vehicle.parameters.gravity_m_s2, self.seen),
            trajectory,
            flight_core: stands,
            ..self.scenario.clone()
        };
        if stands {
            scenario.realism.rotors.start = RotorStart::Idle;
        }
        change.put(&mut scenario).map_err(|error: OutOfRange| {
            let problem = format!("the vehicle cannot fly with {}; choose other seeds", out_of_range(&error));
            FileError::whole(&vehicle.name, problem)
        })?;
        let vehicle = vehicle.name.clone();
        Ok(DrawnFlight { seed, vehicle, number, path: kind, stands, speed_m_s, acceleration_m_s2, change, scenario })
    }
}

/// Returns the motion at the start of `trajectory`, with the bank that its acceleration needs.
fn start(trajectory: &Trajectory, gravity_m_s2: f64, seen: FeedbackSource) -> Motion {
    let reference = trajectory.at(0.0);
    let force = reference.acceleration_m_s2 + Vector3::z() * gravity_m_s2;
    // The initial tilt is limited for a vehicle that must first find its attitude with its own sensors.
    let level_m_s2 = force.xy().norm();
    let most_m_s2 = if seen == FeedbackSource::Truth { f64::INFINITY } else { force.z * tan(LEVEL_RAD) };
    let share = if level_m_s2 > most_m_s2 { most_m_s2 / level_m_s2 } else { 1.0 };
    let (x, y) = (share * force.x, share * force.y);
    let (s, c) = sincos(reference.yaw_rad);
    let (ahead, left) = (c * x + s * y, c * y - s * x);
    let roll = -atan2(left, hypot(ahead, force.z));
    Motion {
        position_m: reference.position_m,
        velocity_m_s: reference.velocity_m_s,
        attitude_rad: Vector3::new(roll, atan2(ahead, force.z), reference.yaw_rad),
        ..Motion::default()
    }
}

/// Returns the largest speed and acceleration of a reference \[m/s, m/s2\].
fn peaks(trajectory: &Trajectory) -> [f64; 2] {
    let times_s = (0..2000).map(|k| DURATION_S * f64::from(k) / 2000.0);
    times_s.fold([0.0_f64; 2], |[speed, acceleration], time_s| {
        let reference = trajectory.at(time_s);
        [speed.max(reference.velocity_m_s.norm()), acceleration.max(reference.acceleration_m_s2.norm())]
    })
}
