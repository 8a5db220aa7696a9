//! Matter: scalar lobes, one file each, and [`Bsdf`], the sum of coefficient matrix × lobe.
//!
//! Every direction is a unit vector that points *away* from the surface. `from` is where the walk came from and `to` where
//! it goes on; shooting walks from the luminaire (`from` is the field's wi), gathering from the camera (`from` is wo). Lobe
//! values are BSDFs in sr⁻¹ without the cosine.
//!
//! Shading normals decide cosines and directions, geometric normals sides. Where the two disagree no light is lost: in
//! gathering, every lobe passes on exactly what its albedo says, for all directions from which it can be seen; shooting is
//! the exact adjoint of that. As always with shading normals, what is shot may then be more or less than what arrived for
//! single directions, but no multiplication factor exceeds the largest albedo.

mod albedo;
mod anisotropic;
mod bsdf;
mod dielectric;
mod diffuse;
mod film;
mod fresnel;
mod glossy;
mod interface;
mod layers;
mod microfacet;
mod mirror;
mod normals;
mod rough;
mod rough_dielectric;
mod rough_thin;
mod sheen;
mod smooth;
mod thin_dielectric;
mod translucent;

pub use bsdf::{Bsdf, Lobe, Term};
pub use dielectric::Dielectric;
pub use diffuse::Diffuse;
pub use film::Film;
pub use fresnel::{dispersed, fresnel_dielectric, refract};
pub use glossy::Glossy;
pub use layers::{Clear, Layers, Velvet};
pub use mirror::Mirror;
pub use normals::Normals;
pub use rough_dielectric::RoughDielectric;
pub use rough_thin::RoughThin;
pub use sheen::Sheen;
pub use thin_dielectric::ThinDielectric;
pub use translucent::Translucent;

use glam::Vec3;

/// What the walk carries, which decides two factors that are not symmetric.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// Power from a luminaire: shading normals need their adjoint factor, refraction none.
    Shooting,
    /// A row from the camera, which reads radiance: refraction scales by η², shading normals need no factor.
    Gathering,
}

/// How likely a direction is: in which measure depends on the lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pdf {
    /// The probability of one of the single directions of a delta lobe.
    Delta(f32),
    /// The density over directions of a finite lobe, sr⁻¹.
    SolidAngle(f32),
}

impl Pdf {
    /// The number, whatever it measures: what `weight` was divided by.
    pub fn value(self) -> f32 {
        match self {
            Self::Delta(p) | Self::SolidAngle(p) => p,
        }
    }

    /// The density over directions, sr⁻¹. None where directions are single.
    pub fn solid_angle(self) -> Option<f32> {
        match self {
            Self::Delta(_) => None,
            Self::SolidAngle(density) => Some(density),
        }
    }
}

/// One sampled direction of one lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Unit direction in which the walk goes on, away from the surface.
    pub to: Vec3,
    /// What the carried power or row is multiplied by: `f |cos| / pdf` (delta lobes: their weight / probability),
    /// with the factors of [`Transport`] included.
    pub weight: Vec3,
    /// How likely `to` was.
    pub pdf: Pdf,
    /// True where a delta lobe turned the walk about the geometric normal, because about the shading normal it would
    /// have gone to the wrong side.
    pub geometric: bool,
}
