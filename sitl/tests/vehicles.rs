//! Tests `sitl vehicles` and `--vehicle`.

#![expect(clippy::unwrap_used, reason = "tests")]

use crate::common::{folder, refused, sitl, succeeds};
use std::fs;

#[test]
fn every_built_in_vehicle_is_listed_and_a_template() {
    let folder = folder("built_in");
    let list = succeeds(&sitl(&folder, &["vehicles"]));
    let names: Vec<_> = list.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert_eq!(names, ["paper", "crazyflie", "hummingbird", "racer", "iris", "f550"]);
    for name in names {
        let text = succeeds(&sitl(&folder, &["vehicles", name]));
        fs::write(folder.join("mine.toml"), text).unwrap();
        let flight = ["fly", "hover", "--vehicle", "mine.toml", "--duration", "0.1", "--force"];
        assert!(succeeds(&sitl(&folder, &flight)).starts_with("hover: rigid-body plant, real rotors, battery, drag"));
    }
}

/// The log has columns for six rotors. The flight is the same whether the command line or the scenario names the
/// vehicle.
#[test]
fn a_scenario_may_name_its_vehicle() {
    let folder = folder("named");
    let hover = "controllers = [\"afbc\"]\nduration_s = 2.0\n[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 2]\n";
    fs::write(folder.join("own.toml"), format!("{hover}[vehicle]\nname = \"f550\"\n")).unwrap();
    fs::write(folder.join("any.toml"), hover).unwrap();
    succeeds(&sitl(&folder, &["fly", "own.toml", "--out", "a"]));
    succeeds(&sitl(&folder, &["fly", "any.toml", "--vehicle", "f550", "--out", "b"]));
    let csv = |out: &str| {
        let files = fs::read_dir(folder.join(out)).unwrap().map(|entry| entry.unwrap().path());
        let log = files.into_iter().find(|path| path.extension().is_some_and(|extension| extension == "csv")).unwrap();
        fs::read_to_string(log).unwrap()
    };
    let (own, any) = (csv("a"), csv("b"));
    assert!(own.starts_with("time_s") && own.contains("omega6_rad_s") && !own.contains("omega7_rad_s"));
    assert_eq!(own, any);
}

#[test]
fn a_vehicle_that_is_not_there_or_does_not_fly_gets_one_line() {
    let folder = folder("refused");
    let racer = succeeds(&sitl(&folder, &["vehicles", "racer"]));
    fs::write(folder.join("heavy.toml"), racer.replacen("mass_kg = 0.752", "mass_kg = 5.0", 1)).unwrap();
    fs::write(folder.join("slip.toml"), format!("{racer}[gains.flight.pdi]\ntilt_p_1_s = 9.0\n")).unwrap();
    let pinned = "[vehicle]\nname = \"racr\"\n[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 2]\n";
    fs::write(folder.join("pinned.toml"), pinned).unwrap();
    for (arguments, expected) in [
        (&["fly", "hover", "--vehicle", "racr"][..], "did you mean racer?"),
        (&["fly", "hover", "--vehicle", "./none.toml"], "./none.toml: no such file; `sitl vehicles` lists"),
        (&["fly", "hover", "--vehicle", "heavy.toml"], "heavy.toml:14: vehicle: rotor_force_max_n"),
        (&["compare", "hover", "--vehicle", "slip.toml"], "gains.flight.pdi: unknown key; known here: cascade, afbc"),
        (&["vehicles", "nothing"], "no built-in vehicle"),
        (&["fly", "pinned.toml"], "pinned.toml:2: vehicle.name: \"racr\" is no built-in vehicle; did you mean racer?"),
        (&["pil", "hover", "--vehicle", "racr"], "did you mean racer?"),
    ] {
        let error = refused(&sitl(&folder, arguments));
        assert!(error.contains(expected) && error.lines().count() == 1, "{error}, not {expected}");
    }
    assert!(!folder.join("out").exists(), "nothing is written");
}

/// A campaign resumes with the same vehicle, whatever the path and comments of its file. Another vehicle is another
/// campaign.
#[test]
fn a_campaign_goes_on_with_the_same_vehicle_from_elsewhere() {
    let folder = folder("campaign");
    let racer = succeeds(&sitl(&folder, &["vehicles", "racer"]));
    fs::create_dir(folder.join("elsewhere")).unwrap();
    fs::write(folder.join("mine.toml"), &racer).unwrap();
    fs::write(folder.join("elsewhere/copy.toml"), format!("# A copy.\n{racer}")).unwrap();
    fs::write(folder.join("other.toml"), racer.replacen("mass_kg = 0.752", "mass_kg = 0.8", 1)).unwrap();
    let campaign = "flights = 2\nduration_s = 0.5\nscenario = \"hover\"\n[spread]\nmass_ratio = [0.9, 1.1]\n";
    fs::write(folder.join("small.toml"), campaign).unwrap();
    let fly = |vehicle| sitl(&folder, &["campaign", "small.toml", "--vehicle", vehicle, "--out", "out"]);
    succeeds(&fly("mine.toml"));
    let flown = fs::read(folder.join("out/results.parquet")).unwrap();
    succeeds(&fly("elsewhere/copy.toml"));
    assert_eq!(fs::read(folder.join("out/results.parquet")).unwrap(), flown);
    refused(&fly("other.toml"));
}
