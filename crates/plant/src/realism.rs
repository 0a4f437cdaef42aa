//! Optional realistic effects that the paper's vehicle lacks.

use crate::battery::BatteryState;
use crate::body_axes::BodyAxes;
use crate::contact::{Contact, SimulatedGround};
use crate::drag::{Drag, HeldDrag};
use crate::environment::{Environment, Segment};
use crate::frame::{PerRotor, RotorLayout};
use crate::ground_effect::GroundEffect;
use crate::load::Load;
use crate::ratios::Ratios;
use crate::rotors::{RotorFault, Rotors, SimulatedRotors};
use crate::surroundings::AirAndGround;
use crate::wind::{SimulatedWind, Wind};
use afbc_types::{Declared, OutOfRange, Range};
use alloc::vec::Vec;
use nalgebra::Vector3;

/// Accepted range of a time step \[s\].
pub const STEP: Range = Range::new("step_s", 1e-5, 0.02);

/// Effects added by [`Plant::with_realism`](crate::Plant::with_realism). The default adds nothing: it equals the
/// paper's plant bit for bit, as long as no rotor is commanded beyond 10,000 rad/s.
///
/// The measurement is separate: [`StateSensor`](crate::StateSensor), between the plant and its controller.
///
/// During a step, commanded speeds, wind, ground effect and battery voltage keep their values from its start, and rotor
/// speeds their values at its middle. Drag and ground contact are evaluated at every stage of the Runge-Kutta method.
/// All effects apply to both models; the simplified model uses d eta/dt as Omega here as well.
///
/// ```
/// use afbc_types::{Parameters, RotorSpeeds};
/// use nalgebra::{Vector3, Vector4};
/// use afbc_plant::{Drag, Environment, Motion, Plant, PlantModel, Realism, Rotors, Turbulence, Wind};
///
/// let realism = Realism {
///     rotors: Rotors { time_constant_s: 0.02, max_rad_s: 317.0, delay_s: 0.001, ..Rotors::default() },
///     drag: Some(Drag::PAPER),
///     wind: Wind {
///         steady_m_s: Vector3::new(5.0, 0.0, 0.0),
///         turbulence: Some(Turbulence::LIGHT),
///         ..Wind::default()
///     },
///     seed: 7,
///     ..Realism::default()
/// };
/// let environment = Environment::calm(Parameters::PAPER)?;
/// let mut plant = Plant::with_realism(PlantModel::RigidBody, Motion::default(), environment, &realism, 0.001)?;
/// for _ in 0..100 {
///     plant.step(&RotorSpeeds(Vector4::repeat(199.9)), 0.001);
/// }
/// assert!(plant.motion().velocity_m_s.x > 0.1); // blown away
/// # Ok::<(), afbc_types::OutOfRange>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Realism {
    /// Rotor lag, limits, delay, faults and battery.
    pub rotors: Rotors,
    /// Blade and body drag. Without it, the air has no effect.
    pub drag: Option<Drag>,
    /// Steady wind, gusts and turbulence.
    pub wind: Wind,
    /// Contact with the ground.
    pub contact: Option<Contact>,
    /// Additional thrust near the ground.
    pub ground_effect: Option<GroundEffect>,
    /// Seed of all random effects in the plant. The same seed gives the same flight.
    pub seed: u64,
}

/// State of rotors, air, ground and battery after a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectsState {
    /// Rotor speeds at the end of the step \[rad/s\]; 0 for rotors that the vehicle does not have.
    pub rotor_speeds_rad_s: PerRotor,
    /// Velocity of the air, earth frame \[m/s\].
    pub wind_m_s: Vector3<f64>,
    /// Thrust divided by its value far from the ground.
    pub thrust_ratio: f64,
    /// True if a foot or a rotor touched the ground at the start of the step.
    pub on_ground: bool,
    /// State of the battery, if there is one.
    pub battery: Option<BatteryState>,
}

/// Effects of [`Realism`] in simulation.
#[derive(Clone, Debug)]
pub(crate) struct SimulatedEffects {
    frame: RotorLayout,
    spin: SimulatedRotors,
    drag: Option<Drag>,
    /// Drag at the rotor speeds of the last step, `None` before the first step.
    held: Option<HeldDrag>,
    weather: SimulatedWind,
    ground: Option<SimulatedGround>,
    ground_effect: Option<GroundEffect>,
    wind_m_s: Vector3<f64>,
    thrust_ratio: f64,
    on_ground: bool,
}

