//! Sensor faults are detected, reported and recovered from.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)] // tests

use crate::common::checks::{at_rest, flown, position_error};
use crate::common::{
    Flight, ICM, MOCAP, NOTHING, Noise, OUTDOOR, Path, Sensors, V3, double, eight, fly, hover, settings, single,
};
use afbc_estimator::{AidSet, AidSource, Estimator, ImuSample, Measurement, Memory, Settings, Stamped};
use nalgebra::Vector3;

#[test]
fn outliers_are_rejected() {
    let mut worst: f64 = 0.0;
    let mut rejected = 0;
    flown(
        eight,
        MOCAP,
        15,
        |_, _| true,
        |ms, measurement| {
            // Every tenth pose is wrong, alternately in position and turned over.
            if let Measurement::Pose { position_m, attitude, .. } = &mut measurement.value {
                let number = measurement.at_us / 10_000;
                if ms > 4000 && number % 20 == 0 {
                    position_m.x += 0.4;
                } else if ms > 4000 && number % 20 == 10 {
                    *attitude = [0.0, 1.0, 0.0, 0.0];
                }
            }
            true
        },
        |ms, estimate, flight| {
            if ms > 5000 {
                worst = worst.max(position_error(estimate, flight));
            }
            rejected = flight.memory.aids().tracker_position.rejected + flight.memory.aids().tracker_attitude.rejected;
            assert_eq!((estimate.resets.heading, estimate.resets.velocity), (0, 0));
        },
    );
    assert!(worst < 0.003, "{worst} m");
    assert!((105..=115).contains(&rejected), "{rejected}");
}

#[test]
fn a_moved_tracker_is_believed_after_a_while() {
    // The tracker's origin moves at 6 s.
    let offset = V3::new(3.0, -1.0, 0.5);
    let mut reset_ms = None;
    flown(
        eight,
        MOCAP,
        12,
        |_, _| true,
        |ms, measurement| {
            if let Measurement::Pose { position_m, .. } = &mut measurement.value {
                *position_m += if ms > 6000 { single(&offset) } else { Vector3::zeros() };
            }
            true
        },
        |ms, estimate, flight| {
            assert!(estimate.resets.position <= 2);
            if estimate.resets.position == 2 {
                let reset_ms = *reset_ms.get_or_insert(ms);
                if ms > reset_ms + 500 {
                    let error = (double(&estimate.state.position_m) - flight.moment().p - offset).norm();
                    assert!(error < 0.005, "{ms} ms: {error} m");
                    let speed = (double(&estimate.state.velocity_m_s) - flight.moment().v).norm();
                    assert!(speed < 0.05, "{ms} ms: {speed} m/s");
                }
            } else if ms > 3000 && ms < 6000 {
                assert!(position_error(estimate, flight) < 0.05, "{ms} ms");
            }
        },
    );
    let reset_ms = reset_ms.unwrap();
    // The reset comes after three fifths of `coast_s`.
    assert!((8950..9150).contains(&reset_ms), "{reset_ms} ms");
}

/// The tracker repeats one pose with new times. A hovering vehicle's true pose hardly differs from it.
#[test]
fn a_frozen_tracker_is_not_believed() {
    let held = core::cell::RefCell::new(None);
    let mut frozen = 0;
    flown(
        hover,
        MOCAP,
        20,
        |_, _| true,
        |ms, measurement| {
            if (6000..14_000).contains(&ms) {
                measurement.value = *held.borrow_mut().get_or_insert(measurement.value);
            }
            true
        },
        |ms, estimate, flight| {
            let error = position_error(estimate, flight);
            assert!(!(3000..=8000).contains(&ms) || error < 0.1, "{ms} ms: {error} m");
            // The position is lost after `coast_s`, and found again.
            let lost = (11_300..14_000).contains(&ms);
            let turns = ms < 1100 || (11_100..11_300).contains(&ms) || (14_000..14_100).contains(&ms);
            assert!(turns || estimate.validity.position != lost, "{ms} ms");
            assert!(ms < 15_000 || error < 0.005, "{ms} ms: {error} m");
            frozen = flight.memory.dropped().frozen;
        },
    );
    assert!((770..=790).contains(&frozen), "{frozen}");
    // With the default `frozen_s`, repeated poses are refused. With 0 they are not, for a tracker without noise.
    let estimator = |frozen_s| Estimator::new(Settings { frozen_s, ..settings(&ICM) }).unwrap();
    for (frozen_s, all) in [(0.0, true), (Settings::DEFAULT.frozen_s, false)] {
        let (estimate, mut memory) = at_rest(1500, NOTHING, |_, _| ());
        for ms in 1..1000 {
            let at_us = estimate.at_us + 1000 * ms;
            let rates_rad_s = Vector3::new(1e-4 * (ms % 3) as f32, 0.0, 0.0);
            let sample = ImuSample { at_us, rates_rad_s, specific_force_m_s2: Vector3::new(0.0, 0.0, 9.81) };
            if ms % 10 == 0 {
                let value = Measurement::Position { position_m: Vector3::zeros(), sigma_m: 0.01 };
                memory.offer(&Stamped { value, at_us: at_us - 5000 });
            }
            let _ = estimator(frozen_s).step(&mut memory, at_us, Some(&sample));
        }
        assert_eq!(memory.dropped().frozen == 0, all, "{frozen_s} s");
    }
}

