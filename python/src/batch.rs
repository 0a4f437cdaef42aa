//! Many vehicles in one call.

use crate::error::error;
use crate::motion::PyState;
use crate::plant::{begun, commands, start};
use crate::scenario::{ScenarioArgument, changed};
use crate::vehicle::VehicleArgument;
use afbc_scenario::Scenario;
use afbc_sim::flight::{View, World};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;

/// Numbers of a state.
const STATE: usize = 12;
/// Numbers of a reference: position, velocity, acceleration, heading.
const REFERENCE: usize = 10;

/// Worlds of one scenario with consecutive seeds, stepped together on all cores without the GIL.
#[pyclass(name = "Batch", module = "afbc")]
pub(crate) struct PyBatch {
    scenario: Scenario,
    worlds: Vec<(World, View)>,
    dt_s: f64,
}

impl PyBatch {
    fn begin(&self, index: usize, seed: u64) -> PyResult<(World, View)> {
        start(&Scenario { seed: seed + index as u64, ..self.scenario.clone() }, self.dt_s)
    }

    /// Numbers of every vehicle, in rows of `width`.
    fn rows<'py>(
        &self,
        py: Python<'py>,
        width: usize,
        row: impl Fn(&(World, View)) -> Vec<f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let numbers: Vec<f64> = self.worlds.iter().flat_map(row).collect();
        PyArray1::from_vec(py, numbers).reshape([self.worlds.len(), width])
    }
}

#[pymethods]
impl PyBatch {
    /// Makes `count` worlds of a scenario, seeds from the scenario's own or from `seed` on.
    #[new]
    #[pyo3(signature = (count, scenario=None, *, vehicle=None, seed=None, dt_s=0.001))]
    fn new(
        count: usize,
        scenario: Option<ScenarioArgument<'_>>,
        vehicle: Option<VehicleArgument<'_>>,
        seed: Option<u64>,
        dt_s: f64,
    ) -> PyResult<Self> {
        let scenario = scenario.unwrap_or(ScenarioArgument::Path("hover".into())).scenario()?;
        let scenario = changed(scenario, vehicle.as_ref(), seed, None)?;
        let seed = scenario.seed;
        let mut batch = PyBatch { scenario, worlds: Vec::new(), dt_s };
        batch.worlds = (0..count).map(|index| batch.begin(index, seed)).collect::<PyResult<_>>()?;
        Ok(batch)
    }

    fn __len__(&self) -> usize {
        self.worlds.len()
    }

    /// Moves every vehicle by `steps` steps with these commanded rotor speeds [rad/s], shape (count, rotors).
    #[pyo3(signature = (speeds_rad_s, steps=1))]
    fn step(&mut self, py: Python<'_>, speeds_rad_s: PyReadonlyArray2<'_, f64>, steps: u32) -> PyResult<()> {
        let (given, rotors) = (speeds_rad_s.as_array(), self.scenario.rotors.len());
        let [rows, columns] = [given.nrows(), given.ncols()];
        if rows != self.worlds.len() {
            let needed = self.worlds.len();
            return Err(error(format!("speeds_rad_s: shape ({rows}, {columns}); ({needed}, {rotors}) is needed")));
        }
        let speeds = given.rows().into_iter().map(|row| commands(&row.to_vec(), rotors));
        let speeds = speeds.collect::<PyResult<Vec<_>>>()?;
        let worlds = &mut self.worlds;
        py.detach(|| {
            worlds.par_iter_mut().zip(&speeds).for_each(|((world, view), speeds)| {
                for _ in 0..steps {
                    world.advance(speeds);
                    // In every step, not in the last one alone: sensors and estimator go on by being read.
                    *view = world.look();
                }
            });
        });
        Ok(())
    }

    /// Starts vehicle `index` again, with this seed, from the scenario's start or this motion.
    #[pyo3(signature = (index, seed, state=None))]
    fn reset(&mut self, index: usize, seed: u64, state: Option<PyRef<'_, PyState>>) -> PyResult<()> {
        let count = self.worlds.len();
        let scenario = begun(&self.scenario, state.as_deref())?;
        let world = start(&Scenario { seed, ..scenario }, self.dt_s)?;
        let slot = self.worlds.get_mut(index);
        *slot.ok_or_else(|| error(format!("index {index}: there are {count} vehicles")))? = world;
        Ok(())
    }

    /// Time of each vehicle [s], shape (count,).
    #[getter]
    fn time_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.worlds.iter().map(|(_, view)| view.time_s))
    }

    /// What reaches the controllers, shape (count, 12): position, velocity, attitude, rates; NaN in an outage.
    #[getter]
    fn states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, STATE, |(_, view)| {
            view.state.map_or(vec![f64::NAN; STATE], |state| crate::motion::numbers(&state).to_vec())
        })
    }

    /// True states in double precision, shape (count, 12).
    #[getter]
    fn true_states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, STATE, |(_, View { motion, .. })| {
            let parts = [&motion.position_m, &motion.velocity_m_s, &motion.attitude_rad, &motion.rates_rad_s];
            parts.into_iter().flat_map(|part| part.iter().copied()).collect()
        })
    }

    /// The references, shape (count, 10): position, velocity, acceleration, heading.
    #[getter]
    fn references<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, REFERENCE, |(_, View { reference, .. })| {
            let parts = [&reference.position_m, &reference.velocity_m_s, &reference.acceleration_m_s2];
            let numbers = parts.into_iter().flat_map(|part| part.iter().copied());
            numbers.chain([reference.yaw_rad]).collect()
        })
    }
}
