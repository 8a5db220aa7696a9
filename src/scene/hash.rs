//! A hash of everything that decides the picture, field by field: the same on every machine and with every compiler. Every
//! struct is taken apart in full, so that a new field must be given a place here.

use super::material::Follows;
use super::texture::{Image, Sampler, Texture, Wrap};
use super::{
    Alpha, Anisotropy, Background, Backs, Camera, Emission, Environment, Factor, Lens, Luminaire, Material,
    Mesh, NormalMap, Pbr, Profile, Projection, Scene, SpotCone, Surface, VertexColours,
};
use crate::light::{Light, Matrix};
use crate::optics::{
    Bsdf, Clear, Dielectric, Diffuse, Film, Glossy, Layers, Lobe, Mirror, RoughDielectric, RoughThin, Sheen,
    Term, ThinDielectric, Translucent, Velvet,
};
use glam::{Affine2, Vec2, Vec3, Vec4};
use std::sync::Arc;

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

    /// Eight bytes at once, where there are many: another hash, of the same kind.
    pub fn word(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x0000_0100_0000_01b3);
        self.0 ^= self.0 >> 32;
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

impl Fields for u64 {
    fn feed(&self, fnv: &mut Fnv) {
        fnv.bytes(&self.to_le_bytes());
    }
}

