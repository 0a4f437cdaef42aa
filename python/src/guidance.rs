//! The class `Guidance`: flight modes, step by step.

use crate::argument::{CallArg, finite, optional};
use crate::error::error;
use crate::flight_core::words;
use crate::motion::{PySetpoint, vector};
use crate::plant::{StateArgument, step_s};
use crate::vehicle::{VehicleArgument, flown};
use afbc_flight_core::{Mode, Ticketed};
use afbc_guidance::{
    AvailableThrust, FailedSensors, FlightMode, Guidance, GuidanceInputs, GuidanceOutputs, Order, Orders, Sticks,
};
use afbc_types::Stamped;
use pyo3::prelude::*;

/// Modes that work with the inputs of this class.
const MODES: [FlightMode; 6] = [
    FlightMode::Hold,
    FlightMode::Land,
    FlightMode::Return,
    FlightMode::Position,
    FlightMode::Altitude,
    FlightMode::Stabilised,
];
const FLYING: [(&str, Mode); 4] = [
    ("disarmed", Mode::Disarmed),
    ("flying", Mode::Flying),
    ("coasting", Mode::Coasting),
    ("descending", Mode::Descending),
];

/// The firmware's flight modes, trajectory limiter and safety net. They turn orders and sticks into setpoints, step by
/// step.
#[pyclass(name = "Guidance", module = "afbc")]
pub(crate) struct PyGuidance {
    guidance: Guidance,
    orders: Orders,
    lift: AvailableThrust,
    dt_s: f64,
    now_us: u64,
    guided: Option<GuidanceOutputs>,
}

impl PyGuidance {
    fn order(&mut self, order: Order) -> PyResult<()> {
        let full = || error("eight orders are waiting already; call step, which answers one");
        self.orders.given.push_back(Ticketed { value: order, ticket: 0 }).map_err(|_| full())
    }
}

