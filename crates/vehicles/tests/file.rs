//! Vehicle files: the built-in ones are valid, and mistakes in others are reported in one line each.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, missing_docs)]

use afbc::Profile;
use afbc_estimator::Settings as Estimation;
use afbc_types::{Declared, DeclaredValue};
use afbc_vehicles::{BUILT_IN, Vehicle, built_in, parse};

/// Returns a built-in file's text without the tuned gains at its end.
fn text(name: &str) -> &'static str {
    built_in(name).unwrap().text.split("# Gains found by").next().unwrap()
}

fn changed(name: &str, from: &str, to: &str) -> String {
    let text = text(name);
    assert!(text.contains(from), "no {from} in {name}");
    text.replacen(from, to, 1)
}

fn refused(text: &str) -> String {
    let error = parse("my.toml", text, "my").unwrap_err().to_string();
    assert!(error.lines().all(|line| line.starts_with("my.toml")), "{error}");
    error
}

#[test]
fn every_built_in_vehicle_is_valid_and_named_after_its_file() {
    for known in &BUILT_IN {
        let vehicle = known.read().unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(vehicle.name, known.name);
        assert!(!vehicle.description.is_empty());
        assert_eq!(vehicle.estimation, Estimation::DEFAULT);
        let arm = vehicle.rotors.iter().map(|rotor| rotor.x.hypot(rotor.y)).sum::<f64>() / vehicle.rotors.len() as f64;
        assert!((arm - 1.0).abs() < 0.01, "{}: {arm}", known.name);
    }
}

/// The paper's vehicle in the profile `flight` has exactly the gains that the firmware had before there were vehicle
/// files.
#[test]
fn the_papers_vehicle_has_the_profiles_gains() {
    let paper = built_in("paper").unwrap().read().unwrap();
    assert_eq!(paper.gains(Profile::Flight), Profile::Flight.gains());
    let settings = Profile::Flight.settings().with_drag(afbc_control::drag::KnownDrag::PAPER);
    assert_eq!(paper.settings(Profile::Flight), settings);
    assert_eq!(paper.gains(Profile::Paper), Profile::Paper.gains());
    assert_eq!(paper.settings(Profile::Paper), Profile::Paper.settings());
    assert_eq!(paper.curve, afbc_flight_core::motor::Curve::DEFAULT);
    assert_eq!(paper.rotors, afbc_types::PLUS.map(|rotor| rotor.to_f64()).to_vec());
}

/// The drag given to the laws matches the plant's drag on the vehicle in hover.
#[test]
fn drag_of_the_file_is_known_per_mass() {
    for known in &BUILT_IN {
        let vehicle = known.read().unwrap();
        let (stated, drag) = (vehicle.settings(Profile::Flight).common.drag, vehicle.realism.drag.unwrap());
        let p = &vehicle.parameters;
        // Blade drag is proportional to the sum of the rotor speeds; in hover, each rotor carries an equal share of the
        // weight.
        let count = vehicle.rotors.len() as f64;
        let each_rad_s = (p.mass_kg * p.gravity_m_s2 / count / p.thrust_factor_n_s2).sqrt();
        let blades = drag.blade_n_s2_m * each_rad_s * count / p.mass_kg;
        let body = 0.5 * drag.air_density_kg_m3 * 0.5 * (drag.area_m2.x + drag.area_m2.y) / p.mass_kg;
        let near = |stated: f32, is: f64| (f64::from(stated) - is).abs() < 1e-5 * (1.0 + is);
        assert!(near(stated.rotor_drag_1_s, blades), "{}: {stated:?}, {blades}", known.name);
        assert!(near(stated.body_drag_1_m, body), "{}: {stated:?}, {body}", known.name);
        assert!(near(stated.rotor_height_m, drag.rotor_height_m), "{}: {stated:?}", known.name);
    }
}

#[test]
fn what_cannot_hover_with_a_margin_is_refused_by_name() {
    let weak = refused(&changed("iris", "force_max_n = 7.066", "force_max_n = 4.5"));
    assert!(weak.contains("rotor_force_max_n") && weak.contains("without a margin"), "{weak}");
    let heavy = refused(&changed("racer", "mass_kg = 0.752", "mass_kg = 5.0"));
    assert!(heavy.contains("rotor_force_max_n") && heavy.contains("at least") | heavy.contains("within"), "{heavy}");
    let sluggish =
        refused(&changed("iris", "inertia_kg_m2 = [0.0089, 0.0164, 0.0193]", "inertia_kg_m2 = [0.0089, 0.029, 0.03]"));
    assert!(sluggish.contains("hover_authority_rad_s2"), "{sluggish}");
    // All rotors turn the same way, so yaw cannot be controlled apart from thrust.
    let spinless = refused(&text("paper").replace("\"ccw\"", "\"cw\""));
    assert!(spinless.contains("rotor_authority"), "{spinless}");
}

