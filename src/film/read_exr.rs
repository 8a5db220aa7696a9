//! OpenEXR files of any program, as named layers.

use crate::error::{Error, Result};
use crate::film::header::Header;
use crate::film::image::Image;
use crate::film::layer::Layer;
use crate::film::write_exr::PREFIX;
use crate::pictures::check_exr;
use ::exr::prelude::{AnyChannel, AttributeValue, FlatSamples, ReadChannels, ReadLayers, Text, read};
use glam::Vec3;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Reads every layer of an EXR file: scan lines or tiles, one part or several of equal size, any compression, f16,
/// f32 or u32. Channels are grouped by what stands before the last dot: `R G B` (called `visible` where nothing
/// stands before it), `X Y Z`, `Z` alone (called `depth`), or `Y` alone (grey). Other channels are passed over.
/// Pixels are those of the data window. Our own layers come first, in the order of [`Layer::ALL`].
pub fn read_exr(path: &Path) -> Result<Image> {
    let unread = |source| Error::Read { path: path.into(), source };
    // Asked before it is opened: a pipe would wait for somebody to write.
    if !std::fs::metadata(path).map_err(unread)?.is_file() {
        let reason = "is no file (a folder, a pipe or a device); name an EXR file".into();
        return Err(Error::Image { path: path.into(), reason });
    }
    let file = File::open(path).map_err(unread)?;
    decode(BufReader::new(file)).map_err(|reason| Error::Image { path: path.into(), reason })
}

/// Bytes in memory for each in the picture: as it is read, and as it is given back, where a half becomes a float and a depth three.
const DECODED: u64 = 4;

fn decode(mut file: BufReader<File>) -> std::result::Result<Image, String> {
    let bad = |e: ::exr::error::Error| format!("not a readable EXR file ({e}); render or export it again");
    let there = file.get_ref().metadata().map_err(|e| e.to_string())?.len();
    check_exr(&mut file, there, DECODED)?;
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
