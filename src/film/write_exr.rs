//! OpenEXR: one part, f32, dotted layer names, facts as header attributes.

use crate::error::{Error, Result};
use crate::film::header::{Header, Value};
use crate::film::image::Image;
use crate::film::layer::Layer;
use crate::film::replace::replace_file;
use crate::film::sums::Film;
use ::exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatSamples, Image as ExrImage,
    Layer as ExrLayer, LayerAttributes, LineOrder, Text, WritableImage,
};
use std::io::Cursor;
use std::path::Path;

/// Prefix of our attributes in a file.
pub(super) const PREFIX: &str = "halflight.";

/// Writes the mean of every layer of the film: `R G B` is the visible half, so that any viewer shows the picture;
/// others are `invisible.R` …, `error.R` … (standard error of the mean), `depth.Z`, `normal.X` ….
pub fn write_exr(path: &Path, film: &Film, header: &Header) -> Result<()> {
    write_image_exr(path, &film.image(header))
}

/// Writes any picture of named layers, with the names of [`write_exr`]. The same picture gives the same bytes.
pub fn write_image_exr(path: &Path, image: &Image) -> Result<()> {
    let bytes = encode(image).map_err(|reason| Error::Write { path: path.into(), reason })?;
    replace_file(path, |file| file.write_all(&bytes))
}

fn encode(image: &Image) -> std::result::Result<Vec<u8>, String> {
    let pixels = image.width as usize * image.height as usize;
    if pixels == 0 {
        return Err("a picture of no pixels".into());
    }
    let mut channels = Vec::new();
    for (name, values) in &image.layers {
        assert_eq!(values.len(), pixels, "layer {name} of another size");
        let components = name.parse::<Layer>().map_or(Layer::Visible.components(), Layer::components);
        for (axis, component) in components.iter().enumerate() {
            let full = if name == Layer::Visible.name() {
                (*component).into()
            } else {
                format!("{name}.{component}")
            };
            let samples = FlatSamples::F32(values.iter().map(|v| v[axis]).collect());
            channels.push(AnyChannel::new(text(&full), samples));
        }
    }
    // PIZ: smallest and fastest of the lossless ones that compress noisy pictures at all.
    let encoding = Encoding {
        compression: Compression::PIZ,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = (image.width as usize, image.height as usize);
    let layer = ExrLayer::new(
        size,
        LayerAttributes::default(),
        encoding,
        AnyChannels::sort(channels.into_iter().collect()),
    );
    let mut exr = ExrImage::from_layer(layer);
    for (name, value) in &image.header.entries {
        exr.attributes.other.insert(text(&format!("{PREFIX}{name}")), attribute(value));
    }
    let mut bytes = Vec::new();
    exr.write().to_buffered(Cursor::new(&mut bytes)).map_err(|e| e.to_string())?;
    sort_attributes(&mut bytes, &image.header).ok_or("an attribute name or text is malformed")?;
    Ok(bytes)
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
/// keeps its length, so the offsets behind it stay true.
fn sort_attributes(bytes: &mut [u8], header: &Header) -> Option<()> {
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
