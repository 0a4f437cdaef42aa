//! What the guidance announces.

use crate::mode::FlightMode;
use core::fmt;

/// What the safety net watches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Cause {
    /// The flight core descends: the state is lost.
    Descent,
    /// Charge below the lowest threshold.
    BatteryEmergency,
    /// Charge below the critical threshold.
    BatteryCritical,
    /// Charge below the first threshold.
    BatteryLow,
    /// Outside the geofence, or about to leave it.
    Fence,
    /// A sensor has failed.
    Sensors,
    /// The station in control is silent.
    Station,
    /// The targets of the companion computer are missing.
    Targets,
    /// The sticks of the pilot are missing.
    Sticks,
}

impl Cause {
    /// Every cause, by decreasing precedence among those with the same action.
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

    /// Returns it in words.
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

/// Why the mode changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ModeReason {
    /// It was ordered.
    Ordered,
    /// The last mode has done its work.
    Done,
    /// An item of the mission.
    Mission,
    /// There is no mission any more.
    Cleared,
    /// The vehicle has not left the ground.
    NoLift,
    /// The motors have stopped.
    Disarmed,
    /// The state is back after an outage, and with it what was flown before.
    Back,
    /// The safety net.
    Failsafe(Cause),
}

impl ModeReason {
    /// Returns it in words.
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

/// Urgency, with MAVLink's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Act now.
    Critical = 2,
    /// Something has failed.
    Error = 3,
    /// Something may fail.
    Warning = 4,
    /// Unusual.
    Notice = 5,
    /// Usual.
    Info = 6,
}

/// An announcement; its text by [`Display`](fmt::Display) has at most 50 characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Notice {
    /// The mode is another.
    Mode(FlightMode, ModeReason),
    /// The safety net has found something, which does not change the mode.
    Found(Cause),
    /// It is over.
    Over(Cause),
    /// The guidance stops the motors of a vehicle that stands on the ground.
    Disarms,
    /// An item of the mission lies outside the geofence, or makes no sense.
    ItemRefused,
}

impl Notice {
    /// Returns how urgent it is.
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
    /// Returns its text in parts, for those who write without the library's formatting.
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

/// The announcements of a tick, oldest first, without gaps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Notices([Option<Notice>; NOTICES_MAX]);

impl Notices {
    /// Adds one; dropped if there are [`NOTICES_MAX`] already.
    pub(crate) fn push(&mut self, notice: Notice) {
        if let Some(place) = self.0.iter_mut().find(|place| place.is_none()) {
            *place = Some(notice);
        }
    }

    /// Returns them.
    pub fn iter(&self) -> impl Iterator<Item = Notice> {
        self.0.iter().map_while(|notice| *notice)
    }
}
