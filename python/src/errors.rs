//! Errors of the engine as exceptions, one class for each class of errors.

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use suture_core::{Error, ErrorClass};

/// The caller gave what means nothing.
pub(crate) fn invalid(words: impl Into<String>) -> PyErr {
    PyValueError::new_err(words.into())
}

/// Anything of the engine, in JSON.
pub(crate) fn to_json(value: &impl serde::Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|error| PyRuntimeError::new_err(error.to_string()))
}

/// The exception for an error. The classes are Python's, so that each can be one of Python's own, too.
pub(crate) fn raise(py: Python<'_>, error: &Error) -> PyErr {
    if matches!(error, Error::Profile { .. }) {
        return invalid(error.to_string());
    }
    let class = match error.class() {
        ErrorClass::Unreadable => "UnreadableError",
        ErrorClass::Refused => "RefusedError",
        ErrorClass::Starved => "StarvedError",
        ErrorClass::Environment => "EnvironmentFailedError",
        ErrorClass::Shortage => "ShortageError",
        ErrorClass::Changed => "ChangedError",
    };
    let made = py.import("suture._errors").and_then(|module| module.getattr(class)?.call1((error.to_string(),)));
    made.map_or_else(|error| error, PyErr::from_value)
}
