use super::Reason;
use super::accessor::Accessors;
use crate::scene::assembly::Closure;
use glam::{DVec3, Vec3};
use gltf::Semantic;
use gltf::json::Index;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive};
use gltf::json::validation::Checked;

/// The triangles of one primitive in the space of its mesh.
#[derive(Clone)]
pub(super) struct Geometry {
    pub positions: Vec<DVec3>,
    pub normals: Option<Vec<Vec3>>,
    pub triangles: Vec<[u32; 3]>,
    pub closure: Closure,
    /// The mean of its vertex colours, linear. None: it has none, or they are no shares of light.
    pub tint: Option<Vec3>,
}

/// Reads a primitive. None: it has nothing that is a surface.
pub(super) fn read(accessors: &Accessors<'_>, primitive: &Primitive) -> Result<Option<Geometry>, Reason> {
    let Checked::Valid(mode) = primitive.mode else {
        return Err("has an unknown drawing mode; export it again".into());
    };
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(Index::value);
    let triangles = match mode {
        Mode::Triangles => list,
        Mode::TriangleStrip => strip,
        Mode::TriangleFan => fan,
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => return Ok(None),
    };
    let Some(position) = attribute(Semantic::Positions) else { return Ok(None) };

    let positions = accessors.vec3(position)?;
    if let Some(vertex) = positions.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        return Err(format!("has a position that is not a finite number (vertex {vertex}); repair the mesh"));
    }
    let count =
        u32::try_from(positions.len()).map_err(|_| "has more vertices than can be counted; split it")?;
    let normals = match attribute(Semantic::Normals) {
        // Counted before they are read: only positions are counted when a scene is found to fit.
        Some(index) if accessors.count(index) > u64::from(count) => {
            let normals = accessors.count(index);
            return Err(format!("has {count} positions and {normals} normals; export it again"));
        }
        Some(index) => Some(accessors.vec3(index)?),
        None => None,
    };
    if let Some(normals) = &normals {
        if normals.len() != positions.len() {
            return Err(format!("has {count} positions and {} normals; export it again", normals.len()));
        }
        if let Some(vertex) = normals.iter().position(|n| n.iter().any(|x| !x.is_finite())) {
            return Err(format!(
                "has a normal that is not a finite number (vertex {vertex}); repair the mesh"
            ));
        }
    }
    let indices = match primitive.indices {
        Some(index) => accessors.indices(index.value())?,
        None => (0..count).collect(),
    };
    if let Some(index) = indices.iter().find(|index| **index >= count) {
        return Err(format!("refers to vertex {index} of {count}; repair the mesh"));
    }
    let triangles = triangles(&indices)?;
    let positions: Vec<_> = positions.into_iter().map(DVec3::from_array).collect();
    let closure = Closure::of(&positions, &triangles);
    let normals =
        normals.map(|normals| normals.into_iter().map(|n| DVec3::from_array(n).as_vec3()).collect());
    let tint = attribute(Semantic::Colors(0)).and_then(|index| mean_colour(accessors, index));
    Ok(Some(Geometry { positions, normals, triangles, closure, tint }))
}

fn mean_colour(accessors: &Accessors<'_>, index: usize) -> Option<Vec3> {
    let shares = [ComponentType::U8, ComponentType::U16];
    let rgb = |[r, g, b, _]: [f64; 4]| DVec3::new(r, g, b);
    let with_alpha = accessors.numbers(index, Type::Vec4, &shares);
    let without = || accessors.numbers(index, Type::Vec3, &shares);
    let colours: Vec<DVec3> = match with_alpha {
        Ok(colours) => colours.into_iter().map(rgb).collect(),
        Err(_) => without().ok()?.into_iter().map(DVec3::from_array).collect(),
    };
    let mean = colours.iter().sum::<DVec3>() / colours.len() as f64;
    (mean.min_element() >= 0.0 && mean.max_element() <= 1.0).then(|| mean.as_vec3())
}

fn list(indices: &[u32]) -> Result<Vec<[u32; 3]>, Reason> {
    let (triangles, rest) = indices.as_chunks::<3>();
    if rest.is_empty() {
        Ok(triangles.to_vec())
    } else {
        Err(format!("has {} corners, which is no multiple of three; repair the mesh", indices.len()))
    }
}

// The orders of glTF 2.0, §3.7.2.1: every second triangle of a strip is turned round to keep its front.
fn strip(indices: &[u32]) -> Result<Vec<[u32; 3]>, Reason> {
    let turned = |(i, w): (usize, &[u32])| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] };
    Ok(indices.windows(3).enumerate().map(turned).collect())
}

fn fan(indices: &[u32]) -> Result<Vec<[u32; 3]>, Reason> {
    let Some((hub, rim)) = indices.split_first() else { return Ok(Vec::new()) };
    Ok(rim.windows(2).map(|w| [w[0], w[1], *hub]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_the_front() {
        assert_eq!(strip(&[0, 1, 2, 3]).unwrap(), [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(fan(&[0, 1, 2, 3]).unwrap(), [[1, 2, 0], [2, 3, 0]]);
        assert!(list(&[0, 1, 2, 3]).is_err());
    }
}
