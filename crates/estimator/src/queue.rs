//! Queue of waiting measurements, and the fix that is being fused.

use crate::aid::AidSource;
use crate::errors::VectorComponent;
use crate::history::PastState;
use crate::horizon::ObservedQuantity;
use crate::measurement::Measurement;
use crate::rotation::normalized;
use afbc_control::math::max;
use afbc_types::Stamped;
use nalgebra::{Quaternion, Vector3};

/// Capacity of the queue.
const WAITING_MAX: usize = 8;

/// Measurements with their arrival numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct MeasurementQueue {
    waiting: [Option<(u32, Stamped<Measurement>)>; WAITING_MAX],
    arrived: u32,
    count: u8,
}

impl MeasurementQueue {
    /// Returns the number of waiting measurements.
    pub(crate) fn waiting(&self) -> u8 {
        self.count
    }

    /// Appends a measurement. Returns true if the oldest one was dropped for it.
    pub(crate) fn push(&mut self, measurement: &Stamped<Measurement>) -> bool {
        let arrived = self.arrived;
        self.arrived = arrived.wrapping_add(1);
        // Takes a free place. Without one, takes the place of the oldest measurement. Arrival numbers may wrap, but the
        // differences between eight of them stay right.
        let age = |place: &Option<(u32, Stamped<Measurement>)>| {
            place.as_ref().map_or(u32::MAX, |(number, _)| arrived.wrapping_sub(*number))
        };
        let Some(place) = self.waiting.iter_mut().max_by_key(|place| age(place)) else { return false };
        let full = place.is_some();
        *place = Some((arrived, *measurement));
        self.count += u8::from(!full);
        full
    }

    /// Removes and returns the measurement that arrived first among those whose time is `due`.
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

/// Coordinates of a position or velocity that pass the gate together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FusedAxes {
    /// x, y and z.
    All,
    /// x and y.
    Level,
    /// z.
    Vertical,
}

impl FusedAxes {
    /// Returns the coordinate of the scalar with this number.
    #[inline]
    pub(crate) fn coordinate(self, number: u8) -> VectorComponent {
        match (self, number) {
            (FusedAxes::Vertical, _) => VectorComponent::Z,
            (_, 0) => VectorComponent::X,
            (_, 1) => VectorComponent::Y,
            _ => VectorComponent::Z,
        }
    }

    /// Returns true if the coordinate belongs to these axes.
    pub(crate) fn contain(self, at: VectorComponent) -> bool {
        match self {
            FusedAxes::All => true,
            FusedAxes::Level => at != VectorComponent::Z,
            FusedAxes::Vertical => at == VectorComponent::Z,
        }
    }

    /// Returns the vector with all other coordinates zero.
    #[inline]
    pub(crate) fn only(self, v: &Vector3<f32>) -> Vector3<f32> {
        match self {
            FusedAxes::All => *v,
            FusedAxes::Level => Vector3::new(v.x, v.y, 0.0),
            FusedAxes::Vertical => Vector3::new(0.0, 0.0, v.z),
        }
    }
}

/// Part of a fix with one kind of aid: one to three scalars.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AidObservation {
    pub(crate) aid: Option<AidSource>,
    pub(crate) target: ObservedQuantity,
    /// Coordinates that are fused, for a position or velocity.
    pub(crate) axes: FusedAxes,
    /// Variances of the scalars. A single scalar uses the first variance, a vertical scalar the third.
    pub(crate) variance: Vector3<f32>,
    /// Variance added to a field's direction after clipped or missing samples.
    pub(crate) rough: f32,
}

impl AidObservation {
    /// Returns true if a GNSS receiver's slow error affects this part.
    #[inline]
    pub(crate) fn is_slow(&self) -> bool {
        matches!(self.aid, Some(AidSource::GnssPosition | AidSource::GnssHeight))
    }

    /// Returns the number of scalars.
    #[inline]
    pub(crate) fn scalars(&self) -> u8 {
        match (&self.target, self.axes) {
            (ObservedQuantity::Height(_) | ObservedQuantity::Field(_) | ObservedQuantity::Heading(_), _)
            | (_, FusedAxes::Vertical) => 1,
            (_, FusedAxes::Level) => 2,
            (_, FusedAxes::All) => 3,
        }
    }

