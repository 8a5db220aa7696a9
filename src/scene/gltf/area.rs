//! Lamps with an extent, which no extension of glTF has: `extras` on a punctual light or on an empty node. They become triangles
//! that shine and reflect nothing.

use super::Reason;
use super::extent::{Extent, area};
use super::extras::{
    AREA, BACKS, DISK, EMISSION, EmissionScale, Extras, IES, Place, RADIANCE, SPHERE, WATTS, numbers,
};
use super::graph::Placed;
use super::lights::{self, Lamp};
use super::notes::Notes;
use crate::scene::names::clean;
use crate::scene::{Backs, Emission, Material, SceneBuilder, Shape};
use glam::Vec3;
use gltf::json::Root;
use gltf::json::extensions::scene::khr_lights_punctual::Type;
use gltf::json::scene::Node;
use std::f64::consts::PI;

/// How strongly it shines, linear RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Strength {
    /// W sr⁻¹: straight ahead, of a sphere in all directions.
    Intensity(Vec3),
    /// W, in all directions together.
    Power(Vec3),
    /// W m⁻² sr⁻¹.
    Radiance(Vec3),
}

/// A lamp with an extent.
struct Extended {
    name: String,
    label: String,
    extent: Extent,
    strength: Strength,
    emission: EmissionScale,
    backs: Backs,
}

