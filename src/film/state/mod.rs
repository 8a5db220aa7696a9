//! A film in a file, to go on from and to add to others: docs/state-format.md.
//!
//! Sums are stored as they are, bit for bit; the same passes of the same render make the same sums, wherever they were rendered.

mod head;
mod read;
#[cfg(test)]
mod tests;
mod write;

pub use head::{Key, StateHead};
pub use read::StateFile;
pub use write::write_state;

/// What a file of ours begins with.
pub const MAGIC: &[u8; 16] = b"halflight-state\n";
/// Of the format.
const VERSION: u32 = 2;
/// The longest head that is read, in bytes: some hundred thousand runs of passes.
const LONGEST_HEAD: u32 = 1 << 24;

/// FNV-1a of 64 bits: G. Fowler, L. C. Noll, K.-P. Vo, D. Eastlake, "The FNV non-cryptographic hash algorithm". A byte that
/// differs never goes unnoticed.
fn checksum(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |sum, byte| (sum ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3))
}

/// What stands for a number that is not finite, or is zero.
const ZERO: u8 = 0;
const INFINITE: u8 = 1;
const MINUS_INFINITE: u8 = 2;
const NOT_A_NUMBER: u8 = 3;
/// A number of so many bytes is this plus how many; the topmost bit is its sign.
const BYTES: u8 = 3;
const NEGATIVE: u8 = 0x80;
/// An exponent that is as far from the row's lowest follows in full.
const FAR: u8 = 0xff;
/// The longest magnitude, in bytes.
const LONGEST: u8 = 112;
