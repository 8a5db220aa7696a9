//! Density estimation: one photon map for each class of paths and each gather radius.

use crate::clearance::{Even, LEAST_SHARE, Reach};
use crate::light::Power;
use crate::photon::{Orders, PathClass, Photon, Photons, Way};
use crate::photon_map::{Flux, Found, Neighbourhood, PhotonMap};
use crate::plan::{Frame, LEVELS, Plan};
use crate::rims::Rims;
use crate::scene::SurfacePoint;
use glam::Vec3;
use rayon::prelude::*;
use std::f32::consts::PI;

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
    /// The part of the estimate that some surface re-radiated.
    pub reradiated: P,
    /// What one photon more than came, of the power that most of it comes with, would add. Not of caustics, if some came anywhere: in
    /// most places there are none.
    pub one_more: P,
}

/// Photons of one class that are gathered with one radius.
pub(crate) struct Tier<P> {
    pub class: PathClass,
    pub map: PhotonMap<P>,
    /// Which of the radii.
    level: usize,
    /// Light that some surface re-radiated: it is kept apart.
    pub reradiated: bool,
    /// Mean power (W) of its photons, each counted by its power.
    typical: P,
}

/// Caustic photons with their directions, of one level.
struct GlintTier<P> {
    map: PhotonMap<P, Way>,
    level: usize,
}

/// The maps of one pass.
pub struct Maps<'a, P> {
    plan: &'a Plan,
    /// Light is read that was scattered before.
    inter_reflection: bool,
    rims: &'a Rims,
    /// Those that are not empty.
    tiers: Vec<Tier<P>>,
    /// What glossy lobes read.
    glints: Vec<GlintTier<P>>,
    /// Classes of which a photon might have come, and none did; and the power (W) that a path began with.
    missing: (Vec<PathClass>, P),
    /// Gather radii in pixel footprints, from the widest: those of [caustics](Frame::caustic_radii), of which the widest
    /// also serves inter-reflection and direct light.
    radii: [f32; LEVELS],
}

impl<'a, P: Power> Maps<'a, P> {
    /// Builds the maps for the radii of `pass`.
    pub fn build(photons: Photons<P>, plan: &'a Plan, frame: &Frame, pass: u32) -> Self {
        let shrink = radius_factor(pass);
        let radii = frame.caustic_radii().map(|radius| radius * shrink);
        let missing = missing(&photons, frame);
        let Photons { by_class: [direct, caustic, indirect], glints, .. } = photons;
        let mut by_level = [(); LEVELS].map(|()| Vec::new());
        for photon in glints {
            by_level[usize::from(photon.level())].push(photon);
        }
        let by_level = by_level.into_iter().enumerate().filter(|(_, photons)| !photons.is_empty());
        let glints = by_level.map(|(level, photons)| GlintTier { map: PhotonMap::build(photons), level });
        let glints = glints.collect();
        let mut caustics = [(); LEVELS].map(|()| Vec::new());
        for photon in caustic {
            caustics[usize::from(photon.level())].push(photon);
        }
        let caustics =
            caustics.into_iter().enumerate().map(|(level, photons)| (PathClass::Caustic, level, photons));
        let (indirect, reradiated) = match plan.scene.fluoresces() {
            true => indirect.into_iter().partition(|photon| !photon.is_reradiated()),
            false => (indirect, Vec::new()),
        };
        let tiers =
            [(PathClass::Direct, direct), (PathClass::Indirect, indirect), (PathClass::Indirect, reradiated)];
        let tiers = tiers.into_iter().map(|(class, photons)| (class, 0, photons));
        let tiers = tiers
            .chain(caustics)
            .filter(|(_, _, photons)| !photons.is_empty())
            .map(|(class, level, photons)| {
                let (typical, reradiated) = (typical(&photons), photons[0].is_reradiated());
                Tier { class, map: PhotonMap::build(photons), level, reradiated, typical }
            })
            .collect();
        let inter_reflection = frame.photons.as_ref().is_some_and(|photons| photons.classes.indirect);
        Self { plan, inter_reflection, rims: &plan.rims, tiers, glints, missing, radii }
    }

    /// How much of the disks at a point may be used, on the side of `normal`; see [`irradiance`](Self::irradiance). `scattered`: a
    /// camera path was scattered before it came there.
    pub fn reach(
        &self,
        nearby: &mut Nearby,
        point: &SurfacePoint,
        normal: Vec3,
        footprint: f32,
        scattered: bool,
    ) -> Reach {
        let clearance = &self.plan.clearance;
        // Not whether photons came: a pass without any must ask as others do.
        if clearance.is_empty() {
            return Reach::Simple(1.0);
        }
        let around = self.around(nearby, point, normal, footprint);
        if clearance.is_even(&around.even, point, normal) {
            return Reach::Simple(1.0);
        }
        let radius = self.radii[0] * footprint;
        let rims = (self.rims, &around.rims[..]);
        match clearance.reach(&self.plan.scene, rims, (point, normal), radius, scattered) {
            // Nothing that paths could look for.
            Reach::Crowded if !self.inter_reflection => Reach::LEAST,
            reach => reach,
        }
    }

