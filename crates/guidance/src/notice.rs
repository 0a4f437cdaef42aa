//! Announcements of the guidance to pilot and ground station.

use crate::mode::FlightMode;
use core::fmt;

/// Cause of a failsafe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FailsafeCause {
    /// The flight core descends because the state is lost.
    Descent,
    /// Charge below the emergency threshold.
    BatteryEmergency,
    /// Charge below the critical threshold.
    BatteryCritical,
    /// Charge below the low threshold.
    BatteryLow,
    /// Outside the geofence, or about to leave it.
    Fence,
    /// A sensor has failed.
    Sensors,
    /// The controlling ground station is silent.
    Station,
    /// No fresh targets of the companion computer.
    Targets,
    /// No fresh sticks of the pilot.
    Sticks,
}

impl FailsafeCause {
    /// All causes. Among those with the same action, an earlier one has precedence.
    pub const ALL: [FailsafeCause; 9] = [
        FailsafeCause::Descent,
        FailsafeCause::BatteryEmergency,
        FailsafeCause::BatteryCritical,
        FailsafeCause::BatteryLow,
        FailsafeCause::Fence,
        FailsafeCause::Sensors,
        FailsafeCause::Station,
        FailsafeCause::Targets,
        FailsafeCause::Sticks,
    ];

    /// Returns the cause in words.
    pub const fn name(self) -> &'static str {
        match self {
            FailsafeCause::Descent => "state lost, descending",
            FailsafeCause::BatteryEmergency => "battery almost empty",
            FailsafeCause::BatteryCritical => "battery critical",
            FailsafeCause::BatteryLow => "battery low",
            FailsafeCause::Fence => "at the geofence",
            FailsafeCause::Sensors => "sensor fault",
            FailsafeCause::Station => "station lost",
            FailsafeCause::Targets => "no targets",
            FailsafeCause::Sticks => "no sticks",
        }
    }
}

/// Reason for a change of mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ModeReason {
    /// The mode was ordered.
    Ordered,
    /// The last mode has finished.
    Done,
    /// An item of the mission selects the mode.
    Mission,
    /// The mission was cleared.
    Cleared,
    /// The vehicle has not left the ground.
    NoLift,
    /// The vehicle was disarmed.
    Disarmed,
    /// The state is back after a loss, and the interrupted mode resumes.
    Back,
    /// A failsafe selects the mode.
    Failsafe(FailsafeCause),
}

impl ModeReason {
    /// Returns the reason in words.
    pub const fn name(self) -> &'static str {
        match self {
            ModeReason::Ordered => "ordered",
            ModeReason::Done => "done",
            ModeReason::Mission => "by the mission",
            ModeReason::Cleared => "the mission was cleared",
            ModeReason::NoLift => "take-off failed: still on the ground",
            ModeReason::Disarmed => "disarmed",
            ModeReason::Back => "the state estimate is back",
            ModeReason::Failsafe(cause) => cause.name(),
        }
    }
}

/// Urgency, with the numbers of MAVLink's `MAV_SEVERITY`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Needs action now.
    Critical = 2,
    /// Something has failed.
    Error = 3,
    /// Something may fail.
    Warning = 4,
    /// Unusual, but no error.
    Notice = 5,
    /// Normal operation.
    Info = 6,
}

/// An announcement. Its text by [`Display`](fmt::Display) has at most 50 characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum GuidanceNotice {
    /// The mode has changed.
    Mode(FlightMode, ModeReason),
    /// The failsafe checks have found a cause that does not change the mode.
    Found(FailsafeCause),
    /// A cause has ended.
    Over(FailsafeCause),
    /// The guidance disarms a vehicle on the ground.
    Disarms,
    /// A mission item lies outside the geofence or is not plausible.
    ItemRefused,
}

impl GuidanceNotice {
    /// Returns the announcement's urgency.
    pub const fn severity(self) -> Severity {
        match self {
            GuidanceNotice::Mode(_, ModeReason::Failsafe(cause)) | GuidanceNotice::Found(cause) => match cause {
                FailsafeCause::Descent | FailsafeCause::BatteryEmergency | FailsafeCause::BatteryCritical => {
                    Severity::Critical
                }
                FailsafeCause::Fence | FailsafeCause::Sensors | FailsafeCause::Station => Severity::Error,
                FailsafeCause::BatteryLow | FailsafeCause::Targets | FailsafeCause::Sticks => Severity::Warning,
            },
            GuidanceNotice::Mode(_, ModeReason::NoLift) => Severity::Error,
            GuidanceNotice::ItemRefused => Severity::Warning,
            GuidanceNotice::Disarms | GuidanceNotice::Over(_) => Severity::Notice,
            GuidanceNotice::Mode(..) => Severity::Info,
        }
    }
}

impl GuidanceNotice {
    /// Returns the text in parts, for callers that do not use `core::fmt`.
    pub const fn parts(self) -> [&'static str; 3] {
        match self {
            GuidanceNotice::Mode(mode, reason) => [mode.name(), ": ", reason.name()],
            GuidanceNotice::Found(cause) => [cause.name(), "", ""],
            GuidanceNotice::Over(cause) => ["cleared: ", cause.name(), ""],
            GuidanceNotice::Disarms => ["on the ground: disarming", "", ""],
            GuidanceNotice::ItemRefused => ["mission stopped: an item cannot be flown", "", ""],
        }
    }
}

impl fmt::Display for GuidanceNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.parts().into_iter().try_for_each(|part| f.write_str(part))
    }
}

/// Largest number of announcements in a tick.
pub const NOTICES_MAX: usize = 8;

/// The announcements of a tick, oldest first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GuidanceNotices([Option<GuidanceNotice>; NOTICES_MAX]);

impl GuidanceNotices {
    /// Adds an announcement; drops it if there are already [`NOTICES_MAX`].
    pub(crate) fn push(&mut self, notice: GuidanceNotice) {
        if let Some(place) = self.0.iter_mut().find(|place| place.is_none()) {
            *place = Some(notice);
        }
    }

    /// Returns the announcements, oldest first.
    pub fn iter(&self) -> impl Iterator<Item = GuidanceNotice> {
        self.0.iter().map_while(|notice| *notice)
    }
}
