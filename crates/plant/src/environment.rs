//! External disturbances, and parameters of the vehicle that change over time.

use crate::frame::RotorLayout;
use crate::ratios::Ratios;
use afbc_types::{Axis, Declared, OutOfRange, Parameters, PerAxis, Range};
use alloc::vec::Vec;
use nalgebra::{Vector2, Vector3};

/// Meaning of a gust's size. In both cases it is part of the paper's A_F = -\[A_x, A_y, A_z\] and A_T = -\[A_phi,
/// A_theta, A_psi\]: a positive gust pushes in the negative direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum GustKind {
    /// The paper's A_i: m/s2 in the earth frame for x, y, z; rad/s2 in the body frame for roll, pitch, yaw.
    Acceleration,
    /// A force \[N\] in the earth frame, or a moment \[N m\] in the body frame, divided by the true mass or inertia.
    Force,
}

/// Constant push on one axis from `start_s` to `end_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Gust {
    /// One of A_phi, A_theta, A_psi, A_z, A_x, A_y.
    pub axis: Axis,
    /// Meaning of `size`.
    pub kind: GustKind,
    /// Size in m/s2, rad/s2, N or N m.
    pub size: f64,
    /// Onset \[s\].
    pub start_s: f64,
    /// End \[s\], infinite for a gust that persists.
    pub end_s: f64,
}

/// Physical parameter that may change in flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum PlantParameter {
    /// m: mass.
    Mass,
    /// Ix, Iy and Iz together.
    Inertia,
    /// b: thrust factor.
    ThrustFactor,
    /// d: drag factor.
    DragFactor,
    /// Moment of the rotors' thrusts about body x, the effect of U1. A factor below 0 reverses its sign.
    RollMoment,
    /// Moment of the rotors' thrusts about body y, the effect of U2. A factor below 0 reverses its sign.
    PitchMoment,
    /// Moment of the rotors' drag about body z: the effect of U3.
    YawMoment,
}

/// Change that multiplies one parameter by `factor` from `start_s` to `end_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct PlantParameterChange {
    /// Parameter that changes.
    pub quantity: PlantParameter,
    /// Factor on the parameter; 1 changes nothing.
    pub factor: f64,
    /// Start \[s\].
    pub start_s: f64,
    /// End \[s\], infinite for a permanent change.
    pub end_s: f64,
}

/// Point mass carried from `start_s` to `end_s`. The vehicle takes it up and releases it at its own velocity. Position
/// and velocity are those of the common centre of mass, and do not jump. A payload beside the body's z axis shifts the
/// centre of mass away from the thrust, and the resulting moment is included. Products of inertia, and the shift's
/// effect on drag and ground contact, are neglected.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Payload {
    /// Mass \[kg\].
    pub mass_kg: f64,
    /// Distance below the centre of mass of the vehicle and the payloads listed before it, negative for above \[m\].
    pub below_m: f64,
    /// Distance ahead of that centre of mass, negative for behind \[m\].
    pub ahead_m: f64,
    /// Distance to the left of that centre of mass, negative for the right \[m\].
    pub left_m: f64,
    /// Start \[s\].
    pub start_s: f64,
    /// End \[s\], infinite for a payload that is kept.
    pub end_s: f64,
}

/// Accepted range of a payload's mass \[kg\].
pub const PAYLOAD_MASS: Range = Range::new("payload_mass_kg", 0.0, 500.0);
/// Accepted range of a payload's distance below the centre of mass \[m\].
pub const PAYLOAD_BELOW: Range = Range::new("below_m", -10.0, 10.0);
/// Accepted range of a payload's distance ahead of the centre of mass \[m\].
pub const PAYLOAD_AHEAD: Range = Range::new("ahead_m", -10.0, 10.0);
/// Accepted range of a payload's distance to the left of the centre of mass \[m\].
pub const PAYLOAD_LEFT: Range = Range::new("left_m", -10.0, 10.0);

