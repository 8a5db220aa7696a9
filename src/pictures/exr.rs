//! OpenEXR: whether a file can be opened at all.

use ::exr::prelude::{Compression, MetaData};
use std::io::{Read, Seek};

/// The header of an EXR file that `there` bytes hold, where its pixels fit into memory `decoded` times over; the file is rewound.
///
/// A damaged or hostile header can ask for any amount of memory, and a failed allocation would end the process.
pub(crate) fn check_exr(file: &mut (impl Read + Seek), there: u64, decoded: u64) -> Result<MetaData, String> {
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
    match bytes {
        Some(bytes) if bytes / MOST_COMPRESSED > there => {
            Err("its header announces more pixels than so short a file can hold; the file is damaged".into())
        }
        Some(bytes) if !is_had(bytes.saturating_mul(decoded)) => Err(format!(
            "its {bytes} bytes of pixels take more memory than there is; make it smaller or free some memory"
        )),
        Some(_) => Ok(meta),
        None => Err("its header asks for more memory than there is; the file is damaged".into()),
    }
}

/// No compression but DWA packs so many bytes into one: deflate, which ZIP and PXR24 rest on, packs 1032, and PXR24 has left
/// out a fourth of the bytes before.
const MOST_COMPRESSED: u64 = 1400;

/// The decoder of these believes sizes in the file before it allocates, and ends the process.
fn is_dwa(compression: Compression) -> bool {
    matches!(compression, Compression::DWAA(_) | Compression::DWAB(_))
}

fn is_had(bytes: u64) -> bool {
    let fits = usize::try_from(bytes).is_ok_and(|n| Vec::<u8>::new().try_reserve_exact(n).is_ok());
    fits && crate::machine::memory().is_none_or(|left| bytes <= left.bytes)
}
