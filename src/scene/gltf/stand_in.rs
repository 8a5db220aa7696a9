//! The numbers of a material, with the mean of each image in place of the image.

use super::Reason;
use super::image::{Images, Mean};
use super::notes::Notes;
use glam::Vec3;
use gltf::json::material::Material as Source;
use serde_json::Value;

/// Checked, each times the mean of its texture.
pub(super) struct Factors {
    pub colour: Vec3,
    pub metallic: f32,
    pub roughness: f32,
    /// Share of what is not metal.
    pub transmission: f32,
    /// Radiance, W m⁻² sr⁻¹.
    pub emitted: Vec3,
}

const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";

/// Reads them. A factor alone would make a body glow, white or clear that is so in a few texels only.
pub(super) fn factors(
    source: &Source,
    images: &mut Images<'_>,
    name: &str,
    label: &str,
    notes: &mut Notes,
) -> Result<Factors, Reason> {
    let mut means = Means { images, name, notes };
    let pbr = &source.pbr_metallic_roughness;
    let share = |what: &str, value: f32| check_share(label, what, value);
    let [r, g, b, _] = pbr.base_color_factor.0;
    for component in [r, g, b] {
        share("baseColorFactor", component)?;
    }
    let more = source.extensions.as_ref();
    let unlit = more.is_some_and(|more| more.unlit.is_some());
    let base = means.of("base colour", pbr.base_color_texture.as_ref().map(|t| t.index.value()));
    let colour = Vec3::new(r, g, b) * base.map_or(Vec3::ONE, |mean| mean.colour);
    let mut factors = Factors {
        colour,
        metallic: share("metallicFactor", pbr.metallic_factor.0)?,
        roughness: share("roughnessFactor", pbr.roughness_factor.0)?,
        transmission: 0.0,
        emitted: Vec3::ZERO,
    };
    if unlit {
        return Ok(factors);
    }
    let others = more.and_then(|more| more.others.get(SPECULAR_GLOSSINESS));
    if let Some(layers) = others {
        (factors.colour, factors.metallic) = (specular_glossiness(layers, &mut means, label)?, 0.0);
    } else {
        let texture = pbr.metallic_roughness_texture.as_ref().map(|t| t.index.value());
        if let Some(mean) = means.of("metallic-roughness", texture) {
            factors.roughness *= mean.data.y;
            factors.metallic *= mean.data.z;
        }
    }
    if let Some(glass) = more.and_then(|more| more.transmission.as_ref()) {
        let mean = means.of("transmission", glass.transmission_texture.as_ref().map(|t| t.index.value()));
        let whole = share("transmissionFactor", glass.transmission_factor.0)?;
        factors.transmission = whole * mean.map_or(1.0, |mean| mean.data.x);
    }
    factors.emitted = emitted(source, &mut means, label)?;
    Ok(factors)
}

fn emitted(source: &Source, means: &mut Means<'_, '_>, label: &str) -> Result<Vec3, Reason> {
    let strength = source.extensions.as_ref().and_then(|more| more.emissive_strength.as_ref());
    let strength = strength.map_or(1.0, |e| e.emissive_strength.0);
    let colour = strength * Vec3::from_array(source.emissive_factor.0);
    if !colour.is_finite() || colour.min_element() < 0.0 {
        return Err(format!("{label}: its emission {colour} is negative or not finite; correct it"));
    }
    if colour == Vec3::ZERO {
        return Ok(colour); // its image is not looked at
    }
    let mean = means.of("emissive", source.emissive_texture.as_ref().map(|t| t.index.value()));
    Ok(colour * mean.map_or(Vec3::ONE, |mean| mean.colour))
}

/// The diffuse and the specular colour of the older model as one: the layer on top takes what it mirrors from the one
/// below, so that the sum never exceeds 1. The specular layer is seen as diffuse, as rough metal is.
fn specular_glossiness(layers: &Value, means: &mut Means<'_, '_>, label: &str) -> Result<Vec3, Reason> {
    let mut colour = |key: &str, kind: &str, texture: &str| -> Result<Vec3, Reason> {
        let factor = layers[key].as_array().map_or(&[][..], Vec::as_slice);
        let mut rgb = Vec3::ONE;
        for (channel, value) in rgb.as_mut().iter_mut().zip(factor) {
            *channel = check_share(label, key, value.as_f64().unwrap_or(f64::NAN) as f32)?;
        }
        let texture = layers[texture]["index"].as_u64().and_then(|index| usize::try_from(index).ok());
        Ok(rgb * means.of(kind, texture).map_or(Vec3::ONE, |mean| mean.colour))
    };
    let diffuse = colour("diffuseFactor", "diffuse", "diffuseTexture")?;
    let specular = colour("specularFactor", "specular", "specularGlossinessTexture")?;
    Ok((1.0 - specular.max_element()) * diffuse + specular)
}

fn check_share(label: &str, what: &str, value: f32) -> Result<f32, Reason> {
    if (0.0..=1.0).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{label}: {what} is {value}; it goes from 0 to 1"))
    }
}

/// The means of one material's textures, which are told.
struct Means<'a, 'b> {
    images: &'a mut Images<'b>,
    name: &'a str,
    notes: &'a mut Notes,
}

impl Means<'_, '_> {
    /// None: there is no texture, or it cannot be read.
    fn of(&mut self, kind: &str, texture: Option<usize>) -> Option<Mean> {
        let mean = self.images.mean(texture?);
        let fact = match &mean {
            Ok(_) => format!("{kind} textures are not supported yet, the mean of the image stands in"),
            Err(why) => format!("{kind} textures are not supported yet, and no mean stands in ({why})"),
        };
        self.notes.about(&fact, self.name);
        mean.ok()
    }
}