impl Payload {
    /// Adds the payload's mass, its inertia (by the parallel axis theorem m m_p/(m + m_p) times the squared distance
    /// from each axis), and its shift of the centre of mass.
    fn load(&self, vehicle: &mut Parameters<f64>, rig: &mut WrenchEffect) {
        let Payload { mass_kg, below_m, ahead_m, left_m, .. } = *self;
        let total_kg = vehicle.mass_kg + mass_kg;
        let [below, ahead, left] = [below_m, ahead_m, left_m].map(|distance_m| distance_m * distance_m);
        let reduced_kg = vehicle.mass_kg * mass_kg / total_kg;
        vehicle.mass_kg = total_kg;
        vehicle.inertia_kg_m2 += reduced_kg * Vector3::new(left + below, ahead + below, ahead + left);
        let share = mass_kg / total_kg;
        rig.lever_m.x += share * left_m;
        rig.lever_m.y -= share * ahead_m;
    }
}

/// True parameters of the vehicle with their changes, gusts and payloads.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Environment {
    nominal: Parameters<f64>,
    frame: RotorLayout,
    changes: Vec<PlantParameterChange>,
    gusts: Vec<Gust>,
    payloads: Vec<Payload>,
}

/// Accepted size of a gust, in the gust's unit.
pub const GUST_SIZE: Range = Range::new("gust", -1e4, 1e4);
/// Accepted start of a gust or a change \[s\].
pub const START: Range = Range::new("start_s", 0.0, 1e6);

/// Tolerance when comparing times, far below any step \[s\], because onset and step count may round differently.
const TIME_SLACK_S: f64 = 1e-9;

fn active(start_s: f64, end_s: f64, t: f64) -> bool {
    start_s <= t + TIME_SLACK_S && t + TIME_SLACK_S < end_s
}

/// Effect of the rotors' wrench on the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WrenchEffect {
    /// Factors on the rotors' moments about body x, y, z.
    pub(crate) moments: Vector3<f64>,
    /// Moments about body x and y per thrust \[m\] that result from a centre of mass beside the thrust, subtracted.
    pub(crate) lever_m: Vector2<f64>,
}

impl WrenchEffect {
    /// Returns the intact rig: the thrust acts through the centre of mass.
    pub(crate) fn intact() -> Self {
        WrenchEffect { moments: Vector3::repeat(1.0), lever_m: Vector2::zeros() }
    }
}

/// Parameters and disturbances that are constant until the next change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Segment {
    pub(crate) parameters: Parameters<f64>,
    pub(crate) ratios: Ratios,
    pub(crate) rig: WrenchEffect,
    /// \[A_x, A_y, A_z\], earth frame \[m/s2\].
    pub(crate) a_force: Vector3<f64>,
    /// \[A_phi, A_theta, A_psi\], body frame \[rad/s2\].
    pub(crate) a_moment: Vector3<f64>,
    /// Time of the next change \[s\].
    pub(crate) until_s: f64,
}

impl Segment {
    /// Creates a segment with these parameters and the paper's disturbances, valid until `until_s`.
    pub(crate) fn new(
        parameters: Parameters<f64>,
        rig: WrenchEffect,
        [a_force, a_moment]: [Vector3<f64>; 2],
        until_s: f64,
    ) -> Self {
        Segment { parameters, ratios: Ratios::new(&parameters), rig, a_force, a_moment, until_s }
    }
}

impl Environment {
    /// Creates an environment with still air and constant parameters.
    ///
    /// # Errors
    /// Returns the first parameter that is out of range.
    pub fn calm(nominal: Parameters<f64>) -> Result<Self, OutOfRange> {
        Self::new(nominal, Vec::new(), Vec::new())
    }

    /// Creates an environment with gusts, which add up, and parameter changes, which multiply.
    ///
    /// # Errors
    /// Returns the first parameter out of range, initially or at any time, or the first gust out of [`GUST_SIZE`] or
    /// [`START`].
    pub fn new(
        nominal: Parameters<f64>,
        changes: Vec<PlantParameterChange>,
        gusts: Vec<Gust>,
    ) -> Result<Self, OutOfRange> {
        let environment = Environment { nominal, frame: RotorLayout::default(), changes, gusts, payloads: Vec::new() };
        nominal.validate()?;
        for gust in &environment.gusts {
            GUST_SIZE.check(gust.size)?;
            START.check(gust.start_s)?;
        }
        environment.validate_changes()?;
        Ok(environment)
    }

