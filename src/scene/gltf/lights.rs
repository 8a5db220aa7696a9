//! KHR_lights_punctual.

use super::Reason;
use super::extent::Extent;
use super::extras::{Extras, IES, Place};
use super::graph::Placed;
use super::ies::Profiles;
use super::notes::{Notes, label};
use crate::light::Light;
use crate::scene::{Luminaire, Profile, SpotCone};
use glam::{DVec3, Vec3};
use gltf::json::Root;
use gltf::json::extensions::scene::khr_lights_punctual::{Light as Source, Spot, Type};
use gltf::json::validation::Checked;
use std::f32::consts::{FRAC_PI_2, PI};

/// What Blender's exporter multiplies watts by (its "Standard" lighting mode, the default), for lamps only.
/// io_scene_gltf2/blender/com/conversion.py: PBR_WATTS_TO_LUMENS.
const BLENDER_LUMENS_PER_WATT: f32 = 683.0;

/// The first version of the exporter that converts at all (October 2022, for Blender 3.4).
const BLENDER_CONVERTS: [u32; 3] = [3, 4, 40];

/// Half-angle (rad) of a beam that is thinner than a pixel of most pictures.
const THIN: f32 = 1e-3;

/// What the numbers of a file's lamps are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Unit {
    /// W sr⁻¹, and W m⁻² of parallel light.
    Radiant,
    /// Blender's: 683 times as many.
    Lumens,
    /// Blender's own: the watts of the whole lamp, also of a spot; W m⁻² of its sun.
    Watts,
}

impl Unit {
    /// By the program that wrote the file.
    fn of(generator: Option<&str>) -> Self {
        let blender = |name: &&str| name.contains("Blender I/O") || name.contains("Khronos Blender");
        let Some(generator) = generator.filter(blender) else { return Self::Radiant };
        let version = generator.split_once("Blender I/O v").map(|(_, version)| version);
        let parts = version.into_iter().flat_map(|version| version.split(|c: char| !c.is_ascii_digit()));
        // The oldest (2018) do not tell theirs, and convert nothing either.
        let parts: Vec<u32> = parts.take(3).map_while(|part| part.parse().ok()).collect();
        if parts[..] >= BLENDER_CONVERTS[..] { Self::Lumens } else { Self::Watts }
    }

    /// Brings a lamp to radiant units, and tells so.
    fn convert(self, lamp: &mut Lamp<'_>, notes: &mut Notes) {
        let directional = matches!(lamp.source.type_, Checked::Valid(Type::Directional));
        match self {
            Self::Radiant => {}
            Self::Lumens => {
                lamp.rgb /= BLENDER_LUMENS_PER_WATT;
                notes.about(
                    "Blender exported watts times 683 lm/W, undone for these lights \
                     (if it was not its Standard lighting mode, set extras `emission` to [683, 683])",
                    &lamp.name,
                );
            }
            Self::Watts => {
                lamp.rgb /= if directional { 1.0 } else { 4.0 * PI };
                notes.about(
                    "Blender before 3.4 exported its own watts (of a sun, W/m²), which these lights are read in",
                    &lamp.name,
                );
            }
        }
    }
}

/// The punctual lights of the scene about `origin`, those that are on; `radius` (m) is that of the scene. Those that were measured
/// are hung among `profiles`.
pub(super) fn punctual(
    root: &Root,
    placed: &[Placed<'_>],
    (origin, radius): (DVec3, f32),
    profiles: &mut Profiles<'_>,
    notes: &mut Notes,
) -> Result<Vec<Luminaire>, Reason> {
    let mut luminaires = Vec::new();
    for place in placed {
        let Some(lamp) = lamp(root, place, notes)? else { continue };
        if lamp.extra(Extent::of)?.is_some() {
            continue;
        }
        if lamp.extra(Extras::backs)?.is_some() {
            notes.about("extras `backs` is passed over, it is read on lights with an extent", &lamp.name);
        }
        let source = lamp.source;
        if source.spot.as_ref().is_some_and(|spot| spot.outer_cone_angle < THIN) {
            notes.about(
                "spots that light less than a pixel: photons show them, paths hardly ever meet them",
                &lamp.name,
            );
        }
        let sun = matches!(source.type_, Checked::Valid(Type::Directional));
        if !sun && lamp.extra(Extras::angle)?.is_some() {
            notes.about("extras `angle` is passed over, it is read on directional lights", &lamp.name);
        }
        let position = (place.position() - origin).as_vec3();
        let measured = lamp.measured(profiles, notes)?;
        let luminaire = match measured {
            Some(_) => lamp.hung(position, profiles.next())?,
            None => lamp.luminaire(position)?,
        };
        if !luminaire.power(radius).total().is_finite() {
            return Err(format!(
                "{}: its power is more than single precision holds (3.4e38 W); give it less",
                lamp.label
            ));
        }
        if luminaire.power(1.0).is_zero() {
            notes.about("lights without power were left out", &lamp.name);
        } else {
            measured.iter().try_for_each(|profile| profiles.hang(profile, place))?;
            luminaires.push(luminaire);
        }
    }
    Ok(luminaires)
}

/// The light at a node with its number. None: there is none.
pub(super) fn source<'a>(root: &'a Root, place: &Placed<'_>) -> Result<Option<(usize, &'a Source)>, Reason> {
    let of_node = place.node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
    let Some(index) = of_node.map(|of_node| of_node.light.value()) else { return Ok(None) };
    let sources = root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
    let source = sources.and_then(|lights| lights.lights.get(index));
    let missing = || format!("{}: its light {index} does not exist; export it again", place.label());
    source.ok_or_else(missing).map(|source| Some((index, source)))
}

