//! One vehicle in one environment, advanced in time.

use crate::body_axes::BodyAxes;
use crate::environment::{Environment, Segment};
use crate::frame::Lanes;
use crate::integrate::rk4;
use crate::load::Load;
use crate::motion::Motion;
use crate::realism::{Effects, Realism, Telemetry};
use crate::surroundings::Surroundings;
use crate::{rigid_body, simplified};
use afbc_types::{OutOfRange, RotorSpeeds};
use alloc::boxed::Box;
use nalgebra::Vector3;

/// Equations of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// (6), the paper's own simulation model.
    Simplified,
    /// (1)-(5) as corrected.
    RigidBody,
}

impl Model {
    /// Returns the lower-case name, as in scenario files and logs.
    pub const fn name(self) -> &'static str {
        match self {
            Model::Simplified => "simplified",
            Model::RigidBody => "rigid-body",
        }
    }
}

/// State vector of the chosen model.
#[derive(Clone, Debug)]
enum Body {
    Simplified(simplified::Vector),
    RigidBody(rigid_body::Vector),
}

impl Body {
    fn new(model: Model, initial: &Motion) -> Self {
        match model {
            Model::Simplified => Body::Simplified(simplified::vector(initial)),
            Model::RigidBody => Body::RigidBody(rigid_body::vector(initial)),
        }
    }

    /// Advances by `dt_s` under a constant load.
    #[inline]
    fn advance(&mut self, load: &Load, dt_s: f64) {
        match self {
            Body::Simplified(x) => *x = rk4(|x| simplified::derivative(x, load), x, dt_s),
            Body::RigidBody(x) => {
                *x = rk4(|x| rigid_body::derivative(x, load), x, dt_s);
                rigid_body::normalise(x);
            }
        }
    }

    /// Advances by `dt_s` under a constant load and forces that depend on position and velocity.
    #[inline]
    fn advance_in(&mut self, load: &Load, surroundings: &Surroundings, dt_s: f64) {
        match self {
            Body::Simplified(x) => *x = rk4(|x| simplified::derivative_in(x, load, surroundings), x, dt_s),
            Body::RigidBody(x) => {
                *x = rk4(|x| rigid_body::derivative_in(x, load, surroundings), x, dt_s);
                rigid_body::normalise(x);
            }
        }
    }

    /// Returns position and velocity.
    #[inline]
    fn place(&self) -> (Vector3<f64>, Vector3<f64>) {
        match self {
            Body::Simplified(x) => (x.fixed_rows::<3>(0).into(), x.fixed_rows::<3>(3).into()),
            Body::RigidBody(x) => (x.fixed_rows::<3>(0).into(), x.fixed_rows::<3>(3).into()),
        }
    }

    fn axes(&self) -> BodyAxes {
        match self {
            Body::Simplified(x) => simplified::body_axes(x),
            Body::RigidBody(x) => rigid_body::body_axes(x),
        }
    }
}

/// One vehicle in one environment.
#[derive(Clone, Debug)]
pub struct Plant {
    body: Body,
    environment: Environment,
    segment: Segment,
    /// Boxed, so that the ideal plant stays small.
    effects: Option<Box<Effects>>,
    steps: u64,
    time_s: f64,
}

impl Plant {
    /// Creates a vehicle with the motion `initial` at t = 0, ideal rotors, and no forces but those of the environment.
    pub fn new(model: Model, initial: Motion, environment: Environment) -> Self {
        let body = Body::new(model, &initial);
        let segment = environment.segment(0.0);
        Plant { body, environment, segment, effects: None, steps: 0, time_s: 0.0 }
    }

    /// Creates a vehicle with realistic rotors, air and ground, for steps of `step_s`.
    ///
    /// # Errors
    /// The first setting out of range.
    pub fn with_realism(
        model: Model,
        initial: Motion,
        environment: Environment,
        realism: &Realism,
        step_s: f64,
    ) -> Result<Self, OutOfRange> {
        let effects = Effects::new(realism, &environment, step_s)?;
        Ok(Plant { effects: Some(Box::new(effects)), ..Plant::new(model, initial, environment) })
    }

    /// Advances the vehicle by `dt_s` with constant commanded rotor speeds; a rotor without a command stands still.
    /// Every call must use the same `dt_s`, the one that the plant was created for.
    #[inline]
    pub fn step<const N: usize>(&mut self, speeds: &RotorSpeeds<N>, dt_s: f64) {
        let speeds = &self.environment.frame().speeds(speeds);
        if self.time_s >= self.segment.until_s {
            self.segment = self.environment.segment(self.time_s);
        }
        if self.effects.is_some() {
            self.advance_in_effect(speeds, dt_s);
        } else {
            let Segment { parameters, rig, a_force, a_moment, .. } = &self.segment;
            let load = Load::ideal(parameters, rig, self.environment.frame(), speeds, *a_force, *a_moment);
            self.body.advance(&load, dt_s);
        }
        // Counted, not summed, so that time does not drift.
        self.steps += 1;
        self.time_s = self.steps as f64 * dt_s;
    }

    /// Advances with all effects of [`Realism`].
    // Not inlined, so that the ideal plant's step stays short.
    #[inline(never)]
    fn advance_in_effect(&mut self, speeds: &Lanes, dt_s: f64) {
        let Some(effects) = &mut self.effects else { return };
        let (position, velocity) = self.body.place();
        let body = &self.body;
        let (load, surroundings) =
            effects.begin_step(speeds, &self.segment, self.time_s, &position, &velocity, || body.axes());
        if surroundings.are_empty() {
            self.body.advance(&load, dt_s);
        } else {
            self.body.advance_in(&load, &surroundings, dt_s);
        }
    }

    /// Returns the present true motion.
    #[inline]
    pub fn motion(&self) -> Motion {
        match &self.body {
            Body::Simplified(x) => simplified::motion(x),
            Body::RigidBody(x) => rigid_body::motion(x),
        }
    }

    /// Returns the state of rotors, air and ground after the last step, or at rest before the first. `None` for an
    /// ideal plant.
    pub fn telemetry(&self) -> Option<Telemetry> {
        self.effects.as_ref().map(|effects| effects.telemetry())
    }

    /// Returns the time since the start \[s\].
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Returns the environment.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }
}
