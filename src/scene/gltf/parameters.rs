//! The numbers of a material, checked, and its textures.

use super::Reason;
use super::image::Images;
use super::notes::Notes;
use super::texture::Reference;
use crate::scene::texture::{Encoding, Texture};
use crate::scene::{Alpha, Anisotropy, Factor, NormalMap, Pbr};
use glam::{Vec3, Vec4, Vec4Swizzles};
use gltf::json::material::{AlphaMode, Material as Source, NormalTexture};
use gltf::json::validation::Checked;
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
    let coverage = coverage(source);
    let base = pbr.base_color_texture.as_ref().map(Reference::of);
    let opacity = share("baseColorFactor", pbr.base_color_factor.0[3])?;
    let (base, alpha) = textures.base(Vec3::new(r, g, b), opacity, base, coverage);
    let mut made = Pbr {
        base,
        alpha,
        coverage,
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
        specular_glossiness(layers, &mut textures, &mut made, label)?;
    } else {
        let reference = pbr.metallic_roughness_texture.as_ref().map(Reference::of);
        textures.metallic_roughness(&mut made, reference);
    }
    if let Some(glass) = more.and_then(|more| more.transmission.as_ref()) {
        let whole = share("transmissionFactor", glass.transmission_factor.0)?;
        let reference = glass.transmission_texture.as_ref().map(Reference::of);
        made.transmission = textures.share("transmission", whole, reference);
    }
    layers(source, &mut textures, &mut made, label)?;
    made.emissive = emissive(source, &mut textures, label)?;
    made.normal = source.normal_texture.as_ref().and_then(|texture| textures.normal_map(texture));
    Ok(made)
}

fn emissive(source: &Source, textures: &mut Textures<'_, '_>, label: &str) -> Result<Factor<Vec3>, Reason> {
    let strength = source.extensions.as_ref().and_then(|more| more.emissive_strength.as_ref());
    let strength = strength.map_or(1.0, |e| e.emissive_strength.0);
    let colour = strength * Vec3::from_array(source.emissive_factor.0);
    check_amounts(label, "emission", colour)?;
    Ok(textures.colour("emissive", colour, source.emissive_texture.as_ref().map(Reference::of)))
}

/// What alpha means.
fn coverage(source: &Source) -> Alpha {
    match source.alpha_mode {
        Checked::Valid(AlphaMode::Mask) => {
            Alpha::Mask(source.alpha_cutoff.as_ref().map_or(0.5, |cutoff| cutoff.0))
        }
        Checked::Valid(AlphaMode::Blend) => Alpha::Blend,
        _ => Alpha::Opaque,
    }
}

