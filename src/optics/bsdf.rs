use super::{
    Dielectric, Diffuse, Glossy, Mirror, Normals, Pdf, RoughDielectric, RoughThin, Sample, Sheen,
    ThinDielectric, Translucent, Transport,
};
use super::{rough, smooth};
use crate::light::{Matrix, Power, Row, Turn};
use glam::Vec3;

/// A scalar lobe (RGB), everything but the straight one: the paper's f_opaque is a sum of these.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Lobe {
    /// Lambert's reflector.
    Diffuse(Diffuse),
    /// A smooth mirror.
    Mirror(Mirror),
    /// A smooth interface of a solid.
    Dielectric(Dielectric),
    /// A smooth thin pane.
    ThinDielectric(ThinDielectric),
    /// A rough mirror.
    Glossy(Glossy),
    /// A rough interface of a solid.
    RoughDielectric(RoughDielectric),
    /// A rough thin pane.
    RoughThin(RoughThin),
    /// Fibres that stand up.
    Sheen(Sheen),
    /// Lambert's law on the other side.
    Translucent(Translucent),
}

impl Lobe {
    /// True for lobes that send light into single directions: [`eval`](Self::eval) is zero, only sampling sees them.
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Mirror(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => true,
            Self::RoughDielectric(lobe) => lobe.is_nothing(),
            Self::Diffuse(_)
            | Self::Glossy(_)
            | Self::RoughThin(_)
            | Self::Sheen(_)
            | Self::Translucent(_) => false,
        }
    }

    /// The lobe as a diffuse reflector, if it is one: what needs no direction of the light once it has
    /// [arrived](Diffuse::arrival), so that a photon map serves it.
    pub fn as_diffuse(&self) -> Option<&Diffuse> {
        match self {
            Self::Diffuse(lobe) => Some(lobe),
            Self::Mirror(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => None,
            Self::Glossy(_) | Self::RoughDielectric(_) | Self::RoughThin(_) => None,
            Self::Sheen(_) | Self::Translucent(_) => None,
        }
    }

    /// True for Lambert's reflector with nothing above it: closed forms of irradiance serve it.
    pub fn is_lambert(&self) -> bool {
        self.as_diffuse().is_some_and(|lobe| lobe.under.is_none())
    }

    /// BSDF value in sr⁻¹ of light from `to` that is seen from `from` (as radiance: through an interface it scales by η²),
    /// cosine not included; symmetric where the two normals are the same and nothing is refracted. Zero for delta lobes.
    pub fn eval(&self, normals: &Normals, from: Vec3, to: Vec3) -> Vec3 {
        match self {
            Self::Diffuse(lobe) => lobe.eval(normals, from, to),
            Self::Translucent(lobe) => lobe.eval(normals, from, to),
            Self::Glossy(lobe) => rough::eval(lobe, normals, from, to),
            Self::RoughDielectric(lobe) if !lobe.is_nothing() => rough::eval(lobe, normals, from, to),
            Self::RoughThin(lobe) => rough::eval(lobe, normals, from, to),
            Self::Sheen(lobe) => rough::eval(lobe, normals, from, to),
            Self::RoughDielectric(_) | Self::Mirror(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => {
                Vec3::ZERO
            }
        }
    }

    /// Density in solid angle with which [`sample`](Self::sample) chooses `to` where light is gathered. Zero for delta
    /// lobes.
    pub fn pdf(&self, normals: &Normals, from: Vec3, to: Vec3) -> f32 {
        match self {
            Self::Diffuse(lobe) => lobe.pdf(normals, from, to),
            Self::Translucent(lobe) => lobe.pdf(normals, from, to),
            Self::Glossy(lobe) => rough::pdf(lobe, normals, from, to),
            Self::RoughDielectric(lobe) if !lobe.is_nothing() => rough::pdf(lobe, normals, from, to),
            Self::RoughThin(lobe) => rough::pdf(lobe, normals, from, to),
            Self::Sheen(lobe) => rough::pdf(lobe, normals, from, to),
            Self::RoughDielectric(_) | Self::Mirror(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => 0.0,
        }
    }

    /// A direction to go on in, from three numbers in [0, 1). None: the walk ends here (absorbed).
    pub fn sample(&self, normals: &Normals, from: Vec3, transport: Transport, u: [f32; 3]) -> Option<Sample> {
        match self {
            Self::Diffuse(lobe) => lobe.sample(normals, from, transport, u),
            Self::Translucent(lobe) => lobe.sample(normals, from, transport, u),
            Self::Glossy(lobe) => rough::sample(lobe, normals, from, transport, u),
            Self::RoughDielectric(lobe) if !lobe.is_nothing() => {
                rough::sample(lobe, normals, from, transport, u)
            }
            Self::RoughThin(lobe) => rough::sample(lobe, normals, from, transport, u),
            Self::Sheen(lobe) => rough::sample(lobe, normals, from, transport, u),
            Self::RoughDielectric(_) | Self::Mirror(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => {
                smooth::choose(self.branches(normals, from, transport), u[2])
            }
        }
    }

    /// All branches of a delta lobe, each as [`sample`](Self::sample) gives it when chance falls on it; the sum of
    /// `weight` times the probability is what the lobe passes on. None for finite lobes.
    pub fn branches(&self, normals: &Normals, from: Vec3, transport: Transport) -> [Option<Sample>; 4] {
        match self {
            _ if !self.is_delta() || !self.responds(normals, from) => [None; 4],
            Self::Mirror(lobe) => smooth::branches(lobe, normals, from, transport),
            // Nothing is there that could bend light or reflect it, whatever the normals are.
            Self::Dielectric(Dielectric { ior: 1.0, tint })
            | Self::RoughDielectric(RoughDielectric { tint, .. }) => {
                let straight = Sample { to: -from, weight: *tint, pdf: Pdf::Delta(1.0), geometric: true };
                [Some(straight), None, None, None]
            }
            Self::Dielectric(lobe) => smooth::branches(lobe, normals, from, transport),
            Self::ThinDielectric(lobe) => smooth::branches(lobe, normals, from, transport),
            Self::Diffuse(_)
            | Self::Glossy(_)
            | Self::RoughThin(_)
            | Self::Sheen(_)
            | Self::Translucent(_) => [None; 4],
        }
    }

    /// What the lobe reflects as a picture of materials shows it, linear RGB.
    pub fn albedo(&self) -> Vec3 {
        match self {
            Self::Diffuse(Diffuse { albedo, under: Some(layers), .. }) => layers.average() * *albedo,
            Self::Translucent(Translucent { colour, under: Some(layers) }) => layers.average() * *colour,
            Self::Glossy(lobe) => lobe.average(),
            Self::Sheen(lobe) => Sheen::average(lobe.alpha) * lobe.colour,
            Self::Mirror(lobe) => lobe.average(),
            _ => self.bound(),
        }
    }

    /// An estimate of what the lobe passes on of light from `from`, linear RGB, to weigh choices among lobes: above zero
    /// wherever anything is scattered.
    pub fn share(&self, normals: &Normals, from: Vec3) -> Vec3 {
        match self {
            Self::Diffuse(lobe) if lobe.under.is_some() => lobe.share(normals, from),
            Self::Translucent(lobe) if lobe.under.is_some() => lobe.turned().share(normals, from),
            Self::Glossy(lobe) => lobe.share(normals, from),
            Self::Sheen(lobe) => lobe.share(normals, from),
            Self::Mirror(lobe) => lobe.share(normals, from),
            _ => self.bound(),
        }
    }

    /// How rough the lobe is, as a material says it: the square root of the (smaller) α. None for lobes that have none: delta
    /// lobes, and those that follow Lambert.
    pub fn roughness(&self) -> Option<f32> {
        match self {
            Self::Glossy(lobe) => Some(lobe.alpha[0].min(lobe.alpha[1]).sqrt()),
            Self::RoughDielectric(lobe) if !lobe.is_nothing() => Some(lobe.alpha.sqrt()),
            Self::RoughThin(lobe) => Some(lobe.alpha.sqrt()),
            Self::Sheen(lobe) => Some(lobe.alpha.sqrt()),
            Self::Diffuse(_) | Self::Translucent(_) | Self::RoughDielectric(_) => None,
            Self::Mirror(_) | Self::Dielectric(_) | Self::ThinDielectric(_) => None,
        }
    }

    /// An upper bound of the reflectance for light of any direction, shading normals aside; linear RGB. It weighs choices, bounds
    /// k, and is zero only where nothing is reflected.
    pub fn bound(&self) -> Vec3 {
        match self {
            Self::Diffuse(lobe) => lobe.albedo,
            Self::Mirror(lobe) => lobe.bound(),
            Self::Dielectric(_) | Self::ThinDielectric(_) => Vec3::ONE,
            Self::RoughDielectric(_) | Self::RoughThin(_) => Vec3::ONE,
            Self::Glossy(lobe) => lobe.bound(),
            Self::Sheen(lobe) => lobe.colour,
            Self::Translucent(lobe) => lobe.colour,
        }
    }

    /// True where the back scatters too.
    pub fn is_two_sided(&self) -> bool {
        match self {
            Self::Diffuse(lobe) => lobe.two_sided,
            Self::Mirror(lobe) => lobe.two_sided,
            Self::Glossy(lobe) => lobe.two_sided,
            Self::Sheen(lobe) => lobe.two_sided,
            Self::RoughDielectric(_) | Self::RoughThin(_) | Self::Translucent(_) => true,
            Self::Dielectric(_) | Self::ThinDielectric(_) => true,
        }
    }

    /// True where light from `from` may be scattered at all: the backs of one-sided lobes are dark.
    pub fn responds(&self, normals: &Normals, from: Vec3) -> bool {
        self.is_two_sided() || normals.is_front(from)
    }
}

/// A lobe of less roughness than this makes caustics, and is seen by the light that it gathers in a few directions.
const NARROW: f32 = 0.25;

impl Lobe {
    /// True for what is neither a delta lobe nor read from a photon map: camera paths go on by it in one direction that they choose,
    /// and it is connected to luminaires beside.
    pub fn is_glossy(&self) -> bool {
        !self.is_delta() && self.as_diffuse().is_none()
    }

    /// True for the interface of a solid: the body is behind its back.
    pub fn is_solid(&self) -> bool {
        matches!(self, Self::Dielectric(_) | Self::RoughDielectric(_))
    }

    /// True for lobes so narrow that what they reflect of a small luminaire is a caustic.
    pub fn is_narrow(&self) -> bool {
        self.is_delta() || self.roughness().is_some_and(|roughness| roughness < NARROW)
    }
}

/// One term of a matrix BSDF: `coefficient × lobe`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term {
    /// How the lobe turns each incoming half into each outgoing half.
    pub coefficient: Matrix,
    /// Where it sends light, and how much of each colour that arrives.
    pub lobe: Lobe,
    /// As which colours that leaves: the blocks beside the diagonal of paper eq. 17.
    pub turn: Turn,
}

impl Term {
    /// A term that leaves colours what they are.
    pub fn new(coefficient: Matrix, lobe: Lobe) -> Self {
        Self { coefficient, lobe, turn: Turn::NONE }
    }

    /// What a row that reads light which leaves by this term reads of light that arrives, but for what the lobe keeps of it.
    #[inline(always)]
    pub fn before(&self, row: Row) -> Row {
        row.before(self.turn) * self.coefficient
    }

    /// What leaves of power that arrives, of which the lobe keeps `weight`.
    #[inline(always)]
    pub fn after<P: Power>(&self, power: P, weight: Vec3) -> P {
        power.through(self.coefficient).filtered(weight).turned(self.turn)
    }
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

    /// What power that arrives from `wi` counts for where it is read without its direction: the share that layers above Lambert's
    /// lobes let through. They are the same over all of them.
    #[inline(always)]
    pub fn arrival(&self, normals: &Normals, wi: Vec3) -> f32 {
        let mut read = self.terms.iter().filter_map(|term| term.lobe.as_diffuse());
        read.next().map_or(1.0, |lobe| lobe.arrival(normals, wi))
    }

    /// True when camera rays go on by some term: a delta lobe, or a glossy one.
    pub fn is_passed_on(&self) -> bool {
        self.terms.iter().any(|term| term.lobe.as_diffuse().is_none())
    }

    /// True when some term is a delta lobe.
    pub fn has_delta_lobe(&self) -> bool {
        self.terms.iter().any(|term| term.lobe.is_delta())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What chance does with a lobe is, on the average, what its branches do for certain.
    #[test]
    fn branches_are_all_that_chance_can_find() {
        let tint = Vec3::new(0.9, 0.5, 0.2);
        let glass = |ior| Lobe::Dielectric(Dielectric { ior, tint });
        let pane = |ior| Lobe::ThinDielectric(ThinDielectric { ior, tint });
        let mirror = Lobe::Mirror(Mirror::plain(tint, true));
        let normals = Normals::flat(Vec3::Y);
        for lobe in [glass(1.5), glass(1.0), glass(0.7), pane(1.5), pane(1.0), mirror] {
            for (x, y) in [(0.0, 1.0), (0.5, 0.8), (0.99, 0.1), (0.3, -0.9), (0.9, -0.3)] {
                let from = Vec3::new(x, y, 0.0).normalize();
                for transport in [Transport::Shooting, Transport::Gathering] {
                    let branches = lobe.branches(&normals, from, transport);
                    let certain = branches.iter().flatten();
                    let (probability, weight) = certain.fold((0.0, Vec3::ZERO), |(p, w), sample| {
                        (p + sample.pdf.value(), w + sample.pdf.value() * sample.weight)
                    });
                    assert!((probability - 1.0).abs() < 1e-6, "{lobe:?} from {from}: {probability}");
                    let n = 20_000;
                    let by_chance: Vec3 = (0..n)
                        .filter_map(|i| {
                            lobe.sample(&normals, from, transport, [0.5, 0.5, (i as f32 + 0.5) / n as f32])
                        })
                        .map(|sample| sample.weight / n as f32)
                        .sum();
                    assert!(
                        (weight - by_chance).abs().max_element() < 1e-3,
                        "{lobe:?} from {from}: {weight}, {by_chance}"
                    );
                }
            }
        }
    }
}
