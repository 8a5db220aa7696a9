//! EXT_mesh_gpu_instancing: one node, many copies of its mesh.

use super::Reason;
use super::accessor::{Accessors, SMALL};
use super::graph::Placed;
use glam::{DAffine3, DQuat, DVec3};
use gltf::json::Value;
use gltf::json::accessor::Type;
use gltf::json::scene::Node;

const NAME: &str = "EXT_mesh_gpu_instancing";

/// The accessor of one of the attributes that place copies.
fn attribute(node: &Node, name: &str) -> Option<usize> {
    let attributes = &node.extensions.as_ref()?.others.get(NAME)?["attributes"];
    attributes.get(name).and_then(Value::as_u64).and_then(|index| usize::try_from(index).ok())
}

/// What places copies, as far as a node has it.
fn accessors_of(node: &Node) -> [Option<usize>; 3] {
    ["TRANSLATION", "ROTATION", "SCALE"].map(|name| attribute(node, name))
}

/// How many copies of its mesh a node shows: one, unless it says otherwise.
pub(super) fn count(accessors: &Accessors<'_>, node: &Node) -> u64 {
    let counts = accessors_of(node).into_iter().flatten();
    counts.map(|index| accessors.possible_count(index).unwrap_or(0)).max().unwrap_or(1)
}

/// From the space of the mesh to the world, for each copy.
pub(super) fn places(accessors: &Accessors<'_>, place: &Placed<'_>) -> Result<Vec<DAffine3>, Reason> {
    let of_node = accessors_of(place.node);
    let mut counts = of_node.into_iter().flatten().map(|index| accessors.count(index));
    // Where a mesh has a skin, its joints say where it stands.
    let Some(count) = counts.next().filter(|_| place.node.skin.is_none()) else {
        return Ok(vec![place.to_world]);
    };
    let wrong = |what: String| format!("{}: its {NAME} {what}", place.label());
    if let Some(other) = counts.find(|other| *other != count) {
        return Err(wrong(format!("places {count} copies and {other}; export it again")));
    }
    let [translation, rotation, scale] = of_node;
    let three = |index: Option<usize>| -> Result<Option<Vec<[f64; 3]>>, Reason> {
        index.map(|index| accessors.numbers(index, Type::Vec3, &[])).transpose().map_err(wrong)
    };
    let (translations, scales) = (three(translation)?, three(scale)?);
    let turns: Option<Vec<[f64; 4]>> =
        rotation.map(|index| accessors.numbers(index, Type::Vec4, &SMALL)).transpose().map_err(wrong)?;
    let copy = |i: usize| {
        let vector = |all: &Option<Vec<[f64; 3]>>| all.as_ref().map(|all| DVec3::from_array(all[i]));
        let turn = turns.as_ref().map(|all| DQuat::from_array(all[i]).normalize());
        let to_node = DAffine3::from_scale_rotation_translation(
            vector(&scales).unwrap_or(DVec3::ONE),
            turn.unwrap_or(DQuat::IDENTITY),
            vector(&translations).unwrap_or(DVec3::ZERO),
        );
        let to_world = place.to_world * to_node;
        to_world.is_finite().then_some(to_world).ok_or_else(|| {
            wrong(format!("places copy {i} by numbers that are not finite or turn nowhere; export it again"))
        })
    };
    (0..count as usize).map(copy).collect()
}
