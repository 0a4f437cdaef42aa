//! The failsafe checks: they detect the causes of failsafes and select the action.
//!
//! The strongest action of all present causes is taken. Among causes with the same action, the first in the order of
//! [`FailsafeCause::ALL`] is reported.

use crate::actions::{BatteryAction, FenceAction, SensorsAction, StationAction, SticksAction, TargetsAction};
use crate::battery::{BatteryCells, BatteryReading};
use crate::fence::FenceStatus;
use crate::mode::FlightMode;
use crate::notice::{FailsafeCause, GuidanceNotice, GuidanceNotices};
use crate::table::FailsafeAction;
use afbc_types::{Range, parameters};
use nalgebra::Vector3;

/// Distance inside the geofence's boundary at which a breach ends \[m\].
const FENCE_MARGIN_M: f32 = 1.0;

parameters! {
    /// Parameters of the failsafes.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct FailsafeSettings {
        /// Largest horizontal distance from home; 0 for none.
        #[parameter(GF_MAX_HOR_DIST, "m", 0.0..=10000.0)]
        pub fence_radius_m: f32 = 0.0,
        /// Largest height above home; 0 for none.
        #[parameter(GF_MAX_VER_DIST, "m", 0.0..=10000.0)]
        pub fence_height_m: f32 = 0.0,
        /// Action when the vehicle is outside the geofence; `terminate` means land.
        #[choice(GF_ACTION)]
        pub fence_action: FenceAction = FenceAction::Hold,
        /// Time after which a silent station counts as lost.
        #[parameter(COM_DL_LOSS_T, "s", 1.0..=300.0)]
        pub station_lost_s: f32 = 10.0,
        /// Action when the station is lost.
        #[choice(NAV_DLL_ACT)]
        pub station_action: StationAction = StationAction::Return,
        /// Action in offboard mode when no fresh targets arrive.
        #[choice(COM_OBL_ACT)]
        pub targets_action: TargetsAction = TargetsAction::Hold,
        /// Action when no fresh stick input arrives in a mode that needs it.
        #[choice(NAV_RCL_ACT)]
        pub sticks_action: SticksAction = SticksAction::Hold,
        /// Action when a sensor fails.
        #[choice(COM_SENS_ACT)]
        pub sensors_action: SensorsAction = SensorsAction::Warn,
        /// Battery volts per volt at the board's pin; 0 or less uses the board's built-in divider.
        #[parameter(BAT1_V_DIV, "1", -1.0..=1000.0)]
        pub divider: f32 = -1.0,
        /// Battery amperes per volt at the board's pin; 0 or less uses the board's built-in amplifier.
        #[parameter(BAT1_A_PER_V, "A/V", -1.0..=10000.0)]
        pub current_a_v: f32 = -1.0,
        /// Number of the battery's cells; 0 uses the battery monitor's charge, or counts cells by the voltage while
        /// disarmed.
        #[parameter(BAT1_N_CELLS, "number", 0.0..=24.0)]
        pub cells: u32 = 0,
        /// Voltage of an empty cell without load.
        #[parameter(BAT1_V_EMPTY, "V", 1.0..=10.0)]
        pub empty_v: f32 = 3.6,
        /// Voltage of a full cell without load, above that of an empty cell.
        #[parameter(BAT1_V_CHARGED, "V", 1.0..=10.0)]
        pub full_v: f32 = 4.05,
        /// Resistance of a cell.
        #[parameter(BAT1_R_INTERNAL, "ohm", 0.0..=1.0)]
        pub resistance_ohm: f32 = 0.005,
        /// Charge below which the battery is announced as low.
        #[parameter(BAT_LOW_THR, "1", 0.0..=1.0)]
        pub low: f32 = 0.15,
        /// Charge below which the battery is critical; at most the charge of a low battery.
        #[parameter(BAT_CRIT_THR, "1", 0.0..=1.0)]
        pub critical: f32 = 0.07,
        /// Charge below which the battery is almost empty; at most the critical charge.
        #[parameter(BAT_EMERGEN_THR, "1", 0.0..=1.0)]
        pub emergency: f32 = 0.05,
        /// Action when the battery is critical; with `return-then-land`, the vehicle lands once the battery is almost
        /// empty.
        #[choice(COM_LOW_BAT_ACT)]
        pub battery_action: BatteryAction = BatteryAction::ReturnThenLand,
    }
    together(failsafe) {
        let most = |range: Range, most: f32| Range { max: most.into(), ..range };
        // The range of the voltage is a divisor and must not be zero.
        most(FailsafeSettings::BAT1_V_EMPTY.range, failsafe.full_v - 0.05).check(failsafe.empty_v)?;
        most(FailsafeSettings::BAT_CRIT_THR.range, failsafe.low).check(failsafe.critical)?;
        most(FailsafeSettings::BAT_EMERGEN_THR.range, failsafe.critical).check(failsafe.emergency)
    }
}

