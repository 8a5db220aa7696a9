//! A film in a file, to go on from and to add to others: docs/state-format.md.
//!
//! Sums are stored as they are, bit for bit; the same passes of the same render make the same sums, wherever they were rendered.

mod annex;
mod bits;
mod head;
mod read;
#[cfg(test)]
mod tests;
mod write;

pub use annex::AnnexFile;
pub(super) use bits::{Reader as BitReader, Writer as BitWriter, width_of};
pub use head::{Annex, Key, StateHead};
pub use read::StateFile;
pub use write::{AnnexRows, write_state, write_state_with};

/// What a file of ours begins with.
pub const MAGIC: &[u8; 16] = b"halflight-state\n";
/// Of the format.
const VERSION: u32 = 3;
/// The longest head that is read, in bytes: some hundred thousand runs of passes.
const LONGEST_HEAD: u32 = 1 << 24;

/// FNV-1a of 64 bits: G. Fowler, L. C. Noll, K.-P. Vo, D. Eastlake, "The FNV non-cryptographic hash algorithm". A byte that
/// differs never goes unnoticed.
fn checksum(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |sum, byte| (sum ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3))
}

/// What the numbers of a row have in common. A number's top is the exponent behind the last bit of its magnitude: tops of a row differ
/// little, its numbers being alike in size, and lengths do not, as some numbers happen to end in zeros.
struct Common {
    /// The lowest exponent.
    lowest: i32,
    /// The lowest top.
    lowest_top: i32,
    /// Bits of an exponent, less the lowest.
    exponents: u32,
    /// Bits of a top, less the lowest and plus one.
    tops: u32,
    /// 1: each number has a bit for its sign. 0: none is below zero.
    signs: u32,
}

/// Bits of either lowest.
const LOWEST: u32 = 16;
/// Bits of either width.
const WIDTH: u32 = 4;
/// What is no finite number has the top that all bits of the width make, and one of these after it.
const INFINITE: u32 = 0;
const MINUS_INFINITE: u32 = 1;
const NOT_A_NUMBER: u32 = 2;
const SPECIAL: u32 = 2;
/// The longest magnitude, in bits.
const LONGEST: u32 = 8 * 112;

/// The top that says that a number is not finite.
fn special(width: u32) -> u32 {
    (1 << width) - 1
}
