//! Arguments of calls from Python. The error about a wrong argument is one line that names it.

use crate::error::error;
use core::convert::Infallible;
use core::ops::RangeInclusive;
use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::{PyOverflowError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyFloat, PyList, PyMapping, PyString};
use pyo3::{Borrowed, PyClass};
use std::path::PathBuf;

/// Accepted seeds: the non-negative numbers of numpy's int64.
pub(crate) const SEEDS: RangeInclusive<u64> = 0..=i64::MAX as u64;
/// Largest number of characters of a wrong argument that an error shows.
const SHOWN: usize = 40;

/// An argument as it was given, or its default. The value is converted when asked for by the argument's name.
pub(crate) enum CallArg<'py, T> {
    Default(T),
    As(Bound<'py, PyAny>),
}

impl<'py, T> FromPyObject<'_, 'py> for CallArg<'py, T> {
    type Error = Infallible;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> Result<Self, Infallible> {
        Ok(CallArg::As(object.to_owned()))
    }
}

impl<'py, T: Argument<'py>> CallArg<'py, T> {
    /// Returns the value of the argument called `name`.
    pub(crate) fn named(&self, name: &str) -> PyResult<T>
    where
        T: Clone,
    {
        match self {
            CallArg::Default(value) => Ok(value.clone()),
            CallArg::As(object) => T::of(name, object),
        }
    }
}

/// Returns the value of the optional argument called `name`; none if it was not given.
pub(crate) fn optional<'py, T: Argument<'py> + Clone>(
    given: Option<&CallArg<'py, T>>,
    name: &str,
) -> PyResult<Option<T>> {
    given.map(|given| given.named(name)).transpose()
}

impl CallArg<'_, u64> {
    /// Returns the value of the argument called `name`, which must be a whole number within `range`.
    pub(crate) fn within(&self, name: &str, range: RangeInclusive<u64>) -> PyResult<u64> {
        let outside = |shown: String| {
            let (least, most) = (range.start(), range.end());
            error(format!("{name}: {shown} given; a whole number from {least} to {most} is needed"))
        };
        let value = match self {
            CallArg::Default(value) => *value,
            CallArg::As(object) => match object.extract::<u64>() {
                Ok(value) => value,
                Err(problem) if problem.is_instance_of::<PyOverflowError>(object.py()) => {
                    return Err(outside(shown(object)));
                }
                Err(problem) => return Err(unfit(name, "a whole number is", object, problem)),
            },
        };
        if range.contains(&value) { Ok(value) } else { Err(outside(value.to_string())) }
    }
}

/// Returns the requested number of threads; none for the default.
pub(crate) fn threads(given: Option<&CallArg<'_, u64>>) -> PyResult<Option<usize>> {
    given.map(|threads| threads.within("threads", 1..=1024).map(|threads| threads as usize)).transpose()
}

/// Returns the requested seed; none for the scenario's own.
pub(crate) fn seed(given: Option<&CallArg<'_, u64>>) -> PyResult<Option<u64>> {
    given.map(|seed| seed.within("seed", SEEDS)).transpose()
}

/// A type that Python objects are converted to.
pub(crate) trait Argument<'py>: Sized {
    /// Converts the argument called `name`.
    fn of(name: &str, object: &Bound<'py, PyAny>) -> PyResult<Self>;
}

/// Returns the error for an argument `name` of a wrong type.
pub(crate) fn wrong(name: &str, needed: &str, object: &Bound<'_, PyAny>) -> PyErr {
    let kind = object.get_type().name().map_or_else(|_| "this".into(), |name| name.to_string());
    PyTypeError::new_err(format!("{name}: {needed} needed, not {kind}"))
}

/// Returns the error for a failed conversion. An exception from the object's own code stays as it is.
fn unfit(name: &str, needed: &str, object: &Bound<'_, PyAny>, raised: PyErr) -> PyErr {
    let py = object.py();
    if raised.is_instance_of::<PyTypeError>(py) {
        wrong(name, needed, object)
    } else if raised.is_instance_of::<PyOverflowError>(py) || raised.is_instance_of::<PyValueError>(py) {
        error(format!("{name}: {} given; {needed} needed", shown(object)))
    } else {
        raised
    }
}

/// Returns the argument as text, cut to a length that fits in a line.
fn shown(object: &Bound<'_, PyAny>) -> String {
    let text = object.repr().map_or_else(|_| "too long a number".into(), |text| text.to_string_lossy().into_owned());
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}...", text.get(..end).unwrap_or_default()),
        None => text,
    }
}

impl<'py> Argument<'py> for f64 {
    fn of(name: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        object.extract().map_err(|raised| unfit(name, "a number is", object, raised))
    }
}

impl<'py> Argument<'py> for String {
    fn of(name: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        object.extract().map_err(|raised| unfit(name, "a str is", object, raised))
    }
}

impl<'py> Argument<'py> for PathBuf {
    fn of(name: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        object.extract().map_err(|raised| unfit(name, "a path is", object, raised))
    }
}

impl<'py, T: PyClass> Argument<'py> for Bound<'py, T> {
    fn of(name: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        let kind = object.py().get_type::<T>();
        let needed = || kind.name().map_or_else(|_| "another is".into(), |kind| format!("afbc.{kind} is"));
        object.cast::<T>().cloned().map_err(|_| wrong(name, &needed(), object))
    }
}