#[test]
fn a_disturbed_field_turns_nothing() {
    let mut disturbed = 0;
    flown(
        eight,
        OUTDOOR,
        20,
        |_, _| true,
        |ms, measurement| {
            if let Measurement::MagneticField { field, .. } = &mut measurement.value {
                // Strong currents disturb the field for 8 s.
                if (8000..16_000).contains(&ms) {
                    *field += Vector3::new(0.3, 0.5, 0.2);
                }
            }
            true
        },
        |ms, estimate, flight| {
            let heading = flight.errors(estimate)[2].abs().to_degrees();
            assert!(ms < 3000 || heading < 2.0, "{ms} ms: {heading} deg");
            disturbed = flight.memory.dropped().disturbed + flight.memory.aids().heading.rejected;
            assert_eq!(estimate.resets.heading, 0);
        },
    );
    assert!(disturbed > 350, "{disturbed}");
}

/// A field along body y that rises within 20 to 60 s to more than the earth's horizontal field looks like a gyroscope
/// that drifts. A receiver's velocity shows which of them does.
#[test]
fn a_field_that_rises_slowly_turns_nothing() {
    for (rise_ms, size) in [(20_000, 0.5), (40_000, -0.5), (60_000, 0.5)] {
        flown(
            eight,
            OUTDOOR,
            70,
            |_, _| true,
            |ms, measurement| {
                if let Measurement::MagneticField { field, .. } = &mut measurement.value {
                    field.y += size * (ms.saturating_sub(8000) as f32 / rise_ms as f32).min(1.0);
                }
                true
            },
            |ms, estimate, flight| {
                let heading = flight.errors(estimate)[2].abs().to_degrees();
                assert!(ms < 3000 || heading < 8.0, "{rise_ms} ms, {ms} ms: {heading} deg");
                assert_eq!(estimate.resets.heading, 0);
            },
        );
    }
}

/// A gyroscope that drifts is still followed by the magnetometer, whether the vehicle moves or hovers.
#[test]
fn a_gyroscope_that_drifts_is_told_from_a_field_that_rises() {
    for path in [hover, eight] {
        flown(
            path,
            OUTDOOR,
            60,
            |ms, sample| {
                sample.rates_rad_s.z += 0.01 * (ms.saturating_sub(5000) as f32 / 50_000.0).min(1.0);
                true
            },
            |_, _| true,
            |ms, estimate, flight| {
                let heading = flight.errors(estimate)[2].abs().to_degrees();
                let most = if ms < 58_000 { 8.0 } else { 2.0 };
                assert!(ms < 3000 || heading < most, "{ms} ms: {heading} deg");
            },
        );
    }
}

/// Flies with a receiver whose height has a slow error, after changes of the measurements. Returns the largest error of
/// the height \[m\], the error at the end, the number of the receiver's heights that were rejected, and true if they
/// were named as ignored.
fn heights(path: Path, seed: u64, change: impl Fn(usize, &mut Measurement)) -> (f64, f64, u32, bool) {
    let truth = fly(path, 90.0);
    let sensors = Sensors { gnss: Some((0.4, 0.6, 0.05)), slow: Some((1.2, 120.0)), ..OUTDOOR };
    let mut flight = Flight::with(&truth, ICM, sensors, seed, Settings { gnss_noise_m: 0.5, ..settings(&ICM) });
    let (mut most_m, mut last_m, mut rejected, mut named) = (0.0_f64, 0.0, 0, false);
    for ms in 0..90_000 {
        let deliver = |measurement: &mut Stamped<Measurement>| {
            change(ms, &mut measurement.value);
            true
        };
        let estimate = flight.step_with(|_| true, deliver);
        if ms > 5000 {
            last_m = (f64::from(estimate.state.position_m.z) - flight.moment().p.z).abs();
            most_m = most_m.max(last_m);
            assert!(estimate.validity.position, "{ms} ms");
        }
        rejected = flight.memory.aids().gnss_height.rejected;
        named |= flight.memory.ignored().contains(AidSource::GnssHeight);
    }
    (most_m, last_m, rejected, named)
}