#[test]
fn one_line_names_file_place_and_cure() {
    for (text, expected) in [
        (changed("racer", "mass_kg", "mass_g"), "my.toml:15: vehicle.mass_g: unknown key; did you mean mass_kg"),
        (changed("racer", "arm_m = 0.125", "arm_m = 0.2"), "arm_m is 0.2, but the rotors are 0.1250 m"),
        (changed("racer", "spin = \"ccw\"", "spin = \"left\""), "rotor.spin"),
        (changed("racer", "time_constant_s", "#"), "rotors.time_constant_s: missing"),
        (changed("racer", "force_max_n = 8.5", "#"), "rotors.force_max_n: missing"),
        (changed("racer", "idle = 0.055", "#"), "motor.idle: missing"),
        (changed("racer", "thrust_factor_n_s2 = 1.562522e-6", "#"), "vehicle.thrust_factor_n_s2: missing"),
        (changed("racer", "[vehicle]", "[vehicl]"), "did you mean vehicle"),
        (
            changed("racer", "inertia_kg_m2 = [0.0025, 0.0021, 0.0043]", "inertia_kg_m2 = [0.0025, nan, 0.0043]"),
            "inertia_kg_m2",
        ),
        (text("racer").to_owned() + "[[rotor]]\nposition_m = [0.0, 0.0, 0.0]\nspin = \"cw\"\n", "arm_m is 0.125, but"),
        (text("f550").replace("[[rotor]]", "[[rotr]]"), "rotor"),
        (text("racer").to_owned() + "[gains.flight.afbc.roll]\nalpha_1 = 3.0\n", "did you mean alpha1"),
        (text("racer").to_owned() + "[gains.flights.afbc.roll]\nalpha1 = 3.0\n", "did you mean flight"),
        (text("racer").to_owned() + "[drag2]\n", "drag2: unknown key"),
        ("x".into(), "syntax"),
    ] {
        let error = refused(&text);
        assert!(error.contains(expected), "{error}, not {expected}");
    }
}

#[test]
fn gains_of_the_file_replace_those_of_the_rule() {
    let gains = "[gains.flight.afbc.z]\nalpha1 = 1.25\n[gains.flight.cascade]\ncommand_filter_rad_s = 33.0\n";
    let own: Vehicle = parse("my.toml", &(text("racer").to_owned() + gains), "my").unwrap();
    let rule: Vehicle = parse("racer", text("racer"), "racer").unwrap();
    let mut expected = rule.gains(Profile::Flight);
    expected.z.backstepping.alpha1 = 1.25;
    assert_eq!(own.gains(Profile::Flight), expected);
    assert_eq!(own.settings(Profile::Flight).command_filter_rad_s, 33.0);
    assert_eq!(own.gains(Profile::Paper), rule.gains(Profile::Paper));
}

/// After any damage to a line, the file is still a vehicle that can fly, or every error line names the file.
#[test]
fn damaged_files_are_told_line_by_line() {
    let values = ["", "nan", "-1e300", "1e300", "\"\\n\"", "[]", "{}", "true", "[0, 0]", "1e-12", "{ a.b = [[1]] }"];
    let (mut refusals, mut accepted) = (0, 0);
    for known in &BUILT_IN {
        let lines: Vec<_> = known.text.lines().collect();
        for (at, line) in lines.iter().enumerate().filter(|(_, line)| !line.is_empty() && !line.starts_with('#')) {
            let key = line.split_once(" = ").map(|(key, _)| key);
            let mut damaged: Vec<_> = key.map_or(Vec::new(), |key| values.map(|v| format!("{key} = {v}")).to_vec());
            damaged.extend([String::new(), format!("{line}\n{line}"), format!("x{line}")]);
            for damaged in damaged {
                let text = [&lines[..at], &[damaged.as_str()], &lines[at + 1..]].concat().join("\n");
                match parse("damaged", &text, "damaged") {
                    Ok(vehicle) => {
                        vehicle.check().unwrap();
                        accepted += 1;
                    }
                    Err(error) => {
                        let error = error.to_string();
                        assert!(error.lines().all(|line| line.starts_with("damaged:")), "{error}");
                        refusals += 1;
                    }
                }
            }
        }
    }
    assert!(refusals > 2500 && accepted > 100, "{refusals} refused, {accepted} accepted");
}

