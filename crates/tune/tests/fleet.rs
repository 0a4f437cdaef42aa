//! Tests the flights made from a vehicle's data, searches on several threads, and searches that resume in their folder.
#![allow(clippy::unwrap_used, missing_docs, reason = "what cannot be flown must stop the test")]

use afbc_scenario::Scenario;
use afbc_scenario::contender::ControllerKind;
use afbc_tune::fleet::{FleetResults, GainSearch};
use afbc_tune::{
    LOST, SearchOptions, by_hand_on, conditions_on, costs, held_out, held_out_on, search, training, training_on,
};
use afbc_vehicles::{BUILT_IN, Vehicle, built_in};
use core::hash::Hasher;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

fn vehicle(name: &str) -> Vehicle {
    built_in(name).unwrap().read().unwrap()
}

/// Returns a hash of the flights, without their contenders.
fn print(flights: &[Scenario]) -> String {
    let mut hash = twox_hash::XxHash64::with_seed(0);
    for flight in flights {
        let bare = Scenario { contenders: Vec::new(), ..flight.clone() };
        hash.write(&serde_json::to_vec(&bare).unwrap());
    }
    format!("{:016x}", hash.finish())
}

/// The first 19 training and 18 held-out flights of the paper's vehicle never change by a bit. Those made from the
/// vehicle's file equal those made without it.
#[test]
fn the_papers_flights_stay_what_they_were() {
    let [train, held] = [training().unwrap(), held_out().unwrap()];
    let pinned = [print(train.get(..19).unwrap()), print(held.get(..18).unwrap())];
    assert_eq!(pinned, ["16f9f7e891d1cb86", "cc27469fc87e2bc2"]);
    let paper = vehicle("paper");
    assert_eq!(training_on(&paper).unwrap(), train);
    assert_eq!(held_out_on(&paper).unwrap(), held);
}

/// Every law can fly every flight. There are at most 23 training flights, each of at most a minute.
#[test]
fn every_flight_is_valid_on_every_vehicle() {
    for known in &BUILT_IN {
        let vehicle = known.read().unwrap();
        let mut flights = training_on(&vehicle).unwrap();
        assert!(flights.len() <= 23 && flights.iter().all(|flight| flight.duration_s <= 60.0), "{}", known.name);
        flights.extend(held_out_on(&vehicle).unwrap());
        // Conditions flown by rule are for the gains of the paper's vehicle, so they are left out here.
        let conditions = conditions_on(&vehicle).unwrap().into_iter().filter(|condition| !condition.by_rule);
        flights.extend(conditions.map(|condition| condition.scenario));
        for flight in flights {
            let contenders = ControllerKind::ALL.map(|kind| by_hand_on(kind, &vehicle)).to_vec();
            let name = format!("{} {}", known.name, flight.name);
            let checked = Scenario { contenders, ..flight }.check();
            assert!(checked.is_ok(), "{name}: {checked:?}");
        }
    }
}

/// INDI with hand-tuned gains scaled by rule, the start of its search, survives all flights except those listed.
#[test]
fn the_start_survives_most_flights() {
    let mut lost = Vec::new();
    for known in &BUILT_IN {
        let vehicle = known.read().unwrap();
        let flights = training_on(&vehicle).unwrap();
        let costs = costs(&flights, &by_hand_on(ControllerKind::Indi, &vehicle)).unwrap();
        let names = flights.iter().zip(costs).filter(|(_, cost)| *cost >= LOST);
        lost.extend(names.map(|(flight, _)| format!("{} {}", known.name, flight.name)));
    }
    assert_eq!(lost, ["crazyflie old"]);
}

#[test]
fn a_search_does_not_depend_on_the_number_of_threads() {
    let vehicle = vehicle("racer");
    let named = |name: &&Scenario| ["weak", "step", "lemniscate", "old"].contains(&name.name.as_str());
    let flights: Vec<_> = training_on(&vehicle).unwrap().iter().filter(named).cloned().collect();
    let start = by_hand_on(ControllerKind::Indi, &vehicle);
    // The steps are large, so that some contenders are given up.
    let course = SearchOptions { budget: 24, step: 0.8, seed: 3 };
    let found = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| search(&start, &flights, &[], course, |_, _| true).unwrap())
    });
    let [one, three] = found;
    assert_eq!((one.after.to_bits(), &one.contender), (three.after.to_bits(), &three.contender));
    assert!(one.after < one.before);
    let flown = costs(&flights, &one.contender).unwrap();
    assert_eq!(afbc_tune::mean(&flown).to_bits(), one.after.to_bits());
}

fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries
        .filter(|path| path.is_file())
        .map(|path| {
            let bytes = std::fs::read(&path).unwrap();
            (path.file_name().unwrap().into(), bytes)
        })
        .collect()
}

/// Searches that are interrupted and resumed leave the same bytes in their folder as searches without interruption. The
/// folder refuses other searches.
#[test]
fn an_interrupted_fleet_resumes_to_the_same_bytes() {
    let base = std::env::temp_dir().join(format!("afbc-tune-fleet-{}", std::process::id()));
    let course = SearchOptions { budget: 2, step: 0.3, seed: 1 };
    let kinds = [ControllerKind::Pid, ControllerKind::Indi];
    let searches: Vec<_> =
        kinds.into_iter().map(|kind| GainSearch::new(kind, &vehicle("racer"), false).unwrap()).collect();
    let run = |folder: &Path, stops: bool| {
        let results = FleetResults::open(folder, &searches, course, false).unwrap();
        let stop = AtomicBool::new(false);
        let ended = results.complete(&searches, &stop, |tries| {
            if stops && tries > 0 {
                stop.store(true, Ordering::Relaxed);
            }
        });
        let outcomes = ended.unwrap();
        assert_eq!(outcomes.is_none(), stops);
        outcomes.map(|outcomes| results.gains_of("racer", &outcomes))
    };
    let (whole, parts) = (base.join("whole"), base.join("parts"));
    let gains = run(&whole, false).unwrap();
    run(&parts, true);
    assert_eq!(run(&parts, false).unwrap(), gains);
    assert_eq!(files(&whole), files(&parts));

    let bare = built_in("racer").unwrap().text.split("# Gains found by").next().unwrap();
    let text = format!("{bare}\n{gains}");
    let read = afbc_vehicles::parse("racer.toml", &text, "racer").unwrap();
    afbc_scenario::contender::Law::on(ControllerKind::Indi, &read, afbc::Profile::Flight).unwrap();

    let refused = |course, searches: &[GainSearch]| {
        FleetResults::open(&whole, searches, course, false).err().map(|error| error.to_string()).unwrap()
    };
    assert!(refused(SearchOptions { seed: 2, ..course }, &searches).contains("with seed 1, not 2"));
    assert!(refused(course, searches.get(..1).unwrap()).contains("other laws or vehicles"));
    std::fs::write(whole.join("racer.pid.json"), "{}").unwrap();
    let results = FleetResults::open(&whole, &searches, course, false).unwrap();
    assert!(results.outcome(searches.first().unwrap()).unwrap_err().to_string().contains("damaged"));
    std::fs::remove_dir_all(base).unwrap();
}
