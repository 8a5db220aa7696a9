//! The files of a scene: its own, and those in its folder that it names. No others are opened.

use super::Reason;
use crate::error::{Error, Result};
use crate::scene::names::one_line;
use base64::Engine;
use base64::alphabet;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::json::Root;
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

/// Padding is often forgotten and never ambiguous.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Buffers end on words of this length, whatever they hold.
pub(super) const PADDING: u64 = 4;

/// The bytes of a scene file. Its beginning is looked at first: a film of many gigabytes is not read to find out that it
/// is no scene.
pub(super) fn read_scene(path: &Path) -> Result<Vec<u8>> {
    let unread = |source| Error::Read { path: path.to_owned(), source };
    let wrong = |reason: String| Error::scene(one_line(&path.display().to_string()), reason);
    let there = fs::metadata(path).map_err(unread)?;
    if there.is_dir() {
        return Err(wrong("is a folder (a directory); name the .gltf or .glb file in it".into()));
    }
    if !there.is_file() {
        return Err(wrong("is no file (a pipe or a device); save the scene to a .gltf or .glb file".into()));
    }
    let mut file = File::open(path).map_err(unread)?;
    let mut bytes = Vec::new();
    file.by_ref().take(256).read_to_end(&mut bytes).map_err(unread)?;
    if !bytes.is_empty() && !begins_like_gltf(&bytes) {
        return Err(wrong(what_else(path)));
    }
    let left = there.len().saturating_sub(bytes.len() as u64);
    let left = usize::try_from(left).map_err(|_| wrong("is too large for this machine".into()))?;
    bytes.try_reserve_exact(left).map_err(|_| wrong("is larger than the memory there is".into()))?;
    file.read_to_end(&mut bytes).map_err(unread)?;
    Ok(bytes)
}

fn begins_like_gltf(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    let first = text.iter().find(|byte| !byte.is_ascii_whitespace());
    // A beginning of blanks alone may go on as JSON.
    bytes.starts_with(b"glTF") || first.is_none_or(|first| *first == b'{')
}

/// Formats that people have instead, and which program makes glTF of them.
const OTHERS: &[(&str, &str)] = &[
    (
        "blend",
        "a Blender file; open it in Blender and choose File > Export > glTF 2.0 (tick cameras and lights)",
    ),
    ("obj", "a Wavefront OBJ file"),
    ("fbx", "an FBX file"),
    ("usd", "a USD file"),
    ("usda", "a USD file"),
    ("usdc", "a USD file"),
    ("usdz", "a USD file"),
    ("stl", "an STL file"),
    ("ply", "a PLY file"),
    ("dae", "a Collada file"),
    ("3ds", "a 3ds file"),
    ("abc", "an Alembic file"),
    ("x3d", "an X3D file"),
    ("wrl", "a VRML file"),
    ("pbrt", "a pbrt scene"),
    ("xml", "an XML file, of Mitsuba perhaps"),
    ("max", "a 3ds Max file; export the scene from there as glTF 2.0"),
    ("c4d", "a Cinema 4D file; export the scene from there as glTF 2.0"),
    ("ma", "a Maya file; export the scene from there as glTF 2.0"),
    ("mb", "a Maya file; export the scene from there as glTF 2.0"),
];

/// What is wrong with a file that is not glTF.
fn what_else(path: &Path) -> Reason {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
    match OTHERS.iter().find(|(other, _)| *other == ending) {
        Some((_, what)) if what.contains(';') => format!("is {what}; only glTF 2.0 is read"),
        Some((_, what)) => format!(
            "is {what}; only glTF 2.0 is read: import it into Blender and choose File > Export > glTF 2.0 (.glb)"
        ),
        None => "is not a glTF file; export the scene as glTF 2.0 (.gltf or .glb)".into(),
    }
}

/// The files of its folder that a scene names, whether or not they are read; paths that do not lead to a file there are
/// left out.
pub(super) fn named(root: &Root, folder: &Path) -> Vec<PathBuf> {
    let buffers = root.buffers.iter().filter_map(|buffer| buffer.uri.as_deref());
    let profiles: Vec<String> = super::ies::uris(root).collect();
    let buffers = buffers.chain(profiles.iter().map(String::as_str));
    let uris: BTreeSet<&str> =
        buffers.chain(root.images.iter().filter_map(|image| image.uri.as_deref())).collect();
    uris.into_iter().filter(|uri| !is_data(uri)).filter_map(|uri| locate(uri, folder).ok()).collect()
}

