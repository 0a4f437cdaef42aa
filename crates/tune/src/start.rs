//! Starting points of the search: hand-tuned gains, so that the same command finds the same gains again.

use afbc::Profile;
use afbc_sim::contender::{Contender, ControllerKind, Law};

/// Command filter of AFBC and backstepping \[rad/s\].
const FILTER_RAD_S: f32 = 40.0;

/// Returns the law of this kind with hand-tuned gains and the settings of the profile `flight`; AFBC under its monitor,
/// as on board.
pub fn by_hand(kind: ControllerKind) -> Contender {
    let mut contender = Contender { law: Law::by_hand(kind), ..Contender::of(kind, Profile::Flight) };
    contender.settings.command_filter_rad_s = FILTER_RAD_S;
    contender.monitored()
}
