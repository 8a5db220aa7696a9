//! The numbers of a material, checked, and its textures.

use super::Reason;
use super::image::Images;
use super::notes::Notes;
use super::texture::Reference;
use crate::scene::texture::{Encoding, Texture};
use crate::scene::{Factor, NormalMap, Pbr};
use glam::{Vec3, Vec4, Vec4Swizzles};
use gltf::json::material::{Material as Source, NormalTexture};
use serde_json::Value;

const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";

/// What `source` says. Whether it encloses a body, and what its vertices' colours and its extras make of it, is for others to say.
pub(super) fn parameters(
    source: &Source,
    images: &mut Images<'_>,
    name: &str,
    label: &str,
    notes: &mut Notes,
) -> Result<Pbr, Reason> {
    let mut textures = Textures { images, name, notes };
    let pbr = &source.pbr_metallic_roughness;
    let share = |what: &str, value: f32| check_share(label, what, value);
    let [r, g, b, _] = pbr.base_color_factor.0;
    for component in [r, g, b] {
        share("baseColorFactor", component)?;
    }
    let more = source.extensions.as_ref();
    let base = pbr.base_color_texture.as_ref().map(Reference::of);
    let mut made = Pbr {
        base: textures.colour("base colour", Vec3::new(r, g, b), base),
        metallic: share("metallicFactor", pbr.metallic_factor.0)?,
        roughness: share("roughnessFactor", pbr.roughness_factor.0)?,
        two_sided: source.double_sided,
        unlit: more.is_some_and(|more| more.unlit.is_some()),
        ior: more.and_then(|more| more.ior.as_ref()).map_or(1.5, |ior| ior.ior.0),
        ..Pbr::default()
    };
    if made.unlit {
        return Ok(made);
    }
    let others = more.and_then(|more| more.others.get(SPECULAR_GLOSSINESS));
    if let Some(layers) = others {
        let colour = specular_glossiness(layers, &mut textures, label)?;
        (made.base, made.metallic) = (Factor::new(colour), 0.0);
    } else {
        let reference = pbr.metallic_roughness_texture.as_ref().map(Reference::of);
        textures.metallic_roughness(&mut made, reference);
    }
    if let Some(glass) = more.and_then(|more| more.transmission.as_ref()) {
        let whole = share("transmissionFactor", glass.transmission_factor.0)?;
        let reference = glass.transmission_texture.as_ref().map(Reference::of);
        made.transmission = textures.share("transmission", whole, reference);
    }
    made.emissive = emissive(source, &mut textures, label)?;
    made.normal = source.normal_texture.as_ref().and_then(|texture| textures.normal_map(texture));
    Ok(made)
}

fn emissive(source: &Source, textures: &mut Textures<'_, '_>, label: &str) -> Result<Factor<Vec3>, Reason> {
    let strength = source.extensions.as_ref().and_then(|more| more.emissive_strength.as_ref());
    let strength = strength.map_or(1.0, |e| e.emissive_strength.0);
    let colour = strength * Vec3::from_array(source.emissive_factor.0);
    if !colour.is_finite() || colour.min_element() < 0.0 {
        return Err(format!("{label}: its emission {colour} is negative or not finite; correct it"));
    }
    Ok(textures.colour("emissive", colour, source.emissive_texture.as_ref().map(Reference::of)))
}

