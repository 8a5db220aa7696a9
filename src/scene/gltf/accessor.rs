//! From accessors to numbers. Everything is checked here against the bytes, because nothing was checked before.

use super::Reason;
use super::container::Bytes;
use super::graph::Placed;
use super::unpack::draco::{self, Most};
use super::unpack::meshopt::Views;
use gltf::json::Root;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked;
use std::collections::HashMap;
use std::ops::Range;

/// An accessor without data reads as zeros; more than this many are a mistake, not a scene.
pub(super) const MOST_ZEROS: u64 = 1 << 24;

/// A file's accessors over its loaded buffers.
pub(super) struct Accessors<'a> {
    pub root: &'a Root,
    buffers: &'a [Bytes<'a>],
    /// Buffer views that are packed each by itself.
    views: Views<'a>,
    /// What is packed by whole primitives, by accessor.
    unpacked: HashMap<usize, Elements>,
}

/// The elements of an accessor that come from elsewhere than its buffer view, one after the other.
pub(super) struct Elements {
    pub kind: Type,
    pub component: ComponentType,
    pub count: u64,
    pub bytes: Vec<u8>,
}

/// Integers that stand for numbers: those of KHR_mesh_quantization.
pub(super) const SMALL: [ComponentType; 4] =
    [ComponentType::I8, ComponentType::U8, ComponentType::I16, ComponentType::U16];

