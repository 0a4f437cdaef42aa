//! Named sets of gains and settings.

use crate::disturbance::DisturbanceObserver;
use crate::fuzzy::Membership;
use crate::model::ModelConstants;
use crate::reference::ReferenceModel;
use crate::{PositionControlLimits, Safeguards, Settings, adaptive, backstepping};
use afbc_control::drag::KnownDrag;
use afbc_control::{Smoothing, math};
use afbc_types::{Axis, Parameters, PerAxis};

/// A named set of gains and settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Profile {
    /// Section IV as printed. Values that it lacks: a command filter of 40 rad/s and unlimited rotors.
    Paper,
    /// AFBC for real rotors: bounded estimates, a robust term without limit cycle, limits on the demands. For the
    /// paper's vehicle with rotors that lag by 20 ms and give 3 N each. Not in the paper: `docs/flight.md`.
    Flight,
}

impl Profile {
    /// Every profile.
    pub const ALL: [Profile; 2] = [Profile::Paper, Profile::Flight];

    /// Returns the lower-case name used in scenario files and logs.
    pub const fn name(self) -> &'static str {
        match self {
            Profile::Paper => "paper",
            Profile::Flight => "flight",
        }
    }

    /// Returns AFBC's gains for a vehicle with these nominal parameters (which must be valid) and a rotor lag of
    /// `lag_s`: [`Profile::gains`] [by rule](by_rule). The profile `paper` ignores the lag. Not in the paper.
    pub fn gains_for(self, vehicle: &Parameters, lag_s: f32) -> PerAxis<adaptive::Gains> {
        let lag_s = if self == Profile::Paper { LAG_S } else { lag_s };
        by_rule(&self.gains(), vehicle, lag_s)
    }

    /// Returns the cascade's settings for rotors that give `force_max_n` each and lag by `lag_s`. In the profile
    /// `flight` they slow down with the gains: [`Settings::slowed`].
    pub fn settings_for(self, force_max_n: f32, lag_s: f32) -> Settings {
        let settings = self.settings();
        match self {
            Profile::Paper => settings,
            Profile::Flight => settings.slowed(slowness(lag_s), lag_s).with_rotor_force_max_n(force_max_n),
        }
    }

    /// Returns AFBC's gains for the paper's vehicle. The baseline uses their `backstepping` part.
    pub fn gains(self) -> PerAxis<adaptive::Gains> {
        PerAxis::from_fn(|axis| {
            let (alpha1, alpha2) = match axis {
                Axis::Z => (3.0, 6.0),
                _ => (1.0, 2.0),
            };
            let membership = match axis {
                Axis::Roll | Axis::Pitch | Axis::Yaw => Membership { centre: 0.26, width: 0.1 },
                Axis::Z | Axis::X | Axis::Y => Membership { centre: 10.0, width: 4.0 },
            };
            let paper = adaptive::Gains {
                backstepping: backstepping::Gains { alpha1, alpha2, ..backstepping::Gains::DEFAULT },
                gamma: if axis == Axis::Z { 2.8 } else { 1.2 },
                eta: if axis == Axis::Z { 0.9 } else { 0.3 },
                epsilon: 0.001,
                membership,
                safeguards: Safeguards::NONE,
            };
            match self {
                Profile::Paper => paper,
                Profile::Flight => flight(axis, paper),
            }
        })
    }

    /// Returns epsilon of the profile `flight` for a subsystem with delta_hat up to `delta_max`.
    ///
    /// Near zero the robust term has the gain delta_hat/epsilon. This rule keeps that gain times g of the paper's
    /// vehicle below half of the limit for the subsystem's response time (`docs/flight.md`).
    pub fn flight_epsilon(axis: Axis, delta_max: f32) -> f32 {
        2.0 * ModelConstants::new(&Parameters::PAPER.to_f32()).hover_gain(axis) * answer_s(axis) * delta_max
    }

    /// Returns the settings of the cascade.
    pub const fn settings(self) -> Settings {
        match self {
            Profile::Paper => Settings::DEFAULT,
            Profile::Flight => Settings {
                common: afbc_control::Settings {
                    dt_s: 0.001,
                    rotor_force_max_n: 3.0,
                    // Without a bound, a limit cycle of roll and pitch raises the thrust, z asks for less, and (40)
                    // tilts more.
                    raised_thrust_max: 0.8,
                    drag: KnownDrag::NONE,
                },
                limits: PositionControlLimits {
                    // At 0.7 rad and 9 m/s2, gusts of the campaign `robustness` push harder than the vehicle may lean.
                    tilt_max_rad: 1.0,
                    tilt_rate_max_rad_s: 6.0,
                    acceleration_max_m_s2: 16.0,
                    speed_max_m_s: 5.0,
                    climb_max_m_s: 3.0,
                },
                command_filter_rad_s: 65.69,
                // A faster pulse asks more of the rotors than they can give, because of the filters' lead.
                forward_rad_s: 12.0,
                tilt_by_thrust: true,
                anti_windup: true,
                freeze_on_ground: true,
                bumpless: true,
                feed_forward: true,
                by_rotation: true,
                disturbance: DisturbanceObserver {
                    disturbance_rad_s: 39.49,
                    disturbance_z_rad_s: 40.0,
                    // This value is chosen by hand. The search finds 80, which tolerates fewer states per second.
                    disturbance_tilt_rad_s: 60.0,
                    disturbance_yaw_rad_s: 31.39,
                    // The memory is chosen by hand, because no training flight needs it.
                    memory_1_s: 2.0,
                    memory_speed_m_s: 4.0,
                    disturbance_lag_s: LAG_S,
                },
                reference: ReferenceModel {
                    reference_xy_rad_s: 4.398,
                    reference_z_rad_s: 11.7,
                    reference_yaw_rad_s: 19.76,
                    reference_acceleration_m_s2: 8.0,
                    reference_turn_rad_s2: 10.1,
                    reference_yaw_rate_rad_s: 3.0,
                },
                smoothing: Smoothing {
                    smooth_tilt_rad_s: 156.7,
                    smooth_yaw_rad_s: 228.1,
                    smooth_lift_rad_s: 80.0,
                    lead_s: 0.02292,
                },
            },
        }
    }
}

