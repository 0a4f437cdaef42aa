//! Tests of the suite `rough-estimate`: drawn behaviour, the estimator's settings and the judgement.

#![expect(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

use afbc::Profile;
use afbc_campaign::rough::{self, CLASSES, FlownRoughFlight, Judgement, MIXTURE, RoughFlight, RoughFlights, Venue};
use afbc_plant::instruments::{FailureKind, ImuModel};
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_sim::flight::Lost;
use afbc_vehicles::{BUILT_IN, Vehicle};
use std::collections::{BTreeMap, BTreeSet};

fn vehicles() -> Vec<Vehicle> {
    BUILT_IN.iter().map(|known| known.read().unwrap()).collect()
}

fn law() -> Contender {
    Contender::of(ControllerKind::Afbc, Profile::Flight).monitored()
}

fn rough(seeds: core::ops::Range<u64>, flights: u64) -> RoughFlights {
    RoughFlights { seeds, flights, duration_s: None, vehicles: vehicles() }
}

#[test]
fn a_flight_is_a_function_of_seed_vehicle_class_and_number() {
    let all = rough(1..3, 2).draw(&law()).unwrap();
    assert_eq!(all.len(), 2 * 2 * vehicles().len() * (CLASSES.len() + 1));
    let iris =
        RoughFlights { vehicles: vec![afbc_vehicles::built_in("iris").unwrap().read().unwrap()], ..rough(2..3, 1) };
    for alone in iris.draw(&law()).unwrap() {
        let beside = all.iter().find(|flight| flight.scenario.name == alone.scenario.name).unwrap();
        assert_eq!(beside, &alone);
    }
    let seeds: BTreeSet<u64> = all.iter().map(|flight| flight.scenario.seed).collect();
    assert_eq!(seeds.len(), all.len());
    let long = all.iter().filter(|flight| flight.scenario.duration_s == rough::LONG_S).count();
    assert!((all.len() / 20..all.len() / 5).contains(&long), "{long} of {}", all.len());
    assert!(all.iter().all(|flight| [rough::SHORT_S, rough::LONG_S].contains(&flight.scenario.duration_s)));
}

/// The estimator is told the data sheet of its part, the usual vibration and no fault, whatever is drawn.
#[test]
fn no_vehicle_is_told_what_is_drawn() {
    let (mut differ, mut calm) = (BTreeSet::new(), BTreeMap::new());
    for flight in rough(1..5, 1).draw(&law()).unwrap() {
        let RoughFlight { class, place, scenario, .. } = &flight;
        let told = scenario.told();
        let mut stated = ImuModel::ICM_42688_P;
        (stated.gyro.vibration_rad_s, stated.accel.vibration_m_s2) = (0.02, 1.0);
        assert_eq!(told.imu, Some(stated), "{class}");
        let of_calm = || nothing(&flight.vehicle, *place).scenario.estimation(0.001);
        let calm = calm.entry((flight.vehicle.clone(), place.name())).or_insert_with(of_calm);
        assert_eq!(scenario.estimation(0.001), *calm, "{class}");
        let untold = told != scenario.instruments;
        if untold || !scenario.instrument_faults.is_empty() || !scenario.environment.gusts().is_empty() {
            differ.insert(*class);
        } else {
            assert_eq!(*class, "nothing");
        }
    }
    assert_eq!(differ.len(), CLASSES.len());
}

/// Returns a flight in which nothing is drawn.
fn nothing(vehicle: &str, place: Venue) -> RoughFlight {
    let vehicles = vehicles().into_iter().filter(|own| own.name == vehicle).collect();
    let drawn = RoughFlights { vehicles, ..rough(1..20, 1) }.draw(&law()).unwrap();
    drawn.into_iter().find(|flight| flight.class == "nothing" && flight.place == place).unwrap()
}

