//! The class `Instruments`: simulated sensors, reading by reading.

use crate::argument::CallArg;
use crate::error::error;
use crate::plant::{PyPlant, step_s};
use crate::scenario::{ScenarioArgument, asked};
use crate::vehicle::VehicleArgument;
use afbc_plant::SimulatedInstruments;
use afbc_plant::instruments::ImuReading;
use nalgebra::Vector3;
use numpy::{PyArray1, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Instruments of a scenario's vehicle, with their errors, delays and failures: inertial sensor, tracker, GNSS
/// receiver, barometer and magnetometer, as far as it has them. They can measure any plant.
#[pyclass(name = "Instruments", module = "afbc")]
pub(crate) struct PyInstruments {
    instruments: SimulatedInstruments,
}

fn three<'py>(py: Python<'py>, vector: &Vector3<f64>) -> Bound<'py, PyArray1<f64>> {
    [vector.x, vector.y, vector.z].to_pyarray(py)
}

fn inertial<'py>(py: Python<'py>, sample: &ImuReading) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("at_s", sample.at_s)?;
    dict.set_item("rates_rad_s", three(py, &sample.rates_rad_s))?;
    dict.set_item("specific_force_m_s2", three(py, &sample.specific_force_m_s2))?;
    Ok(dict)
}

#[pymethods]
impl PyInstruments {
    /// Makes the instruments of a scenario, by default "outdoor". They are read every `dt_s` [s].
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
        let scenario = asked(scenario.as_ref(), "outdoor", vehicle.as_ref(), seed.as_ref())?;
        let dt_s = step_s(&dt_s)?;
        let cure = "the scenario has no instruments; add a table [instruments], or choose mocap or outdoor";
        let instruments = scenario.instruments(dt_s).map_err(error)?;
        let instruments = instruments.ok_or_else(|| error(format!("{}: {cure}", scenario.name)))?;
        Ok(PyInstruments { instruments })
    }

    /// Reads the instruments once, at the plant's present time. Returns the measurements that arrive: under "imu" a
    /// sample or None, and under "tracker", "gnss", "barometer" and "magnetometer" lists of measurements. Each has the
    /// time at which it was true.
    fn measure<'py>(
        &mut self,
        py: Python<'py>,
        plant: CallArg<'py, Bound<'py, PyPlant>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let truth = plant.named("plant")?.try_borrow()?.truth();
        let readings = self.instruments.measure(&truth);
        let dict = PyDict::new(py);
        dict.set_item("imu", readings.imu.map(|sample| inertial(py, &sample)).transpose()?)?;
        let fixes =
            |of: Vec<PyResult<Bound<'py, PyDict>>>| PyList::new(py, of.into_iter().collect::<PyResult<Vec<_>>>()?);
        let tracker = readings.tracker.iter().map(|fix| {
            let dict = PyDict::new(py);
            dict.set_item("true_at_s", fix.true_at_s)?;
            dict.set_item("position_m", three(py, &fix.position_m))?;
            let [x, y, z, w]: [f64; 4] = fix.attitude.coords.into();
            dict.set_item("attitude", [w, x, y, z].to_pyarray(py))?;
            Ok(dict)
        });
        dict.set_item("tracker", fixes(tracker.collect())?)?;
        let gnss = readings.gnss.iter().map(|fix| {
            let dict = PyDict::new(py);
            dict.set_item("true_at_s", fix.true_at_s)?;
            dict.set_item("position_m", three(py, &fix.position_m))?;
            dict.set_item("velocity_m_s", three(py, &fix.velocity_m_s))?;
            dict.set_item("horizontal_sigma_m", fix.horizontal_sigma_m)?;
            dict.set_item("vertical_sigma_m", fix.vertical_sigma_m)?;
            dict.set_item("velocity_sigma_m_s", fix.velocity_sigma_m_s)?;
            Ok(dict)
        });
        dict.set_item("gnss", fixes(gnss.collect())?)?;
        let barometer = readings.barometer.iter().map(|fix| {
            let dict = PyDict::new(py);
            dict.set_item("true_at_s", fix.true_at_s)?;
            dict.set_item("height_m", fix.height_m)?;
            Ok(dict)
        });
        dict.set_item("barometer", fixes(barometer.collect())?)?;
        let magnetometer = readings.magnetometer.iter().map(|fix| {
            let dict = PyDict::new(py);
            dict.set_item("true_at_s", fix.true_at_s)?;
            dict.set_item("field_ut", three(py, &fix.field_ut))?;
            Ok(dict)
        });
        dict.set_item("magnetometer", fixes(magnetometer.collect())?)?;
        Ok(dict)
    }
}