/// The light at a node in radiant units. None: there is none.
pub(super) fn lamp<'a>(
    root: &'a Root,
    place: &Placed<'_>,
    notes: &mut Notes,
) -> Result<Option<Lamp<'a>>, Reason> {
    let Some((index, source)) = source(root, place)? else { return Ok(None) };
    let mut lamp = Lamp::new(source, index, place, notes)?;
    Unit::of(root.asset.generator.as_deref()).convert(&mut lamp, notes);
    if source.range.is_some() {
        notes.about("the range of lights is ignored, light has none", &lamp.name);
    }
    Ok(Some(lamp))
}

/// One light at one node.
pub(super) struct Lamp<'a> {
    source: &'a Source,
    pub name: String,
    pub label: String,
    /// Extras of the light; those of the node stand over them, because Blender writes object properties there.
    extras: [Extras; 2],
    /// W sr⁻¹, or W m⁻² of parallel light.
    pub rgb: Vec3,
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
    pub fn extra<T>(&self, read: impl Fn(&Extras) -> Result<Option<T>, Reason>) -> Result<Option<T>, Reason> {
        let [node, light] = &self.extras;
        let own = read(light)?;
        Ok(read(node)?.or(own))
    }

    /// Point, spot or directional.
    pub fn kind(&self) -> Result<Type, Reason> {
        match self.source.type_ {
            Checked::Valid(kind) => Ok(kind),
            Checked::Invalid => {
                Err(format!("{}: its type is not point, spot or directional; correct it", self.label))
            }
        }
    }

    /// What its extras say of how it was measured. None: nothing.
    fn measured(&self, profiles: &mut Profiles<'_>, notes: &mut Notes) -> Result<Option<Profile>, Reason> {
        let Some(file) = self.extra(Extras::ies)? else { return Ok(None) };
        let label = &self.label;
        match self.kind()? {
            Type::Directional => {
                return Err(format!("{label}: extras `{IES}` is for point and spot lights; remove it"));
            }
            Type::Spot => {
                notes.about("the cone of spots that shine by an IES file is passed over", &self.name);
            }
            Type::Point => {}
        }
        if self.extra(Extras::warn)?.is_some() {
            return Err(format!("{label}: extras `warn` and `{IES}` both say how it shines; leave one out"));
        }
        profiles.named(&file, label).map(Some)
    }

    /// As the profile of this index says: its intensity is the mean over all directions.
    fn hung(&self, position: Vec3, profile: u32) -> Result<Luminaire, Reason> {
        Ok(Luminaire::Profile { position, intensity: self.light_at(position)?, profile })
    }

    /// Both halves.
    fn light_at(&self, position: Vec3) -> Result<Light, Reason> {
        let light = self.extra(Extras::emission)?.unwrap_or_default().of(self.rgb);
        if !light.is_finite() || !position.is_finite() {
            return Err(format!("{}: its power or place is not finite; correct it", self.label));
        }
        Ok(light)
    }

    fn luminaire(&self, position: Vec3) -> Result<Luminaire, Reason> {
        let (light, kind) = (self.light_at(position)?, self.kind()?);
        let warn = self.extra(Extras::warn)?;
        Ok(match (kind, warn) {
            (Type::Directional, Some(_)) => {
                return Err(format!("{}: extras `warn` is for point and spot lights; remove it", self.label));
            }
            (Type::Directional, None) => self.sun(light)?,
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

    /// A disk at infinity, or parallel light, that brings so much (W m⁻²) to what faces it.
    fn sun(&self, irradiance: Light) -> Result<Luminaire, Reason> {
        let angle = self.extra(Extras::angle)?.unwrap_or(0.0);
        Ok(if angle > 0.0 {
            Luminaire::sun(self.forward, irradiance, 0.5 * angle.to_radians())
        } else {
            Luminaire::Directional { direction: self.forward, irradiance }
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
        Ok(SpotCone::of_angles(inner, outer.min(FRAC_PI_2)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_of_lamps_follows_from_the_exporter_and_its_version() {
        let unit = |generator: &str| Unit::of(Some(generator));
        for new in ["v5.0.21", "v4.0.44", "v3.4.50", "v3.4.40", "v3.6.27 with hand edits", "v10.0.0", "v3.10"]
        {
            assert_eq!(unit(&format!("Khronos glTF Blender I/O {new}")), Unit::Lumens, "{new}");
        }
        for old in ["v1.6.16", "v3.3.32", "v3.4.39", "v0.9.36", "v1", ""] {
            assert_eq!(unit(&format!("Khronos glTF Blender I/O {old}")), Unit::Watts, "{old}");
        }
        assert_eq!(unit("Khronos Blender glTF 2.0 exporter"), Unit::Watts);
        assert_eq!(unit("glTF-Transform v3.0.4, and Blender 3.3"), Unit::Radiant);
        assert_eq!(Unit::of(None), Unit::Radiant);
    }
}
