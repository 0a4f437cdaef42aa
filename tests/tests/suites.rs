//! The built-in suites fly as described, and docs/reference/suites.md and docs/reference/faults.md show their results.

use afbc::Profile;
use afbc_campaign::compare::{self, standard_and_monitored};
use afbc_campaign::suite::{SUITES, Suite, SuiteFlight};
use afbc_files::read::BuiltIn;
use afbc_plant::{PlantParameter, SensorFaultKind};
use afbc_report::markers;
use afbc_report::suite::{self, FlownSuite};
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_sim::flight::fly;
use afbc_types::{Axis, Declared, DeclaredValue};
use core::convert::Infallible;
use std::collections::BTreeSet;

fn built_in(name: &str) -> Suite {
    BuiltIn::named(&SUITES, name).unwrap().read().unwrap()
}

/// True if the words are the same and the numbers differ by at most their last digit, or by 2 %, by which another
/// host's rounding may change a flight.
fn agree(page: &str, code: &str) -> bool {
    let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    let (page, code) = (words(page), words(code));
    page.len() == code.len()
        && page.iter().zip(&code).all(|(page, code)| match (page.parse::<f64>(), code.parse::<f64>()) {
            (Ok(page), Ok(code)) => (page - code).abs() <= 1.5e-3 + 0.02 * code.abs(),
            _ => page == code,
        })
}

/// Flies a suite under its contenders, and compares the result with the page's table.
fn compared(name: &str, page: &str) {
    let suite = built_in(name);
    let scenarios = suite.under(&standard_and_monitored()).unwrap();
    let comparisons = compare::fly(scenarios, 1, u64::MAX, &|| ()).unwrap();
    let code = suite::markdown(FlownSuite { suite: &suite, comparisons: &comparisons });
    let [begin, end] = suite::markers(name);
    let (_, page, _) = markers::parts(page, [&begin, &end]).expect("both markers");
    let lines = || page.lines().zip(code.lines());
    let cells = |line: &str| line.split('|').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
    let differ = lines().find(|(page, code)| {
        let (page, code) = (cells(page), cells(code));
        page.len() != code.len() || page.iter().zip(&code).any(|(page, code)| !agree(page, code))
    });
    let file = if name == "field" { "suites" } else { name };
    let cure =
        format!("run `cargo run --release -- compare --suite {name} --seeds 1 --write docs/reference/{file}.md`");
    assert_eq!(differ, None, "{cure}");
    assert_eq!(page.lines().count(), code.lines().count(), "{cure}");
}

#[test]
fn the_page_of_the_field_is_what_flies() {
    compared("field", include_str!("../../docs/reference/suites.md"));
}