/// Rotor lag for which the profile `flight` is tuned \[s\].
pub const LAG_S: f32 = 0.02;

/// Loop delay on the paper's vehicle apart from the rotor lag \[s\]: a step, the input filters, and states up to 20 ms
/// old.
const REST_S: f32 = 0.03;

/// Response time of a subsystem on the paper's vehicle \[s\]: step, rotor lag and states that are 20 ms old; plus the
/// input filters for roll and pitch; plus the attitude loop for x and y.
const fn answer_s(axis: Axis) -> f32 {
    match axis {
        Axis::Yaw | Axis::Z => 0.041,
        Axis::Roll | Axis::Pitch => 0.08,
        Axis::X | Axis::Y => 0.12,
    }
}

/// Scales gains for the paper's vehicle with a rotor lag of [`LAG_S`] so that a vehicle with these nominal parameters
/// (which must be valid) and a lag of `lag_s` behaves the same. Not in the paper.
///
/// * **Mass and inertia**: alpha_2, gamma, eta, Theta_max and delta_max are multiplied by the ratio of the paper's g_i
///   (6) in hover to this vehicle's: by mass for z, by inertia over arm for roll and pitch, by inertia over d/b for
///   yaw. alpha_1, epsilon, the leakage and the membership functions are in rad and m, and are not scaled.
/// * **Rotor lag**: see [`slowness`] and [`adaptive::Gains::slowed`].
pub fn by_rule(gains: &PerAxis<adaptive::Gains>, vehicle: &Parameters, lag_s: f32) -> PerAxis<adaptive::Gains> {
    let (paper, own) = (ModelConstants::new(&Parameters::PAPER.to_f32()), ModelConstants::new(vehicle));
    let scale = |axis| paper.hover_gain(axis) / own.hover_gain(axis);
    PerAxis::from_fn(|axis| gains[axis].scaled(scale(axis)).slowed(slowness(lag_s)))
}

/// Returns the factor by which a vehicle with a rotor lag of `lag_s` \[s\] is slower than the paper's. At least 1,
/// because faster rotors change neither noise nor command filter. Not in the paper.
pub fn slowness(lag_s: f32) -> f32 {
    math::max((lag_s + REST_S) / (LAG_S + REST_S), 1.0)
}

/// Returns the gains of the profile `flight`, as found by `sitl tune afbc`. `docs/flight.md` explains each.
fn flight(axis: Axis, paper: adaptive::Gains) -> adaptive::Gains {
    let (alpha1, alpha2, stiffness, gamma, eta, theta_max, delta_max) = match axis {
        Axis::Roll | Axis::Pitch => (2.792, 0.3081, 95.92, 0.6876, 0.5622, 4.0, 0.003794),
        Axis::Yaw => (2.334, 6.326, 8.959, 37.43, 0.01825, 12.0, 0.2665),
        Axis::Z => (2.467, 9.638, 11.81, 83.65, 0.1351, 10.0, 7.364),
        // These gains are chosen by hand. They are stiffer and learn more slowly than the gains of the search, so that
        // an error of the estimated velocity matters less.
        Axis::X | Axis::Y => (1.0, 4.2, 18.0, 6.0, 0.07809, 25.0, 1.267),
    };
    let membership = match axis {
        // The paper's Gaussians are narrow in rad/s: between rules u_a acts as a rate gain, and chatters because of the
        // delay.
        Axis::Roll | Axis::Pitch | Axis::Yaw => Membership { centre: 3.0, width: 1.2 },
        Axis::Z | Axis::X | Axis::Y => paper.membership,
    };
    let epsilon = Profile::flight_epsilon(axis, delta_max);
    let safeguards = Safeguards { sigma: 0.01, theta_max, delta_max };
    let backstepping = backstepping::Gains { alpha1, alpha2, stiffness };
    adaptive::Gains { backstepping, gamma, eta, epsilon, membership, safeguards }
}
