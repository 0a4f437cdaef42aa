//! What may follow from each cause: the choices of the [safety net](crate::net)'s parameters, numbered as in PX4.

use crate::table::FailsafeAction;
use afbc_types::Choice;

/// Declares choices, each with its words in the order of their numbers, and what follows.
macro_rules! choices {
    ($(
        $(#[$doc:meta])*
        $Choice:ident from $first:literal {
            $( $Variant:ident $word:literal => $action:ident, )*
        }
    )*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize))]
        pub enum $Choice {
            $(
                #[doc = concat!("`", $word, "`: see [`FailsafeAction::", stringify!($action), "`].")]
                #[cfg_attr(feature = "serde", serde(rename = $word))]
                $Variant,
            )*
        }

        impl Choice for $Choice {
            const ALL: &'static [Self] = &[$($Choice::$Variant),*];
            const WORDS: &'static [&'static str] = &[$($word),*];
            const FIRST: u8 = $first;
        }

        impl $Choice {
            /// Returns what follows.
            pub const fn action(self) -> FailsafeAction {
                match self { $( $Choice::$Variant => FailsafeAction::$action, )* }
            }
        }
    )*};
}

choices! {
    /// What follows from a flight outside the geofence.
    FenceAction from 0 {
        Nothing "nothing" => None,
        Warn "warn" => Warn,
        Hold "hold" => Hold,
        Return "return" => Return,
        Terminate "terminate" => Land,
        Land "land" => Land,
    }
    /// What follows from a lost station.
    StationAction from 0 {
        Nothing "nothing" => None,
        Hold "hold" => Hold,
        Return "return" => Return,
        Land "land" => Land,
    }
    /// What follows from lost targets in offboard mode.
    TargetsAction from 0 {
        Land "land" => Land,
        Hold "hold" => Hold,
        Return "return" => Return,
    }
    /// What follows from lost sticks in a mode that they fly.
    SticksAction from 1 {
        Hold "hold" => Hold,
        Return "return" => Return,
        Land "land" => Land,
    }
    /// What follows from a failed sensor.
    SensorsAction from 0 {
        Nothing "nothing" => None,
        Warn "warn" => Warn,
        Hold "hold" => Hold,
        Return "return" => Return,
        Land "land" => Land,
    }
    /// What follows from a critical battery; in `return-then-land`, the vehicle lands with an almost empty one.
    BatteryAction from 0 {
        Warn "warn" => Warn,
        Return "return" => Return,
        Land "land" => Land,
        ReturnThenLand "return-then-land" => Return,
    }
}
