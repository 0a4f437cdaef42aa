//! Compares the plant's mounted IMU, in `f64`, with the flight software's calibration, in `f32`.
#![allow(clippy::unwrap_used, missing_docs)] // tests

use afbc_estimator::{ImuCalibration, ImuSample};
use afbc_plant::instruments::ImuModel;
use afbc_plant::{Environment, InstrumentSuite, Motion, Plant, PlantModel, SimulatedInstruments, Truth};
use afbc_types::{Mounting, Parameters};
use nalgebra::Vector3;

/// A perfect IMU anywhere on the vehicle reads, after calibration, the motion of the centre of mass.
#[test]
fn a_calibrated_sensor_is_at_the_centre_of_mass() {
    const STEP_S: f64 = 0.001;
    let plant = Plant::new(PlantModel::RigidBody, Motion::default(), Environment::calm(Parameters::PAPER).unwrap());
    let mounting = Mounting { position_m: Vector3::new(0.2, -0.1, 0.05), attitude_rad: Vector3::new(3.0, -0.4, 1.2) };
    let suite = InstrumentSuite { imu: Some(ImuModel { mounting, ..ImuModel::DEFAULT }), ..InstrumentSuite::default() };
    let mut instruments = SimulatedInstruments::new(&suite, &[], 1, STEP_S).unwrap();
    let (calibration, mut last) = (ImuCalibration::new(&mounting.to_f32()), None);
    let spin = Vector3::new(20.0, -30.0, 10.0);
    for step in 0..100_u32 {
        let time_s = f64::from(step) * STEP_S;
        let rates_rad_s = Vector3::new(3.0, -5.0, 2.0) + spin * time_s;
        let truth = Truth { time_s, rates_rad_s, angular_acceleration_rad_s2: spin, ..plant.truth() };
        let felt = instruments.measure(&truth).imu.unwrap();
        let read = ImuSample {
            at_us: 1000 * u64::from(step),
            rates_rad_s: felt.rates_rad_s.cast(),
            specific_force_m_s2: felt.specific_force_m_s2.cast(),
        };
        let sample = calibration.apply(&mut last, read);
        let rates = sample.rates_rad_s.cast::<f64>() - rates_rad_s;
        let force = sample.specific_force_m_s2.cast::<f64>() - truth.specific_force_m_s2();
        assert!(rates.norm() < 1e-5, "{rates}");
        // The first sample has no derivative.
        assert!(step == 0 || force.norm() < 5e-3, "{force}");
    }
}
