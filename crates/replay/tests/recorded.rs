//! Recorded flights against PX4's EKF2 over them. Skipped where the data are absent.
#![allow(clippy::unwrap_used, missing_docs, reason = "tests")]

use afbc_replay::{Start, fly, read};
use std::path::Path;

/// The bounds that the documentation states.
#[test]
fn agrees_with_ekf2_on_recorded_flights() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    for (name, compared) in [("ecl_iris_gps.csv", 200), ("px4_sitl_hover.ulg", 150)] {
        let path = folder.join(name);
        if !path.exists() {
            println!("skipped: no {}", path.display());
            continue;
        }
        let recording = read(&path).unwrap();
        let replayed = fly(&recording, Some(10.0)).unwrap();
        let f = &replayed.figures;
        let [attitude, velocity, position] = [f.attitude, f.velocity, f.position].map(|figure| {
            assert!(figure.count > compared && figure.valid_ratio() == Some(1.0), "{name}: {figure:?}");
            figure.rms().unwrap()
        });
        println!("{name}: {attitude} deg, {velocity} m/s, {position} m");
        assert!(attitude < 2.0 && velocity < 0.3 && position < 1.0, "{name}: {attitude}, {velocity}, {position}");
        assert!(matches!(replayed.start, Start::AtRest(at_s) if at_s < 2.0), "{:?}", replayed.start);
        let resets = replayed.resets;
        assert_eq!((resets.position, resets.velocity, resets.heading, resets.restarts), (1, 0, 0, 0));
        let aids = &replayed.aids;
        assert_eq!(aids.gnss_position.rejected + aids.height.rejected + aids.heading.rejected, 0);
        assert_eq!(recording.missing().count(), 0);
    }
}
