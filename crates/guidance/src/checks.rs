//! Checks before arming, each with a name.

use afbc_flight_core::Refusal;
use core::fmt;

/// A check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Check {
    /// The estimate knows its attitude.
    Attitude,
    /// It knows its heading.
    Heading,
    /// It knows where it is.
    Position,
    /// The vehicle is level.
    Level,
    /// It has not moved for a second.
    AtRest,
    /// The control tick's rate is right.
    TickRate,
    /// No sensor has failed.
    Sensors,
    /// The battery is known, and not low; without a number of cells it is not checked.
    Battery,
    /// The vehicle is inside the geofence.
    Fence,
    /// The mode is one to start from.
    Mode,
}

impl Check {
    /// Every check.
    pub const ALL: [Check; 10] = [
        Check::Attitude,
        Check::Heading,
        Check::Position,
        Check::Level,
        Check::AtRest,
        Check::TickRate,
        Check::Sensors,
        Check::Battery,
        Check::Fence,
        Check::Mode,
    ];

    /// Returns its name.
    pub const fn name(self) -> &'static str {
        match self {
            Check::Attitude => "attitude",
            Check::Heading => "heading",
            Check::Position => "position",
            Check::Level => "level",
            Check::AtRest => "at rest",
            Check::TickRate => "tick rate",
            Check::Sensors => "sensors",
            Check::Battery => "battery",
            Check::Fence => "geofence",
            Check::Mode => "mode",
        }
    }
}

/// The results of all checks; its text lists those that fail.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Checks {
    failing: u16,
}

impl Checks {
    /// Notes a result.
    pub(crate) fn note(&mut self, check: Check, ok: bool) {
        self.failing |= if ok { 0 } else { 1 << check as u16 };
    }

    /// True if none fails.
    pub const fn all_ok(self) -> bool {
        self.failing == 0
    }

    /// True if this one does not fail.
    pub const fn is_ok(self, check: Check) -> bool {
        self.failing & 1 << check as u16 == 0
    }

    /// Returns every check with its result.
    pub fn iter(self) -> impl Iterator<Item = (Check, bool)> {
        Check::ALL.into_iter().map(move |check| (check, self.is_ok(check)))
    }

    /// Returns why the vehicle is not to be armed, as far as the flight core does not check it itself.
    pub fn refusal(self) -> Option<Refusal> {
        let reasons = [
            (Check::Battery, Refusal::BatteryLow),
            (Check::Sensors, Refusal::SensorFailed),
            (Check::Fence, Refusal::OutsideFence),
            (Check::Mode, Refusal::WrongMode),
        ];
        reasons.into_iter().find(|(check, _)| !self.is_ok(*check)).map(|(_, refusal)| refusal)
    }

    /// Returns the set of failing checks, bit by bit in the order of [`Check::ALL`].
    pub const fn failing(self) -> u16 {
        self.failing
    }
}

impl fmt::Display for Checks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let failing = self.iter().filter(|(_, ok)| !ok);
        failing
            .enumerate()
            .try_for_each(|(index, (check, _))| write!(f, "{}{}", if index == 0 { "" } else { ", " }, check.name()))
    }
}
