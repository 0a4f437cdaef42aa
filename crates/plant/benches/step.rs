//! Benchmarks of one plant step, ideal and with all effects, and of one measurement by sensors or instruments.
//!
//! Run with `cargo bench -p afbc-plant`. A simple feedback keeps the vehicle in place, so that conditions stay the
//! same. Every figure includes the time of the feedback and of [`Plant::motion`], which `feedback_alone` measures.
#![allow(clippy::unwrap_used, missing_docs)] // a plant that cannot be built must stop the bench

use afbc_plant::instruments::{BarometerModel, GnssModel, ImuModel, MagnetometerModel, TrackerModel};
use afbc_plant::{
    BatteryModel, Contact, CosineGust, Deviations, Drag, Environment, GroundEffect, InstrumentSuite,
    MeasurementDropouts, Motion, Plant, PlantModel, Realism, Rotors, Sensing, SimulatedInstruments, StateSensor,
    Turbulence, Wind,
};
use afbc_types::{Parameters, RotorSpeeds};
use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use nalgebra::{Vector3, Vector4};

fn main() {
    divan::main();
}

const STEP_S: f64 = 0.001;
const MODELS: [PlantModel; 2] = [PlantModel::Simplified, PlantModel::RigidBody];

fn start() -> Motion {
    Motion { position_m: Vector3::new(0.0, 0.0, 2.0), ..Motion::default() }
}

fn lag() -> Rotors {
    Rotors { time_constant_s: 0.02, max_rad_s: 317.0, delay_s: 0.001, ..Rotors::default() }
}

fn weather() -> Wind {
    Wind {
        steady_m_s: Vector3::new(3.0, 1.0, 0.0),
        gusts: vec![CosineGust { velocity_m_s: Vector3::new(0.0, 2.0, 0.0), start_s: 1.0, rise_s: 0.5, hold_s: 1.0 }],
        turbulence: Some(Turbulence::LIGHT),
    }
}

/// Returns lag, limits, delay, drag, wind with turbulence.
fn usual() -> Realism {
    Realism { rotors: lag(), drag: Some(Drag::PAPER), wind: weather(), seed: 1, ..Realism::default() }
}

fn everything() -> Realism {
    Realism {
        rotors: Rotors { battery: Some(BatteryModel::THREE_CELLS), ..lag() },
        contact: Some(Contact::PAPER),
        ground_effect: Some(GroundEffect::PAPER),
        ..usual()
    }
}

fn environment() -> Environment {
    Environment::calm(Parameters::PAPER).unwrap()
}

/// Returns speeds around hover that keep the vehicle in place.
fn feedback(motion: &Motion) -> RotorSpeeds {
    let eta = &motion.attitude_rad;
    let (p, q) = (motion.rates_rad_s.x, motion.rates_rad_s.y);
    let (position, velocity) = (&motion.position_m, &motion.velocity_m_s);
    let roll = 8.0 * p + 40.0 * (eta.x - 0.1 * velocity.y - 0.05 * position.y);
    let pitch = 8.0 * q + 40.0 * (eta.y + 0.1 * velocity.x + 0.05 * position.x);
    let up = 200.0 - 20.0 * (position.z - 2.0) - 20.0 * velocity.z;
    RotorSpeeds(Vector4::new(up + roll, up + pitch, up - roll, up - pitch).map(|w| w.clamp(0.0, 317.0) as f32))
}

fn fly(bencher: Bencher, mut plant: Plant) {
    bencher.counter(ItemsCount::new(1_usize)).bench_local(|| {
        let speeds = feedback(&plant.motion());
        plant.step(black_box(&speeds), STEP_S);
    });
    assert!(plant.motion().position_m.norm() < 1e3, "the vehicle has left its place");
}

#[divan::bench(sample_count = 200, sample_size = 2000)]
fn feedback_alone(bencher: Bencher) {
    let plant = Plant::new(PlantModel::RigidBody, start(), environment());
    bencher.bench_local(|| feedback(&black_box(&plant).motion()));
}

#[divan::bench(args = MODELS, sample_count = 200, sample_size = 2000)]
fn ideal(bencher: Bencher, model: PlantModel) {
    fly(bencher, Plant::new(model, start(), environment()));
}

