//! glTF 2.0 in.
//!
//! The gltf crate parses the JSON and nothing more: its readers and its validation can panic on damaged files, so
//! every reference is looked up with `get` and every byte range is checked here.

mod accessor;
mod animation;
mod area;
mod camera;
mod container;
mod count;
mod document;
mod extensions;
mod extent;
mod extras;
mod files;
mod geometry;
mod graph;
mod ies;
mod image;
mod image_light;
mod instances;
mod lights;
mod material;
mod morph;
mod notes;
mod parameters;
mod skin;
mod stage;
mod tangents;
mod texture;
mod unpack;
mod variants;

use super::assembly::Assembly;
use super::environment::{Around, Shining, Source};
use super::names::{listed, one_line};
use super::{Choice, Loaded, Luminaire, Scene, SceneBuilder, Shape, Surroundings};
use crate::error::Error;
use accessor::Accessors;
use animation::Weights;
use document::{Document, Stance};
use extensions::{Standing, standing};
use extras::{Extras, Place};
pub(super) use files::locate;
use geometry::Geometry;
use glam::{DAffine3, DVec3, Vec3};
use gltf::Semantic;
use gltf::json::Root;
use gltf::json::mesh::Primitive;
use gltf::json::validation::Checked;
use graph::Placed;
use image::Images;
use material::{Materials, Wanted};
use notes::{Notes, label};
use skin::Posed;
use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::Path;
use unpack::draco::Most;

/// What is wrong and the way out; the file's name goes before it.
type Reason = String;

/// Bytes that packed primitives may unpack to where nobody knows how much memory there is.
const UNPACKED: u64 = 1 << 32;

/// Reads what is chosen of a file, and says which files it is of.
pub(super) fn load(path: &Path, choice: &Choice) -> crate::error::Result<Loaded> {
    let bytes = files::read_scene(path)?;
    let name = one_line(&path.display().to_string());
    let folder = path.parent().unwrap_or(Path::new(""));
    match read(&bytes, folder, &name, choice) {
        Ok((mut loaded, around, held)) => {
            loaded.files.push(path.to_owned());
            // Whoever renders it may name a file anywhere; the scene itself may not.
            let beside = if choice.around.source.is_some() { None } else { Some(folder) };
            match held {
                Some(held) => loaded.scene.surround_by(held, &around)?,
                None => loaded.scene.put_into(&around, beside)?,
            }
            loaded.files.extend(around.file(beside)?);
            Ok(loaded)
        }
        Err(reason) => Err(Error::scene(name, one_line(&reason))),
    }
}

/// What is read of a file, what is said of its surroundings, and what the file holds of them.
type Read = (Loaded, Surroundings, Option<Shining>);

