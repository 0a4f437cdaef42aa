//! Texts of the trip reasons, as a ground station shows them.

use afbc::Trip;
use afbc_types::Axis;
use std::collections::BTreeSet;

/// Each reason is unique, names its subsystem and the fault, and fits a status text of the link.
#[test]
fn every_reason_says_what_and_where() {
    let of = |make: fn(Axis) -> Trip, word: &'static str| Axis::ALL.map(|axis| (make(axis), word, Some(axis.name())));
    let mut reasons = vec![(Trip::Saturation, "saturated", None)];
    reasons.extend(of(Trip::Theta, "Theta_hat"));
    reasons.extend(of(Trip::Delta, "delta_hat"));
    reasons.extend(of(Trip::Error, "errors"));
    for (axis, input) in [(Axis::Roll, "U1"), (Axis::Pitch, "U2"), (Axis::Yaw, "U3"), (Axis::Z, "U4")] {
        reasons.push((Trip::LimitCycle(axis), "limit cycle", Some(input)));
    }
    for (trip, word, place) in &reasons {
        let reason = trip.reason();
        assert!(reason.starts_with("AFBC off: ") && reason.contains(word), "{reason}");
        assert!(place.is_none_or(|place| reason.contains(place)), "{reason}");
        assert!(reason.len() <= 50 && reason.is_ascii(), "{reason}");
    }
    let words: BTreeSet<_> = reasons.iter().map(|(trip, ..)| trip.reason()).collect();
    assert_eq!(words.len(), reasons.len());
}
