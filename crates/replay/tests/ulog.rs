//! Replays PX4 logs that the test writes itself: in old and new layouts, whole and damaged.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs, reason = "tests")]

mod common;

use afbc_replay::{EstimatorStart, Recording, Replayed, Sensor, fly, read};
use common::{Kind, file, log, replay};

/// Checks that estimate and truth agree in attitude \[degrees\], velocity \[m/s\] and position \[m\].
fn agrees(replayed: &Replayed, what: &str) {
    let f = &replayed.figures;
    let [attitude, velocity, position] = [f.attitude, f.velocity, f.position].map(|figure| figure.rms().unwrap());
    println!("{what}: {attitude:.3} deg, {velocity:.3} m/s, {position:.3} m");
    assert!(attitude < 0.5 && velocity < 0.06 && position < 0.1, "{what}: {attitude}, {velocity}, {position}");
    assert!(f.attitude.valid_ratio() > Some(0.95), "{what}: {:?}", f.attitude);
}

fn missing(recording: &Recording) -> Vec<Sensor> {
    recording.missing().map(|source| source.sensor).collect()
}

#[test]
fn old_and_new_layouts_say_the_same() {
    for rate_hz in [100, 250, 1000] {
        let both = [false, true].map(|old| {
            let kind = Kind { old, rate_hz, ..Kind::default() };
            let (recording, replayed) = replay(&format!("layout-{old}-{rate_hz}.ulg"), &log(&kind));
            agrees(&replayed, &format!("old {old}, {rate_hz} Hz"));
            assert!(matches!(replayed.start, EstimatorStart::AtRest(at_s) if at_s < 1.5), "{:?}", replayed.start);
            assert_eq!(missing(&recording), []);
            assert!((recording.imu_rate_hz() - rate_hz as f64).abs() < 1.0);
            let resets = replayed.resets;
            assert_eq!((resets.position, resets.velocity, resets.restarts), (1, 0, 0));
            recording
        });
        let [new, old] = both
            .map(|recording| recording.sources.iter().map(|source| (source.sensor, source.used)).collect::<Vec<_>>());
        assert_eq!(new, old);
    }
}

/// A heading needs a magnetometer or accelerated motion; velocity and position need a receiver.
#[test]
fn a_log_that_lacks_a_topic_flies_on_the_rest() {
    for old in [false, true] {
        let without = |topic| {
            let kind = Kind { old, without: vec![topic], ..Kind::default() };
            replay(&format!("without-{old}-{topic}.ulg"), &log(&kind))
        };
        let (recording, replayed) = without("vehicle_air_data");
        assert_eq!(missing(&recording), [Sensor::Barometer]);
        agrees(&replayed, "no barometer");

        let (recording, Replayed { figures, .. }) = without("vehicle_gps_position");
        assert_eq!(missing(&recording), [Sensor::Gnss]);
        assert_eq!((figures.velocity.rms(), figures.position.rms()), (None, None));
        assert!(figures.attitude.rms() < Some(6.0), "{:?}", figures.attitude.rms());
        assert!(figures.tilt.rms().is_some());

        let (recording, Replayed { figures, .. }) = without("vehicle_magnetometer");
        assert_eq!(missing(&recording), [Sensor::Magnetometer]);
        // While the vehicle accelerates, the receiver's velocity reveals the heading.
        assert!(figures.heading.rms() < Some(10.0), "{:?}", figures.heading.rms());
        assert!(figures.tilt.rms() < Some(1.0) && figures.position.rms() < Some(1.0), "{figures:?}");

        let (recording, Replayed { figures, rows, .. }) = without("vehicle_attitude");
        assert_eq!(missing(&recording), [Sensor::Attitude]);
        assert!(figures.attitude.rms().is_none() && figures.velocity.rms() < Some(0.06));
        assert!(!rows.is_empty());

        let (recording, Replayed { figures, .. }) = without("vehicle_local_position");
        assert_eq!(missing(&recording), [Sensor::Motion]);
        assert!(figures.velocity.rms().is_none() && figures.attitude.rms() < Some(0.5));
    }
    // A log without any estimate of its own.
    let kind = Kind { without: vec!["vehicle_attitude", "vehicle_local_position"], ..Kind::default() };
    let (recording, replayed) = replay("alone.ulg", &log(&kind));
    assert_eq!(missing(&recording), [Sensor::Attitude, Sensor::Motion]);
    assert!(replayed.rows.iter().any(|row| row.ours.is_some_and(|ours| ours.validity.position)));
    // A receiver that never has a fix counts as unusable, not as missing.
    let mut bytes = log(&Kind::default());
    let (recording, _) = replay("fix.ulg", &bytes);
    assert_eq!(recording.unusable().count(), 0);
    without_fixes(&mut bytes);
    let (recording, Replayed { figures, .. }) = replay("no-fix.ulg", &bytes);
    assert_eq!(missing(&recording), []);
    assert_eq!(recording.unusable().map(|source| source.sensor).collect::<Vec<_>>(), [Sensor::Gnss]);
    assert!(figures.velocity.rms().is_none() && figures.attitude.rms() < Some(6.0));
    // A log without IMU samples.
    let kind = Kind { without: vec!["sensor_combined"], ..Kind::default() };
    let error = read(&file("imu.ulg", &log(&kind))).unwrap_err().to_string();
    assert!(error.contains("imu.ulg") && error.contains("sensor_combined") && error.contains("SDLOG"), "{error}");
}

