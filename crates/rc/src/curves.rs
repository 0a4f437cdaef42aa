//! Stick curves with PX4's names and formulae: from a stick's deflection to the commanded share.

use afbc_guidance::{FlightMode, Sticks};
use afbc_types::parameters;

parameters! {
    /// Curves of the sticks. Altitude and position mode have a dead zone and an expo, acro mode an expo and a super
    /// expo; stabilised mode is linear, and so are roll and pitch in altitude mode and the throttle in acro mode.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct StickCurves {
        /// Roll and pitch in position mode: 0 linear, 1 cubic.
        #[parameter(MPC_XY_MAN_EXPO, "1", 0.0..=1.0)]
        pub horizontal_expo: f32 = 0.6,
        /// Throttle in altitude and position mode: 0 linear, 1 cubic.
        #[parameter(MPC_Z_MAN_EXPO, "1", 0.0..=1.0)]
        pub vertical_expo: f32 = 0.6,
        /// Yaw in altitude and position mode: 0 linear, 1 cubic.
        #[parameter(MPC_YAW_EXPO, "1", 0.0..=1.0)]
        pub yaw_expo: f32 = 0.6,
        /// Dead zone around the centre of the sticks in altitude and position mode, as a share of full deflection.
        #[parameter(MPC_HOLD_DZ, "1", 0.0..=1.0)]
        pub dead_zone: f32 = 0.1,
        /// Roll and pitch in acro mode: 0 linear, 1 cubic.
        #[parameter(MC_ACRO_EXPO, "1", 0.0..=1.0)]
        pub acro_expo: f32 = 0.0,
        /// Yaw in acro mode: 0 linear, 1 cubic.
        #[parameter(MC_ACRO_EXPO_Y, "1", 0.0..=1.0)]
        pub acro_yaw_expo: f32 = 0.0,
        /// Super expo of roll and pitch in acro mode: reduces the rate below full deflection.
        #[parameter(MC_ACRO_SUPEXPO, "1", 0.0..=0.95)]
        pub acro_super_expo: f32 = 0.0,
        /// Super expo of yaw in acro mode.
        #[parameter(MC_ACRO_SUPEXPOY, "1", 0.0..=0.95)]
        pub acro_yaw_super_expo: f32 = 0.0,
    }
}

impl StickCurves {
    /// Returns the command, -1 to 1, for stick deflections, -1 to 1, in a mode. Modes that do not use sticks leave them
    /// unchanged.
    #[must_use]
    pub fn shape(&self, mode: FlightMode, sticks: &Sticks) -> Sticks {
        let Sticks { roll, pitch, throttle, yaw } = *sticks;
        let held = |stick, expo| expo_dead_zone(stick, expo, self.dead_zone);
        let lean = |stick| held(stick, self.horizontal_expo);
        let (climb, turn) = (held(throttle, self.vertical_expo), held(yaw, self.yaw_expo));
        match mode {
            FlightMode::Position => Sticks { roll: lean(roll), pitch: lean(pitch), throttle: climb, yaw: turn },
            FlightMode::Altitude => Sticks { throttle: climb, yaw: turn, ..*sticks },
            FlightMode::Acro => {
                let rate = |stick| super_expo(stick, self.acro_expo, self.acro_super_expo);
                let yaw = super_expo(yaw, self.acro_yaw_expo, self.acro_yaw_super_expo);
                Sticks { roll: rate(roll), pitch: rate(pitch), throttle, yaw }
            }
            _ => *sticks,
        }
    }
}

/// Mixes a linear and a cubic curve; `expo` is the cubic share.
fn expo(stick: f32, expo: f32) -> f32 {
    (1.0 - expo) * stick + expo * stick * stick * stick
}

/// Applies [`expo`] to the deflection beyond `dead_zone`.
fn expo_dead_zone(stick: f32, share: f32, dead_zone: f32) -> f32 {
    // Leaves some travel outside the dead zone, as PX4 does.
    let dead_zone = dead_zone.min(0.99);
    let beyond = (stick.abs() - dead_zone).max(0.0);
    expo((beyond / (1.0 - dead_zone)).min(1.0), share).copysign(stick)
}

/// Applies [`expo`] and a further bend that holds the command back until the end of the travel.
fn super_expo(stick: f32, share: f32, bend: f32) -> f32 {
    expo(stick, share) * (1.0 - bend) / (1.0 - stick.abs() * bend)
}

#[cfg(test)]
mod tests;
