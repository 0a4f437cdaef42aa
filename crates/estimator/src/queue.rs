//! Measurements that wait, and the fix that is being fused.

use crate::aid::Aid;
use crate::errors::Coordinate;
use crate::history::Past;
use crate::horizon::Target;
use crate::measurement::Measurement;
use crate::rotation::normalized;
use afbc_control::math::max;
use afbc_types::Stamped;
use nalgebra::{Quaternion, Vector3};

/// Number of measurements that may wait.
const WAITING_MAX: usize = 8;

/// Measurements, each with the number of its arrival.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Queue {
    waiting: [Option<(u32, Stamped<Measurement>)>; WAITING_MAX],
    arrived: u32,
    count: u8,
}

impl Queue {
    /// Number of measurements.
    pub(crate) fn waiting(&self) -> u8 {
        self.count
    }

    /// Appends; true if the oldest one had to give way.
    pub(crate) fn push(&mut self, measurement: &Stamped<Measurement>) -> bool {
        let arrived = self.arrived;
        self.arrived = arrived.wrapping_add(1);
        // A free place, or else the oldest one's.
        // The numbers wrap; how far apart those of eight are does not.
        let age = |place: &Option<(u32, Stamped<Measurement>)>| {
            place.as_ref().map_or(u32::MAX, |(number, _)| arrived.wrapping_sub(*number))
        };
        let Some(place) = self.waiting.iter_mut().max_by_key(|place| age(place)) else { return false };
        let full = place.is_some();
        *place = Some((arrived, *measurement));
        self.count += u8::from(!full);
        full
    }

    /// Removes and returns the oldest measurement whose time is `due`.
    pub(crate) fn take(&mut self, due: impl Fn(u64) -> bool) -> Option<Stamped<Measurement>> {
        if self.count == 0 {
            return None;
        }
        let age = |number: u32| self.arrived.wrapping_sub(number);
        let due = |(place, waiting): (usize, &Option<(u32, Stamped<Measurement>)>)| {
            waiting.as_ref().filter(|(_, waiting)| due(waiting.at_us)).map(|(number, _)| (age(*number), place))
        };
        let (_, oldest) = self.waiting.iter().enumerate().filter_map(due).max()?;
        let (_, measurement) = self.waiting.get_mut(oldest)?.take()?;
        self.count -= 1;
        Some(measurement)
    }
}

/// The coordinates of a position or velocity that are judged together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Axes {
    /// x, y and z.
    All,
    /// x and y.
    Level,
    /// z.
    Vertical,
}

impl Axes {
    /// Returns the coordinate of the scalar with this number.
    #[inline]
    pub(crate) fn coordinate(self, number: u8) -> Coordinate {
        match (self, number) {
            (Axes::Vertical, _) => Coordinate::Z,
            (_, 0) => Coordinate::X,
            (_, 1) => Coordinate::Y,
            _ => Coordinate::Z,
        }
    }

    /// True of a coordinate that is one of them.
    pub(crate) fn contain(self, at: Coordinate) -> bool {
        match self {
            Axes::All => true,
            Axes::Level => at != Coordinate::Z,
            Axes::Vertical => at == Coordinate::Z,
        }
    }

    /// Returns the vector with zero in all other coordinates.
    #[inline]
    pub(crate) fn only(self, v: &Vector3<f32>) -> Vector3<f32> {
        match self {
            Axes::All => *v,
            Axes::Level => Vector3::new(v.x, v.y, 0.0),
            Axes::Vertical => Vector3::new(0.0, 0.0, v.z),
        }
    }
}

/// One kind of aid in a fix: one scalar or three.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Part {
    pub(crate) aid: Option<Aid>,
    pub(crate) target: Target,
    /// Of a position or velocity, the coordinates that are fused.
    pub(crate) axes: Axes,
    /// Variances of its scalars; the first one of a single scalar.
    pub(crate) variance: Vector3<f32>,
    /// Variance of a field's direction that comes on top.
    pub(crate) rough: f32,
}

impl Part {
    /// True of what a GNSS receiver's slow error comes on top of.
    #[inline]
    pub(crate) fn is_slow(&self) -> bool {
        matches!(self.aid, Some(Aid::GnssPosition | Aid::GnssHeight))
    }