/// A receiver's height that creeps by 20 m is doubted: barometer and velocity agree without it.
#[test]
fn a_receivers_height_that_creeps_is_not_followed() {
    for (seed, rise_ms, by_m) in [(1, 20_000, 20.0), (2, 40_000, -20.0), (3, 60_000, 20.0), (4, 60_000, -20.0)] {
        let (most_m, last_m, _, named) = heights(if seed % 2 == 0 { hover } else { eight }, seed, |ms, measurement| {
            if let Measurement::Gnss { position_m, .. } = measurement {
                position_m.z += by_m * (ms.saturating_sub(10_000) as f32 / rise_ms as f32).min(1.0);
            }
        });
        assert!(most_m < 9.0 && last_m < 5.0 && named, "{rise_ms} ms, {by_m} m: {most_m} m, {last_m} m in the end");
    }
}

/// A barometer that creeps moves its offset only, and a receiver whose height is right is never doubted.
#[test]
fn a_barometer_that_creeps_leaves_the_receivers_height_alone() {
    for (seed, by_m) in [(1, 0.0), (2, 20.0), (3, -20.0), (4, 0.0)] {
        let (most_m, _, rejected, named) =
            heights(if seed % 2 == 0 { hover } else { eight }, seed, |ms, measurement| {
                if let Measurement::Height { height_m, .. } = measurement {
                    *height_m += by_m * (ms.saturating_sub(10_000) as f32 / 60_000.0).min(1.0);
                }
            });
        assert!(most_m < 4.0 && rejected < 5 && !named, "{by_m} m: {most_m} m, {rejected} rejected");
    }
}

/// Each kind of aid is wrong for 2.5 s. It is named as ignored then, and only then.
#[test]
fn an_aid_that_contradicts_the_others_is_named() {
    type Change = fn(&mut Measurement);
    let cases: [(AidSource, Change); 4] = [
        (AidSource::GnssPosition, |measurement| {
            if let Measurement::Gnss { position_m, .. } = measurement {
                position_m.x += 40.0;
            }
        }),
        (AidSource::GnssHeight, |measurement| {
            if let Measurement::Gnss { position_m, .. } = measurement {
                position_m.z += 60.0;
            }
        }),
        (AidSource::Height, |measurement| {
            if let Measurement::Height { height_m, .. } = measurement {
                *height_m += 40.0;
            }
        }),
        (AidSource::Heading, |measurement| {
            if let Measurement::MagneticField { field, .. } = measurement {
                *field += Vector3::new(0.3, 0.5, 0.2);
            }
        }),
    ];
    for (aid, spoil) in cases {
        flown(
            eight,
            OUTDOOR,
            14,
            |_, _| true,
            |ms, measurement| {
                if (8000..10_500).contains(&ms) {
                    spoil(&mut measurement.value);
                }
                true
            },
            |ms, _, flight| {
                let ignored = flight.memory.ignored();
                let expected =
                    if (9700..10_500).contains(&ms) { AidSet::default().with(aid) } else { AidSet::default() };
                let changes = (9000..9700).contains(&ms) || (10_500..11_000).contains(&ms);
                assert!(ms < 4000 || changes || ignored == expected, "{aid:?} at {ms} ms: {ignored:?}");
            },
        );
    }
}

#[test]
fn a_receiver_that_jumps_keeps_its_velocity() {
    flown(
        eight,
        OUTDOOR,
        16,
        |_, _| true,
        |ms, measurement| {
            if let (Measurement::Gnss { position_m, .. }, 8000..8800) = (&mut measurement.value, ms) {
                position_m.y += 30.0;
            }
            true
        },
        |ms, estimate, flight| {
            assert!(ms < 4000 || position_error(estimate, flight) < 1.0, "{ms} ms");
            assert_eq!(flight.memory.aids().gnss_velocity.rejected, 0);
            assert_eq!(estimate.resets.velocity, 0);
            assert!(ms < 9000 || flight.memory.aids().gnss_position.rejected >= 7);
            assert!(ms < 9500 || (estimate.resets.position == 1 && estimate.validity.position));
        },
    );
}

