//! Packed geometry: what stands in for the bytes of buffer views and for the elements of accessors.

pub(super) mod draco;
pub(super) mod meshopt;

/// What is said of a packing that this program was built without, where nobody refused the file before.
#[cfg(not(all(feature = "draco", feature = "meshopt")))]
const LEFT_OUT: &str = "is packed in a way that this halflight was built without";
