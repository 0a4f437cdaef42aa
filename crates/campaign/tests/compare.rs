//! Tests of comparisons over seeds: which scenarios a seed changes, and how contenders differ over the same seeds.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)]

use afbc::Profile;
use afbc_campaign::PairedDifference;
use afbc_campaign::compare::{self, Comparison, DISTANCE, MEASURES, SEEDS, usual_seeds};
use afbc_campaign::statistics::{Median, SignedRank};
use afbc_plant::{Deviations, MeasurementDropouts, RotorFault, Sensing};
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::{BUILT_IN, Scenario};

fn named(name: &str) -> Scenario {
    BUILT_IN.iter().find(|known| known.name == name).unwrap().read().unwrap()
}

fn under(scenario: Scenario, kinds: &[ControllerKind]) -> Scenario {
    let contenders = kinds.iter().map(|kind| Contender::of(*kind, Profile::Flight)).collect();
    Scenario { contenders, ..scenario }
}

fn fly(scenario: Scenario, seeds: u64) -> Comparison {
    compare::fly(vec![scenario], seeds, u64::MAX, &|| ()).unwrap().remove(0)
}

/// A scenario's default is several seeds if, and only if, two seeds give two different flights.
#[test]
fn a_seed_is_said_to_matter_where_it_does() {
    let still = Scenario { duration_s: 6.0, ..named("hover") };
    let sensing = |sensing: Sensing| Scenario { sensing, ..still.clone() };
    let some = Deviations { position_m: 0.01, ..Deviations::DEFAULT };
    let lossy = MeasurementDropouts { rate_hz: 2.0, ..MeasurementDropouts::default() };
    let one_by_one = [
        sensing(Sensing { noise: some, ..Sensing::default() }),
        sensing(Sensing { bias: some, ..Sensing::default() }),
        sensing(Sensing { delay_s: 0.01, period_s: 0.02, gyro: true, ..Sensing::default() }),
        Scenario { sensing: Sensing { dropouts: Some(lossy), ..Sensing::default() }, ..named("circle") },
    ];
    let built_in = BUILT_IN.iter().map(|known| known.read().unwrap());
    let (mut random, mut fixed) = (0, 0);
    for scenario in built_in.chain(one_by_one) {
        let name = format!("{} {:?}", scenario.name, scenario.sensing);
        let scenario = Scenario { duration_s: scenario.duration_s.min(6.0), ..scenario };
        let matters = scenario.is_random();
        let flown = fly(under(scenario.clone(), &[ControllerKind::Pid]), 2);
        let [first, second] = [0, 1].map(|flight| flown.entries[0].flights[flight].metrics);
        assert_eq!(matters, first != second, "{name}");
        assert_eq!(usual_seeds(&scenario), if matters { SEEDS } else { 1 });
        *(if matters { &mut random } else { &mut fixed }) += 1;
    }
    assert!(random >= 4 && fixed >= 4, "{random}, {fixed}");
}

/// A law's name means the law with its flight profile, whichever scenario comes first. A printed law is named so.
#[test]
fn a_laws_name_is_that_of_the_law_that_flies_in_any_order() {
    let all: Vec<Scenario> = BUILT_IN.iter().map(|known| known.read().unwrap()).collect();
    for kind in ControllerKind::ALL {
        for (a, b) in all.iter().flat_map(|a| all.iter().map(move |b| (a, b))) {
            let own = compare::contenders(&[a.clone(), b.clone()]);
            let chosen = compare::choose(&own, &[kind.name().to_owned()]).unwrap();
            assert_eq!(chosen, [Contender::of(kind, Profile::Flight)], "{} {}", a.name, b.name);
            let mut turned = compare::contenders(&[b.clone(), a.clone()]);
            let name = |contender: &Contender| contender.name.clone();
            let mut own = own;
            own.sort_by_key(name);
            turned.sort_by_key(name);
            assert_eq!(own, turned, "{} {}", a.name, b.name);
        }
    }
    let printed = compare::contenders(&[named("paper")]);
    let titles: Vec<_> = printed.iter().map(|contender| (contender.name.as_str(), contender.title())).collect();
    let [afbc, backstepping] = ["AFBC as printed", "backstepping as printed"];
    assert_eq!(titles, [("afbc-as-printed", afbc), ("backstepping-as-printed", backstepping)]);
}

/// Of the built-in scenarios, only the paper's flies the printed law, and names it so.
#[test]
fn only_the_papers_scenario_flies_the_printed_law() {
    for known in &BUILT_IN {
        let scenario = known.read().unwrap();
        for contender in &scenario.contenders {
            let is_paper = scenario.name == "paper";
            assert_eq!(contender.is_printed(), is_paper, "{}: {}", scenario.name, contender.name);
            assert_eq!(contender.title().ends_with("as printed"), is_paper, "{}", scenario.name);
        }
    }
}

