//! Tests `sitl replay`: results and errors.

#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use crate::common::{folder, log_at_rest, refused, sitl, succeeds};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn summary(folder: &Path, name: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.join("out").join(name).join("summary.json")).unwrap()).unwrap()
}

/// The logged estimate is off by 2 degrees, 0.1 m/s and 0.3 m, which the replay must find. Its own heading follows the
/// field, which by the World Magnetic Model points 0.62 degrees east of north at this place.
#[test]
fn says_how_far_the_estimates_are_apart() {
    let folder = folder("apart");
    log_at_rest(&folder, 15);
    let said = succeeds(&sitl(&folder, &["replay", "rest.csv"]));
    assert!(said.contains("attitude") && said.contains("started at rest") && !said.contains("Missing"), "{said}");
    let out = folder.join("out/replay-rest");
    let found = summary(&folder, "replay-rest");
    let number = |key: &str| found[key].as_f64().unwrap();
    assert!((number("heading_rms_deg") - 1.38).abs() < 0.2 && number("tilt_rms_deg") < 0.3, "{found:#}");
    assert!((number("velocity_rms_m_s") - 0.1).abs() < 0.02, "{found:#}");
    assert!((number("horizontal_rms_m") - 0.3).abs() < 0.05, "{found:#}");
    // The estimate is compared over the second half of the time after the start, since that time is shorter than 20 s.
    assert!((number("measured_from_s") - 8.0).abs() < 0.2, "{found:#}");
    for name in ["attitude.svg", "velocity.svg", "position.svg", "difference.svg"] {
        let text = fs::read_to_string(out.join(name)).unwrap();
        roxmltree::Document::parse(&text).unwrap();
    }
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert_eq!(page.matches("<svg ").count(), 4);
    let csv = fs::read_to_string(out.join("replay.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 15 * 10);
    let columns = csv.lines().next().unwrap().split(',').count();
    assert!(columns == 28 && csv.lines().all(|line| line.split(',').count() == columns));
    // This replay is compared from another time on.
    succeeds(&sitl(&folder, &["replay", "rest.csv", "--from", "14", "--force"]));
    assert_eq!(summary(&folder, "replay-rest")["measured_from_s"], 14.0);
}

/// The stated error of the compass decides the standard deviation of the heading.
#[test]
fn the_error_of_the_compass_can_be_stated() {
    let folder = folder("compass");
    log_at_rest(&folder, 14);
    let sigma = |error: &str| {
        succeeds(&sitl(&folder, &["replay", "rest.csv", "--compass-error", error, "--force"]));
        let csv = fs::read_to_string(folder.join("out/replay-rest/replay.csv")).unwrap();
        let mut lines = csv.lines();
        let column = lines.next().unwrap().split(',').position(|name| name == "rz_sigma_rad").unwrap();
        lines.next_back().unwrap().split(',').nth(column).unwrap().parse::<f64>().unwrap()
    };
    let [sure, usual, unsure] = ["0", "0.1", "0.4"].map(sigma);
    assert!(sure < 0.05 && (0.09..0.2).contains(&usual) && unsure > 0.3, "{sure} {usual} {unsure}");
    for wrong in ["-0.1", "much", "nan"] {
        let output = sitl(&folder, &["replay", "rest.csv", &format!("--compass-error={wrong}")]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success());
        assert!(said.contains("--compass-error") && said.contains("number of rad"), "{said}");
    }
}

/// Without a logged estimate, there is nothing to compare with, which is reported. The replay also runs without the
/// other kinds of lines.
#[test]
fn says_what_is_missing() {
    let folder = folder("missing");
    log_at_rest(&folder, 12);
    fs::remove_file(folder.join("rest_ekf2.csv")).unwrap();
    let log = fs::read_to_string(folder.join("rest.csv")).unwrap();
    let imu: String = log.lines().filter(|line| line.contains("imu")).map(|line| format!("{line}\n")).collect();
    fs::write(folder.join("imu.csv"), imu).unwrap();
    for (name, missing) in [
        ("rest", vec!["rest_ekf2.csv", "rest_ekf2.csv"]),
        ("imu", vec!["gps", "baro", "mag", "imu_ekf2.csv", "imu_ekf2.csv"]),
    ] {
        let said = succeeds(&sitl(&folder, &["replay", &format!("{name}.csv")]));
        assert!(missing.iter().all(|topic| said.contains(topic)), "{said}");
        let found = summary(&folder, &format!("replay-{name}"));
        assert_eq!(found["missing"], serde_json::json!(missing));
        for key in ["attitude_rms_deg", "velocity_rms_m_s", "position_rms_m"] {
            assert_eq!(found[key], Value::Null, "{key}");
        }
    }
}

/// Invalid lines are skipped and counted.
#[test]
fn skips_and_counts_bad_lines() {
    let folder = folder("lines");
    log_at_rest(&folder, 14);
    let good = fs::read_to_string(folder.join("rest.csv")).unwrap();
    let mut lines: Vec<String> = good.lines().map(str::to_owned).collect();
    for (at, line) in [
        (700, "2500000,imu,nan,0,0,0,0,0"),
        (900, "18446744073709551615,imu,0,0,-9.8,0,0,0"),
        (1100, "4000,imu,0,0,-9.8,0,0,0"),
        (1300, "-1,imu,0,0,-9.8,0,0,0"),
        (1500, "5000000,gps,1e300,1e300,1e300,0,0,0"),
        (1700, "6000000,mag,inf,0,0"),
        (1900, "what is this"),
    ] {
        lines.insert(at, line.to_owned());
    }
    fs::write(folder.join("rest.csv"), lines.join("\n")).unwrap();
    let said = succeeds(&sitl(&folder, &["replay", "rest.csv"]));
    assert!(said.contains("2 lines were skipped; the first is line 1301."), "{said}");
    let found = summary(&folder, "replay-rest");
    let skipped = |index: usize| found["sources"][index]["skipped"].as_u64().unwrap();
    assert_eq!((skipped(0), skipped(1)), (3, 1), "{found:#}");
    assert!(found["velocity_rms_m_s"].as_f64().unwrap() < 0.13, "{found:#}");
}

#[test]
fn what_is_no_log_is_refused_in_one_line() {
    let folder = folder("refused");
    log_at_rest(&folder, 1);
    for (name, bytes, words) in [
        ("empty.ulg", &b""[..], "empty"),
        ("short.ulg", b"ULog\x01\x12\x35\x01\0\0", "16 bytes"),
        ("bare.ulg", b"ULog\x01\x12\x35\x01\0\0\0\0\0\0\0\0", "sensor_combined"),
        ("text.csv", b"hello\nworld\n", "not a log"),
        ("picture.png", b"\x89PNG\r\n\x1a\n\0\0\0", "not a log"),
        ("nan.csv", b"1000,imu,nan,nan,nan,nan,nan,nan\n", "the log has no usable line of kind imu"),
        ("gps.csv", b"1000,gps,488000,85456073,473977508,0,0,0\n", "the log has no line of kind imu"),
    ] {
        fs::write(folder.join(name), bytes).unwrap();
        let said = refused(&sitl(&folder, &["replay", name]));
        assert!(said.starts_with(&format!("{name}: ")) && said.contains(words) && said.contains(';'), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
    }
    assert!(refused(&sitl(&folder, &["replay", "nothing.ulg"])).starts_with("nothing.ulg: the log cannot be read"));
    assert!(refused(&sitl(&folder, &["replay", "."])).starts_with(".: the log cannot be read"));
    fs::remove_file(folder.join("rest_ekf2.csv")).unwrap();
    let said = refused(&sitl(&folder, &["replay", "rest.csv"]));
    assert!(said.starts_with("rest.csv: the estimator never started (at rest, but not yet for long enough)"), "{said}");
    assert!(!folder.join("out").exists());
}

/// Replays recorded flights; skipped if the data are absent.
#[test]
fn recorded_flights() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let folder = folder("recorded");
    for (name, file) in [("ecl_iris_gps", "ecl_iris_gps.csv"), ("px4_sitl_hover", "px4_sitl_hover.ulg")] {
        let path = data.join(file);
        if !path.exists() {
            println!("skipped: no {}", path.display());
            continue;
        }
        succeeds(&sitl(&folder, &["replay", path.to_str().unwrap()]));
        let found = summary(&folder, &format!("replay-{name}"));
        for (key, bound) in [("attitude_rms_deg", 2.0), ("velocity_rms_m_s", 0.3), ("position_rms_m", 1.0)] {
            assert!(found[key].as_f64().unwrap() < bound, "{name}: {key}: {}", found[key]);
        }
    }
}
