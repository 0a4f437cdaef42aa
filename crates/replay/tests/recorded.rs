//! Compares our estimate with PX4's EKF2 on recorded flights. Skipped if the recordings are absent.
#![allow(clippy::unwrap_used, clippy::panic, missing_docs, reason = "tests")]

use afbc_replay::{EstimatorStart, Recording, fly, read};
use std::path::Path;

/// Reads a log of the shared data; prints a line and returns none if it is absent.
fn shared(name: &str) -> Option<Recording> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(name);
    if !path.exists() {
        println!("skipped: no {}", path.display());
        return None;
    }
    Some(read(&path).unwrap())
}

/// Checks the bounds that the documentation states.
#[test]
fn agrees_with_ekf2_on_recorded_flights() {
    for (name, compared) in [("ecl_iris_gps.csv", 200), ("px4_sitl_hover.ulg", 150)] {
        let Some(recording) = shared(name) else { continue };
        let replayed = fly(&recording, Some(10.0)).unwrap();
        let f = &replayed.figures;
        let [attitude, velocity, position] = [f.attitude, f.velocity, f.position].map(|figure| {
            assert!(figure.count > compared && figure.valid_ratio() == Some(1.0), "{name}: {figure:?}");
            figure.rms().unwrap()
        });
        println!("{name}: {attitude} deg, {velocity} m/s, {position} m");
        assert!(attitude < 2.0 && velocity < 0.3 && position < 1.0, "{name}: {attitude}, {velocity}, {position}");
        assert!(matches!(replayed.start, EstimatorStart::AtRest(at_s) if at_s < 2.0), "{:?}", replayed.start);
        let resets = replayed.resets;
        assert_eq!((resets.position, resets.velocity, resets.heading, resets.restarts), (1, 0, 0, 0));
        let aids = &replayed.aids;
        assert_eq!(aids.gnss_position.rejected + aids.height.rejected + aids.heading.rejected, 0);
        assert_eq!(recording.missing().count(), 0);
    }
}

/// The vehicle stands still for nine seconds, at first without a fix: the estimate must not move.
#[test]
fn rest_before_the_first_fix_is_rest() {
    for name in ["px4_sitl_hover.ulg", "ecl_iris_gps.csv"] {
        let Some(mut recording) = shared(name) else { continue };
        // The vehicle is also found at rest without flags that say that it stands, and without any fix.
        for (stated, fixes) in [(true, true), (false, true), (true, false)] {
            if !stated {
                recording.landed.clear();
                recording.disarmed.clear();
            }
            if !fixes {
                recording.aiding.clear();
            }
            let replayed = fly(&recording, Some(10.0)).unwrap();
            let EstimatorStart::AtRest(began_s) = replayed.start else { panic!("{:?}", replayed.start) };
            let mut first = None;
            for row in replayed.rows.iter().filter(|row| row.time_s < 8.5) {
                let Some(ours) = row.ours.filter(|_| row.time_s > began_s + 0.5) else { continue };
                let state = &ours.state;
                let (place, attitude) = *first.get_or_insert((state.position_m, state.attitude_rad));
                let speed = state.velocity_m_s.norm();
                let tilt = (state.attitude_rad - attitude).xy().norm().to_degrees();
                assert!(speed < 0.05 && tilt < 0.3, "{name}, {} s: {speed} m/s, {tilt} degrees", row.time_s);
                let away = (state.position_m - place).norm();
                assert!(fixes || away < 0.1, "{name}, {} s: {away} m", row.time_s);
                assert!(ours.at_rest && ours.validity.velocity, "{name}, {} s", row.time_s);
            }
            assert!(first.is_some());
        }
    }
}

/// The magnetometer's field is not the earth's: it lies level instead of dipping by 74 degrees. So its heading counts
/// as unknown. The log's own heading turns by 12 degrees although the vehicle stands still.
#[test]
fn a_field_that_is_not_the_earths_gives_no_heading() {
    let Some(recording) = shared("sample_log_small.ulg") else { return };
    let replayed = fly(&recording, None).unwrap();
    let stated = recording.notes.iter().any(|note| note.contains("magnetometer") && note.contains("calibrate"));
    assert!(stated, "{:?}", recording.notes);
    for row in &replayed.rows {
        let Some((ours, turn)) = row.ours.zip(row.rotation_rad()) else { continue };
        let sigma = f64::from(ours.sigmas.attitude_rad.z);
        assert!(!ours.validity.heading && turn.z.abs() < 3.0 * sigma, "{} s: {} of {sigma} rad", row.time_s, turn.z);
    }
}
