//! glTF 2.0 in.
//!
//! The gltf crate parses the JSON and nothing more: its readers and its validation can panic on damaged files, so
//! every reference is looked up with `get` and every byte range is checked here.

mod accessor;
mod camera;
mod container;
mod extras;
mod geometry;
mod graph;
mod lights;
mod material;
mod notes;

use super::Scene;
use super::assembly::{Piece, assemble};
use crate::error::Error;
use accessor::Accessors;
use extras::{Extras, Place};
use geometry::Geometry;
use glam::{DVec3, Vec3};
use gltf::json::Root;
use graph::Placed;
use material::{Materials, Wanted};
use notes::{Notes, label, one_line};
use std::collections::HashMap;
use std::path::Path;

/// What is wrong and the way out; the file's name goes before it.
type Reason = String;

/// Extensions that do not change the picture we make, or that are reported by who uses them.
const QUIET: &[&str] = &[
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_materials_variants",
    "KHR_mesh_quantization",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "EXT_texture_avif",
    "EXT_texture_webp",
];

pub(super) fn load(path: &Path) -> crate::error::Result<Scene> {
    let bytes = std::fs::read(path).map_err(|source| Error::Read { path: path.to_owned(), source })?;
    let name = path.display().to_string();
    let folder = path.parent().unwrap_or(Path::new(""));
    read(&bytes, folder, &name).map_err(|reason| Error::scene(one_line(&name), one_line(&reason)))
}

fn read(bytes: &[u8], folder: &Path, name: &str) -> Result<Scene, Reason> {
    let (root, chunk) = container::split(bytes)?;
    let buffers = container::load_buffers(&root, chunk, folder)?;
    let accessors = Accessors { root: &root, buffers: &buffers };
    let mut notes = Notes::default();

    let index = root.scene.map_or(0, |scene| scene.value());
    let source = root.scenes.get(index).ok_or(match root.scene {
        Some(_) => "its default scene does not exist; export it again",
        None => "has no scene; put the objects into one and export it again",
    })?;
    let extras =
        Extras::new(&source.extras, label("scene", index, source.name.as_deref()), Place::Scene, &mut notes);
    let illumination = extras.illumination()?;
    let placed = graph::place(&root, source)?;
    report(&root, &placed, &mut notes);

    let mut materials = Materials::new(&root, &mut notes)?;
    let pieces = pieces(&accessors, &placed, &mut materials, &mut notes)?;
    let assembly = assemble(pieces, camera::eye(&root, &placed))?;
    assembly.rounded.iter().for_each(|note| notes.line(note.clone()));
    let materials = materials.finish(&mut notes);
    match assembly.without_area {
        0 => {}
        1 => notes.line("1 triangle without area was left out".into()),
        n => notes.line(format!("{n} triangles without area were left out")),
    }
    for surface in &assembly.inside_out {
        notes.about("the vertex normals look away from the front (counter-clockwise side)", surface);
    }
    if assembly.mesh.triangles.is_empty() {
        return Err("has no triangles; add a mesh to the scene".into());
    }
    let mut luminaires = assembly.luminaires(&materials);
    luminaires.extend(lights::punctual(&root, &placed, assembly.origin, &mut notes)?);
    if luminaires.is_empty() {
        return Err("nothing emits light; add a lamp, or a material with an emissive colour".into());
    }
    let camera = camera::choose(&root, &placed, assembly.origin, &assembly.mesh, &mut notes)?;
    Ok(Scene {
        name: name.to_owned(),
        mesh: assembly.mesh,
        surfaces: assembly.surfaces,
        materials,
        luminaires,
        camera,
        origin: assembly.origin,
        illumination,
        notes: notes.finish(),
    })
}

