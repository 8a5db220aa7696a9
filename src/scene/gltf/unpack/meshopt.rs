//! EXT_meshopt_compression and its successor KHR_meshopt_compression: buffer views whose bytes are packed in another place.

use super::super::Reason;
use super::super::container::Bytes;
use gltf::json::buffer::{Buffer, View};
use gltf::json::{Root, Value};
use std::cell::OnceCell;

/// The two names of one packing. The second also has a filter for colours and denser streams.
pub(in super::super) const NAMES: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// True for a buffer that only stands for the bytes that packed views would unpack to. It is not loaded.
pub(in super::super) fn is_fallback(buffer: &Buffer) -> bool {
    let others = buffer.extensions.as_ref().map(|extensions| &extensions.others);
    let marked =
        |name: &str| others.and_then(|others| others.get(name)).is_some_and(|e| e["fallback"] == true);
    NAMES.iter().any(|name| marked(name))
}

/// The packed buffer views of a file, each unpacked once, when it is first read.
pub(in super::super) struct Views<'a> {
    root: &'a Root,
    /// Which of [`NAMES`] the file requires.
    required: [bool; 2],
    unpacked: Vec<OnceCell<Result<Vec<u8>, Reason>>>,
}

impl<'a> Views<'a> {
    /// None unpacked yet.
    pub fn new(root: &'a Root) -> Self {
        let required = NAMES.map(|name| root.extensions_required.iter().any(|required| required == name));
        Self { root, required, unpacked: root.buffer_views.iter().map(|_| OnceCell::new()).collect() }
    }

    /// The bytes of a view. None: its bytes lie in its buffer, as they are.
    pub fn get(&self, index: usize, buffers: &[Bytes<'_>]) -> Option<Result<&[u8], Reason>> {
        let packing = self.packing(self.root.buffer_views.get(index)?)?;
        let bytes = self.unpacked.get(index)?.get_or_init(|| packing.unpack(buffers));
        Some(bytes.as_deref().map_err(Clone::clone))
    }

    /// How long a view is, unpacked.
    pub fn length(&self, view: &View) -> u64 {
        self.packing(view).map_or(view.byte_length.0, |packing| packing.length())
    }

    /// The bytes that all packed views together unpack to.
    pub fn unpacked_bytes(&self) -> u64 {
        let packings = self.root.buffer_views.iter().filter_map(|view| self.packing(view));
        packings.fold(0, |sum, packing| sum.saturating_add(packing.length()))
    }

    /// How a view is packed. None where the plain bytes are in the file as well, for readers without the extension.
    fn packing(&self, view: &'a View) -> Option<Packing<'a>> {
        let others = &view.extensions.as_ref()?.others;
        let plain = || self.root.buffers.get(view.buffer.value()).is_some_and(|buffer| !is_fallback(buffer));
        NAMES.iter().zip(self.required).find_map(|(name, required)| {
            let says = others.get(*name)?;
            (required || !plain()).then_some(Packing { name, says })
        })
    }
}

/// What the extension says of a view.
#[derive(Clone, Copy)]
struct Packing<'a> {
    name: &'static str,
    says: &'a Value,
}

impl Packing<'_> {
    fn number(&self, key: &str) -> Option<u64> {
        self.says[key].as_u64()
    }

    fn length(&self) -> u64 {
        self.number("count").unwrap_or(0).saturating_mul(self.number("byteStride").unwrap_or(0))
    }

