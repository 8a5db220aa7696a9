//! KHR_draco_mesh_compression: primitives whose accessors are packed together in one buffer view.

use super::super::Reason;
use super::super::accessor::{Accessors, Elements};
use super::super::graph::Placed;
use super::super::notes::label;
use gltf::Semantic;
use gltf::json::Value;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive};
use gltf::json::validation::Checked;
use std::collections::{HashMap, HashSet};

/// Its name in files.
pub(in super::super) const NAME: &str = "KHR_draco_mesh_compression";

/// The bound on all that is unpacked of a file.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "draco"), expect(dead_code))]
pub(in super::super) struct Most {
    pub triangles: u64,
    pub bytes: u64,
}

/// What the packed primitives of placed meshes unpack to, by accessor.
pub(in super::super) fn unpack(
    accessors: &Accessors<'_>,
    placed: &[Placed<'_>],
    mut most: Most,
) -> Result<HashMap<usize, Elements>, Reason> {
    let mut unpacked = HashMap::new();
    let mut seen = HashSet::new();
    let meshes = placed.iter().filter_map(|place| Some(place.node.mesh?.value()));
    for index in meshes.filter(|index| seen.insert(*index)) {
        let Some(mesh) = accessors.root.meshes.get(index) else { continue };
        for primitive in mesh.primitives.iter().filter(|primitive| has_faces(primitive)) {
            let Some(packing) = packing(accessors, primitive) else { continue };
            let named = |what| format!("{}: {what}", label("mesh", index, mesh.name.as_deref()));
            let elements = of_primitive(accessors, primitive, packing, &mut most).map_err(named)?;
            for (accessor, elements) in elements {
                if unpacked.insert(accessor, elements).is_some() {
                    return Err(named(format!(
                        "accessor {accessor} is packed twice by {NAME}; export it again, perhaps without compression"
                    )));
                }
            }
        }
    }
    Ok(unpacked)
}

/// False for points and lines, which are left out whatever is in them.
fn has_faces(primitive: &Primitive) -> bool {
    let Checked::Valid(mode) = primitive.mode else { return true };
    matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)
}

/// How a primitive is packed. None where its plain numbers are in the file as well, for readers without the extension.
pub(in super::super) fn packing<'a>(
    accessors: &Accessors<'_>,
    primitive: &'a Primitive,
) -> Option<&'a Value> {
    let packing = primitive.extensions.as_ref()?.others.get(NAME)?;
    let position = primitive.attributes.get(&Checked::Valid(Semantic::Positions))?;
    let accessor = accessors.root.accessors.get(position.value())?;
    accessor.buffer_view.is_none().then_some(packing)
}

/// The elements of each accessor of a primitive that its packing holds. What is packed is faces, whether they are to be drawn as
/// single triangles or as strips; nothing else may be packed.
fn of_primitive(
    accessors: &Accessors<'_>,
    primitive: &Primitive,
    packing: &Value,
    most: &mut Most,
) -> Result<Vec<(usize, Elements)>, Reason> {
    if primitive.mode == Checked::Valid(Mode::TriangleFan) {
        return Err(format!(
            "is a triangle fan packed by {NAME}, which holds triangles and strips only; export it again as triangles"
        ));
    }
    let view = packing["bufferView"].as_u64().and_then(|view| usize::try_from(view).ok());
    let view = view.ok_or_else(|| format!("its {NAME} has no buffer view; export it again"))?;
    let bytes = accessors.view(view).map_err(|what| format!("its {NAME} {what}; export it again"))?;
    let mut wanted = Vec::new();
    for (semantic, accessor) in &primitive.attributes {
        let Checked::Valid(semantic) = semantic else { continue };
        if let Some(id) = packing["attributes"][semantic.to_string()].as_u64() {
            wanted.push((as_announced(accessors, accessor.value())?, id));
        }
    }
    let indices =
        primitive.indices.ok_or_else(|| format!("is packed by {NAME} without indices; export it again"))?;
    decode(bytes, as_announced(accessors, indices.value())?, &wanted, most)
}

