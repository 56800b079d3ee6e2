//! The Python module `steradian`: scenes are loaded or built, rendered and compared; pictures are NumPy arrays.

mod convert;
mod errors;
mod image;
mod scene;
mod watch;

use pyo3::prelude::*;
use steradian::internal::memory::HugePages;

#[global_allocator]
static ALLOCATOR: HugePages = HugePages;

/// The compiled part of the package `steradian`.
#[pymodule]
fn _steradian(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<scene::PyScene>()?;
    module.add_class::<image::PyImage>()?;
    module.add_class::<image::PyLayer>()?;
    module.add_function(wrap_pyfunction!(scene::load, module)?)?;
    module.add_function(wrap_pyfunction!(scene::load_dict, module)?)?;
    module.add_function(wrap_pyfunction!(scene::schema, module)?)?;
    module.add_function(wrap_pyfunction!(watch::render, module)?)?;
    module.add_function(wrap_pyfunction!(image::read, module)?)?;
    module.add_function(wrap_pyfunction!(image::write, module)?)?;
    module.add_function(wrap_pyfunction!(image::compare, module)?)?;
    Ok(())
}