    /// Number of scalars.
    #[inline]
    pub(crate) fn scalars(&self) -> u8 {
        match (&self.target, self.axes) {
            (Target::Height(_) | Target::Field(_) | Target::Heading(_), _) | (_, Axes::Vertical) => 1,
            (_, Axes::Level) => 2,
            (_, Axes::All) => 3,
        }
    }

    /// Adds to the variances what clipped or missing samples since the measurement have made uncertain.
    #[inline]
    pub(crate) fn roughen(&mut self, (theta, velocity): (f32, f32), tau_s: f32) {
        if theta + velocity > 0.0 {
            let more = match self.target {
                Target::Position(_) | Target::Height(_) => velocity * tau_s * tau_s,
                Target::Velocity(_) => velocity,
                Target::Attitude(_) | Target::Heading(_) => theta,
                Target::Field(_) => 0.0,
            };
            self.variance += Vector3::repeat(more);
            self.rough = theta;
        }
    }
}

/// A measurement that is being fused, scalar by scalar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fix {
    pub(crate) at_us: u64,
    /// State at its time, without corrections.
    pub(crate) past: Past,
    pub(crate) parts: [Option<Part>; 3],
    /// Number of the first part's next scalar.
    pub(crate) next: u8,
    /// Normalised innovation squared of this part so far.
    pub(crate) nis: f32,
}

impl Fix {
    /// True of a receiver's.
    pub(crate) fn is_gnss(&self) -> bool {
        let of_gnss = |part: &Part| part.is_slow() || part.aid == Some(Aid::GnssVelocity);
        self.parts.iter().flatten().any(of_gnss)
    }
}

/// Smallest standard deviations: position \[m\], velocity \[m/s\], angle \[rad\].
const LEAST: f32 = 1e-4;
const LEAST_M_S: f32 = 1e-3;

/// Returns the parts of a measurement. The variance of a field is that of its coordinates; its heading's depends on the
/// attitude.
pub(crate) fn parts(measurement: &Measurement) -> [Option<Part>; 3] {
    let square = |sigma: f32, least: f32| max(sigma, least) * max(sigma, least);
    let of_axes =
        |aid, target, variance: Vector3<f32>, axes| Some(Part { aid: Some(aid), target, axes, variance, rough: 0.0 });
    let part = |aid, target, variance| of_axes(aid, target, variance, Axes::All);
    let same = |variance: f32| Vector3::new(variance, variance, variance);
    match *measurement {
        Measurement::Pose { position_m, attitude: [w, x, y, z], position_sigma_m, attitude_sigma_rad } => {
            let attitude = normalized(&Quaternion::new(w, x, y, z));
            [
                part(Aid::TrackerPosition, Target::Position(position_m), same(square(position_sigma_m, LEAST))),
                part(Aid::TrackerAttitude, Target::Attitude(attitude), same(square(attitude_sigma_rad, LEAST))),
                None,
            ]
        }
        Measurement::Position { position_m, sigma_m } => {
            [part(Aid::TrackerPosition, Target::Position(position_m), same(square(sigma_m, LEAST))), None, None]
        }
        Measurement::Gnss {
            position_m,
            velocity_m_s,
            horizontal_sigma_m,
            vertical_sigma_m,
            speed_sigma_m_s,
            climb_sigma_m_s,
        } => {
            let level = |horizontal: f32, vertical: f32| Vector3::new(horizontal, horizontal, vertical);
            let position = level(square(horizontal_sigma_m, LEAST), square(vertical_sigma_m, LEAST));
            let velocity = level(square(speed_sigma_m_s, LEAST_M_S), square(climb_sigma_m_s, LEAST_M_S));
            // The height by itself: it is the worst of a receiver's, and a barometer can contradict it.
            [
                of_axes(Aid::GnssPosition, Target::Position(position_m), position, Axes::Level),
                of_axes(Aid::GnssHeight, Target::Position(position_m), position, Axes::Vertical),
                part(Aid::GnssVelocity, Target::Velocity(velocity_m_s), velocity),
            ]
        }
        Measurement::Height { height_m, sigma_m } => {
            [part(Aid::Height, Target::Height(height_m), same(square(sigma_m, LEAST))), None, None]
        }
        Measurement::MagneticField { field, sigma } => {
            [part(Aid::Heading, Target::Field(field), same(sigma * sigma)), None, None]
        }
        Measurement::Heading { heading_rad, sigma_rad } => {
            [part(Aid::Heading, Target::Heading(heading_rad), same(square(sigma_rad, LEAST))), None, None]
        }
    }
}