/// Sensors that have failed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FailedSensors {
    /// Gyroscope or accelerometer.
    pub inertial: bool,
    /// Barometer.
    pub barometer: bool,
    /// Magnetometer.
    pub magnetometer: bool,
    /// GNSS receiver.
    pub gnss: bool,
    /// External position tracker, such as motion capture.
    pub tracker: bool,
}

impl FailedSensors {
    /// True if any sensor has failed.
    pub const fn any(self) -> bool {
        self.inertial || self.barometer || self.magnetometer || self.gnss || self.tracker
    }
}

/// Inputs of the failsafe checks in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FailsafeInputs<'a> {
    pub(crate) mode: FlightMode,
    pub(crate) armed: bool,
    pub(crate) descends: bool,
    pub(crate) position_m: Option<Vector3<f32>>,
    pub(crate) home_m: Option<Vector3<f32>>,
    pub(crate) battery: Option<&'a BatteryReading>,
    pub(crate) sensors: FailedSensors,
    /// Time since the controlling ground station was last heard \[us\]; none if never.
    pub(crate) silent_us: Option<u32>,
    pub(crate) targets: bool,
    pub(crate) sticks: bool,
    /// State of the uploaded geofence.
    pub(crate) fence: FenceStatus,
    pub(crate) dt_s: f32,
}

/// Memory of the failsafe checks between ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FailsafeMemory {
    charge: Option<f32>,
    /// Number of cells found from the voltage; 0 without a battery.
    cells: u8,
    /// Causes present, one bit each.
    present: u16,
}

fn bit(cause: FailsafeCause) -> u16 {
    1 << cause as u16
}

impl FailsafeMemory {
    /// Returns the filtered charge of the battery, 0 to 1.
    pub(crate) fn charge(&self) -> Option<f32> {
        self.charge
    }

    /// True if the battery is monitored.
    pub(crate) fn is_watched(&self, failsafe: &FailsafeSettings) -> bool {
        failsafe.cells > 0 || self.charge.is_some()
    }

    /// True if the cause is present.
    pub(crate) fn is_present(&self, cause: FailsafeCause) -> bool {
        self.present & bit(cause) != 0
    }

    /// Runs all checks. Returns the strongest action, its cause, and the set of new causes.
    pub(crate) fn update(
        &mut self,
        failsafe: &FailsafeSettings,
        seen: &FailsafeInputs<'_>,
        notices: &mut GuidanceNotices,
    ) -> (FailsafeAction, FailsafeCause, u16) {
        if !seen.armed {
            // The count never falls while a battery is connected: an empty battery of six cells must not count as a
            // full one of five.
            let cells = seen.battery.map_or(0, BatteryReading::cells);
            self.cells = if cells == 0 { 0 } else { self.cells.max(cells) };
            if cells == 0 {
                self.charge = None;
            }
        }
        // A configured number of cells has precedence, then the monitor's charge, then the number found.
        let number = match seen.battery {
            _ if failsafe.cells > 0 => failsafe.cells,
            Some(BatteryReading { charge: Some(_), .. }) => 0,
            _ => self.cells.into(),
        };
        let cells = BatteryCells {
            number,
            empty_v: failsafe.empty_v,
            full_v: failsafe.full_v,
            resistance_ohm: failsafe.resistance_ohm,
        };
        cells.update(&mut self.charge, seen.battery, seen.dt_s);
        let before = self.present;
        self.present = 0;
        let mut note = |cause: FailsafeCause, holds: bool| self.present |= if holds { bit(cause) } else { 0 };
        note(FailsafeCause::Descent, seen.armed && seen.descends);
        // A low battery stays low in flight, even if its voltage recovers.
        let below = |threshold: f32| self.charge.is_some_and(|charge| charge < threshold);
        let was = |cause: FailsafeCause| seen.armed && before & bit(cause) != 0;
        note(FailsafeCause::BatteryEmergency, below(failsafe.emergency) || was(FailsafeCause::BatteryEmergency));
        note(FailsafeCause::BatteryCritical, below(failsafe.critical) || was(FailsafeCause::BatteryCritical));
        note(FailsafeCause::BatteryLow, below(failsafe.low) || was(FailsafeCause::BatteryLow));
        let FenceStatus { leaves, outside } = seen.fence;
        note(
            FailsafeCause::Fence,
            seen.armed && (leaves || outside || failsafe.is_outside(seen, was(FailsafeCause::Fence))),
        );
        note(FailsafeCause::Sensors, seen.sensors.any());
        let lost = |silent_us: u32| silent_us as f32 * 1e-6 > failsafe.station_lost_s;
        note(FailsafeCause::Station, seen.armed && seen.silent_us.is_some_and(lost));
        note(FailsafeCause::Targets, seen.armed && seen.mode == FlightMode::Offboard && !seen.targets);
        note(FailsafeCause::Sticks, seen.armed && seen.mode.is_manual() && !seen.sticks);
        let new = self.present & !before;
        let over = before & !self.present;
        if over != 0 && seen.armed {
            // Low batteries do not recover. Targets and sticks are not checked once the mode has changed.
            for cause in [FailsafeCause::Descent, FailsafeCause::Fence, FailsafeCause::Sensors, FailsafeCause::Station]
            {
                if over & bit(cause) != 0 {
                    notices.push(GuidanceNotice::Over(cause));
                }
            }
        }
        if self.present == 0 {
            return (FailsafeAction::None, FailsafeCause::Descent, 0);
        }
        let (action, cause) = self.strongest(failsafe, seen.position_m.is_some());
        (if seen.armed { action } else { FailsafeAction::None }, cause, new)
    }

