//! Vehicles.

use crate::error::error;
use afbc_types::Parameters;
use afbc_vehicles::{BUILT_IN, Vehicle};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// A vehicle: of the built-in ones by name, or of a file by path.
#[pyclass(name = "Vehicle", module = "afbc", frozen)]
pub(crate) struct PyVehicle(pub(crate) Vehicle);

/// A vehicle, or what names one.
#[derive(FromPyObject)]
pub(crate) enum VehicleArgument<'py> {
    Vehicle(Bound<'py, PyVehicle>),
    Path(PathBuf),
}

impl VehicleArgument<'_> {
    pub(crate) fn vehicle(&self) -> PyResult<Vehicle> {
        match self {
            VehicleArgument::Vehicle(vehicle) => Ok(vehicle.get().0.clone()),
            VehicleArgument::Path(path) => afbc_scenario::vehicle_named(path).map_err(error),
        }
    }
}

#[pymethods]
impl PyVehicle {
    #[new]
    fn new(name: PathBuf) -> PyResult<Self> {
        afbc_scenario::vehicle_named(&name).map(PyVehicle).map_err(error)
    }

    /// Reads the text of a vehicle file (TOML), as docs/vehicles.md describes it.
    #[staticmethod]
    #[pyo3(signature = (text, name="vehicle"))]
    fn from_toml(text: &str, name: &str) -> PyResult<Self> {
        afbc_vehicles::parse(name, text, name).map(PyVehicle).map_err(error)
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    #[getter]
    fn description(&self) -> &str {
        &self.0.description
    }

    /// Number of rotors.
    #[getter]
    fn rotors(&self) -> usize {
        self.0.rotors.len()
    }

    /// Largest force of one rotor [N].
    #[getter]
    fn rotor_force_max_n(&self) -> f64 {
        self.0.force_max_n
    }

    /// Lag of the rotors [s].
    #[getter]
    fn lag_s(&self) -> f32 {
        self.0.lag_s()
    }

    /// Positions of the rotors' hubs from the centre of mass, body frame [m], shape (rotors, 3).
    #[getter]
    fn rotor_positions_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (realism, arm_m) = (&self.0.realism, self.0.parameters.arm_m);
        let contact = realism.contact.map(|contact| contact.rotor_height_m);
        let height_m = realism.drag.map(|drag| drag.rotor_height_m).or(contact).unwrap_or_default();
        let numbers = self.0.rotors.iter().flat_map(|rotor| [rotor.x * arm_m, rotor.y * arm_m, height_m]);
        PyArray1::from_iter(py, numbers).reshape([self.0.rotors.len(), 3])
    }

    /// Direction of the moment by which each rotor's drag turns the body, shape (rotors,): 1 to positive yaw, by a
    /// rotor that turns clockwise seen from above; -1 by one that turns counter-clockwise.
    #[getter]
    fn rotor_yaw_signs<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.0.rotors.iter().map(|rotor| if rotor.pushes_left { 1.0 } else { -1.0 }))
    }

    /// Smallest and largest speed of a rotor [rad/s].
    #[getter]
    fn rotor_speed_limits_rad_s(&self) -> (f64, f64) {
        (self.0.realism.rotors.min_rad_s, self.0.realism.rotors.max_rad_s)
    }

    /// Drag by name, in SI, or None: `blade_n_s2_m`, the force of one rotor's blades per rotor speed and airspeed in
    /// its plane; `body_n_s2_m2`, the body's force along x, y, z per square of the airspeed; `centre_m`, where that
    /// acts.
    #[getter]
    fn drag<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(drag) = &self.0.realism.drag else { return Ok(None) };
        let dict = PyDict::new(py);
        dict.set_item("blade_n_s2_m", drag.blade_n_s2_m)?;
        dict.set_item("body_n_s2_m2", <[f64; 3]>::from(drag.area_m2 * (0.5 * drag.air_density_kg_m3)))?;
        dict.set_item("centre_m", <[f64; 3]>::from(drag.centre_m))?;
        Ok(Some(dict))
    }

    /// Nominal masses, inertia, arm and rotor factors by name, in SI.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        parameters(py, &self.0.parameters)
    }

    fn __repr__(&self) -> String {
        format!("Vehicle('{}')", self.0.name)
    }
}

/// Parameters by name.
pub(crate) fn parameters<'py>(py: Python<'py>, of: &Parameters<f64>) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("mass_kg", of.mass_kg)?;
    dict.set_item("arm_m", of.arm_m)?;
    dict.set_item("inertia_kg_m2", <[f64; 3]>::from(of.inertia_kg_m2))?;
    dict.set_item("rotor_inertia_kg_m2", of.rotor_inertia_kg_m2)?;
    dict.set_item("thrust_factor_n_s2", of.thrust_factor_n_s2)?;
    dict.set_item("drag_factor_n_m_s2", of.drag_factor_n_m_s2)?;
    dict.set_item("gravity_m_s2", of.gravity_m_s2)?;
    Ok(dict)
}

/// Names of the built-in vehicles.
#[pyfunction]
pub(crate) fn vehicles() -> Vec<&'static str> {
    BUILT_IN.iter().map(|known| known.name).collect()
}