/// Adds the lamps of a file that have an extent to the shapes of a scene, each with a material of its own.
pub(super) fn add(
    root: &Root,
    placed: &[Placed<'_>],
    scene: &mut SceneBuilder,
    notes: &mut Notes,
) -> Result<(), Reason> {
    for place in placed {
        let lamp = match lights::lamp(root, place, notes)? {
            Some(lamp) => of_light(&lamp, notes)?,
            None => of_node(place, notes)?,
        };
        let Some(lamp) = lamp else { continue };
        let (shape, emission) = lamp.shape(place)?;
        if emission.radiance.is_zero() {
            notes.about("lights without power were left out", &lamp.name);
            continue;
        }
        let material = scene.material(lamp.material(emission));
        scene.shape(Shape { material, ..shape });
    }
    Ok(())
}

/// How many triangles and vertices the lamp at a node is made of, from its JSON alone; wrong values count as none.
pub(super) fn size(root: &Root, place: &Placed<'_>) -> [u64; 2] {
    let light = lights::source(root, place).ok().flatten().map(|(_, light)| &light.extras);
    if light.is_none() && !is_empty(place.node) {
        return [0, 0];
    }
    let extent = |extras| {
        let extras = Extras::new(extras, String::new(), Place::Light, &mut Notes::default());
        Extent::of(&extras).ok().flatten()
    };
    let extent = extent(&place.node.extras).or_else(|| light.and_then(extent));
    extent.map_or([0, 0], Extent::size)
}

/// True for a node that only stands somewhere.
pub(super) fn is_empty(node: &Node) -> bool {
    let light = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
    node.mesh.is_none() && node.camera.is_none() && light.is_none()
}

fn of_light(lamp: &Lamp<'_>, notes: &mut Notes) -> Result<Option<Extended>, Reason> {
    let Some(extent) = lamp.extra(Extent::of)? else { return Ok(None) };
    let (label, key) = (lamp.label.clone(), extent.key());
    match lamp.kind()? {
        Type::Directional => {
            return Err(format!("{label}: extras `{key}` is for point and spot lights; remove it"));
        }
        Type::Spot => {
            notes.about("the cone of spots with an extent is passed over", &lamp.name);
        }
        Type::Point => {}
    }
    if lamp.extra(Extras::warn)?.is_some() {
        return Err(format!("{label}: extras `warn` is for lights without extent; remove it, or `{key}`"));
    }
    if lamp.extra(Extras::ies)?.is_some() {
        return Err(format!("{label}: extras `{IES}` is for lights without extent; remove it, or `{key}`"));
    }
    Ok(Some(Extended {
        name: clean(&lamp.name),
        label,
        extent,
        strength: Strength::Intensity(lamp.rgb),
        emission: lamp.extra(Extras::emission)?.unwrap_or_default(),
        backs: lamp.extra(Extras::backs)?.unwrap_or(Backs::Unseen),
    }))
}

/// An empty node is a lamp where its extras say how large and how strong. Others may mean something else by the same words.
fn of_node(place: &Placed<'_>, notes: &mut Notes) -> Result<Option<Extended>, Reason> {
    if !is_empty(place.node) {
        return Ok(None);
    }
    let extras = Extras::new(&place.node.extras, place.label(), Place::Empty, notes);
    let has = |keys: &[&str]| keys.iter().any(|key| extras.has(key));
    let (formed, strong) = (has(&[AREA, DISK, SPHERE]), has(&[WATTS, RADIANCE]));
    if !(formed && strong) {
        if formed || strong || has(&[EMISSION, BACKS]) {
            notes.about(
                "an empty node shines by extras `area`, `disk` or `sphere` together with `power` or `radiance`; \
                 these have but some",
                &place.name(),
            );
        }
        return Ok(None);
    }
    let Some((extent, strength)) = Extent::of(&extras)?.zip(Strength::of(&extras)?) else { return Ok(None) };
    place.forward()?;
    let emission = extras.emission()?.unwrap_or_default();
    let backs = extras.backs()?.unwrap_or(Backs::Unseen);
    Ok(Some(Extended { name: place.name(), label: place.label(), extent, strength, emission, backs }))
}

impl Extended {
    /// Where it stands, its material left open, and how it shines.
    fn shape(&self, place: &Placed<'_>) -> Result<(Shape, Emission), Reason> {
        let (corners, triangles) = self.extent.placed(place.to_world);
        let area = area(&corners, &triangles);
        if place.to_world.matrix3.determinant() == 0.0 || !area.is_normal() {
            return Err(format!("{} has no extent in the world, or too much; scale it", self.label));
        }
        let radiance = self.emission.of(self.strength.radiance(self.extent, area));
        if !radiance.is_finite() {
            return Err(format!(
                "{}: its radiance is more than single precision holds; give it less power or more extent",
                self.label
            ));
        }
        let closed = Some(self.extent.is_round());
        let shape = Shape { closed, ..Shape::new(self.name.clone(), 0, corners, triangles) };
        Ok((shape, Emission { radiance, two_sided: false }))
    }

    fn material(&self, emission: Emission) -> Material {
        let black = Material::diffuse(self.name.clone(), Vec3::ZERO).with_emission(emission);
        Material { lobes: Vec::new(), backs: self.backs, ..black }
    }
}

impl Strength {
    /// None: nothing says it.
    fn of(extras: &Extras) -> Result<Option<Self>, Reason> {
        let colour = |key| {
            extras.read(key, "a number, or three for red, green and blue, 0 or more", |value| {
                let grey = value.as_f64().map(|x| Vec3::splat(x as f32));
                let colour = grey.or_else(|| numbers(value).map(Vec3::from_array))?;
                (colour.is_finite() && colour.min_element() >= 0.0).then_some(colour)
            })
        };
        match (colour(WATTS)?, colour(RADIANCE)?) {
            (Some(_), Some(_)) => {
                Err(extras.wrong("`power` and `radiance` both say how strongly it shines; leave one out"))
            }
            (power, radiance) => Ok(power.map(Self::Power).or(radiance.map(Self::Radiance))),
        }
    }

    /// W m⁻² sr⁻¹, of so much (m²) that shines.
    fn radiance(self, extent: Extent, area: f64) -> Vec3 {
        // A convex body shows a quarter of its area to all sides on average (Cauchy).
        let shown = if extent.is_round() { 0.25 * area } else { area };
        let over = |rgb: Vec3, divisor: f64| (rgb.as_dvec3() / divisor).as_vec3();
        match self {
            Self::Intensity(rgb) => over(rgb, shown),
            Self::Power(rgb) => over(rgb, PI * area),
            Self::Radiance(rgb) => rgb,
        }
    }
}
