//! The Python package of hemicube, thin over the library: arrays in and out.
//!
//! What users call stands in `python/hemicube`; here is what only Rust can do. Long work runs on a
//! thread of its own ([`work`]), and errors become exceptions that speak Python ([`failure`],
//! [`remedy`]).

mod arrays;
mod factors;
mod failure;
mod heat;
mod light;
mod ranks;
mod remedy;
mod scene;
mod work;

use pyo3::prelude::*;

/// What the package stands on.
#[pymodule]
fn _hemicube(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<scene::Scene>()?;
    module.add_class::<factors::Pieces>()?;
    module.add_class::<light::Light>()?;
    module.add_function(wrap_pyfunction!(factors::view_factors, module)?)?;
    module.add_function(wrap_pyfunction!(heat::heat, module)?)?;
    module.add_function(wrap_pyfunction!(heat::gebhart, module)?)?;
    module.add_function(wrap_pyfunction!(heat::lump, module)?)?;
    module.add_function(wrap_pyfunction!(light::lit, module)?)?;
    module.add_function(wrap_pyfunction!(ranks::solve_shared, module)?)?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))
}