/// Returns every setting of an estimator with its key.
fn settings(estimation: &Estimation) -> Vec<(&'static str, f32)> {
    let mut settings = Vec::new();
    let Ok(()) = estimation.visit(&mut |declaration, value| {
        let DeclaredValue::Single([number]) = value else { panic!("{} is not a number", declaration.range.name) };
        settings.push((declaration.range.name, *number));
        Ok::<(), core::convert::Infallible>(())
    });
    settings
}

/// Arming limits and guidance settings come from the file, with words for choices, and are checked together.
#[test]
fn arming_and_guidance_are_the_files() {
    let with = |tables: &str| format!("{}\n{tables}\n", text("iris"));
    let plain = parse("my.toml", text("iris"), "my").unwrap();
    let guidance = afbc_guidance::Settings::DEFAULT;
    assert_eq!((plain.arming, plain.guidance), (afbc_flight_core::ArmingLimits::DEFAULT, guidance));
    let tables = "[arming]\ntilt_max_rad = 0.1\n[guidance]\nland_m_s = 0.4\nfence_action = \"land\"\ncells = 3\n";
    let vehicle = parse("my.toml", &with(tables), "my").unwrap();
    let configuration = vehicle.configuration().unwrap();
    assert_eq!(configuration.arming, afbc_flight_core::ArmingLimits { tilt_max_rad: 0.1, ..plain.arming });
    let flying = afbc_guidance::FlightModeSettings { land_m_s: 0.4, ..guidance.flying };
    let fence_action = afbc_guidance::FenceAction::Land;
    let failsafe = afbc_guidance::FailsafeSettings { fence_action, cells: 3, ..guidance.failsafe };
    assert_eq!(configuration.guidance, afbc_guidance::Settings { flying, failsafe, ..guidance });
    for (tables, key, why) in [
        ("[guidance]\nfence_action = \"circle\"", "guidance.fence_action", "it must be \"nothing\", \"warn\""),
        ("[guidance]\nfence_action = 2", "guidance.fence_action", "a string"),
        ("[guidance]\ncells = 2.5", "guidance.cells", "not a whole number"),
        ("[guidance]\nlow = 0.0625", "guidance.critical", "within 0 to 0.0625"),
        ("[arming]\ntilt_max_rad = 1.0", "arming.tilt_max_rad", "within 0.01 to 0.8"),
        ("[arming]\ntilt_rad = 0.2", "arming.tilt_rad", "did you mean tilt_max_rad"),
    ] {
        let error = refused(&with(tables));
        assert!(error.contains(key) && error.contains(why), "{error}");
    }
}

/// The image assigns every declared value of the configuration, and has every rotor.
#[test]
fn an_image_holds_each_value_of_the_configuration() {
    fn count(group: &impl Declared) -> usize {
        let mut count = 0;
        let Ok(()) = group.visit(&mut |_, _| {
            count += 1;
            Ok::<(), core::convert::Infallible>(())
        });
        count
    }
    for known in &BUILT_IN {
        let vehicle = known.read().unwrap();
        let it = vehicle.configuration().unwrap();
        let parts = count(&it.curve) + count(&it.response) + count(&it.imu) + count(&it.estimation);
        let modes = count(&it.arming) + count(&it.guidance);
        let declared = count(&it.parameters) + parts + modes + count(&it.settings) + count(&it.gains);
        let image = vehicle.image();
        assert_eq!(image.matches("\n    it.").count(), declared, "{image}");
        assert_eq!(image.matches("Rotor { x: ").count(), vehicle.rotors.len(), "{image}");
        assert!(!image.contains("null"), "{image}");
    }
}

