//! From the bytes of a file to its JSON and its buffers.

use super::Reason;
use base64::Engine;
use base64::alphabet;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::json::Root;
use std::borrow::Cow;
use std::path::{Component, Path};

/// Padding is often forgotten and never ambiguous.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The JSON text of a .gltf or .glb, and the binary chunk of a .glb. Told apart by content, not by name.
pub(super) fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Reason> {
    if bytes.is_empty() {
        return Err("is empty; export the scene again".into());
    }
    if bytes.starts_with(b"glTF") {
        return split_glb(bytes);
    }
    let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    if text.iter().find(|byte| !byte.is_ascii_whitespace()) != Some(&b'{') {
        return Err("is not a glTF file; export the scene as glTF 2.0 (.gltf or .glb)".into());
    }
    Ok((text, None))
}

fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Reason> {
    let word = |at: usize| -> Option<u32> {
        let four = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes(four.try_into().ok()?))
    };
    let truncated = |wanted: u64| {
        format!(
            "is truncated: {} bytes are there, {wanted} are announced; copy or export it again",
            bytes.len()
        )
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else { return Err(truncated(12)) };
    if version != 2 {
        return Err(format!("is binary glTF version {version}; only version 2 can be read, convert it"));
    }
    if u64::from(length) > bytes.len() as u64 {
        return Err(truncated(u64::from(length)));
    }
    let mut json = None;
    let mut binary = None;
    let mut at = 12;
    while at < length as usize {
        let (Some(size), Some(kind)) = (word(at), word(at + 4)) else { return Err(truncated(at as u64 + 8)) };
        let start = at + 8;
        let chunk = bytes.get(start..start.saturating_add(size as usize));
        let chunk = chunk.ok_or_else(|| truncated(start as u64 + u64::from(size)))?;
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if binary.is_none() => binary = Some(chunk),
            _ => {} // the format asks readers to pass over chunks they do not know
        }
        at = start + size as usize;
    }
    Ok((json.ok_or("has no JSON chunk; export it again")?, binary))
}

/// The bytes of every buffer, each at least as long as it says.
pub(super) fn load_buffers<'a>(
    root: &Root,
    chunk: Option<&'a [u8]>,
    folder: &Path,
) -> Result<Vec<Cow<'a, [u8]>>, Reason> {
    let load = |(index, buffer): (usize, &gltf::json::Buffer)| {
        let bytes: Cow<'a, [u8]> = match &buffer.uri {
            Some(uri) => load_uri(uri, folder).map_err(|e| format!("buffer {index}: {e}"))?.into(),
            None if index == 0 && chunk.is_some() => chunk.unwrap_or_default().into(),
            None => {
                return Err(format!("buffer {index} has neither a uri nor a binary chunk; export it again"));
            }
        };
        let (have, want) = (bytes.len() as u64, buffer.byte_length.0);
        if have < want {
            return Err(format!(
                "buffer {index} holds {have} bytes where {want} are announced; export it again"
            ));
        }
        Ok(bytes)
    };
    root.buffers.iter().enumerate().map(load).collect()
}

/// The bytes of a data uri, or of a file in the folder of the scene.
pub(super) fn load_uri(uri: &str, folder: &Path) -> Result<Vec<u8>, Reason> {
    if let Some(data) = uri.strip_prefix("data:") {
        let encoded = data
            .split_once(',')
            .filter(|(kind, _)| kind.ends_with(";base64"))
            .ok_or("its data uri is not base64; export it again")?;
        return BASE64
            .decode(encoded.1)
            .map_err(|e| format!("its data uri is damaged ({e}); export it again"));
    }
    let shown: String = uri.chars().take(100).collect();
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
    std::fs::read(folder.join(&name))
        .map_err(|e| format!("its file `{name}` cannot be read ({e}); put it beside the scene"))
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
            let message = load_uri(uri, folder).expect_err(uri);
            assert!(message.contains("in the folder"), "{uri}: {message}");
        }
    }
}
