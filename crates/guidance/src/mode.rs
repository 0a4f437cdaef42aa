//! Flight modes, with PX4's names.

/// Flight mode: determines the setpoint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum FlightMode {
    /// Holds position and heading (PX4: "loiter").
    #[default]
    Hold,
    /// Climbs to the take-off height above the ground, then [`Hold`](Self::Hold).
    Takeoff,
    /// Descends vertically, and disarms on the ground.
    Land,
    /// Climbs to the return height, flies home and lands.
    Return,
    /// Flies the mission, then [`Hold`](Self::Hold).
    Mission,
    /// Follows the targets of a companion computer.
    Offboard,
    /// Sticks command velocities. Centred sticks hold position.
    Position,
    /// Sticks command roll, pitch, climb rate and yaw rate.
    Altitude,
    /// Sticks command roll, pitch, thrust and yaw rate.
    Stabilised,
    /// Sticks command body rates and thrust.
    Acro,
}

impl FlightMode {
    /// Every mode.
    pub const ALL: [FlightMode; 10] = [
        FlightMode::Hold,
        FlightMode::Takeoff,
        FlightMode::Land,
        FlightMode::Return,
        FlightMode::Mission,
        FlightMode::Offboard,
        FlightMode::Position,
        FlightMode::Altitude,
        FlightMode::Stabilised,
        FlightMode::Acro,
    ];

    /// Returns the mode's name for users, in lower case.
    pub const fn name(self) -> &'static str {
        match self {
            FlightMode::Hold => "hold",
            FlightMode::Takeoff => "takeoff",
            FlightMode::Land => "land",
            FlightMode::Return => "return",
            FlightMode::Mission => "mission",
            FlightMode::Offboard => "offboard",
            FlightMode::Position => "position",
            FlightMode::Altitude => "altitude",
            FlightMode::Stabilised => "stabilised",
            FlightMode::Acro => "acro",
        }
    }

    /// True if the pilot's sticks fly this mode.
    pub const fn is_manual(self) -> bool {
        matches!(self, FlightMode::Position | FlightMode::Altitude | FlightMode::Stabilised | FlightMode::Acro)
    }
}
