//! EXT_lights_image_based: a cube of pictures around a scene, within its file. The pictures of its first level are what is there;
//! those of others, and the coefficients of irradiance, are made of it for viewers that do not trace light.

use super::Reason;
use super::accessor::Accessors;
use super::extras::numbers;
use super::image::Images;
use super::notes::label;
use super::stage::Stage;
use crate::pictures::Pixels;
use crate::scene::environment::{AtInfinity, Cube, Shining};
use crate::scene::texture::to_linear;
use glam::{Mat3, Quat, Vec4};
use serde_json::Value;
use std::path::Path;

pub(super) const NAME: &str = "EXT_lights_image_based";

/// Texels of a row of a face: six faces are 300 MB.
const MOST_SIDE: u32 = 2048;

/// What colours are raised to before their alpha divides them. The extension leaves it open; Babylon.js, which it comes from, writes
/// and reads them so (helperFunctions.fx: toRGBD, fromRGBD).
const RGBD_POWER: f64 = 2.2;

/// The image-based light of the scene that is shown. None: it has none.
pub(super) fn read(
    accessors: &Accessors<'_>,
    stage: &Stage<'_>,
    folder: &Path,
) -> Result<Option<Shining>, Reason> {
    let root = accessors.root;
    let scene = stage.index.and_then(|index| root.scenes.get(index));
    let reference = scene.and_then(|scene| scene.extensions.as_ref()?.others.get(NAME));
    let Some(reference) = reference else { return Ok(None) };
    let Some(index) = index(&reference["light"]) else {
        return Err(format!("{}: its {NAME} names no light; export it again", stage.label));
    };
    let lights = root.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME)?.get("lights"));
    let Some(light) = lights.and_then(|lights| lights.get(index)) else {
        return Err(format!(
            "{}: its image-based light {index} does not exist; export it again",
            stage.label
        ));
    };
    let label = label("image-based light", index, light["name"].as_str());
    let shining = shining(light, label.clone(), &mut Images::new(accessors, folder));
    shining.map(Some).map_err(|what| format!("{label}: {what}"))
}

fn shining(light: &Value, name: String, images: &mut Images<'_>) -> Result<Shining, Reason> {
    let strength = intensity(light)?;
    let turn = Some(rotation(light)?);
    let panorama = cube(light, images)?.panorama();
    Ok(Shining { name, light: AtInfinity { panorama, sun: None }, turn, strength })
}

fn intensity(light: &Value) -> Result<f32, Reason> {
    let Some(value) = light.get("intensity") else { return Ok(1.0) };
    let number = value.as_f64().map(|x| x as f32).filter(|x| x.is_finite() && *x >= 0.0);
    number.ok_or_else(|| format!("its intensity is {}; it is a factor, 0 or more", shown(value)))
}

/// From the cube's own space to the scene's.
fn rotation(light: &Value) -> Result<Mat3, Reason> {
    let Some(value) = light.get("rotation") else { return Ok(Mat3::IDENTITY) };
    let unit = numbers(value).and_then(|numbers| Vec4::from_array(numbers).try_normalize());
    let wrong = || format!("its rotation is {}; it is a quaternion [x, y, z, w] of length 1", shown(value));
    unit.map(|unit| Mat3::from_quat(Quat::from_vec4(unit))).ok_or_else(wrong)
}

fn cube(light: &Value, images: &mut Images<'_>) -> Result<Cube, Reason> {
    let levels = light["specularImages"].as_array().filter(|levels| !levels.is_empty());
    let Some(levels) = levels else {
        return Err("has no specularImages, and its irradianceCoefficients alone do not say what mirrors show; export it with them, \
                    or name another sky by --environment"
            .into());
    };
    let faces: Option<Vec<usize>> = levels[0].as_array().and_then(|faces| faces.iter().map(index).collect());
    let faces: Option<[usize; 6]> = faces.and_then(|faces| faces.try_into().ok());
    let faces =
        faces.ok_or("its specularImages do not begin with the six faces of a cube; export it again")?;
    let side = side(light)?;
    let mut read = Vec::with_capacity(6);
    for image in faces {
        read.push(images.stored(image).and_then(|pixels| face(&pixels, side)).map_err(|what| {
            let name = images.name(image);
            format!("{name}: {what}")
        })?);
    }
    let faces = read.try_into().map_err(|_| "has no six faces")?;
    Ok(Cube::new(side, &faces))
}

/// How many texels a row of a face has.
fn side(light: &Value) -> Result<u32, Reason> {
    let value = &light["specularImageSize"];
    let side = value.as_u64().and_then(|side| u32::try_from(side).ok());
    side.filter(|side| (1..=MOST_SIDE).contains(side)).ok_or_else(|| {
        format!("its specularImageSize is {}; faces have 1 to {MOST_SIDE} pixels in a row", shown(value))
    })
}

/// The linear colours of a face: RGBD where it has alpha, else sRGB.
fn face(pixels: &Pixels, side: u32) -> Result<Vec<[f32; 3]>, Reason> {
    let Pixels { width, height, channels, .. } = pixels;
    if [*width, *height] != [side; 2] {
        return Err(format!(
            "is {width} × {height} where specularImageSize says {side} × {side}; export it again"
        ));
    }
    let each = channels.len() / (side as usize * side as usize);
    let has_alpha = each.is_multiple_of(2);
    let linear: [f32; 256] = std::array::from_fn(|stored| {
        let share = stored as f64 / 255.0;
        (if has_alpha { share.powf(RGBD_POWER) } else { to_linear(share) }) as f32
    });
    let texel = |(number, texel): (usize, &[u8])| {
        let alpha = if has_alpha { texel[each - 1] } else { 255 };
        if alpha == 0 {
            let (column, row) = (number % side as usize, number / side as usize);
            return Err(format!(
                "its texel in column {column}, row {row} (from 0 at the upper left) has alpha 0, which divides its light \
                 (RGBD); mend it in an image editor"
            ));
        }
        let rgb = if each < 3 { [texel[0]; 3] } else { [texel[0], texel[1], texel[2]] };
        Ok(rgb.map(|stored| linear[usize::from(stored)] / (f32::from(alpha) / 255.0)))
    };
    channels.chunks_exact(each).enumerate().map(texel).collect()
}

fn index(value: &Value) -> Option<usize> {
    value.as_u64().and_then(|index| usize::try_from(index).ok())
}

fn shown(value: &Value) -> String {
    value.to_string().chars().take(60).collect()
}
