//! Skins: where the vertices of a mesh are when its joints are where the file puts them.

use super::Reason;
use super::accessor::Accessors;
use super::geometry::Geometry;
use super::notes::label;
use glam::{DAffine3, DMat3, DMat4, DVec3, Vec3, Vec4, Vec4Swizzles};
use gltf::Semantic;
use gltf::json::Index;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::Primitive;
use gltf::json::validation::Checked;
use std::collections::HashMap;

/// A primitive in the world.
pub(super) struct Posed {
    pub positions: Vec<DVec3>,
    /// Any length.
    pub normals: Option<Vec<Vec3>>,
    /// Any length; w as in glTF, or zero.
    pub tangents: Option<Vec<Vec4>>,
    /// True where its joints turn it inside out.
    pub mirrored: bool,
}

/// Poses `geometry` by the joints of a skin, which stand at `places` (by node). glTF 2.0, §3.7.3.3: the transform of
/// the node that the mesh hangs on has no part in it. None: a joint is not in the scene, or the vertices name none.
pub(super) fn pose(
    accessors: &Accessors<'_>,
    primitive: &Primitive,
    geometry: &Geometry,
    skin: usize,
    places: &HashMap<usize, DAffine3>,
) -> Result<Option<Posed>, Reason> {
    let Some(matrices) = joint_matrices(accessors, skin, places)? else { return Ok(None) };
    let influences = influences(accessors, primitive, geometry.in_file())?;
    if influences.is_empty() {
        return Ok(None);
    }
    let mut posed = Posed {
        positions: Vec::with_capacity(geometry.positions.len()),
        normals: geometry.normals.as_ref().map(|normals| Vec::with_capacity(normals.len())),
        tangents: geometry.tangents.as_ref().map(|tangents| Vec::with_capacity(tangents.len())),
        mirrored: false,
    };
    let mut turned = 0_usize;
    for (vertex, position) in geometry.positions.iter().enumerate() {
        let all = influences.iter().map(|set| set[geometry.source(vertex)]);
        let matrix = blend(&matrices, all).map_err(|joint| {
            format!(
                "vertex {vertex} hangs on joint {joint}, which its skin {skin} does not have; export it again"
            )
        })?;
        posed.positions.push(matrix.transform_point3(*position));
        turned += usize::from(matrix.matrix3.determinant() < 0.0);
        if let (Some(to), Some(from)) = (&mut posed.normals, &geometry.normals) {
            to.push(turn_normal(matrix.matrix3, from[vertex]));
        }
        if let (Some(to), Some(from)) = (&mut posed.tangents, &geometry.tangents) {
            to.push(turn_tangent(matrix.matrix3, from[vertex]));
        }
    }
    posed.mirrored = 2 * turned > geometry.positions.len();
    Ok(Some(posed))
}

/// From the space of the mesh to the world, for each joint.
fn joint_matrices(
    accessors: &Accessors<'_>,
    skin: usize,
    places: &HashMap<usize, DAffine3>,
) -> Result<Option<Vec<DAffine3>>, Reason> {
    let source = accessors.root.skins.get(skin);
    let source = source.ok_or_else(|| format!("its skin {skin} does not exist; export it again"))?;
    let places = source.joints.iter().map(|joint| places.get(&joint.value()).copied());
    let Some(places) = places.collect::<Option<Vec<_>>>() else { return Ok(None) };
    let Some(index) = source.inverse_bind_matrices else { return Ok(Some(places)) };
    let back: Vec<[f64; 16]> = accessors.numbers(index.value(), Type::Mat4, &[])?;
    let name = label("skin", skin, source.name.as_deref());
    if back.len() < places.len() || back.iter().flatten().any(|x| !x.is_finite()) {
        return Err(format!(
            "{name} has {} joints and {} inverse bind matrices, all of which must be finite; export it again",
            places.len(),
            back.len()
        ));
    }
    let matrices = places.iter().zip(&back).map(|(place, back)| {
        let back = DMat4::from_cols_array(back);
        *place * DAffine3::from_mat4(back)
    });
    Ok(Some(matrices.collect()))
}

/// Up to four joints of each vertex and how much they have to say.
type Influences = Vec<([u32; 4], [f64; 4])>;

/// The sets of influences of a primitive: four joints a vertex each.
fn influences(
    accessors: &Accessors<'_>,
    primitive: &Primitive,
    vertices: usize,
) -> Result<Vec<Influences>, Reason> {
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(Index::value);
    let mut sets = Vec::new();
    for set in 0.. {
        let (Some(joints), Some(weights)) =
            (attribute(Semantic::Joints(set)), attribute(Semantic::Weights(set)))
        else {
            break;
        };
        let shares = [ComponentType::U8, ComponentType::U16];
        let (joints, weights) = (accessors.joints(joints)?, accessors.numbers(weights, Type::Vec4, &shares)?);
        if joints.len() != vertices || weights.len() != vertices {
            return Err(format!(
                "has {vertices} positions, {} sets of joints and {} of weights; export it again",
                joints.len(),
                weights.len()
            ));
        }
        if weights.iter().flatten().any(|weight: &f64| !weight.is_finite() || *weight < 0.0) {
            return Err("has a joint weight that is negative or not finite; repair the mesh".into());
        }
        sets.push(joints.into_iter().zip(weights).collect());
    }
    Ok(sets)
}

/// The mean of the joints' matrices by weight; of a vertex without weights that of its first joint. Err: a joint that
/// does not exist.
fn blend(
    matrices: &[DAffine3],
    influences: impl Iterator<Item = ([u32; 4], [f64; 4])> + Clone,
) -> Result<DAffine3, u32> {
    let sum: f64 = influences.clone().flat_map(|(_, weights)| weights).sum();
    let get = |joint: u32| matrices.get(joint as usize).copied().ok_or(joint);
    if sum == 0.0 {
        return get(influences.clone().next().map_or(0, |(joints, _)| joints[0]));
    }
    let mut blended = DAffine3::from_mat3_translation(DMat3::ZERO, DVec3::ZERO);
    for (joints, weights) in influences {
        for (joint, weight) in joints.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0) {
            let matrix = get(joint)?;
            blended.matrix3 += (weight / sum) * matrix.matrix3;
            blended.translation += (weight / sum) * matrix.translation;
        }
    }
    Ok(blended)
}

/// A normal after a linear map of its surface, on the side that it was: det · M⁻ᵀ, which exists where the inverse does
/// not, with the determinant's sign given back.
pub(super) fn turn_normal(linear: DMat3, normal: Vec3) -> Vec3 {
    let sign = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
    let n = sign * normal.as_dvec3();
    (n.x * y.cross(z) + n.y * z.cross(x) + n.z * x.cross(y)).normalize_or_zero().as_vec3()
}

/// A tangent after a linear map of its surface: what was right of normal × tangent is so in a mirror image the other way round.
pub(super) fn turn_tangent(linear: DMat3, tangent: Vec4) -> Vec4 {
    let sign = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
    let turned = (linear * tangent.xyz().as_dvec3()).normalize_or_zero().as_vec3();
    turned.extend(sign * tangent.w)
}
