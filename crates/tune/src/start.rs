//! Starting points of the search: hand-tuned gains, so that the same command always finds the same gains.

use crate::builder::is_paper;
use afbc::disturbance::DisturbanceObserver;
use afbc::reference::ReferenceModel;
use afbc::{Profile, Settings};
use afbc_control::Smoothing;
use afbc_scenario::contender::{Contender, ControllerKind, Law};
use afbc_vehicles::Vehicle;

/// Returns the law of this kind with hand-tuned gains, the limits of the profile `flight` and a hand-tuned cascade.
/// AFBC is under its monitor, as on board.
pub fn by_hand(kind: ControllerKind) -> Contender {
    let contender = Contender { law: Law::by_hand(kind), ..Contender::of(kind, Profile::Flight) };
    let reference = ReferenceModel {
        reference_xy_rad_s: 5.0,
        reference_z_rad_s: 6.5,
        reference_yaw_rad_s: 17.0,
        reference_turn_rad_s2: 15.0,
        ..contender.settings.reference
    };
    let disturbance = DisturbanceObserver { disturbance_rad_s: 10.0, ..contender.settings.disturbance };
    let smoothing = Smoothing::BY_HAND;
    let settings = Settings { command_filter_rad_s: 75.0, disturbance, reference, smoothing, ..contender.settings };
    Contender { settings, ..contender }.monitored()
}

/// Returns the hand-tuned contender on `vehicle`, scaled [by rule](Contender::by_rule).
pub fn by_hand_on(kind: ControllerKind, vehicle: &Vehicle) -> Contender {
    if is_paper(vehicle) { by_hand(kind) } else { by_hand(kind).by_rule(vehicle) }
}
