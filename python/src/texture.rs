//! Images on materials, from arrays.

use crate::errors::usage;
use halflight::scene::texture::{Encoding, Image, Texture};
use halflight::scene::{Anisotropy, NormalMap, Pbr};
use numpy::{PyArray, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

/// What textures may say, in the words of the keys of `textures`.
const NAMES: [&str; 16] = [
    "base_color",
    "metallic_roughness",
    "normal",
    "emissive",
    "transmission",
    "specular",
    "specular_color",
    "diffuse_transmission",
    "diffuse_transmission_color",
    "clearcoat",
    "clearcoat_roughness",
    "sheen_color",
    "sheen_roughness",
    "iridescence",
    "iridescence_thickness",
    "anisotropy",
];

/// Lays images on a material, by what they say. Channels as in glTF.
pub fn lay(pbr: &mut Pbr, textures: &Bound<'_, PyDict>) -> PyResult<()> {
    for (name, image) in textures {
        let name = name.str()?.to_string();
        let texture = Some(Texture::new(Arc::new(read(&name, &image)?)));
        match name.as_str() {
            "base_color" => pbr.base.texture = texture,
            "metallic_roughness" => pbr.metallic_roughness = texture,
            "normal" => pbr.normal = texture.map(|texture| NormalMap { texture, scale: 1.0 }),
            "emissive" => pbr.emissive.texture = texture,
            "transmission" => pbr.transmission.texture = texture,
            "specular" => pbr.specular.texture = texture,
            "specular_color" => pbr.specular_colour.texture = texture,
            "diffuse_transmission" => pbr.translucence.texture = texture,
            "diffuse_transmission_color" => pbr.translucent_colour.texture = texture,
            "clearcoat" => pbr.coat.texture = texture,
            "clearcoat_roughness" => pbr.coat_roughness.texture = texture,
            "sheen_color" => pbr.sheen.texture = texture,
            "sheen_roughness" => pbr.sheen_roughness.texture = texture,
            "iridescence" => pbr.film.texture = texture,
            "iridescence_thickness" => pbr.film_texture = texture,
            "anisotropy" => {
                let grain = pbr.anisotropy.take();
                let grain = grain.unwrap_or(Anisotropy { strength: 1.0, rotation: 0.0, texture: None });
                pbr.anisotropy = Some(Anisotropy { texture, ..grain });
            }
            _ => {
                return Err(usage(format!("textures: there is no `{name}`; there are {}", NAMES.join(", "))));
            }
        }
    }
    Ok(())
}

/// An array of bytes of shape (height, width) or (height, width, channels), row by row from the top.
fn read(name: &str, image: &Bound<'_, PyAny>) -> PyResult<Image> {
    let wrong =
        || usage(format!("textures[{name:?}]: not an array of uint8 of shape (height, width, 1 to 4)"));
    let array = image.cast::<PyArray<u8, numpy::IxDyn>>().map_err(|_| wrong())?;
    let ([height, width] | [height, width, 1..=4]) = *array.shape() else { return Err(wrong()) };
    let texels = array.readonly().as_array().iter().copied().collect();
    let side = |side: usize| u32::try_from(side).map_err(|_| wrong());
    let encoding = match name {
        "base_color" | "emissive" | "specular_color" | "diffuse_transmission_color" | "sheen_color" => {
            Encoding::Colour
        }
        _ => Encoding::Data,
    };
    Image::new(name, [side(width)?, side(height)?], texels, encoding).ok_or_else(wrong)
}