/// An accessor, and what it says its elements are.
#[cfg_attr(not(feature = "draco"), expect(dead_code))]
struct Announced {
    index: usize,
    kind: Type,
    component: ComponentType,
}

fn as_announced(accessors: &Accessors<'_>, index: usize) -> Result<Announced, Reason> {
    match accessors.root.accessors.get(index) {
        Some(Accessor { type_: Checked::Valid(kind), component_type: Checked::Valid(component), .. }) => {
            Ok(Announced { index, kind: *kind, component: component.0 })
        }
        Some(_) => Err(format!("accessor {index} has an unknown type; export it again")),
        None => Err(format!("accessor {index} does not exist; export it again")),
    }
}

#[cfg(not(feature = "draco"))]
fn decode(
    _: &[u8],
    _: Announced,
    _: &[(Announced, u64)],
    _: &mut Most,
) -> Result<Vec<(usize, Elements)>, Reason> {
    Err(super::LEFT_OUT.into())
}

#[cfg(feature = "draco")]
use decoder::decode;

#[cfg(feature = "draco")]
mod decoder {
    use super::{Announced, ComponentType, Elements, Most, NAME, Reason, Type};
    use draco_core::{
        DataType, DecodeLimits, DecoderBuffer, FaceIndex, Mesh, MeshDecoder, PointAttribute, PointIndex,
    };
    use std::panic::{AssertUnwindSafe, catch_unwind};

    /// The indices and each of the wanted attributes, by its number in the packing.
    pub fn decode(
        bytes: &[u8],
        indices: Announced,
        wanted: &[(Announced, u64)],
        most: &mut Most,
    ) -> Result<Vec<(usize, Elements)>, Reason> {
        let damaged = |what: &str| {
            format!("its {NAME} is damaged ({what}); export it again, perhaps without compression")
        };
        // The crate refuses damage in words wherever it is known to. If it does not, that must not end a program which
        // reads files of strangers.
        let unpacked = catch_unwind(AssertUnwindSafe(|| {
            let mesh = mesh(bytes, *most).map_err(|error| damaged(&error.to_string()))?;
            elements(&mesh, indices, wanted).map_err(|what| damaged(&what))
        }));
        let unpacked = unpacked.map_err(|_| damaged("the decoder failed"))??;
        let size: u64 = unpacked.iter().map(|(_, elements)| elements.bytes.len() as u64).sum();
        most.bytes = most.bytes.saturating_sub(size);
        Ok(unpacked)
    }

    /// Bytes of a face or a point while they are unpacked: who is whose neighbour, and in which order they came.
    const UNPACKING: u64 = 100;

    fn mesh(bytes: &[u8], most: Most) -> Result<Mesh, draco_core::DracoError> {
        let limits = DecodeLimits::default()
            .with_max_faces(most.triangles.min(most.bytes / UNPACKING))
            .with_max_points(most.triangles.saturating_mul(3).min(most.bytes / UNPACKING))
            .with_max_decoded_bytes(most.bytes);
        let mut mesh = Mesh::new();
        MeshDecoder::new().decode(&mut DecoderBuffer::new(bytes).with_limits(limits), &mut mesh)?;
        Ok(mesh)
    }

    fn elements(
        mesh: &Mesh,
        indices: Announced,
        wanted: &[(Announced, u64)],
    ) -> Result<Vec<(usize, Elements)>, Reason> {
        let mut all = vec![corners(mesh, indices)?];
        for (announced, id) in wanted {
            let attribute = u32::try_from(*id).ok().and_then(|id| mesh.attribute_by_unique_id(id));
            let attribute = attribute.ok_or_else(|| format!("it has no attribute {id}"))?;
            all.push((announced.index, of_attribute(mesh.num_points(), attribute, announced)?));
        }
        Ok(all)
    }

