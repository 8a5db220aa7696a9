//! What a [`SceneBuilder`] refuses: each reason names the thing and what it may be.

use super::illumination::{matrix_from, square_from};
use super::{
    Camera, Illumination, Lens, Luminaire, Material, Matter, Pbr, Profile, Projection, SceneBuilder, Shape,
};
use crate::light::{Light, Matrix};
use crate::optics::Lobe;
use glam::{Vec3, Vec4};

type Reason = String;

/// The versine of 10⁻⁵ rad: below, directions in f32 are too coarse for a disk.
const SMALLEST_SUN: f32 = 5e-11;

/// All that can be wrong before anything is put together.
pub(super) fn check(scene: &SceneBuilder, camera: &Camera) -> Result<(), Reason> {
    for material in &scene.materials {
        check_material(material).map_err(|what| format!("material `{}`: {what}", material.name))?;
    }
    for shape in &scene.shapes {
        check_shape(shape, scene.materials.len())
            .map_err(|what| format!("shape `{}`: {what}", shape.name))?;
    }
    for (i, luminaire) in scene.luminaires.iter().enumerate() {
        check_luminaire(luminaire, &scene.profiles).map_err(|what| format!("luminaire {i}: {what}"))?;
    }
    scene.illumination.map_or(Ok(()), check_illumination)?;
    if scene.origin.is_some_and(|origin| !origin.is_finite()) {
        return Err("its origin is not finite".into());
    }
    check_camera(camera).map_err(|what| format!("camera: {what}"))
}

fn check_material(material: &Material) -> Result<(), Reason> {
    for (share, lobe) in &material.lobes {
        let (colour, ior) = match lobe {
            Lobe::Diffuse(lobe) => (lobe.albedo, 1.0),
            Lobe::Mirror(lobe) => (lobe.tint.max(lobe.grazing), 1.0),
            Lobe::Dielectric(lobe) => (lobe.tint, lobe.ior),
            Lobe::ThinDielectric(lobe) => (lobe.tint, lobe.ior),
            Lobe::Glossy(lobe) => (lobe.f0.max(lobe.f90), 1.0),
            Lobe::RoughDielectric(lobe) => (lobe.tint, lobe.ior),
            Lobe::RoughThin(lobe) => (lobe.tint, lobe.ior),
            Lobe::Sheen(lobe) => (lobe.colour, 1.0),
            Lobe::Translucent(lobe) => (lobe.colour, 1.0),
        };
        if !is_amount(*share) || !is_colour(colour) {
            return Err(format!("{lobe:?} with share {share} is negative or not finite"));
        }
        if !(ior > 0.0 && ior.is_finite()) {
            return Err(format!("its ior is {ior}; a refractive index is above 0, such as 1.5"));
        }
    }
    if !is_colour(material.absorption) {
        return Err(format!("its absorption {} is negative or not finite", material.absorption));
    }
    if !is_amount(material.dispersion) {
        return Err(format!("its dispersion {} is negative or not finite", material.dispersion));
    }
    check_fluorescence(material)?;
    material.pattern.as_deref().map_or(Ok(()), check_pattern)?;
    material.opaque.into_iter().chain(material.straight).try_for_each(check_matrix)?;
    material.illumination.map_or(Ok(()), check_illumination)?;
    material.emission.map_or(Ok(()), |emission| check_light("its emission", emission.radiance))
}

/// What a material re-radiates, beside its base colour.
pub(super) fn check_fluorescence(material: &Material) -> Result<(), Reason> {
    let Some(fluorescence) = &material.fluorescence else { return Ok(()) };
    let diffuse = material.lobes.iter().filter_map(|(_, lobe)| lobe.as_diffuse());
    fluorescence.check(diffuse.fold(Vec3::ZERO, |most, lobe| most.max(lobe.albedo)))
}

fn check_illumination(illumination: Illumination) -> Result<(), Reason> {
    match illumination {
        Illumination::Square { s, t } => square_from(s, t).map(drop),
        Illumination::Whitted => Ok(()),
        Illumination::Own(Matter { opaque, straight }) => {
            check_matrix(opaque).and_then(|()| check_matrix(straight))
        }
    }
}

