//! Plant: one vehicle in one environment, advanced in time.

use crate::body_axes::BodyAxes;
use crate::environment::{Environment, Segment};
use crate::frame::PerRotor;
use crate::integrate::rk4;
use crate::load::Load;
use crate::motion::Motion;
use crate::realism::{EffectsState, Realism, SimulatedEffects};
use crate::rotors::RotorFault;
use crate::surroundings::AirAndGround;
use crate::truth::Truth;
use crate::wind::Wind;
use crate::{rigid_body, simplified};
use afbc_types::{OutOfRange, RotorSpeeds};
use alloc::boxed::Box;
use alloc::vec::Vec;
use nalgebra::{Quaternion, SVector, Vector3};

/// Equations of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum PlantModel {
    /// The paper's own simulation model (6).
    Simplified,
    /// The rigid body (1)-(5) as corrected.
    RigidBody,
}

impl PlantModel {
    /// Returns the lower-case name used in scenario files and logs.
    pub const fn name(self) -> &'static str {
        match self {
            PlantModel::Simplified => "simplified",
            PlantModel::RigidBody => "rigid-body",
        }
    }
}

/// State vector of the chosen model.
#[derive(Clone, Debug)]
enum ModelVector {
    Simplified(simplified::SimplifiedVector),
    RigidBody(rigid_body::RigidBodyVector),
}

impl ModelVector {
    fn new(model: PlantModel, initial: &Motion) -> Self {
        match model {
            PlantModel::Simplified => ModelVector::Simplified(simplified::vector(initial)),
            PlantModel::RigidBody => ModelVector::RigidBody(rigid_body::vector(initial)),
        }
    }

    /// Advances by `dt_s` with a constant load.
    #[inline]
    fn advance(&mut self, load: &Load, dt_s: f64) {
        match self {
            ModelVector::Simplified(x) => *x = rk4(|x| simplified::derivative(x, load), x, dt_s),
            ModelVector::RigidBody(x) => {
                *x = rk4(|x| rigid_body::derivative(x, load), x, dt_s);
                rigid_body::normalise(x);
            }
        }
    }

    /// Advances by `dt_s` with a constant load and forces that depend on position and velocity.
    #[inline]
    fn advance_in(&mut self, load: &Load, surroundings: &AirAndGround, dt_s: f64) {
        match self {
            ModelVector::Simplified(x) => *x = rk4(|x| simplified::derivative_in(x, load, surroundings), x, dt_s),
            ModelVector::RigidBody(x) => {
                *x = rk4(|x| rigid_body::derivative_in(x, load, surroundings), x, dt_s);
                rigid_body::normalise(x);
            }
        }
    }

    /// Returns d^2 xi/dt^2, earth frame \[m/s2\], and the derivative of the model's rates \[rad/s2\].
    fn accelerations(&self, load: &Load, surroundings: Option<&AirAndGround>) -> (Vector3<f64>, Vector3<f64>) {
        match (self, surroundings) {
            (ModelVector::Simplified(x), None) => halves(&simplified::derivative(x, load), 9),
            (ModelVector::Simplified(x), Some(s)) => halves(&simplified::derivative_in(x, load, s), 9),
            (ModelVector::RigidBody(x), None) => halves(&rigid_body::derivative(x, load), 10),
            (ModelVector::RigidBody(x), Some(s)) => halves(&rigid_body::derivative_in(x, load, s), 10),
        }
    }

    /// Returns position and velocity.
    #[inline]
    fn place(&self) -> (Vector3<f64>, Vector3<f64>) {
        match self {
            ModelVector::Simplified(x) => (x.fixed_rows::<3>(0).into(), x.fixed_rows::<3>(3).into()),
            ModelVector::RigidBody(x) => (x.fixed_rows::<3>(0).into(), x.fixed_rows::<3>(3).into()),
        }
    }

    fn axes(&self) -> BodyAxes {
        match self {
            ModelVector::Simplified(x) => simplified::body_axes(x),
            ModelVector::RigidBody(x) => rigid_body::body_axes(x),
        }
    }
}

