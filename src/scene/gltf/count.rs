//! How large a scene would be, from its JSON alone: a file of kilobytes can ask for any number of triangles.

use super::Reason;
use super::accessor::Accessors;
use super::area;
use super::graph::Placed;
use super::instances;
use gltf::Semantic;
use gltf::json::mesh::{Mesh, Mode, Primitive};
use gltf::json::validation::Checked;

/// Bytes of a triangle with its vertices while a scene is built: each vertex (36) twice and once in single precision (24),
/// each triangle (12) twice and once with its surface (16), and the tree of boxes. What textures ask of a vertex (two sets of
/// coordinates, colour and tangent: 48) thrice.
const TRIANGLE_BYTES: u64 = 200;
const VERTEX_BYTES: u64 = 100;
const DRESSED_BYTES: u64 = 144;

/// Bytes of packed buffer views once they are unpacked: some seconds of work, whatever memory there is.
const MOST_UNPACKED: u64 = 1 << 34;

/// Vertices that morph targets move, for each triangle that a scene may have: some seconds of work.
const MOVED_PER_TRIANGLE: u64 = 24;

#[derive(Clone, Copy, Default)]
struct Count {
    triangles: u64,
    vertices: u64,
    /// Vertices times the targets that they may be moved by.
    moved: u64,
    /// Those that have something for textures.
    dressed: u64,
}

impl Count {
    fn plus(self, other: Self) -> Self {
        Self {
            triangles: self.triangles.saturating_add(other.triangles),
            vertices: self.vertices.saturating_add(other.vertices),
            moved: self.moved.saturating_add(other.moved),
            dressed: self.dressed.saturating_add(other.dressed),
        }
    }

    /// Copies of a mesh that is moved once. Each takes memory, whatever is in it.
    fn times(self, copies: u64) -> Self {
        Self {
            triangles: self.triangles.saturating_mul(copies),
            vertices: self.vertices.saturating_mul(copies),
            moved: self.moved,
            dressed: self.dressed.saturating_mul(copies),
        }
    }
}

/// Refuses a scene of more than `most` triangles, every instance counted, or one that takes more than `memory` bytes (None:
/// nobody knows how much there is), before any of it is built.
pub(super) fn check(
    accessors: &Accessors<'_>,
    placed: &[Placed<'_>],
    most: u64,
    memory: Option<u64>,
) -> Result<(), Reason> {
    let of_mesh = |mesh: &Mesh| {
        mesh.primitives.iter().map(|p| of_primitive(accessors, p)).fold(Count::default(), Count::plus)
    };
    let meshes: Vec<Count> = accessors.root.meshes.iter().map(of_mesh).collect();
    let of_place = |place: &Placed<'_>| {
        let count = meshes.get(place.node.mesh?.value())?;
        Some(count.times(instances::count(accessors, place.node)))
    };
    let of_lamp = |place: &Placed<'_>| {
        let [triangles, vertices] = area::size(accessors.root, place);
        Count { triangles, vertices, ..Count::default() }
    };
    let lamps = placed.iter().map(of_lamp);
    let Count { triangles, vertices, moved, dressed } =
        placed.iter().filter_map(of_place).chain(lamps).fold(Count::default(), Count::plus);
    if moved > most.saturating_mul(MOVED_PER_TRIANGLE) {
        return Err(format!(
            "its morph targets move {moved} vertices, which is more than --max-triangles {most} allows ({MOVED_PER_TRIANGLE} \
             for each triangle); leave some out or raise it"
        ));
    }
    if triangles > most || vertices > most.saturating_mul(3) {
        return Err(format!(
            "announces {triangles} triangles and {vertices} vertices, every instance counted, which is more than --max-triangles \
             {most} allows (three vertices each); leave some out or raise it"
        ));
    }
    let bytes = triangles
        .saturating_mul(TRIANGLE_BYTES)
        .saturating_add(vertices.saturating_mul(VERTEX_BYTES))
        .saturating_add(dressed.saturating_mul(DRESSED_BYTES))
        .saturating_add(accessors.unpacked_bytes());
    match memory {
        Some(there) if bytes > there => Err(format!(
            "announces {triangles} triangles and {vertices} vertices, every instance counted, which take about {} MB where {} MB of \
             memory are free; leave some out",
            bytes >> 20,
            there >> 20
        )),
        _ => Ok(()),
    }
}

/// Refuses a file whose packed buffer views are too much to unpack, before any is.
pub(super) fn check_packed(accessors: &Accessors<'_>, memory: Option<u64>) -> Result<(), Reason> {
    let unpacked = accessors.unpacked_bytes();
    if unpacked <= MOST_UNPACKED && memory.is_none_or(|there| unpacked <= there) {
        return Ok(());
    }
    Err(format!(
        "announces {} MB of packed buffer views, which is more than can be unpacked; leave some out",
        unpacked >> 20
    ))
}

/// What is wrong with it is told when it is read. An instance takes memory whatever is in it, so it counts as one triangle
/// at least.
fn of_primitive(accessors: &Accessors<'_>, primitive: &Primitive) -> Count {
    let count = |accessor: usize| accessors.possible_count(accessor).unwrap_or(0);
    let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
    let vertices = positions.map_or(0, |index| count(index.value()));
    let corners = primitive.indices.map_or(vertices, |index| count(index.value()));
    let is_unpacked = primitive.indices.is_some_and(|index| accessors.is_unpacked(index.value()));
    let triangles = match primitive.mode {
        Checked::Valid(Mode::Triangles) => corners / 3,
        // Faces are packed one by one.
        Checked::Valid(Mode::TriangleStrip) if is_unpacked => corners / 3,
        Checked::Valid(Mode::TriangleStrip | Mode::TriangleFan) => corners.saturating_sub(2),
        _ => return Count { triangles: 1, ..Count::default() },
    };
    let targets = primitive.targets.as_ref().map_or(0, |targets| targets.len() as u64);
    let dresses = |semantic| primitive.attributes.contains_key(&Checked::Valid(semantic));
    let dressed = if dresses(Semantic::TexCoords(0)) || dresses(Semantic::Colors(0)) { vertices } else { 0 };
    Count { triangles: triangles.max(1), vertices, moved: vertices.saturating_mul(targets), dressed }
}