    fn corners(mesh: &Mesh, indices: Announced) -> Result<(usize, Elements), Reason> {
        let size = match indices.component {
            ComponentType::U8 => 1,
            ComponentType::U16 => 2,
            _ => 4,
        };
        if mesh.num_points() as u64 > 1 << (8 * size) {
            return Err(format!("its {} vertices are too many for its indices", mesh.num_points()));
        }
        let mut bytes = Vec::with_capacity(3 * size * mesh.num_faces());
        for face in 0..mesh.num_faces() as u32 {
            for corner in mesh.face(FaceIndex(face)) {
                bytes.extend_from_slice(&corner.0.to_le_bytes()[..size]);
            }
        }
        let Announced { index, component, .. } = indices;
        let count = 3 * mesh.num_faces() as u64;
        Ok((index, Elements { kind: Type::Scalar, component, count, bytes }))
    }

    /// The values of an attribute for each of so many points, in the type that its accessor announces.
    fn of_attribute(
        points: usize,
        attribute: &PointAttribute,
        announced: &Announced,
    ) -> Result<Elements, Reason> {
        let Announced { index, kind, component } = *announced;
        let numbers = kind.multiplicity();
        if usize::from(attribute.num_components()) != numbers {
            return Err(format!(
                "accessor {index} has {numbers} numbers an element, its packing {}",
                attribute.num_components()
            ));
        }
        let from = attribute.data_type();
        let width = from.byte_length();
        let stride = usize::try_from(attribute.byte_stride()).unwrap_or(0);
        let mut bytes = Vec::with_capacity(points * numbers * component.size());
        for point in 0..points as u32 {
            let start = (attribute.mapped_index(PointIndex(point)).0 as usize).checked_mul(stride);
            let value =
                start.and_then(|start| attribute.buffer().data().get(start..)?.get(..width * numbers));
            let value =
                value.ok_or_else(|| format!("its attribute of accessor {index} ends at vertex {point}"))?;
            if is_same(from, component) {
                bytes.extend_from_slice(value);
            } else {
                for number in value.chunks_exact(width) {
                    let number = read(number, from)
                        .ok_or_else(|| format!("accessor {index} is packed as {from:?}"))?;
                    write(number, component, &mut bytes);
                }
            }
        }
        Ok(Elements { kind, component, count: points as u64, bytes })
    }

    fn is_same(from: DataType, to: ComponentType) -> bool {
        matches!(
            (from, to),
            (DataType::Int8, ComponentType::I8)
                | (DataType::Uint8, ComponentType::U8)
                | (DataType::Int16, ComponentType::I16)
                | (DataType::Uint16, ComponentType::U16)
                | (DataType::Uint32, ComponentType::U32)
                | (DataType::Float32, ComponentType::F32)
        )
    }

    /// A number of a packed attribute, little-endian. None: of a type that no accessor has.
    fn read(bytes: &[u8], from: DataType) -> Option<f64> {
        Some(match (from, bytes) {
            (DataType::Int8, [a]) => f64::from(*a as i8),
            (DataType::Uint8, [a]) => f64::from(*a),
            (DataType::Int16, [a, b]) => f64::from(i16::from_le_bytes([*a, *b])),
            (DataType::Uint16, [a, b]) => f64::from(u16::from_le_bytes([*a, *b])),
            (DataType::Int32, [a, b, c, d]) => f64::from(i32::from_le_bytes([*a, *b, *c, *d])),
            (DataType::Uint32, [a, b, c, d]) => f64::from(u32::from_le_bytes([*a, *b, *c, *d])),
            (DataType::Float32, [a, b, c, d]) => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
            _ => return None,
        })
    }

    fn write(number: f64, to: ComponentType, bytes: &mut Vec<u8>) {
        match to {
            ComponentType::I8 => bytes.extend((number as i8).to_le_bytes()),
            ComponentType::U8 => bytes.extend((number as u8).to_le_bytes()),
            ComponentType::I16 => bytes.extend((number as i16).to_le_bytes()),
            ComponentType::U16 => bytes.extend((number as u16).to_le_bytes()),
            ComponentType::U32 => bytes.extend((number as u32).to_le_bytes()),
            ComponentType::F32 => bytes.extend((number as f32).to_le_bytes()),
        }
    }
}