impl<T: Fields> Fields for Arc<T> {
    fn feed(&self, fnv: &mut Fnv) {
        (**self).feed(fnv);
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

impl Fields for Vec2 {
    fn feed(&self, fnv: &mut Fnv) {
        self.to_array().feed(fnv);
    }
}

impl Fields for Vec4 {
    fn feed(&self, fnv: &mut Fnv) {
        self.to_array().feed(fnv);
    }
}

impl Fields for Affine2 {
    fn feed(&self, fnv: &mut Fnv) {
        self.to_cols_array().feed(fnv);
    }
}

/// That of a term that leaves colours what they are is what it was before others did not.
impl Fields for Term {
    fn feed(&self, fnv: &mut Fnv) {
        let Self { coefficient, lobe, turn } = self;
        (coefficient, lobe).feed(fnv);
        if turn.is_reradiated() {
            (MORE, turn.colours() as u32).feed(fnv);
        }
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
    Surface { material, smooth, closed; name }
    Pbr {
        base, alpha, coverage, vertex_colours, metallic, roughness, metallic_roughness, specular, specular_colour,
        transmission, translucence, translucent_colour, coat, coat_roughness, sheen, sheen_roughness, anisotropy, film,
        film_ior, film_thickness, film_texture, ior, solid,
        two_sided, unlit, emissive, emission, normal
    }
    Anisotropy { strength, rotation, texture }
    NormalMap { texture, scale }
    VertexColours { most, mean }
    Texture { image, sampler, set, transform }
    Sampler { wrap, linear }
    Emission { radiance, two_sided }
    Follows { s, t }
    Bsdf { straight, terms }
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
    Lens { radius, focus }
}

/// The default illumination has become the materials' matrices. That of a scene without an environment is what it was before there were any.
impl Fields for Scene {
    fn feed(&self, fnv: &mut Fnv) {
        let Self {
            mesh,
            surfaces,
            materials,
            luminaires,
            profiles,
            camera,
            environment,
            skies: _,
            name: _,
            origin: _,
            illumination: _,
            lit_by_studio: _,
            notes: _,
        } = self;
        (mesh, (surfaces, (materials, (luminaires, camera)))).feed(fnv);
        environment.iter().for_each(|environment| environment.feed(fnv));
        profiles.iter().for_each(|profile| profile.feed(fnv));
    }
}

impl Fields for Profile {
    fn feed(&self, fnv: &mut Fnv) {
        let (digest, axes) = self.parts();
        (MORE, (digest, axes.to_cols_array())).feed(fnv);
    }
}

impl Fields for Environment {
    fn feed(&self, fnv: &mut Fnv) {
        let (digest, strength, turn, background) = self.parts();
        (MORE, (strength, turn.to_cols_array())).feed(fnv);
        match background {
            Background::Same => 0_u32.feed(fnv),
            Background::Black => 1_u32.feed(fnv),
            Background::Colour(colour) => (2_u32, colour).feed(fnv),
        }
        digest.feed(fnv);
    }
}

impl Fields for Camera {
    fn feed(&self, fnv: &mut Fnv) {
        let Self { position, right, up, forward, projection, aspect, lens } = self;
        ((position, right), ((up, forward), (projection, aspect))).feed(fnv);
        // Pinholes came first, and keep their hashes.
        lens.iter().for_each(|lens| lens.feed(fnv));
    }
}

/// Goes before what not every scene has: as a count, or as a variant's number, it never comes.
const MORE: u64 = u64::MAX;

impl Fields for Mesh {
    /// That of a mesh without texture coordinates is what it was before there were any.
    fn feed(&self, fnv: &mut Fnv) {
        let Self { positions, normals, triangles, surface, uvs, colours, tangents } = self;
        ((positions, normals), (triangles, surface)).feed(fnv);
        if uvs.iter().any(|uvs| !uvs.is_empty()) || !colours.is_empty() || !tangents.is_empty() {
            (MORE, (uvs, (colours, tangents))).feed(fnv);
        }
    }
}

impl Fields for Material {
    /// The lobes and what the material has of its own have become its BSDF; what follows the scene's point, an atlas keeps apart.
    /// That of a material without textures is what it was before there were any.
    fn feed(&self, fnv: &mut Fnv) {
        let Self {
            name: _,
            lobes: _,
            pattern,
            illumination: _,
            opaque: _,
            straight: _,
            fluorescence: _,
            emission,
            backs,
            absorption,
            dispersion,
            covered: _,
            most: _,
            straight_there: _,
            bsdf,
            reflects,
            resolved: _,
            follows,
        } = self;
        ((emission, backs), (bsdf, follows)).feed(fnv);
        if let Some(pattern) = pattern {
            (MORE, (pattern, reflects)).feed(fnv);
        }
        if *absorption != Vec3::ZERO || *dispersion != 0.0 {
            (MORE, (absorption, dispersion)).feed(fnv);
        }
    }
}

impl<T: Fields> Fields for Factor<T> {
    fn feed(&self, fnv: &mut Fnv) {
        let Self { factor, texture } = self;
        (factor, texture).feed(fnv);
    }
}

impl Fields for Alpha {
    fn feed(&self, fnv: &mut Fnv) {
        match self {
            Self::Opaque => 0_u32.feed(fnv),
            Self::Mask(least) => (1_u32, least).feed(fnv),
            Self::Blend => 2_u32.feed(fnv),
        }
    }
}

impl Fields for Image {
    fn feed(&self, fnv: &mut Fnv) {
        self.content().feed(fnv);
    }
}

impl Fields for u8 {
    fn feed(&self, fnv: &mut Fnv) {
        fnv.bytes(&[*self]);
    }
}

impl Fields for Wrap {
    fn feed(&self, fnv: &mut Fnv) {
        let tag: u32 = match self {
            Self::Repeat => 0,
            Self::Mirrored => 1,
            Self::Clamp => 2,
        };
        tag.feed(fnv);
    }
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
            Self::Mirror(Mirror { tint, grazing, two_sided }) => {
                (1_u32, ((tint, grazing), two_sided)).feed(fnv);
            }
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
            Self::Triangle { triangle, part, emission, area } => {
                (0_u32, (triangle, (emission, area))).feed(fnv);
                // What shines alike came first, and keeps its hash.
                if let Some(part) = part {
                    (MORE, part.bits()).feed(fnv);
                }
            }
            Self::Point { position, intensity } => (1_u32, (position, intensity)).feed(fnv),
            Self::Spot { position, direction, intensity, cone } => {
                (2_u32, ((position, direction), (intensity, cone))).feed(fnv);
            }
            Self::Warn { position, direction, intensity, exponent, attenuation } => {
                (3_u32, ((position, direction), (intensity, (exponent, attenuation)))).feed(fnv);
            }
            Self::Directional { direction, irradiance } => (4_u32, (direction, irradiance)).feed(fnv),
            Self::Sun { direction, radiance, versine } => (5_u32, (direction, (radiance, versine))).feed(fnv),
            Self::Environment { fluence } => (6_u32, fluence).feed(fnv),
            Self::Profile { position, intensity, profile } => {
                (7_u32, (position, (intensity, profile))).feed(fnv);
            }
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
