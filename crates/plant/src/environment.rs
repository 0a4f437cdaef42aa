//! What acts on the vehicle from outside, and how its parameters change, in time.

use afbc_types::{Axis, Declared, OutOfRange, Parameters, PerAxis, Range};
use alloc::vec::Vec;
use nalgebra::Vector3;

/// How a gust's size is to be read. Either way it is part of the paper's A_F = -\[A_x, A_y, A_z\] and
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

/// A point mass carried from `start_s` to `end_s` on the body's z axis, so that thrust still passes through the common
/// centre of mass. It is taken up and let go at the vehicle's velocity; position and velocity are those of the common
/// centre of mass, and do not jump.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Payload {
    /// \[kg\]
    pub mass_kg: f64,
    /// Below the centre of mass of vehicle and payloads listed before; negative for above \[m\].
    pub below_m: f64,
    /// Start \[s\].
    pub start_s: f64,
    /// End \[s\]; infinite for a payload that stays.
    pub end_s: f64,
}

/// Accepted range of a payload's mass \[kg\].
pub const PAYLOAD_MASS: Range = Range::new("payload_mass_kg", 0.0, 500.0);
/// Accepted range of a payload's place \[m\].
pub const PAYLOAD_BELOW: Range = Range::new("below_m", -10.0, 10.0);

impl Payload {
    /// Adds the payload's mass, and by the parallel axis theorem m m_p/(m + m_p) h^2 to Ix and Iy.
    fn load(&self, vehicle: &mut Parameters<f64>) {
        let total_kg = vehicle.mass_kg + self.mass_kg;
        let across = vehicle.mass_kg * self.mass_kg / total_kg * self.below_m * self.below_m;
        vehicle.mass_kg = total_kg;
        vehicle.inertia_kg_m2 += Vector3::new(across, across, 0.0);
    }
}

/// The vehicle's true parameters and everything that changes or pushes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    nominal: Parameters<f64>,
    changes: Vec<ParameterChange>,
    gusts: Vec<Gust>,
    payloads: Vec<Payload>,
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
        let environment = Environment { nominal, changes, gusts, payloads: Vec::new() };
        nominal.validate()?;
        for gust in &environment.gusts {
            GUST_SIZE.check(gust.size)?;
            START.check(gust.start_s)?;
        }
        environment.validate_changes()?;
        Ok(environment)
    }

    /// The same environment with payloads, which come after the parameter changes: a changed vehicle takes them up.
    ///
    /// # Errors
    /// The first payload out of range, or parameter out of range at any time under them.
    pub fn with_payloads(self, payloads: Vec<Payload>) -> Result<Self, OutOfRange> {
        for payload in &payloads {
            PAYLOAD_MASS.check(payload.mass_kg)?;
            PAYLOAD_BELOW.check(payload.below_m)?;
        }
        let environment = Environment { payloads, ..self };
        environment.validate_changes()?;
        Ok(environment)
    }

    fn validate_changes(&self) -> Result<(), OutOfRange> {
        let changes = self.changes.iter().flat_map(|c| [c.start_s, c.end_s]);
        let payloads = self.payloads.iter().flat_map(|p| [p.start_s, p.end_s]);
        changes.chain(payloads).try_for_each(|edge| self.segment(edge).parameters.validate())
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

    /// Every payload.
    pub fn payloads(&self) -> &[Payload] {
        &self.payloads
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
        for payload in self.payloads.iter().filter(|p| active(p.start_s, p.end_s, t)) {
            payload.load(&mut parameters);
        }
        let (m, i) = (parameters.mass_kg, parameters.inertia_kg_m2);
        let scale = PerAxis { roll: i.x, pitch: i.y, yaw: i.z, z: m, x: m, y: m };
        let mut a = PerAxis::<f64>::default();
        for gust in self.gusts.iter().filter(|g| active(g.start_s, g.end_s, t)) {
            a[gust.axis] += match gust.kind {
                GustKind::Acceleration => gust.size,
                GustKind::Force => gust.size / scale[gust.axis],
            };
        }
        let changes = self.changes.iter().flat_map(|c| [c.start_s, c.end_s]);
        let gusts = self.gusts.iter().flat_map(|g| [g.start_s, g.end_s]);
        let payloads = self.payloads.iter().flat_map(|p| [p.start_s, p.end_s]);
        let until_s =
            changes.chain(gusts).chain(payloads).filter(|&edge| edge > t + TIME_SLACK_S).fold(f64::INFINITY, f64::min);
        Segment {
            parameters,
            a_force: Vector3::new(a.x, a.y, a.z),
            a_moment: Vector3::new(a.roll, a.pitch, a.yaw),
            until_s: until_s - TIME_SLACK_S,
        }
    }
}
