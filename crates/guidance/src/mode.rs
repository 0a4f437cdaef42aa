//! Flight modes.

/// What determines the setpoint. The names are PX4's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum FlightMode {
    /// Holds position and heading ("loiter").
    #[default]
    Hold,
    /// Climbs to the take-off height above where it stands, then [`Hold`](Self::Hold).
    Takeoff,
    /// Descends where it is, and disarms on the ground.
    Land,
    /// Climbs to the return height, flies home and lands.
    Return,
    /// Flies the mission, then [`Hold`](Self::Hold).
    Mission,
    /// Follows the targets of a companion computer.
    Offboard,
    /// The sticks give velocities; centred, it holds.
    Position,
    /// The sticks give roll, pitch, climb rate and rate of the heading.
    Altitude,
    /// The sticks give roll, pitch, thrust and rate of the heading.
    Stabilised,
    /// The sticks give the rates about the body's axes, and the thrust.
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

    /// Returns the name that people know.
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

    /// True if a pilot's sticks fly it.
    pub const fn is_manual(self) -> bool {
        matches!(self, FlightMode::Position | FlightMode::Altitude | FlightMode::Stabilised | FlightMode::Acro)
    }
}