fn read(bytes: &[u8], folder: &Path, name: &str, choice: &Choice) -> Result<Read, Reason> {
    let (json, chunk) = container::split(bytes)?;
    let Document { root, mut stances, animations } = document::parse(json)?;
    let buffers = container::load_buffers(&root, chunk, folder)?;
    let mut accessors = Accessors::new(&root, &buffers);
    let mut notes = Notes::default();

    let stage = stage::choose(&root, choice.scene.as_deref(), &mut notes)?;
    let mut scene = SceneBuilder::new(name);
    let extras = Extras::new(stage.extras, stage.label.clone(), Place::Scene, &mut notes);
    scene.illumination = extras.illumination()?;
    let of_file = extras.surroundings()?;
    let memory = crate::machine::memory().map(|left| left.bytes);
    count::check_packed(&accessors, memory)?;
    let weights = match &choice.pose {
        Some(pose) => animation::strike(&accessors, &animations, pose, &mut stances, &mut notes)?,
        None => Weights::new(),
    };
    let animations = animation::names(&animations);
    let to_parent: Vec<DAffine3> = stances.into_iter().map(Stance::to_parent).collect();
    let placed = graph::place(&root, &to_parent, &stage.roots)?;
    unpack_within(&mut accessors, &placed, choice.max_triangles, memory)?;
    if choice.pose.is_none() && !animations.is_empty() {
        let known = listed(animations.iter().map(String::as_str));
        notes.line(format!(
            "is seen at rest; --pose [NAME:]SECONDS shows it as an animation has it then: {known}"
        ));
    }
    report(&root, &placed, &mut notes);
    let variants = variants::names(&root);
    let variant = variants::choose(&variants, choice.variant.as_deref(), &mut notes)?;

    let mut materials = Materials::new(&root, Images::new(&accessors, folder), &mut notes)?;
    let form = Form { weights, variant };
    scene.shapes = shapes(&accessors, &placed, &form, &mut materials, &mut notes)?;
    scene.materials = materials.finish()?;
    let of_meshes = scene.shapes.len();
    area::add(&root, &placed, &mut scene, &mut notes)?;
    let has_lamps = scene.shapes.len() > of_meshes;
    let wanted = choice.camera.as_deref();
    let mut assembly = scene.assemble(camera::eye(&root, &placed, wanted))?;
    assembly.lines().into_iter().for_each(|line| notes.line(line));
    assembly.inside_out.iter().for_each(|surface| notes.about(Assembly::INSIDE_OUT, surface));
    if assembly.mesh.triangles.is_empty() {
        return Err("has no triangles; add a mesh to the scene".into());
    }
    let mut profiles = ies::Profiles::new(&accessors, folder);
    light(&root, &placed, &mut assembly, &mut profiles, &mut notes)?;
    ies::add(&mut profiles, &placed, &mut assembly, &mut notes)?;
    scene.profiles = profiles.finish();
    let mut around = choice.around.clone().or(of_file);
    let held = match around.source {
        None => image_light::read(&accessors, &stage, folder)?,
        Some(_) => None,
    };
    let shines_around = around.shines() || held.is_some();
    let reflects = scene.materials.iter().any(|material| !material.lobes.is_empty());
    let alone = !has_lamps && !camera::is_placed(&placed);
    let glimmers = alone && is_lit(&assembly) && glows_by_pictures(&root, &assembly);
    let nothing_said = around.source.is_none() && held.is_none();
    let by_studio = nothing_said && reflects && (glimmers || !is_lit(&assembly));
    if by_studio {
        around.source = Some(Around::Source(Source::Studio));
        notes.line(if glimmers { LITTLE_LIGHT.to_owned() } else { no_light(&root) });
    } else if assembly.luminaires.is_empty() && !shines_around {
        let dark = "nothing emits light; name an environment, such as --environment studio".to_owned();
        if !choice.dark {
            return Err(with_losses(dark, notes));
        }
        notes.line(dark);
    } else if !is_lit(&assembly) && reflects && !shines_around {
        notes.line("nothing lights the scene: only what is unlit or emits visible light is seen".into());
    }
    let camera = camera::choose(&root, &placed, wanted, assembly.origin, &assembly.mesh, &mut notes)?;
    scene.notes = notes.finish();
    let files = files::named(&root, folder);
    let scene = Scene { lit_by_studio: by_studio, ..scene.finish(assembly, camera) };
    Ok((Loaded { scene, files, variants, animations }, around, held))
}