impl<'py, T: Argument<'py>> Argument<'py> for Vec<T> {
    fn of(name: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        if object.cast::<PyString>().is_ok() {
            return Err(wrong(name, "a list is", object));
        }
        let items = object.try_iter().map_err(|raised| unfit(name, "a list is", object, raised))?;
        items.enumerate().map(|(index, item)| T::of(&format!("{name}[{index}]"), &item?)).collect()
    }
}

/// Named values from a mapping or from pairs.
#[derive(Clone, Default)]
pub(crate) struct NamedGains(pub(crate) Vec<(String, f64)>);

impl<'py> Argument<'py> for NamedGains {
    fn of(name: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        let pairs = match object.cast::<PyMapping>() {
            Ok(mapping) => mapping.items()?.into_any(),
            Err(_) => object.clone(),
        };
        let needed = "a mapping of names to numbers is";
        if object.cast::<PyString>().is_ok() {
            return Err(wrong(name, needed, object));
        }
        let items = pairs.try_iter().map_err(|raised| unfit(name, needed, object, raised))?;
        let pair = |item: PyResult<Bound<'py, PyAny>>| {
            let item = item?;
            let (gain, value): (Bound<'py, PyAny>, Bound<'py, PyAny>) =
                item.extract().map_err(|raised| unfit(name, needed, object, raised))?;
            let gain = String::of(name, &gain)?;
            let value = f64::of(&format!("{name}[{gain:?}]"), &value)?;
            Ok((gain, value))
        };
        items.map(pair).collect::<PyResult<_>>().map(NamedGains)
    }
}

/// Numbers of an array of any shape.
#[derive(Clone)]
pub(crate) struct ArgumentArray {
    numbers: Vec<f64>,
    shape: Vec<usize>,
}

impl ArgumentArray {
    /// Returns the numbers of the argument called `name` if its shape is `wanted`. A length of none accepts any length.
    pub(crate) fn shaped<const D: usize>(self, name: &str, wanted: [Option<usize>; D]) -> PyResult<Vec<f64>> {
        let fits = |(wanted, given): (&Option<usize>, &usize)| wanted.is_none_or(|wanted| wanted == *given);
        if self.shape.len() == D && wanted.iter().zip(&self.shape).all(fits) {
            return Ok(self.numbers);
        }
        let lengths = wanted.map(|length| length.map_or_else(|| "any".into(), |length| length.to_string()));
        let given: Vec<String> = self.shape.iter().map(ToString::to_string).collect();
        Err(error(format!("{name}: shape {} given; {} is needed", tuple(&given), tuple(&lengths))))
    }
}

/// Formats a shape as Python writes it.
fn tuple(lengths: &[String]) -> String {
    match lengths {
        [length] => format!("({length},)"),
        _ => format!("({})", lengths.join(", ")),
    }
}

impl<'py> Argument<'py> for ArgumentArray {
    fn of(name: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        static AS_ARRAY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
        let py = object.py();
        let needed = "numbers are";
        let array = match object.cast::<PyArrayDyn<f64>>() {
            // This is a fast path, since most arguments are such arrays and a step may run a thousand times a second.
            Ok(array) if array.is_c_contiguous() && array.data().is_aligned() => {
                return Ok(ArgumentArray { numbers: array.to_vec().map_err(error)?, shape: array.shape().to_vec() });
            }
            Ok(array) => array.clone().into_any(),
            Err(_) => {
                let as_array = AS_ARRAY.import(py, "numpy", "asarray")?;
                let array = as_array.call1((object,)).map_err(|raised| unfit(name, needed, object, raised))?;
                let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
                if !["f", "i", "u"].contains(&kind.as_str()) {
                    let (of, dtype) = (object.get_type().name()?, array.getattr("dtype")?);
                    return Err(PyTypeError::new_err(format!("{name}: {needed} needed, not {of} of dtype {dtype}")));
                }
                array
            }
        };
        // Copies the array: nobody else can write the copy meanwhile, and it is contiguous.
        let array = array.call_method1("astype", ("float64", "C"))?;
        let array = array.cast_into::<PyArrayDyn<f64>>()?;
        Ok(ArgumentArray { numbers: array.to_vec().map_err(error)?, shape: array.shape().to_vec() })
    }
}

impl<'py, const N: usize> Argument<'py> for [f64; N] {
    fn of(name: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        // A fast path for a list of floats. All other arguments take the general path, which also reports errors.
        if let Ok(list) = object.cast_exact::<PyList>()
            && list.len() == N
            && list.iter().all(|item| item.is_instance_of::<PyFloat>())
        {
            return list.extract();
        }
        let numbers = ArgumentArray::of(name, object)?.shaped(name, [Some(N)])?;
        let mut numbers = numbers.into_iter();
        Ok(core::array::from_fn(|_| numbers.next().unwrap_or_default()))
    }
}

/// Returns the value of the argument called `name` if it is finite as a single.
pub(crate) fn finite(name: &str, value: f64) -> PyResult<f64> {
    let single = value as f32;
    if single.is_finite() { Ok(value) } else { Err(error(format!("{name}: {value} given; a finite number is needed"))) }
}

/// Returns the values of the argument called `name` if all are finite as singles.
pub(crate) fn all_finite<const N: usize>(name: &str, values: [f64; N]) -> PyResult<[f64; N]> {
    values.iter().try_for_each(|value| finite(name, *value).map(drop))?;
    Ok(values)
}
