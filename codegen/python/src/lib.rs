//! The part of the Python package `specgen` that is not Python: commands as functions, and a controller on memory that Python
//! holds. `specgen/*.py` gives both their names, types and documentation.

mod call;
mod controller;

use pyo3::exceptions::PyException;
use pyo3::{create_exception, pymodule};

create_exception!(specgen, Error, PyException, "What specgen refuses or cannot do.");

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
