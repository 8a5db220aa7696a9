//! OpenEXR: one part, dotted layer names, facts as header attributes.

use crate::error::Result;
use crate::film::header::{Header, Value};
use crate::film::image::Image;
use crate::film::layer::Layer;
use crate::film::replace::{Revised, replace_revised};
use crate::film::sums::Film;
use ::exr::block::BlockIndex;
use ::exr::image::write::channels::{ChannelsWriter, WritableChannels};
use ::exr::math::RoundingMode;
use ::exr::meta::attribute::{ChannelDescription, ChannelList, LevelMode, SampleType};
use ::exr::meta::header::Header as ExrHeader;
use ::exr::prelude::{
    AttributeValue, Blocks, Compression, Encoding, Image as ExrImage, Layer as ExrLayer, LayerAttributes,
    LineOrder, Text, WritableImage, f16,
};
use glam::Vec3;
use half::slice::HalfFloatSliceExt;
use std::io::{self, BufWriter, Read, Write};
use std::path::Path;

/// Prefix of our attributes in a file.
pub(super) const PREFIX: &str = "halflight.";
/// Beginning of the names of facts about mattes.
const CRYPTOMATTE: &str = "cryptomatte/";

/// Writes the mean of every layer of the film: `R G B` is the visible half, so that any viewer shows the picture;
/// others are `invisible.R` …, `error.R` … (standard error of the mean), `depth.Z`, `normal.X` ….
pub fn write_exr(path: &Path, film: &Film, header: &Header) -> Result<()> {
    write_image_exr(path, &film.image(header))
}

/// Writes any picture of named layers, with the names of [`write_exr`]. The same picture gives the same bytes.
pub fn write_image_exr(path: &Path, image: &Image) -> Result<()> {
    let layers: Vec<_> = WrittenLayer::all_of(image).collect();
    // PIZ: smallest and fastest of the lossless ones that compress noisy pictures at all.
    write_layers_exr(path, (image.width, image.height), &image.header, &layers, Compression::PIZ)
}

/// A layer whose values are asked for while they are written.
pub struct WrittenLayer<'a> {
    /// As in [`Image::layers`].
    pub name: String,
    /// True: 16 bits a number. False: 32.
    pub half: bool,
    /// What stands behind its name and a dot, one for each of its numbers.
    pub components: &'static [&'static str],
    /// Its numbers.
    pub line: Line<'a>,
}

/// Fills in one component (the second number) of a row of pixels (the first).
pub type Line<'a> = Box<dyn Fn(usize, usize, &mut [f32]) + Sync + 'a>;

/// The numbers of a picture as they are.
pub fn line_of(values: &[Vec3]) -> Line<'_> {
    Box::new(|y, axis, line| {
        let values = &values[y * line.len()..];
        line.iter_mut().zip(values).for_each(|(x, value)| *x = value[axis]);
    })
}

impl<'a> WrittenLayer<'a> {
    /// The layers of a picture, as they are.
    pub fn all_of(image: &'a Image) -> impl Iterator<Item = Self> {
        let pixels = image.width as usize * image.height as usize;
        image.layers.iter().map(move |(name, values)| {
            assert_eq!(values.len(), pixels, "layer {name} of another size");
            Self { name: name.clone(), half: false, components: components_of(name), line: line_of(values) }
        })
    }
}

/// The components of a layer by its name: of what is none of ours those of light.
pub(crate) fn components_of(name: &str) -> &'static [&'static str] {
    name.parse::<Layer>().map_or(Layer::Visible.components(), Layer::components)
}

