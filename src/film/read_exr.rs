//! OpenEXR files of any program, as named layers.

use crate::error::{Error, Result};
use crate::film::header::Header;
use crate::film::image::Image;
use crate::film::layer::Layer;
use crate::film::write_exr::PREFIX;
use ::exr::prelude::{
    AnyChannel, AttributeValue, Compression, FlatSamples, MetaData, ReadChannels, ReadLayers, Text, read,
};
use glam::Vec3;
use std::fs::File;
use std::io::{BufReader, Seek};
use std::path::Path;

/// Reads every layer of an EXR file: scan lines or tiles, one part or several of equal size, any compression, f16,
/// f32 or u32. Channels are grouped by what stands before the last dot: `R G B` (called `visible` where nothing
/// stands before it), `X Y Z`, `Z` alone (called `depth`), or `Y` alone (grey). Other channels are passed over.
/// Pixels are those of the data window. Our own layers come first, in the order of [`Layer::ALL`].
pub fn read_exr(path: &Path) -> Result<Image> {
    let file = File::open(path).map_err(|source| Error::Read { path: path.into(), source })?;
    decode(BufReader::new(file)).map_err(|reason| Error::Image { path: path.into(), reason })
}

fn decode(mut file: BufReader<File>) -> std::result::Result<Image, String> {
    let bad = |e: ::exr::error::Error| format!("not a readable EXR file ({e}); render or export it again");
    check_size(&mut file)?;
    let reader =
        read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
    let exr = reader.from_buffered(file).map_err(bad)?;
    let first = exr.layer_data.first().ok_or("it holds no picture")?;
    let size = first.size;
    let several = exr.layer_data.len() > 1;
    let mut groups: Vec<Group<'_>> = Vec::new();
    let mut header = Header::new();
    for part in &exr.layer_data {
        if part.size != size {
            return Err("its parts differ in size; give a file of one size".into());
        }
        let part_name = part.attributes.layer_name.as_ref().filter(|_| several).map(utf8);
        for channel in &part.channel_data.list {
            collect(&mut groups, part_name.as_deref(), channel);
        }
        read_facts(&mut header, part.attributes.other.iter());
    }
    read_facts(&mut header, exr.attributes.other.iter());
    header.entries.sort_by(|a, b| a.0.cmp(&b.0));
    let mut layers: Vec<_> = groups.iter().flat_map(|group| group.layers(size.area())).collect();
    if layers.is_empty() {
        return Err("it holds no layer with channels R, G, B (nor X, Y, Z, nor Y, nor Z)".into());
    }
    layers.sort_by_key(|(name, _)| name.parse().map_or(usize::MAX, |layer: Layer| layer as usize));
    let side = |n: usize| u32::try_from(n).map_err(|_| "it is too large".to_string());
    Ok(Image { width: side(size.width())?, height: side(size.height())?, layers, header })
}

/// A damaged or hostile header can ask for any amount of memory, and a failed allocation would end the process.
fn check_size(file: &mut BufReader<File>) -> std::result::Result<(), String> {
    let bad = |e: ::exr::error::Error| format!("not a readable EXR file ({e}); render or export it again");
    let meta = MetaData::read_from_buffered(&mut *file, false).map_err(bad)?;
    file.rewind().map_err(|e| e.to_string())?;
    if let Some(dwa) = meta.headers.iter().map(|header| header.compression).find(|c| is_dwa(*c)) {
        return Err(format!(
            "it has {dwa}, which cannot be read safely; save it again with ZIP, PIZ or no compression"
        ));
    }
    let bytes = meta.headers.iter().try_fold(0_u64, |sum, header| {
        let pixels = header.layer_size.0.checked_mul(header.layer_size.1)?;
        sum.checked_add(pixels.checked_mul(header.channels.bytes_per_pixel)? as u64)
    });
    let there = file.get_ref().metadata().map_err(|e| e.to_string())?.len();
    match bytes {
        Some(bytes) if bytes / MOST_COMPRESSED > there => {
            Err("its header announces more pixels than so short a file can hold; the file is damaged".into())
        }
        Some(bytes) if !is_had(bytes.saturating_mul(DECODED)) => Err(format!(
            "its {bytes} bytes of pixels take more memory than there is; make it smaller or free some memory"
        )),
        Some(_) => Ok(()),
        None => Err("its header asks for more memory than there is; the file is damaged".into()),
    }
}

