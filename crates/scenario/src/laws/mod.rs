//! The only list of control laws.

mod controllers;
mod declare;
mod gains;
mod own;
#[cfg(test)]
mod tests;

pub(crate) use gains::{law_gains, per_axis, whole};
pub use own::{OWN_GAINS_MAX, OwnController, OwnFlight, OwnGain, OwnGains, OwnKind, OwnLaw, OwnMemory, OwnVehicle};

use afbc::{Adaptive, Backstepping, Controller, Guarded, Profile, Safeguards, adaptive, backstepping};
use afbc_control::{Action, FlightController, Mixer, Smoothing, Trace};
use afbc_files::read::words::nearest;
use afbc_laws::{Dfbc, Geometric, Indi, L1, Mpc, Pid, dfbc, geometric, indi, l1, mpc, pid};
use afbc_types::{Axis, PerAxis, Setpoint, State};

declare::laws! {
    /// Adaptive fuzzy backstepping (20)-(22).
    Afbc {
        name: "afbc",
        title: "AFBC",
        prefix: "A_",
        in_cascade: true,
        gains: PerAxis<adaptive::Gains>,
        tuned: |afbc| *afbc,
        by_hand: by_hand(),
        controller: Controller<Adaptive, N>, |vehicle, settings, gains| {
            Controller::new(vehicle, settings, Adaptive::new(gains)?)
        },
    }
    /// Classical backstepping (16), (21).
    Backstepping {
        name: "backstepping",
        title: "backstepping",
        prefix: "B_",
        in_cascade: true,
        gains: PerAxis<backstepping::Gains>,
        tuned: |afbc| afbc.map(|gains| gains.backstepping),
        by_hand: by_hand().map(|gains| gains.backstepping),
        controller: Controller<Backstepping, N>, |vehicle, settings, gains| {
            Controller::new(vehicle, settings, Backstepping::new(&vehicle.parameters, gains)?)
        },
    }
    /// Cascaded PID, as in autopilots.
    Pid {
        name: "pid",
        title: "PID",
        prefix: "PID_",
        in_cascade: false,
        gains: pid::Gains,
        tuned: |_| pid::Gains::TUNED,
        by_hand: pid::Gains { smoothing: Smoothing::BY_HAND, ..pid::Gains::PAPER_VEHICLE },
        controller: Pid<N>, |vehicle, settings, gains| Pid::new(vehicle, settings.common, gains),
    }
    /// Geometric tracking on SE(3) with integral terms.
    Geometric {
        name: "geometric",
        title: "geometric",
        prefix: "GEO_",
        in_cascade: false,
        gains: geometric::Gains,
        tuned: |_| geometric::Gains::TUNED,
        by_hand: geometric::Gains { smoothing: Smoothing::BY_HAND, ..geometric::Gains::GOODARZI_2013 },
        controller: Geometric<N>, |vehicle, settings, gains| Geometric::new(vehicle, settings.common, gains),
    }
    /// Incremental nonlinear dynamic inversion.
    Indi {
        name: "indi",
        title: "INDI",
        prefix: "INDI_",
        in_cascade: false,
        gains: indi::Gains,
        tuned: |_| indi::Gains::TUNED,
        by_hand: indi::Gains { smoothing: Smoothing::BY_HAND, ..indi::Gains::PAPER_VEHICLE },
        controller: Indi<N>, |vehicle, settings, gains| Indi::new(vehicle, settings.common, gains),
    }
    /// Geometric tracking with L1-adaptive compensation of thrust and moments.
    L1 {
        name: "l1",
        title: "L1",
        prefix: "L1_",
        in_cascade: false,
        gains: l1::Gains,
        tuned: |_| l1::Gains::TUNED,
        by_hand: l1::Gains {
            geometric: geometric::Gains { smoothing: Smoothing::BY_HAND, ..l1::Gains::BY_HAND.geometric },
            ..l1::Gains::BY_HAND
        },
        controller: L1<N>, |vehicle, settings, gains| L1::new(vehicle, settings.common, gains),
    }
    /// Differential-flatness-based control with incremental inversion of the moments.
    Dfbc {
        name: "dfbc",
        title: "DFBC",
        prefix: "DFBC_",
        in_cascade: false,
        gains: dfbc::Gains,
        tuned: |_| dfbc::Gains::TUNED,
        by_hand: dfbc::Gains { smoothing: Smoothing::BY_HAND, ..dfbc::Gains::PAPER_VEHICLE },
        controller: Dfbc<N>, |vehicle, settings, gains| Dfbc::new(vehicle, settings.common, gains),
    }
    /// Linear model-predictive control of the position, incremental inversion of the moments.
    Mpc {
        name: "mpc",
        title: "MPC",
        prefix: "LMPC_",
        in_cascade: false,
        gains: mpc::Gains,
        tuned: |_| mpc::Gains::TUNED,
        by_hand: mpc::Gains { smoothing: Smoothing::BY_HAND, ..mpc::Gains::PAPER_VEHICLE },
        controller: Mpc<N>, |vehicle, settings, gains| Mpc::new(vehicle, settings.common, gains),
    }
}

