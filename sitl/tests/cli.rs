//! Tests the command line: errors, output files and exit codes.

#![expect(clippy::unwrap_used, reason = "tests")]

use crate::common::{command, folder, sitl};
use afbc_scenario::contender::ControllerKind;
use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};
use std::time::Instant;

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Returns every file under `folder`, by path.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.insert(path.clone(), fs::read(&path).unwrap());
        }
    }
    found
}

/// Three lines; appended text begins at line 4.
const HOVER: &str = "[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 1]\n";

/// Text appended to [`HOVER`], and the error.
const BAD_TABLES: [(&str, &str); 70] = [
    ("[[outage]]\nstart_s = -1", ":5: outage.start_s: -1 is out of range: it must lie within 0 to 36000 (seconds)"),
    ("[vehicle]\nmass_g = 486", ":5: vehicle.mass_g: unknown key; did you mean mass_kg (kilograms)?"),
    (
        "[vehicle]\n\n\nmass_kg = 4860",
        ":7: vehicle.mass_kg: 4860 is out of range: it must lie within 0.01 to 500 (kilograms)",
    ),
    (
        "[vehicle]\nmass_kg = \"0.5\"",
        ":5: vehicle.mass_kg: the value is a string and must be a number (kilograms); write digits without quotes",
    ),
    (
        "[vehicle]\nmass_kg = nan",
        ":5: vehicle.mass_kg: NaN is not a finite number: it must lie within 0.01 to 500 (kilograms)",
    ),
    (
        "[vehicle]\narm_m = -inf",
        ":5: vehicle.arm_m: -inf is not a finite number: it must lie within 0.01 to 10 (metres)",
    ),
    ("[vehicle]\ninertia_kg_m2 = [1, 2]", ":5: vehicle.inertia_kg_m2: 2 values; write three, as in [x, y, z]"),
    (
        "[vehicle]\ninertia_kg_m2 = 1",
        ":5: vehicle.inertia_kg_m2: the value is a number and must be three numbers; write [x, y, z]",
    ),
    (
        "[vehicle]\ninertia_kg_m2 = [\n  1,\n  -1,\n  1]",
        ":7: vehicle.inertia_kg_m2: -1 is out of range: it must lie within 1e-6 to 1000 (kilogram square metres)",
    ),
    ("[truth]\nmass = 0.5", ":5: truth.mass: unknown key; did you mean mass_kg (kilograms)?"),
    ("[gains.rol]\neta = 1", ":4: gains.rol: unknown key; did you mean roll?"),
    ("[gains]\nroll = 1", ":5: gains.roll: the value is a number and must be a table; write one table: [gains.roll]"),
    ("[gains.z]\neta = -1", ":5: gains.z.eta: -1 is out of range: it must lie within 0 to 10000 (input per m or rad)"),
    (
        "[gains.x]\neta = 1\nwidth = 0.1",
        ":4: gains.x.centre: centre / width = 100, out of range: it must lie within 0.1 to 6; change the centre or the \
         width",
    ),
    ("[settings]\ndt_s = 1", ":5: settings.dt_s: 1 is out of range: it must lie within 0.0001 to 0.02 (seconds)"),
    (
        "[settings]\nrate_hz = 500",
        ":5: settings.rate_hz: unknown key; \
         known here: dt_s, rotor_force_max_n, raised_thrust_max, rotor_drag_1_s, body_drag_1_m, rotor_height_m, \
         command_filter_rad_s, forward_rad_s, tilt_by_thrust, anti_windup, freeze_on_ground, bumpless, feed_forward, \
         by_rotation, disturbance_rad_s, disturbance_z_rad_s, disturbance_tilt_rad_s, disturbance_yaw_rad_s, \
         memory_1_s, memory_speed_m_s, disturbance_lag_s, reference_xy_rad_s, reference_z_rad_s, reference_yaw_rad_s, \
         reference_acceleration_m_s2, reference_turn_rad_s2, reference_yaw_rate_rad_s, smooth_tilt_rad_s, \
         smooth_yaw_rad_s, smooth_lift_rad_s, lead_s",
    ),
    (
        "[initial]\nattitude_rad = [1.6, 0, 0]",
        ":5: initial.attitude_rad: 1.6 is out of range: it must lie within -1.5 to 1.5 (radians)",
    ),
    (
        "[initial]\nattitude_deg = [5, 0, 0]",
        ":5: initial.attitude_deg: unknown key; did you mean attitude_rad (radians)?",
    ),
    (
        "[[gust]]\naxis = \"x\"\nmoment_n_m = 1\nstart_s = 1",
        ":6: gust.moment_n_m: unknown key; known here: axis, acceleration_m_s2, force_n, start_s, duration_s",
    ),
    (
        "[[gust]]\naxis = \"x\"\nstart_s = 1",
        ":4: gust.acceleration_m_s2: missing; axis \"x\" takes acceleration_m_s2 or force_n",
    ),
    (
        "[[gust]]\naxis = \"yaw\"\nmoment_n_m = 1\nangular_acceleration_rad_s2 = 1\nstart_s = 1",
        ":6: gust.moment_n_m: the gust has two sizes; axis \"yaw\" takes angular_acceleration_rad_s2 or moment_n_m, \
         not both",
    ),
    (
        "[[gust]]\naxis = \"phi\"\nforce_n = 1\nstart_s = 1",
        ":5: gust.axis: \"phi\" is unknown; it must be \"roll\", \"pitch\", \"yaw\", \"z\", \"x\" or \"y\"",
    ),
    ("[[gust]]\naxis = \"x\"\nforce_n = 1", ":4: gust.start_s: missing; add it (seconds)"),
    (
        "[[gust]]\naxis = \"x\"\nforce_n = 1\nstart_s = 1\nduration_s = -1",
        ":8: gust.duration_s: -1 is out of range: it must lie within 0.001 to 36000 (seconds)",
    ),
    (
        "[gust]\naxis = \"x\"",
        ":4: gust: the value is a table and must be a list of tables; write [[gust]], once for each",
    ),
    (
        "[[change]]\nparameter = \"weight\"\nfactor = 2\nstart_s = 1",
        ":5: change.parameter: \"weight\" is unknown; \
         it must be \"mass\", \"inertia\", \"thrust-factor\", \"drag-factor\", \
         \"roll-moment\", \"pitch-moment\" or \"yaw-moment\"",
    ),
    ("[[change]]\nparameter = \"mass\"\nstart_s = 1", ":4: change.factor: missing; add it"),
    (
        "[[change]]\nparameter = \"mass\"\nstart_s = 1\nfactor = 0.01",
        ":7: change.factor: the factor causes mass_kg = 0.00486, out of range: it must lie within 0.01 to 500; change \
         the factor",
    ),
    (
        "[[change]]\nparameter = \"mass\"\nstart_s = 1\nfactor = 100\n\
         [[change]]\nparameter = \"mass\"\nstart_s = 2\nfactor = 100",
        ":11: change.factor: the factor causes mass_kg = 4860, out of range: it must lie within 0.01 to 500; change \
         the factor",
    ),
    ("[trajectory]\nkind = \"paper\"", ":4: syntax: duplicate key near `trajectory`; COMPARE"),
    ("[weather]\nx = 1", ":4: weather: unknown key; known here: ALL"),
    ("[wind]\nx = 1", ":5: wind.x: unknown key; known here: steady_m_s, turbulence, gust"),
    ("[wind]\nsteady_m_s = [1, 0, 0]", ":4: wind: wind only acts through drag, and the vehicle has none; add [drag]"),
    (
        "[drag]\n[wind]\nturbulence = \"strong\"",
        ":6: wind.turbulence: \"strong\" is unknown; it must be \"light\", \"moderate\" or \"severe\"",
    ),
    ("[drag]\n[wind.turbulence]", ":5: wind.turbulence.wind_20ft_m_s: missing; add it (metres per second)"),
    ("[drag]\n[[wind.gust]]\nvelocity_m_s = [1, 0, 0]\nstart_s = 1", ":5: wind.gust.rise_s: missing; add it (seconds)"),
    (
        "[drag]\nblade_n_s2_m = 0.5",
        ":5: drag.blade_n_s2_m: blade_n_s2_m = 0.5, out of range: it must lie within 0 to 0.0012034782790026014; \
         change it",
    ),
    ("[drag]\narea_m2 = 1", ":5: drag.area_m2: the value is a number and must be three numbers; write [x, y, z]"),
    (
        "[rotors]\nmax_rad_s = 300\nforce_max_n = 3",
        ":6: rotors.force_max_n: the rotors have two limits; write force_max_n or max_rad_s, not both",
    ),
    (
        "[rotors]\nforce_max_n = 9999",
        ":5: rotors.force_max_n: the force causes max_rad_s = 18305.385, out of range: it must lie within 1 to 10000; \
         change the force",
    ),
    (
        "[rotors]\nmin_rad_s = 400\nmax_rad_s = 300",
        ":5: rotors.min_rad_s: min_rad_s = 400, out of range: it must lie within 0 to 300; change it",
    ),
    (
        "[rotors]\ntime_constant = 0.02",
        ":5: rotors.time_constant: unknown key; did you mean time_constant_s (seconds)?",
    ),
    (
        "[[rotor_fault]]\nrotor = 5\nefficiency = 1\nstart_s = 0",
        ":5: rotor_fault.rotor: 5 is out of range: it must lie within 1 to 4",
    ),
    (
        "[[rotor_fault]]\nrotor = 1.5\nefficiency = 1\nstart_s = 0",
        ":5: rotor_fault.rotor: there is no rotor 1.5; write a whole number, 1 to 4",
    ),
    (
        "[battery]\nfull_v = 9",
        ":4: battery.empty_v: empty_v = 9.9, out of range: it must lie within 0.1 to 9; change it",
    ),
    (
        "[ground]\nground_effect = 1",
        ":5: ground.ground_effect: the value is a number and must be true or false; write true or false without quotes",
    ),
    (
        "[[payload]]\nmass_kg = 499.9\nstart_s = 1",
        ":5: payload.mass_kg: the payload causes mass_kg = 500.386, out of range: it must lie within 0.01 to 500; \
         change the payload",
    ),
    ("[sensors]\nnoise = 2", ":5: sensors.noise: 2 is out of range: it must lie within 0 to 1"),
    ("[sensors.noise]\nposition = 1", ":5: sensors.noise.position: unknown key; did you mean position_m (metres)?"),
    ("[sensors]\ndropouts = { rate_hz = 1 }", ":5: sensors.dropouts.mean_s: missing; add it (seconds)"),
    (
        "[limits]\ntilt_max_rad = 2",
        ":5: limits.tilt_max_rad: 2 is out of range: it must lie within 0.05 to 1.57 (radians)",
    ),
    ("[gains.z]\nsigma = 11", ":5: gains.z.sigma: 11 is out of range: it must lie within 0 to 10 (1/s)"),
    ("[gains.z]\nepsilom = 1", ":5: gains.z.epsilom: unknown key; did you mean epsilon (m/s or rad/s)?"),
    (
        "[[contender]]\ncontroller = \"afbc\"",
        ":4: contender.name: missing; give the contender a name, such as \"gentle\"",
    ),
    (
        "[[contender]]\nname = \"a\\nb\"\ncontroller = \"pid\"",
        ":5: contender.name: this cannot be a name; write one plain line of 1 to 32 characters",
    ),
    (
        "[[contender]]\nname = \"a\"\ncontroller = \"pid\"\n[[contender]]\nname = \"a\"\ncontroller = \"pid\"",
        ":8: contender.name: \"a\" is the name of another contender; choose another",
    ),
    (
        "[[contender]]\nname = \"a\"\ncontroller = \"lqr\"",
        ":6: contender.controller: \"lqr\" is unknown; \
         it must be LAWS",
    ),
    (
        "[[contender]]\nname = \"a\"\ncontroller = \"afbc\"\nsettings = { dt_s = 0.002 }",
        ":7: contender.settings.dt_s: all contenders share one time step; set it in the file's own [settings]",
    ),
    (
        "[[contender]]\nname = \"a\"\ncontroller = \"backstepping\"\n[contender.gains.x]\ngamma = 1",
        ":8: contender.gains.x.gamma: unknown key; known here: alpha1, alpha2, stiffness",
    ),
    (
        "[[contender]]\nname = \"a\"\ncontroller = \"pid\"\n[contender.gains]\nposition_p = 1",
        ":8: contender.gains.position_p: unknown key; did you mean position_p_1_s (1/s)?",
    ),
    (
        "[[contender]]\nname = \"a\"\ncontroller = \"indi\"\nmonitor = true",
        ":7: contender.monitor: unknown key; known here: name, controller, profile, gains, settings, limits",
    ),
    ("\"a\\nb\" = 1", ":4: trajectory.a\\nb: unknown key; known here: kind, position_m, yaw_rad"),
    ("yaw_deg = 90", ":4: trajectory.yaw_deg: unknown key; did you mean yaw_rad (radians)?"),
    (
        "yaw_rad = true",
        ":4: trajectory.yaw_rad: the value is true or false and must be a number (radians); write digits without \
         quotes",
    ),
    ("yaw_rad = 1e999", ":4: trajectory.yaw_rad: inf is not a finite number: it must lie within -100 to 100 (radians)"),
    ("yaw_rad = 0xffff", ":4: trajectory.yaw_rad: 65535 is out of range: it must lie within -100 to 100 (radians)"),
    ("yaw_rad = 1\nyaw_rad = 2", ":5: syntax: duplicate key near `yaw_rad`; COMPARE"),
    ("yaw_rad = ", ":4: syntax: string values must be quoted, expected literal string; COMPARE"),
    ("[vehicle", ":4: syntax: unclosed table, expected `]`; COMPARE"),
    ("vehicle = 1", ":4: trajectory.vehicle: unknown key; known here: kind, position_m, yaw_rad"),
];

