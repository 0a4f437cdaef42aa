//! Any input, for any duration, gives finite estimates and a positive covariance, and needs limited memory.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)] // tests

use crate::common::checks::{positive, sound};
use crate::common::{ICM, MOCAP, Noise, OUTDOOR, V3, settings, single};
use afbc_estimator::{Estimate, Estimator, ImuSample, Measurement, Memory, Settings, Sigmas, Stamped};
use afbc_types::State;
use nalgebra::Vector3;
use proptest::prelude::*;

/// Draws typical numbers, large numbers, NaN and infinities.
fn any_number() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -20.0..20.0_f32,
        1 => -1e4..1e4_f32,
        1 => proptest::sample::select(vec![f32::NAN, f32::INFINITY, -f32::INFINITY, f32::MAX, 1e-40, 0.0]),
    ]
}

fn any_vector() -> impl Strategy<Value = Vector3<f32>> {
    [any_number(), any_number(), any_number()].prop_map(|[x, y, z]| Vector3::new(x, y, z))
}

fn any_sigma() -> impl Strategy<Value = f32> {
    prop_oneof![4 => 1e-3..3.0_f32, 1 => any_number()]
}

fn any_measurement() -> impl Strategy<Value = Measurement> {
    let quaternion = prop_oneof![
        Just([1.0, 0.0, 0.0, 0.0]),
        Just([0.5, 0.5, -0.5, 0.5]),
        Just([0.0, 0.0, 0.0, 0.97]),
        [any_number(), any_number(), any_number(), any_number()],
    ];
    prop_oneof![
        (any_vector(), quaternion, any_sigma(), any_sigma()).prop_map(|(position_m, attitude, p, a)| {
            Measurement::Pose { position_m, attitude, position_sigma_m: p, attitude_sigma_rad: a }
        }),
        (any_vector(), any_sigma()).prop_map(|(position_m, sigma_m)| Measurement::Position { position_m, sigma_m }),
        (any_vector(), any_vector(), any_sigma(), any_sigma(), any_sigma()).prop_map(
            |(position_m, velocity_m_s, p, v, climb)| {
                Measurement::Gnss {
                    position_m,
                    velocity_m_s,
                    horizontal_sigma_m: p,
                    vertical_sigma_m: p,
                    speed_sigma_m_s: v,
                    climb_sigma_m_s: climb,
                }
            }
        ),
        (any_number(), any_sigma()).prop_map(|(height_m, sigma_m)| Measurement::Height { height_m, sigma_m }),
        (any_vector(), any_sigma()).prop_map(|(field, sigma)| Measurement::MagneticField { field, sigma }),
        (any_number(), any_sigma())
            .prop_map(|(heading_rad, sigma_rad)| Measurement::Heading { heading_rad, sigma_rad }),
    ]
}

/// Event in the life of an estimator.
#[derive(Clone, Debug)]
enum Event {
    /// Samples as at rest or in flight, for some milliseconds.
    Fly(u32, f32),
    /// One sample with any numbers, with this time offset.
    Sample(Vector3<f32>, Vector3<f32>, i64),
    /// A measurement with this time offset.
    Measure(Measurement, i64),
    /// No samples for this time.
    Gap(u32),
    OnGround(bool),
    /// The clock jumps.
    Clock(i64),
    StartAt(Vector3<f32>, Vector3<f32>, f32),
}

fn any_event() -> impl Strategy<Value = Event> {
    let off = prop_oneof![4 => -300_000..30_000_i64, 1 => any::<i64>(), 1 => Just(0)];
    prop_oneof![
        6 => (1..400_u32, 0.0..10.0_f32).prop_map(|(ms, wild)| Event::Fly(ms, wild)),
        3 => (1..1500_u32).prop_map(|ms| Event::Fly(ms, 0.0)),
        2 => (any_vector(), any_vector(), off.clone()).prop_map(|(w, f, off)| Event::Sample(w, f, off)),
        8 => (any_measurement(), off.clone()).prop_map(|(m, off)| Event::Measure(m, off)),
        1 => (1..2000_u32).prop_map(Event::Gap),
        1 => any::<bool>().prop_map(Event::OnGround),
        1 => off.prop_map(Event::Clock),
        1 => (any_vector(), any_vector(), any_sigma()).prop_map(|(p, v, s)| Event::StartAt(p, v, s)),
    ]
}