/// The pages' statements about AFBC and other laws agree with `sitl compare --suite field`, as far as the field's table
/// shows: it is rounded and has one seed.
#[test]
fn pages_say_where_afbc_leads() {
    let [begin, end] = suite::markers("field");
    let (_, table, _) = markers::parts(include_str!("../../docs/reference/suites.md"), [&begin, &end]).unwrap();
    let cells = |line: &str| line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
    let mut lines = table.lines().take_while(|line| line.starts_with('|'));
    let heads = cells(lines.next().unwrap());
    let tuned = ["AFBC", "PID", "geometric", "INDI", "L1", "DFBC", "MPC"];
    let columns = tuned.map(|law| heads.iter().position(|head| head == law).unwrap());
    // A cell ends with both distances, or with the time of the loss.
    let distance = |cell: &str| cell.rsplit_once(" / ").map(|(start, _)| start.rsplit(' ').next().unwrap().to_owned());
    let flights: Vec<(String, [Option<String>; 7])> = lines
        .skip(1)
        .map(cells)
        .map(|cells| (cells[0].split('`').nth(1).unwrap().to_owned(), columns.map(|column| distance(&cells[column]))))
        .collect();
    // The command compares over ten seeds, the page shows one seed to four digits. So distances are surely level or
    // possibly level.
    let number = |text: &Option<String>| text.as_ref().map_or(f64::INFINITY, |text| text.parse().unwrap());
    let is_level = |law: usize, distances: &[Option<String>; 7], rounding_m: f64| {
        let best = distances.iter().map(number).fold(f64::INFINITY, f64::min);
        number(&distances[law]) - best <= (0.05 * best).max(0.2e-3) + rounding_m
    };
    let (afbc, pid, indi, dfbc, mpc) = (0, 1, 3, 5, 6);
    let survived = || flights.iter().filter(|(_, distances)| distances.iter().any(Option::is_some));
    assert_eq!((flights.len(), survived().count()), (26, 25));
    for (law, said) in [(afbc, 22), (mpc, 8), (dfbc, 6), (indi, 4), (pid, 3)] {
        let level = |rounding_m| survived().filter(|(_, distances)| is_level(law, distances, rounding_m)).count();
        assert!((level(-1e-4)..=level(1e-4 + 1e-9)).contains(&said), "{}: {said}", tuned[law]);
    }
    let raced = || survived().filter(|(name, _)| ["lemniscate-", "circle-"].iter().any(|kind| name.starts_with(kind)));
    assert_eq!(raced().count(), 10);
    let least = |distances: &[Option<String>; 7]| distances.iter().map(number).fold(f64::INFINITY, f64::min);
    assert!(raced().all(|(_, distances)| number(&distances[afbc]) <= least(distances)));
    let said = "AFBC is best or level, within 5 % or 0.2 mm of the best, in 22 of the 26 flights of the suite `field`, \
                MPC in 8, DFBC in 6, INDI in 4, PID in 3; it is the best in each of the racer's 10 flights, and one \
                flight is lost under every law";
    let plain = |page: &str| page.split_whitespace().collect::<Vec<_>>().join(" ");
    let results = plain(include_str!("../../docs/results.md"));
    for (name, page) in [
        ("README.md", plain(include_str!("../../README.md"))),
        ("docs/results.md", results.clone()),
        ("docs/suites.md", plain(include_str!("../../docs/suites.md"))),
    ] {
        assert!(page.contains(said), "{name} lacks: {said}");
    }
    let section = results.split("## On other vehicles").nth(1).unwrap().split(" ## ").next().unwrap();
    let mut quoted = 0;
    for (name, distances) in &flights {
        let Some((_, after)) = section.split_once(&format!("`{name}`")) else { continue };
        let figures = [afbc, pid, indi, dfbc, mpc].map(|law| distances[law].as_deref().unwrap());
        let row = format!(" | {} |", figures.join(" | "));
        assert!(after.starts_with(&row), "docs/results.md, `{name}`: {row}");
        quoted += 1;
    }
    assert!(quoted >= 4, "{quoted} flights are quoted");
}

#[test]
fn the_page_of_faults_is_what_flies() {
    compared("faults", include_str!("../../docs/reference/faults.md"));
}

/// A suite's figures follow from the flight's steps: distances from 5 s to the end, losses, trips.
#[test]
fn a_suites_figures_are_those_of_the_flight() {
    let suite = built_in("faults");
    let scenarios = suite.under(&standard_and_monitored()).unwrap();
    let chosen = |name: &&str| scenarios.iter().find(|scenario| scenario.name == **name).unwrap().clone();
    let chosen: Vec<_> = ["offset-x", "rotor-1-20"].iter().map(chosen).collect();
    for comparison in compare::fly(chosen, 1, u64::MAX, &|| ()).unwrap() {
        for entry in &comparison.entries {
            let (mut squares, mut count, mut largest_m, mut tripped) = (0.0, 0.0, 0.0_f64, None);
            let lost = fly(&comparison.scenario, entry.contender(), |sample| {
                let distance_m = (sample.motion.position_m - sample.reference.position_m).norm();
                if sample.time_s > 4.9995 {
                    squares += distance_m * distance_m;
                    count += 1.0;
                    largest_m = largest_m.max(distance_m);
                }
                tripped = tripped.or(sample.action.health.fallback.map(|reason| (sample.time_s, reason)));
            });
            let [flight] = entry.flights.as_slice() else { panic!("one seed") };
            assert_eq!((flight.lost, flight.tripped.map(|t| (t.time_s, t.reason))), (lost.unwrap(), tripped));
            let rms_m: f64 = (squares / count).sqrt();
            assert!((flight.metrics.rmse.xyz().norm() - rms_m).abs() < 1e-9 * (1.0 + rms_m));
            assert!((flight.metrics.max_distance_m - largest_m).abs() < 1e-12);
        }
    }
}

