//! Who wrote a file: files of other programs are not replaced unless asked for.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// What stands in PNG and JPEG files of ours, and in the `generator` of our pages.
pub(super) const SIGNATURE: &str = "halflight";
/// Scale of our float maps, which have room for nothing else: −1 with as many digits as nobody else writes.
pub(super) const PFM_SCALE: &str = "-1.000000000000";
/// Headers lie within so much, that of an atlas of some hundred layers too.
const SEARCHED: u64 = 1 << 20;

/// True where a file says that we wrote it, or holds nothing. What is no file, as a pipe, is not ours.
///
/// # Errors
/// It cannot be read.
pub fn is_ours(path: &Path) -> io::Result<bool> {
    let mut beginning = Vec::new();
    // Asked before it is opened: a pipe would wait for somebody to write.
    if !std::fs::metadata(path)?.is_file() {
        return Ok(false);
    }
    File::open(path)?.take(SEARCHED).read_to_end(&mut beginning)?;
    Ok(beginning.is_empty() || signed(&beginning))
}

fn signed(bytes: &[u8]) -> bool {
    let holds = |mark: &[u8]| bytes.windows(mark.len()).any(|window| window == mark);
    if bytes.starts_with(b"\x76\x2f\x31\x01") {
        holds(super::write_exr::PREFIX.as_bytes())
    } else if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        holds(format!("Software\0{SIGNATURE}").as_bytes())
    } else if bytes.starts_with(b"\xff\xd8\xff") {
        holds(&[b"\xff\xfe\0\x0b", SIGNATURE.as_bytes()].concat())
    } else if bytes.starts_with(b"#?RADIANCE\n") {
        holds(format!("\nSOFTWARE={SIGNATURE}\n").as_bytes())
    } else if bytes.starts_with(b"PF\n") {
        bytes.split(|byte| *byte == b'\n').nth(2) == Some(PFM_SCALE.as_bytes())
    } else if bytes.starts_with(b"<!doctype html>") {
        holds(format!("<meta name=\"generator\" content=\"{SIGNATURE}\">").as_bytes())
    } else if bytes.starts_with(super::state::MAGIC) {
        true
    } else {
        bytes.starts_with(b"{") && holds(format!("\"program\": \"{SIGNATURE} ").as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Header, Image, write_image_exr, write_rgb_jpg, write_rgb_png};
    use glam::Vec3;

    #[test]
    fn what_we_write_is_ours_and_what_others_write_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let plane = vec![Vec3::ONE; 6];
        let file = |name: &str| folder.path().join(name);
        let layers = vec![("visible".to_owned(), plane.clone())];
        let header = Header::new().with("version", "1");
        write_image_exr(&file("a.exr"), &Image { width: 3, height: 2, layers, header }).unwrap();
        write_rgb_png(&file("a.png"), 3, 2, &plane, 0.0).unwrap();
        write_rgb_jpg(&file("a.jpg"), 3, 2, &plane, 0.0).unwrap();
        std::fs::write(file("empty"), b"").unwrap();
        for name in ["a.exr", "a.png", "a.jpg", "empty"] {
            assert!(is_ours(&file(name)).unwrap(), "{name}");
        }
        let mut png = Vec::new();
        png::Encoder::new(&mut png, 1, 1).write_header().unwrap().write_image_data(&[9]).unwrap();
        std::fs::write(file("b.png"), png).unwrap();
        let mut jpg = Vec::new();
        let encoder = jpeg_encoder::Encoder::new(&mut jpg, 90);
        encoder.encode(&[9; 3], 1, 1, jpeg_encoder::ColorType::Rgb).unwrap();
        std::fs::write(file("b.jpg"), jpg).unwrap();
        let pixel = |_: usize, _: usize| (0.0_f32, 0.0_f32, 0.0_f32);
        ::exr::prelude::write_rgb_file(file("b.exr"), 2, 2, pixel).unwrap();
        std::fs::write(file("b.txt"), b"halflight is mentioned").unwrap();
        for name in ["b.png", "b.jpg", "b.exr", "b.txt"] {
            assert!(!is_ours(&file(name)).unwrap(), "{name}");
        }
        assert!(is_ours(&file("missing")).is_err());
    }
}
