//! A hash of the pixels of each layer of EXR files: pictures that are equal bit for bit have equal lines.
//! `cargo run --release --example pixels -- a.exr b.exr`; benches/same-pixels.sh uses it to compare two builds.

use halflight::film::read_exr;

fn main() -> halflight::error::Result<()> {
    for file in std::env::args().skip(1) {
        for (name, pixels) in &read_exr(file.as_ref())?.layers {
            let bytes =
                pixels.iter().flat_map(|pixel| pixel.to_array().map(f32::to_bits)).flat_map(u32::to_le_bytes);
            let hash = bytes.fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
                (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
            });
            println!("{file} {name} {hash:016x}");
        }
    }
    Ok(())
}