/// What lies above the body, and what it is like beside glTF's core.
fn layers(
    source: &Source,
    textures: &mut Textures<'_, '_>,
    made: &mut Pbr,
    label: &str,
) -> Result<(), Reason> {
    let Some(more) = source.extensions.as_ref() else { return Ok(()) };
    if let Some(specular) = &more.specular {
        let factor = check_share(label, "specularFactor", specular.specular_factor.0)?;
        let reference = specular.specular_texture.as_ref().map(Reference::of);
        made.specular = textures.channel("specular", factor, reference, 3);
        let colour = Vec3::from_array(specular.specular_color_factor.0);
        check_amounts(label, "specularColorFactor", colour)?;
        let reference = specular.specular_color_texture.as_ref().map(Reference::of);
        made.specular_colour = textures.colour("specular colour", colour, reference);
    }
    let others = |name: &str| more.others.get(name).filter(|value| value.is_object());
    if let Some(coat) = others("KHR_materials_clearcoat") {
        let json = Layer { json: coat, label };
        made.coat = textures.layer(&json, "clear coat", ["clearcoatFactor", "clearcoatTexture"], 0)?;
        let keys = ["clearcoatRoughnessFactor", "clearcoatRoughnessTexture"];
        made.coat_roughness = textures.layer(&json, "clear coat roughness", keys, 1)?;
        if made.coat.factor > 0.0 && coat.get("clearcoatNormalTexture").is_some() {
            let fact =
                "normal textures of clear coats are not supported yet, the normals of what is below stand in";
            textures.notes.about(fact, textures.name);
        }
    }
    if let Some(sheen) = others("KHR_materials_sheen") {
        let json = Layer { json: sheen, label };
        let colour = json.colour("sheenColorFactor", Vec3::ZERO)?;
        made.sheen = textures.colour("sheen", colour, Reference::of_json(&sheen["sheenColorTexture"]));
        let keys = ["sheenRoughnessFactor", "sheenRoughnessTexture"];
        made.sheen_roughness = textures.layer(&json, "sheen roughness", keys, 3)?;
    }
    if let Some(leaf) = others("KHR_materials_diffuse_transmission") {
        let json = Layer { json: leaf, label };
        let keys = ["diffuseTransmissionFactor", "diffuseTransmissionTexture"];
        made.translucence = textures.layer(&json, "diffuse transmission", keys, 3)?;
        let colour = json.colour("diffuseTransmissionColorFactor", Vec3::ONE)?;
        let reference = Reference::of_json(&leaf["diffuseTransmissionColorTexture"]);
        made.translucent_colour = textures.colour("diffuse transmission colour", colour, reference);
    }
    if let Some(film) = others("KHR_materials_iridescence") {
        let json = Layer { json: film, label };
        made.film = textures.layer(&json, "iridescence", ["iridescenceFactor", "iridescenceTexture"], 0)?;
        made.film_ior = json.amount("iridescenceIor", 1.3)?.max(1e-3);
        let thickness = |key, usual| json.amount(key, usual);
        made.film_thickness = [
            thickness("iridescenceThicknessMinimum", 100.0)?,
            thickness("iridescenceThicknessMaximum", 400.0)?,
        ];
        let reference =
            Reference::of_json(&film["iridescenceThicknessTexture"]).filter(|_| made.film.factor > 0.0);
        match textures.content("iridescence thickness", reference, Encoding::Data) {
            Content::Same(texel) => {
                let [thin, thick] = made.film_thickness;
                made.film_thickness = [thin + (thick - thin) * texel.y; 2];
            }
            Content::Varies(texture) => made.film_texture = Some(texture),
        }
    }
    if let Some(grain) = others("KHR_materials_anisotropy") {
        let json = Layer { json: grain, label };
        let strength = json.share("anisotropyStrength", 0.0)?;
        let rotation = grain["anisotropyRotation"].as_f64().unwrap_or(0.0) as f32;
        let reference = Reference::of_json(&grain["anisotropyTexture"]);
        if strength > 0.0 && rotation.is_finite() {
            let texture = reference.and_then(|reference| textures.texture(reference, Encoding::Data).ok());
            made.anisotropy = Some(Anisotropy { strength, rotation, texture });
        }
    }
    Ok(())
}

/// An extension's numbers.
struct Layer<'a> {
    json: &'a Value,
    label: &'a str,
}

impl Layer<'_> {
    fn share(&self, key: &str, usual: f32) -> Result<f32, Reason> {
        check_share(self.label, key, number(&self.json[key], usual))
    }

    fn amount(&self, key: &str, usual: f32) -> Result<f32, Reason> {
        let value = number(&self.json[key], usual);
        match value >= 0.0 && value.is_finite() {
            true => Ok(value),
            false => Err(format!("{}: {key} is {value}; it is no less than 0", self.label)),
        }
    }

    fn colour(&self, key: &str, usual: Vec3) -> Result<Vec3, Reason> {
        let mut rgb = usual;
        for (channel, value) in rgb.as_mut().iter_mut().zip(self.json[key].as_array().into_iter().flatten()) {
            *channel = check_share(self.label, key, number(value, f32::NAN))?;
        }
        Ok(rgb)
    }
}

/// A number where there is one.
fn number(value: &Value, usual: f32) -> f32 {
    if value.is_null() { usual } else { value.as_f64().unwrap_or(f64::NAN) as f32 }
}

