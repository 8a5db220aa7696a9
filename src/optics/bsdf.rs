use super::{Dielectric, Diffuse, Mirror, Normals, Sample, ThinDielectric, Transport};
use crate::light::Matrix;
use glam::Vec3;

/// A scalar lobe (RGB), everything but the straight one: the paper's f_opaque is a sum of these.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lobe {
    /// Lambert's reflector.
    Diffuse(Diffuse),
    /// A smooth mirror.
    Mirror(Mirror),
    /// A smooth interface of a solid.
    Dielectric(Dielectric),
    /// A smooth thin pane.
    ThinDielectric(ThinDielectric),
}

impl Lobe {
    /// True for lobes that send light into single directions: [`eval`](Self::eval) is zero, only sampling sees them.
    pub fn is_delta(&self) -> bool {
        !matches!(self, Self::Diffuse(_))
    }

    /// BSDF value in sr⁻¹, cosine not included; symmetric in its two directions. Zero for delta lobes.
    pub fn eval(&self, normals: &Normals, from: Vec3, to: Vec3) -> Vec3 {
        match self {
            Self::Diffuse(lobe) => lobe.eval(normals, from, to),
            Self::Mirror(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => Vec3::ZERO,
        }
    }

    /// Density in solid angle with which [`sample`](Self::sample) chooses `to`. Zero for delta lobes.
    pub fn pdf(&self, normals: &Normals, from: Vec3, to: Vec3) -> f32 {
        match self {
            Self::Diffuse(lobe) => lobe.pdf(normals, from, to),
            Self::Mirror(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => 0.0,
        }
    }

    /// A direction to go on in, from three numbers in [0, 1). None: the walk ends here (absorbed).
    pub fn sample(&self, normals: &Normals, from: Vec3, transport: Transport, u: [f32; 3]) -> Option<Sample> {
        match self {
            Self::Diffuse(lobe) => lobe.sample(normals, from, transport, u),
            Self::Mirror(lobe) => lobe.sample(normals, from, transport),
            Self::Dielectric(lobe) => lobe.sample(normals, from, transport, u[2]),
            Self::ThinDielectric(lobe) => lobe.sample(normals, from, transport, u[2]),
        }
    }

    /// An upper bound of the reflectance for light of any direction, shading normals aside; linear RGB.
    pub fn albedo(&self) -> Vec3 {
        match self {
            Self::Diffuse(lobe) => lobe.albedo,
            Self::Mirror(lobe) => lobe.tint,
            Self::Dielectric(_) | Self::ThinDielectric(_) => Vec3::ONE,
        }
    }

    /// True where the back scatters too.
    pub fn is_two_sided(&self) -> bool {
        match self {
            Self::Diffuse(lobe) => lobe.two_sided,
            Self::Mirror(lobe) => lobe.two_sided,
            Self::Dielectric(_) | Self::ThinDielectric(_) => true,
        }
    }

    /// True where light from `from` may be scattered at all: the backs of one-sided lobes are dark.
    pub fn responds(&self, normals: &Normals, from: Vec3) -> bool {
        self.is_two_sided() || normals.is_front(from)
    }
}

/// One term of a matrix BSDF: `coefficient × lobe`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term {
    /// How the lobe turns each incoming half into each outgoing half.
    pub coefficient: Matrix,
    /// Where it sends light.
    pub lobe: Lobe,
}

/// A matrix BSDF `F = C_straight f_transp + Σ C_k f_k` (paper eq. 14, 19, 21, 23 are its corners).
///
/// f_transp (paper eq. 4) is never evaluated: light that goes on along its own line is multiplied by `straight`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bsdf {
    /// What goes straight on, 2×2.
    pub straight: Matrix,
    /// What is scattered.
    pub terms: Vec<Term>,
}

impl Bsdf {
    /// True when some term is diffuse-like: photons deposited here can be seen by density estimation.
    pub fn has_finite_lobe(&self) -> bool {
        self.terms.iter().any(|term| !term.lobe.is_delta())
    }

    /// True when some term is a delta lobe: camera rays go on through it.
    pub fn has_delta_lobe(&self) -> bool {
        self.terms.iter().any(|term| term.lobe.is_delta())
    }
}