/// The bytes of the file that [`write_layers_exr`] writes. None where it cannot hold the picture.
pub fn exr_bytes(
    size: (u32, u32),
    header: &Header,
    layers: &[WrittenLayer<'_>],
    compression: Compression,
) -> Option<Vec<u8>> {
    let mut file = io::Cursor::new(Vec::new());
    encode(size, header, layers, compression, &mut file).ok()?;
    Some(file.into_inner())
}

/// The same as [`write_image_exr`] for a picture of (width, height) that need not be in memory as it is written.
pub fn write_layers_exr(
    path: &Path,
    size: (u32, u32),
    header: &Header,
    layers: &[WrittenLayer<'_>],
    compression: Compression,
) -> Result<()> {
    replace_revised(path, |file| encode(size, header, layers, compression, file).map_err(io::Error::other))
}

fn encode(
    (width, height): (u32, u32),
    header: &Header,
    layers: &[WrittenLayer<'_>],
    compression: Compression,
    file: &mut dyn Revised,
) -> std::result::Result<(), String> {
    if width == 0 || height == 0 {
        return Err("a picture of no pixels".into());
    }
    let mut channels = Vec::new();
    for layer in layers {
        let WrittenLayer { name, half, components, line } = layer;
        for (axis, component) in components.iter().enumerate() {
            let full = if name == Layer::Visible.name() {
                (*component).into()
            } else {
                format!("{name}.{component}")
            };
            channels.push(Channel { name: text(&full), half: *half, axis, line });
        }
    }
    channels.sort_by(|a, b| a.name.cmp(&b.name)); // as the format demands
    let encoding = Encoding { compression, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = (width as usize, height as usize);
    let layer = ExrLayer::new(size, LayerAttributes::default(), encoding, Channels(channels));
    let mut exr = ExrImage::from_layer(layer);
    for (name, value) in &header.entries {
        exr.attributes.other.insert(text(&full(name)), attribute(value));
    }
    let mut buffered = BufWriter::with_capacity(1 << 16, &mut *file);
    exr.write().to_buffered(&mut buffered).map_err(|e| e.to_string())?;
    buffered.flush().map_err(|e| e.to_string())?;
    drop(buffered);
    sort_attributes(file, header)
        .map_err(|e| e.to_string())?
        .ok_or("an attribute name or text is malformed")?;
    Ok(())
}

/// The name of a fact in a file: ours have a prefix, those of Cryptomatte the names of its specification.
fn full(name: &str) -> String {
    if name.starts_with(CRYPTOMATTE) { name.into() } else { format!("{PREFIX}{name}") }
}

/// One component of a layer.
struct Channel<'a> {
    name: Text,
    half: bool,
    axis: usize,
    line: &'a Line<'a>,
}

/// All of them, in the order of their names.
struct Channels<'a>(Vec<Channel<'a>>);

impl<'a> WritableChannels<'a> for Channels<'a> {
    type Writer = &'a Self;

    fn infer_channel_list(&self) -> ChannelList {
        let describe = |channel: &Channel<'_>| {
            let sample = if channel.half { SampleType::F16 } else { SampleType::F32 };
            ChannelDescription::new(channel.name.clone(), sample, false)
        };
        ChannelList::new(self.0.iter().map(describe).collect())
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_writer(&'a self, _: &ExrHeader) -> &'a Self {
        self
    }
}

impl ChannelsWriter for &Channels<'_> {
    /// Line by line, and in each line channel by channel, in the byte order of the machine.
    fn extract_uncompressed_block(&self, header: &ExrHeader, block: BlockIndex) -> Vec<u8> {
        let (at, size) = (block.pixel_position, block.pixel_size);
        let mut bytes = Vec::with_capacity(size.area() * header.channels.bytes_per_pixel);
        let (mut numbers, mut halves) = (vec![0.0; size.width()], vec![f16::ZERO; size.width()]);
        for y in at.y()..at.y() + size.height() {
            for Channel { half, axis, line, .. } in &self.0 {
                line(y, *axis, &mut numbers);
                if *half {
                    halves.convert_from_f32_slice(&numbers);
                    bytes.extend(halves.iter().flat_map(|x| x.to_ne_bytes()));
                } else {
                    bytes.extend(numbers.iter().flat_map(|x| x.to_ne_bytes()));
                }
            }
        }
        bytes
    }
}

fn attribute(value: &Value) -> AttributeValue {
    match value {
        Value::Text(words) => AttributeValue::Text(text(words)),
        Value::Integer(i) => {
            i32::try_from(*i).map_or_else(|_| AttributeValue::Text(text(&i.to_string())), AttributeValue::I32)
        }
        Value::Real(x) => AttributeValue::F64(*x),
    }
}

/// `Text::from(&str)` panics on anything but Latin-1, which a file name need not be; OpenEXR itself asks for UTF-8.
fn text(words: &str) -> Text {
    Text::from_slice_unchecked(words.as_bytes())
}

/// Puts the attributes of a one-part file into a fixed order: the format's own by name, then ours as given. The
/// crate keeps custom attributes in a randomly seeded map, and equal renders are to be equal files. The header
/// keeps its length, so the offsets behind it stay true. None: they are malformed.
fn sort_attributes(file: &mut dyn Revised, header: &Header) -> io::Result<Option<()>> {
    for length in (16..).map(|doubled| 1 << doubled) {
        let mut bytes = Vec::new();
        file.rewind()?;
        (&mut *file).take(length).read_to_end(&mut bytes)?;
        if sort_attributes_of(&mut bytes, header).is_some() {
            file.rewind()?;
            return file.write_all(&bytes).map(Some);
        }
        // Nowhere near so many are written.
        if (bytes.len() as u64) < length {
            break;
        }
    }
    Ok(None)
}

/// The same for the beginning of a file. None where they do not end there.
fn sort_attributes_of(bytes: &mut [u8], header: &Header) -> Option<()> {
    let begin = 8; // magic number, version and flags
    let mut at = begin;
    let mut attributes: Vec<(usize, Vec<u8>, Vec<u8>)> = Vec::new();
    while *bytes.get(at)? != 0 {
        let name_end = at + bytes[at..].iter().position(|&b| b == 0)?;
        let kind_end = name_end + 1 + bytes[name_end + 1..].iter().position(|&b| b == 0)?;
        let length = bytes.get(kind_end + 1..kind_end + 5)?.try_into().ok()?;
        let end = kind_end + 5 + usize::try_from(i32::from_le_bytes(length)).ok()?;
        let name = bytes[at..name_end].to_vec();
        let ours = name.strip_prefix(PREFIX.as_bytes());
        let place = header.entries.iter().position(|(entry, _)| Some(entry.as_bytes()) == ours);
        attributes.push((place.map_or(0, |i| i + 1), name, bytes.get(at..end)?.to_vec()));
        at = end;
    }
    attributes.sort();
    let sorted: Vec<u8> = attributes.into_iter().flat_map(|(_, _, all)| all).collect();
    bytes[begin..at].copy_from_slice(&sorted);
    Some(())
}
