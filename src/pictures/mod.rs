//! Picture files, which come from strangers: decoded within bounds of size and memory.

mod exr;
mod pixels;
mod radiance;

pub(crate) use exr::check_exr;
pub(crate) use pixels::Pixels;
pub(crate) use radiance::Radiance;
