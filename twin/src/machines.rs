//! The list of machines.

/// The boards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MachineName {
    MatekH743,
    Pixracer,
    SpeedyBeeF405V4,
}

impl MachineName {
    /// All of them.
    pub const ALL: [Self; 3] = [MachineName::MatekH743, MachineName::Pixracer, MachineName::SpeedyBeeF405V4];

    /// Returns its name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            MachineName::MatekH743 => "matekh743",
            MachineName::Pixracer => "pixracer",
            MachineName::SpeedyBeeF405V4 => "speedybeef405v4",
        }
    }
}

/// Evaluates an expression in which a type's name stands for the machine of this name.
#[macro_export]
macro_rules! with_machine {
    ($name:expr, $machine:ident => $call:expr) => {
        match $name {
            $crate::machines::MachineName::MatekH743 => {
                type $machine = rigless::machine::matekh743::MatekH743;
                $call
            }
            $crate::machines::MachineName::Pixracer => {
                type $machine = rigless::machine::pixracer::Pixracer;
                $call
            }
            $crate::machines::MachineName::SpeedyBeeF405V4 => {
                type $machine = $crate::speedybee::SpeedyBeeF405V4;
                $call
            }
        }
    };
}
