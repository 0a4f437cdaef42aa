//! List of the boards.

/// Declares the boards: name on the command line and type of each.
macro_rules! machines {
    ($count:literal: $($name:ident $text:literal $machine:ty,)+) => {
        /// Board, selected by name.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum MachineName {
            $($name,)+
        }

        impl MachineName {
            /// All boards.
            pub const ALL: [Self; $count] = [$(MachineName::$name),+];

            /// Returns the name on the command line.
            pub const fn name(self) -> &'static str {
                match self {
                    $(MachineName::$name => $text,)+
                }
            }
        }

        $(pub type $name = $machine;)+
    };
}

machines! {
    9:
    MatekH743 "matekh743" rigless::machine::matekh743::MatekH743,
    Pixracer "pixracer" rigless::machine::pixracer::Pixracer,
    SpeedyBeeF405V3 "speedybeef405v3" crate::f405::F405<0>,
    SpeedyBeeF405V4 "speedybeef405v4" crate::f405::F405<1>,
    SpeedyBeeF405Mini "speedybeef405mini" crate::f405::F405<2>,
    MatekF405Se "matekf405se" crate::f405::F405<3>,
    MatekF405Std "matekf405std" crate::f405::F405<4>,
    KakuteF4V2 "kakutef4v2" crate::f405::F405<5>,
    Stm32f405 "stm32f405" crate::f405::F405<6>,
}

/// Evaluates `$call` with `$machine` as an alias of the board's type.
#[macro_export]
macro_rules! with_machine {
    ($name:expr, $machine:ident => $call:expr) => {
        $crate::with_machine!(
            @of $name, $machine => $call; MatekH743 Pixracer SpeedyBeeF405V3 SpeedyBeeF405V4 SpeedyBeeF405Mini
            MatekF405Se MatekF405Std KakuteF4V2 Stm32f405
        )
    };
    (@of $name:expr, $machine:ident => $call:expr; $($each:ident)+) => {
        match $name {
            $($crate::machines::MachineName::$each => {
                type $machine = $crate::machines::$each;
                $call
            })+
        }
    };
}