/// Sets the fix type of every GNSS message to 0: the second-to-last byte of its records.
fn without_fixes(bytes: &mut [u8]) {
    let mut at = 16;
    while at + 3 < bytes.len() {
        let length = usize::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
        let end = at + 3 + length;
        // GNSS is the log's second topic in the new layout.
        if bytes[at + 2] == b'D' && bytes[at + 3..at + 5] == [1, 0] {
            bytes[end - 2] = 0;
        }
        at = end;
    }
}

/// In a log of 8 s, estimates are compared in the second half of the time after the start.
#[test]
fn a_short_log_is_compared_from_its_middle_on() {
    let (_, replayed) = replay("eight.ulg", &log(&Kind { duration_s: 8.0, ..Kind::default() }));
    assert!((4.4..4.7).contains(&replayed.from_s), "{}", replayed.from_s);
    agrees(&replayed, "8 s");
}

#[test]
fn a_log_that_begins_in_the_air_starts_in_its_own_state() {
    for without in [vec![], vec!["vehicle_land_detected"]] {
        let kind = Kind { begins_s: 4.0, without, ..Kind::default() };
        let (_, replayed) = replay("air.ulg", &log(&kind));
        assert!(matches!(replayed.start, EstimatorStart::FromLog(at_s, None) if at_s < 0.5), "{:?}", replayed.start);
        agrees(&replayed, "in the air");
    }
    // Without an attitude in the log, the estimator does not start in the air.
    let kind = Kind { begins_s: 4.0, without: vec!["vehicle_attitude"], ..Kind::default() };
    let (_, replayed) = replay("air-alone.ulg", &log(&kind));
    assert!(matches!(replayed.start, EstimatorStart::Never(_)), "{:?}", replayed.start);
    assert!(replayed.rows.iter().all(|row| row.ours.is_none()));
}

/// The log's position jumps by 10 m together with its reference: the place stays the same, and the reset is reported.
#[test]
fn resets_of_the_log_are_reported_and_its_references_followed() {
    let (recording, replayed) = replay("reset.ulg", &log(&Kind { reset_s: 17.0, ..Kind::default() }));
    agrees(&replayed, "reset");
    assert_eq!(recording.resets.len(), 1, "{:?}", recording.resets);
    let reset = &recording.resets[0];
    assert_eq!((reset.what, reset.unit), ("position", "m"));
    assert!((reset.by - 10.0).abs() < 1e-6);
}

#[test]
fn gaps_and_receivers() {
    // The estimator bridges the first gap, and starts again after the second.
    let (_, replayed) = replay("gap.ulg", &log(&Kind { gap_s: (8.0, 8.2), ..Kind::default() }));
    assert_eq!(replayed.resets.restarts, 0);
    agrees(&replayed, "gap of 0.2 s");
    let kind = Kind { gap_s: (6.0, 9.0), duration_s: 40.0, ..Kind::default() };
    let (recording, _) = replay("long-gap.ulg", &log(&kind));
    let replayed = fly(&recording, Some(25.0)).unwrap();
    assert_eq!(replayed.resets.restarts, 1);
    assert!(replayed.figures.position.rms() < Some(0.5) && replayed.figures.attitude.rms() < Some(3.0));
    // The first of two receivers has no fix.
    let (recording, replayed) = replay("two.ulg", &log(&Kind { receivers: 2, ..Kind::default() }));
    agrees(&replayed, "two receivers");
    assert!(recording.notes.iter().any(|note| note.contains("receivers")), "{:?}", recording.notes);
}

/// Without the correction, a field of 0.05 gauss that turns with the vehicle would cost 13 degrees of heading.
#[test]
fn what_ekf2_knows_of_the_magnetometer_counts() {
    for old in [false, true] {
        let (_, replayed) = replay("iron.ulg", &log(&Kind { iron: 0.05, old, ..Kind::default() }));
        agrees(&replayed, "iron");
    }
}