/// Refuses a scene that is too large, before anything of it is built, and unpacks what is packed as a whole.
fn unpack_within(
    accessors: &mut Accessors<'_>,
    placed: &[Placed<'_>],
    triangles: u64,
    memory: Option<u64>,
) -> Result<(), Reason> {
    count::check(accessors, placed, triangles, memory)?;
    let bytes = memory.map_or(UNPACKED, |there| there / 2);
    if accessors.unpack(placed, Most { triangles, bytes })? {
        // What is packed may be more than was announced.
        count::check(accessors, placed, triangles, memory)?;
    }
    Ok(())
}

/// Adds the lights to the triangles that shine; there is one or the other.
fn light(
    root: &Root,
    placed: &[Placed<'_>],
    assembly: &mut Assembly,
    profiles: &mut ies::Profiles<'_>,
    notes: &mut Notes,
) -> Result<(), Reason> {
    let (min, max) = assembly.mesh.bounds();
    let bounds = (assembly.origin, 0.5 * min.distance(max));
    assembly.luminaires.extend(lights::punctual(root, placed, bounds, profiles, notes)?);
    Ok(())
}

fn is_lit(assembly: &Assembly) -> bool {
    let lights = |luminaire: &Luminaire| luminaire.power(1.0).invisible != Vec3::ZERO;
    assembly.luminaires.iter().any(lights)
}

/// All that shines are emissive pictures at their plain strength: windows of a house, or the visor of a helmet.
fn glows_by_pictures(root: &Root, assembly: &Assembly) -> bool {
    if !assembly.luminaires.iter().all(|luminaire| matches!(luminaire, Luminaire::Triangle { .. })) {
        return false;
    }
    let shines = |material: &&gltf::json::Material| material.emissive_factor.0 != [0.0; 3];
    root.materials.iter().filter(shines).all(|material| {
        let more = material.extensions.as_ref().and_then(|more| more.emissive_strength.as_ref());
        material.emissive_texture.is_some() && more.is_none_or(|strength| strength.emissive_strength.0 <= 1.0)
    })
}

/// That little lights it, and what does besides.
const LITTLE_LIGHT: &str = "has no light but emissive textures, and no camera: the built-in studio lights it too; --environment none \
                            leaves it alone";

/// That nothing lights it, what does, and how to choose.
fn no_light(root: &Root) -> String {
    let mut reason =
        "has no light: the built-in studio lights it; --environment sky, a picture (.hdr, .exr) or a \
                      colour is another choice"
            .to_owned();
    if root.asset.generator.as_ref().is_some_and(|generator| generator.contains("Blender")) {
        reason += ". Blender never exports area lights and the World, and its other lamps, cameras and custom \
                   properties only where Include > Punctual Lights, Cameras and Custom Properties are ticked in its \
                   export dialog (docs/blender.md)";
    }
    reason
}

/// A reason, and what else was lost on the way.
fn with_losses(reason: Reason, notes: Notes) -> Reason {
    let others = notes.finish();
    if others.is_empty() { reason } else { format!("{reason}. Besides: {}", others.join("; ")) }
}

/// What meshes look like beside what they say themselves.
struct Form {
    /// Of morph targets, where an animation has a say.
    weights: Weights,
    /// Which variant of its material a primitive has.
    variant: Option<usize>,
}

/// One shape per primitive under each node, or per copy of it.
fn shapes(
    accessors: &Accessors<'_>,
    placed: &[Placed<'_>],
    form: &Form,
    materials: &mut Materials<'_>,
    notes: &mut Notes,
) -> Result<Vec<Shape>, Reason> {
    let skinned = placed.iter().any(|place| place.node.skin.is_some());
    let places = placed.iter().filter(|_| skinned).map(|place| (place.index, place.to_world)).collect();
    let mut read: HashMap<(usize, usize), Option<Geometry>> = HashMap::new();
    let mut shapes = Vec::new();
    for place in placed {
        let Some(index) = place.node.mesh.map(|mesh| mesh.value()) else { continue };
        let missing = || format!("{}: its mesh {index} does not exist; export it again", place.label());
        let mesh = accessors.root.meshes.get(index).ok_or_else(missing)?;
        let copies =
            if mesh.primitives.is_empty() { Vec::new() } else { instances::places(accessors, place)? };
        let at_rest = || morph::weights_at_rest(place.node, mesh);
        let weights = form.weights.get(&place.index).cloned().unwrap_or_else(at_rest);
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let mesh_label = label("mesh", index, mesh.name.as_deref());
            let material = variants::material(primitive, form.variant)
                .or_else(|| primitive.material.map(|material| material.value()));
            let needs = materials.needs(material, notes)?;
            let geometry = match read.entry((index, number)) {
                std::collections::hash_map::Entry::Occupied(known) => known.into_mut(),
                std::collections::hash_map::Entry::Vacant(new) => {
                    let geometry = geometry::read(accessors, primitive, &needs);
                    new.insert(geometry.map_err(|what| format!("{mesh_label}: {what}"))?)
                }
            };
            let Some(geometry) = geometry else {
                notes.about("points, lines and empty meshes are no surfaces and were left out", &mesh_label);
                continue;
            };
            let name = place.name();
            let named = |what: Reason| format!("{mesh_label}: {what}");
            let morphed = morph::morph(accessors, primitive, geometry, &weights).map_err(named)?;
            let geometry = morphed.as_ref().unwrap_or(geometry);
            if needs.colours && geometry.colours.is_none() && has_colours(primitive) {
                notes.about("vertex colours that are no shares of light are left out", &name);
            }
            if needs.uvs.iter().zip(&geometry.uvs).any(|(asked, uvs)| *asked && uvs.is_none()) {
                notes.about(
                    "there are no texture coordinates for its textures, whose corner covers it",
                    &name,
                );
            }
            let colours = geometry.colours();
            let wanted = Wanted { material, closure: geometry.closure, colours, surface: &name };
            let material = materials.index(wanted, notes)?;
            for to_world in &copies {
                let posed = pose(accessors, primitive, geometry, (place, *to_world), &places, notes);
                shapes.push(shape(geometry, posed.map_err(named)?, name.clone(), material));
            }
        }
    }
    Ok(shapes)
}

/// A primitive where its joints or its node put it.
fn pose(
    accessors: &Accessors<'_>,
    primitive: &Primitive,
    geometry: &Geometry,
    (place, to_world): (&Placed<'_>, DAffine3),
    places: &HashMap<usize, DAffine3>,
    notes: &mut Notes,
) -> Result<Posed, Reason> {
    if let Some(skin) = place.node.skin {
        match skin::pose(accessors, primitive, geometry, skin.value(), places)? {
            Some(posed) => return Ok(posed),
            None => {
                notes.about("the joints of its skin are not to be found, it is seen unposed", &place.name());
            }
        }
    }
    let linear = to_world.matrix3;
    let normals = geometry.normals.as_ref();
    Ok(Posed {
        positions: geometry.positions.iter().map(|p: &DVec3| to_world.transform_point3(*p)).collect(),
        normals: normals.map(|normals| normals.iter().map(|n| skin::turn_normal(linear, *n)).collect()),
        tangents: geometry
            .tangents
            .as_ref()
            .map(|tangents| tangents.iter().map(|t| skin::turn_tangent(linear, *t)).collect()),
        mirrored: linear.determinant() < 0.0,
    })
}

fn shape(geometry: &Geometry, posed: Posed, name: String, material: u32) -> Shape {
    let triangles = geometry.triangles.iter();
    let triangles = triangles.map(|&[a, b, c]| if posed.mirrored { [a, c, b] } else { [a, b, c] });
    Shape {
        normals: posed.normals,
        closed: Some(geometry.closure.closed),
        uvs: geometry.uvs.clone(),
        colours: geometry.colours.clone(),
        tangents: posed.tangents,
        ..Shape::new(name, material, posed.positions, triangles.collect::<Vec<_>>())
    }
}

fn has_colours(primitive: &Primitive) -> bool {
    primitive.attributes.contains_key(&Checked::Valid(Semantic::Colors(0)))
}

/// Tells what is in the file and changes the picture, but is not read.
fn report(root: &Root, placed: &[Placed<'_>], notes: &mut Notes) {
    let mut told = HashSet::new();
    for place in placed {
        let node = place.node;
        let is_lamp = node.extensions.as_ref().is_some_and(|e| e.khr_lights_punctual.is_some());
        if !is_lamp && ies::of_node(node).is_none() {
            let at = if area::is_empty(node) { Place::Empty } else { Place::Elsewhere };
            Extras::new(&node.extras, place.label(), at, notes);
        }
        let others = node.extensions.iter().flat_map(|e| &e.others);
        for (name, _) in others.filter(|(name, _)| standing(name) != Some(Standing::Fine)) {
            told.insert(name.as_str());
            notes.about(&format!("{name} is not supported"), &place.name());
        }
        let Some(mesh) = node.mesh.and_then(|mesh| root.meshes.get(mesh.value())) else { continue };
        Extras::new(&mesh.extras, format!("mesh of {}", place.label()), Place::Elsewhere, notes);
    }
    let all: BTreeSet<&String> = root.extensions_used.iter().chain(&root.extensions_required).collect();
    for name in all.into_iter().filter(|name| standing(name).is_none() && !told.contains(name.as_str())) {
        notes.about("glTF extensions that are not supported and passed over", name);
    }
}