impl<'a> Accessors<'a> {
    /// Of a file with its buffers.
    pub fn new(root: &'a Root, buffers: &'a [Bytes<'a>]) -> Self {
        Self { root, buffers, views: Views::new(root), unpacked: HashMap::new() }
    }

    /// Unpacks the primitives of placed meshes that are packed as a whole. True where there are any: then their elements are
    /// counted anew.
    pub fn unpack(&mut self, placed: &[Placed<'_>], most: Most) -> Result<bool, Reason> {
        self.unpacked = draco::unpack(self, placed, most)?;
        Ok(!self.unpacked.is_empty())
    }

    /// The bytes that packed buffer views take once all of them are unpacked.
    pub fn unpacked_bytes(&self) -> u64 {
        self.views.unpacked_bytes()
    }

    /// Vectors of three: floats, or the smaller numbers of KHR_mesh_quantization where the file says that it has them.
    pub fn vec3(&self, index: usize) -> Result<Vec<[f64; 3]>, Reason> {
        self.numbers(index, Type::Vec3, if self.is_quantized() { &SMALL } else { &[] })
    }

    /// Vectors of four, likewise.
    pub fn vec4(&self, index: usize) -> Result<Vec<[f64; 4]>, Reason> {
        self.numbers(index, Type::Vec4, if self.is_quantized() { &SMALL } else { &[] })
    }

    /// Texture coordinates: floats or shares; likewise.
    pub fn vec2(&self, index: usize) -> Result<Vec<[f64; 2]>, Reason> {
        let shares = &[ComponentType::U8, ComponentType::U16];
        self.numbers(index, Type::Vec2, if self.is_quantized() { &SMALL } else { shares })
    }

    fn is_quantized(&self) -> bool {
        const QUANTIZATION: &str = "KHR_mesh_quantization";
        let Root { extensions_used: used, extensions_required: required, .. } = self.root;
        used.iter().chain(required).any(|name| name == QUANTIZATION)
    }

    /// Elements of N numbers: floats, or `also`, which are shares of their type's largest where the accessor says so.
    pub fn numbers<const N: usize>(
        &self,
        index: usize,
        kind: Type,
        also: &[ComponentType],
    ) -> Result<Vec<[f64; N]>, Reason> {
        let allowed = [also, &[ComponentType::F32]].concat();
        let (bytes, component) = self.packed(index, kind, &allowed)?;
        let (size, normalized) = (component.size(), self.is_normalized(index));
        let element = |bytes: &[u8]| {
            std::array::from_fn(|i| number(&bytes[size * i..size * (i + 1)], component, normalized))
        };
        Ok(bytes.chunks_exact(size * N).map(element).collect())
    }

    /// The numbers of some elements of an accessor, and of no others: it may be long.
    pub fn some(
        &self,
        index: usize,
        kind: Type,
        also: &[ComponentType],
        range: Range<u64>,
    ) -> Result<Vec<f64>, Reason> {
        let allowed = [also, &[ComponentType::F32]].concat();
        let (bytes, component) = self.packed_range(index, kind, &allowed, range)?;
        let normalized = self.is_normalized(index);
        Ok(bytes.chunks_exact(component.size()).map(|bytes| number(bytes, component, normalized)).collect())
    }

    fn is_normalized(&self, index: usize) -> bool {
        self.root.accessors.get(index).is_some_and(|accessor| accessor.normalized)
    }

    /// The four joints of each vertex, indices into those of its skin.
    pub fn joints(&self, index: usize) -> Result<Vec<[u32; 4]>, Reason> {
        let (bytes, component) = self.packed(index, Type::Vec4, &[ComponentType::U8, ComponentType::U16])?;
        Ok(unsigned(&bytes, component.size()).as_chunks::<4>().0.to_vec())
    }

    /// The bytes of a buffer view.
    pub fn view(&self, index: usize) -> Result<&[u8], Reason> {
        if let Some(unpacked) = self.views.get(index, self.buffers) {
            return unpacked;
        }
        let view = self.root.buffer_views.get(index).ok_or("has a buffer view that does not exist")?;
        let buffer = self.buffers.get(view.buffer.value()).ok_or("has a buffer that does not exist")?;
        let start = view.byte_offset.map_or(0, |o| o.0);
        let bytes = start
            .checked_add(view.byte_length.0)
            .and_then(|end| buffer.get(usize::try_from(start).ok()?..usize::try_from(end).ok()?));
        Ok(bytes.ok_or("has a buffer view that reaches beyond its buffer")?)
    }

    /// How many elements an accessor has, unread. Zero where it does not exist.
    pub fn count(&self, index: usize) -> u64 {
        let announced = || self.root.accessors.get(index).map_or(0, |accessor| accessor.count.0);
        self.unpacked.get(&index).map_or_else(announced, |elements| elements.count)
    }

    /// True where its elements come out of a packed primitive.
    pub fn is_unpacked(&self, index: usize) -> bool {
        self.unpacked.contains_key(&index)
    }

    /// The number of elements. None where it cannot be that many: reading it says why, and takes no memory.
    pub fn possible_count(&self, index: usize) -> Option<u64> {
        let accessor = self.root.accessors.get(index)?;
        let most = match accessor.buffer_view {
            Some(view) => self.views.length(self.root.buffer_views.get(view.value())?),
            None if self.is_unpacked(index) => u64::MAX,
            None => MOST_ZEROS,
        };
        Some(self.count(index)).filter(|count| *count <= most)
    }

    /// Unsigned integers.
    pub fn indices(&self, index: usize) -> Result<Vec<u32>, Reason> {
        let allowed = [ComponentType::U8, ComponentType::U16, ComponentType::U32];
        let (bytes, component) = self.packed(index, Type::Scalar, &allowed)?;
        Ok(unsigned(&bytes, component.size()))
    }

    /// The elements one after the other without gaps, and the type of their components.
    fn packed(
        &self,
        index: usize,
        kind: Type,
        allowed: &[ComponentType],
    ) -> Result<(Vec<u8>, ComponentType), Reason> {
        self.packed_range(index, kind, allowed, 0..self.count(index))
    }

    /// The same of some elements.
    fn packed_range(
        &self,
        index: usize,
        kind: Type,
        allowed: &[ComponentType],
        range: Range<u64>,
    ) -> Result<(Vec<u8>, ComponentType), Reason> {
        let wrong = |what: &str| format!("accessor {index} {what}; export it again");
        let accessor = self.root.accessors.get(index).ok_or_else(|| wrong("does not exist"))?;
        let unpacked = self.unpacked.get(&index);
        let component = match (accessor.type_, accessor.component_type) {
            (Checked::Valid(k), Checked::Valid(c)) if k == kind && allowed.contains(&c.0) => c.0,
            _ => return Err(wrong("has the wrong type for its use")),
        };
        let size = component.size() * kind.multiplicity();
        let all = self.count(index);
        let count = range.end.checked_sub(range.start).filter(|_| range.end <= all);
        let count =
            count.ok_or_else(|| wrong(&format!("has {all} elements, which are too few for its use")))?;
        let mut packed = match (unpacked, accessor.buffer_view) {
            (Some(elements), _) if (elements.kind, elements.component) == (kind, component) => {
                let bytes = range.start as usize * size..range.end as usize * size;
                elements.bytes.get(bytes).ok_or_else(|| wrong("is damaged"))?.to_vec()
            }
            (Some(_), _) => return Err(wrong("has the wrong type for its use")),
            (None, Some(view)) => {
                let offset = accessor.byte_offset.map_or(0, |o| o.0);
                self.gather(view.value(), offset, range.clone(), size).map_err(|e| wrong(&e))?
            }
            (None, None) if count <= MOST_ZEROS => vec![0; count as usize * size],
            (None, None) => return Err(wrong(&format!("announces {count} elements without data"))),
        };
        if accessor.sparse.is_some() {
            if count != all {
                return Err(wrong("is sparse, which is not read where an animation uses it"));
            }
            self.replace_sparse(accessor, size, &mut packed).map_err(|what| wrong(&what))?;
        }
        Ok((packed, component))
    }

    /// Puts the elements in place that a sparse accessor has others of.
    fn replace_sparse(&self, accessor: &Accessor, size: usize, packed: &mut [u8]) -> Result<(), Reason> {
        let Some(sparse) = &accessor.sparse else { return Ok(()) };
        let Checked::Valid(places) = sparse.indices.component_type else {
            return Err("has sparse indices of the wrong type".into());
        };
        let (view, offset) = (sparse.indices.buffer_view.value(), sparse.indices.byte_offset.0);
        let width = places.0.size();
        let places = self.gather(view, offset, 0..sparse.count.0, width)?;
        let (view, offset) = (sparse.values.buffer_view.value(), sparse.values.byte_offset.0);
        let values = self.gather(view, offset, 0..sparse.count.0, size)?;
        for (place, value) in unsigned(&places, width).into_iter().zip(values.chunks_exact(size)) {
            let start = place as usize * size;
            let target = packed.get_mut(start..start + size);
            target.ok_or("has a sparse index beyond its end")?.copy_from_slice(value);
        }
        Ok(())
    }

    /// Elements of `size` bytes out of a buffer view, without the gaps of its stride.
    fn gather(&self, view: usize, offset: u64, range: Range<u64>, size: usize) -> Result<Vec<u8>, Reason> {
        let count = range.end;
        let bytes = self.view(view)?;
        let view = &self.root.buffer_views[view];
        let stride = view.byte_stride.map_or(size, |s| s.0);
        if stride < size {
            return Err("has a stride smaller than its elements".into());
        }
        if range.is_empty() {
            return Ok(Vec::new());
        }
        let needed = (count - 1).checked_mul(stride as u64).and_then(|n| n.checked_add(size as u64));
        let elements = needed
            .and_then(|needed| {
                bytes.get(usize::try_from(offset).ok()?..)?.get(..usize::try_from(needed).ok()?)
            })
            .ok_or_else(|| format!("announces {count} elements, which reach beyond its buffer view"))?;
        let wanted = &elements[range.start as usize * stride..];
        Ok(wanted.chunks(stride).flat_map(|element| &element[..size]).copied().collect())
    }
}

/// One number, little-endian. Integers are shares where `normalized`: glTF 2.0, §3.11.
fn number(bytes: &[u8], component: ComponentType, normalized: bool) -> f64 {
    let share = |number: f64, largest: f64| if normalized { (number / largest).max(-1.0) } else { number };
    match (component, bytes) {
        (ComponentType::I8, [a]) => share(f64::from(*a as i8), 127.0),
        (ComponentType::U8, [a]) => share(f64::from(*a), 255.0),
        (ComponentType::I16, [a, b]) => share(f64::from(i16::from_le_bytes([*a, *b])), 32_767.0),
        (ComponentType::U16, [a, b]) => share(f64::from(u16::from_le_bytes([*a, *b])), 65_535.0),
        (_, [a, b, c, d]) => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
        _ => unreachable!("a number of {} bytes", bytes.len()),
    }
}

fn unsigned(bytes: &[u8], width: usize) -> Vec<u32> {
    let number = |b: &[u8]| b.iter().rev().fold(0, |n, byte| n << 8 | u32::from(*byte));
    bytes.chunks_exact(width).map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_are_shares_of_their_largest_where_the_file_says_so() {
        let share = |bytes: &[u8], component| number(bytes, component, true);
        assert_eq!(share(&[0x80], ComponentType::I8), -1.0);
        assert_eq!(share(&[0x7F], ComponentType::I8), 1.0);
        assert_eq!(share(&[51], ComponentType::U8), 0.2);
        assert_eq!(share(&[0x00, 0x80], ComponentType::I16), -1.0);
        assert_eq!(share(&[0xFF, 0xFF], ComponentType::U16), 1.0);
        assert_eq!(number(&[0x00, 0x80], ComponentType::I16, false), -32_768.0);
        assert_eq!(number(&1.5_f32.to_le_bytes(), ComponentType::F32, true), 1.5);
    }
}
