use super::Reason;
use super::extras::{Extras, Place};
use super::graph::Placed;
use super::notes::{Notes, label};
use crate::scene::centre::Eye;
use crate::scene::names::listed;
use crate::scene::{Camera, Mesh, NO_CAMERA, Projection};
use glam::{DVec3, Vec3};
use gltf::json::Root;
use gltf::json::camera::{Camera as Source, Type};
use gltf::json::validation::Checked;
use std::f32::consts::PI;

/// True where the scene has a camera.
pub(super) fn is_placed(placed: &[Placed<'_>]) -> bool {
    !cameras(placed).is_empty()
}

/// The camera of the scene about `origin` that is `wanted`, by its own or its node's name, else by number from 0; else
/// its first camera; else one that sees all of `mesh`.
pub(super) fn choose(
    root: &Root,
    placed: &[Placed<'_>],
    wanted: Option<&str>,
    origin: DVec3,
    mesh: &Mesh,
    notes: &mut Notes,
) -> Result<Camera, Reason> {
    let found = cameras(placed);
    let chosen = match wanted {
        None => 0,
        Some(wanted) => find(root, &found, wanted)?,
    };
    let Some((place, index)) = found.get(chosen).copied() else {
        notes.line(NO_CAMERA.into());
        return Ok(framing(mesh));
    };
    let others = found.iter().enumerate().filter(|(other, _)| *other != chosen);
    let others: Vec<_> = others.map(|(_, (other, _))| other.name()).collect();
    if !others.is_empty() && wanted.is_none() {
        notes.line(format!(
            "seen by the first camera, {}; --camera NAME or N (from 0) takes another: {}",
            place.name(),
            listed(others.iter().map(String::as_str))
        ));
    }
    let missing = || format!("{}: its camera {index} does not exist; export it again", place.label());
    let source = root.cameras.get(index).ok_or_else(missing)?;
    let label = label("camera", index, source.name.as_deref());
    let (projection, aspect) = project(source).map_err(|what| format!("{label}: {what}"))?;
    let lens = Extras::new(&source.extras, label.clone(), Place::Camera, notes).lens(projection)?;
    if aspect.is_some_and(|a| !(a > 0.0 && a.is_finite())) {
        return Err(format!("{label}: its aspect ratio is not above 0; correct it"));
    }
    let forward = place.forward()?;
    let right = forward.cross(place.to_world.matrix3.y_axis).try_normalize();
    let right = right.ok_or_else(|| format!("{} is scaled to nothing; give it a scale", place.label()))?;
    let position = (place.position() - origin).as_vec3();
    if !position.is_finite() {
        return Err(format!("{} is too far away for single precision; move it nearer", place.label()));
    }
    Ok(Camera {
        position,
        right: right.as_vec3(),
        up: right.cross(forward).as_vec3(),
        forward: forward.as_vec3(),
        projection,
        aspect,
        lens,
    })
}

/// From where the scene is seen, in the world. None without a camera, or with one that [`choose`] refuses.
pub(super) fn eye(root: &Root, placed: &[Placed<'_>], wanted: Option<&str>) -> Option<Eye> {
    let found = cameras(placed);
    let (place, index) = *found.get(wanted.map_or(Ok(0), |wanted| find(root, &found, wanted)).ok()?)?;
    let (projection, aspect) = project(root.cameras.get(index)?).ok()?;
    Some(Eye::new(place.position(), place.forward().ok()?, projection, aspect))
}

/// The nodes that hold a camera, with its index.
fn cameras<'a>(placed: &'a [Placed<'a>]) -> Vec<(&'a Placed<'a>, usize)> {
    placed.iter().filter_map(|place| Some((place, place.node.camera?.value()))).collect()
}

/// The place among `found` of the camera that is called `wanted`.
fn find(root: &Root, found: &[(&Placed<'_>, usize)], wanted: &str) -> Result<usize, Reason> {
    let own_name = |index: usize| root.cameras.get(index).and_then(|camera| camera.name.as_deref());
    let by_node = found.iter().position(|(place, _)| place.name() == wanted);
    let by_name = || found.iter().position(|(_, index)| own_name(*index) == Some(wanted));
    let by_number = || wanted.parse().ok().filter(|number| *number < found.len());
    by_node.or_else(by_name).or_else(by_number).ok_or_else(|| {
        let names: Vec<_> = found.iter().map(|(place, _)| place.name()).collect();
        match &names[..] {
            [] => format!("has no camera `{wanted}`, as it has none; leave out --camera"),
            names => format!(
                "has no camera `{wanted}`; --camera takes a name, or a number from 0: it has {}",
                listed(names.iter().map(String::as_str))
            ),
        }
    })
}

fn project(source: &Source) -> Result<(Projection, Option<f32>), Reason> {
    match (source.type_, &source.perspective, &source.orthographic) {
        (Checked::Valid(Type::Perspective), Some(p), _) if p.yfov > 0.0 && p.yfov < PI => {
            Ok((Projection::Perspective { yfov: p.yfov }, p.aspect_ratio))
        }
        (Checked::Valid(Type::Perspective), Some(p), _) => {
            Err(format!("its yfov is {} rad; it lies between 0 and π", p.yfov))
        }
        (Checked::Valid(Type::Orthographic), _, Some(o)) if o.ymag != 0.0 && o.ymag.is_finite() => {
            Ok((Projection::Orthographic { half_height: o.ymag.abs() }, Some((o.xmag / o.ymag).abs())))
        }
        (Checked::Valid(Type::Orthographic), _, Some(o)) => {
            Err(format!("its ymag is {}; give it half the height of what it sees", o.ymag))
        }
        _ => Err("has neither a perspective nor an orthographic projection; export it again".into()),
    }
}

/// A camera that sees the whole mesh, from the front (+Z) and slightly above, on a film of any shape.
fn framing(mesh: &Mesh) -> Camera {
    let (min, max) = mesh.bounds();
    let centre = 0.5 * (min + max);
    let radius = mesh.positions.iter().map(|p| p.distance(centre)).fold(0.0, f32::max);
    let yfov = 40.0_f32.to_radians();
    // 17° above.
    let away = Vec3::new(0.0, 0.3, 1.0).normalize();
    let position = centre + radius / (0.5 * yfov).sin() * away;
    let camera = Camera::look_at(position, centre, Vec3::Y, Projection::Perspective { yfov });
    Camera { aspect: Some(1.0), ..camera }
}
