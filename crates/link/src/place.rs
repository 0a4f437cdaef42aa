//! Places on the earth.

/// What a height is measured from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Datum {
    /// Mean sea level.
    Sea,
    /// The home position.
    Home,
    /// Where the vehicle is.
    Here,
}

/// A height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Height {
    /// Height \[m\]; NaN: any, or as it is.
    pub metres: f32,
    /// Above what.
    pub above: Datum,
}

/// A place on the earth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Latitude \[1e-7 deg\]; [`Place::AS_IT_IS`]: as it is.
    pub latitude_e7: i32,
    /// Longitude \[1e-7 deg\]; [`Place::AS_IT_IS`]: as it is.
    pub longitude_e7: i32,
    /// Height.
    pub height: Height,
}

impl Place {
    /// A coordinate that is not given.
    pub const AS_IT_IS: i32 = i32::MAX;

    /// True if latitude and longitude exist, or are not given, and the height is below 100 km or not given.
    pub fn is_plausible(&self) -> bool {
        let within = |value: i32, max: i32| value == Self::AS_IT_IS || (-max..=max).contains(&value);
        let height_m = self.height.metres;
        within(self.latitude_e7, 900_000_000)
            && within(self.longitude_e7, 1_800_000_000)
            && (height_m.is_nan() || height_m.abs() <= 1e5)
    }
}

/// Returns what heights are measured from in a global `MAV_FRAME`; none for other frames.
pub(crate) fn datum(frame: u8) -> Option<Datum> {
    match frame {
        0 | 5 => Some(Datum::Sea),
        3 | 6 => Some(Datum::Home),
        _ => None,
    }
}

/// Returns the `MAV_FRAME` of a height.
pub(crate) const fn frame(datum: Datum) -> u8 {
    match datum {
        Datum::Sea => 0,
        Datum::Home | Datum::Here => 3,
    }
}

/// Returns an angle in degrees as an integer of 1e-7 degrees; NaN is not given, others out of range stay so.
pub(crate) fn e7(degrees: f32) -> i32 {
    // Beyond any angle, and short of the number that says that none is given.
    if degrees.is_nan() { Place::AS_IT_IS } else { (f64::from(degrees) * 1e7).clamp(-2e9, 2e9) as i32 }
}