    /// Irradiance (W m⁻²) by light of each class, by [`PathClass`], that arrives on the side of `normal` after no more
    /// than `most_reflections`; `footprint` is the side of what a pixel covers there (m), `reach` what may be used of the disks. In a
    /// crowd inter-reflection is not read. `nearby` holds what was found for other places of the same maps.
    pub fn irradiance(
        &self,
        nearby: &mut Nearby,
        point: &SurfacePoint,
        normal: Vec3,
        (footprint, reach): (f32, Reach),
        most_reflections: u16,
    ) -> [Irradiance<P>; 3] {
        let mut by_class = [Irradiance::default(); 3];
        if self.tiers.is_empty() && self.missing.0.is_empty() {
            return by_class;
        }
        let around = self.around(nearby, point, normal, footprint);
        let disks = self.disks(around, point, normal, (footprint, reach));
        for (tier, near) in self.tiers.iter().zip(&around.photons) {
            let Tier { class, map, level, reradiated, typical } = tier;
            if !is_read(*class, reach) {
                continue;
            }
            let disk = &disks[*level];
            let flux = map.flux_near(near, [point.position, normal], disk.radius, most_reflections);
            let (whole, half) = (flux.whole.scaled(disk.over_whole), flux.inner.scaled(disk.over_half));
            let irradiance = &mut by_class[*class as usize];
            irradiance.value += whole;
            if *reradiated {
                irradiance.reradiated += whole;
            }
            // E(r) − E(r/2) is half of a bias that is linear in r.
            irradiance.bias += (whole + half.scaled(-1.0)).scaled(2.0);
            if *class != PathClass::Caustic {
                irradiance.one_more += typical.scaled(disk.over_circle());
            }
        }
        let (classes, power) = &self.missing;
        for class in classes.iter().filter(|class| is_read(**class, reach)) {
            by_class[*class as usize].one_more += power.scaled(disks[0].over_circle());
        }
        by_class
    }

    /// Shows `each` caustic photon by which glossy lobes at a point see what glares: the unit direction that it came from, the
    /// irradiance (W m⁻²) that it brings to the disk, and what it would bring to that of half the radius.
    pub fn glints(
        &self,
        nearby: &mut Nearby,
        (point, normal): (&SurfacePoint, Vec3),
        (footprint, reach): (f32, Reach),
        most_reflections: u16,
        mut each: impl FnMut(Vec3, P, P),
    ) {
        if self.glints.is_empty() {
            return;
        }
        let mut found = std::mem::take(&mut nearby.found);
        let around = self.around(nearby, point, normal, footprint);
        let disks = self.disks(around, point, normal, (footprint, reach));
        for (GlintTier { map, level }, near) in self.glints.iter().zip(&around.glints) {
            let disk = &disks[*level];
            map.find(near, [point.position, normal], disk.radius, most_reflections, &mut found);
            let half = (0.5 * disk.radius).powi(2);
            for photon in found.places().iter().map(|place| &map.photons()[*place as usize]) {
                let is_inner = photon.position.distance_squared(point.position) <= half;
                let inner = if is_inner { photon.power.scaled(disk.over_half) } else { P::default() };
                each(photon.from.unit(), photon.power.scaled(disk.over_whole), inner);
            }
        }
        nearby.found = found;
    }

