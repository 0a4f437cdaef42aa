//! Named sets of gains and settings.

use crate::fuzzy::Membership;
use crate::{Settings, adaptive, backstepping};
use airframe::{Axis, PerAxis};

/// A named set of gains and settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// Section IV as printed, and for what it leaves open: a command filter of 40 rad/s and rotors without a limit.
    Paper,
}

impl Profile {
    /// Every profile.
    pub const ALL: [Profile; 1] = [Profile::Paper];

    /// Lower-case name, as in scenario files and logs.
    pub const fn name(self) -> &'static str {
        match self {
            Profile::Paper => "paper",
        }
    }

    /// Gains of AFBC; their `backstepping` part is the baseline's.
    pub fn gains(self) -> PerAxis<adaptive::Gains> {
        let Profile::Paper = self;
        PerAxis::from_fn(|axis| {
            let (alpha1, alpha2, gamma, eta) = match axis {
                Axis::Z => (3.0, 6.0, 2.8, 0.9),
                _ => (1.0, 2.0, 1.2, 0.3),
            };
            let membership = match axis {
                Axis::Roll | Axis::Pitch | Axis::Yaw => Membership { centre: 0.26, width: 0.1 },
                Axis::Z | Axis::X | Axis::Y => Membership { centre: 10.0, width: 4.0 },
            };
            let backstepping = backstepping::Gains { alpha1, alpha2 };
            adaptive::Gains { backstepping, gamma, eta, epsilon: 0.001, membership }
        })
    }

    /// Settings of the cascade.
    pub fn settings(self) -> Settings {
        let Profile::Paper = self;
        Settings { dt_s: 0.001, command_filter_rad_s: 40.0, rotor_force_max_n: 1e4 }
    }
}
