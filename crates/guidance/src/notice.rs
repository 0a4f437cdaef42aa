//! Announcements of the guidance to pilot and ground station.

use crate::mode::FlightMode;
use core::fmt;

/// Cause of a failsafe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Cause {
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

impl Cause {
    /// All causes. Among those with the same action, an earlier one has precedence.
    pub const ALL: [Cause; 9] = [
        Cause::Descent,
        Cause::BatteryEmergency,
        Cause::BatteryCritical,
        Cause::BatteryLow,
        Cause::Fence,
        Cause::Sensors,
        Cause::Station,
        Cause::Targets,
        Cause::Sticks,
    ];

    /// Returns the cause in words.
    pub const fn name(self) -> &'static str {
        match self {
            Cause::Descent => "no state, flight core descends",
            Cause::BatteryEmergency => "battery almost empty",
            Cause::BatteryCritical => "battery critical",
            Cause::BatteryLow => "battery low",
            Cause::Fence => "at the geofence",
            Cause::Sensors => "sensor fault",
            Cause::Station => "station lost",
            Cause::Targets => "no targets",
            Cause::Sticks => "no sticks",
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
    /// The safety net selects the mode.
    Failsafe(Cause),
}

impl ModeReason {
    /// Returns the reason in words.
    pub const fn name(self) -> &'static str {
        match self {
            ModeReason::Ordered => "ordered",
            ModeReason::Done => "done",
            ModeReason::Mission => "by the mission",
            ModeReason::Cleared => "the mission was cleared",
            ModeReason::NoLift => "has not left the ground",
            ModeReason::Disarmed => "disarmed",
            ModeReason::Back => "the state is back",
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
pub enum Notice {
    /// The mode has changed.
    Mode(FlightMode, ModeReason),
    /// The safety net has found a cause that does not change the mode.
    Found(Cause),
    /// A cause has ended.
    Over(Cause),
    /// The guidance disarms a vehicle on the ground.
    Disarms,
    /// A mission item lies outside the geofence or is not plausible.
    ItemRefused,
}

impl Notice {
    /// Returns the announcement's urgency.
    pub const fn severity(self) -> Severity {
        match self {
            Notice::Mode(_, ModeReason::Failsafe(cause)) | Notice::Found(cause) => match cause {
                Cause::Descent | Cause::BatteryEmergency | Cause::BatteryCritical => Severity::Critical,
                Cause::Fence | Cause::Sensors | Cause::Station => Severity::Error,
                Cause::BatteryLow | Cause::Targets | Cause::Sticks => Severity::Warning,
            },
            Notice::Mode(_, ModeReason::NoLift) => Severity::Error,
            Notice::ItemRefused => Severity::Warning,
            Notice::Disarms | Notice::Over(_) => Severity::Notice,
            Notice::Mode(..) => Severity::Info,
        }
    }
}

impl Notice {
    /// Returns the text in parts, for callers that do not use `core::fmt`.
    pub const fn parts(self) -> [&'static str; 3] {
        match self {
            Notice::Mode(mode, reason) => [mode.name(), ": ", reason.name()],
            Notice::Found(cause) => [cause.name(), "", ""],
            Notice::Over(cause) => ["no longer: ", cause.name(), ""],
            Notice::Disarms => ["on the ground: disarming", "", ""],
            Notice::ItemRefused => ["mission stopped: an item cannot be flown", "", ""],
        }
    }
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.parts().into_iter().try_for_each(|part| f.write_str(part))
    }
}

/// Largest number of announcements in a tick.
pub const NOTICES_MAX: usize = 8;

/// The announcements of a tick, oldest first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Notices([Option<Notice>; NOTICES_MAX]);

impl Notices {
    /// Adds an announcement; drops it if there are already [`NOTICES_MAX`].
    pub(crate) fn push(&mut self, notice: Notice) {
        if let Some(place) = self.0.iter_mut().find(|place| place.is_none()) {
            *place = Some(notice);
        }
    }

    /// Returns the announcements, oldest first.
    pub fn iter(&self) -> impl Iterator<Item = Notice> {
        self.0.iter().map_while(|notice| *notice)
    }
}