/// Returns the derivatives of velocity and of the rates, which begin at row `rates`.
fn halves<const N: usize>(derivative: &SVector<f64, N>, rates: usize) -> (Vector3<f64>, Vector3<f64>) {
    (derivative.fixed_rows::<3>(3).into(), derivative.fixed_rows::<3>(rates).into())
}

/// One vehicle in one environment.
#[derive(Clone, Debug)]
pub struct Plant {
    body: ModelVector,
    environment: Environment,
    segment: Segment,
    /// Simulated effects that the ideal plant does not have. They are boxed, so that the ideal plant stays small.
    effects: Option<Box<SimulatedEffects>>,
    /// Load of the last step; before the first step, that of the initial rotor speeds.
    load: Load,
    /// Rotor speeds of the last step of an ideal plant, initially hover speeds.
    speeds_rad_s: PerRotor,
    /// Hover speed of the fastest rotor of the nominal vehicle \[rad/s\].
    hover_rad_s: f64,
    steps: u64,
    time_s: f64,
}

impl Plant {
    /// Creates a vehicle with the motion `initial` at t = 0, ideal rotors, and only the environment's forces.
    pub fn new(model: PlantModel, initial: Motion, environment: Environment) -> Self {
        let body = ModelVector::new(model, &initial);
        let segment = environment.segment(0.0);
        let speeds_rad_s = environment.frame().hover_rad_s(environment.nominal());
        let hover_rad_s = speeds_rad_s.max();
        let load = Load::ideal(&segment, environment.frame(), &speeds_rad_s);
        Plant { body, environment, segment, effects: None, load, speeds_rad_s, hover_rad_s, steps: 0, time_s: 0.0 }
    }

    /// Creates a vehicle with realistic rotors, air and ground, for steps of `step_s`.
    ///
    /// # Errors
    /// Returns the first setting that is out of range.
    pub fn with_realism(
        model: PlantModel,
        initial: Motion,
        environment: Environment,
        realism: &Realism,
        step_s: f64,
    ) -> Result<Self, OutOfRange> {
        let effects = SimulatedEffects::new(realism, &environment, step_s)?;
        let ideal = Plant::new(model, initial, environment);
        Ok(Plant { load: effects.start(&ideal.segment), effects: Some(Box::new(effects)), ..ideal })
    }

    /// Advances the vehicle by `dt_s` with constant commanded rotor speeds. A rotor without a command stands still.
    /// Every call must use the `dt_s` for which the plant was created.
    #[inline]
    pub fn step<const N: usize>(&mut self, speeds: &RotorSpeeds<N>, dt_s: f64) {
        let speeds = &self.environment.frame().speeds(speeds);
        if self.time_s >= self.segment.until_s {
            self.segment = self.environment.segment(self.time_s);
        }
        if self.effects.is_some() {
            self.advance_in_effect(speeds, dt_s);
        } else {
            self.load = Load::ideal(&self.segment, self.environment.frame(), speeds);
            self.speeds_rad_s = *speeds;
            self.body.advance(&self.load, dt_s);
        }
        // Counted, not summed, so that time does not drift.
        self.steps += 1;
        self.time_s = self.steps as f64 * dt_s;
    }

    /// Advances with all effects of [`Realism`].
    // The function is not inlined, so that the ideal plant's step stays short.
    #[inline(never)]
    fn advance_in_effect(&mut self, speeds: &PerRotor, dt_s: f64) {
        let Some(effects) = &mut self.effects else { return };
        let (position, velocity) = self.body.place();
        let body = &self.body;
        // The axes are a closure, because they are needed only near the ground.
        let (load, surroundings) =
            effects.begin_step(speeds, &self.segment, self.time_s, &position, &velocity, || body.axes());
        self.load = load;
        if surroundings.are_empty() {
            self.body.advance(&self.load, dt_s);
        } else {
            self.body.advance_in(&self.load, &surroundings, dt_s);
        }
    }