/// So large that a body mirrors at normal incidence what its specular colour says.
const MIRROR_LIKE: f32 = 1e6;

/// The older model: a body of a diffuse colour under a layer of a specular one, whose glossiness is 1 less its roughness.
fn specular_glossiness(
    layers: &Value,
    textures: &mut Textures<'_, '_>,
    made: &mut Pbr,
    label: &str,
) -> Result<(), Reason> {
    let json = Layer { json: layers, label };
    let diffuse = json.colour("diffuseFactor", Vec3::ONE)?;
    let opacity = check_share(label, "diffuseFactor", number(&layers["diffuseFactor"][3], 1.0))?;
    let reference = Reference::of_json(&layers["diffuseTexture"]);
    (made.base, made.alpha) = textures.base(diffuse, opacity, reference, made.coverage);
    let (specular, glossiness) =
        (json.colour("specularFactor", Vec3::ONE)?, json.share("glossinessFactor", 1.0)?);
    let reference = Reference::of_json(&layers["specularGlossinessTexture"]);
    made.specular_colour = textures.colour("specular", specular, reference);
    (made.metallic, made.ior, made.roughness) = (0.0, MIRROR_LIKE, 1.0 - glossiness);
    if let Some(reference) = reference.filter(|_| glossiness > 0.0) {
        match textures.roughness_of_gloss(reference, glossiness) {
            Ok(texture) if texture.image.least().y == texture.image.most().y => {
                made.roughness = texture.image.mean().y;
            }
            Ok(texture) => (made.roughness, made.metallic_roughness) = (1.0, Some(texture)),
            Err(_) => {} // told already, with its colour
        }
    }
    Ok(())
}

fn check_amounts(label: &str, what: &str, rgb: Vec3) -> Result<(), Reason> {
    match rgb.is_finite() && rgb.min_element() >= 0.0 {
        true => Ok(()),
        false => Err(format!("{label}: its {what} {rgb} is negative or not finite; correct it")),
    }
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

    /// The base colour and alpha. Where both come to nothing the image is not looked at.
    fn base(
        &mut self,
        factor: Vec3,
        alpha: f32,
        reference: Option<Reference>,
        coverage: Alpha,
    ) -> (Factor<Vec3>, f32) {
        let reference = reference.filter(|_| factor != Vec3::ZERO || coverage != Alpha::Opaque);
        match self.content("base colour", reference, Encoding::Colour) {
            Content::Same(texel) => (Factor::new(factor * texel.xyz()), alpha * texel.w),
            Content::Varies(texture) => (Factor { factor, texture: Some(texture) }, alpha),
        }
    }

    /// A share times that in red.
    fn share(&mut self, kind: &str, factor: f32, reference: Option<Reference>) -> Factor<f32> {
        self.channel(kind, factor, reference, 0)
    }

    /// A share times that in one of the channels.
    fn channel(
        &mut self,
        kind: &str,
        factor: f32,
        reference: Option<Reference>,
        channel: usize,
    ) -> Factor<f32> {
        let reference = reference.filter(|_| factor != 0.0);
        match self.content(kind, reference, Encoding::Data) {
            Content::Same(texel) => Factor::new(factor * texel[channel]),
            Content::Varies(texture) => Factor { factor, texture: Some(texture) },
        }
    }

    /// A share of an extension, by the keys of its factor and of its texture.
    fn layer(
        &mut self,
        json: &Layer<'_>,
        kind: &str,
        [factor, texture]: [&str; 2],
        channel: usize,
    ) -> Result<Factor<f32>, Reason> {
        let share = json.share(factor, 0.0)?;
        Ok(self.channel(kind, share, Reference::of_json(&json.json[texture]), channel))
    }

    /// Roughness in green, from glossiness in alpha.
    fn roughness_of_gloss(&mut self, reference: Reference, glossiness: f32) -> Result<Texture, Reason> {
        let set = reference.checked()?;
        let (image, sampler) = self.images.roughness_of_gloss(reference.texture, glossiness)?;
        Ok(Texture { image, sampler, set, transform: reference.transform })
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
