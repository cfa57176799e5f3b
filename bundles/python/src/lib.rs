//! Checker bundles in Python: a Python interface to the SDK in `bundles/sdk`.
//!
//! The code of the bus and the codec is not duplicated. A bundle that a script describes becomes a
//! [`qcbus_sdk::Bundle`]. Its rules call functions of the script (`bundle`, `rule`). They get views
//! into the image of the document (`lease`, `element`, `document`), which end with the job. A
//! collector takes their findings (`found`).

mod bundle;
mod column;
mod document;
mod element;
mod found;
mod lease;
mod roads;
mod rows;
mod rule;

use pyo3::prelude::*;

/// Native part of `qcbus`. `qcbus/__init__.py` exports it to users.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<document::Document>()?;
    module.add_class::<element::Element>()?;
    module.add_class::<element::Elements>()?;
    module.add_class::<column::Column>()?;
    module.add_class::<column::Table>()?;
    module.add_class::<rows::Rows>()?;
    module.add_class::<roads::Road>()?;
    module.add_class::<roads::Section>()?;
    module.add_class::<roads::PyLane>()?;
    module.add_class::<roads::Pose>()?;
    module.add_class::<found::Found>()?;
    module.add_class::<found::PyFinding>()?;
    module.add_class::<bundle::Native>()?;
    module.add("Closed", module.py().get_type::<lease::Closed>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    Ok(())
}
