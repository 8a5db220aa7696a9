use crate::array::{colour, vec3};
use crate::errors::usage;
use crate::options::halves;
use glam::Vec3;
use halflight::light::Light;
use halflight::scene::{Luminaire as Lamp, SpotCone};
use pyo3::prelude::*;
use std::f32::consts::FRAC_PI_2;

/// What shines without being a mesh: made by `point`, `spot`, `warn`, `directional` and `sun`.
///
/// Colours are three linear numbers, or one for grey. `halves` says which halves of light it emits: "both", "invisible" (lights but
/// is not seen), or two factors (invisible, visible). Meshes shine by the `emission` of their material.
#[pyclass(frozen, module = "halflight")]
pub struct Luminaire {
    pub inner: Lamp,
}

type Any<'a, 'py> = &'a Bound<'py, PyAny>;

#[pymethods]
impl Luminaire {
    /// The same `intensity` (W/sr) in all directions from `position` (m).
    #[staticmethod]
    #[pyo3(signature = (position, intensity, *, halves=None))]
    fn point(position: Any<'_, '_>, intensity: Any<'_, '_>, halves: Option<Any<'_, '_>>) -> PyResult<Self> {
        let position = vec3(position, "position")?;
        Ok(Lamp::Point { position, intensity: light(intensity, "intensity", halves)? }.into())
    }

    /// A cone about `direction`: `intensity` (W/sr) up to the half-angle `inner`, falling to none at `outer` (radians, up to π/2).
    #[staticmethod]
    #[pyo3(signature = (position, direction, intensity, *, inner=0.0, outer=std::f32::consts::FRAC_PI_4, halves=None))]
    fn spot(
        position: Any<'_, '_>,
        direction: Any<'_, '_>,
        intensity: Any<'_, '_>,
        inner: f32,
        outer: f32,
        halves: Option<Any<'_, '_>>,
    ) -> PyResult<Self> {
        if !(0.0 <= inner && inner <= outer && outer <= FRAC_PI_2) {
            return Err(usage(format!(
                "spot: inner {inner} and outer {outer}; they rise from 0 to π/2 radians"
            )));
        }
        Ok(Lamp::Spot {
            position: vec3(position, "position")?,
            direction: unit(direction)?,
            intensity: light(intensity, "intensity", halves)?,
            cone: SpotCone::of_angles(inner, outer),
        }
        .into())
    }

    /// OpenGL's spot: `intensity` · cos^`exponent` / (a0 + a1 r + a2 r²) at distance r (m).
    #[staticmethod]
    #[pyo3(signature = (position, direction, intensity, *, exponent=0.0, attenuation=(0.0, 0.0, 1.0), halves=None))]
    fn warn(
        position: Any<'_, '_>,
        direction: Any<'_, '_>,
        intensity: Any<'_, '_>,
        exponent: f32,
        attenuation: (f32, f32, f32),
        halves: Option<Any<'_, '_>>,
    ) -> PyResult<Self> {
        Ok(Lamp::Warn {
            position: vec3(position, "position")?,
            direction: unit(direction)?,
            intensity: light(intensity, "intensity", halves)?,
            exponent,
            attenuation: attenuation.into(),
        }
        .into())
    }

    /// Parallel light along `direction`: `irradiance` (W/m²) on a surface that faces it.
    #[staticmethod]
    #[pyo3(signature = (direction, irradiance, *, halves=None))]
    fn directional(
        direction: Any<'_, '_>,
        irradiance: Any<'_, '_>,
        halves: Option<Any<'_, '_>>,
    ) -> PyResult<Self> {
        let irradiance = light(irradiance, "irradiance", halves)?;
        Ok(Lamp::Directional { direction: unit(direction)?, irradiance }.into())
    }

    /// A disk at infinity whose light travels along `direction`, of the whole angle `angle` (degrees, as of Blender's suns):
    /// `irradiance` (W/m²) on a surface that faces it.
    #[staticmethod]
    #[pyo3(signature = (direction, irradiance, *, angle=0.53, halves=None))]
    fn sun(
        direction: Any<'_, '_>,
        irradiance: Any<'_, '_>,
        angle: f32,
        halves: Option<Any<'_, '_>>,
    ) -> PyResult<Self> {
        if !(0.002..=180.0).contains(&angle) {
            return Err(usage(format!(
                "sun: its angle is {angle}; give 0.002 to 180 degrees, or use directional"
            )));
        }
        let irradiance = light(irradiance, "irradiance", halves)?;
        Ok(Lamp::sun(unit(direction)?, irradiance, (0.5 * angle).to_radians()).into())
    }

    fn __repr__(&self) -> String {
        format!("<halflight.Luminaire {:?}>", self.inner)
    }
}

impl From<Lamp> for Luminaire {
    fn from(inner: Lamp) -> Self {
        Self { inner }
    }
}

fn light(rgb: Any<'_, '_>, what: &str, given: Option<Any<'_, '_>>) -> PyResult<Light> {
    let rgb = colour(rgb, what)?;
    let [invisible, visible] = halves(given)?;
    Ok(Light::new(invisible * rgb, visible * rgb))
}

fn unit(direction: Any<'_, '_>) -> PyResult<Vec3> {
    let direction = vec3(direction, "direction")?;
    direction
        .try_normalize()
        .ok_or_else(|| usage(format!("direction {direction} leads nowhere; give one of some length")))
}