    /// Returns the strongest action with its cause. `positioned`: the position is known, so a descent of the flight
    /// core demands nothing, and orders count.
    fn strongest(&self, failsafe: &FailsafeSettings, positioned: bool) -> (FailsafeAction, FailsafeCause) {
        let counts =
            |cause: &FailsafeCause| self.is_present(*cause) && !(positioned && *cause == FailsafeCause::Descent);
        let found = FailsafeCause::ALL.into_iter().filter(counts);
        found.fold((FailsafeAction::None, FailsafeCause::Descent), |(strongest, of), cause| {
            let action = failsafe.action(cause);
            if action > strongest { (action, cause) } else { (strongest, of) }
        })
    }
}

/// True if `cause` is in the set `new`.
pub(crate) fn is_new(new: u16, cause: FailsafeCause) -> bool {
    new & bit(cause) != 0
}

/// Announces the causes in the set `new` that have an action, except `but`.
pub(crate) fn announce(
    failsafe: &FailsafeSettings,
    new: u16,
    but: Option<FailsafeCause>,
    notices: &mut GuidanceNotices,
) {
    for cause in FailsafeCause::ALL {
        if new & bit(cause) != 0 && Some(cause) != but && failsafe.action(cause) > FailsafeAction::None {
            notices.push(GuidanceNotice::Found(cause));
        }
    }
}

impl FailsafeSettings {
    /// Returns the action configured for a cause.
    pub fn action(&self, cause: FailsafeCause) -> FailsafeAction {
        match cause {
            FailsafeCause::Descent => FailsafeAction::Land,
            FailsafeCause::BatteryLow => FailsafeAction::Warn,
            FailsafeCause::BatteryEmergency if self.battery_action == BatteryAction::ReturnThenLand => {
                FailsafeAction::Land
            }
            FailsafeCause::BatteryCritical | FailsafeCause::BatteryEmergency => self.battery_action.action(),
            FailsafeCause::Fence => self.fence_action.action(),
            FailsafeCause::Sensors => self.sensors_action.action(),
            FailsafeCause::Station => self.station_action.action(),
            FailsafeCause::Targets => self.targets_action.action(),
            FailsafeCause::Sticks => self.sticks_action.action(),
        }
    }

    /// True if the vehicle is outside the geofence. If it `was`, it must come back inside by a margin.
    fn is_outside(&self, seen: &FailsafeInputs<'_>, was: bool) -> bool {
        // Without a position, keep the last result.
        let (Some(position_m), Some(home_m)) = (seen.position_m, seen.home_m) else { return was };
        let margin = if was { FENCE_MARGIN_M } else { 0.0 };
        !self.encloses(&home_m, &position_m, margin)
    }

    /// Returns the height above home up to which a vehicle is well inside the geofence; infinite without a limit \[m\].
    pub(crate) fn ceiling_m(&self) -> f32 {
        if self.fence_height_m > 0.0 { inner(self.fence_height_m, FENCE_MARGIN_M) } else { f32::INFINITY }
    }

    /// True if a place lies inside the geofence. Each dimension of the fence is reduced by `margin_m`, but at most to
    /// half.
    pub(crate) fn encloses(&self, home_m: &Vector3<f32>, place_m: &Vector3<f32>, margin_m: f32) -> bool {
        let off_m = place_m - home_m;
        let (radius_m, height_m) = (inner(self.fence_radius_m, margin_m), inner(self.fence_height_m, margin_m));
        let beyond_radius = self.fence_radius_m > 0.0 && off_m.xy().norm_squared() > radius_m * radius_m;
        let beyond_height = self.fence_height_m > 0.0 && off_m.z > height_m;
        !(beyond_radius || beyond_height)
    }
}

/// Returns the size of a fence less a margin, but at least half the size.
fn inner(size_m: f32, margin_m: f32) -> f32 {
    if size_m > 2.0 * margin_m { size_m - margin_m } else { 0.5 * size_m }
}

#[cfg(test)]
mod tests;