    /// What is near a point.
    pub(crate) fn around<'n>(
        &self,
        nearby: &'n mut Nearby,
        point: &SurfacePoint,
        normal: Vec3,
        footprint: f32,
    ) -> &'n Surroundings {
        let position = point.position;
        if let Some(i) = nearby.places.iter().position(|place| place.covers(position, footprint)) {
            return &nearby.places[i];
        }
        let place = &mut nearby.places[nearby.next];
        nearby.next = (nearby.next + 1) % PLACES;
        let footprint = LARGER * footprint;
        (place.centre, place.footprint) = (position, footprint);
        place.photons.resize_with(self.tiers.len(), Neighbourhood::default);
        // A little more, for what rounding does at its edge.
        let reach = |level: usize| 1.0001 * (self.radii[level] + SPARE) * footprint;
        for (tier, near) in self.tiers.iter().zip(&mut place.photons) {
            tier.map.neighbourhood(position, reach(tier.level), near);
        }
        place.glints.resize_with(self.glints.len(), Neighbourhood::default);
        for (tier, near) in self.glints.iter().zip(&mut place.glints) {
            tier.map.neighbourhood(position, reach(tier.level), near);
        }
        let widest = (0..LEVELS).map(reach).fold(0.0, f32::max);
        self.rims.near(position, widest, &mut place.rims);
        let radius = self.radii[0] * footprint;
        place.even = self.plan.clearance.even(&self.plan.scene, (point, normal), widest, radius);
        place
    }

    /// Where [`irradiance`](Self::irradiance) looks for photons, by level.
    pub(crate) fn disks(
        &self,
        around: &Surroundings,
        point: &SurfacePoint,
        normal: Vec3,
        (footprint, reach): (f32, Reach),
    ) -> [Disk; LEVELS] {
        let share = match reach {
            Reach::Simple(share) => share,
            Reach::Crowded => LEAST_SHARE,
        };
        let most = share * self.radii[0];
        let (radii, rims) = (self.radii.map(|radius| radius.min(most) * footprint), &around.rims);
        let whole = radii.map(|radius| PI * radius * radius);
        let areas =
            if rims.is_empty() { whole } else { self.rims.areas(rims, point.position, normal, radii) };
        if areas == whole {
            return std::array::from_fn(|level| Disk::new(radii[level], [whole[level], 0.25 * whole[level]]));
        }
        let radii: [f32; LEVELS] = std::array::from_fn(|level| narrowed(radii[level], areas[level]));
        let each: [f32; 2 * LEVELS] =
            std::array::from_fn(|i| if i % 2 == 0 { radii[i / 2] } else { 0.5 * radii[i / 2] });
        let areas = self.rims.areas(rims, point.position, normal, each);
        std::array::from_fn(|level| Disk::new(radii[level], [areas[2 * level], areas[2 * level + 1]]))
    }

    /// The maps, not one of them empty.
    pub(crate) fn tiers(&self) -> &[Tier<P>] {
        &self.tiers
    }

    /// Multiplies what is read by a weight of each photon's orders. The photons themselves stay as they are.
    pub(crate) fn weigh(&mut self, weight: impl Fn(Orders) -> f32 + Sync) {
        for tier in &mut self.tiers {
            tier.map.weigh(|photon| weight(photon.orders));
        }
    }
}

impl<P: Power> Tier<P> {
    /// Its disk among all.
    pub fn disk<'d>(&self, disks: &'d [Disk; LEVELS]) -> &'d Disk {
        &disks[self.level]
    }

    /// The power on the disk after no more than `most_reflections`, and the photons that bring it.
    pub fn find(
        &self,
        near: &Neighbourhood,
        place: [Vec3; 2],
        disk: &Disk,
        most_reflections: u16,
        found: &mut Found,
    ) -> Flux<P> {
        self.map.find(near, place, disk.radius, most_reflections, found)
    }
}

/// Mean power of photons, each counted by its power, whatever the size of that; the same sum however many threads there are.
fn typical<P: Power>(photons: &[Photon<P>]) -> P {
    const TOGETHER: usize = 4096;
    let power = |photon: &Photon<P>| f64::from(photon.power.total());
    let all: Vec<f64> =
        photons.par_chunks(TOGETHER).map(|some| some.iter().map(power).sum::<f64>()).collect();
    let all: f64 = all.iter().sum();
    // None of these is above one.
    let share = |photon: &Photon<P>| photon.power.scaled((power(photon) / all) as f32);
    let means: Vec<P> = photons
        .par_chunks(TOGETHER)
        .map(|some| some.iter().map(share).fold(P::default(), |sum, share| sum + share))
        .collect();
    if all > 0.0 { means.into_iter().fold(P::default(), |sum, mean| sum + mean) } else { P::default() }
}

/// Classes that are shot and of which nothing came, and the power of a path at its start, in each component alike.
fn missing<P: Power>(photons: &Photons<P>, frame: &Frame) -> (Vec<PathClass>, P) {
    let Some(plan) = &frame.photons else { return (Vec::new(), P::default()) };
    let came = |class: PathClass| !photons.by_class[class as usize].is_empty();
    let missing = PathClass::ALL.into_iter().filter(|class| plan.classes.contains(*class) && !came(*class));
    let power = photons.ledger.emitted / (f64::from(plan.paths.max(1)) * P::COMPONENTS as f64);
    (missing.collect(), P::from_components(|_| power as f32))
}

/// True where light of this class is read from photons; in a crowd only that which camera paths do not find.
pub(crate) fn is_read(class: PathClass, reach: Reach) -> bool {
    class != PathClass::Indirect || reach != Reach::Crowded
}