/// A scenario's own contenders keep the gains of its file in a comparison, on any vehicle.
#[test]
fn own_gains_fly_in_their_own_scenario() {
    let text = "controllers = [\"pid\", \"afbc\"]\n[vehicle]\nname = \"racer\"";
    let hover = "[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 1]\n";
    let gentle = "[[contender]]\nname = \"gentle\"\ncontroller = \"pid\"\ngains = { position_p_1_s = 0.6 }\n";
    let racer = afbc_scenario::parse("racer.toml", &format!("{text}\n{hover}{gentle}"), "racer").unwrap();
    let masses = afbc_scenario::parse("light.toml", &format!("[vehicle]\nmass_kg = 0.3\n{hover}"), "light").unwrap();
    let own = compare::contenders(&[racer.clone(), masses.clone(), named("hover")]);
    let names: Vec<_> = own.iter().map(|contender| contender.name.as_str()).collect();
    assert_eq!(names, ["pid", "afbc", "gentle", "backstepping"]);
    for mut scenario in [racer, masses] {
        let before = scenario.contenders.clone();
        compare::fly_under(&mut scenario, &own).unwrap();
        for contender in before {
            let flies = scenario.contenders.iter().find(|other| other.name == contender.name).unwrap();
            assert_eq!(*flies, contender, "{}", scenario.name);
        }
    }
}

#[test]
fn differences_are_those_of_the_same_seeds() {
    let kinds = [ControllerKind::Pid, ControllerKind::Afbc, ControllerKind::Indi, ControllerKind::Backstepping];
    let flown = fly(under(Scenario { duration_s: 6.0, ..named("hardware") }, &kinds), 7);
    // The default contender to compare with is AFBC.
    assert_eq!(flown.baseline, 1);
    let flown = flown.with_baseline(Some("indi"));
    assert_eq!((flown.baseline, flown.clone().with_baseline(Some("nobody")).baseline), (2, 1));
    for value in [DISTANCE.value, MEASURES[5].value] {
        let versus = flown.paired_differences(value);
        assert_eq!(versus[2], None, "not with itself");
        let mut tested = Vec::new();
        for (entry, versus) in flown.entries.iter().zip(&versus).filter(|(_, versus)| versus.is_some()) {
            let pairs = entry.flights.iter().zip(&flown.entries[2].flights);
            let differences: Vec<f64> = pairs
                .map(|(own, other)| {
                    assert_eq!(own.seed, other.seed);
                    value(&own.metrics) - value(&other.metrics)
                })
                .collect();
            let PairedDifference { seeds, difference, test, p_holm } = versus.unwrap();
            assert_eq!((seeds, Some(difference)), (7, Median::of(&differences)));
            assert_eq!(test, SignedRank::of(&differences));
            assert!(p_holm >= test.p);
            tested.push((test.p, p_holm));
        }
        // Holm's correction multiplies the smallest of three probabilities by three.
        let smallest = tested.iter().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
        assert_eq!(smallest.1, (3.0 * smallest.0).min(1.0));
    }
    // A single seed gives no comparison.
    let single = fly(flown.scenario, 1);
    assert!(single.paired_differences(DISTANCE.value).iter().all(Option::is_none));
}

/// A lost vehicle ranks behind every vehicle that is not lost.
#[test]
fn a_lost_vehicle_is_the_worst() {
    let mut falling = Scenario { duration_s: 8.0, ..named("hardware") };
    falling.realism.rotors.faults = vec![RotorFault { rotor: 1, efficiency: 0.0, start_s: 1.0 }];
    let mut flown = fly(under(falling, &[ControllerKind::Pid, ControllerKind::Indi]), 6);
    let kept = fly(under(Scenario { duration_s: 8.0, ..named("hardware") }, &[ControllerKind::Indi]), 6);
    flown.entries[1] = kept.entries[0].clone();
    assert_eq!(flown.entries[0].lost(), 6);
    assert_eq!(flown.entries[0].median(DISTANCE.value), None);
    assert!(flown.is_best(&flown.entries[1], &DISTANCE) && !flown.is_best(&flown.entries[0], &DISTANCE));
    let versus = flown.clone().with_baseline(Some("indi")).paired_differences(DISTANCE.value)[0].unwrap();
    assert_eq!((versus.test.effect, versus.difference.value), (1.0, f64::INFINITY));
    // Two lost vehicles are level.
    flown.entries[1] = flown.entries[0].clone();
    let level = flown.paired_differences(DISTANCE.value)[1].unwrap();
    assert_eq!((level.difference.value, level.test), (0.0, SignedRank { p: 1.0, effect: 0.0 }));
}