fn check_matrix(matrix: Matrix) -> Result<(), Reason> {
    let [[a, b], [c, d]] = matrix.rows();
    matrix_from([a, b, c, d]).map(drop)
}

fn check_shape(shape: &Shape, materials: usize) -> Result<(), Reason> {
    if shape.material as usize >= materials {
        return Err(format!("there is no material {}; the scene has {materials}", shape.material));
    }
    if let Some(vertex) = shape.positions.iter().position(|p| !p.is_finite()) {
        return Err(format!("the position of vertex {vertex} is not finite"));
    }
    let count = shape.positions.len();
    if let Some(normals) = &shape.normals {
        if normals.len() != count {
            return Err(format!("has {count} positions and {} normals; give as many", normals.len()));
        }
        if let Some(vertex) = normals.iter().position(|n| !n.is_finite()) {
            return Err(format!("the normal of vertex {vertex} is not finite"));
        }
    }
    check_attributes(shape)?;
    match shape.triangles.iter().flatten().find(|vertex| **vertex as usize >= count) {
        Some(vertex) => Err(format!("a triangle refers to vertex {vertex} of {count}")),
        None => Ok(()),
    }
}

fn check_attributes(shape: &Shape) -> Result<(), Reason> {
    for uvs in shape.uvs.iter().flatten() {
        check_vertices(shape, "texture coordinates", uvs, |uv| uv.is_finite())?;
    }
    if let Some(colours) = &shape.colours {
        let share = |colour: &Vec4| colour.to_array().iter().all(|x| (0.0..=1.0).contains(x));
        check_vertices(shape, "colours (0 to 1)", colours, share)?;
    }
    shape
        .tangents
        .as_ref()
        .map_or(Ok(()), |tangents| check_vertices(shape, "tangents", tangents, |tangent| tangent.is_finite()))
}

fn check_vertices<T>(
    shape: &Shape,
    what: &str,
    values: &[T],
    fine: impl Fn(&T) -> bool,
) -> Result<(), Reason> {
    let (count, n) = (shape.positions.len(), values.len());
    if n != count {
        return Err(format!("has {count} positions and {n} {what}; give as many"));
    }
    match values.iter().position(|value| !fine(value)) {
        Some(vertex) => Err(format!("the {what} of vertex {vertex} cannot be")),
        None => Ok(()),
    }
}

fn check_pattern(pattern: &Pbr) -> Result<(), Reason> {
    let Pbr { base, metallic, roughness, emissive, emission, ior, .. } = pattern;
    let colours = [base.factor, pattern.sheen.factor, pattern.translucent_colour.factor];
    let mut shares: Vec<f32> = colours.iter().flat_map(Vec3::to_array).collect();
    shares.extend([*metallic, *roughness, pattern.alpha]);
    let others = [
        &pattern.transmission,
        &pattern.specular,
        &pattern.translucence,
        &pattern.coat,
        &pattern.coat_roughness,
        &pattern.sheen_roughness,
        &pattern.film,
    ];
    shares.extend(others.map(|share| share.factor));
    shares.extend(pattern.anisotropy.iter().map(|grain| grain.strength));
    if let Some(share) = shares.iter().find(|share| !(0.0..=1.0).contains(*share)) {
        return Err(format!("a factor of its pattern is {share}; it goes from 0 to 1"));
    }
    let emits = is_colour(emissive.factor) && emission.iter().copied().all(is_amount);
    let placed = pattern.textures().all(|texture| texture.transform.is_finite() && texture.set < 2);
    let bumps = pattern.normal.as_ref().is_none_or(|map| map.scale.is_finite())
        && pattern.anisotropy.as_ref().is_none_or(|grain| grain.rotation.is_finite())
        && is_colour(pattern.specular_colour.factor)
        && pattern.film_ior > 0.0
        && pattern.film_thickness.iter().copied().chain([pattern.film_ior]).all(is_amount);
    match emits && placed && bumps && *ior > 0.0 && ior.is_finite() {
        true => Ok(()),
        false => Err("a number of its pattern is negative or not finite, or a texture's set beyond 1".into()),
    }
}

