//! Actions that each cause of the [failsafe checks](crate::failsafe) can have. The numbers are PX4's.

use crate::table::FailsafeAction;
use afbc_types::Choice;

/// Declares choices: each has its words in the order of their numbers, and the failsafe action of each word.
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
            /// Returns the failsafe action of this choice.
            pub const fn action(self) -> FailsafeAction {
                match self { $( $Choice::$Variant => FailsafeAction::$action, )* }
            }
        }
    )*};
}

choices! {
    /// Action when the vehicle is outside the geofence.
    FenceAction from 0 {
        Nothing "nothing" => None,
        Warn "warn" => Warn,
        Hold "hold" => Hold,
        Return "return" => Return,
        Terminate "terminate" => Land,
        Land "land" => Land,
    }
    /// Action when the ground station is lost.
    StationAction from 0 {
        Nothing "nothing" => None,
        Hold "hold" => Hold,
        Return "return" => Return,
        Land "land" => Land,
    }
    /// Action when the targets are lost in offboard mode.
    TargetsAction from 0 {
        Land "land" => Land,
        Hold "hold" => Hold,
        Return "return" => Return,
    }
    /// Action when the sticks are lost in a manual mode.
    SticksAction from 1 {
        Hold "hold" => Hold,
        Return "return" => Return,
        Land "land" => Land,
    }
    /// Action when a sensor has failed.
    SensorsAction from 0 {
        Nothing "nothing" => None,
        Warn "warn" => Warn,
        Hold "hold" => Hold,
        Return "return" => Return,
        Land "land" => Land,
    }
    /// Action when the battery is critical. With `return-then-land`, the vehicle returns, and lands once the battery is
    /// almost empty.
    BatteryAction from 0 {
        Warn "warn" => Warn,
        Return "return" => Return,
        Land "land" => Land,
        ReturnThenLand "return-then-land" => Return,
    }
}
