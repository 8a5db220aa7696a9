//! How a material refers to an image, and a mesh lays it out.

use super::Reason;
use glam::{Affine2, Mat2, Vec2};
use gltf::json::material::NormalTexture;
use gltf::json::texture::Info;
use serde_json::{Value, json};

/// A texture as a material refers to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reference {
    /// Index into the file's textures.
    pub texture: usize,
    /// By which of the vertices' sets of texture coordinates it is laid out.
    pub set: u32,
    /// From those to the image.
    pub transform: Affine2,
}

const TRANSFORM: &str = "KHR_texture_transform";

impl Reference {
    pub fn of(info: &Info) -> Self {
        let transform = info.extensions.as_ref().and_then(|more| more.texture_transform.as_ref());
        let plain = Self { texture: info.index.value(), set: info.tex_coord, transform: Affine2::IDENTITY };
        let Some(more) = transform else { return plain };
        Self {
            set: more.tex_coord.unwrap_or(info.tex_coord),
            transform: transform_of(more.offset.0, more.rotation.0, more.scale.0),
            ..plain
        }
    }

    pub fn of_normal(info: &NormalTexture) -> Option<Self> {
        let transform = info.extensions.as_ref().and_then(|more| more.others.get(TRANSFORM));
        Self::of_json(&json!({
            "index": info.index.value(),
            "texCoord": info.tex_coord,
            "extensions": { TRANSFORM: transform },
        }))
    }

    /// Of a texture of an extension that the gltf crate does not know. None: there is none.
    pub fn of_json(info: &Value) -> Option<Self> {
        let index = |value: &Value| value.as_u64().and_then(|index| u32::try_from(index).ok());
        let transform = &info["extensions"][TRANSFORM];
        let number = |value: &Value| value.as_f64().map(|x| x as f32);
        let pair = |key: &str, or: f32| [0, 1].map(|i| number(&transform[key][i]).unwrap_or(or));
        let set = index(&transform["texCoord"]).or_else(|| index(&info["texCoord"]));
        Some(Self {
            texture: index(&info["index"])? as usize,
            set: set.unwrap_or(0),
            transform: transform_of(
                pair("offset", 0.0),
                number(&transform["rotation"]).unwrap_or(0.0),
                pair("scale", 1.0),
            ),
        })
    }

    /// Which of the two sets that are read. Err: why it cannot be shown.
    pub fn checked(&self) -> Result<u8, Reason> {
        if !self.transform.is_finite() {
            return Err(format!("its {TRANSFORM} is not finite"));
        }
        match self.set {
            0 => Ok(0),
            1 => Ok(1),
            more => {
                Err(format!("of texture coordinates TEXCOORD_0 and TEXCOORD_1 are read, not TEXCOORD_{more}"))
            }
        }
    }
}

/// Scaled, then turned counter-clockwise as the image is seen (whose second coordinate runs down), then moved: as the text of
/// KHR_texture_transform says and viewers do; the listing in it turns the other way (KhronosGroup/glTF#1563).
fn transform_of(offset: [f32; 2], rotation: f32, scale: [f32; 2]) -> Affine2 {
    let turned = Mat2::from_angle(-rotation);
    Affine2::from_mat2_translation(turned * Mat2::from_diagonal(scale.into()), Vec2::from_array(offset))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transform_scales_then_turns_then_moves() {
        let info = json!({ "index": 3, "texCoord": 0, "extensions": { TRANSFORM: {
            "offset": [0.5, 0.25], "rotation": std::f32::consts::FRAC_PI_2, "scale": [2, 3], "texCoord": 1 } } });
        let reference = Reference::of_json(&info).unwrap();
        assert_eq!((reference.texture, reference.set), (3, 1));
        // Right becomes up, which is negative; down becomes right.
        let at = |uv: [f32; 2]| reference.transform.transform_point2(uv.into());
        assert!(at([1.0, 0.0]).distance(Vec2::new(0.5, -1.75)) < 1e-6, "{}", at([1.0, 0.0]));
        assert!(at([0.0, 1.0]).distance(Vec2::new(3.5, 0.25)) < 1e-6, "{}", at([0.0, 1.0]));
        assert_eq!(Reference::of_json(&json!({})), None);
        assert!(Reference::of_json(&json!({ "index": 0, "texCoord": 2 })).unwrap().checked().is_err());
    }
}
