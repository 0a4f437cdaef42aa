//! The costs of the gains that fly, in the training and the held-out flights, are those of docs/tuning.md.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    missing_docs,
    reason = "what cannot be flown must stop the test"
)]

use afbc::Profile;
use afbc_sim::contender::{Contender, ControllerKind};
use afbc_tune::{LOST, by_hand, conditions, costs, held_out, mean, training};

/// Returns the law with the gains found by `sitl tune`; AFBC under its monitor, as in the search.
fn found(kind: ControllerKind) -> Contender {
    Contender::of(kind, Profile::Flight).monitored()
}

#[test]
fn the_gains_that_fly_cost_what_is_documented() {
    let page = include_str!("../../docs/tuning.md");
    let flights = [training().unwrap(), held_out().unwrap()];
    // Backstepping of the profile flies with AFBC's gains.
    let kinds: Vec<_> = ControllerKind::ALL.into_iter().filter(|kind| *kind != ControllerKind::Backstepping).collect();
    let mut missing = Vec::new();
    let mut expect = |begin: String, end: String| {
        if !page.lines().any(|line| line.starts_with(&begin) && line.ends_with(&end)) {
            missing.push(format!("{begin}...{end}"));
        }
    };

    let of_each = |contender: &Contender| flights.each_ref().map(|flights| costs(flights, contender).unwrap());
    let each_after: Vec<_> = kinds.iter().map(|&kind| of_each(&found(kind))).collect();
    for (kind, after) in kinds.iter().zip(&each_after) {
        let before = of_each(&by_hand(*kind));
        assert!(after.iter().flatten().all(|cost| *cost < LOST), "{}: lost or tripped", kind.title());
        let ([training_before, held_out_before], [training, held_out]) =
            (before.each_ref().map(|costs| mean(costs)), after.each_ref().map(|costs| mean(costs)));
        expect(
            format!("| {} | ", kind.title()),
            format!(" | {training_before:.3} | {training:.3} | {held_out_before:.3} | {held_out:.3} |"),
        );
    }

    for flight in &flights[0] {
        expect(format!("| `{}` | {} | ", flight.name, flight.duration_s), String::new());
    }
    let head: String = kinds.iter().map(|kind| format!(" {} |", kind.title())).collect();
    expect("| cost after |".into(), head);
    for (index, flight) in flights[0].iter().enumerate() {
        let costs: String = each_after.iter().map(|[training, _]| format!(" {:.2} |", training[index])).collect();
        expect(format!("| `{}` |", flight.name), costs);
    }
    assert!(missing.is_empty(), "docs/tuning.md lacks these rows:\n{}", missing.join("\n"));
}

/// Backstepping alone, which learns nothing, does not meet them: a Crazyflie's thrust falls with its battery. Nor do
/// the gains from which AFBC's search starts.
#[test]
fn the_gains_that_fly_meet_every_condition() {
    let conditions = conditions().unwrap();
    let unmet = |contender: &Contender| {
        let unmet = conditions.iter().filter(|condition| condition.factor(contender).unwrap() > 1.0);
        unmet.map(|condition| condition.scenario.name.clone()).collect::<Vec<_>>()
    };
    for kind in ControllerKind::ALL.into_iter().filter(|kind| *kind != ControllerKind::Backstepping) {
        assert_eq!(unmet(&found(kind)), [""; 0], "{}", kind.name());
    }
    let by_hand = unmet(&by_hand(ControllerKind::Afbc));
    assert!(by_hand.iter().any(|name| name.starts_with("robustness")), "{by_hand:?}");
}
