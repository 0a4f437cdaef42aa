//! The gains that fly are those that the search found: over its flights they cost what docs/tuning.md says.
#![allow(clippy::unwrap_used, missing_docs, reason = "what cannot be flown must stop the test")]

use afbc::Profile;
use sitl::contender::{Contender, ControllerKind, Law};
use sitl::tune::{LOST, by_hand, costs, held_out, mean, training};

/// The law with the gains that `sitl tune` found; AFBC under its monitor, as in the search.
fn found(kind: ControllerKind) -> Contender {
    let contender = Contender::of(kind, Profile::Flight);
    let law = if let Law::Afbc(gains) = contender.law { Law::Guarded(gains) } else { contender.law };
    Contender { law, ..contender }
}

#[test]
fn the_gains_that_fly_cost_what_is_documented() {
    let page = include_str!("../../docs/tuning.md");
    let flights = [training().unwrap(), held_out().unwrap()];
    // Backstepping of the profile flies with AFBC's gains.
    for kind in ControllerKind::ALL.into_iter().filter(|kind| *kind != ControllerKind::Backstepping) {
        let cost = |contender: &Contender| {
            flights.each_ref().map(|flights| {
                let costs = costs(flights, contender).unwrap();
                (costs.iter().copied().fold(0.0, f64::max), mean(&costs))
            })
        };
        let ([(_, training_before), (_, held_out_before)], [(worst, training), (held_out_worst, held_out)]) =
            (cost(&by_hand(kind)), cost(&found(kind)));
        assert!(worst < LOST && held_out_worst < LOST, "{}: lost or tripped", kind.title());
        let row = format!("| {training_before:.3} | {training:.3} | {held_out_before:.3} | {held_out:.3} |");
        let documented = page.lines().find(|line| line.starts_with(&format!("| {} | ", kind.title()))).unwrap();
        assert!(documented.ends_with(&row), "{documented}: {row}");
    }
}
