//! Density estimation: one photon map for each class of paths, with its own radius.

use crate::light::Power;
use crate::photon_map::PhotonMap;
use crate::plan::Plan;
use crate::rims::Rims;
use crate::scene::SurfacePoint;
use crate::shoot::{PathClass, Photons};
use glam::Vec3;

/// How fast the radius shrinks from pass to pass: variance falls as passes^-α, bias as passes^(α−1).
/// 2/3 balances them. Knaus & Zwicker 2011, §4.2.
pub const ALPHA: f64 = 2.0 / 3.0;

/// r_pass / r_0 with r²_{i+1} / r²_i = (i + α) / (i + 1), i = 1, 2, … (Knaus & Zwicker 2011, eq. 20); `pass` counts
/// from zero. A function of the pass alone, so that any set of passes can be rendered anywhere.
pub fn radius_factor(pass: u32) -> f32 {
    /// So many factors are multiplied one by one.
    const FEW: u32 = 64;
    let product: f64 = (1..=pass.min(FEW)).map(f64::from).map(|i| (i + ALPHA) / (i + 1.0)).product();
    // The product up to n is Γ(n+1+α) / Γ(n+2) times a constant, and Γ(z+a) / Γ(z+b) = (z + (a+b−1)/2)^(a−b) (1 + O(z⁻²)):
    // a pass late in a long render takes no longer than its first.
    let place = |n: u32| f64::from(n) + 1.0 + 0.5 * ALPHA;
    let beyond = (place(pass.max(FEW)) / place(FEW)).powf(ALPHA - 1.0);
    (product * beyond).sqrt() as f32
}

/// Irradiance (W m⁻²) by density estimation.
#[derive(Clone, Copy, Debug, Default)]
pub struct Irradiance<P> {
    /// The estimate.
    pub value: P,
    /// An estimate of its bias, as noisy: 2 (E(r) − E(r/2)). Right where the bias is linear in the radius, as near
    /// rims and shadows, and 3/2 of it where it is quadratic, as where light varies smoothly.
    pub bias: P,
}

/// The maps of one pass.
pub struct Maps<'a, P> {
    rims: &'a Rims,
    by_class: [PhotonMap<P>; 3],
    /// Gather radius of inter-reflection and direct light in pixel footprints.
    wide: f32,
    /// Gather radius of caustics in pixel footprints.
    sharp: f32,
}

impl<'a, P: Power> Maps<'a, P> {
    /// Builds a map of each class of photons for the radius of `pass`.
    pub fn build(photons: Photons<P>, plan: &'a Plan, pass: u32) -> Self {
        let Plan { settings, rims, .. } = plan;
        let shrink = radius_factor(pass);
        let (wide, sharp) = (settings.indirect_radius * shrink, settings.caustic_radius * shrink);
        Self { rims, by_class: photons.by_class.map(PhotonMap::build), wide, sharp }
    }

    /// Irradiance (W m⁻²) by light of each class, by [`PathClass`], that arrives on the side of `normal` after no more
    /// than `most_reflections`; `footprint` is the side of what a pixel covers there (m).
    pub fn irradiance(
        &self,
        point: &SurfacePoint,
        normal: Vec3,
        footprint: f32,
        most_reflections: u16,
    ) -> [Irradiance<P>; 3] {
        if self.by_class.iter().all(PhotonMap::is_empty) {
            return [Irradiance::default(); 3];
        }
        let [wide, sharp] = [self.wide, self.sharp].map(|radius| radius * footprint);
        let [wide_area, sharp_area, wide_half, sharp_half] =
            self.rims.areas(point.position, normal, [wide, sharp, 0.5 * wide, 0.5 * sharp]);
        let disks =
            [(wide, wide_area, wide_half), (sharp, sharp_area, sharp_half), (wide, wide_area, wide_half)];
        std::array::from_fn(|class| {
            let map = &self.by_class[class];
            if map.is_empty() {
                return Irradiance::default();
            }
            let (radius, area, half_area) = disks[class];
            let flux = map.flux(point.position, normal, radius, most_reflections);
            let (whole, half) = (flux.whole.scaled(1.0 / area), flux.inner.scaled(1.0 / half_area));
            // E(r) − E(r/2) is half of a bias that is linear in r.
            Irradiance { value: whole, bias: (whole + half.scaled(-1.0)).scaled(2.0) }
        })
    }

    /// The photons of `class`.
    pub(super) fn of(&self, class: PathClass) -> &PhotonMap<P> {
        &self.by_class[class as usize]
    }

    /// Where [`irradiance`](Self::irradiance) looks. None where there are no photons of `class`.
    pub(super) fn disk(
        &self,
        class: PathClass,
        point: &SurfacePoint,
        normal: Vec3,
        footprint: f32,
    ) -> Option<Disk> {
        if self.by_class[class as usize].is_empty() {
            return None;
        }
        let radius = footprint * if class == PathClass::Caustic { self.sharp } else { self.wide };
        let [whole, half] = self.rims.areas(point.position, normal, [radius, 0.5 * radius]);
        Some(Disk { radius, over_whole: 1.0 / whole, over_half: 1.0 / half })
    }

    /// Calls `visit` with the number of each block of photons of `class` around the disk, and a bit for each that counts there
    /// after no more than `most_reflections`. Returns the power on the disk of half the radius.
    pub(super) fn each(
        &self,
        class: PathClass,
        point: &SurfacePoint,
        normal: Vec3,
        disk: &Disk,
        most_reflections: u16,
        visit: impl FnMut(usize, u64),
    ) -> P {
        self.of(class).visit(point.position, normal, disk.radius, most_reflections, visit)
    }

    /// Multiplies what is read by sⁿ tᵐ of each photon's orders: the maps of a scene at (1, 1) become those of the point
    /// (s, t). The photons themselves stay as they are.
    pub(super) fn weigh(&mut self, (s, t): (f32, f32)) {
        let powers = |x: f32| -> Vec<f32> { (0..=u8::MAX).map(|n| x.powi(n.into())).collect() };
        let (s, t) = (powers(s), powers(t));
        for map in &mut self.by_class {
            map.weigh(|photon| s[usize::from(photon.orders.n)] * t[usize::from(photon.orders.m)]);
        }
    }
}

/// The part of a surface whose photons are summed.
pub(super) struct Disk {
    /// m.
    radius: f32,
    /// One over the area of surface within the radius, m⁻².
    pub over_whole: f32,
    /// The same for half the radius.
    pub over_half: f32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_follow_the_schedule() {
        assert_eq!(radius_factor(0), 1.0);
        for pass in 0..50 {
            let ratio = f64::from(radius_factor(pass + 1) / radius_factor(pass)).powi(2);
            let i = f64::from(pass) + 1.0;
            assert!((ratio - (i + ALPHA) / (i + 1.0)).abs() < 1e-5);
        }
        let mut squared = 1.0_f64;
        for i in 1..=200_000_u32 {
            squared *= (f64::from(i) + ALPHA) / (f64::from(i) + 1.0);
            if [63, 64, 65, 100, 1000, 200_000].contains(&i) {
                assert!((f64::from(radius_factor(i)) / squared.sqrt() - 1.0).abs() < 2e-6, "{i}");
            }
        }
    }
}