    /// Adds payloads, which are applied after the parameter changes.
    ///
    /// # Errors
    /// Returns the first payload out of range, or the first parameter out of range at any time with the payloads.
    pub fn with_payloads(self, payloads: Vec<Payload>) -> Result<Self, OutOfRange> {
        for payload in &payloads {
            PAYLOAD_MASS.check(payload.mass_kg)?;
            PAYLOAD_BELOW.check(payload.below_m)?;
            PAYLOAD_AHEAD.check(payload.ahead_m)?;
            PAYLOAD_LEFT.check(payload.left_m)?;
        }
        let environment = Environment { payloads, ..self };
        environment.validate_changes()?;
        Ok(environment)
    }

    /// Returns the same changes, gusts and payloads for a vehicle with other parameters.
    ///
    /// # Errors
    /// Returns the first parameter out of range, initially or at any time with the changes.
    pub fn on(&self, nominal: Parameters<f64>) -> Result<Self, OutOfRange> {
        nominal.validate()?;
        let environment = Environment { nominal, ..self.clone() };
        environment.validate_changes()?;
        Ok(environment)
    }

    /// Returns the environment for a vehicle with this frame instead of the paper's.
    #[must_use]
    pub fn with_frame(self, frame: RotorLayout) -> Self {
        Environment { frame, ..self }
    }

    fn validate_changes(&self) -> Result<(), OutOfRange> {
        let changes = self.changes.iter().flat_map(|c| [c.start_s, c.end_s]);
        let payloads = self.payloads.iter().flat_map(|p| [p.start_s, p.end_s]);
        // Nothing changes between these times, so no other time needs a check.
        changes.chain(payloads).try_for_each(|edge| self.segment(edge).parameters.validate())
    }

    /// Returns the true parameters before any change.
    pub fn nominal(&self) -> &Parameters<f64> {
        &self.nominal
    }

    /// Returns the positions of the rotors.
    pub fn frame(&self) -> &RotorLayout {
        &self.frame
    }

    /// Returns every gust.
    pub fn gusts(&self) -> &[Gust] {
        &self.gusts
    }

    /// Returns every parameter change.
    pub fn changes(&self) -> &[PlantParameterChange] {
        &self.changes
    }

    /// Returns every payload.
    pub fn payloads(&self) -> &[Payload] {
        &self.payloads
    }

    /// Returns parameters and disturbances at time `t` \[s\], with the time of the next change.
    pub(crate) fn segment(&self, t: f64) -> Segment {
        let (mut parameters, mut rig) = (self.nominal, WrenchEffect::intact());
        for change in self.changes.iter().filter(|c| active(c.start_s, c.end_s, t)) {
            match change.quantity {
                PlantParameter::Mass => parameters.mass_kg *= change.factor,
                PlantParameter::Inertia => parameters.inertia_kg_m2 *= change.factor,
                PlantParameter::ThrustFactor => parameters.thrust_factor_n_s2 *= change.factor,
                PlantParameter::DragFactor => parameters.drag_factor_n_m_s2 *= change.factor,
                PlantParameter::RollMoment => rig.moments.x *= change.factor,
                PlantParameter::PitchMoment => rig.moments.y *= change.factor,
                PlantParameter::YawMoment => rig.moments.z *= change.factor,
            }
        }
        for payload in self.payloads.iter().filter(|p| active(p.start_s, p.end_s, t)) {
            payload.load(&mut parameters, &mut rig);
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
        let disturbances = [Vector3::new(a.x, a.y, a.z), Vector3::new(a.roll, a.pitch, a.yaw)];
        Segment::new(parameters, rig, disturbances, until_s - TIME_SLACK_S)
    }
}
