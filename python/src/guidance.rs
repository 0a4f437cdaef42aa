//! Flight modes, step by step.

use crate::error::error;
use crate::flight_core::words;
use crate::motion::{PySetpoint, PyState, vector};
use crate::vehicle::VehicleArgument;
use afbc_flight_core::{Mode, Ticketed};
use afbc_guidance::{FailedSensors, FlightMode, Guidance, GuidanceInputs, Guided, Lift, Order, Orders, Sticks};
use afbc_types::Stamped;
use pyo3::prelude::*;
use std::path::PathBuf;

/// Modes that are flown by what this class is given.
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

/// Flight modes, trajectory limiter and safety net of the firmware: setpoints from what somebody wants, step by step.
#[pyclass(name = "Guidance", module = "afbc")]
pub(crate) struct PyGuidance {
    guidance: Guidance,
    orders: Orders,
    lift: Lift,
    dt_s: f64,
    now_us: u64,
    guided: Option<Guided>,
}

impl PyGuidance {
    fn order(&mut self, order: Order) -> PyResult<()> {
        let full = || error("eight orders wait already; each step answers one");
        self.orders.given.push_back(Ticketed { value: order, ticket: 0 }).map_err(|_| full())
    }
}

#[pymethods]
impl PyGuidance {
    /// Makes the guidance with the settings of this vehicle's file, the paper's if none is given, for steps of `dt_s`
    /// [s].
    #[new]
    #[pyo3(signature = (vehicle=None, *, dt_s=0.001))]
    fn new(vehicle: Option<VehicleArgument<'_>>, dt_s: f64) -> PyResult<Self> {
        afbc_control::Settings::DT.range.check(dt_s).map_err(error)?;
        let vehicle = vehicle.unwrap_or(VehicleArgument::Path(PathBuf::from("paper"))).vehicle()?;
        let mass_kg = vehicle.parameters.mass_kg;
        let lift = Lift {
            most_m_s2: (vehicle.rotors.len() as f64 * vehicle.force_max_n / mass_kg) as f32,
            gravity_m_s2: vehicle.parameters.gravity_m_s2 as f32,
            given_m_s2: None,
        };
        let guidance = Guidance::new(vehicle.guidance).map_err(error)?;
        Ok(PyGuidance { guidance, orders: Orders::default(), lift, dt_s, now_us: 0, guided: None })
    }

    /// Orders to take off to a height above where it stands [m], or to that of the settings.
    #[pyo3(signature = (height_m=None))]
    fn take_off(&mut self, height_m: Option<f32>) -> PyResult<()> {
        self.order(Order::TakeOff(height_m))
    }

    /// Orders to fly to a place and to hold there [m]; NaN keeps a coordinate. Heading [rad] and horizontal speed
    /// [m/s] if they are given.
    #[pyo3(signature = (position_m, yaw_rad=f32::NAN, speed_m_s=None))]
    fn go_to(&mut self, position_m: [f64; 3], yaw_rad: f32, speed_m_s: Option<f32>) -> PyResult<()> {
        self.order(Order::GoTo { position_m: vector(position_m), yaw_rad, speed_m_s })
    }

    /// Orders a flight mode: "hold", "land", "return" or, flown by sticks, "position", "altitude", "stabilised".
    fn select(&mut self, mode: &str) -> PyResult<()> {
        let known = MODES.into_iter().find(|known| words(known) == mode);
        let known = known.ok_or_else(|| {
            let names = MODES.map(|known| words(&known)).join(", ");
            error(format!("{mode}: no such mode; they are {names}"))
        })?;
        self.order(Order::Select(known))
    }

    /// Sets a pilot's sticks, -1 to 1 each: roll and yaw positive to the right, pitch forward, throttle up, 0 in its
    /// middle.
    fn sticks(&mut self, roll: f32, pitch: f32, yaw: f32, throttle: f32) -> PyResult<()> {
        let given = [roll, pitch, yaw, throttle];
        if !given.iter().all(|stick| (-1.0..=1.0).contains(stick)) {
            return Err(error(format!("sticks: {given:?}; each is within -1 to 1")));
        }
        let value = Sticks { roll, pitch, throttle, yaw };
        self.orders.sticks = Some(Stamped { value, at_us: self.now_us });
        Ok(())
    }

    /// Performs a step with the state, if it is known, and what a flight core says: its mode ("flying"...), whether the
    /// vehicle is airborne and rested, and the thrust that it commands over mass [m/s2]. Returns the setpoint, if there
    /// is one.
    #[pyo3(signature = (state, core="flying", *, airborne=true, rested=true, thrust_m_s2=None))]
    fn step(
        &mut self,
        state: Option<PyRef<'_, PyState>>,
        core: &str,
        airborne: bool,
        rested: bool,
        thrust_m_s2: Option<f32>,
    ) -> PyResult<Option<PySetpoint>> {
        let known = FLYING.iter().find(|(name, _)| *name == core);
        let (_, core) = known.ok_or_else(|| {
            let names = FLYING.map(|(name, _)| name).join(", ");
            error(format!("{core}: no such mode of a flight core; they are {names}"))
        })?;
        self.now_us += (self.dt_s * 1e6).round() as u64;
        if let Some(sticks) = &mut self.orders.sticks {
            sticks.at_us = self.now_us; // they are held where they are
        }
        let inputs = GuidanceInputs {
            now_us: self.now_us,
            dt_s: self.dt_s as f32,
            state: state.as_deref().map(|state| &state.0),
            core: *core,
            airborne,
            rested,
            battery: None,
            sensors: FailedSensors::default(),
            lift: Lift { given_m_s2: thrust_m_s2, ..self.lift },
        };
        let guided = self.guidance.tick(&inputs, &self.orders);
        self.orders.given.pop_front();
        self.guided = Some(guided);
        Ok(guided.setpoint.map(PySetpoint))
    }

    /// The flight mode: "hold", "takeoff", "land", "return"...
    #[getter]
    fn mode(&self) -> String {
        words(&self.guidance.mode())
    }

    /// The answer of the last step to an order: "granted", or why not; None if nothing was ordered.
    #[getter]
    fn answer(&self) -> Option<String> {
        let (_, result) = self.guided?.answer?;
        Some(result.map_or_else(|refusal| words(&refusal), |()| "granted".into()))
    }

    /// True if the motors of the armed vehicle idle on the ground.
    #[getter]
    fn idle_on_ground(&self) -> bool {
        self.guided.is_some_and(|guided| guided.idle_on_ground)
    }

    /// What the guidance asks of the flight core: "arm", "disarm"; None for nothing.
    #[getter]
    fn request(&self) -> Option<String> {
        Some(words(&self.guided?.request?))
    }

    /// Why the safety net acts; None if it does not.
    #[getter]
    fn failsafe(&self) -> Option<String> {
        Some(words(&self.guided?.failsafe?))
    }
}
