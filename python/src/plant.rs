//! The class `Plant`: the simulated vehicle, step by step.

use crate::argument::{ArgumentArray, CallArg, optional};
use crate::error::error;
use crate::motion::{PySetpoint, PyState};
use crate::scenario::{ScenarioArgument, asked};
use crate::vehicle::VehicleArgument;
use afbc_control::Settings;
use afbc_plant::{Motion, Truth};
use afbc_scenario::Scenario;
use afbc_sim::flight::{World, WorldView};
use afbc_types::{ROTORS_MAX, RotorSpeeds};
use nalgebra::SVector;
use numpy::{PyArray1, ToPyArray};
use pyo3::prelude::*;

/// The world of a scenario without its controllers: plant with rotors, air, ground and battery, sensors, link and
/// reference. Faults and gusts come as the scenario says. `step` moves it; its attributes show the present time.
#[pyclass(name = "Plant", module = "afbc")]
pub(crate) struct PyPlant {
    scenario: Scenario,
    world: World,
    view: WorldView,
    dt_s: f64,
}

/// Argument that must be a state.
pub(crate) type StateArgument<'py> = CallArg<'py, Bound<'py, PyState>>;

/// Returns the time between steps of the argument `dt_s`.
pub(crate) fn step_s(dt_s: &CallArg<'_, f64>) -> PyResult<f64> {
    let dt_s = dt_s.named("dt_s")?;
    Settings::DT.range.check(dt_s).map_err(error)?;
    Ok(dt_s)
}

/// Returns the world of `scenario` and its first observation.
pub(crate) fn start(scenario: &Scenario, dt_s: f64) -> PyResult<(World, WorldView)> {
    let mut world = World::new(scenario, dt_s).map_err(error)?;
    let view = world.look();
    Ok((world, view))
}

/// Returns the scenario with this motion as its start, if one is given.
pub(crate) fn begun(scenario: &Scenario, state: Option<&PyState>) -> PyResult<Scenario> {
    let mut scenario = scenario.clone();
    if let Some(PyState(state)) = state {
        if !state.is_plausible() {
            return Err(error("state: finite numbers, within 1e5 m, 1e3 m/s, 1e3 rad and 1e3 rad/s, are needed"));
        }
        scenario.initial = Motion {
            position_m: state.position_m.cast(),
            velocity_m_s: state.velocity_m_s.cast(),
            attitude_rad: state.attitude_rad.cast(),
            rates_rad_s: state.rates_rad_s.cast(),
        };
        scenario.check().map_err(error)?;
    }
    Ok(scenario)
}

/// Largest speed that a rotor may be commanded [rad/s], far beyond that of any real rotor.
const SPEED_MAX_RAD_S: f64 = 1e5;

/// Returns the commanded rotor speeds, checked.
pub(crate) fn commands(speeds: &[f64]) -> PyResult<RotorSpeeds<ROTORS_MAX>> {
    if let Some(speed) = speeds.iter().find(|speed| !(0.0..=SPEED_MAX_RAD_S).contains(*speed)) {
        return Err(error(format!("speeds_rad_s: {speed} given; numbers from 0 to {SPEED_MAX_RAD_S} are needed")));
    }
    let speed = |i: usize| speeds.get(i).copied().unwrap_or_default() as f32;
    Ok(RotorSpeeds(SVector::from_fn(|i, _| speed(i))))
}

impl PyPlant {
    /// Returns the true motion that instruments measure.
    pub(crate) fn truth(&self) -> Truth {
        self.world.plant().truth()
    }
}