/// Flights of the field have the speed, acceleration or wind in their names, on the vehicles that they name.
#[test]
fn the_flights_of_the_field_are_those_it_names() {
    let suite = built_in("field");
    let peak = |flight: &SuiteFlight, derivative: fn(&afbc_scenario::trajectory::Reference) -> f64| {
        let times = (0..(flight.scenario.duration_s * 1e3) as u32).map(|k| 1e-3 * f64::from(k));
        times.map(|t| derivative(&flight.scenario.trajectory.at(t))).fold(0.0, f64::max)
    };
    let vehicle = |flight: &SuiteFlight| flight.scenario.vehicle_file.as_ref().map(|vehicle| vehicle.name.clone());
    let mut found = BTreeSet::new();
    for flight in &suite.flights {
        let name = flight.scenario.name.as_str();
        let (kind, number) = name.rsplit_once('-').unwrap_or((name, ""));
        let number: f64 = number.trim_end_matches('g').parse().unwrap_or(f64::NAN);
        match kind {
            "lemniscate" | "paper-lemniscate" => {
                let speed_m_s = peak(flight, |reference| reference.velocity_m_s.norm());
                assert!((speed_m_s - number).abs() < 1e-3, "{name}: {speed_m_s} m/s");
                assert_eq!(vehicle(flight).as_deref(), (kind == "lemniscate").then_some("racer"), "{name}");
            }
            "circle" => {
                let acceleration_m_s2 = peak(flight, |reference| reference.acceleration_m_s2.norm());
                assert!((acceleration_m_s2 - 0.981 * number).abs() < 1e-3, "{name}: {acceleration_m_s2} m/s2");
                // The start is banked for this acceleration, to a milliradian.
                let tilt_rad = (acceleration_m_s2 / 9.81).atan();
                assert!((flight.scenario.initial.attitude_rad.y + tilt_rad).abs() < 1e-3, "{name}");
                assert_eq!(vehicle(flight).as_deref(), Some("racer"));
            }
            "wind" => {
                let wind_m_s = flight.scenario.realism.wind.steady_m_s.norm();
                assert!((wind_m_s - number).abs() < 0.6, "{name}: {wind_m_s} m/s");
                let reference = flight.scenario.trajectory.at(1.0).position_m;
                assert!((reference.x - 1.25 * 1.0_f64.sin()).abs() < 1e-4, "{name}");
                assert!((reference.z - 3.0 - 0.75 * 2.0_f64.sin()).abs() < 1e-4, "{name}");
                assert_eq!((vehicle(flight).as_deref(), flight.published.len()), (Some("iris"), 4));
            }
            "rotor" => {
                let [fault] = flight.scenario.realism.rotors.faults.as_slice() else { panic!("{name}") };
                assert!((fault.efficiency - 0.01 * number).abs() < 1e-9, "{name}");
            }
            _ => {}
        }
        found.insert(if number.is_nan() { name.to_owned() } else { format!("{kind} {number}") });
    }
    for wanted in [
        "lemniscate 2",
        "lemniscate 3",
        "lemniscate 4",
        "lemniscate 6",
        "lemniscate 8",
        "lemniscate 10",
        "circle 5",
        "circle 10",
        "circle 15",
        "circle 20",
        "wind 0",
        "wind 4",
        "wind 8",
        "wind 12",
        "paper-lemniscate 3",
        "paper-lemniscate 4",
        "rotor 80",
        "rotor 60",
        "rotor 40",
        "rotor 20",
        "payload-ahead",
        "battery-end",
        "hardware",
    ] {
        assert!(found.contains(wanted), "{wanted}");
    }
}