/// True for what holds its bytes itself.
pub(super) fn is_data(uri: &str) -> bool {
    uri.starts_with("data:")
}

/// The bytes of a data uri, or of a file in the folder of the scene that may have so many.
pub(super) fn load_uri(uri: &str, folder: &Path, most: u64) -> std::result::Result<Vec<u8>, Reason> {
    if let Some(data) = uri.strip_prefix("data:") {
        let encoded = data
            .split_once(',')
            .filter(|(kind, _)| kind.ends_with(";base64"))
            .ok_or("its data uri is not base64; export it again")?;
        return BASE64
            .decode(encoded.1)
            .map_err(|e| format!("its data uri is damaged ({e}); export it again"));
    }
    let path = locate(uri, folder)?;
    read_at_most(&path, most).map_err(|e| match e.kind() {
        io::ErrorKind::FileTooLarge => {
            format!(
                "its file `{}` is longer than the {most} bytes that it may have; export it again, or take a smaller one",
                shown(uri)
            )
        }
        _ => unreadable(uri, &e),
    })
}

fn read_at_most(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    if length > most {
        return Err(io::ErrorKind::FileTooLarge.into());
    }
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(length as usize)?;
    file.take(most).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn shown(uri: &str) -> String {
    uri.chars().take(100).collect()
}

fn unreadable(uri: &str, e: &io::Error) -> Reason {
    format!("its file `{}` cannot be read ({e}); put it beside the scene", shown(uri))
}

/// The regular file within the folder that a uri names, links followed.
pub(in crate::scene) fn locate(uri: &str, folder: &Path) -> std::result::Result<PathBuf, Reason> {
    let shown = shown(uri);
    let name =
        percent_decode(uri).ok_or_else(|| format!("its uri `{shown}` is not UTF-8; rename the file"))?;
    let inside = |name: &str| {
        !name.contains([':', '\\', '\0'])
            && Path::new(name).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir))
    };
    if name.is_empty() || !inside(&name) {
        return Err(format!(
            "its uri `{shown}` does not name a file in the folder of the scene; move the file there and name it"
        ));
    }
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let unreadable = |e: io::Error| unreadable(uri, &e);
    let path = here.join(&name).canonicalize().map_err(unreadable)?;
    if !path.starts_with(here.canonicalize().map_err(unreadable)?) {
        return Err(format!(
            "its file `{shown}` is a link that leads out of the folder of the scene; copy the file itself there"
        ));
    }
    // Before it is opened: a pipe would wait for whoever writes to it.
    if fs::metadata(&path).map_err(unreadable)?.is_file() {
        Ok(path)
    } else {
        Err(format!("`{shown}` is no file (a folder, a pipe or a device); put the file itself there"))
    }
}

/// `%XX` to bytes; None when the result is not UTF-8. A `%` without two hexadecimal digits stands for itself.
fn percent_decode(uri: &str) -> Option<String> {
    let bytes = uri.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let digit = |i: usize| bytes.get(i).and_then(|b| char::from(*b).to_digit(16));
        match (bytes[at], digit(at + 1), digit(at + 2)) {
            (b'%', Some(high), Some(low)) => {
                decoded.push((16 * high + low) as u8);
                at += 3;
            }
            (byte, ..) => {
                decoded.push(byte);
                at += 1;
            }
        }
    }
    String::from_utf8(decoded).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percent_signs_are_decoded() {
        assert_eq!(percent_decode("a%20b.bin").as_deref(), Some("a b.bin"));
        assert_eq!(percent_decode("100%.bin").as_deref(), Some("100%.bin"));
        assert_eq!(percent_decode("%c3%A4.bin").as_deref(), Some("ä.bin"));
        assert_eq!(percent_decode("%FF"), None);
    }

    #[test]
    fn uris_stay_in_the_folder() {
        let folder = Path::new("no such folder");
        for uri in ["../x.bin", "a/%2e%2e/../x", "/etc/passwd", "file:///x", "c:\\x", "", "a%00b"] {
            let message = load_uri(uri, folder, 9).expect_err(uri);
            assert!(message.contains("in the folder"), "{uri}: {message}");
        }
    }
}
