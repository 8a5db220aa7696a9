//! From the bytes of a file to its JSON and its buffers.

use super::Reason;
use super::files::{PADDING, is_data, load_uri, locate};
use super::unpack::meshopt::is_fallback;
use gltf::json::Root;
use std::collections::HashMap;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::rc::Rc;

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

/// The bytes of a buffer. Buffers of one file share them.
#[derive(Clone, Debug)]
pub(super) enum Bytes<'a> {
    Chunk(&'a [u8]),
    Read(Rc<Vec<u8>>),
}

impl Deref for Bytes<'_> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::Chunk(bytes) => bytes,
            Self::Read(bytes) => bytes,
        }
    }
}

/// The bytes of every buffer, each at least as long as it says, and a file no longer but for padding.
pub(super) fn load_buffers<'a>(
    root: &Root,
    chunk: Option<&'a [u8]>,
    folder: &Path,
) -> Result<Vec<Bytes<'a>>, Reason> {
    let mut known = HashMap::new();
    let load = |(index, buffer): (usize, &gltf::json::Buffer)| {
        if is_fallback(buffer) {
            return Ok(Bytes::Chunk(&[]));
        }
        let want = buffer.byte_length.0;
        let bytes = match &buffer.uri {
            Some(uri) => shared(&mut known, uri, folder, want).map_err(|e| format!("buffer {index}: {e}"))?,
            None if index == 0 && chunk.is_some() => Bytes::Chunk(chunk.unwrap_or_default()),
            None => {
                return Err(format!("buffer {index} has neither a uri nor a binary chunk; export it again"));
            }
        };
        let have = bytes.len() as u64;
        if have < want {
            return Err(format!(
                "buffer {index} holds {have} bytes where {want} are announced; export it again"
            ));
        }
        Ok(bytes)
    };
    root.buffers.iter().enumerate().map(load).collect()
}

/// Reads a file once, by whatever names buffers call it.
fn shared<'a>(
    known: &mut HashMap<PathBuf, Rc<Vec<u8>>>,
    uri: &str,
    folder: &Path,
    want: u64,
) -> Result<Bytes<'a>, Reason> {
    let most = want.saturating_add(PADDING - 1);
    if is_data(uri) {
        return Ok(Bytes::Read(Rc::new(load_uri(uri, folder, most)?)));
    }
    let path = locate(uri, folder)?;
    if let Some(bytes) = known.get(&path) {
        return Ok(Bytes::Read(Rc::clone(bytes)));
    }
    let bytes = Rc::new(load_uri(uri, folder, most)?);
    known.insert(path, Rc::clone(&bytes));
    Ok(Bytes::Read(bytes))
}
