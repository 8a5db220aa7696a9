use crate::array::vec3;
use crate::errors::usage;
use crate::options::Options;
use glam::Vec3;
use halflight::scene::{Camera as Eye, Lens, Projection};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A camera at `position` that looks at `target` (world, m), `up` roughly up.
///
/// `yfov` is the full vertical angle of view in radians, as in glTF; with `half_height` (m) instead, projection is parallel.
/// `aspect` is width / height of the picture that it asks for. A thin lens of radius `aperture` (m) shows sharp what lies at the
/// distance `focus` (m along the direction of view).
#[pyclass(frozen, module = "halflight")]
pub struct Camera {
    /// In the world.
    pub inner: Eye,
}

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(
        signature = (position, target, **more),
        text_signature = "(position, target, *, up=(0, 1, 0), yfov=0.7, half_height=None, aspect=None, aperture=None, focus=None)"
    )]
    fn new(
        position: &Bound<'_, PyAny>,
        target: &Bound<'_, PyAny>,
        more: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let more = Options::of("Camera()", more)?;
        let number = |name| more.get::<f32>(name, "a number");
        let up = more.read("up", |value| vec3(value, "up"))?.unwrap_or(Vec3::Y);
        let projection = match (number("yfov")?, number("half_height")?) {
            (Some(_), Some(_)) => return Err(usage("Camera(): give yfov or half_height, not both")),
            (None, Some(half_height)) => Projection::Orthographic { half_height },
            (yfov, None) => Projection::Perspective { yfov: yfov.unwrap_or(0.7) },
        };
        let aspect = number("aspect")?;
        let lens = match (number("aperture")?, number("focus")?) {
            (None, None) => None,
            (Some(radius), Some(focus)) => Some(Lens { radius, focus }),
            _ => {
                return Err(usage("Camera(): a lens has both an aperture and a focus; give both or neither"));
            }
        };
        more.finish()?;
        let (position, target) = (vec3(position, "position")?, vec3(target, "target")?);
        let looking = Eye::look_at(position, target, up, projection);
        Ok(Self { inner: Eye { aspect, lens, ..looking } })
    }

    fn __repr__(&self) -> String {
        let Eye { position, forward, projection, .. } = self.inner;
        format!("<halflight.Camera at {position}, looking along {forward}, {projection:?}>")
    }
}
