//! Where a search begins: gains by hand, so that the same command finds the same gains again once they are the defaults.

use afbc::{Profile, adaptive};
use afbc_peers::{geometric, indi, pid};
use afbc_sim::contender::{Contender, ControllerKind, Law, backstepping_part};
use afbc_types::{Axis, PerAxis};

/// Of the command filter, for AFBC and backstepping \[rad/s\].
const FILTER_RAD_S: f32 = 40.0;

/// The law of this kind with gains by hand, in the settings of the profile `flight`; AFBC under its monitor, as on board.
pub fn by_hand(kind: ControllerKind) -> Contender {
    let afbc = PerAxis::from_fn(afbc_gains);
    let law = match kind {
        ControllerKind::Afbc => Law::Guarded(afbc),
        ControllerKind::Backstepping => Law::Backstepping(backstepping_part(&afbc)),
        ControllerKind::Pid => Law::Pid(pid::Gains::PAPER_VEHICLE),
        ControllerKind::Geometric => Law::Geometric(geometric::Gains::GOODARZI_2013),
        ControllerKind::Indi => Law::Indi(indi::Gains::PAPER_VEHICLE),
    };
    let mut contender = Contender { law, ..Contender::of(kind, Profile::Flight) };
    contender.settings.command_filter_rad_s = FILTER_RAD_S;
    contender
}

fn afbc_gains(axis: Axis) -> adaptive::Gains {
    let (alpha1, alpha2, gamma, eta, delta_max) = match axis {
        Axis::Roll | Axis::Pitch => (10.0, 0.7, 4.0, 0.3, 0.05),
        Axis::Yaw => (3.0, 12.0, 20.0, 0.3, 0.5),
        Axis::Z => (4.0, 8.0, 30.0, 0.9, 1.0),
        Axis::X | Axis::Y => (3.0, 6.0, 40.0, 0.3, 0.5),
    };
    let mut gains = Profile::Flight.gains()[axis];
    gains.backstepping.alpha1 = alpha1;
    gains.backstepping.alpha2 = alpha2;
    gains.gamma = gamma;
    gains.eta = eta;
    gains.epsilon = Profile::flight_epsilon(axis, delta_max);
    gains.safeguards.delta_max = delta_max;
    gains
}
