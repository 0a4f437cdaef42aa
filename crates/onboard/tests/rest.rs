//! Tests that a vehicle at rest outdoors keeps its estimated position, whatever its receiver's error does.
#![allow(clippy::expect_used, clippy::panic, reason = "a test that cannot go on should say why")]

use afbc_estimator::{Estimator, ImuCalibration, Measurement, OutputFilter, Settings};
use afbc_flight_core::Inbox;
use afbc_onboard::{Aged, Configuration, ControlInputs, EstimatorFrontEnd, Flight, Prepared, Readings};
use afbc_types::{Mounting, State};
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;

/// Time without fixes, then with fixes \[ms\].
const SILENT_MS: u64 = 8_000;
const STANDS_MS: u64 = 60_000;

/// Returns pseudo-random numbers in -1..1, different for each time.
fn noise(ms: u64) -> Vector3<f32> {
    let number = |k: u64| ((ms * 3 + k).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as f32 / (1 << 23) as f32 - 1.0;
    Vector3::new(number(0), number(1), number(2))
}

/// Returns the readings of a vehicle: fixes at 10 Hz, barometer and magnetometer at 50 Hz. `wander_m` is the amplitude
/// of the receiver's slow error. `hand` is the true acceleration, velocity and displacement.
fn readings(ms: u64, place_m: Vector3<f32>, wander_m: Vector3<f32>, hand: [Vector3<f32>; 3]) -> Readings {
    let [acceleration, velocity_m_s, moved_m] = hand;
    let t = 1e-3 * ms as f32;
    let force = acceleration + Vector3::new(0.0, 0.0, 9.81) + noise(ms) * 0.02;
    let imu = Some(Aged { value: [noise(ms + 1_000_000) * 1e-3, force], age_us: 0 });
    let swing = Vector3::new((0.05 * t).sin(), (0.04 * t).cos() - 1.0, (0.07 * t).sin());
    let position_m = place_m + moved_m + wander_m.component_mul(&swing) + noise(ms + 5_000_000) * 0.4;
    let fix = Measurement::Gnss {
        position_m,
        velocity_m_s: velocity_m_s + noise(ms + 6_000_000) * 0.1,
        horizontal_sigma_m: 1.3,
        vertical_sigma_m: 2.0,
        speed_sigma_m_s: 0.06,
        climb_sigma_m_s: 0.06,
    };
    let height = moved_m.z + 0.3 * (0.06 * t).sin() + noise(ms + 7_000_000).x * 0.2;
    let field = Vector3::new(0.2, 0.0, -0.43) + noise(ms + 8_000_000) * 0.005;
    let value = match ms % 100 {
        0 if ms > SILENT_MS => fix,
        10 | 30 | 50 | 70 | 90 => Measurement::Height { height_m: height, sigma_m: 0.15 },
        15 | 35 | 55 | 75 | 95 => Measurement::MagneticField { field, sigma: 0.005 },
        _ => return Readings { imu, ..Readings::NONE },
    };
    Readings { imu, aids: [Some(Aged { value, age_us: 0 }), None] }
}

const STILL: [Vector3<f32>; 3] = [Vector3::new(0.0, 0.0, 0.0); 3];

/// Returns the largest displacement and speed of the state from `tick` after the first two seconds.
fn stands(
    place_m: Vector3<f32>,
    wander_m: Vector3<f32>,
    mut tick: impl FnMut(u64, &Readings) -> Option<State>,
) -> (f32, f32) {
    let mut first = None;
    let (mut away_m, mut speed_m_s) = (0.0_f32, 0.0_f32);
    for ms in 1..SILENT_MS + STANDS_MS {
        let state = tick(ms, &readings(ms, place_m, wander_m, STILL)).expect("it has samples");
        if ms > 2000 {
            let stood_m = *first.get_or_insert(state.position_m);
            away_m = away_m.max((state.position_m - stood_m).amax());
            speed_m_s = speed_m_s.max(state.velocity_m_s.amax());
        }
    }
    (away_m, speed_m_s)
}

fn navigation() -> EstimatorFrontEnd {
    let estimator = Estimator::new(Settings::DEFAULT).expect("valid");
    EstimatorFrontEnd::new(estimator, OutputFilter::default(), ImuCalibration::default())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]

    /// The receiver wanders by metres in any direction, and the barometer by some tenths, but the vehicle's estimate
    /// does not.
    #[test]
    fn it_stays_where_it_stands(
        place_m in [-5000.0_f32..5000.0, -5000.0_f32..5000.0, -100.0_f32..3000.0].prop_map(Vector3::from),
        wander_m in [-3.0_f32..3.0, -3.0_f32..3.0, -4.0_f32..4.0].prop_map(Vector3::from),
    ) {
        let (mut navigation, mut inbox) = (navigation(), Inbox::default());
        navigation.set_on_ground(true);
        let (away_m, speed_m_s) = stands(place_m, wander_m, |ms, readings| {
            navigation.tick(ms * 1000, readings, &mut inbox.take()).map(|estimate| estimate.state)
        });
        prop_assert!(away_m < 0.15 && speed_m_s < 0.1, "{away_m} m, {speed_m_s} m/s");
    }
}

