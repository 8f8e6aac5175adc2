//! The native part of the Python package `specgen`: commands as functions, and a controller on Python's memory. `specgen/*.py`
//! provides their names, types and documentation.

mod call;
mod controller;

use pyo3::exceptions::PyException;
use pyo3::{create_exception, pymodule};

create_exception!(specgen, Error, PyException, "An error of specgen.");

/// `specgen._native`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::Error;
    #[pymodule_export]
    use super::call::{Session, call};
    #[pymodule_export]
    use super::controller::Library;
}
