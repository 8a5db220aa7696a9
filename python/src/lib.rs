//! halflight for Python.
//!
//! A thin edge: what Python gives becomes the library's own types here, once, and what the library makes becomes arrays and
//! records. Work is done without the interpreter's lock, in a thread of its own, so that Ctrl-C is heard.

mod array;
mod atlas;
mod camera;
mod compare;
mod errors;
mod luminaire;
mod material;
mod options;
mod picture;
mod records;
mod render;
mod scene;
mod settings;
mod state;
mod texture;
mod wait;

/// Renders scenes lit by vector-valued light.
#[pyo3::pymodule]
mod _core {
    #[pymodule_export]
    use super::atlas::Atlas;
    #[pymodule_export]
    use super::camera::Camera;
    #[pymodule_export]
    use super::compare::compare;
    #[pymodule_export]
    use super::luminaire::Luminaire;
    #[pymodule_export]
    use super::material::Material;
    #[pymodule_export]
    use super::picture::Picture;
    #[pymodule_export]
    use super::records::{check, multiplication_factor, plan};
    #[pymodule_export]
    use super::render::{Render, render};
    #[pymodule_export]
    use super::scene::Scene;
    #[pymodule_export]
    use super::state::State;

    /// That of the library.
    #[pymodule_init]
    fn init(module: &pyo3::Bound<'_, pyo3::types::PyModule>) -> pyo3::PyResult<()> {
        use pyo3::types::PyModuleMethods;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
