//! Extracts the figures that the log needs from the vehicle's configuration.

use afbc_flight_core::numbering::{ARDUPILOT, rotors_of_outputs};
use afbc_onboard::Configuration;

/// Number of motors in a message.
pub(crate) const MOTORS: usize = 12;

/// Constants of a vehicle.
#[derive(Clone, Debug)]
pub(crate) struct Known {
    /// Index of the rotor that is each of PX4's motors; beyond the last rotor if there is no such motor.
    pub(crate) rotor_of_motor: [usize; MOTORS],
    /// Number of rotors.
    pub(crate) rotors: usize,
    /// b / F_max: share of a rotor's largest force per squared speed \[s2/rad2\].
    pub(crate) share_per_speed_squared: f32,
    /// Largest force of all rotors together \[N\].
    pub(crate) thrust_max_n: f32,
    /// MAVLink system id of the vehicle.
    pub(crate) system: u8,
}

impl Known {
    pub(crate) fn of(configuration: &Configuration) -> Self {
        let Configuration { parameters, rotors, settings, link, .. } = configuration;
        let force_max_n = settings.common.rotor_force_max_n;
        Known {
            rotor_of_motor: rotors_of_outputs(ARDUPILOT, rotors),
            rotors: rotors.count(),
            share_per_speed_squared: parameters.thrust_factor_n_s2 / force_max_n,
            thrust_max_n: force_max_n * rotors.count() as f32,
            system: u8::try_from(link.system).unwrap_or(1),
        }
    }
}