proptest! {
    #[test]
    fn nothing_makes_it_unsound(events in proptest::collection::vec(any_event(), 1..60), seed in any::<u64>()) {
        let estimator = Estimator::new(Settings::DEFAULT).unwrap();
        let mut memory = Memory::default();
        let mut noise = Noise::new(seed);
        let mut now_us: u64 = 5_000_000;
        for event in events {
            match event {
                Event::Fly(ms, wild) => {
                    for _ in 0..ms {
                        now_us = now_us.saturating_add(1000);
                        let wild = f64::from(wild);
                        let sample = ImuSample {
                            at_us: now_us,
                            rates_rad_s: single(&noise.vector(0.003 + wild)),
                            specific_force_m_s2: single(&(V3::new(0.1, 0.0, 9.81) + noise.vector(0.03 + 3.0 * wild))),
                        };
                        sound(&estimator.step(&mut memory, now_us, Some(&sample)), &memory);
                    }
                }
                Event::Sample(rates_rad_s, specific_force_m_s2, off) => {
                    now_us = now_us.saturating_add(1000);
                    let at_us = now_us.saturating_add_signed(off);
                    let sample = ImuSample { at_us, rates_rad_s, specific_force_m_s2 };
                    sound(&estimator.step(&mut memory, now_us, Some(&sample)), &memory);
                }
                Event::Measure(value, off) => {
                    memory.offer(&Stamped { value, at_us: now_us.saturating_add_signed(off) });
                    sound(&estimator.step(&mut memory, now_us, None), &memory);
                }
                Event::Gap(ms) => {
                    for _ in 0..ms / 10 {
                        now_us = now_us.saturating_add(10_000);
                        sound(&estimator.step(&mut memory, now_us, None), &memory);
                    }
                }
                Event::OnGround(on_ground) => memory.set_on_ground(on_ground),
                Event::Clock(off) => now_us = now_us.saturating_add_signed(off).min(u64::MAX / 2),
                Event::StartAt(position_m, velocity_m_s, sigma) => {
                    let state = State { position_m, velocity_m_s, ..State::default() };
                    let all = Vector3::repeat(sigma);
                    let sigmas = Sigmas {
                        attitude_rad: all, velocity_m_s: all, position_m: all, gyro_bias_rad_s: all,
                        accel_bias_m_s2: all, height_offset_m: 0.0,
                    };
                    let usable = estimator.start_at(&mut memory, now_us, &state, &sigmas);
                    prop_assert!(!usable || (state.is_plausible() && sigma >= 0.0));
                }
            }
            if memory.runs() {
                positive(&memory);
            }
        }
    }
}