/// A disarmed vehicle in a whole flight also keeps its position.
#[test]
fn a_disarmed_vehicle_stays_where_it_stands() {
    let mut flight: Flight = Flight::new(&Configuration::default()).expect("valid");
    let mut inputs = ControlInputs::default();
    let (away_m, speed_m_s) = stands(Vector3::new(30.0, -20.0, 10.0), Vector3::new(2.0, -2.0, 3.0), |ms, readings| {
        flight.tick(ms * 1000, &mut inputs, readings).estimate
    });
    assert!(away_m < 0.15 && speed_m_s < 0.1, "{away_m} m, {speed_m_s} m/s");
}

/// A station corrects the mounting of a rotated sensor. The estimate starts again in the new axes and is right at once,
/// instead of taking the change for a motion.
#[test]
fn another_mounting_starts_the_estimate_again() {
    let turned = Vector3::new(0.0, 0.2, 1.0);
    let configuration =
        Configuration { imu: Mounting { attitude_rad: turned, ..Mounting::PLAIN }, ..Default::default() };
    let mut flight: Flight = Flight::new(&Configuration::default()).expect("valid");
    let mut inputs = ControlInputs::default();
    let to_sensor = Rotation3::from_euler_angles(turned.x, turned.y, turned.z).inverse();
    let mut stood_m = Vector3::zeros();
    for ms in 1..40_000 {
        if ms == 20_000 {
            assert!(flight.adopt(&Prepared::new(&configuration).expect("valid")));
        }
        let mut readings = readings(ms, Vector3::zeros(), Vector3::zeros(), STILL);
        readings.imu = readings.imu.map(|imu| Aged { value: imu.value.map(|value| to_sensor * value), ..imu });
        let report = flight.tick(ms * 1000, &mut inputs, &readings);
        let estimate = report.estimate.expect("it has samples");
        match ms {
            19_999 => {
                assert!((estimate.attitude_rad.y - 0.2).abs() < 0.05, "{}", estimate.attitude_rad);
                stood_m = estimate.position_m;
            }
            22_000.. => {
                assert!(estimate.attitude_rad.xy().amax() < 0.02, "{ms} ms: {}", estimate.attitude_rad);
                assert!(estimate.velocity_m_s.amax() < 0.1, "{ms} ms: {}", estimate.velocity_m_s);
            }
            _ => (),
        }
        if ms == 39_999 {
            assert!((estimate.position_m - stood_m).amax() < 1.0, "{} and {stood_m}", estimate.position_m);
        }
    }
}

/// A disarmed vehicle is lifted by 1 m and pushed by 2 m within two seconds. The estimate follows, and stays there,
/// although the receiver's error has wandered meanwhile.
#[test]
fn a_hand_moves_it() {
    let (mut navigation, mut inbox) = (navigation(), Inbox::default());
    navigation.set_on_ground(true);
    let by_m = Vector3::new(2.0, 0.0, 1.0);
    let [mut velocity, mut moved] = [Vector3::zeros(); 2];
    let mut before = Vector3::zeros();
    for ms in 1..60_000 {
        let acceleration = match ms {
            30_001..=31_000 => by_m,
            31_001..=32_000 => -by_m,
            _ => Vector3::zeros(),
        };
        velocity += acceleration * 1e-3;
        moved += velocity * 1e-3;
        let readings = readings(ms, Vector3::zeros(), Vector3::new(2.0, -2.0, 3.0), [acceleration, velocity, moved]);
        let state = navigation.tick(ms * 1000, &readings, &mut inbox.take()).expect("it has samples").state;
        if ms == 30_000 {
            before = state.position_m;
        }
        if ms > 30_000 {
            let off = (state.position_m - before - moved).amax();
            assert!(off < 0.5, "{ms} ms: off by {off} m");
            let off = (state.velocity_m_s - velocity).amax();
            assert!(off < 0.3, "{ms} ms: off by {off} m/s");
        }
        if ms > 36_000 {
            assert!(state.velocity_m_s.amax() < 0.1, "{ms} ms: {} m/s", state.velocity_m_s.amax());
        }
    }
}