    fn unpack(&self, buffers: &[Bytes<'_>]) -> Result<Vec<u8>, Reason> {
        let name = self.name;
        let lost = || format!("has a buffer view whose {name} leads to no bytes");
        let number = |key| self.number(key).and_then(|number| usize::try_from(number).ok());
        let buffer = number("buffer").and_then(|buffer| buffers.get(buffer)).ok_or_else(lost)?;
        let (start, length) = (number("byteOffset").unwrap_or(0), number("byteLength").ok_or_else(lost)?);
        let end = start.checked_add(length).ok_or_else(lost)?;
        let packed = buffer.get(start..end).ok_or_else(lost)?;
        let (Some(count), Some(stride)) = (number("count"), number("byteStride")) else {
            return Err(format!("has a buffer view whose {name} has no count or no byteStride"));
        };
        let word = |key: &str| self.says[key].as_str();
        decode(packed, (count, stride), word("mode").unwrap_or(""), word("filter").unwrap_or("NONE"))
            .map_err(|what| format!("has a buffer view whose {name} {what}"))
    }
}

#[cfg(feature = "meshopt")]
fn decode(
    packed: &[u8],
    (count, stride): (usize, usize),
    mode: &str,
    filter: &str,
) -> Result<Vec<u8>, Reason> {
    use meshoptimizer_rs::codec::{
        decode_filter_color, decode_filter_exp, decode_filter_oct, decode_filter_quat, decode_index_buffer,
        decode_index_sequence, decode_vertex_buffer,
    };
    use meshoptimizer_rs::{Limits, Workspace};
    // It counts its output once; how much may be unpacked was decided before.
    let mut workspace = Workspace::new(Limits { max_bytes: usize::MAX, max_work: u64::MAX });
    let damaged = |error| format!("is damaged ({error})");
    let decode = match mode {
        "ATTRIBUTES" => decode_vertex_buffer,
        "TRIANGLES" => decode_index_buffer,
        "INDICES" => decode_index_sequence,
        _ => return Err("has an unknown mode".into()),
    };
    let mut bytes = decode(count, stride, packed, &mut workspace).map_err(damaged)?;
    let undo = match filter {
        "NONE" => return Ok(bytes),
        "OCTAHEDRAL" => decode_filter_oct,
        "QUATERNION" => decode_filter_quat,
        "EXPONENTIAL" => decode_filter_exp,
        "COLOR" => decode_filter_color,
        _ => return Err("has an unknown filter".into()),
    };
    if mode != "ATTRIBUTES" {
        return Err("has a filter, which only attributes may have".into());
    }
    undo(&mut bytes, count, stride, &mut workspace).map_err(damaged)?;
    Ok(bytes)
}

#[cfg(not(feature = "meshopt"))]
fn decode(_: &[u8], _: (usize, usize), _: &str, _: &str) -> Result<Vec<u8>, Reason> {
    Err(super::LEFT_OUT.into())
}

#[cfg(test)]
#[cfg(feature = "meshopt")]
mod tests {
    use super::*;
    use meshoptimizer_rs::Workspace;
    use meshoptimizer_rs::codec::{
        VertexEncoding, encode_filter_color, encode_filter_quat, encode_vertex_buffer,
    };

    /// Four numbers of an element, packed by a filter and a stream of version 1, unpacked again.
    fn round<const W: usize>(filter: &str, filtered: &[u8], version: u8) -> Vec<Vec<u8>> {
        let encoding = VertexEncoding::new(version, 2).unwrap();
        let count = filtered.len() / W;
        let packed = encode_vertex_buffer(filtered, count, W, encoding, &mut Workspace::default()).unwrap();
        let bytes = decode(&packed, (count, W), "ATTRIBUTES", filter).unwrap();
        bytes.chunks(W).map(<[u8]>::to_vec).collect()
    }

    #[test]
    fn turns_and_colours_come_back() {
        let turns = [[0.0, 0.0, 0.0, 1.0], [0.5, -0.5, 0.5, 0.5], [0.6, 0.0, -0.8, 0.0_f32]];
        let filtered = encode_filter_quat(3, 8, 16, turns.as_flattened(), &mut Workspace::default()).unwrap();
        for version in [0, 1] {
            for (element, turn) in round::<8>("QUATERNION", &filtered, version).iter().zip(turns) {
                let numbers =
                    element.as_chunks::<2>().0.iter().map(|b| f32::from(i16::from_le_bytes(*b)) / 32_767.0);
                let dot: f32 = numbers.zip(turn).map(|(a, b)| a * b).sum();
                assert!((dot.abs() - 1.0).abs() < 1e-3, "{turn:?}: {dot}");
            }
        }
        let colours = [[1.0, 0.0, 0.0, 1.0], [0.2, 0.4, 0.6, 0.8_f32]];
        let filtered =
            encode_filter_color(2, 4, 8, colours.as_flattened(), &mut Workspace::default()).unwrap();
        for (element, colour) in round::<4>("COLOR", &filtered, 1).iter().zip(colours) {
            for (found, expected) in element.iter().zip(colour) {
                assert!((f32::from(*found) / 255.0 - expected).abs() < 0.02, "{element:?} for {colour:?}");
            }
        }
    }
}
