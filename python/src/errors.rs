//! Errors of the library as Python exceptions, which `steradian/_errors.py` defines.

use pyo3::prelude::*;
use steradian::{Error, ErrorKind};

/// The exception for an error.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let name = match (error, error.kind()) {
        (Error::Setting { .. }, _) => "SettingError",
        (_, ErrorKind::Usage) => "UsageError",
        (_, ErrorKind::Scene) => "SceneError",
        (_, ErrorKind::AssetMissing) => "MissingFileError",
        (_, ErrorKind::Output) => "OutputError",
        (_, ErrorKind::Checkpoint) => "CheckpointError",
        (_, ErrorKind::OutOfMemory) => "OutOfMemoryError",
        (_, ErrorKind::Internal) => "InternalError",
    };
    raise(py, name, &error.to_string())
}

/// The exception of this name.
pub fn raise(py: Python<'_>, name: &str, message: &str) -> PyErr {
    let class = py.import("steradian._errors").and_then(|module| module.getattr(name));
    match class.and_then(|class| class.call1((message,))) {
        Ok(exception) => PyErr::from_value(exception),
        Err(error) => error,
    }
}

/// Results of the library as those of Python.
pub trait OrRaise<T> {
    /// The value, or the error as an exception.
    fn or_raise(self, py: Python<'_>) -> PyResult<T>;
}

impl<T> OrRaise<T> for steradian::Result<T> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|error| exception(py, &error))
    }
}