/// Each estimator setting can be stated alone, up to the ends of its range; beyond them it is refused. Gravity must
/// come from `[vehicle]`.
#[test]
fn the_estimators_settings_are_the_files() {
    let without = parse("my.toml", text("iris"), "my").unwrap().estimation;
    assert_eq!(without, Estimation::DEFAULT);
    let gravity = Estimation::GRAVITY.range.name;
    let mut ranges = Vec::new();
    let Ok(()) = without.visit(&mut |declaration, _| {
        ranges.push(declaration.range);
        Ok::<(), core::convert::Infallible>(())
    });
    for range in ranges {
        let written = |value: f64| format!("{}\n[estimator]\n{} = {value:?}\n", text("iris"), range.name);
        if range.name == gravity {
            let error = refused(&written(9.8));
            assert!(error.contains("estimator.gravity_m_s2") && error.contains("[vehicle]"), "{error}");
            continue;
        }
        for value in [range.min, range.max, 0.3 * range.min + 0.7 * range.max] {
            let read = parse("my.toml", &written(value), "my").unwrap().estimation;
            for ((key, read), (_, usual)) in settings(&read).into_iter().zip(settings(&without)) {
                assert_eq!(read, if key == range.name { value as f32 } else { usual }, "{key} with {}", range.name);
            }
            afbc_estimator::Estimator::new(read).unwrap();
        }
        for value in [range.min - 0.1 * (range.max - range.min), 1.1 * range.max - 0.1 * range.min] {
            let error = refused(&written(value));
            assert!(error.contains(&format!("estimator.{}", range.name)), "{error}");
        }
    }
    for (line, stated) in [
        ("gyro_noise = 1e-3", "did you mean gyro_noise_rad_s_rthz"),
        ("coast_s = \"5\"", "estimator.coast_s"),
        ("gate_sigmas = nan", "estimator.gate_sigmas"),
    ] {
        let error = refused(&format!("{}\n[estimator]\n{line}\n", text("iris")));
        assert!(error.contains(stated), "{error}");
    }
    for (vehicle_m_s2, estimator_m_s2) in [("9.79", 9.79), ("6.0", 9.7), ("11.0", 9.9)] {
        let there = changed("racer", "[vehicle]", &format!("[vehicle]\ngravity_m_s2 = {vehicle_m_s2}"));
        assert_eq!(parse("my.toml", &there, "my").unwrap().estimation.gravity_m_s2, estimator_m_s2);
    }
    // The example in docs/estimation.md must be readable.
    let page = include_str!("../../../docs/estimation.md");
    let example = page.split("```toml\n").find(|block| block.starts_with("[estimator]")).unwrap();
    let example = example.split("```").next().unwrap();
    let read = parse("my.toml", &format!("{}\n{example}", text("iris")), "my").unwrap().estimation;
    let differing = settings(&read).into_iter().zip(settings(&without)).filter(|(read, usual)| read != usual);
    assert_eq!(differing.count(), example.lines().count() - 1);
}

/// A part named in `[imu]` sets the estimator's noise from its data sheet, and vibration from the file. `[estimator]`
/// overrides both.
#[test]
fn the_inertial_sensors_data_sheet_reaches_the_estimator() {
    let iris = |imu: &str| changed("iris", "[imu]", &format!("[imu]\n{imu}"));
    let read = |imu: &str| parse("my.toml", &iris(imu), "my").unwrap().estimation;
    let usual = read("");
    assert_eq!(usual, Estimation::DEFAULT);
    let parts = ["icm-42688-p", "bmi270", "mpu-6000"].map(|part| read(&format!("part = \"{part}\"")));
    let [fine, middling, poor] = parts.map(|it| it.gyro_noise_rad_s_rthz);
    assert!(fine < poor && middling < poor && poor != usual.gyro_noise_rad_s_rthz, "{fine} {middling} {poor}");
    assert_eq!(parts.map(|it| it.gyro_range_rad_s), [2000.0_f64.to_radians() as f32; 3]);
    // Settings that the part does not affect keep their defaults.
    assert_eq!(
        parts.map(|it| (it.gnss_noise_m, it.mag_slow_rad, it.baro_walk_m_rts)),
        [(usual.gnss_noise_m, usual.mag_slow_rad, usual.baro_walk_m_rts,); 3]
    );
    let shaken = read("part = \"icm-42688-p\"\ngyro = { vibration_rad_s = 0.5 }");
    assert!(shaken.gyro_noise_rad_s_rthz > 2.0 * fine, "{shaken:?}");
    let own = format!("{}\n[estimator]\ngyro_noise_rad_s_rthz = 0.03\n", iris("part = \"bmi270\""));
    let own = parse("my.toml", &own, "my").unwrap().estimation;
    assert_eq!(own, Estimation { gyro_noise_rad_s_rthz: 0.03, ..parts[1] });
    for (line, named) in [
        ("part = \"bmi720\"", "bmi270"),
        ("gyro = { vibration = 1.0 }", "vibration_rad_s"),
        ("harmonics = [1.0, 0.5, 0.25]", "harmonics"),
        ("part = \"bmi270\"\nlever_m = [0.0, 0.0, 0.05]", "lever_m"),
    ] {
        let error = refused(&iris(line));
        assert!(error.contains(named), "{error}");
    }
}

/// The inertial sensor's mounting and the rotors' time constant reach the flight software as stated in the file.
#[test]
fn mounting_and_lag_are_the_files() {
    for known in &BUILT_IN {
        let vehicle = known.read().unwrap();
        assert_eq!(vehicle.response().time_constant_s, vehicle.realism.rotors.time_constant_s as f32, "{}", known.name);
    }
    let turned = changed("iris", "attitude_rad = [0.0, 0.0, 0.0]", "attitude_rad = [0.0, 3.0, 1.5]");
    let mounting = parse("my.toml", &turned, "my").unwrap().imu.to_f32();
    assert_eq!(mounting.attitude_rad.as_slice(), [0.0, 3.0, 1.5]);
}
