use crate::array::{colour, vec3};
use crate::errors::{raised, usage};
use crate::options::halves;
use glam::Vec3;
use halflight::light::Light;
use halflight::scene::{Luminaire as Lamp, Profile, SceneBuilder, SpotCone};
use pyo3::prelude::*;
use std::f32::consts::FRAC_PI_2;
use std::path::PathBuf;

/// What shines without being a mesh: made by `point`, `spot`, `warn`, `profile`, `directional` and `sun`.
///
/// Colours are three linear numbers, or one for grey. `halves` says which halves of light it emits: "both", "invisible" (lights but
/// is not seen), or two factors (invisible, visible). Meshes shine by the `emission` of their material.
#[pyclass(frozen, module = "halflight")]
pub struct Luminaire {
    inner: Lamp,
    /// How it shines, where that was measured; its index is that of the scene it is added to.
    profile: Option<Profile>,
}

impl Luminaire {
    /// Adds it to what shines.
    pub fn add_to(&self, scene: &mut SceneBuilder) {
        let mut lamp = self.inner;
        if let (Lamp::Profile { profile: index, .. }, Some(profile)) = (&mut lamp, &self.profile) {
            *index = scene.profile(profile.clone());
        }
        scene.luminaire(lamp);
    }
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

    /// A point that shines as an IES `file` says (LM-63, types B and C): along `direction`, its +Y as near to `up` as can be (None: the
    /// world's +Y, of a lamp that shines up or down −Z). Vertical angles go to its +X, which is to the right of both.
    ///
    /// `intensity` (W/sr) is the mean over all directions. None: that of the file, candelas taken for W/sr, times `multiplier`.
    #[staticmethod]
    #[pyo3(signature = (position, direction, file, *, intensity=None, multiplier=None, up=None, halves=None))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments")]
    fn profile(
        py: Python<'_>,
        position: Any<'_, '_>,
        direction: Any<'_, '_>,
        file: PathBuf,
        intensity: Option<Any<'_, '_>>,
        multiplier: Option<Any<'_, '_>>,
        up: Option<Any<'_, '_>>,
        halves: Option<Any<'_, '_>>,
    ) -> PyResult<Self> {
        let (position, direction) = (vec3(position, "position")?, unit(direction)?);
        let read = py.detach(|| Profile::read(&file)).map_err(raised)?;
        let aimed = match up.map(|up| vec3(up, "up")).transpose()? {
            Some(up) => read.aimed(direction, up).ok_or_else(|| {
                usage(format!(
                    "profile: up {up} is along its direction {direction}; give another, or leave it out"
                ))
            })?,
            None => {
                let aimed = read.aimed(direction, Vec3::Y).or_else(|| read.aimed(direction, Vec3::NEG_Z));
                aimed.expect("no direction is along both")
            }
        };
        let rgb = match (intensity, multiplier) {
            (Some(_), Some(_)) => return Err(usage("profile: give intensity or multiplier, not both")),
            (Some(mean), None) => colour(mean, "intensity")?,
            (None, factor) => {
                let factor = factor.map_or(Ok(Vec3::ONE), |factor| colour(factor, "multiplier"))?;
                (read.mean_intensity() * factor.as_dvec3()).as_vec3()
            }
        };
        let intensity = of_halves(rgb, halves)?;
        Ok(Self { inner: Lamp::Profile { position, intensity, profile: 0 }, profile: Some(aimed) })
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
        Self { inner, profile: None }
    }
}

fn light(rgb: Any<'_, '_>, what: &str, given: Option<Any<'_, '_>>) -> PyResult<Light> {
    of_halves(colour(rgb, what)?, given)
}

fn of_halves(rgb: Vec3, given: Option<Any<'_, '_>>) -> PyResult<Light> {
    let [invisible, visible] = halves(given)?;
    Ok(Light::new(invisible * rgb, visible * rgb))
}

fn unit(direction: Any<'_, '_>) -> PyResult<Vec3> {
    let direction = vec3(direction, "direction")?;
    direction
        .try_normalize()
        .ok_or_else(|| usage(format!("direction {direction} leads nowhere; give one of some length")))
}