/// The sizes drawn for each class cover most of the range that the page states, and never exceed that range.
#[test]
fn each_class_is_drawn_within_its_bounds() {
    let hummingbird = vec![afbc_vehicles::built_in("hummingbird").unwrap().read().unwrap()];
    let all = RoughFlights { vehicles: hummingbird, ..rough(1..3, 60) }.draw(&law()).unwrap();
    for class in &CLASSES {
        let sizes: Vec<f64> = all.iter().filter(|flight| flight.class == class.name).map(size).collect();
        let [low, high] = bounds(class.name);
        let (least, most) = sizes.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), x| (a.min(*x), b.max(*x)));
        assert!(least >= low - 1e-9 && most <= high + 1e-9, "{}: {least} to {most}", class.name);
        let spread = if low == high { 0.0 } else { (most - least) / (high - low) };
        assert!(low == high || spread > 0.5, "{}: {least} to {most}", class.name);
        let at = |place| all.iter().any(|flight| flight.class == class.name && flight.place == place);
        let own = [at(Venue::Indoors), at(Venue::Outdoors)];
        assert_eq!(own, [class.place != Some(Venue::Outdoors), class.place != Some(Venue::Indoors)], "{}", class.name);
    }
    for mixture in all.iter().filter(|flight| flight.class == MIXTURE) {
        let [one, other] = mixture.parts[..] else { panic!("{:?}", mixture.parts) };
        assert!(one != other && one != "nothing" && other != "nothing");
        for part in [one, other] {
            let class = CLASSES.iter().find(|class| class.name == part).unwrap();
            assert!(class.place.is_none_or(|place| place == mixture.place));
        }
    }
    for flight in &all {
        let begins = flight.scenario.instrument_faults.iter().map(|fault| fault.start_s);
        assert!(begins.into_iter().all(|start_s| (5.0..0.6 * flight.scenario.duration_s).contains(&start_s)));
    }
}

/// The page of tables lists all classes with their properties.
#[test]
fn the_page_has_every_class() {
    let page = include_str!("../../../docs/reference/suites.md");
    for class in &CLASSES {
        let place = class.place.map_or("either", Venue::name);
        let known = if class.known { "yes" } else { "" };
        let row = format!("| `{}` | {place} | {known} | {} |", class.name, class.meaning);
        assert!(page.lines().any(|line| line == row), "{row}");
    }
}

/// Returns the size of the first sensor behaviour that was drawn for the flight.
fn size(flight: &RoughFlight) -> f64 {
    let suite = &flight.scenario.instruments;
    let faults = &flight.scenario.instrument_faults;
    let gnss = || suite.gnss.unwrap();
    let tracker = || suite.tracker.unwrap();
    match flight.class {
        "nothing" => faults.len() as f64,
        "vibration" => suite.imu.unwrap().accel.vibration_m_s2,
        "lever" => suite.imu.unwrap().lever_m.norm(),
        "bias" => suite.imu.unwrap().gyro.bias_rad_s,
        "bumps" => flight.scenario.environment.gusts()[0].size.abs(),
        "hard-iron" => suite.magnetometer.unwrap().hard_iron_ut,
        "motor-field" => suite.magnetometer.unwrap().motor_ut.norm(),
        "gnss-late" => gnss().delay_s,
        "gnss-stamps" => gnss().stamp_s.abs(),
        "gnss-accuracy" => gnss().reported,
        "gnss-outage" => faults[0].end_s - faults[0].start_s,
        "tracker-rate" => tracker().rate_hz,
        "tracker-late" => tracker().delay_s,
        "tracker-stamps" => tracker().stamp_s.abs(),
        _ => match faults[0].failure {
            FailureKind::ImuClipped { specific_force_m_s2, .. } => specific_force_m_s2,
            FailureKind::ImuBiased { rates_bias_rad_s, .. } => rates_bias_rad_s.norm(),
            FailureKind::MagnetometerDisturbed { field_ut } => field_ut.norm(),
            FailureKind::GnssJumped { by_m } => by_m.norm(),
            FailureKind::GnssMultipath { deviation_m, .. } => deviation_m,
            FailureKind::TrackerJumped { by_m, yaw_rad } => by_m.norm().max(yaw_rad.abs()),
            other => panic!("{other:?}"),
        },
    }
}