    /// Adds the uncertainty from clipped or missing samples since the measurement to the variances.
    #[inline]
    pub(crate) fn inflate_variances(&mut self, (theta, velocity): (f32, f32), tau_s: f32) {
        if theta + velocity > 0.0 {
            let more = match self.target {
                ObservedQuantity::Position(_) | ObservedQuantity::Height(_) => velocity * tau_s * tau_s,
                ObservedQuantity::Velocity(_) => velocity,
                ObservedQuantity::Attitude(_) | ObservedQuantity::Heading(_) => theta,
                ObservedQuantity::Field(_) => 0.0,
            };
            self.variance += Vector3::repeat(more);
            self.rough = theta;
        }
    }
}

/// Measurement that is being fused, scalar by scalar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PendingFusion {
    pub(crate) at_us: u64,
    /// State at the measurement's time, without corrections.
    pub(crate) past: PastState,
    pub(crate) parts: [Option<AidObservation>; 3],
    /// Number of the scalar of the first part that is fused next.
    pub(crate) next: u8,
    /// Sum of the normalised innovations squared of the first part's scalars that have been fused.
    pub(crate) nis: f32,
}

impl PendingFusion {
    /// Returns true for a GNSS receiver's fix.
    pub(crate) fn is_gnss(&self) -> bool {
        let of_gnss = |part: &AidObservation| part.is_slow() || part.aid == Some(AidSource::GnssVelocity);
        self.parts.iter().flatten().any(of_gnss)
    }
}

/// Smallest standard deviations of position \[m\] and angle \[rad\], and of velocity \[m/s\].
const LEAST: f32 = 1e-4;
const LEAST_M_S: f32 = 1e-3;

/// Returns the parts of a measurement. For a field, the variance is that of its coordinates; the variance of its
/// heading depends on the attitude.
pub(crate) fn parts(measurement: &Measurement) -> [Option<AidObservation>; 3] {
    let square = |sigma: f32, least: f32| max(sigma, least) * max(sigma, least);
    let of_axes = |aid, target, variance: Vector3<f32>, axes| {
        Some(AidObservation { aid: Some(aid), target, axes, variance, rough: 0.0 })
    };
    let part = |aid, target, variance| of_axes(aid, target, variance, FusedAxes::All);
    let same = |variance: f32| Vector3::new(variance, variance, variance);
    match *measurement {
        Measurement::Pose { position_m, attitude: [w, x, y, z], position_sigma_m, attitude_sigma_rad } => {
            let attitude = normalized(&Quaternion::new(w, x, y, z));
            [
                part(
                    AidSource::TrackerPosition,
                    ObservedQuantity::Position(position_m),
                    same(square(position_sigma_m, LEAST)),
                ),
                part(
                    AidSource::TrackerAttitude,
                    ObservedQuantity::Attitude(attitude),
                    same(square(attitude_sigma_rad, LEAST)),
                ),
                None,
            ]
        }
        Measurement::Position { position_m, sigma_m } => [
            part(AidSource::TrackerPosition, ObservedQuantity::Position(position_m), same(square(sigma_m, LEAST))),
            None,
            None,
        ],
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
            // The height is a part of its own: it is a receiver's worst coordinate, and a barometer can contradict it.
            [
                of_axes(AidSource::GnssPosition, ObservedQuantity::Position(position_m), position, FusedAxes::Level),
                of_axes(AidSource::GnssHeight, ObservedQuantity::Position(position_m), position, FusedAxes::Vertical),
                part(AidSource::GnssVelocity, ObservedQuantity::Velocity(velocity_m_s), velocity),
            ]
        }
        Measurement::Height { height_m, sigma_m } => {
            [part(AidSource::Height, ObservedQuantity::Height(height_m), same(square(sigma_m, LEAST))), None, None]
        }
        Measurement::MagneticField { field, sigma } => {
            [part(AidSource::Heading, ObservedQuantity::Field(field), same(sigma * sigma)), None, None]
        }
        Measurement::Heading { heading_rad, sigma_rad } => [
            part(AidSource::Heading, ObservedQuantity::Heading(heading_rad), same(square(sigma_rad, LEAST))),
            None,
            None,
        ],
    }
}
