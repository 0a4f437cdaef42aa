//! Tests `sitl params`.

#![expect(clippy::unwrap_used, reason = "tests")]

use crate::common::{folder, refused, sitl, succeeds};
use std::fs;

/// All values of every vehicle survive both formats and a store, to the bit.
#[test]
fn what_is_exported_is_imported() {
    for vehicle in ["paper", "crazyflie", "f550"] {
        let folder = folder(vehicle);
        let export =
            |of: &[&str]| succeeds(&sitl(&folder, &[&["params", "export", "--vehicle", vehicle], of].concat()));
        let all = export(&[]);
        assert!(all.lines().filter(|line| line.starts_with("1\t1\t")).count() > 100);
        export(&["--out", "all.params"]);
        export(&["--out", "all.parm"]);
        assert_eq!(fs::read_to_string(folder.join("all.params")).unwrap(), all);
        // Changes the mass as a user would.
        let mass = |text: &str, mass: &str| -> String {
            let line = |line: &str| match line.contains("V_MASS") {
                true if line.starts_with('1') => format!("1\t1\tV_MASS\t{mass}\t9\r\n"),
                true => format!("V_MASS {mass} # by hand\n"),
                false => format!("{line}\n"),
            };
            text.lines().map(line).collect()
        };
        let heavier = match vehicle {
            "crazyflie" => "0.0285",
            "f550" => "2.35",
            _ => "0.49",
        };
        for (file, store) in [("all.params", "a.store"), ("all.parm", "b.store")] {
            let text = fs::read_to_string(folder.join(file)).unwrap();
            fs::write(folder.join(file), mass(&text, heavier)).unwrap();
            let import = ["params", "import", file, "--vehicle", vehicle, "--store", store];
            assert!(succeeds(&sitl(&folder, &import)).contains(" parameters, 1"));
            let diff = succeeds(&sitl(&folder, &["params", "diff", "--vehicle", vehicle, "--store", store]));
            assert!(diff.starts_with("V_MASS ") && diff.ends_with(&format!("-> {heavier}\n")), "{diff}");
            assert_eq!(diff.lines().count(), 1);
            assert_eq!(succeeds(&sitl(&folder, &["params", "diff", file, "--vehicle", vehicle])), diff);
            let expected = mass(&all, heavier).replace('\r', "");
            assert_eq!(export(&["--store", store]), expected);
        }
        assert_eq!(fs::read(folder.join("a.store")).unwrap().len(), 32 * 1024);
        // Importing the defaults deletes the stored values.
        fs::write(folder.join("all.params"), &all).unwrap();
        succeeds(&sitl(&folder, &["params", "import", "all.params", "--vehicle", vehicle, "--store", "a.store"]));
        assert_eq!(succeeds(&sitl(&folder, &["params", "diff", "--vehicle", vehicle, "--store", "a.store"])), "");
    }
}

#[test]
fn a_bad_line_gets_one_line_and_changes_nothing() {
    let folder = folder("refused");
    for (text, expected) in [
        ("V_MASS 0.5\nV_MAS 0.5\n", "mine.params:2: V_MAS: no such parameter; `sitl params export` lists them"),
        ("# mine\n\n1\t1\tV_MASS\t900\t9\n", "mine.params:3: V_MASS: must be 0.01 to 500"),
        ("V_MASS nan\n", "mine.params:1: V_MASS: \"nan\" is no number"),
        ("V_MASS half\n", "mine.params:1: V_MASS: \"half\" is no number"),
        ("V_MASS\n", "mine.params:1: 1 fields, neither"),
        ("1 1 V_MASS 0.5\n", "mine.params:1: 4 fields, neither"),
        ("V_MASS 0.5\nV_MASS 0.6\n", "mine.params:2: V_MASS: the parameter has two values"),
        ("C_BUMPLESS 0.5\n", "mine.params:1: C_BUMPLESS: must be a whole number"),
        ("V_MASS 3\n", "mine.params: rotor_force_max_n"),
        ("V_MASS_IN_KILOGRAMS 3\n", "mine.params:1: V_MASS_IN_KILOGRAMS: no such parameter"),
    ] {
        fs::write(folder.join("mine.params"), text).unwrap();
        let error = refused(&sitl(&folder, &["params", "import", "mine.params", "--store", "vehicle.store"]));
        assert!(error.starts_with(expected) && error.lines().count() == 1, "{error}, not {expected}");
        assert!(!folder.join("vehicle.store").exists());
    }
    fs::write(folder.join("short.store"), "no store").unwrap();
    for (arguments, expected) in [
        (&["params", "export", "--store", "none.store"][..], "none.store: No such file"),
        (
            &["params", "export", "--store", "short.store"],
            "short.store: the file is no parameter store: it has 8 bytes instead of 32768",
        ),
        (&["params", "import", "none.params", "--store", "a.store"], "none.params: cannot be read"),
        (&["params", "import", "none.params"], "--store is missing"),
        (&["params", "export", "--vehicle", "racr"], "vehicle: \"racr\" is no built-in vehicle"),
    ] {
        let error = refused(&sitl(&folder, arguments));
        assert!(error.starts_with(expected) && error.lines().count() == 1, "{error}, not {expected}");
    }
}

/// A store of another vehicle is reported, and its values are not used. Random data count as unreadable.
#[test]
fn a_store_that_does_not_fit_is_reported() {
    let folder = folder("other");
    fs::write(folder.join("mine.parm"), "MOT_IDLE 0.07\n").unwrap();
    succeeds(&sitl(&folder, &["params", "import", "mine.parm", "--store", "a.store"]));
    let diff = |vehicle: &str, store: &str| {
        let output = sitl(&folder, &["params", "diff", "--vehicle", vehicle, "--store", store]);
        (succeeds(&output), String::from_utf8(output.stderr).unwrap())
    };
    assert_eq!(diff("paper", "a.store"), ("MOT_IDLE         0.05 -> 0.07\n".into(), String::new()));
    let reported = "a.store: parameters: stored for another vehicle, ignored\n";
    assert_eq!(diff("iris", "a.store"), (String::new(), reported.into()));
    fs::write(folder.join("b.store"), vec![0x5A; 32 * 1024]).unwrap();
    let reported = "b.store: parameters: store unreadable, using defaults\n";
    assert_eq!(diff("paper", "b.store"), (String::new(), reported.into()));
}