fn check_luminaire(luminaire: &Luminaire, profiles: &[Profile]) -> Result<(), Reason> {
    let (position, direction, light) = match *luminaire {
        Luminaire::Triangle { .. } => {
            return Err("triangles shine by the emission of their material; give it one".into());
        }
        Luminaire::Point { position, intensity } => (position, None, intensity),
        Luminaire::Spot { position, direction, intensity, .. } => (position, Some(direction), intensity),
        Luminaire::Warn { position, direction, intensity, exponent, attenuation } => {
            if !is_amount(exponent) || !attenuation.into_iter().all(is_amount) || attenuation == [0.0; 3] {
                return Err(format!(
                    "its exponent {exponent} and attenuation {attenuation:?} must be finite and not negative, \
                     one of the latter above 0"
                ));
            }
            (position, Some(direction), intensity)
        }
        Luminaire::Profile { position, intensity, profile } => {
            let Some(profile) = profiles.get(profile as usize) else {
                return Err(format!("there is no profile {profile}; the scene has {}", profiles.len()));
            };
            if !profile.is_upright() {
                return Err("the axes of its profile are not of length 1 and square to each other".into());
            }
            (position, None, intensity)
        }
        Luminaire::Directional { direction, irradiance } => (Vec3::ZERO, Some(direction), irradiance),
        Luminaire::Sun { direction, radiance, versine } => {
            if !(SMALLEST_SUN..=1.0).contains(&versine) {
                return Err(format!(
                    "its versine is {versine}; a sun's angular radius is from 1e-5 rad to a right angle: take parallel light"
                ));
            }
            (Vec3::ZERO, Some(direction), radiance)
        }
        Luminaire::Environment { .. } => {
            return Err("an environment is given to the builder as such; leave out this luminaire".into());
        }
    };
    if !position.is_finite() {
        return Err("its position is not finite".into());
    }
    if direction.is_some_and(|direction| !direction.is_normalized()) {
        return Err("its direction is not of length 1; normalize it".into());
    }
    check_light("its light", light)
}

fn check_light(what: &str, light: Light) -> Result<(), Reason> {
    if is_colour(light.invisible) && is_colour(light.visible) {
        Ok(())
    } else {
        Err(format!("{what} {light:?} is negative or not finite"))
    }
}

fn check_camera(camera: &Camera) -> Result<(), Reason> {
    let axes = [camera.right, camera.up, camera.forward];
    if !camera.position.is_finite() || !axes.into_iter().all(Vec3::is_normalized) {
        return Err(
            "its position is not finite, or its axes are not of length 1; does it look at itself?".into()
        );
    }
    let fine = match camera.projection {
        Projection::Perspective { yfov } => yfov > 0.0 && yfov < std::f32::consts::PI,
        Projection::Orthographic { half_height } => half_height > 0.0 && half_height.is_finite(),
    };
    if !fine {
        return Err(format!("{:?}; an angle lies between 0 and π, a height above 0", camera.projection));
    }
    if let Some(aspect) = camera.aspect.filter(|aspect| !(*aspect > 0.0 && aspect.is_finite())) {
        return Err(format!("its aspect ratio is {aspect}; it is above 0"));
    }
    match (camera.lens, camera.projection) {
        (None, _) => Ok(()),
        (Some(_), Projection::Orthographic { .. }) => {
            Err("an orthographic camera has no lens; leave it out, or make the projection perspective".into())
        }
        (Some(Lens { radius, focus }), _) if is_amount(radius) && focus > 0.0 && focus.is_finite() => Ok(()),
        (Some(lens), _) => Err(format!("{lens:?}; a radius is not negative, a distance above 0")),
    }
}

pub(super) fn is_amount(x: f32) -> bool {
    x >= 0.0 && x.is_finite()
}

fn is_colour(rgb: Vec3) -> bool {
    rgb.to_array().into_iter().all(is_amount)
}