/// No compression but DWA packs so many bytes into one: deflate, which ZIP and PXR24 rest on, packs 1032, and PXR24 has left
/// out a fourth of the bytes before.
const MOST_COMPRESSED: u64 = 1400;
/// Bytes in memory for each in the picture: as it is read, and as it is given back, where a half becomes a float and a depth three.
const DECODED: u64 = 4;

/// The decoder of these believes sizes in the file before it allocates, and ends the process.
fn is_dwa(compression: Compression) -> bool {
    matches!(compression, Compression::DWAA(_) | Compression::DWAB(_))
}

fn is_had(bytes: u64) -> bool {
    let fits = usize::try_from(bytes).is_ok_and(|n| Vec::<u8>::new().try_reserve_exact(n).is_ok());
    fits && crate::machine::memory().is_none_or(|left| bytes <= left.bytes)
}

/// Channels that share what stands before the last dot.
struct Group<'a> {
    name: String,
    channels: Vec<(String, &'a FlatSamples)>,
}

fn collect<'a>(groups: &mut Vec<Group<'a>>, part: Option<&str>, channel: &'a AnyChannel<FlatSamples>) {
    let full = utf8(&channel.name);
    let (stem, component) = full.rsplit_once('.').unwrap_or(("", &full));
    let name = match (part.unwrap_or(""), stem) {
        ("", stem) => stem.to_string(),
        (part, "") => part.to_string(),
        (part, stem)
            if stem.strip_prefix(part).is_some_and(|rest| rest.is_empty() || rest.starts_with('.')) =>
        {
            stem.to_string()
        }
        (part, stem) => format!("{part}.{stem}"),
    };
    match groups.iter_mut().find(|group| group.name == name) {
        Some(group) => group.channels.push((component.to_string(), &channel.sample_data)),
        None => groups.push(Group { name, channels: vec![(component.to_string(), &channel.sample_data)] }),
    }
}

impl Group<'_> {
    fn channel(&self, component: &str, pixels: usize) -> Option<&FlatSamples> {
        let found = self.channels.iter().find(|(name, _)| name == component).map(|(_, samples)| *samples);
        found.filter(|samples| samples.len() == pixels) // a subsampled channel has fewer
    }

    /// The layers made of these channels: at most a picture or vector, and a depth.
    fn layers(&self, pixels: usize) -> Vec<(String, Vec<Vec3>)> {
        let channel = |component: &'static str| self.channel(component, pixels);
        let triple = |a, b, c| Some([channel(a)?, channel(b)?, channel(c)?]);
        let named = |unnamed: &str| if self.name.is_empty() { unnamed } else { &self.name }.to_string();
        let mut found = Vec::new();
        let vector = triple("X", "Y", "Z");
        if let Some(rgb) = triple("R", "G", "B") {
            found.push((named("visible"), combine(pixels, rgb)));
        } else if let Some(y) = channel("Y").filter(|_| vector.is_none() && channel("RY").is_none()) {
            found.push((named("visible"), combine(pixels, [y, y, y])));
        }
        if let Some(xyz) = vector {
            found.push((named("vector"), combine(pixels, xyz)));
        } else if let Some(z) = channel("Z") {
            let name = if found.is_empty() { named("depth") } else { format!("{}.depth", self.name) };
            let depth = (0..pixels).map(|i| Vec3::new(sample(z, i), 0.0, 0.0)).collect();
            found.push((name.trim_start_matches('.').to_string(), depth));
        }
        found
    }
}

fn combine(pixels: usize, [x, y, z]: [&FlatSamples; 3]) -> Vec<Vec3> {
    (0..pixels).map(|i| Vec3::new(sample(x, i), sample(y, i), sample(z, i))).collect()
}

fn sample(samples: &FlatSamples, i: usize) -> f32 {
    match samples {
        FlatSamples::F16(values) => values[i].to_f32(),
        FlatSamples::F32(values) => values[i],
        FlatSamples::U32(values) => values[i] as f32,
    }
}

fn read_facts<'a>(header: &mut Header, attributes: impl Iterator<Item = (&'a Text, &'a AttributeValue)>) {
    for (name, value) in attributes {
        let name = utf8(name);
        let name = name.strip_prefix(PREFIX).unwrap_or(&name);
        match value {
            AttributeValue::Text(words) => header.set(name, utf8(words)),
            AttributeValue::I32(i) => header.set(name, i64::from(*i)),
            AttributeValue::F32(x) => header.set(name, f64::from(*x)),
            AttributeValue::F64(x) => header.set(name, *x),
            _ => {}
        }
    }
}

fn utf8(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}