#[pymethods]
impl PyGuidance {
    /// Makes the guidance with the settings of this vehicle's file, or of the paper's vehicle, for steps of `dt_s` [s].
    #[new]
    #[pyo3(
        signature = (vehicle=None, *, dt_s=CallArg::Default(0.001)),
        text_signature = "(vehicle=None, *, dt_s=0.001)"
    )]
    fn new(vehicle: Option<CallArg<'_, VehicleArgument<'_>>>, dt_s: CallArg<'_, f64>) -> PyResult<Self> {
        let dt_s = step_s(&dt_s)?;
        let vehicle = flown(vehicle.as_ref())?;
        let mass_kg = vehicle.parameters.mass_kg;
        let lift = AvailableThrust {
            most_m_s2: (vehicle.rotors.len() as f64 * vehicle.force_max_n / mass_kg) as f32,
            gravity_m_s2: vehicle.parameters.gravity_m_s2 as f32,
            given_m_s2: None,
        };
        let guidance = Guidance::new(vehicle.guidance).map_err(error)?;
        Ok(PyGuidance { guidance, orders: Orders::default(), lift, dt_s, now_us: 0, guided: None })
    }

    /// Orders a take-off to a height above the ground where the vehicle stands [m], by default that of the settings.
    #[pyo3(signature = (height_m=None))]
    fn take_off(&mut self, height_m: Option<CallArg<'_, f64>>) -> PyResult<()> {
        let height_m = optional(height_m.as_ref(), "height_m")?.map(|height_m| finite("height_m", height_m));
        self.order(Order::TakeOff(height_m.transpose()?.map(|height_m| height_m as f32)))
    }

    /// Orders a flight to a position [m], to hold there. NaN keeps a coordinate. The heading [rad] stays as it is if
    /// `yaw_rad` is None or NaN. `speed_m_s` is the horizontal speed.
    #[pyo3(signature = (position_m, yaw_rad=None, speed_m_s=None))]
    fn go_to(
        &mut self,
        position_m: CallArg<'_, [f64; 3]>,
        yaw_rad: Option<CallArg<'_, f64>>,
        speed_m_s: Option<CallArg<'_, f64>>,
    ) -> PyResult<()> {
        let position_m = position_m.named("position_m")?;
        // NaN has a meaning here; infinity is refused.
        let kept = |name, value: f64| if value.is_nan() { Ok(value) } else { finite(name, value) };
        position_m.iter().try_for_each(|value| kept("position_m", *value).map(drop))?;
        let yaw_rad = kept("yaw_rad", optional(yaw_rad.as_ref(), "yaw_rad")?.unwrap_or(f64::NAN))? as f32;
        let speed_m_s = optional(speed_m_s.as_ref(), "speed_m_s")?;
        let speed_m_s = speed_m_s.map(|speed_m_s| finite("speed_m_s", speed_m_s)).transpose()?;
        let speed_m_s = speed_m_s.map(|speed_m_s| speed_m_s as f32);
        self.order(Order::GoTo { position_m: vector(position_m), yaw_rad, speed_m_s })
    }

    /// Orders a flight mode: "hold", "land", "return", or a mode flown by sticks, "position", "altitude", "stabilised".
    fn select(&mut self, mode: CallArg<'_, String>) -> PyResult<()> {
        let mode = mode.named("mode")?;
        let known = MODES.into_iter().find(|known| words(known) == mode);
        let known = known.ok_or_else(|| {
            let names = MODES.map(|known| words(&known)).join(", ");
            error(format!("{mode}: no such mode; the modes are {names}"))
        })?;
        self.order(Order::Select(known))
    }

    /// Sets the pilot's sticks, each from -1 to 1. Roll and yaw are positive to the right, pitch forward, throttle up.
    /// The middle of the throttle is 0.
    fn sticks(
        &mut self,
        roll: CallArg<'_, f64>,
        pitch: CallArg<'_, f64>,
        yaw: CallArg<'_, f64>,
        throttle: CallArg<'_, f64>,
    ) -> PyResult<()> {
        let stick = |stick: CallArg<'_, f64>, name| match stick.named(name)? {
            value if (-1.0..=1.0).contains(&value) => Ok(value as f32),
            value => Err(error(format!("{name}: {value} given; a stick must be within -1 to 1"))),
        };
        let (roll, pitch) = (stick(roll, "roll")?, stick(pitch, "pitch")?);
        let (yaw, throttle) = (stick(yaw, "yaw")?, stick(throttle, "throttle")?);
        let value = Sticks { roll, pitch, throttle, yaw };
        self.orders.sticks = Some(Stamped { value, at_us: self.now_us });
        Ok(())
    }

    /// Performs a step with the state, if it is known, and outputs of a flight core: its mode such as "flying", whether
    /// the vehicle is airborne and rested, and its commanded thrust divided by the mass [m/s2]. Returns the setpoint,
    /// if there is one.
    #[pyo3(signature = (state, core="flying", *, airborne=true, rested=true, thrust_m_s2=None))]
    fn step(
        &mut self,
        state: Option<StateArgument<'_>>,
        core: &str,
        airborne: bool,
        rested: bool,
        thrust_m_s2: Option<CallArg<'_, f64>>,
    ) -> PyResult<Option<PySetpoint>> {
        let state = optional(state.as_ref(), "state")?;
        let thrust_m_s2 = optional(thrust_m_s2.as_ref(), "thrust_m_s2")?;
        let thrust_m_s2 = thrust_m_s2.map(|thrust_m_s2| finite("thrust_m_s2", thrust_m_s2)).transpose()?;
        let known = FLYING.iter().find(|(name, _)| *name == core);
        let (_, core) = known.ok_or_else(|| {
            let names = FLYING.map(|(name, _)| name).join(", ");
            error(format!("{core}: no such mode of a flight core; the modes are {names}"))
        })?;
        self.now_us += (self.dt_s * 1e6).round() as u64;
        if let Some(sticks) = &mut self.orders.sticks {
            sticks.at_us = self.now_us; // the sticks stay where they are
        }
        let inputs = GuidanceInputs {
            now_us: self.now_us,
            dt_s: self.dt_s as f32,
            state: state.as_ref().map(|state| &state.get().0),
            reset: None,
            core: *core,
            airborne,
            rested,
            battery: None,
            sensors: FailedSensors::default(),
            available_thrust: AvailableThrust {
                given_m_s2: thrust_m_s2.map(|thrust_m_s2| thrust_m_s2 as f32),
                ..self.lift
            },
        };
        let guided = self.guidance.tick(&inputs, &self.orders);
        self.orders.given.pop_front();
        self.guided = Some(guided);
        Ok(guided.setpoint.map(PySetpoint))
    }

    /// Flight mode, such as "hold", "takeoff", "land" or "return".
    #[getter]
    fn mode(&self) -> String {
        words(&self.guidance.mode())
    }

    /// Answer of the last step to an order: "granted" or the reason for the refusal; None without an order.
    #[getter]
    fn answer(&self) -> Option<String> {
        let (_, result) = self.guided?.answer?;
        Some(result.map_or_else(|refusal| words(&refusal), |()| "granted".into()))
    }

    /// True if the motors of the armed vehicle shall idle on the ground.
    #[getter]
    fn idle_on_ground(&self) -> bool {
        self.guided.is_some_and(|guided| guided.idle_on_ground)
    }

    /// Request of the guidance to the flight core: "arm" or "disarm"; None for no request.
    #[getter]
    fn request(&self) -> Option<String> {
        Some(words(&self.guided?.request?))
    }

    /// Reason why the safety net acts; None if it does not.
    #[getter]
    fn failsafe(&self) -> Option<String> {
        Some(words(&self.guided?.failsafe?))
    }
}