/// Whole files, and the error.
const BAD_FILES: [(&str, &str); 28] = [
    (
        "flight_core = true\n[trajectory]\nkind = \"paper\"\n[settings]\ndt_s = 0.002",
        ":1: flight_core: the vehicle cannot fly with dt_s = 0.002, out of range: it must lie within 0.001 to 0.001; \
         change that parameter, or leave flight_core out",
    ),
    (
        "flight_core = true\n[trajectory]\nkind = \"paper\"\n[initial]\nattitude_rad = [1, 0, 0]",
        ":1: flight_core: the vehicle cannot fly with attitude_rad = 1, out of range: it must lie within -0.8 to 0.8; \
         change that parameter, or leave flight_core out",
    ),
    ("", ":1: trajectory: missing; add [trajectory] with kind = \"hover\" and position_m = [0, 0, 1]"),
    ("[trajectry]\nkind = \"paper\"", ":1: trajectry: unknown key; did you mean trajectory?"),
    (
        "[[trajectory]]\n[[trajectory]]",
        ":1: trajectory: the value is a list and must be a table; write one table: [trajectory]",
    ),
    (
        "[trajectory]\nkind = \"spiral\"",
        ":2: trajectory.kind: \"spiral\" is unknown; \
         it must be \"paper\", \"hover\", \"step\", \"circle\", \"lemniscate\", \"lissajous\", \
         \"waypoints\", \"minimum-snap\" or \"file\"",
    ),
    ("[trajectory]\nkind = \"paper\"\nradius_m = 1", ":3: trajectory.radius_m: unknown key; known here: kind"),
    (
        "[trajectory]\nkind = \"circle\"\ncentre_m = [0, 0, 1]\nradius = 1\nperiod_s = 5",
        ":4: trajectory.radius: unknown key; did you mean radius_m (metres)?",
    ),
    (
        "[trajectory]\nkind = \"circle\"\ncentre_m = [0, 0, 1]\nperiod_s = 9",
        ":1: trajectory.radius_m: missing; add it (metres)",
    ),
    (
        "[trajectory]\nkind = \"circle\"\ncentre_m = [0, 0, 1]\nradius_m = 100\nperiod_s = 0.5",
        ":5: trajectory.period_s: it asks for 1.257e3 m/s, 1.579e4 m/s2, 1.984e5 m/s3 and 2.494e6 m/s4, more than a \
         controller accepts (1e3 m/s, 1e3 m/s2, 1e5 m/s3, 1e7 m/s4); allow more time",
    ),
    (
        "[trajectory]\nkind = \"waypoints\"",
        ":1: trajectory.waypoint: missing; add [[trajectory.waypoint]] with time_s and position_m",
    ),
    (
        "[trajectory]\nkind = \"waypoints\"\n\
         [[trajectory.waypoint]]\ntime_s = 3\nposition_m = [0, 0, 1]\n\
         [[trajectory.waypoint]]\ntime_s = 2\nposition_m = [0, 0, 2]",
        ":7: trajectory.waypoint.time_s: 2 is not later than the 3 of the waypoint before; make the times increase",
    ),
    ("duration_s = -3", ":1: duration_s: -3 is out of range: it must lie within 0.1 to 36000 (seconds)"),
    ("duration = 3", ":1: trajectory: missing; add [trajectory] with kind = \"hover\" and position_m = [0, 0, 1]"),
    ("duration = 3\n[trajectory]\nkind = \"paper\"", ":1: duration: unknown key; did you mean duration_s (seconds)?"),
    (
        "duration_s = 1979-05-27",
        ":1: duration_s: the value is a date or time and must be a number (seconds); write digits without quotes",
    ),
    ("name = \"../up\"", ":1: name: \"../up\" cannot be a name; NAME"),
    ("name = \"\"", ":1: name: \"\" cannot be a name; NAME"),
    (
        "description = \"a\\nb\"",
        ":1: description: the text has line breaks or control characters; make it one plain line",
    ),
    ("plant = \"real\"", ":1: plant: \"real\" is unknown; it must be \"simplified\" or \"rigid-body\""),
    ("controllers = []", ":1: controllers: the list is empty; add LAWS"),
    ("seed = 1.5", ":1: seed: 1.5 is not a whole number; leave out its decimals"),
    ("seed = 1000000001", ":1: seed: 1000000001 is out of range: it must lie within 0 to 1e9"),
    ("seed = 1000000000.5", ":1: seed: 1000000000.5 is not a whole number; leave out its decimals"),
    ("seed = -1", ":1: seed: -1 is out of range: it must lie within 0 to 1e9"),
    ("monitor = 1", ":1: monitor: the value is a number and must be true or false; write true or false without quotes"),
    ("controllers = [\"afbc\", \"afbc\"]", ":1: controllers: \"afbc\" is listed twice; once is enough"),
    ("profile = \"best\"", ":1: profile: \"best\" is unknown; it must be \"paper\" or \"flight\""),
];