/// Returns the smallest and largest size that may be drawn for a class of sensor behaviour.
fn bounds(class: &str) -> [f64; 2] {
    match class {
        "nothing" => [0.0, 0.0],
        "vibration" => [1.0, 10.0],
        "clipping" => [10.5, 14.0],
        "bumps" => [160.0, 400.0],
        "bias" => [0.003, 0.05],
        "bias-step" => [0.001, 0.03],
        "bias-drift" => [0.001, 0.01],
        "lever" => [0.0, 0.05],
        "hard-iron" | "motor-field" => [1.0, 10.0],
        "field" => [5.0, 25.0],
        "gnss-late" => [0.1, 0.25],
        "gnss-stamps" => [0.02, 0.15],
        "gnss-jump" => [2.0, 100.0],
        "gnss-ramp" => [2.0, 30.0],
        "gnss-outage" => [0.5, 8.0],
        "multipath" => [2.0, 10.0],
        "gnss-accuracy" => [0.3, 2.0],
        "tracker-rate" => [10.0, 100.0],
        "tracker-late" => [0.01, 0.25],
        "tracker-stamps" => [0.005, 0.05],
        "tracker-slip" => [0.1, 5.0],
        "tracker-turn" => [0.05, 0.5],
        "tracker-flip" => [core::f64::consts::PI; 2],
        other => panic!("{other} has no bounds here"),
    }
}

/// Flies every class on one vehicle for ten seconds. The result does not depend on the number of threads. The estimate
/// is consistent if the sensors behave as the vehicle is told.
#[test]
fn every_class_flies_and_has_its_row() {
    let paper = vec![afbc_vehicles::built_in("paper").unwrap().read().unwrap()];
    let short = RoughFlights { vehicles: paper, duration_s: Some(10.0), ..rough(1..2, 1) };
    let flown = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| rough::fly(short.draw(&law()).unwrap(), &|| ())).unwrap()
    };
    let (one, many) = (flown(1), flown(4));
    let bits = |flown: &[FlownRoughFlight]| -> Vec<u64> {
        flown.iter().flat_map(|it| [it.judgement.nees.to_bits(), it.judgement.within.to_bits()]).collect()
    };
    assert_eq!(bits(&one), bits(&many));
    let rows = rough::rows(&one);
    assert_eq!(rows.len(), CLASSES.len() + 2);
    assert_eq!(rows.iter().filter(|row| row.flights == 1).count(), CLASSES.len() + 1);
    assert_eq!(rows.last().map(|row| (row.class, row.flights)), Some((None, CLASSES.len() + 1)));
    // There is one evaluation every 10 ms from 5 to 10 s.
    assert!(one.iter().all(|it| it.judgement.looks <= 501));
    let nothing = &one[0];
    assert_eq!((nothing.flight.class, nothing.judgement.looks, nothing.judgement.lost), ("nothing", 501, None));
    assert!(nothing.judgement.nees > 1.0 && nothing.judgement.nees < 40.0, "{:?}", nothing.judgement);
    assert!(nothing.judgement.within > 0.9, "{:?}", nothing.judgement);
}

/// Compares with figures counted by hand. Means are over flights with a valid estimate. Without a positive covariance
/// the mean is NaN.
#[test]
fn rows_are_those_counted_by_hand() {
    let lost = Some(Lost { time_s: 9.0, reason: "tilted beyond 90 degrees" });
    let judged = |nees, within, valid| Judgement { looks: 100, valid, nees, within, ..Judgement::default() };
    let of = |class: &'static str, judgement| FlownRoughFlight {
        flight: RoughFlight { class, ..nothing("iris", Venue::Indoors) },
        judgement,
    };
    let flown = [
        of("bumps", judged(9.0, 1.0, 100)),
        of("bumps", Judgement { lost, coasted: true, ..judged(27.0, 0.5, 50) }),
        of("bumps", Judgement { descended: true, ..judged(0.0, 0.0, 0) }),
        of("field", judged(f64::NAN, 0.9, 100)),
    ];
    let rows = rough::rows(&flown);
    let row = |class| *rows.iter().find(|row| row.class == class).unwrap();
    let bumps = row(Some("bumps"));
    assert_eq!((bumps.flights, bumps.nees, bumps.worst_nees, bumps.within), (3, 18.0, 27.0, 0.75));
    assert_eq!((bumps.valid, bumps.coasted, bumps.descended, bumps.tripped, bumps.lost), (0.5, 1, 1, 0, 1));
    let all = row(None);
    assert!(all.nees.is_nan() && all.worst_nees.is_nan() && row(Some("field")).worst_nees.is_nan());
    assert_eq!((all.flights, row(Some("vibration")).flights), (4, 0));
}
