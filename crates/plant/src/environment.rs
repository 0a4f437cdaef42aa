//! What acts on the vehicle from outside, and how its parameters change, in time.

use airframe::{Axis, OutOfRange, Parameters, PerAxis, Range};
use alloc::vec::Vec;
use nalgebra::Vector3;

/// How a gust's size is to be read. All three appear as the paper's A_F = -\[A_x, A_y, A_z\] and
/// A_T = -\[A_phi, A_theta, A_psi\]: a positive gust decelerates the positive direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GustKind {
    /// The paper's A_i: m/s2 in the earth frame for x, y, z; rad/s2 in the body frame for roll, pitch, yaw.
    Acceleration,
    /// A physical force \[N\] in the earth frame, or moment \[N m\] in the body frame, divided by the true mass or inertia.
    Force,
}

/// A constant push on one axis from `start_s` to `end_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gust {
    /// Which of A_phi, A_theta, A_psi, A_z, A_x, A_y.
    pub axis: Axis,
    /// How to read `size`.
    pub kind: GustKind,
    /// m/s2, rad/s2, N or N m.
    pub size: f64,
    /// Onset \[s\].
    pub start_s: f64,
    /// End \[s\]; infinite for a push that stays.
    pub end_s: f64,
}

/// A physical parameter that may change in flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// m
    Mass,
    /// Ix, Iy and Iz together.
    Inertia,
    /// b
    ThrustFactor,
    /// d
    DragFactor,
}

/// Multiplies one parameter by `factor` from `start_s` to `end_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterChange {
    /// Which parameter.
    pub quantity: Quantity,
    /// 1 changes nothing.
    pub factor: f64,
    /// Start \[s\].
    pub start_s: f64,
    /// End \[s\]; infinite for a change that stays.
    pub end_s: f64,
}

/// The vehicle's true parameters and everything that changes or pushes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    nominal: Parameters<f64>,
    changes: Vec<ParameterChange>,
    gusts: Vec<Gust>,
}

/// Accepted size of a gust, in its own unit.
pub const GUST_SIZE: Range = Range::new("gust", -1e4, 1e4);
/// Accepted start of a gust or a change \[s\].
pub const START: Range = Range::new("start_s", 0.0, 1e6);

/// Slack in the comparison of times, far below any step \[s\]: onset and step count may round differently.
const TIME_SLACK_S: f64 = 1e-9;

fn active(start_s: f64, end_s: f64, t: f64) -> bool {
    start_s <= t + TIME_SLACK_S && t + TIME_SLACK_S < end_s
}

/// What holds from one moment to the next change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Segment {
    pub(crate) parameters: Parameters<f64>,
    /// \[A_x, A_y, A_z\], earth frame \[m/s2\].
    pub(crate) a_force: Vector3<f64>,
    /// \[A_phi, A_theta, A_psi\], body frame \[rad/s2\].
    pub(crate) a_moment: Vector3<f64>,
    /// When the next change is due \[s\].
    pub(crate) until_s: f64,
}

impl Environment {
    /// Still air and parameters that stay.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn calm(nominal: Parameters<f64>) -> Result<Self, OutOfRange> {
        Self::new(nominal, Vec::new(), Vec::new())
    }

    /// An environment with gusts, which add up, and parameter changes, which multiply.
    ///
    /// # Errors
    /// The first parameter out of range, as it stands or at any time under the changes, or the first gust out of
    /// [`GUST_SIZE`] or [`START`].
    pub fn new(nominal: Parameters<f64>, changes: Vec<ParameterChange>, gusts: Vec<Gust>) -> Result<Self, OutOfRange> {
        let environment = Environment { nominal, changes, gusts };
        nominal.validate()?;
        for gust in &environment.gusts {
            GUST_SIZE.check(gust.size)?;
            START.check(gust.start_s)?;
        }
        for change in &environment.changes {
            environment.segment(change.start_s).parameters.validate()?;
            environment.segment(change.end_s).parameters.validate()?;
        }
        Ok(environment)
    }

    /// The true parameters before any change.
    pub fn nominal(&self) -> &Parameters<f64> {
        &self.nominal
    }

    /// Every gust.
    pub fn gusts(&self) -> &[Gust] {
        &self.gusts
    }

    /// Every parameter change.
    pub fn changes(&self) -> &[ParameterChange] {
        &self.changes
    }

    /// What holds at time `t` \[s\], and until when.
    pub(crate) fn segment(&self, t: f64) -> Segment {
        let mut parameters = self.nominal;
        for change in self.changes.iter().filter(|c| active(c.start_s, c.end_s, t)) {
            match change.quantity {
                Quantity::Mass => parameters.mass_kg *= change.factor,
                Quantity::Inertia => parameters.inertia_kg_m2 *= change.factor,
                Quantity::ThrustFactor => parameters.thrust_factor_n_s2 *= change.factor,
                Quantity::DragFactor => parameters.drag_factor_n_m_s2 *= change.factor,
            }
        }
        let (m, i) = (parameters.mass_kg, parameters.inertia_kg_m2);
        let scale = PerAxis { roll: i.x, pitch: i.y, yaw: i.z, z: m, x: m, y: m };
        let mut a = PerAxis::<f64>::default();
        for gust in self.gusts.iter().filter(|g| active(g.start_s, g.end_s, t)) {
            *a.get_mut(gust.axis) += match gust.kind {
                GustKind::Acceleration => gust.size,
                GustKind::Force => gust.size / scale.get(gust.axis),
            };
        }
        let changes = self.changes.iter().flat_map(|c| [c.start_s, c.end_s]);
        let gusts = self.gusts.iter().flat_map(|g| [g.start_s, g.end_s]);
        let until_s = changes.chain(gusts).filter(|&edge| edge > t + TIME_SLACK_S).fold(f64::INFINITY, f64::min);
        Segment {
            parameters,
            a_force: Vector3::new(a.x, a.y, a.z),
            a_moment: Vector3::new(a.roll, a.pitch, a.yaw),
            until_s: until_s - TIME_SLACK_S,
        }
    }
}
