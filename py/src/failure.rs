//! How work ends badly, and which exception that is in Python.

use std::error::Error;

use hemicube::is_cancelled;
use hemicube::progress::Cancelled;
use pyo3::prelude::*;

/// Why there is no result.
#[derive(Debug)]
pub enum Failure {
    /// What was given makes no sense: `InputError`.
    Input(String),
    /// A file cannot be read or written: `FileError`.
    File(String),
    /// It does not fit in memory: `OutOfMemory`.
    Memory(String),
    /// Something else: `Error`.
    Failed(String),
    /// The caller stopped it.
    Cancelled,
}

impl Failure {
    /// What an error of the library means: cancelled, or what `otherwise` makes of it.
    pub fn of<E: Error + 'static>(error: E, otherwise: impl FnOnce(E) -> Self) -> Self {
        if is_cancelled(&error) { Self::Cancelled } else { otherwise(error) }
    }

    /// The exception.
    pub fn raise(self, py: Python<'_>) -> PyErr {
        let (class, text) = match self {
            Self::Input(text) => ("InputError", text),
            Self::File(text) => ("FileError", text),
            Self::Memory(text) => ("OutOfMemory", text),
            Self::Failed(text) => ("Error", text),
            Self::Cancelled => ("Error", "cancelled".to_owned()),
        };
        let exception = || py.import("hemicube._errors")?.getattr(class)?.call1((text,));
        exception().map_or_else(|error| error, PyErr::from_value)
    }
}

impl From<Cancelled> for Failure {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}