/// Replaces placeholders by the text that several messages share.
fn expand(message: &str) -> String {
    let [laws @ .., last] = ControllerKind::ALL.map(|kind| format!("\"{}\"", kind.name()));
    message
        .replace("LAWS", &format!("{} or {last}", laws.join(", ")))
        .replace("COMPARE", "`sitl scenarios hover` prints a file to compare with")
        .replace("NAME", "a name must be 1 to 64 letters, digits, '-' or '_', since file names are made from it")
        .replace(
            "ALL",
            "name, description, duration_s, seed, plant, vehicle, truth, controllers, profile, gains, settings, \
             limits, monitor, contender, trajectory, initial, gust, change, payload, rotors, rotor_fault, battery, \
             drag, wind, ground, sensors, sensor_fault, instruments, told, instrument_fault, outage, flight_core",
        )
}

#[test]
fn bad_files_get_a_line_for_each_mistake_and_nothing_is_written() {
    let folder = folder("bad");
    let tables = BAD_TABLES.map(|(text, message)| (format!("{HOVER}{text}\n"), message));
    let files_ = BAD_FILES.map(|(text, message)| (format!("{text}\n"), message));
    let mut wrong = Vec::new();
    for (text, message) in tables.into_iter().chain(files_) {
        fs::write(folder.join("my.toml"), &text).unwrap();
        for verb in ["check", "fly"] {
            let output = sitl(&folder, &[verb, "my.toml"]);
            let (said, expected) = (stderr(&output), format!("my.toml{}", expand(message)));
            if !said.lines().any(|line| line == expected) {
                wrong.push(format!("{text}is not told {expected} but {said}"));
            }
            // In some files, the mistake makes the trajectory missing too, which is a second error.
            let others = said.lines().filter(|line| *line != expected);
            let mut others = others.filter(|line| !line.contains("trajectory: missing"));
            let known = "my.toml:1: duration: unknown key; did you mean duration_s (seconds)?";
            if let Some(other) = others.find(|line| *line != known) {
                wrong.push(format!("{text}is told {other}, too"));
            }
            assert_eq!(code(&output), 2, "{text}");
            assert_eq!(stdout(&output), "");
        }
        assert_eq!(files(&folder).len(), 1, "{text}");
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn files_that_cannot_be_read_get_one_line() {
    let folder = folder("unreadable");
    fs::create_dir(folder.join("dir.toml")).unwrap();
    fs::write(folder.join("latin.toml"), b"name = \"caf\xe9\"").unwrap();
    fs::write(folder.join("large.toml"), vec![b'#'; (1 << 20) + 1]).unwrap();
    fs::write(folder.join("my flight.toml"), HOVER).unwrap();
    let lists = "`sitl scenarios` lists the built-in ones";
    for (name, message) in [
        ("none.toml", format!("none.toml: no such file; {lists}")),
        ("dir.toml", "dir.toml: this is a folder; name a scenario file in it".into()),
        ("latin.toml", "latin.toml: the file is not UTF-8 text; save it as UTF-8".into()),
        ("large.toml", "large.toml: the file is larger than 1 MiB, too large for a scenario; name another file".into()),
        ("my flight.toml", expand("my flight.toml:1: name: \"my flight\" cannot be a name; NAME")),
        ("hovr", "hovr: no such scenario; did you mean hover?".into()),
        (
            "xyz",
            "xyz: no such scenario; `sitl scenarios` lists what is built in; for a file, write its path, as in \
             ./my.toml"
                .into(),
        ),
    ] {
        let output = sitl(&folder, &["fly", name]);
        assert_eq!((stderr(&output), code(&output)), (format!("{message}\n"), 2));
        assert!(!folder.join("out").exists());
    }
}

#[test]
fn bad_options_are_refused_before_anything_is_written() {
    let folder = folder("options");
    for arguments in [
        &["--reading", "storm"] as &[&str],
        &["--inertia", "0"],
        &["--no-uncertainty", "--thrust", "+"],
        &["paper", "--log-hz", "300"],
        &["paper", "--duration", "0"],
        &["paper", "--duration", "nan"],
        &["fly", "hover", "--duration", "-5"],
        &["fly", "hover", "--seed", "-5"],
        &["fly", "hover", "--speed", "5"],
        &["campaign", "robustness", "--flights", "0"],
        &["campaign", "robustness", "--flights", "20000"],
        &["fly"],
        &["fly", "hover", "--controller", "lqr"],
        &["fly", "hover", "--duration", "36000", "--log-hz", "1000"],
        &["scenarios", "hovr"],
    ] {
        let output = sitl(&folder, arguments);
        assert_eq!(code(&output), 2, "{arguments:?}");
        assert!(!stderr(&output).is_empty() && output.stdout.is_empty(), "{arguments:?}");
        assert!(!stderr(&output).contains("-- -"), "an option is advised as a file: {}", stderr(&output));
        assert!(files(&folder).is_empty(), "{arguments:?}");
    }
}

#[test]
fn an_out_folder_that_cannot_be_gets_one_line() {
    let folder = folder("blocked");
    fs::write(folder.join("taken"), "").unwrap();
    let output = sitl(&folder, &["fly", "hover", "--duration", "1", "--out", "taken"]);
    assert_eq!(code(&output), 2);
    assert!(stderr(&output).contains("taken") && stderr(&output).lines().count() == 1, "{}", stderr(&output));
    assert_eq!(files(&folder).len(), 1);
}

#[test]
fn without_a_command_it_flies_the_paper() {
    let folder = folder("paper");
    let output = sitl(&folder, &["--duration", "6", "--log-hz", "10"]);
    assert_eq!((code(&output), stderr(&output)), (0, String::new()));
    for name in ["paper-afbc.csv", "paper-backstepping.csv", "summary.json", "report.html"] {
        assert!(folder.join("out/paper").join(name).is_file(), "{name}");
    }
    let named = sitl(&folder, &["paper", "--duration", "6", "--log-hz", "10"]);
    assert_eq!(stdout(&output), stdout(&named));
}

#[test]
fn options_choose_among_the_papers_readings() {
    let folder = folder("readings");
    let logs = |arguments: &[&str]| {
        let out = folder.join("out");
        let _ = fs::remove_dir_all(&out);
        let common = ["paper", "--duration", "1", "--log-hz", "1", "--out", "out"];
        let output = sitl(&folder, &[&common, arguments].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        files(&out).keys().filter(|path| path.extension().is_some_and(|extension| extension == "csv")).count()
    };
    assert_eq!(logs(&[]), 2);
    assert_eq!(logs(&["--no-uncertainty", "--reading", "none"]), 2);
    assert_eq!(logs(&["--inertia", "-", "--thrust", "+"]), 2);
    assert_eq!(logs(&["--inertia", "both", "--thrust", "both"]), 8);
    assert_eq!(logs(&["--reading", "all", "--inertia", "both", "--thrust", "both", "--plant", "both"]), 48);
}

#[test]
fn a_lost_vehicle_ends_its_run_and_keeps_its_log() {
    let folder = folder("lost");
    let gust = "duration_s = 10\n[[gust]]\naxis = \"roll\"\nmoment_n_m = 1.2\nstart_s = 2\n";
    fs::write(folder.join("storm.toml"), format!("{gust}{HOVER}")).unwrap();
    let output = sitl(&folder, &["fly", "storm.toml"]);
    assert_eq!((code(&output), stderr(&output)), (1, String::new()));
    assert!(stdout(&output).contains("lost at t = "), "{}", stdout(&output));
    let log = fs::read_to_string(folder.join("out/storm/storm-afbc.csv")).unwrap();
    assert!((200..900).contains(&log.lines().count()));

    // The loss in the paper's reading `forces` is known and not an error.
    let output = sitl(&folder, &["--reading", "forces", "--log-hz", "10"]);
    assert_eq!((code(&output), stderr(&output)), (0, String::new()));
    assert!(stdout(&output).contains("lost at t = "));
}

#[test]
fn every_built_in_scenario_is_listed_checked_and_a_template() {
    let folder = folder("built_in");
    let list = stdout(&sitl(&folder, &["scenarios"]));
    let names: Vec<_> = list.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert_eq!(
        names,
        [
            "paper",
            "hover",
            "step",
            "circle",
            "lissajous",
            "waypoints",
            "wind",
            "delivery",
            "hardware",
            "storm",
            "mocap",
            "outdoor"
        ]
    );
    for name in names {
        let file = sitl(&folder, &["scenarios", name]);
        fs::write(folder.join("copy.toml"), &file.stdout).unwrap();
        let (built_in, copy) = (sitl(&folder, &["check", name]), sitl(&folder, &["check", "./copy.toml"]));
        assert_eq!((code(&built_in), code(&copy)), (0, 0), "{}", stderr(&copy));
        assert!(stdout(&built_in).starts_with(&format!("{name}: ok, ")));
        assert_eq!(stdout(&built_in), stdout(&copy));
        assert_eq!(code(&sitl(&folder, &["fly", name, "--log-hz", "1", "--controller", "afbc"])), 0);
        assert!(folder.join("out").join(name).join(format!("{name}-afbc.csv")).is_file());
        assert!(!folder.join("out").join(name).join(format!("{name}-backstepping.csv")).exists());
    }
}

#[test]
fn two_runs_write_the_same_bytes() {
    let folder = folder("determinism");
    for out in ["a", "b"] {
        assert_eq!(code(&sitl(&folder, &["fly", "delivery", "--out", out])), 0);
    }
    let (a, b) = (files(&folder.join("a")), files(&folder.join("b")));
    assert!(a.len() > 2);
    assert!(a.values().eq(b.values()));

    // The paper's flight is the same from the scenario file and from the code.
    assert_eq!(code(&sitl(&folder, &["fly", "paper", "--out", "file"])), 0);
    assert_eq!(code(&sitl(&folder, &["paper", "--out", "code"])), 0);
    let log = |out: &str| fs::read(folder.join(out).join("paper-afbc.csv")).unwrap();
    assert!(log("file") == log("code"));
}

#[test]
fn a_closed_pipe_is_no_failure() {
    let folder = folder("pipe");
    for arguments in [&["scenarios", "paper"] as &[&str], &["fly", "hover", "--duration", "1"]] {
        let mut child = command(&folder, arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert_eq!((code(&output), stderr(&output)), (0, String::new()));
    }
}

#[test]
fn help_and_version_go_to_stdout() {
    let folder = folder("help");
    for arguments in [&["--help"] as &[&str], &["-h"], &["--version"], &["fly", "--help"], &["help", "paper"]] {
        let output = sitl(&folder, arguments);
        assert_eq!(code(&output), 0);
        assert!(stdout(&output).lines().count() > 0 && output.stderr.is_empty());
    }
}

/// Returns the number of rows of a flight's log.
fn rows(log: &Path) -> usize {
    fs::read_to_string(log).unwrap().lines().count() - 1
}

#[test]
fn the_default_log_rate_is_reduced_for_a_long_flight() {
    let folder = folder("long");
    let log = folder.join("out/hover/hover-backstepping.csv");
    let fly = |arguments: &[&str]| {
        let output = sitl(&folder, &[&["fly", "hover", "--controller", "backstepping", "--force"], arguments].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        (rows(&log), stderr(&output))
    };
    assert_eq!(fly(&["--duration", "600"]), (60_001, String::new()));
    let (rows, said) = fly(&["--duration", "1500"]);
    assert_eq!(rows, 1500 * 40 + 1);
    assert!(said.starts_with("logs of 1500 s keep 40 rows per second; --log-hz 100 keeps more\n"), "{said}");
    assert_eq!(fly(&["--duration", "601", "--log-hz", "100"]), (60_101, String::new()));
    assert_eq!(fly(&["--duration", "601", "--log-hz", "200"]), (120_201, String::new()));
}

/// Progress through a pipe appears every few seconds, long before a tenth of the work is done.
#[test]
fn progress_through_a_pipe_is_not_silent() {
    let folder = folder("progress");
    // This command takes hours.
    let mut flying = command(&folder, &["compare", "storm", "--seeds", "10000"]);
    let mut child = flying.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut said = BufReader::new(child.stderr.take().unwrap());
    let begun = Instant::now();
    let mut line = || {
        let mut line = String::new();
        assert_ne!(said.read_line(&mut line).unwrap(), 0, "it has ended");
        (line, begun.elapsed())
    };
    let (first, _) = line();
    assert!(first.contains(": 0 of ") && first.ends_with(" flights\n"), "{first}");
    // The lines come after 5 s and 10 s later; slower machines are late.
    for (from_s, to_s) in [(4, 12), (13, 30)] {
        let (line, after) = line();
        let done: u64 = line.split(' ').nth(1).unwrap().parse().unwrap();
        assert!(line.contains(" flights") && done < 10_000, "{line}");
        assert!((from_s..to_s).contains(&after.as_secs()), "{after:?}: {line}");
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

/// Output fits a terminal of 80 columns: tables fit, and text is wrapped between words.
#[test]
fn text_fits_a_terminal_of_80_columns() {
    let folder = folder("width");
    let campaign = "flights = 3\nduration_s = 6\nscenario = \"hover\"\n[spread]\nmass_ratio = [0.8, 1.2]\n";
    fs::write(folder.join("few.toml"), campaign).unwrap();
    for arguments in [
        &["paper", "--duration", "6"][..],
        &["fly", "wind", "--duration", "6"],
        &["campaign", "few.toml"],
        &["fly", "--help"],
    ] {
        let wide = |columns: &str| {
            let output =
                command(&folder, &[arguments, &["--force"]].concat()).env("COLUMNS", columns).output().unwrap();
            assert_eq!(code(&output), 0, "{}", stderr(&output));
            let shown = stdout(&output);
            // Commands to copy are not wrapped.
            shown.lines().filter(|line| !line.contains("sitl ")).map(|line| line.chars().count()).max().unwrap()
        };
        assert!(wide("80") <= 80, "{arguments:?}: {}", wide("80"));
    }
}
