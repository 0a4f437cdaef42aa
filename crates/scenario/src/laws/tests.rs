//! Tests the consistency of every entry in the list of laws.
#![allow(clippy::unwrap_used, reason = "tests")]

use super::{ControllerKind, Law};
use crate::contender::Contender;
use afbc::Profile;
use afbc_types::{Axis, Declared, PLUS, Parameters};
use core::convert::Infallible;
use std::collections::BTreeSet;

#[test]
fn names_and_prefixes_are_unique() {
    let all = ControllerKind::ALL;
    assert_eq!(all.map(ControllerKind::name).into_iter().collect::<BTreeSet<_>>().len(), all.len());
    assert_eq!(all.map(ControllerKind::title).into_iter().collect::<BTreeSet<_>>().len(), all.len());
    assert_eq!(all.map(ControllerKind::prefix).into_iter().collect::<BTreeSet<_>>().len(), all.len());
}

/// Gains of laws in the cascade are in one group per axis; other gains are in no group.
#[test]
fn each_law_has_gains_that_fly_the_papers_vehicle() {
    let rotors = PLUS.map(|rotor| rotor.to_f64());
    for kind in ControllerKind::ALL {
        let by_hand = Contender { law: Law::by_hand(kind), ..Contender::of(kind, Profile::Flight) };
        for contender in [Contender::of(kind, Profile::Paper), Contender::of(kind, Profile::Flight), by_hand] {
            assert_eq!(contender.kind(), kind);
            contender.check(&Parameters::PAPER, &rotors).unwrap();
            contender.law.validate().unwrap();
            let (mut groups, mut count) = (BTreeSet::new(), 0);
            let Ok(()) = contender.law.visit(&mut |declaration, _| {
                groups.insert(declaration.group);
                count += 1;
                Ok::<(), Infallible>(())
            });
            let axes = Axis::ALL.map(Axis::name);
            let expected: BTreeSet<&str> = if kind.in_cascade() { axes.into() } else { [""].into() };
            assert!(groups == expected && count > 0, "{}: {groups:?}", kind.name());
        }
    }
}

/// A contender's gains scaled by rule equal those used on a vehicle without its own gains.
#[test]
fn gains_by_rule_are_those_that_fly() {
    for vehicle in &afbc_vehicles::BUILT_IN {
        let bare = vehicle.text.split("# Gains found by").next().unwrap();
        let vehicle = afbc_vehicles::parse(vehicle.name, bare, vehicle.name).unwrap();
        for kind in ControllerKind::ALL {
            let contender = Contender::of(kind, Profile::Flight);
            let flies = contender.clone().on(&vehicle, Profile::Flight).unwrap();
            assert_eq!(contender.by_rule(&vehicle), flies, "{} on {}", kind.name(), vehicle.name);
        }
    }
}
