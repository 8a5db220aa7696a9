//! Photons: what is shot, kept and gathered, how light came there, and where its power went.

use crate::scene::Material;
use glam::Vec3;

/// How light came to where it was deposited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathClass {
    /// Straight from the luminaire (through any number of surfaces).
    Direct = 0,
    /// Through delta lobes only.
    Caustic = 1,
    /// Through at least one finite lobe.
    Indirect = 2,
}

impl PathClass {
    /// All of them, by their numbers.
    pub const ALL: [Self; 3] = [Self::Direct, Self::Caustic, Self::Indirect];
}

/// Light that arrived at a surface.
///
/// `D` is what is kept of the direction that it came from: nothing, as a rule.
#[derive(Clone, Copy, Debug)]
pub struct Photon<P, D = ()> {
    /// Where, scene space (m).
    pub position: Vec3,
    /// Power (W), times |wi·ns| / |wi·ng|. Where no direction is kept it is for Lambert's lobe, which does not ask for it, and times
    /// what layers above that let through.
    pub power: P,
    /// Geometric normal there, on the side the light came from, in 127ths: it is only asked for its side.
    pub normal: [i8; 3],
    /// How it is gathered: see [`level`](Self::level) and [`is_reradiated`](Self::is_reradiated).
    pub kind: u8,
    /// Reflections since the luminaire; the last number stands for all above it.
    pub reflections: u16,
    /// Powers of the scene's s and t in `power`; the last number stands for all above it.
    pub orders: Orders,
    /// Where it came from.
    pub from: D,
}

/// A direction in four bytes, within 10⁻⁴: a unit vector on an octahedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Way([i16; 2]);

impl Way {
    /// Of a unit vector.
    pub fn new(unit: Vec3) -> Self {
        let Vec3 { x, y, z } = unit / unit.abs().element_sum();
        let fold = |a: f32, b: f32| (1.0 - b.abs()).copysign(a);
        let [a, b] = if z >= 0.0 { [x, y] } else { [fold(x, y), fold(y, x)] };
        Self([a, b].map(|x| (x * 32767.0).round() as i16))
    }

    /// The unit vector.
    pub fn unit(self) -> Vec3 {
        let [a, b] = self.0.map(|x| f32::from(x) / 32767.0);
        let z = 1.0 - a.abs() - b.abs();
        let below = (-z).max(0.0);
        Vec3::new(a - below.copysign(a), b - below.copysign(b), z).normalize()
    }
}

/// Beside the level.
const RERADIATED: u8 = 0x80;

/// How often light was reflected (n) and went straight on (m) by matrices that follow the scene's point (s, t) of the
/// square: its power is proportional to sⁿ tᵐ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Orders {
    /// Reflections.
    pub n: u8,
    /// Straight crossings.
    pub m: u8,
}

impl Orders {
    /// After a reflection by `material`.
    pub fn reflected(self, material: &Material) -> Self {
        Self { n: self.n.saturating_add(u8::from(material.follows.s.is_some())), ..self }
    }

    /// After going straight through `material`.
    pub fn crossed(self, material: &Material) -> Self {
        Self { m: self.m.saturating_add(u8::from(material.follows.t.is_some())), ..self }
    }
}

impl<P> Photon<P> {
    /// A photon on the side of the unit vector `normal`.
    pub fn new(position: Vec3, normal: Vec3, power: P, reflections: u32) -> Self {
        let normal = (127.0 * normal).round().to_array().map(|x| x as i8);
        let reflections = u16::try_from(reflections).unwrap_or(u16::MAX);
        Self { position, power, normal, kind: 0, reflections, orders: Orders::default(), from: () }
    }

    /// With the unit direction that it came from.
    pub fn coming_from(self, wi: Vec3) -> Photon<P, Way> {
        let Self { position, power, normal, kind, reflections, orders, from: () } = self;
        Photon { position, power, normal, kind, reflections, orders, from: Way::new(wi) }
    }
}

impl<P: Copy> Photon<P, Way> {
    /// The same, whose direction is not asked for.
    pub fn without_direction(&self) -> Photon<P> {
        let Self { position, power, normal, kind, reflections, orders, from: _ } = *self;
        Photon { position, power, normal, kind, reflections, orders, from: () }
    }
}

impl<P, D> Photon<P, D> {
    /// Gathered with one of the [radii of caustics](crate::plan::Frame::caustic_radii), below 128.
    #[must_use]
    pub fn at_level(self, level: u8) -> Self {
        Self { kind: (self.kind & RERADIATED) | level, ..self }
    }

    /// Of light that was re-radiated on its way, or that was not.
    #[must_use]
    pub fn reradiated(self, reradiated: bool) -> Self {
        let level = self.level();
        Self { kind: if reradiated { RERADIATED | level } else { level }, ..self }
    }

    /// Which of the radii of caustics it is gathered with; zero for other light.
    pub fn level(&self) -> u8 {
        self.kind & !RERADIATED
    }

    /// True for light that some surface re-radiated on its way.
    pub fn is_reradiated(&self) -> bool {
        self.kind & RERADIATED != 0
    }

    /// The cosine between its normal and another, within about a hundredth.
    pub fn cos_to(&self, normal: Vec3) -> f32 {
        Vec3::from_array(self.normal.map(f32::from)).dot(normal) * (1.0 / 127.0)
    }
}

/// All photons of one pass, by [`PathClass`], each in the order of their paths.
#[derive(Clone, Debug)]
pub struct Photons<P> {
    /// Indexed by `PathClass as usize`.
    pub by_class: [Vec<Photon<P>>; 3],
    /// Caustics of what glares, once more for glossy lobes: with directions.
    pub glints: Vec<Photon<P, Way>>,
    /// Where the power went.
    pub ledger: Ledger,
}

/// The energy of the carried light of one pass, sums over paths and RGB of both halves, W.
///
/// `emitted + roulette + created = absorbed + escaped` holds to rounding; `roulette` has expectation zero.
/// In global matter `created` is zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ledger {
    /// Left luminaires.
    pub emitted: f64,
    /// Stayed at surfaces.
    pub absorbed: f64,
    /// Left the scene.
    pub escaped: f64,
    /// Added (or, below zero, taken) by Russian roulette.
    pub roulette: f64,
    /// Added at surfaces that send on more than they receive, and by non-physical falloff; also the scatter of
    /// choosing among several lobes, which expects as much `absorbed`.
    pub created: f64,
    /// Lines traced.
    pub lines: u64,
    /// Photons that arrived where they are deposited, thinned ones among them.
    pub deposits: u64,
}

impl Ledger {
    /// Adds what another part of a pass did.
    pub fn add(&mut self, other: &Self) {
        self.emitted += other.emitted;
        self.absorbed += other.absorbed;
        self.escaped += other.escaped;
        self.roulette += other.roulette;
        self.created += other.created;
        self.lines += other.lines;
        self.deposits += other.deposits;
    }
}

impl<P> Photons<P> {
    /// None at all.
    pub fn none() -> Self {
        let by_class = [Vec::new(), Vec::new(), Vec::new()];
        Self { by_class, glints: Vec::new(), ledger: Ledger::default() }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.by_class.iter().map(Vec::len).sum::<usize>() + self.glints.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::warp;

    #[test]
    fn directions_in_four_bytes_are_nearly_what_they_were() {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z];
        let around = (0..400).map(|i| warp::sphere([(i % 20) as f32 / 20.0, (i / 20) as f32 / 20.0]));
        for unit in axes.into_iter().chain(around) {
            let off = (Way::new(unit).unit() - unit).length();
            assert!(off < 1e-4, "{unit}: {off}");
        }
    }
}