/// One piece per primitive under each node.
fn pieces(
    accessors: &Accessors<'_>,
    placed: &[Placed<'_>],
    materials: &mut Materials<'_>,
    notes: &mut Notes,
) -> Result<Vec<Piece>, Reason> {
    let mut read: HashMap<(usize, usize), Option<Geometry>> = HashMap::new();
    let mut pieces = Vec::new();
    for place in placed {
        let Some(index) = place.node.mesh.map(|mesh| mesh.value()) else { continue };
        let missing = || format!("{}: its mesh {index} does not exist; export it again", place.label());
        let mesh = accessors.root.meshes.get(index).ok_or_else(missing)?;
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let mesh_label = label("mesh", index, mesh.name.as_deref());
            let geometry = match read.entry((index, number)) {
                std::collections::hash_map::Entry::Occupied(known) => known.into_mut(),
                std::collections::hash_map::Entry::Vacant(new) => {
                    let geometry = geometry::read(accessors, primitive);
                    new.insert(geometry.map_err(|what| format!("{mesh_label}: {what}"))?)
                }
            };
            let Some(geometry) = geometry else {
                notes.about("points, lines and empty meshes are no surfaces and were left out", &mesh_label);
                continue;
            };
            let name = place.name();
            let material = primitive.material.map(|material| material.value());
            let wanted = Wanted { material, closure: geometry.closure, surface: &name };
            let material = materials.index(wanted, notes)?;
            pieces.push(instance(geometry, place, name, material));
        }
    }
    Ok(pieces)
}

fn instance(geometry: &Geometry, place: &Placed<'_>, name: String, material: u32) -> Piece {
    let linear = place.to_world.matrix3;
    let mirrored = linear.determinant() < 0.0;
    // det · M⁻ᵀ, which exists where the inverse does not; its sign is given back so that the outside stays outside.
    let sign = if mirrored { -1.0 } else { 1.0 };
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
    let (nx, ny, nz) = (sign * y.cross(z), sign * z.cross(x), sign * x.cross(y));
    let turn = |n: &Vec3| {
        let n = n.as_dvec3();
        (n.x * nx + n.y * ny + n.z * nz).normalize_or_zero().as_vec3()
    };
    let triangles = geometry.triangles.iter();
    Piece {
        name,
        material,
        positions: geometry.positions.iter().map(|p: &DVec3| place.to_world.transform_point3(*p)).collect(),
        normals: geometry.normals.as_ref().map(|normals| normals.iter().map(turn).collect()),
        triangles: triangles.map(|&[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] }).collect(),
        closed: geometry.closure.closed,
    }
}

/// Tells what is in the file and changes the picture, but is not read.
fn report(root: &Root, placed: &[Placed<'_>], notes: &mut Notes) {
    if !root.animations.is_empty() {
        notes.line("animations are not supported; the scene is seen at rest".into());
    }
    for place in placed {
        let node = place.node;
        if node.extensions.as_ref().is_none_or(|e| e.khr_lights_punctual.is_none()) {
            Extras::new(&node.extras, place.label(), Place::Elsewhere, notes);
        }
        if node.skin.is_some() {
            notes.about("skins are not supported, the mesh is seen unposed", &place.name());
        }
        for (name, _) in node.extensions.iter().flat_map(|e| &e.others) {
            notes.about(&format!("{name} is not supported"), &place.name());
        }
        let Some(mesh) = node.mesh.and_then(|mesh| root.meshes.get(mesh.value())) else { continue };
        Extras::new(&mesh.extras, format!("mesh of {}", place.label()), Place::Elsewhere, notes);
        let weights = node.weights.as_ref().or(mesh.weights.as_ref());
        let morphs = mesh.primitives.iter().any(|p| p.targets.as_ref().is_some_and(|t| !t.is_empty()));
        if morphs && weights.is_some_and(|weights| weights.iter().any(|w| *w != 0.0)) {
            notes.about("morph targets are not supported, the mesh is seen undeformed", &place.name());
        }
        let coloured = |semantic: &gltf::json::validation::Checked<gltf::Semantic>| {
            matches!(semantic, gltf::json::validation::Checked::Valid(gltf::Semantic::Colors(0)))
        };
        if mesh.primitives.iter().any(|primitive| primitive.attributes.keys().any(coloured)) {
            notes.about("vertex colours are not supported yet", &place.name());
        }
    }
    let told = |name: &str| name.starts_with("KHR_materials_") || placed.iter().any(|p| uses(p, name));
    for name in root.extensions_used.iter().filter(|name| !QUIET.contains(&name.as_str()) && !told(name)) {
        notes.line(format!("the glTF extension {name} is not supported and passed over"));
    }
}

fn uses(place: &Placed<'_>, extension: &str) -> bool {
    place.node.extensions.as_ref().is_some_and(|e| e.others.contains_key(extension))
}
