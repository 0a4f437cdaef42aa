//! The class `Vehicle` and the function `vehicles`.

use crate::argument::{Argument, CallArg, wrong};
use crate::error::error;
use crate::source::PickledFile;
use afbc_types::Parameters;
use afbc_vehicles::{BUILT_IN, Vehicle};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// A vehicle: a built-in one by name, or one from a file by path.
#[pyclass(name = "Vehicle", module = "afbc", frozen)]
pub(crate) struct PyVehicle {
    pub(crate) vehicle: Vehicle,
    source: PickledFile,
}

/// A vehicle, or the name or path of one.
#[derive(Clone)]
pub(crate) enum VehicleArgument<'py> {
    Vehicle(Bound<'py, PyVehicle>),
    Path(PathBuf),
}

impl<'py> Argument<'py> for VehicleArgument<'py> {
    fn of(name: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(vehicle) = object.cast::<PyVehicle>() {
            return Ok(VehicleArgument::Vehicle(vehicle.clone()));
        }
        let path = object.extract().map_err(|_| wrong(name, "afbc.Vehicle, a name or a path is", object))?;
        Ok(VehicleArgument::Path(path))
    }
}

impl VehicleArgument<'_> {
    pub(crate) fn vehicle(&self) -> PyResult<Vehicle> {
        match self {
            VehicleArgument::Vehicle(vehicle) => Ok(vehicle.get().vehicle.clone()),
            VehicleArgument::Path(path) => afbc_scenario::vehicle_named(path).map_err(error),
        }
    }
}

/// Returns the vehicle of the argument `vehicle`; none if it was not given.
pub(crate) fn given(vehicle: Option<&CallArg<'_, VehicleArgument<'_>>>) -> PyResult<Option<Vehicle>> {
    crate::argument::optional(vehicle, "vehicle")?.map(|vehicle| vehicle.vehicle()).transpose()
}

/// Returns the vehicle of the argument `vehicle`, by default the paper's.
pub(crate) fn flown(vehicle: Option<&CallArg<'_, VehicleArgument<'_>>>) -> PyResult<Vehicle> {
    given(vehicle)?.map_or_else(|| afbc_scenario::vehicle_named(Path::new("paper")).map_err(error), Ok)
}

/// Makes the vehicle of this source.
fn of(source: PickledFile) -> PyResult<PyVehicle> {
    let vehicle = afbc_vehicles::parse(&source.file, &source.text, &source.name).map_err(error)?;
    Ok(PyVehicle { vehicle, source })
}

impl PyVehicle {
    pub(crate) fn at(path: &Path) -> PyResult<Self> {
        // Reads as the command line does first, since its errors show the path as given.
        afbc_scenario::vehicle_named(path).map_err(error)?;
        let text = |name: &str| afbc_vehicles::built_in(name).map(|known| known.text);
        of(PickledFile::at(path, "vehicle", text).map_err(error)?)
    }
}

#[pymethods]
impl PyVehicle {
    #[new]
    fn new(name: CallArg<'_, PathBuf>) -> PyResult<Self> {
        PyVehicle::at(&name.named("name")?)
    }

    /// Reads the text of a vehicle file (TOML); docs/vehicles.md describes the format.
    #[staticmethod]
    #[pyo3(signature = (text, name="vehicle"))]
    fn from_toml(text: &str, name: &str) -> PyResult<Self> {
        of(PickledFile { file: name.into(), text: text.into(), name: name.into() })
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String, String, String))> {
        Ok((py.import("afbc._afbc")?.getattr("_vehicle")?, self.source.clone().into_texts()))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<PyVehicle>().is_ok_and(|other| other.get().vehicle == self.vehicle)
    }

    fn __hash__(&self) -> u64 {
        hash(&self.vehicle.name)
    }

    #[getter]
    fn name(&self) -> &str {
        &self.vehicle.name
    }

    #[getter]
    fn description(&self) -> &str {
        &self.vehicle.description
    }

    /// Number of rotors.
    #[getter]
    fn rotors(&self) -> usize {
        self.vehicle.rotors.len()
    }

    /// Largest force of one rotor [N].
    #[getter]
    fn rotor_force_max_n(&self) -> f64 {
        self.vehicle.force_max_n
    }

    /// Lag of the rotors [s].
    #[getter]
    fn lag_s(&self) -> f32 {
        self.vehicle.lag_s()
    }

    /// Positions of the rotor hubs relative to the centre of mass, body frame [m], shape (rotors, 3).
    #[getter]
    fn rotor_positions_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (realism, arm_m) = (&self.vehicle.realism, self.vehicle.parameters.arm_m);
        let contact = realism.contact.map(|contact| contact.rotor_height_m);
        let height_m = realism.drag.map(|drag| drag.rotor_height_m).or(contact).unwrap_or_default();
        let numbers = self.vehicle.rotors.iter().flat_map(|rotor| [rotor.x * arm_m, rotor.y * arm_m, height_m]);
        PyArray1::from_iter(py, numbers).reshape([self.vehicle.rotors.len(), 3])
    }

    /// Direction in which the drag of each rotor turns the body, shape (rotors,). It is 1, positive yaw, for a rotor
    /// that turns clockwise seen from above, and -1 for one that turns counter-clockwise.
    #[getter]
    fn rotor_yaw_signs<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.vehicle.rotors.iter().map(|rotor| if rotor.pushes_left { 1.0 } else { -1.0 }))
    }

    /// Smallest and largest speed of a rotor [rad/s].
    #[getter]
    fn rotor_speed_limits_rad_s(&self) -> (f64, f64) {
        (self.vehicle.realism.rotors.min_rad_s, self.vehicle.realism.rotors.max_rad_s)
    }

    /// Drag by name, in SI units, or None. `blade_n_s2_m` is the force of one rotor's blades divided by rotor speed and
    /// by the airspeed in the rotor's plane. `body_n_s2_m2` is the body's force along x, y, z divided by the square of
    /// the airspeed, and `centre_m` the point at which it acts.
    #[getter]
    fn drag<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(drag) = &self.vehicle.realism.drag else { return Ok(None) };
        let dict = PyDict::new(py);
        dict.set_item("blade_n_s2_m", drag.blade_n_s2_m)?;
        dict.set_item("body_n_s2_m2", <[f64; 3]>::from(drag.area_m2 * (0.5 * drag.air_density_kg_m3)))?;
        dict.set_item("centre_m", <[f64; 3]>::from(drag.centre_m))?;
        Ok(Some(dict))
    }

    /// Nominal masses, inertia, arm and rotor factors by name, in SI units.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        parameters(py, &self.vehicle.parameters)
    }

    fn __repr__(&self) -> String {
        format!("Vehicle('{}')", self.vehicle.name)
    }
}

/// Returns the parameters by name.
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

/// Returns a hash of the name, so that equal objects have equal hashes.
pub(crate) fn hash(name: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    name.hash(&mut hasher);
    hasher.finish()
}

/// Restores a vehicle from the data that `pickle` kept.
#[pyfunction]
pub(crate) fn _vehicle(file: String, text: String, name: String) -> PyResult<PyVehicle> {
    of(PickledFile { file, text, name })
}

/// Returns the names of the built-in vehicles.
#[pyfunction]
pub(crate) fn vehicles() -> Vec<&'static str> {
    BUILT_IN.iter().map(|known| known.name).collect()
}
