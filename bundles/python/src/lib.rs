//! Checker bundles in Python: the SDK of `bundles/sdk` under another roof.
//!
//! Nothing of the bus or the codec is made twice. A bundle that a script describes becomes a [`qcbus_sdk::Bundle`]
//! whose rules call functions of the script (`bundle`, `rule`); what they get are views into the image of the
//! document (`lease`, `element`, `document`) that end with the job, and a list for what they find (`found`).

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

/// What `qcbus` is made of; `qcbus/__init__.py` gives it to people.
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
