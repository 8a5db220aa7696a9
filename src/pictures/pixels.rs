//! PNG, JPEG and WebP.

use std::io::Cursor;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Bytes that decoders may take beside the pixels.
const WORKING: usize = 1 << 29;

/// A decoded image.
pub(crate) struct Pixels {
    pub width: u32,
    pub height: u32,
    /// Of each one to four: grey, grey and alpha, red green blue, or with alpha; as stored, row by row from the top.
    pub channels: Vec<u8>,
    /// Bytes of a channel: 1, or 2 with the higher one first.
    pub depth: usize,
}

impl Pixels {
    /// Decodes a PNG, JPEG or WebP file of at most so many pixels, 8 bits a channel. Err: why not.
    pub fn decode(bytes: &[u8], most: u64) -> Result<Self, String> {
        Self::decode_as(bytes, most, png::Transformations::STRIP_16)
    }

    /// The same with 16 bits a channel where it has them.
    pub fn decode_deep(bytes: &[u8], most: u64) -> Result<Self, String> {
        Self::decode_as(bytes, most, png::Transformations::IDENTITY)
    }

    fn decode_as(bytes: &[u8], most: u64, depth: png::Transformations) -> Result<Self, String> {
        match bytes {
            [0x89, b'P', b'N', b'G', ..] => png(bytes, most, depth),
            [0xFF, 0xD8, 0xFF, ..] => jpeg(bytes, most),
            [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => webp(bytes, most),
            _ => Err("neither PNG, JPEG nor WebP".into()),
        }
    }
}

fn check_size(width: u32, height: u32, most: u64) -> Result<usize, String> {
    let pixels = u64::from(width) * u64::from(height);
    if pixels <= most { Ok(pixels as usize) } else { Err(format!("{width}x{height} pixels are too many")) }
}

fn png(bytes: &[u8], most: u64, depth: png::Transformations) -> Result<Pixels, String> {
    let limits = png::Limits { bytes: WORKING };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_transformations(png::Transformations::EXPAND | depth);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info().map_err(|e| format!("damaged: {e}"))?;
    let (width, height) = (reader.info().width, reader.info().height);
    check_size(width, height, most)?;
    let mut raw = vec![0; reader.output_buffer_size().ok_or("too many pixels")?];
    let frame = reader.next_frame(&mut raw).map_err(|e| format!("damaged: {e}"))?;
    raw.truncate(frame.buffer_size());
    if frame.color_type == png::ColorType::Indexed {
        return Err("damaged: its palette is missing".into());
    }
    let depth = if frame.bit_depth == png::BitDepth::Sixteen { 2 } else { 1 };
    Ok(Pixels { width, height, channels: raw, depth })
}

fn jpeg(bytes: &[u8], most: u64) -> Result<Pixels, String> {
    let options = DecoderOptions::default()
        .jpeg_set_out_colorspace(ColorSpace::RGB)
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX));
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(|e| format!("damaged: {e}"))?;
    let info = decoder.info().ok_or("damaged: it has no size")?;
    let (width, height) = (u32::from(info.width), u32::from(info.height));
    let pixels = check_size(width, height, most)?;
    let raw = decoder.decode().map_err(|e| format!("damaged: {e}"))?;
    if raw.len() != 3 * pixels {
        return Err("its colours are not RGB".into());
    }
    Ok(Pixels { width, height, channels: raw, depth: 1 })
}

fn webp(bytes: &[u8], most: u64) -> Result<Pixels, String> {
    let mut decoder =
        image_webp::WebPDecoder::new(Cursor::new(bytes)).map_err(|e| format!("damaged: {e}"))?;
    let (width, height) = decoder.dimensions();
    check_size(width, height, most)?;
    decoder.set_memory_limit(WORKING);
    let mut raw = vec![0; decoder.output_buffer_size().ok_or("too many pixels")?];
    decoder.read_image(&mut raw).map_err(|e| format!("damaged: {e}"))?;
    Ok(Pixels { width, height, channels: raw, depth: 1 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_image_or_too_large_is_an_error() {
        assert!(Pixels::decode(b"", 100).is_err_and(|e| e.contains("neither")));
        assert!(Pixels::decode(b"\x89PNG\r\n\x1a\n", 100).is_err_and(|e| e.contains("damaged")));
        assert!(Pixels::decode(b"\xFF\xD8\xFF\xE0", 100).is_err_and(|e| e.contains("damaged")));
        assert!(Pixels::decode(b"RIFF\x04\0\0\0WEBP", 100).is_err_and(|e| e.contains("damaged")));
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, 20, 10);
        encoder.set_color(png::ColorType::Grayscale);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[7; 200]).unwrap();
        drop(writer);
        assert!(Pixels::decode(&file, 199).is_err_and(|e| e.contains("too many")));
        let pixels = Pixels::decode(&file, 200).unwrap();
        assert_eq!((pixels.width, pixels.height, pixels.channels), (20, 10, vec![7; 200]));
    }
}
