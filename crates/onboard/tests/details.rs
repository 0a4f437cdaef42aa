//! Tests the details of a tick.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs, reason = "tests")]

use afbc_estimator::Measurement;
use afbc_onboard::{Aged, Configuration, ControlInputs, Flight, Readings, TickDetails, TickInputs};
use nalgebra::Vector3;

/// A vehicle that stands still.
struct Standing {
    flight: Flight,
    time_us: u64,
    /// True if its inertial sensor is read.
    senses: bool,
}

impl Standing {
    fn tick(&mut self, aid: Option<Measurement>) -> TickDetails {
        self.time_us += 1_000;
        let noise = 1e-3 * (self.time_us / 1_000 % 7) as f32;
        let value = [Vector3::new(0.0, noise, 0.0), Vector3::new(noise, 0.0, 9.81)];
        let imu = self.senses.then_some(Aged { value, age_us: 0 });
        let readings = Readings { imu, aids: [aid.map(|value| Aged { value, age_us: 0 }), None] };
        let (inputs, mut messages) =
            (TickInputs { time_us: self.time_us, readings, ..TickInputs::default() }, ControlInputs::EMPTY);
        let before = self.flight.before(&messages);
        let report = self.flight.tick(self.time_us, &mut messages, &readings);
        assert!(!report.mode.armed());
        self.flight.details(&inputs, &before, &messages)
    }
}

fn fix(position_m: Vector3<f32>, horizontal_sigma_m: f32) -> Measurement {
    Measurement::Gnss {
        position_m,
        velocity_m_s: Vector3::zeros(),
        horizontal_sigma_m,
        vertical_sigma_m: 0.5,
        speed_sigma_m_s: 0.1,
        climb_sigma_m_s: 0.2,
    }
}

/// A fix is reported in the local frame, whose origin the first usable fix sets. At rest, a usable fix is set to the
/// vehicle's position, and an unusable fix stays as it is.
#[test]
fn a_fix_at_rest_is_where_the_vehicle_stands() {
    let configuration = Configuration::default();
    let most_m = configuration.estimation.position_sigma_max_m;
    let mut vehicle = Standing { flight: Flight::new(&configuration).unwrap(), time_us: 0, senses: false };
    let first_m = Vector3::new(110.0, 220.0, 30.0);
    let details = vehicle.tick(Some(fix(first_m, 0.5)));
    assert!(!details.offers && details.on_ground && details.local == [None; 2] && details.sample.is_none());
    vehicle.senses = true;
    let details = vehicle.tick(Some(fix(first_m, 0.5)));
    assert!(details.offers && details.local == [None; 2], "it does not run yet");
    let sample = details.sample.unwrap();
    assert_eq!((sample.at_us, sample.specific_force_m_s2.z), (2_000, 9.81));
    for _ in 0..5_000 {
        let _ = vehicle.tick(None);
    }
    let before = vehicle.tick(Some(fix(first_m, 0.5)));
    let Some(estimate) = before.estimate.filter(|estimate| estimate.at_rest) else { panic!("{:?}", before.estimate) };
    let origin_m = before.origin_m.unwrap();
    let poor = vehicle.tick(Some(fix(first_m + Vector3::new(1.0, 2.0, 3.0), most_m * 1.01)));
    let said_m = first_m + Vector3::new(1.0, 2.0, 3.0) - origin_m;
    assert_eq!(poor.local, [Some(fix(said_m, most_m * 1.01)), None]);
    let stands_m = poor.estimate.unwrap().state.position_m;
    let good = vehicle.tick(Some(fix(first_m + Vector3::new(1.0, 2.0, 3.0), most_m)));
    assert_eq!(good.local, [Some(fix(stands_m, most_m)), None]);
    assert!((stands_m - estimate.state.position_m).norm() < 0.1);
    // The inputs keep the original reading.
    let read = good.inputs.readings.aids[0].unwrap().value;
    assert_eq!(read, fix(first_m + Vector3::new(1.0, 2.0, 3.0), most_m));
}

/// A magnetometer's reading is corrected.
#[test]
fn a_field_is_corrected() {
    let mut configuration = Configuration::default();
    configuration.calibration.mag_offset_ut = Vector3::new(1.0, -2.0, 3.0);
    let mut vehicle = Standing { flight: Flight::new(&configuration).unwrap(), time_us: 0, senses: true };
    let read = Measurement::MagneticField { field: Vector3::new(20.0, 5.0, -40.0), sigma: 1.0 };
    let corrected = Measurement::MagneticField { field: Vector3::new(19.0, 7.0, -43.0), sigma: 1.0 };
    assert_eq!(vehicle.tick(Some(read)).local, [Some(corrected), None]);
}
