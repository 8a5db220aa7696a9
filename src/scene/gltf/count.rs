//! How large a scene would be, from its JSON alone: a file of kilobytes can ask for any number of triangles.

use super::Reason;
use super::accessor::MOST_ZEROS;
use super::graph::Placed;
use gltf::Semantic;
use gltf::json::Root;
use gltf::json::mesh::{Mode, Primitive};
use gltf::json::validation::Checked;

/// Bytes of a triangle with its vertices while a scene is built: each vertex (36) twice and once in single precision (24),
/// each triangle (12) twice and once with its surface (16), and the tree of boxes. What textures ask of a vertex (two sets of
/// coordinates, colour and tangent: 48) thrice.
const TRIANGLE_BYTES: u64 = 200;
const VERTEX_BYTES: u64 = 100;
const DRESSED_BYTES: u64 = 144;

#[derive(Clone, Copy, Default)]
struct Count {
    triangles: u64,
    vertices: u64,
    /// Those that have something for textures.
    dressed: u64,
}

impl Count {
    fn plus(self, other: Self) -> Self {
        Self {
            triangles: self.triangles.saturating_add(other.triangles),
            vertices: self.vertices.saturating_add(other.vertices),
            dressed: self.dressed.saturating_add(other.dressed),
        }
    }
}

/// Refuses a scene of more than `most` triangles, every instance counted, or one that takes more than `memory` bytes (None:
/// nobody knows how much there is), before any of it is built.
pub(super) fn check(
    root: &Root,
    placed: &[Placed<'_>],
    most: u64,
    memory: Option<u64>,
) -> Result<(), Reason> {
    let meshes: Vec<Count> = root
        .meshes
        .iter()
        .map(|mesh| mesh.primitives.iter().map(|p| of_primitive(root, p)).fold(Count::default(), Count::plus))
        .collect();
    let instances = placed.iter().filter_map(|place| place.node.mesh);
    let counts = instances.filter_map(|mesh| meshes.get(mesh.value()).copied());
    let Count { triangles, vertices, dressed } = counts.fold(Count::default(), Count::plus);
    if triangles > most || vertices > most.saturating_mul(3) {
        return Err(format!(
            "announces {triangles} triangles and {vertices} vertices, every instance counted, which is more than --max-triangles \
             {most} allows (three vertices each); leave some out or raise it"
        ));
    }
    let bytes =
        triangles.saturating_mul(TRIANGLE_BYTES).saturating_add(vertices.saturating_mul(VERTEX_BYTES));
    let bytes = bytes.saturating_add(dressed.saturating_mul(DRESSED_BYTES));
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

/// What is wrong with it is told when it is read. An instance takes memory whatever is in it, so it counts as one triangle
/// at least.
fn of_primitive(root: &Root, primitive: &Primitive) -> Count {
    let count = |accessor: usize| elements(root, accessor).unwrap_or(0);
    let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
    let vertices = positions.map_or(0, |index| count(index.value()));
    let corners = primitive.indices.map_or(vertices, |index| count(index.value()));
    let triangles = match primitive.mode {
        Checked::Valid(Mode::Triangles) => corners / 3,
        Checked::Valid(Mode::TriangleStrip | Mode::TriangleFan) => corners.saturating_sub(2),
        _ => return Count { triangles: 1, ..Count::default() },
    };
    let dresses = |semantic| primitive.attributes.contains_key(&Checked::Valid(semantic));
    let dressed = if dresses(Semantic::TexCoords(0)) || dresses(Semantic::Colors(0)) { vertices } else { 0 };
    Count { triangles: triangles.max(1), vertices, dressed }
}

/// How many elements an accessor has. None where that cannot be: reading it says why, and takes no memory.
fn elements(root: &Root, accessor: usize) -> Option<u64> {
    let accessor = root.accessors.get(accessor)?;
    let most = match accessor.buffer_view {
        Some(view) => root.buffer_views.get(view.value())?.byte_length.0,
        None => MOST_ZEROS,
    };
    Some(accessor.count.0).filter(|count| *count <= most)
}
