//! Physics of the vehicle in `f64`, without any controller: rotor speeds in, motion out.
//!
//! There are two models of the vehicle: [`simplified`], the paper's (6), and [`rigid_body`], the paper's (1)-(5) as
//! corrected. Both take gusts and changing parameters from an [`Environment`]. Both are integrated by the classical
//! fourth-order Runge-Kutta method with constant rotor speeds during a step.
//!
//! This is the paper's plant. [`Realism`] adds optional effects: rotors with lag, limits, delay, faults and a battery;
//! drag; wind with gusts and turbulence; ground. A [`StateSensor`] measures the motion for a controller like a perfect
//! tracker; [`SimulatedInstruments`] are the sensors of a real vehicle. Every flight is reproducible from a seed.
//!
//! [`afbc_types`] defines frames, units and the meaning of "(n)". Trigonometry comes from the `libm` crate, so a flight
//! gives the same bits on every host.
//!
//! ```
//! use afbc_types::{Parameters, RotorSpeeds};
//! use afbc_plant::{Environment, Motion, Plant, PlantModel};
//!
//! let environment = Environment::calm(Parameters::PAPER)?;
//! let mut plant = Plant::new(PlantModel::RigidBody, Motion::default(), environment);
//! for _ in 0..1000 {
//!     plant.step(&RotorSpeeds::<4>::default(), 0.001);
//! }
//! assert!((plant.motion().velocity_m_s.z + 9.81).abs() < 1e-9); // one second of free fall
//! # Ok::<(), afbc_types::OutOfRange>(())
//! ```
#![no_std]

extern crate alloc;

pub mod battery;
mod body_axes;
pub mod contact;
mod delay;
pub mod drag;
mod dropouts;
mod environment;
mod frame;
pub mod ground_effect;
pub mod instruments;
pub mod integrate;
mod load;
mod motion;
pub mod noise;
mod ratios;
mod realism;
pub mod rigid_body;
pub mod rotors;
mod sensor_fault;
pub mod sensors;
pub mod simplified;
mod surroundings;
mod truth;
pub mod turbulence;
mod vehicle;
pub mod wind;

pub use battery::{BatteryModel, BatteryState, Sag};
pub use contact::Contact;
pub use drag::Drag;
pub use dropouts::MeasurementDropouts;
pub use environment::{
    Environment, GUST_SIZE, Gust, GustKind, PAYLOAD_AHEAD, PAYLOAD_BELOW, PAYLOAD_LEFT, PAYLOAD_MASS, Payload,
    PlantParameter, PlantParameterChange, START,
};
pub use frame::{PerRotor, RotorLayout};
pub use ground_effect::GroundEffect;
pub use instruments::{InstrumentReadings, InstrumentSuite, SimulatedInstruments};
pub use load::Load;
pub use motion::Motion;
pub use realism::{EffectsState, Realism, STEP};
pub use rotors::{RotorFault, RotorStart, Rotors};
pub use sensor_fault::{SensorFault, SensorFaultKind, SensorFaults};
pub use sensors::{Deviations, Sensing, StateMeasurement, StateSensor};
pub use truth::Truth;
pub use turbulence::Turbulence;
pub use vehicle::{Plant, PlantModel};
pub use wind::{CosineGust, Wind};
