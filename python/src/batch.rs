//! The class `Batch`: many vehicles stepped in one call.

use crate::argument::{ArgumentArray, CallArg, SEEDS, optional};
use crate::error::error;
use crate::plant::{StateArgument, begun, commands, start, step_s};
use crate::scenario::{ScenarioArgument, asked};
use crate::vehicle::VehicleArgument;
use crate::work::in_slices;
use afbc_scenario::Scenario;
use afbc_sim::flight::{World, WorldView};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use rayon::prelude::*;

/// Length of a state vector.
const STATE: usize = 12;
/// Length of a reference vector: position, velocity, acceleration, heading.
const REFERENCE: usize = 10;
/// Largest number of worlds, which take some 2 GB.
const COUNT_MAX: u64 = 100_000;
/// Largest number of steps in one call: more than a quarter of an hour at 1 kHz.
const STEPS_MAX: u64 = 1_000_000;
/// Number of steps of single vehicles between checks for Ctrl-C, a few hundredths of a second.
const SLICE: usize = 20_000;

/// Simulated worlds of one scenario with consecutive seeds, stepped together on all cores without the GIL.
#[pyclass(name = "Batch", module = "afbc")]
pub(crate) struct PyBatch {
    scenario: Scenario,
    worlds: Vec<(World, WorldView)>,
    dt_s: f64,
}

impl PyBatch {
    fn begin(&self, seed: u64) -> PyResult<(World, WorldView)> {
        start(&Scenario { seed, ..self.scenario.clone() }, self.dt_s)
    }

    /// Returns an array with a row of `width` numbers for every vehicle.
    fn rows<'py>(
        &self,
        py: Python<'py>,
        width: usize,
        row: impl Fn(&(World, WorldView)) -> Vec<f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let numbers: Vec<f64> = self.worlds.iter().flat_map(row).collect();
        PyArray1::from_vec(py, numbers).reshape([self.worlds.len(), width])
    }
}

#[pymethods]
impl PyBatch {
    /// Makes `count` worlds of a scenario. The seeds are consecutive, from `seed` or the scenario's own seed on.
    #[new]
    #[pyo3(
        signature = (count, scenario=None, *, vehicle=None, seed=None, dt_s=CallArg::Default(0.001)),
        text_signature = "(count, scenario=None, *, vehicle=None, seed=None, dt_s=0.001)"
    )]
    fn new(
        py: Python<'_>,
        count: CallArg<'_, u64>,
        scenario: Option<CallArg<'_, ScenarioArgument<'_>>>,
        vehicle: Option<CallArg<'_, VehicleArgument<'_>>>,
        seed: Option<CallArg<'_, u64>>,
        dt_s: CallArg<'_, f64>,
    ) -> PyResult<Self> {
        let count = count.within("count", 1..=COUNT_MAX)?;
        let scenario = asked(scenario.as_ref(), "hover", vehicle.as_ref(), seed.as_ref())?;
        let first = scenario.seed;
        if first > SEEDS.end() - count {
            return Err(error(format!(
                "seed: {first} given; counted from this seed, the last of {count} vehicles exceeds the largest \
                 seed; give a smaller seed"
            )));
        }
        let mut worlds = Vec::new();
        let full = |_| PyMemoryError::new_err(format!("count: {count} vehicles do not fit into memory; take fewer"));
        worlds.try_reserve_exact(count as usize).map_err(full)?;
        let mut batch = PyBatch { scenario, worlds, dt_s: step_s(&dt_s)? };
        for index in 0..count {
            let world = batch.begin(first + index)?;
            batch.worlds.push(world);
            if index % 256 == 0 {
                py.check_signals()?;
            }
        }
        Ok(batch)
    }

    fn __len__(&self) -> usize {
        self.worlds.len()
    }

    /// Moves every vehicle by `steps` steps with these commanded rotor speeds [rad/s], shape (count, rotors).
    #[pyo3(signature = (speeds_rad_s, steps=CallArg::Default(1)), text_signature = "($self, speeds_rad_s, steps=1)")]
    fn step(
        &mut self,
        py: Python<'_>,
        speeds_rad_s: CallArg<'_, ArgumentArray>,
        steps: CallArg<'_, u64>,
    ) -> PyResult<()> {
        let (count, rotors) = (self.worlds.len(), self.scenario.rotors.len());
        let speeds = speeds_rad_s.named("speeds_rad_s")?.shaped("speeds_rad_s", [Some(count), Some(rotors)])?;
        let speeds = speeds.chunks_exact(rotors).map(commands).collect::<PyResult<Vec<_>>>()?;
        let steps = steps.within("steps", 1..=STEPS_MAX)?;
        let slice = (SLICE / count).max(1) as u64;
        let worlds = &mut self.worlds;
        in_slices(py, steps, slice, |steps| {
            worlds.par_iter_mut().zip(&speeds).for_each(|((world, view), speeds)| {
                for _ in 0..steps {
                    world.advance(speeds);
                    // The world is observed in every step, since sensors and estimator only advance when they are read.
                    *view = world.look();
                }
            });
        })
    }

    /// Restarts vehicle `index` with this seed, from the scenario's start or from the motion `state`.
    #[pyo3(signature = (index, seed, state=None))]
    fn reset(
        &mut self,
        index: CallArg<'_, u64>,
        seed: CallArg<'_, u64>,
        state: Option<StateArgument<'_>>,
    ) -> PyResult<()> {
        let index = index.within("index", 0..=self.worlds.len() as u64 - 1)? as usize;
        let seed = seed.within("seed", SEEDS)?;
        let state = optional(state.as_ref(), "state")?;
        let scenario = begun(&self.scenario, state.as_ref().map(Bound::get))?;
        let world = start(&Scenario { seed, ..scenario }, self.dt_s)?;
        self.worlds.iter_mut().skip(index).take(1).for_each(|slot| *slot = world.clone());
        Ok(())
    }

    /// Time of each vehicle [s], shape (count,).
    #[getter]
    fn time_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.worlds.iter().map(|(_, view)| view.time_s))
    }

    /// States that reach the controllers, shape (count, 12): position, velocity, attitude, rates. NaN in an outage.
    #[getter]
    fn states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, STATE, |(_, view)| {
            view.state.map_or(vec![f64::NAN; STATE], |state| crate::motion::numbers(&state).to_vec())
        })
    }

    /// True states in double precision, shape (count, 12).
    #[getter]
    fn true_states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, STATE, |(_, WorldView { motion, .. })| {
            let parts = [&motion.position_m, &motion.velocity_m_s, &motion.attitude_rad, &motion.rates_rad_s];
            parts.into_iter().flat_map(|part| part.iter().copied()).collect()
        })
    }

    /// References, shape (count, 10): position, velocity, acceleration, heading.
    #[getter]
    fn references<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, REFERENCE, |(_, WorldView { reference, .. })| {
            let parts = [&reference.position_m, &reference.velocity_m_s, &reference.acceleration_m_s2];
            let numbers = parts.into_iter().flat_map(|part| part.iter().copied());
            numbers.chain([reference.yaw_rad]).collect()
        })
    }
}
