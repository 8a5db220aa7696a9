//! A hash of everything that decides the picture, field by field: the same on every machine and with every compiler. Every
//! struct is taken apart in full, so that a new field must be given a place here.

use super::material::Follows;
use super::{Backs, Camera, Emission, Luminaire, Material, Mesh, Projection, Scene, SpotCone, Surface};
use crate::light::{Light, Matrix};
use crate::optics::{
    Bsdf, Clear, Dielectric, Diffuse, Film, Glossy, Layers, Lobe, Mirror, RoughDielectric, RoughThin, Sheen,
    Term, ThinDielectric, Translucent, Velvet,
};
use glam::Vec3;

/// To be raised where the hash of a scene that has not changed is to change, because its picture does.
const VERSION: u32 = 1;

/// FNV-1a of 64 bits: G. Fowler, L. C. Noll, K.-P. Vo, D. Eastlake, "The FNV non-cryptographic hash algorithm".
/// Each byte maps states one to one, so one field that differs in value alone never goes unnoticed.
pub(crate) struct Fnv(pub u64);

impl Fnv {
    pub const EMPTY: Self = Self(0xcbf2_9ce4_8422_2325);

    pub fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}

/// What can be written as bytes in one way: numbers little-endian, lists after their length, variants after their number.
trait Fields {
    fn feed(&self, fnv: &mut Fnv);
}

/// The hash of all of `scene` that decides its picture.
pub(super) fn hash(scene: &Scene) -> u64 {
    let mut fnv = Fnv::EMPTY;
    (VERSION, scene).feed(&mut fnv);
    fnv.0
}

impl Fields for u32 {
    fn feed(&self, fnv: &mut Fnv) {
        fnv.bytes(&self.to_le_bytes());
    }
}

impl Fields for f32 {
    fn feed(&self, fnv: &mut Fnv) {
        self.to_bits().feed(fnv);
    }
}

impl Fields for bool {
    fn feed(&self, fnv: &mut Fnv) {
        u32::from(*self).feed(fnv);
    }
}

impl<T: Fields> Fields for &T {
    fn feed(&self, fnv: &mut Fnv) {
        (**self).feed(fnv);
    }
}

impl<T: Fields, const N: usize> Fields for [T; N] {
    fn feed(&self, fnv: &mut Fnv) {
        self.iter().for_each(|one| one.feed(fnv));
    }
}

impl<T: Fields> Fields for Vec<T> {
    fn feed(&self, fnv: &mut Fnv) {
        fnv.bytes(&(self.len() as u64).to_le_bytes());
        self.iter().for_each(|one| one.feed(fnv));
    }
}

impl<T: Fields> Fields for Option<T> {
    fn feed(&self, fnv: &mut Fnv) {
        self.is_some().feed(fnv);
        self.iter().for_each(|one| one.feed(fnv));
    }
}

impl<A: Fields, B: Fields> Fields for (A, B) {
    fn feed(&self, fnv: &mut Fnv) {
        self.0.feed(fnv);
        self.1.feed(fnv);
    }
}

impl Fields for Vec3 {
    fn feed(&self, fnv: &mut Fnv) {
        self.to_array().feed(fnv);
    }
}

impl Fields for Matrix {
    fn feed(&self, fnv: &mut Fnv) {
        self.rows().feed(fnv);
    }
}

/// Structs field by field, but for those after the semicolon, which decide nothing.
macro_rules! fields {
    ($($name:ident { $($field:ident),+ $(; $($rest:ident),+)? })+) => {$(
        impl Fields for $name {
            fn feed(&self, fnv: &mut Fnv) {
                let Self { $($field),+ $(, $($rest: _),+)? } = self;
                $($field.feed(fnv);)+
            }
        }
    )+};
}

fields! {
    // The default illumination has become the materials' matrices.
    Scene { mesh, surfaces, materials, luminaires, camera; name, origin, illumination, notes }
    Mesh { positions, normals, triangles, surface }
    Surface { material, smooth, closed; name }
    // The lobes and what the material has of its own have become its BSDF; what follows the scene's point, an atlas keeps apart.
    Material { emission, backs, bsdf, follows; name, lobes, illumination, opaque, straight, resolved }
    Emission { radiance, two_sided }
    Follows { s, t }
    Bsdf { straight, terms }
    Term { coefficient, lobe }
    Glossy { f0, f90, alpha, tangent, two_sided, film, under }
    Film { ior, thickness, factor }
    Clear { f0, f90, alpha }
    RoughDielectric { ior, alpha, tint }
    RoughThin { ior, alpha, tint }
    Sheen { colour, alpha, two_sided }
    Translucent { colour, under }
    Layers { clear, coat, sheen; average }
    Velvet { weight, alpha }
    Light { invisible, visible }
    SpotCone { inner, outer }
    Camera { position, right, up, forward, projection, aspect }
}

impl Fields for Backs {
    fn feed(&self, fnv: &mut Fnv) {
        let tag: u32 = match self {
            Self::Seen => 0,
            Self::Unseen => 1,
        };
        tag.feed(fnv);
    }
}

impl Fields for Lobe {
    fn feed(&self, fnv: &mut Fnv) {
        match self {
            Self::Diffuse(Diffuse { albedo, two_sided, under: None }) => {
                (0_u32, (albedo, two_sided)).feed(fnv);
            }
            Self::Diffuse(Diffuse { albedo, two_sided, under: Some(layers) }) => {
                (5_u32, ((albedo, two_sided), layers)).feed(fnv);
            }
            Self::Mirror(Mirror { tint, two_sided }) => (1_u32, (tint, two_sided)).feed(fnv),
            Self::Dielectric(Dielectric { ior, tint }) => (2_u32, (ior, tint)).feed(fnv),
            Self::ThinDielectric(ThinDielectric { ior, tint }) => (3_u32, (ior, tint)).feed(fnv),
            Self::Glossy(lobe) => (4_u32, lobe).feed(fnv),
            Self::RoughDielectric(lobe) => (6_u32, lobe).feed(fnv),
            Self::RoughThin(lobe) => (7_u32, lobe).feed(fnv),
            Self::Sheen(lobe) => (8_u32, lobe).feed(fnv),
            Self::Translucent(lobe) => (9_u32, lobe).feed(fnv),
        }
    }
}

impl Fields for Luminaire {
    fn feed(&self, fnv: &mut Fnv) {
        match self {
            Self::Triangle { triangle, emission, area } => {
                (0_u32, (triangle, (emission, area))).feed(fnv);
            }
            Self::Point { position, intensity } => (1_u32, (position, intensity)).feed(fnv),
            Self::Spot { position, direction, intensity, cone } => {
                (2_u32, ((position, direction), (intensity, cone))).feed(fnv);
            }
            Self::Warn { position, direction, intensity, exponent, attenuation } => {
                (3_u32, ((position, direction), (intensity, (exponent, attenuation)))).feed(fnv);
            }
            Self::Directional { direction, irradiance } => (4_u32, (direction, irradiance)).feed(fnv),
        }
    }
}

impl Fields for Projection {
    fn feed(&self, fnv: &mut Fnv) {
        match self {
            Self::Perspective { yfov } => (0_u32, yfov).feed(fnv),
            Self::Orthographic { half_height } => (1_u32, half_height).feed(fnv),
        }
    }
}