impl SimulatedEffects {
    pub(crate) fn new(realism: &Realism, environment: &Environment, step_s: f64) -> Result<Self, OutOfRange> {
        let Realism { rotors, drag, wind, contact, ground_effect, seed } = realism;
        let (vehicle, frame) = (environment.nominal(), environment.frame());
        STEP.check(step_s)?;
        let spin = SimulatedRotors::new(rotors.clone(), vehicle, frame, step_s)?;
        let weather = SimulatedWind::new(wind.clone(), *seed, step_s)?;
        if let Some(drag) = drag {
            drag.validate_for(vehicle, frame, rotors.max_rad_s, step_s)?;
        }
        if let Some(contact) = contact {
            contact.validate_for(vehicle, step_s)?;
        }
        if let Some(ground_effect) = ground_effect {
            ground_effect.validate()?;
        }
        Ok(SimulatedEffects {
            frame: *frame,
            spin,
            drag: *drag,
            held: None,
            weather,
            ground: contact.map(|contact| contact.ground(vehicle)),
            ground_effect: *ground_effect,
            wind_m_s: Vector3::zeros(),
            thrust_ratio: 1.0,
            on_ground: false,
        })
    }

    /// Computes the forces of the step that begins at `time_s` with this position and velocity.
    #[inline]
    pub(crate) fn begin_step<'a>(
        &'a mut self,
        speeds: &PerRotor,
        segment: &'a Segment,
        time_s: f64,
        position_m: &Vector3<f64>,
        velocity_m_s: &Vector3<f64>,
        axes: impl FnOnce() -> BodyAxes,
    ) -> (Load, AirAndGround<'a>) {
        let Segment { parameters, ratios, .. } = segment;
        let drive = self.spin.advance(&self.frame, speeds, time_s, parameters.drag_factor_n_m_s2);
        self.wind_m_s = self.weather.advance(time_s, position_m.z, velocity_m_s);
        if let Some(effect) = &self.ground_effect {
            self.thrust_ratio = effect.thrust_ratio(position_m.z);
        }
        let [speeds, squares] = [&drive.speeds_rad_s, &drive.squares].map(|values| self.frame.sums(values));
        self.held = self.drag.as_ref().map(|drag| drag.held(&speeds, parameters.arm_m));
        let ground = self.near(position_m.z, velocity_m_s.z);
        self.on_ground = ground.is_some_and(|ground| ground.touches(position_m.z, &axes()));
        let load = Load::of_rotors(segment, [&speeds, &squares], self.thrust_ratio);
        (load, self.surroundings(ratios, position_m.z, velocity_m_s.z))
    }

    /// Returns the load of the rotors at their present speeds, before the first step.
    pub(crate) fn start(&self, segment: &Segment) -> Load {
        let [speeds, squares] = [self.spin.speeds_rad_s, self.spin.squares()].map(|values| self.frame.sums(&values));
        Load::of_rotors(segment, [&speeds, &squares], self.thrust_ratio)
    }

    /// Returns air and ground for this height and climb rate, with the wind and rotors of the last step.
    #[inline]
    pub(crate) fn surroundings<'a>(&'a self, ratios: &'a Ratios, height_m: f64, climb_m_s: f64) -> AirAndGround<'a> {
        AirAndGround::new(ratios, self.held.as_ref(), self.wind_m_s, self.near(height_m, climb_m_s))
    }

    /// Returns the ground if the vehicle can reach it within a step.
    #[inline]
    fn near(&self, height_m: f64, climb_m_s: f64) -> Option<&SimulatedGround> {
        self.ground.as_ref().filter(|ground| ground.is_near(height_m, climb_m_s))
    }

    /// # Errors
    /// Returns the first parameter that is out of range, and changes nothing then. The same holds for the next setters.
    pub(crate) fn set_wind(&mut self, wind: &Wind) -> Result<(), OutOfRange> {
        self.weather.change(wind)
    }

    pub(crate) fn set_rotor_faults(&mut self, faults: Vec<RotorFault>) -> Result<(), OutOfRange> {
        self.spin.set_faults(&self.frame, faults)
    }

    pub(crate) fn set_charge(&mut self, share: f64) -> Result<bool, OutOfRange> {
        self.spin.set_charge(share)
    }

    pub(crate) fn telemetry(&self) -> EffectsState {
        EffectsState {
            rotor_speeds_rad_s: self.spin.speeds_rad_s,
            wind_m_s: self.wind_m_s,
            thrust_ratio: self.thrust_ratio,
            on_ground: self.on_ground,
            battery: self.spin.charge(),
        }
    }
}