/// The diffuse and the specular colour of the older model as one: the layer on top takes what it mirrors from the one
/// below, so that the sum never exceeds 1. The specular layer is seen as diffuse, as rough metal is; of images the mean.
fn specular_glossiness(layers: &Value, textures: &mut Textures<'_, '_>, label: &str) -> Result<Vec3, Reason> {
    let mut colour = |key: &str, kind: &str, texture: &str| -> Result<Vec3, Reason> {
        let factor = layers[key].as_array().map_or(&[][..], Vec::as_slice);
        let mut rgb = Vec3::ONE;
        for (channel, value) in rgb.as_mut().iter_mut().zip(factor) {
            *channel = check_share(label, key, value.as_f64().unwrap_or(f64::NAN) as f32)?;
        }
        let Factor { factor, texture } = textures.colour(kind, rgb, Reference::of_json(&layers[texture]));
        let Some(texture) = texture else { return Ok(factor) };
        textures.notes.about(
            &format!("{kind} textures of {SPECULAR_GLOSSINESS} are not supported yet, the mean of the image stands in"),
            textures.name,
        );
        Ok(factor * texture.image.mean().xyz())
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

/// One material's textures. What is the same all over an image becomes part of the factor.
struct Textures<'a, 'b> {
    images: &'a mut Images<'b>,
    name: &'a str,
    notes: &'a mut Notes,
}

/// What a texture is: the same everywhere, or not.
enum Content {
    Same(Vec4),
    Varies(Texture),
}

impl Textures<'_, '_> {
    /// A colour times one. Where the factor is black the image is not looked at.
    fn colour(&mut self, kind: &str, factor: Vec3, reference: Option<Reference>) -> Factor<Vec3> {
        let reference = reference.filter(|_| factor != Vec3::ZERO);
        match self.content(kind, reference, Encoding::Colour) {
            Content::Same(texel) => Factor::new(factor * texel.xyz()),
            Content::Varies(texture) => Factor { factor, texture: Some(texture) },
        }
    }

    /// A share times that in red.
    fn share(&mut self, kind: &str, factor: f32, reference: Option<Reference>) -> Factor<f32> {
        let reference = reference.filter(|_| factor != 0.0);
        match self.content(kind, reference, Encoding::Data) {
            Content::Same(texel) => Factor::new(factor * texel.x),
            Content::Varies(texture) => Factor { factor, texture: Some(texture) },
        }
    }

    fn metallic_roughness(&mut self, pbr: &mut Pbr, reference: Option<Reference>) {
        let reference = reference.filter(|_| [pbr.metallic, pbr.roughness] != [0.0; 2]);
        match self.content("metallic-roughness", reference, Encoding::Data) {
            Content::Same(texel) => {
                pbr.roughness *= texel.y;
                pbr.metallic *= texel.z;
            }
            Content::Varies(texture) => pbr.metallic_roughness = Some(texture),
        }
    }

    fn normal_map(&mut self, texture: &NormalTexture) -> Option<NormalMap> {
        let scale = texture.scale;
        if !scale.is_finite() {
            self.notes.about("normal textures whose scale is not finite are left out", self.name);
            return None;
        }
        let reference = Reference::of_normal(texture);
        let flat = |texel: Vec4| (texel.x - 0.5).abs().max((texel.y - 0.5).abs()) <= HALF_STEP;
        match self.content("normal", reference, Encoding::Data) {
            Content::Varies(texture) => Some(NormalMap { texture, scale }),
            // An image of one texel that leans is a normal map too.
            Content::Same(texel) if texel == Vec4::ONE || flat(texel) => None,
            Content::Same(_) => {
                let texture = self.texture(reference?, Encoding::Data).ok()?;
                Some(NormalMap { texture, scale })
            }
        }
    }

    fn content(&mut self, kind: &str, reference: Option<Reference>, encoding: Encoding) -> Content {
        let Some(reference) = reference else { return Content::Same(Vec4::ONE) };
        match self.texture(reference, encoding) {
            Ok(texture) if texture.image.least() == texture.image.most() => {
                Content::Same(texture.image.mean())
            }
            Ok(texture) => Content::Varies(texture),
            Err(why) => {
                self.notes.about(
                    &format!("{kind} textures that cannot be read, the factor alone stands in ({why})"),
                    self.name,
                );
                Content::Same(Vec4::ONE)
            }
        }
    }

    fn texture(&mut self, reference: Reference, encoding: Encoding) -> Result<Texture, Reason> {
        let set = reference.checked()?;
        let (image, sampler) = self.images.get(reference.texture, encoding)?;
        Ok(Texture { image, sampler, set, transform: reference.transform })
    }
}

/// 8 bits have no middle: 127 and 128 are as near as they come.
const HALF_STEP: f32 = 0.5 / 255.0 + f32::EPSILON;