/// A receiver's position jumps for good while its velocity continues: the position stays valid and follows after 7 s.
/// Without the velocity, it is invalid after 5 s.
#[test]
fn a_position_that_is_doubted_is_carried_on_by_a_velocity() {
    for has_velocity in [true, false] {
        flown(
            eight,
            OUTDOOR,
            22,
            |_, _| true,
            |ms, measurement| {
                if let (Measurement::Gnss { position_m, .. }, 8000..) = (&mut measurement.value, ms) {
                    position_m.x += 30.0;
                }
                has_velocity || ms < 8000 || !matches!(measurement.value, Measurement::Gnss { .. })
            },
            |ms, estimate, flight| {
                if (5000..14_500).contains(&ms) && has_velocity {
                    assert!(position_error(estimate, flight) < 1.5, "{ms} ms");
                }
                if ms > 5000 && !(12_500..13_500).contains(&ms) {
                    assert_eq!(estimate.validity.position, has_velocity || ms < 13_000, "{ms} ms");
                }
                assert!(!(15_500..).contains(&ms) || !has_velocity || position_error(estimate, flight) > 28.0);
            },
        );
    }
}

#[test]
fn without_aid_it_stays_level_and_says_what_is_lost() {
    flown(
        eight,
        OUTDOOR,
        60,
        |_, _| true,
        |ms, measurement| ms < 10_000 || matches!(measurement.value, Measurement::Height { .. }),
        |ms, estimate, flight| {
            let e = flight.errors(estimate);
            let v = estimate.validity;
            if ms > 15_500 {
                assert!(!v.position && !v.velocity && v.attitude && v.height, "{ms} ms: {v:?}");
            }
            if ms > 3000 {
                let tilt = e.fixed_rows::<2>(0).norm().to_degrees();
                assert!(tilt < 8.0, "{ms} ms: {tilt} deg");
                assert!(e[8].abs() < 1.5, "{ms} ms: {} m", e[8]);
            }
        },
    );
}

/// The repeated samples of a stuck IMU do not turn the estimate. When the IMU comes back, the tilt error is at most
/// that after a silent IMU plus five sigma, plus 0.5 rad/s times the 16 ms before the fault can be detected.
#[test]
fn a_sensor_that_was_stuck_is_like_one_that_was_silent() {
    for fails_ms in [100, 200, 400, 3000] {
        let fails = |ms: usize| (6000..6000 + fails_ms).contains(&ms);
        let mut silent_rad = Vec::new();
        for is_stuck in [false, true] {
            let held = core::cell::Cell::new(None);
            flown(
                hover,
                MOCAP,
                12,
                |ms, sample| {
                    if is_stuck && fails(ms) {
                        let (rates, force) = held.get().unwrap_or((sample.rates_rad_s, sample.specific_force_m_s2));
                        held.set(Some((rates, force)));
                        (sample.rates_rad_s, sample.specific_force_m_s2) = (rates + Vector3::repeat(0.5), force);
                    }
                    is_stuck || !fails(ms)
                },
                |_, _| true,
                |ms, estimate, flight| {
                    let tilt_rad = flight.errors(estimate).fixed_rows::<2>(0).amax();
                    let known = ms >= 6020 && fails(ms);
                    assert!(!(known && estimate.validity.attitude), "{fails_ms} ms, {ms} ms");
                    if !is_stuck {
                        silent_rad.push(tilt_rad);
                    } else if ms >= 6000 + fails_ms && estimate.validity.attitude {
                        let sigma_rad = f64::from(estimate.sigmas.attitude_rad.xy().max());
                        let most_rad = silent_rad[ms] + 5.0 * sigma_rad + 0.008;
                        assert!(tilt_rad < most_rad, "{fails_ms} ms, {ms} ms: {tilt_rad}, not {most_rad}");
                    }
                    let found = estimate.validity.position && position_error(estimate, flight) < 0.02;
                    assert!(ms < 7500 + fails_ms || found, "{fails_ms} ms, {ms} ms");
                },
            );
        }
    }
}