/// A cut log is reported, and the rest is replayed.
#[test]
fn a_cut_log_is_flown_as_far_as_it_goes() {
    let whole = log(&Kind::default());
    for share in [0.6, 0.9, 0.9999] {
        let cut = &whole[..(share * whole.len() as f64) as usize];
        let (recording, replayed) = replay("cut.ulg", cut);
        assert!(recording.notes.iter().any(|note| note.contains("cut")), "{:?}", recording.notes);
        agrees(&replayed, "cut");
    }
    for length in (0..600).step_by(7) {
        let error = read(&file("stub.ulg", &whole[..length])).unwrap_err().to_string();
        assert!(error.contains("stub.ulg: ") && error.contains(';') && error.lines().count() == 1, "{error}");
    }
}

/// Damage costs only the records that it hits.
#[test]
fn a_damaged_log_is_flown_around_the_damage() {
    let whole = log(&Kind::default());
    for share in [0.3, 0.5, 0.8] {
        let mut damaged = whole.clone();
        let at = (share * whole.len() as f64) as usize;
        damaged[at..at + 300].fill(0xa5);
        let (recording, replayed) = replay("damaged.ulg", &damaged);
        assert!(recording.notes.iter().any(|note| note.contains("skipped")), "{:?}", recording.notes);
        let imu = recording.sources.iter().find(|source| source.sensor == Sensor::Imu).unwrap();
        assert!(imu.used > 25 * 250 - 15, "{imu:?}");
        agrees(&replayed, "damaged");
    }
}

/// Any file gives an error of one line or a finite estimate.
#[test]
fn no_file_panics() {
    let whole = log(&Kind { duration_s: 3.0, rate_hz: 100, ..Kind::default() });
    let mut seed = 12_345_u64;
    let mut random = |below: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % below
    };
    let mut read_ones = 0;
    for case in 0..400 {
        let mut bytes = whole.clone();
        // Most cases damage the definitions, which the parser trusts most.
        let within = if case % 3 == 0 { bytes.len() } else { 2500 };
        for _ in 0..=random(8) {
            match random(4) {
                0 => bytes[random(within)] = random(256) as u8,
                1 => bytes[random(within)] ^= 1 << random(8),
                2 => drop(bytes.remove(random(within))),
                _ => bytes.insert(random(within), random(256) as u8),
            }
        }
        if case % 5 == 0 {
            bytes.truncate(random(bytes.len()));
        }
        if let Ok(recording) = read(&file("random.ulg", &bytes)) {
            read_ones += 1;
            let replayed = fly(&recording, Some(0.0)).unwrap();
            for ours in replayed.rows.iter().filter_map(|row| row.ours) {
                assert!(ours.state.is_plausible());
            }
        }
    }
    assert!(read_ones > 100, "{read_ones}");
}

/// Unknown iron turns the heading. The more the field differs from the earth's, the larger the stated heading error,
/// and the actual error is within it. A field that differs completely gives no heading.
#[test]
fn a_heading_is_as_good_as_the_field() {
    let (mut inside, mut all) = (0, 0);
    for (index, gauss) in [0.0, 0.01, 0.03, 0.05, 0.05, 0.08, 0.1, 0.1, 0.6, 0.6].into_iter().enumerate() {
        // Bias directions all around, some of them steep.
        let angle = 2.4 * index as f64;
        let stray = [angle.cos(), angle.sin(), 0.8 - 0.3 * (index % 6) as f64].map(|part| part * gauss);
        let kind = Kind { stray, ..Kind::default() };
        let (recording, replayed) = replay(&format!("stray-{index}.ulg"), &log(&kind));
        let strange = recording.notes.iter().any(|note| note.contains("magnetometer") && note.contains("calibrate"));
        let valid = replayed.figures.heading.valid_ratio().unwrap();
        assert!(if gauss > 0.5 { strange } else { !strange || gauss > 0.04 }, "{stray:?}: {:?}", recording.notes);
        assert!(gauss > 0.04 || valid > 0.95, "{stray:?}: heading valid {valid}");
        for (ours, turn) in replayed.rows.iter().filter_map(|row| row.ours.zip(row.rotation_rad())) {
            let sigma = f64::from(ours.sigmas.attitude_rad.z);
            inside += usize::from(turn.z.abs() < 3.0 * sigma);
            all += 1;
            // The heading is checked until the vehicle flies. Its motion then reveals the heading, too.
            assert!(gauss < 0.5 || ours.at_us > 53_000_000 || !ours.validity.heading, "{stray:?}: {sigma} rad");
        }
    }
    assert!(100 * inside >= 99 * all, "{inside} of {all}");
}