/// Hours at rest on samples every 4 ms, where accelerometer bias and tilt cannot be told apart. By default a quarter of
/// an hour with a tracker and one and two hours outdoors; `HOURS=10` runs ten hours of each. Outdoors with the bare
/// sensor's settings, the standard deviation of a horizontal bias falls to a third of the error after ten hours; with
/// the defaults it does not.
#[test]
fn hours_leave_it_sound() {
    let told: Option<f64> = std::env::var("HOURS").ok().map(|hours| hours.parse().unwrap());
    for (hours, sensors, settings) in [
        (told.unwrap_or(0.25), MOCAP, settings(&ICM)),
        (told.unwrap_or(1.0), OUTDOOR, settings(&ICM)),
        (told.unwrap_or(2.0), OUTDOOR, Settings::DEFAULT),
    ] {
        let steps = (hours * 900_000.0) as u64;
        let estimator = Estimator::new(settings).unwrap();
        let mut memory = Memory::default();
        let mut noise = Noise::new(6);
        let (mut gyro, mut accel) = (noise.vector(ICM.gyro_bias), noise.vector(ICM.accel_bias));
        let mut offset = 100.0;
        let mut over = [0_u32; 16];
        let mut checks = 0_u32;
        let root_dt = 4e-3_f64.sqrt();
        for i in 1..=steps {
            let at_us = i * 4000;
            gyro += noise.vector(ICM.gyro_walk * root_dt);
            accel += noise.vector(ICM.accel_walk * root_dt);
            offset += noise.normal() * 0.02 * root_dt;
            let sample = ImuSample {
                at_us,
                rates_rad_s: single(&(gyro + noise.vector(ICM.gyro / root_dt))),
                specific_force_m_s2: single(
                    &(V3::new(0.0, 0.0, crate::common::G) + accel + noise.vector(ICM.accel / root_dt)),
                ),
            };
            if sensors.tracker.is_some() && i % 3 == 0 {
                let attitude = crate::common::quaternion(&crate::common::exp(&noise.vector(3.5e-3)));
                let position_m = single(&noise.vector(1e-3));
                let value =
                    Measurement::Pose { position_m, attitude, position_sigma_m: 1e-3, attitude_sigma_rad: 3.5e-3 };
                memory.offer(&Stamped { value, at_us: at_us - 8000 });
            }
            if sensors.gnss.is_some() && i % 50 == 0 {
                let value = Measurement::Gnss {
                    position_m: single(&noise.vector(1.0)),
                    velocity_m_s: single(&noise.vector(0.1)),
                    horizontal_sigma_m: 1.0,
                    vertical_sigma_m: 1.0,
                    speed_sigma_m_s: 0.1,
                    climb_sigma_m_s: 0.1,
                };
                memory.offer(&Stamped { value, at_us: at_us - 100_000 });
            }
            if sensors.baro.is_some() && i % 10 == 0 {
                let height_m = (offset + 0.15 * noise.normal()) as f32;
                memory
                    .offer(&Stamped { value: Measurement::Height { height_m, sigma_m: 0.15 }, at_us: at_us - 20_000 });
                let field = single(&(crate::common::field() + noise.vector(0.01)));
                memory.offer(&Stamped {
                    value: Measurement::MagneticField { field, sigma: 0.01 },
                    at_us: at_us - 12_000,
                });
            }
            let _ = estimator.step(&mut memory, at_us, Some(&sample));
            let _ = estimator.step(&mut memory, at_us + 1000, None);
            let _ = estimator.step(&mut memory, at_us + 2000, None);
            let estimate = estimator.step(&mut memory, at_us + 3000, None);
            if i % 25_000 == 0 {
                positive(&memory);
                let s = &estimate.sigmas;
                let pairs = [
                    (estimate.state.attitude_rad, s.attitude_rad),
                    (estimate.state.velocity_m_s, s.velocity_m_s),
                    (estimate.state.position_m, s.position_m),
                    (single(&gyro) - estimate.gyro_bias_rad_s, s.gyro_bias_rad_s),
                    (single(&accel) - estimate.accel_bias_m_s2, s.accel_bias_m_s2),
                ];
                checks += 1;
                for (k, (error, sigma)) in pairs.iter().enumerate() {
                    for c in 0..3 {
                        over[3 * k + c] += u32::from(error[c].abs() > 2.0 * sigma[c]);
                        assert!(
                            error[c].abs() < 6.0 * sigma[c],
                            "{hours} h, {i}, state {k} {c}: {} {}",
                            error[c],
                            sigma[c]
                        );
                    }
                }
                let validity = estimate.validity;
                assert!(validity.attitude && validity.heading && validity.velocity && validity.position);
                assert_eq!((estimate.resets.restarts, estimate.resets.velocity, estimate.resets.position), (0, 0, 1));
            }
        }
        println!("{hours} h: beyond 2 sigma, of {checks}: {over:?}");
        // By chance, one error in twenty is beyond. With few checks, the share may be larger.
        let most = if settings == Settings::DEFAULT { checks / 8 } else { checks };
        assert!(over.iter().all(|over| *over <= most), "{over:?} of {checks}");
    }
}

/// An estimator and its memory need less than ten kibibytes of RAM.
#[test]
fn fits_in_ten_kibibytes() {
    let (estimator, memory) = (size_of::<Estimator>(), size_of::<Memory>());
    println!("Estimator {estimator} bytes, Memory {memory} bytes, Estimate {} bytes", size_of::<Estimate>());
    assert!(estimator + memory <= 10 * 1024, "{estimator} + {memory} bytes");
}
