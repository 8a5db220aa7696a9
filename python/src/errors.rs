//! The library's errors as exceptions, with the same one line.

use halflight::error::Error;
use pyo3::prelude::*;

/// The exception for an error: a class of `halflight._errors`.
pub fn raised(error: Error) -> PyErr {
    Python::attach(|py| exception(py, &error).unwrap_or_else(|failed| failed))
}

/// [`Error::Usage`] as an exception.
pub fn usage(line: impl Into<String>) -> PyErr {
    raised(Error::Usage(line.into()))
}

/// The exception for a layer that a picture does not have.
pub fn no_layer(line: String) -> PyErr {
    Python::attach(|py| of_class(py, "NoLayer", &line).map_or_else(|failed| failed, PyErr::from_value))
}

fn exception(py: Python<'_>, error: &Error) -> PyResult<PyErr> {
    let class = match error {
        Error::NoImage { .. } => "NoImage",
        Error::Scene { .. } => "SceneError",
        Error::Read { .. } | Error::Write { .. } | Error::Image { .. } => "FileError",
        Error::Usage(_) | Error::Print(_) => "UsageError",
    };
    let value = of_class(py, class, &error.to_string())?;
    if let Error::NoImage { k, .. } = error {
        value.setattr("k", *k)?;
    }
    Ok(PyErr::from_value(value))
}

fn of_class<'py>(py: Python<'py>, class: &str, line: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("halflight._errors")?.getattr(class)?.call1((line,))
}
