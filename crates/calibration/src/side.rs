//! The six sides of a vehicle.

use nalgebra::Vector3;

/// Smallest share of the specific force along an axis: within 35 degrees.
const ALONG_MIN: f32 = 0.82;
/// Accepted specific force at rest \[m/s2\].
const AT_REST_M_S2: core::ops::RangeInclusive<f32> = 7.0..=13.0;

/// Side of the vehicle that points to the ground, in the order of MAVLink ground stations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// Tail down: body x up.
    Back,
    /// Nose down: body x down.
    Front,
    /// Left side down: body y down.
    Left,
    /// Right side down: body y up.
    Right,
    /// Upside down: body z down.
    Up,
    /// Upright: body z up.
    Down,
}

impl Side {
    /// All sides.
    pub const ALL: [Self; 6] = [Side::Back, Side::Front, Side::Left, Side::Right, Side::Up, Side::Down];

    /// Returns the upward vertical on this side, body frame.
    #[must_use]
    pub fn up(self) -> Vector3<f32> {
        match self {
            Side::Back => Vector3::x(),
            Side::Front => -Vector3::x(),
            Side::Left => -Vector3::y(),
            Side::Right => Vector3::y(),
            Side::Up => -Vector3::z(),
            Side::Down => Vector3::z(),
        }
    }

    /// Returns the side on which a vehicle with this specific force (body frame) rests \[m/s2\]. `None` between sides,
    /// or if the force cannot be gravity.
    #[must_use]
    pub fn of(specific_force_m_s2: &Vector3<f32>) -> Option<Self> {
        let norm = specific_force_m_s2.norm();
        let is_along = |side: &Side| side.up().dot(specific_force_m_s2) >= ALONG_MIN * norm;
        // At most one side fits: no two axes can both have more than 0.71 of the norm.
        Side::ALL.into_iter().find(is_along).filter(|_| AT_REST_M_S2.contains(&norm))
    }
}

/// A set of sides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sides(u8);

impl Sides {
    /// All six sides.
    pub const ALL: Self = Sides(0b11_1111);

    /// Returns true if `side` is in the set.
    #[must_use]
    pub fn contains(self, side: Side) -> bool {
        self.0 & 1 << side as u8 != 0
    }

    /// Returns the set without `side`.
    #[must_use]
    pub fn without(self, side: Side) -> Self {
        Sides(self.0 & !(1 << side as u8))
    }

    /// Returns the share of the six sides that is not in the set \[%\].
    pub(crate) fn done_percent(self) -> u8 {
        (100 - 100 * self.0.count_ones() / 6) as u8
    }

    /// Returns true if the set is empty.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Returns the sides in the set, in order.
    pub fn iter(self) -> impl Iterator<Item = Side> {
        Side::ALL.into_iter().filter(move |side| self.contains(*side))
    }
}