/// The faults cover every rotor at every remaining thrust, model errors in both directions, and wrong signs of the
/// measurement and of the moments on every axis.
#[test]
fn the_faults_are_complete() {
    let suite = built_in("faults");
    let mut found = BTreeSet::new();
    for SuiteFlight { scenario, .. } in &suite.flights {
        let percent = |share: f64| (100.0 * share).round();
        let faults = scenario.realism.rotors.faults.iter();
        found.extend(faults.map(|fault| format!("rotor {} {}", fault.rotor, percent(fault.efficiency))));
        found.extend(scenario.environment.changes().iter().map(|c| format!("{:?} {}", c.quantity, c.factor)));
        found.extend(scenario.environment.payloads().iter().map(|payload| format!("payload {}", payload.left_m > 0.0)));
        found.extend(scenario.sensor_faults.iter().map(|fault| {
            let axis = fault.axis.map_or("all", Axis::name);
            match fault.misreading {
                SensorFaultKind::Factor(factor) => format!("{axis} times {factor}"),
                SensorFaultKind::Offset(_) => format!("{axis} off"),
                SensorFaultKind::Frozen => format!("{axis} frozen"),
            }
        }));
    }
    let rotors = (1..5).flat_map(|rotor| [0, 20, 40, 60, 80].map(|share| format!("rotor {rotor} {share}")));
    let models = [PlantParameter::ThrustFactor, PlantParameter::Inertia, PlantParameter::Mass];
    let models = models.iter().flat_map(|quantity| ["2", "0.5"].map(|factor| format!("{quantity:?} {factor}")));
    let moments = [PlantParameter::RollMoment, PlantParameter::PitchMoment, PlantParameter::YawMoment]
        .map(|m| format!("{m:?} -1"));
    let signs = Axis::ALL.map(|axis| format!("{} times -1", axis.name()));
    let offsets = Axis::ALL.map(|axis| format!("{} off", axis.name()));
    let others = ["all frozen", "x frozen", "payload true", "payload false"].map(String::from);
    for wanted in rotors.chain(models).chain(moments).chain(signs).chain(offsets).chain(others) {
        assert!(found.contains(&wanted), "no {wanted}");
    }
}

/// A suite's tilt limit raises every law's own limit, if it has one, and the cascade's. No limit is lowered.
#[test]
fn every_law_may_tilt_as_far() {
    let tilts = |contender: &Contender| {
        let mut tilts = Vec::new();
        let Ok(()) = contender.law.visit(&mut |declaration, value| {
            if let ("tilt_max_rad", DeclaredValue::Single([tilt])) = (declaration.range.name, value) {
                tilts.push(*tilt);
            }
            Ok::<(), Infallible>(())
        });
        tilts
    };
    for kind in ControllerKind::ALL {
        let own = Contender::of(kind, Profile::Flight);
        let free = own.clone().free_to_tilt(1.1);
        assert!(tilts(&free).iter().all(|tilt| *tilt == 1.1), "{}", kind.name());
        assert_eq!(tilts(&free).len(), tilts(&own).len());
        assert!(kind.in_cascade() || !tilts(&own).is_empty(), "{} has no tilt_max_rad", kind.name());
        assert_eq!(free.settings.limits.tilt_max_rad, 1.1);
        assert!((free.settings.limits.acceleration_max_m_s2 - 9.81 * 1.1_f32.tan()).abs() < 1e-4);
        assert_eq!(own.clone().free_to_tilt(0.1), own);
    }
    let printed = Contender::of(ControllerKind::Afbc, Profile::Paper);
    assert_eq!(printed.clone().free_to_tilt(1.1), printed);
}
