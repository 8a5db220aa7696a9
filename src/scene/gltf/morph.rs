//! Morph targets: what a mesh is when some of its targets have weight.

use super::Reason;
use super::accessor::Accessors;
use super::geometry::Geometry;
use crate::scene::assembly::Closure;
use glam::{DVec3, Vec3};
use gltf::json::Index;
use gltf::json::mesh::{Mesh, MorphTarget, Primitive};
use gltf::json::scene::Node;

/// How many targets the primitives of a mesh have.
pub(super) fn targets(mesh: &Mesh) -> usize {
    mesh.primitives.iter().map(|primitive| primitive.targets.as_ref().map_or(0, Vec::len)).max().unwrap_or(0)
}

/// The weights of a mesh under a node at rest.
pub(super) fn weights_at_rest(node: &Node, mesh: &Mesh) -> Vec<f64> {
    let weights = node.weights.as_ref().or(mesh.weights.as_ref());
    weights.into_iter().flatten().map(|weight| f64::from(*weight)).collect()
}

/// A primitive with its targets added by their weights. None: no target has any.
pub(super) fn morph(
    accessors: &Accessors<'_>,
    primitive: &Primitive,
    geometry: &Geometry,
    weights: &[f64],
) -> Result<Option<Geometry>, Reason> {
    let targets = primitive.targets.iter().flatten().zip(weights);
    let moved: Vec<_> = targets.filter(|(_, weight)| **weight != 0.0).collect();
    if moved.is_empty() {
        return Ok(None);
    }
    let mut positions = geometry.positions.clone();
    let mut normals: Option<Vec<DVec3>> =
        geometry.normals.as_ref().map(|normals| normals.iter().map(|n| n.as_dvec3()).collect());
    for (MorphTarget { positions: to, normals: turned, .. }, weight) in moved {
        add(accessors, *to, *weight, &geometry.copies, &mut positions)?;
        if let Some(normals) = &mut normals {
            add(accessors, *turned, *weight, &geometry.copies, normals)?;
        }
    }
    let all = positions.iter().chain(normals.iter().flatten());
    if !all.into_iter().all(|v| v.is_finite()) {
        return Err(
            "has a morph target that moves a vertex to where is no finite number; repair the mesh".into()
        );
    }
    let closure = Closure::of(&positions, &geometry.triangles);
    let normals: Option<Vec<Vec3>> = normals.map(|normals| normals.iter().map(|n| n.as_vec3()).collect());
    Ok(Some(Geometry { positions, normals, closure, ..geometry.clone() }))
}

/// Adds what a target has for an attribute.
fn add<T>(
    accessors: &Accessors<'_>,
    target: Option<Index<T>>,
    weight: f64,
    copies: &[u32],
    to: &mut [DVec3],
) -> Result<(), Reason> {
    let Some(index) = target.map(|index| index.value()) else { return Ok(()) };
    let count = accessors.count(index);
    let own = to.len() - copies.len();
    if count != own as u64 {
        return Err(format!("has {own} vertices and a morph target of {count}; export it again"));
    }
    let moved = accessors.vec3(index)?;
    let all = (0..own).chain(copies.iter().map(|copy| *copy as usize));
    for (to, vertex) in to.iter_mut().zip(all) {
        *to += weight * DVec3::from_array(moved[vertex]);
    }
    Ok(())
}