#[divan::bench(args = MODELS, sample_count = 200, sample_size = 2000)]
fn rotor_lag(bencher: Bencher, model: PlantModel) {
    let realism = Realism { rotors: lag(), ..Realism::default() };
    fly(bencher, Plant::with_realism(model, start(), environment(), &realism, STEP_S).unwrap());
}

#[divan::bench(args = MODELS, sample_count = 200, sample_size = 2000)]
fn lag_drag_turbulence(bencher: Bencher, model: PlantModel) {
    fly(bencher, Plant::with_realism(model, start(), environment(), &usual(), STEP_S).unwrap());
}

#[divan::bench(args = MODELS, sample_count = 200, sample_size = 2000)]
fn all(bencher: Bencher, model: PlantModel) {
    fly(bencher, Plant::with_realism(model, start(), environment(), &everything(), STEP_S).unwrap());
}

#[divan::bench(args = MODELS, sample_count = 200, sample_size = 2000)]
fn drag_in_still_air(bencher: Bencher, model: PlantModel) {
    let realism = Realism { drag: Some(Drag::PAPER), ..Realism::default() };
    fly(bencher, Plant::with_realism(model, start(), environment(), &realism, STEP_S).unwrap());
}

/// The plant has the usual effects and sensors of a campaign.
#[divan::bench(sample_count = 200, sample_size = 2000)]
fn lag_drag_turbulence_sensors(bencher: Bencher) {
    let mut plant = Plant::with_realism(PlantModel::RigidBody, start(), environment(), &usual(), STEP_S).unwrap();
    let mut sensors = sensors();
    bencher.counter(ItemsCount::new(1_usize)).bench_local(|| {
        let motion = plant.motion();
        let speeds = feedback(&motion);
        plant.step(black_box(&speeds), STEP_S);
        sensors.measure(&motion)
    });
}

fn sensors() -> StateSensor {
    let sensing = Sensing {
        noise: Deviations::all(0.001),
        bias: Deviations::all(0.001),
        delay_s: 0.002,
        dropouts: Some(MeasurementDropouts { rate_hz: 1.0, mean_s: 0.01 }),
        ..Sensing::DEFAULT
    };
    StateSensor::new(&sensing, 1, STEP_S).unwrap()
}

/// Computation of the instruments' input with all effects.
#[divan::bench(sample_count = 200, sample_size = 2000)]
fn truth(bencher: Bencher) {
    let plant = Plant::with_realism(PlantModel::RigidBody, start(), environment(), &everything(), STEP_S).unwrap();
    bencher.counter(ItemsCount::new(1_usize)).bench_local(|| black_box(&plant).truth());
}

/// All instruments of a vehicle that flies outdoors, and a tracker.
#[divan::bench(args = [false, true], sample_count = 200, sample_size = 2000)]
fn instruments(bencher: Bencher, vibration: bool) {
    let mut imu = ImuModel::ICM_42688_P;
    if vibration {
        (imu.gyro.vibration_rad_s, imu.accel.vibration_m_s2) = (0.02, 1.0);
    }
    let suite = InstrumentSuite {
        imu: Some(imu),
        tracker: Some(TrackerModel::MOCAP_100),
        gnss: Some(GnssModel::M10),
        barometer: Some(BarometerModel::DPS310),
        magnetometer: Some(MagnetometerModel::IST8310),
    };
    let mut truth = Plant::new(PlantModel::RigidBody, start(), environment()).truth();
    let mut instruments = SimulatedInstruments::new(&suite, &[], 1, STEP_S).unwrap();
    bencher.counter(ItemsCount::new(1_usize)).bench_local(|| {
        truth.time_s += STEP_S;
        instruments.measure(black_box(&truth))
    });
}

#[divan::bench(sample_count = 200, sample_size = 2000)]
fn measurement(bencher: Bencher) {
    let mut sensors = sensors();
    let motion = start();
    bencher.counter(ItemsCount::new(1_usize)).bench_local(|| sensors.measure(black_box(&motion)));
}

#[divan::bench(sample_count = 200, sample_size = 2000)]
fn normal_number(bencher: Bencher) {
    let mut noise = afbc_plant::noise::Noise::new(1, afbc_plant::noise::NoiseStream::Wind);
    bencher.counter(ItemsCount::new(1_usize)).bench_local(|| noise.normal());
}
