//! KHR_lights_punctual.

use super::Reason;
use super::extras::{Extras, Place};
use super::graph::Placed;
use super::notes::{Notes, label};
use crate::scene::{Luminaire, SpotCone};
use glam::{DVec3, Vec3};
use gltf::json::Root;
use gltf::json::extensions::scene::khr_lights_punctual::{Light as Source, Spot, Type};
use gltf::json::validation::Checked;
use std::f32::consts::FRAC_PI_2;

/// What Blender's exporter multiplies watts by (its "Standard" lighting mode, the default), for lamps only.
/// io_scene_gltf2/blender/com/conversion.py: PBR_WATTS_TO_LUMENS.
const BLENDER_LUMENS_PER_WATT: f32 = 683.0;

/// The punctual lights of the scene about `origin`, those that are on.
pub(super) fn punctual(
    root: &Root,
    placed: &[Placed<'_>],
    origin: DVec3,
    notes: &mut Notes,
) -> Result<Vec<Luminaire>, Reason> {
    let sources = root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
    let sources = sources.map_or(&[][..], |lights| &lights.lights);
    let blender = root.asset.generator.as_ref().is_some_and(|generator| generator.contains("Blender I/O"));
    let mut luminaires = Vec::new();
    for place in placed {
        let Some(light) = place.node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref()) else {
            continue;
        };
        let index = light.light.value();
        let source = sources
            .get(index)
            .ok_or_else(|| format!("{}: its light {index} does not exist; export it again", place.label()))?;
        let mut lamp = Lamp::new(source, index, place, notes)?;
        if blender {
            lamp.rgb /= BLENDER_LUMENS_PER_WATT;
            notes.about(
                "Blender exported watts times 683 lm/W, undone for these lights \
                 (if it was not its Standard lighting mode, set extras `emission` to [683, 683])",
                &lamp.name,
            );
        }
        if source.range.is_some() {
            notes.about("the range of lights is ignored, light has none", &lamp.name);
        }
        let luminaire = lamp.luminaire((place.position() - origin).as_vec3())?;
        if luminaire.power(1.0).is_zero() {
            notes.about("lights without power were left out", &lamp.name);
        } else {
            luminaires.push(luminaire);
        }
    }
    Ok(luminaires)
}

/// One light at one node.
struct Lamp<'a> {
    source: &'a Source,
    name: String,
    label: String,
    /// Extras of the light; those of the node stand over them, because Blender writes object properties there.
    extras: [Extras; 2],
    rgb: Vec3,
    forward: Vec3,
}

impl<'a> Lamp<'a> {
    fn new(source: &'a Source, index: usize, place: &Placed<'_>, notes: &mut Notes) -> Result<Self, Reason> {
        let label = label("light", index, source.name.as_deref());
        let rgb = source.intensity * Vec3::from_array(source.color);
        if !rgb.is_finite() || rgb.min_element() < 0.0 {
            return Err(format!("{label}: its intensity {rgb} is negative or not finite; correct it"));
        }
        let extras = [
            Extras::new(&place.node.extras, place.label(), Place::Light, notes),
            Extras::new(&source.extras, label.clone(), Place::Light, notes),
        ];
        let name = source.name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| place.name());
        Ok(Self { source, name, label, extras, rgb, forward: place.forward()?.as_vec3() })
    }

    /// The first of the extras that has it.
    fn extra<T>(&self, read: impl Fn(&Extras) -> Result<Option<T>, Reason>) -> Result<Option<T>, Reason> {
        let [node, light] = &self.extras;
        let own = read(light)?;
        Ok(read(node)?.or(own))
    }

    fn luminaire(&self, position: Vec3) -> Result<Luminaire, Reason> {
        let light = self.extra(Extras::emission)?.unwrap_or_default().of(self.rgb);
        let warn = self.extra(Extras::warn)?;
        let Checked::Valid(kind) = self.source.type_ else {
            return Err(format!("{}: its type is not point, spot or directional; correct it", self.label));
        };
        if !light.is_finite() || !position.is_finite() {
            return Err(format!("{}: its power or place is not finite; correct it", self.label));
        }
        Ok(match (kind, warn) {
            (Type::Directional, Some(_)) => {
                return Err(format!("{}: extras `warn` is for point and spot lights; remove it", self.label));
            }
            (Type::Directional, None) => {
                Luminaire::Directional { direction: self.forward, irradiance: light }
            }
            (_, Some([exponent, a0, a1, a2])) => Luminaire::Warn {
                position,
                direction: self.forward,
                intensity: light,
                exponent,
                attenuation: [a0, a1, a2],
            },
            (Type::Point, None) => Luminaire::Point { position, intensity: light },
            (Type::Spot, None) => {
                Luminaire::Spot { position, direction: self.forward, intensity: light, cone: self.cone()? }
            }
        })
    }

    fn cone(&self) -> Result<SpotCone, Reason> {
        let missing = || format!("{}: is a spot without its cone; export it again", self.label);
        let Spot { inner_cone_angle: inner, outer_cone_angle: outer } =
            *self.source.spot.as_ref().ok_or_else(missing)?;
        // Half a radian's last bit above π/2 is how exporters write 90°.
        if !(inner >= 0.0 && inner <= outer && outer > 0.0 && outer <= FRAC_PI_2 + 1e-6) {
            return Err(format!(
                "{}: its cone is from {inner} to {outer} rad; they go from 0 to π/2, inner before outer",
                self.label
            ));
        }
        Ok(SpotCone { cos_inner: inner.cos(), cos_outer: outer.cos().max(0.0) })
    }
}