/// Places that are remembered: rows of a tile, and what mirrors and glass show there, take turns.
const PLACES: usize = 8;
/// How far from a place its surroundings serve, in footprints.
const SPARE: f32 = 6.0;
/// And for footprints that are so much larger.
const LARGER: f32 = 1.05;

/// What is near the places that were asked for last. It changes no result.
pub struct Nearby {
    places: [Surroundings; PLACES],
    /// The one to be forgotten next.
    next: usize,
    found: Found,
}

impl Default for Nearby {
    fn default() -> Self {
        let places = std::array::from_fn(|_| Surroundings::default());
        Self { places, next: 0, found: Found::default() }
    }
}

/// What is near one place.
#[derive(Default)]
pub(crate) struct Surroundings {
    centre: Vec3,
    /// The largest they serve (m); zero where nothing was asked for yet.
    footprint: f32,
    /// By map.
    pub photons: Vec<Neighbourhood>,
    glints: Vec<Neighbourhood>,
    rims: Vec<u32>,
    even: Even,
}

impl Surroundings {
    fn covers(&self, position: Vec3, footprint: f32) -> bool {
        footprint <= self.footprint && position.distance(self.centre) <= SPARE * self.footprint
    }
}

/// The part of a surface whose photons are summed.
pub(crate) struct Disk {
    /// m.
    radius: f32,
    /// One over the area of surface within the radius, m⁻².
    pub over_whole: f32,
    /// The same for half the radius.
    pub over_half: f32,
}

impl Disk {
    /// From a radius (m) and the areas (m²) of surface within it and within half of it.
    fn new(radius: f32, [whole, half]: [f32; 2]) -> Self {
        Self { radius, over_whole: 1.0 / whole, over_half: 1.0 / half }
    }

    /// One over the area of the disk, m⁻², as if no rim cut it: the little that one leaves in some pass is no measure of others.
    fn over_circle(&self) -> f32 {
        1.0 / (PI * self.radius * self.radius)
    }
}

/// The radius (m) to look within where a disk holds `area` (m²) of surface.
///
/// The middle of a disk that a rim cuts is not where it is asked for, so that its bias is linear in the radius there, and
/// light does vary fast in corners. From a quarter cut away on the radius is halved.
fn narrowed(radius: f32, area: f32) -> f32 {
    let cut = 1.0 - area / (PI * radius * radius);
    radius * (1.0 - 0.5 * (4.0 * cut).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disks_are_narrowed_where_they_are_cut() {
        let (r, whole) = (3.0_f32, 9.0 * PI);
        for (part, expected) in [(1.0, 3.0), (0.875, 2.25), (0.75, 1.5), (0.5, 1.5), (0.1, 1.5), (1.3, 3.0)] {
            assert!((narrowed(r, part * whole) - expected).abs() < 1e-5, "{part}");
        }
    }

    #[test]
    fn the_typical_power_is_that_of_the_photons_that_bring_most() {
        use crate::light::Invisible;
        for unit in [1e-30_f32, 1.0, 1e30] {
            let photon = |power: f32| {
                Photon::new(Vec3::ZERO, Vec3::Y, Invisible(Vec3::new(unit * power, 0.0, 0.0)), 1)
            };
            let photons: Vec<_> =
                (0..10_000).map(|i| photon(if i % 100 == 0 { 99.0 } else { 1.0 })).collect();
            // Half of the power comes in portions of 99, half in portions of 1.
            let typical = typical(&photons).0 / unit;
            assert!((typical.x / 50.0 - 1.0).abs() < 1e-4 && typical.y == 0.0, "{typical}");
        }
        assert_eq!(typical::<Invisible>(&[]).0, Vec3::ZERO);
    }

    #[test]
    fn a_pass_without_photons_asks_what_others_ask() {
        use crate::light::Invisible;
        let scene = crate::scene::Scene::load("builtin:cornell-spheres").expect("built in");
        let plan = Plan::new(scene, crate::plan::Settings::for_film(64, 64));
        let frame = Frame::asked(&plan);
        let maps = Maps::<Invisible>::build(Photons::none(), &plan, &frame, 0);
        // Each triangle's middle, with disks as wide as a quarter of the room.
        let reach = |triangle| {
            let point = plan.scene.mesh.point(triangle, 0.3, 0.3, false);
            let normal = point.normals.geometric;
            maps.reach(&mut Nearby::default(), &point, normal, 0.05, false)
        };
        let all: Vec<_> = (0..plan.scene.mesh.triangles.len() as u32).map(reach).collect();
        let crowded = all.iter().filter(|reach| **reach == Reach::Crowded).count();
        assert!(0 < crowded && crowded < all.len(), "{crowded} of {}", all.len());
    }

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