#[test]
fn faults_of_the_imu_are_told() {
    // Stuck in flight.
    let mut stuck_ms = None;
    flown(
        hover,
        MOCAP,
        3,
        |ms, sample| {
            if ms > 2000 {
                (sample.rates_rad_s, sample.specific_force_m_s2) = (Vector3::repeat(0.1), Vector3::repeat(5.0));
            }
            true
        },
        |_, _| true,
        |ms, estimate, _| {
            if estimate.imu.stuck {
                stuck_ms.get_or_insert(ms);
                assert!(!estimate.validity.attitude && !estimate.validity.position);
            }
        },
    );
    assert!((2015..2025).contains(&stuck_ms.unwrap()), "{stuck_ms:?}");
    // No samples.
    flown(
        hover,
        MOCAP,
        3,
        |ms, _| ms < 2000,
        |_, _| true,
        |ms, estimate, _| {
            assert_eq!(estimate.imu.missing, ms > 2019, "{ms}");
            assert!(ms < 2020 || !estimate.validity.attitude);
        },
    );
    // Clipped samples for a while are reported. Then the estimate recovers.
    flown(
        eight,
        MOCAP,
        9,
        |ms, sample| {
            if (6000..6030).contains(&ms) {
                sample.rates_rad_s.x = 34.9;
            }
            true
        },
        |_, _| true,
        |ms, estimate, flight| {
            assert_eq!(estimate.imu.clipped, (6000..6229).contains(&ms), "{ms} ms");
            assert!(ms < 7000 || (position_error(estimate, flight) < 0.005 && estimate.validity.position), "{ms} ms");
        },
    );
    // Noisy.
    let noise = core::cell::RefCell::new(Noise::new(4));
    flown(
        eight,
        MOCAP,
        6,
        |ms, sample| {
            if ms > 3000 {
                sample.specific_force_m_s2 += single(&noise.borrow_mut().vector(40.0));
            }
            true
        },
        |_, _| true,
        |ms, estimate, _| {
            let settling = (3000..3500).contains(&ms);
            assert!(settling || estimate.imu.noisy == (ms >= 3500), "{ms} ms: {:?}", estimate.imu);
        },
    );
}

#[test]
fn a_gap_in_the_samples_is_survived() {
    for gap_ms in [15, 100, 240, 600] {
        flown(
            eight,
            MOCAP,
            14,
            |ms, _| !(8000..8000 + gap_ms).contains(&ms),
            |_, _| true,
            |ms, estimate, flight| {
                let error = position_error(estimate, flight);
                assert!(!(3000..8000).contains(&ms) || error < 0.005, "{gap_ms}, {ms} ms");
                assert!(ms < 12_000 || error < 0.005, "gap of {gap_ms}, {ms} ms: {error} m, {estimate:#?}");
                assert_eq!(estimate.resets.restarts, u32::from(gap_ms > 250 && ms >= 8000 + gap_ms), "{gap_ms}");
            },
        );
    }
}

#[test]
fn bad_measurements_are_counted() {
    let good = Measurement::Position { position_m: Vector3::zeros(), sigma_m: 0.01 };
    let (estimate, mut memory) = at_rest(2000, NOTHING, |_, _| ());
    let estimator = Estimator::new(settings(&ICM)).unwrap();
    let now_us = estimate.at_us;
    let step = |memory: &mut Memory, ms: u64| {
        let sample = ImuSample {
            at_us: now_us + 1000 * ms,
            rates_rad_s: Vector3::new(1e-4 * ms as f32, 0.0, 0.0),
            specific_force_m_s2: Vector3::new(0.0, 0.0, 9.81),
        };
        estimator.step(memory, now_us + 1000 * ms, Some(&sample))
    };
    for value in [
        Measurement::Position { position_m: Vector3::new(f32::NAN, 0.0, 0.0), sigma_m: 0.01 },
        Measurement::Position { position_m: Vector3::new(1e6, 0.0, 0.0), sigma_m: 0.01 },
        Measurement::Position { position_m: Vector3::zeros(), sigma_m: 0.0 },
        Measurement::Height { height_m: 1.0, sigma_m: f32::NAN },
        Measurement::MagneticField { field: Vector3::zeros(), sigma: 0.1 },
        Measurement::Heading { heading_rad: f32::INFINITY, sigma_rad: 0.1 },
        Measurement::Pose {
            position_m: Vector3::zeros(),
            attitude: [0.2, 0.0, 0.0, 0.0],
            position_sigma_m: 0.1,
            attitude_sigma_rad: 0.1,
        },
    ] {
        memory.offer(&Stamped { value, at_us: now_us });
    }
    let _ = step(&mut memory, 1);
    assert_eq!(memory.dropped().implausible, 7);
    // One measurement is too old, one is far in the future, two have the same time, and one is older than the last.
    for at_us in [now_us - 300_000, now_us + 500_000, now_us - 20_000, now_us - 20_000, now_us - 40_000] {
        memory.offer(&Stamped { value: good, at_us });
    }
    for ms in 2..20 {
        let _ = step(&mut memory, ms);
    }
    let dropped = memory.dropped();
    assert_eq!((dropped.late, dropped.early, dropped.overtaken), (1, 1, 2), "{dropped:?}");
    assert_eq!(memory.aids().tracker_position.accepted, 1);
    for i in 0..10 {
        memory.offer(&Stamped { value: good, at_us: now_us + 20_000 + i });
    }
    assert_eq!(memory.dropped().crowded, 2);
}