impl OwnLaw {
    /// Registers the law, so that it can fly. It replaces a registered law of the same name.
    ///
    /// # Errors
    /// One line on a name that is invalid or a built-in law's, or on a gain that is out of its range.
    pub fn register(self) -> Result<ControllerKind, String> {
        self.keep(&ControllerKind::ALL.map(ControllerKind::name)).map(ControllerKind::Own)
    }
}

impl ControllerKind {
    /// Returns every law that can fly: those of the list, then the registered ones.
    pub fn all() -> Vec<ControllerKind> {
        ControllerKind::ALL.into_iter().chain(OwnKind::all().into_iter().map(ControllerKind::Own)).collect()
    }

    /// Returns the law called `name`.
    pub fn named(name: &str) -> Option<ControllerKind> {
        ControllerKind::all().into_iter().find(|kind| kind.name() == name)
    }

    /// Returns the names of every law, for a message: `afbc, backstepping, pid`.
    pub fn names() -> String {
        let names: Vec<_> = ControllerKind::all().into_iter().map(ControllerKind::name).collect();
        names.join(", ")
    }

    /// Returns a cure for an unknown `name`, for a message: the most similar law's name, or all names.
    pub fn cure(name: &str) -> String {
        match nearest(name, ControllerKind::all().into_iter().map(ControllerKind::name)) {
            Some(similar) => format!("did you mean {similar}?"),
            None => format!("the laws are {}", ControllerKind::names()),
        }
    }

    /// The two laws that the paper compares.
    pub const PAPER: [ControllerKind; 2] = [ControllerKind::Afbc, ControllerKind::Backstepping];
}

/// Returns the gains from which AFBC's search starts, for the settings of the profile `flight`. They are the rounded
/// result of an earlier search.
fn by_hand() -> PerAxis<adaptive::Gains> {
    PerAxis::from_fn(|axis| {
        let (alpha1, alpha2, stiffness, gamma, eta, delta_max) = match axis {
            Axis::Roll | Axis::Pitch => (1.2, 0.6, 86.0, 0.3, 0.06, 0.028),
            Axis::Yaw => (4.0, 7.5, 30.0, 42.0, 0.01, 0.33),
            Axis::Z => (1.7, 9.5, 3.6, 180.0, 2.3, 2.9),
            Axis::X | Axis::Y => (11.0, 2.0, 2.1, 26.0, 0.035, 0.75),
        };
        let gains = Profile::Flight.gains()[axis];
        adaptive::Gains {
            backstepping: backstepping::Gains { alpha1, alpha2, stiffness },
            gamma,
            eta,
            epsilon: Profile::flight_epsilon(axis, delta_max),
            safeguards: Safeguards { delta_max, ..gains.safeguards },
            ..gains
        }
    })
}