#[pymethods]
impl PyPlant {
    /// Makes the world of a scenario, by default "hover", for steps of `dt_s` [s].
    #[new]
    #[pyo3(
        signature = (scenario=None, *, vehicle=None, seed=None, dt_s=CallArg::Default(0.001)),
        text_signature = "(scenario=None, *, vehicle=None, seed=None, dt_s=0.001)"
    )]
    fn new(
        scenario: Option<CallArg<'_, ScenarioArgument<'_>>>,
        vehicle: Option<CallArg<'_, VehicleArgument<'_>>>,
        seed: Option<CallArg<'_, u64>>,
        dt_s: CallArg<'_, f64>,
    ) -> PyResult<Self> {
        let scenario = asked(scenario.as_ref(), "hover", vehicle.as_ref(), seed.as_ref())?;
        let dt_s = step_s(&dt_s)?;
        let (world, view) = start(&scenario, dt_s)?;
        Ok(PyPlant { scenario, world, view, dt_s })
    }

    /// Restarts the world, optionally with another seed or from another motion.
    #[pyo3(signature = (seed=None, state=None))]
    fn reset(&mut self, seed: Option<CallArg<'_, u64>>, state: Option<StateArgument<'_>>) -> PyResult<()> {
        let state = optional(state.as_ref(), "state")?;
        let mut scenario = begun(&self.scenario, state.as_ref().map(Bound::get))?;
        scenario.seed = crate::argument::seed(seed.as_ref())?.unwrap_or(scenario.seed);
        (self.world, self.view) = start(&scenario, self.dt_s)?;
        self.scenario = scenario;
        Ok(())
    }

    /// Moves the vehicle by one step with these commanded rotor speeds [rad/s], shape (rotors,).
    fn step(&mut self, speeds_rad_s: CallArg<'_, ArgumentArray>) -> PyResult<()> {
        let rotors = self.scenario.rotors.len();
        let speeds = speeds_rad_s.named("speeds_rad_s")?.shaped("speeds_rad_s", [Some(rotors)])?;
        self.world.advance(&commands(&speeds)?);
        self.view = self.world.look();
        Ok(())
    }

    /// Time [s].
    #[getter]
    fn time_s(&self) -> f64 {
        self.view.time_s
    }

    /// Time between steps [s].
    #[getter]
    fn dt_s(&self) -> f64 {
        self.dt_s
    }

    /// State that reaches the controller: measured by the scenario's sensors or estimated by the vehicle, and held
    /// between samples. None in a dropout or an outage.
    #[getter]
    fn state(&self) -> Option<PyState> {
        self.view.state.map(PyState)
    }

    /// The true state, as a perfect sensor would measure it.
    #[getter]
    fn true_state(&self) -> PyState {
        PyState(self.view.motion.measure())
    }

    /// The twelve numbers of the true state in double precision.
    #[getter]
    fn true_vector<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let motion = &self.view.motion;
        let parts = [&motion.position_m, &motion.velocity_m_s, &motion.attitude_rad, &motion.rates_rad_s];
        PyArray1::from_iter(py, parts.into_iter().flat_map(|part| part.iter().copied()))
    }

    /// Reference of the scenario at this time.
    #[getter]
    fn setpoint(&self) -> PySetpoint {
        PySetpoint(self.view.reference.setpoint())
    }

    /// True rotor speeds [rad/s], shape (rotors,); zero before the first step of an ideal plant.
    #[getter]
    fn rotor_speeds_rad_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let truth = self.world.plant().truth();
        PyArray1::from_iter(py, truth.rotor_speeds_rad_s.iter().take(self.scenario.rotors.len()).copied())
    }

    /// Reading of a perfect accelerometer at the centre of mass, body frame [m/s2], shape (3,).
    #[getter]
    fn specific_force_m_s2<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        <[f64; 3]>::from(self.world.plant().truth().specific_force_m_s2()).to_pyarray(py)
    }

    /// Wind at the vehicle, earth frame [m/s], shape (3,).
    #[getter]
    fn wind_m_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let wind = self.view.telemetry.map_or([0.0; 3], |telemetry| telemetry.wind_m_s.into());
        wind.to_pyarray(py)
    }

    /// True if the vehicle stands on the ground.
    #[getter]
    fn on_ground(&self) -> bool {
        self.view.telemetry.is_some_and(|telemetry| telemetry.on_ground)
    }
}
