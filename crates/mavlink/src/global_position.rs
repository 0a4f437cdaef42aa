//! Positions on the earth.

/// Reference of a height.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Datum {
    /// Mean sea level.
    Sea,
    /// The home position.
    Home,
    /// The vehicle's present position.
    Here,
}

/// A height with its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Height {
    /// Height \[m\]; NaN: not given.
    pub metres: f32,
    /// Reference of the height.
    pub above: Datum,
}

/// A position on the earth. Coordinates that are not given mean "unchanged".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlobalPosition {
    /// Latitude \[1e-7 deg\]; [`GlobalPosition::AS_IT_IS`] if not given.
    pub latitude_e7: i32,
    /// Longitude \[1e-7 deg\]; [`GlobalPosition::AS_IT_IS`] if not given.
    pub longitude_e7: i32,
    /// Height.
    pub height: Height,
}

impl GlobalPosition {
    /// Value of a coordinate that is not given.
    pub const AS_IT_IS: i32 = i32::MAX;

    /// True if latitude and longitude are valid or not given, and the height is within 100 km or not given.
    pub fn is_plausible(&self) -> bool {
        let within = |value: i32, max: i32| value == Self::AS_IT_IS || (-max..=max).contains(&value);
        let height_m = self.height.metres;
        within(self.latitude_e7, 900_000_000)
            && within(self.longitude_e7, 1_800_000_000)
            && (height_m.is_nan() || height_m.abs() <= 1e5)
    }
}

/// Returns the reference of heights in a global `MAV_FRAME`; none for other frames.
pub(crate) fn datum(frame: u8) -> Option<Datum> {
    match frame {
        0 | 5 => Some(Datum::Sea),
        3 | 6 => Some(Datum::Home),
        _ => None,
    }
}

/// Returns the `MAV_FRAME` for a reference of heights.
pub(crate) const fn frame(datum: Datum) -> u8 {
    match datum {
        Datum::Sea => 0,
        Datum::Home | Datum::Here => 3,
    }
}

/// Converts degrees to units of 1e-7 degrees. NaN becomes "not given"; other invalid angles stay invalid.
pub(crate) fn e7(degrees: f32) -> i32 {
    // The limits are beyond any angle, but below the value for "not given".
    if degrees.is_nan() { GlobalPosition::AS_IT_IS } else { (f64::from(degrees) * 1e7).clamp(-2e9, 2e9) as i32 }
}