    /// Sets the motion of the vehicle, as when a hand holds it.
    pub fn set_motion(&mut self, motion: &Motion) {
        let model = match &self.body {
            ModelVector::Simplified(_) => PlantModel::Simplified,
            ModelVector::RigidBody(_) => PlantModel::RigidBody,
        };
        self.body = ModelVector::new(model, motion);
    }

    /// Returns the input of the instruments: the present motion with its accelerations by the forces of the last step.
    pub fn truth(&self) -> Truth {
        let Segment { parameters, ratios, .. } = &self.segment;
        let (position_m, velocity_m_s) = self.body.place();
        let surroundings =
            self.effects.as_ref().map(|effects| effects.surroundings(ratios, position_m.z, velocity_m_s.z));
        let (acceleration_m_s2, angular) = self.body.accelerations(&self.load, surroundings.as_ref());
        let (attitude, rates_rad_s, angular_acceleration_rad_s2) = match &self.body {
            ModelVector::RigidBody(x) => ([x[6], x[7], x[8], x[9]], Vector3::new(x[10], x[11], x[12]), angular),
            ModelVector::Simplified(x) => {
                let Motion { attitude_rad, rates_rad_s, .. } = simplified::motion(x);
                let (rates, angular) = simplified::body_rates(&attitude_rad, &rates_rad_s, &angular);
                (rigid_body::quaternion(&attitude_rad), rates, angular)
            }
        };
        let [w, x, y, z] = attitude;
        Truth {
            time_s: self.time_s,
            position_m,
            velocity_m_s,
            attitude: Quaternion::new(w, x, y, z),
            rates_rad_s,
            acceleration_m_s2,
            angular_acceleration_rad_s2,
            gravity_m_s2: parameters.gravity_m_s2,
            rotor_speeds_rad_s: self.telemetry().map_or(self.speeds_rad_s, |telemetry| telemetry.rotor_speeds_rad_s),
            hover_rad_s: self.hover_rad_s,
            thrust_share: self.load.thrust_m_s2() * parameters.mass_kg / self.environment.nominal().weight_n(),
        }
    }

    /// Returns the present true motion.
    #[inline]
    pub fn motion(&self) -> Motion {
        match &self.body {
            ModelVector::Simplified(x) => simplified::motion(x),
            ModelVector::RigidBody(x) => rigid_body::motion(x),
        }
    }

    /// Returns the state of rotors, air and ground after the last step, or at rest before the first. `None` for an
    /// ideal plant.
    pub fn telemetry(&self) -> Option<EffectsState> {
        self.effects.as_ref().map(|effects| effects.telemetry())
    }

    /// Returns the time since the start \[s\].
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Changes gusts, parameters and payloads from the next step on, each at its times. The frame stays.
    pub fn set_environment(&mut self, environment: Environment) {
        self.environment = environment.with_frame(*self.environment.frame());
        self.segment = self.environment.segment(self.time_s);
    }

    /// Changes the wind from the next step on. The wind has no effect without drag. An ideal plant has no air.
    ///
    /// # Errors
    /// Returns the first parameter that is out of range, and changes nothing then.
    pub fn set_wind(&mut self, wind: &Wind) -> Result<(), OutOfRange> {
        self.effects.as_mut().map_or(Ok(()), |effects| effects.set_wind(wind))
    }

    /// Changes the rotor faults from the next step on. Rotors of an ideal plant do not fail.
    ///
    /// # Errors
    /// Returns the first number that is out of range, and changes nothing then.
    pub fn set_rotor_faults(&mut self, faults: Vec<RotorFault>) -> Result<(), OutOfRange> {
        self.effects.as_mut().map_or(Ok(()), |effects| effects.set_rotor_faults(faults))
    }

    /// Sets the battery's charge as a share of its capacity. Returns false without a battery.
    ///
    /// # Errors
    /// Returns an error if the share is out of range.
    pub fn set_charge(&mut self, share: f64) -> Result<bool, OutOfRange> {
        self.effects.as_mut().map_or(Ok(false), |effects| effects.set_charge(share))
    }

    /// Returns the environment.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }
}
