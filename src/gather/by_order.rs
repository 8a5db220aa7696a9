//! The final pass once more, with what each pixel shows kept apart by its powers of s and t: the kernel of the atlas.
//!
//! It runs over a scene at (s, t) = (1, 1), where every matrix that follows the scene's point has factor one, and
//! counts instead. A row reads one half of light only (what would mix them is refused before), so that each
//! contribution has one pair of orders (n, m) and its weight anywhere else in the square is sⁿ tᵐ.

use super::branches::{Parent, Surface, branches};
use super::connect::Connection;
use super::estimate::Tier;
use super::{
    CERTAIN_DELTA_CHAIN, Connections, Gathered, Maps, Nearby, Parts, Pixel, TILE, TILE_WIDTH, describe,
};
use crate::light::{Light, Matrix, Power, Row};
use crate::optics::{Lobe, Term};
use crate::photon_map::Found;
use crate::plan::{Direct, Plan};
use crate::rays::{Hit, Ray, Segment};
use crate::sampling::{Rng, Stream, endurance};
use crate::scene::{Material, SurfacePoint, View};
use crate::shoot::{Orders, Photon};
use glam::{DVec4, Vec3, Vec4};
use rayon::prelude::*;

/// Where counting ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MostOrders {
    /// The largest n that is kept apart.
    pub n: u8,
    /// The largest m; more crossings count as so many.
    pub m: u8,
    /// True: light of more reflections is left out. False: it counts as if it had `n`.
    pub cut: bool,
}

/// Where light of each pair of orders is kept.
struct Places {
    /// Where n stands among the places, for n up to twice 255; light that is left out has a place behind all others.
    row: [u16; 512],
    /// The same for m; the two add up.
    column: [u16; 512],
    /// (n, m) of each place, and what the film's point of the square makes of it.
    orders: Vec<(u8, u8)>,
    weights: Vec<f32>,
}

/// What [`ABREAST`] pixels show, by place; linear RGB radiance.
struct ByPlace {
    /// The fourth number means nothing.
    sums: Vec<[Vec4; ABREAST]>,
    /// No light has come to places from here on.
    end: usize,
    /// How many numbers have been added to each pixel.
    added: [usize; ABREAST],
    /// Sums of many numbers are kept here, in f64; empty where they are few.
    carried: Vec<[DVec4; ABREAST]>,
}

/// Photons of a map, in its order, as adding them up asks for them.
struct Packed {
    photons: Vec<PackedPhoton>,
    /// They have no place from here on.
    end: usize,
}

/// Power (W), and the place in the bits of the fourth number.
struct PackedPhoton(Vec4);

impl PackedPhoton {
    fn new(power: Vec3, place: u16) -> Self {
        Self(power.extend(f32::from_bits(ONE | u32::from(place))))
    }

    fn place(&self) -> u16 {
        self.0.w.to_bits() as u16
    }
}

/// The bits of 1.
const ONE: u32 = 1.0_f32.to_bits();

/// So many numbers, and as many again, are summed in f32 before the sum is added to others in f64.
const RUN: usize = 1024;

/// So many numbers by place stay near the processor that adds to them.
const NEAR: usize = 8192;

/// Places of all orders that are ever kept apart.
const MOST_PLACES: usize = 1 << 14;

impl Places {
    /// For pixels that are also read at the point (s, t).
    fn new(most: MostOrders, (s, t): (f32, f32)) -> Self {
        let across = u16::from(most.m) + 1;
        let orders: Vec<_> = (0..=most.n).flat_map(|n| (0..=most.m).map(move |m| (n, m))).collect();
        let mut weights: Vec<f32> =
            orders.iter().map(|&(n, m)| s.powi(n.into()) * t.powi(m.into())).collect();
        let places = orders.len();
        assert!(places + usize::from(across) <= MOST_PLACES, "{most:?}: more pictures than an atlas holds");
        let row = |n: u16| {
            if most.cut && n > most.n.into() { places as u16 } else { n.min(most.n.into()) * across }
        };
        // Places of light that is left out, one for each m.
        weights.resize(places + usize::from(across), 0.0);
        Self {
            row: std::array::from_fn(|n| row(n as u16)),
            column: std::array::from_fn(|m| (m as u16).min(most.m.into())),
            orders,
            weights,
        }
    }

    /// The place of light of orders `light`, read by a row that already has `row`.
    #[inline]
    fn of(&self, row: Orders, light: Orders) -> u16 {
        self.row[usize::from(row.n) + usize::from(light.n)]
            + self.column[usize::from(row.m) + usize::from(light.m)]
    }

    /// The place of light that has the given one, read by a row that already has `row`.
    fn behind(&self, row: Orders, place: u16) -> u16 {
        self.orders.get(usize::from(place)).map_or(place, |&(n, m)| self.of(row, Orders { n, m }))
    }

    /// What light at this place counts at the film's point.
    fn weight(&self, place: u16) -> f32 {
        self.weights[usize::from(place)]
    }

    /// True where all light that a row of these orders reads is left out.
    fn leaves_out(&self, row: Orders) -> bool {
        usize::from(self.row[usize::from(row.n)]) >= self.orders.len()
    }
}

impl ByPlace {
    fn new(places: &Places) -> Self {
        let sums = vec![[Vec4::ZERO; ABREAST]; places.weights.len()];
        Self { sums, end: 0, added: [0; ABREAST], carried: Vec::new() }
    }

    /// Adds radiance to a pixel.
    fn add(&mut self, pixel: usize, place: u16, value: Vec3) {
        self.sums[usize::from(place)][pixel] += value.extend(0.0);
        self.end = self.end.max(usize::from(place) + 1);
        self.count(pixel, 1);
    }

    /// Adds the radiance of photons that bring `factor` (m⁻² sr⁻¹) times their power.
    #[inline(never)] // the loop needs all registers
    fn add_photons(&mut self, pixel: usize, Packed { photons, end }: &Packed, found: &Found, factor: Vec3) {
        let (pixel, factor) = (pixel % ABREAST, factor.extend(0.0));
        for found in found.places().chunks(RUN) {
            let sums = &mut self.sums[..];
            for i in found {
                let photon = &photons[*i as usize];
                sums[usize::from(photon.place())][pixel] += factor * photon.0;
            }
            self.count(pixel, found.len());
        }
        self.end = self.end.max(*end);
    }

    fn count(&mut self, pixel: usize, more: usize) {
        self.added[pixel] += more;
        if self.added[pixel] > RUN {
            self.carry();
        }
    }

    #[cold]
    fn carry(&mut self) {
        self.carried.resize(self.sums.len(), [DVec4::ZERO; ABREAST]);
        for (carried, sum) in self.carried.as_flattened_mut().iter_mut().zip(self.sums.as_flattened_mut()) {
            *carried += std::mem::take(sum).as_dvec4();
        }
        self.added = [0; ABREAST];
    }

    /// Ends the pixels: gives what they show to `take`, by place, as far as there is light, and begins anew.
    fn end(&mut self, take: impl FnOnce(&[[Vec4; ABREAST]])) {
        if !self.carried.is_empty() {
            self.carry();
            for (sum, carried) in self.sums.iter_mut().zip(self.carried.drain(..)) {
                *sum = carried.map(DVec4::as_vec4);
            }
        }
        take(&self.sums[..self.end]);
        self.sums[..self.end].fill([Vec4::ZERO; ABREAST]);
        (self.end, self.added) = (0, [0; ABREAST]);
    }
}

/// Pixels of a row that are added to their records at once.
pub const ABREAST: usize = 8;

/// Gathers passes of `plan`, whose scene stands at (1, 1), one with each of `maps`. What [`ABREAST`] pixels of a row show in all
/// of them together is given to `add`: by n, then m, each up to `most`, ended where there is no more light, the fourth number of
/// each without meaning; with the pixels' own record, one of equal parts of `records` (row by row; the last of a row may have pixels
/// beyond its end, which are dark), and a total of its band of pixels. Returns each pass as it looks at the point `at`, and the totals,
/// topmost first.
pub fn gather_by_order<P: Power, R: Send, T: Default + Send>(
    plan: &Plan,
    connections: &Connections,
    mut maps: Vec<Maps<'_, P>>,
    first_pass: u32,
    (most, at): (MostOrders, (f32, f32)),
    records: &mut [R],
    add: impl Fn(&mut [R], &[[Vec4; ABREAST]], &mut T) + Sync,
) -> (Vec<Gathered<1>>, Vec<T>) {
    let view = plan.scene.camera.view(plan.settings.width as f32 / plan.settings.height as f32);
    let (width, height) = (plan.settings.width as usize, plan.settings.height as usize);
    let across = width.div_ceil(ABREAST);
    let block = records.len() / (across * height);
    let places = Places::new(most, at);
    let place = |orders| places.of(Orders::default(), orders);
    maps.iter_mut().for_each(|maps| maps.weigh(|orders| places.weight(place(orders))));
    let pack = |tier: &Tier<P>| {
        let photons = tier.map.photons();
        let each =
            |photon: &Photon<P>| PackedPhoton::new(photon.power.light().invisible, place(photon.orders));
        let ends = photons.par_iter().map(|photon| usize::from(place(photon.orders)) + 1);
        Packed { photons: photons.par_iter().map(each).collect(), end: ends.max().unwrap_or(0) }
    };
    let of_pass = |maps: &Maps<'_, P>| -> Vec<Packed> { maps.tiers().iter().map(pack).collect() };
    let packed: Vec<_> = maps.iter().map(of_pass).collect();
    let together = (NEAR / places.weights.len()).clamp(ABREAST, TILE_WIDTH) / ABREAST * ABREAST;
    let mut pictures = vec![vec![Pixel::<1>::EMPTY; width * height]; maps.len()];
    // Tiles, so that the photons that pixels share stay near.
    let mut bands: Vec<_> = pictures.iter_mut().map(|pixels| pixels.chunks_mut(width * TILE)).collect();
    let bands = records.chunks_mut(across * TILE * block).map(|records| {
        let bands = bands.iter_mut().map(|band| band.next().expect("as many as of records"));
        (records, bands.collect::<Vec<_>>())
    });
    let totals = bands
        .collect::<Vec<_>>()
        .into_par_iter()
        .enumerate()
        .map(|(band, (records, mut pixels))| {
            let mut walk = Walk {
                plan,
                view,
                connections,
                maps: &maps,
                packed: &packed,
                found: Found::default(),
                pass: 0,
                nearby: maps.iter().map(|_| Nearby::default()).collect(),
                places: &places,
                kept: (0..together / ABREAST).map(|_| ByPlace::new(&places)).collect(),
                column: 0,
                growth: plan.existence.growth().max(1.0),
                stack: Vec::new(),
                hits: Vec::new(),
                between: Vec::new(),
            };
            let mut total = T::default();
            for left in (0..width).step_by(TILE_WIDTH) {
                for row in 0..records.len() / (across * block) {
                    let right = (left + TILE_WIDTH).min(width);
                    for left in (left..right).step_by(together) {
                        let right = (left + together).min(right);
                        for (i, pixels) in pixels.iter_mut().enumerate() {
                            walk.pass = i;
                            for x in left..right {
                                let (y, pass) = (band * TILE + row, first_pass + i as u32);
                                let index = (y * width + x) as u64;
                                let rng = Rng::new(plan.settings.seed, Stream::Gather, pass, index);
                                walk.column = x - left;
                                pixels[row * width + x] = walk.pixel(x as u32, y as u32, rng);
                            }
                        }
                        // What adding needs does not stay near while others are gathered, nor photons of one pass while those of
                        // another are: each is done for many pixels.
                        let records =
                            records[(row * across + left / ABREAST) * block..].chunks_exact_mut(block);
                        let used = (right - left).div_ceil(ABREAST);
                        for (record, kept) in records.zip(&mut walk.kept[..used]) {
                            // What is left out has a place behind those of all orders.
                            kept.end(|light| {
                                add(record, &light[..light.len().min(places.orders.len())], &mut total);
                            });
                        }
                    }
                }
            }
            total
        })
        .collect();
    (pictures.into_iter().map(|pixels| Gathered { pixels }).collect(), totals)
}

/// One straight line still to be looked along.
struct Line {
    origin: Vec3,
    direction: Vec3,
    parent: Parent<1>,
    /// Powers of s and t that its row has.
    orders: Orders,
    /// Length of the camera path so far, m.
    travelled: f32,
}

/// A row, and the powers of s and t that it already has.
#[derive(Clone, Copy)]
struct Reading {
    row: Row,
    orders: Orders,
}

impl Reading {
    /// Before a reflection by `term` of `material`. The first reflection into the visible half has no s: F(s, t)'s
    /// second row is [f_opaque 0].
    fn before(self, material: &Material, term: &Term) -> Self {
        let invisible = self.row.invisible != Vec3::ZERO;
        let orders = if invisible { self.orders.reflected(material) } else { self.orders };
        Self { row: self.row * term.coefficient, orders }
    }
}

/// A point on a line of the camera path, and what is still read there.
#[derive(Clone, Copy)]
struct Here<'a> {
    reading: Reading,
    material: &'a Material,
    point: &'a SurfacePoint,
    wo: Vec3,
    travelled: f32,
    most_reflections: u32,
}

struct Walk<'a, P> {
    plan: &'a Plan,
    view: View,
    connections: &'a Connections,
    /// By pass, and so the next two.
    maps: &'a [Maps<'a, P>],
    /// Of each map.
    packed: &'a [Vec<Packed>],
    found: Found,
    nearby: Vec<Nearby>,
    /// Which of the passes it is, from the first.
    pass: usize,
    places: &'a Places,
    /// Of a row of pixels.
    kept: Vec<ByPlace>,
    /// Which of them it is.
    column: usize,
    /// By so much, or less, lines multiply from one delta reflection to the next.
    growth: f32,
    stack: Vec<Line>,
    hits: Vec<Hit>,
    between: Vec<Hit>,
}

impl<P: Power> Walk<'_, P> {
    fn pixel(&mut self, x: u32, y: u32, mut rng: Rng) -> Pixel<1> {
        let settings = &self.plan.settings;
        let (width, height) = (settings.width as f32, settings.height as f32);
        let [jx, jy] = rng.f32x2();
        let (origin, direction) = self.view.ray((x as f32 + jx) / width, (y as f32 + jy) / height);
        let mut pixel = Pixel::EMPTY;
        let parent = Parent { rows: [Row::VISIBLE], delta_chain: 0, share: 1.0 };
        self.stack.push(Line { origin, direction, parent, orders: Orders::default(), travelled: 0.0 });
        while let Some(line) = self.stack.pop() {
            self.look_along(&line, &mut pixel, &mut rng);
        }
        pixel
    }

    fn look_along(&mut self, line: &Line, pixel: &mut Pixel<1>, rng: &mut Rng) {
        let ray = Ray { origin: line.origin, direction: line.direction, t_max: f32::INFINITY };
        let mut hits = std::mem::take(&mut self.hits);
        self.plan.look_along(&ray, &line.parent.rows, &mut hits);
        let Parent { rows: [row], delta_chain, .. } = line.parent;
        let mut reading = Reading { row, orders: line.orders };
        let most = self.plan.settings.max_reflections.unwrap_or(u32::MAX);
        for hit in &hits {
            let material = &self.plan.scene.materials[self.plan.material_index(hit.triangle)];
            let point =
                self.plan.scene.mesh.point(hit.triangle, hit.u, hit.v, self.plan.is_smooth(hit.triangle));
            let wo = -line.direction;
            if pixel.depth == f32::INFINITY && delta_chain == 0 && !material.is_nothing() {
                describe(pixel, hit, &point, wo, &material.bsdf);
            }
            if let Some(emission) = material.emission
                && delta_chain <= most
                && (emission.two_sided || point.normals.is_front(wo))
            {
                let place = self.places.of(reading.orders, Orders::default());
                let seen = reading.row * emission.radiance;
                self.kept[self.column / ABREAST].add(self.column % ABREAST, place, seen);
                pixel.parts[0].emitted += self.places.weight(place) * seen;
            }
            if delta_chain < most {
                let here = Here {
                    reading,
                    material,
                    point: &point,
                    wo,
                    travelled: line.travelled + hit.t,
                    most_reflections: most - delta_chain - 1,
                };
                self.read_surface(&here, pixel, rng);
                self.pass_on(&here, line, rng);
            }
            reading.row = reading.row * material.bsdf.straight;
            reading.orders = reading.orders.crossed(material);
            if reading.row.is_zero() {
                break;
            }
        }
        self.hits = hits;
    }

    /// Light that finite lobes send towards the camera.
    fn read_surface(&mut self, here: &Here<'_>, pixel: &mut Pixel<1>, rng: &mut Rng) {
        let Here { point, wo, material, .. } = *here;
        for term in material.bsdf.terms.iter().filter(|term| !term.lobe.is_delta()) {
            let reading = here.reading.before(material, term);
            if reading.row.is_zero() || !term.lobe.responds(&point.normals, wo) {
                continue;
            }
            if self.plan.settings.direct == Direct::Connection {
                self.connect(reading, term, here, &mut pixel.parts[0], rng);
            }
            let Lobe::Diffuse(diffuse) = term.lobe else { continue };
            let footprint = self.view.footprint(here.travelled, self.plan.settings.height);
            let normal = point.normals.geometric * if point.normals.is_front(wo) { 1.0 } else { -1.0 };
            let f = diffuse.towards(&point.normals, wo);
            let most = u16::try_from(here.most_reflections).unwrap_or(u16::MAX);
            let (maps, packed, places) = (&self.maps[self.pass], &self.packed[self.pass], self.places);
            let (kept, found) = (&mut self.kept[self.column / ABREAST], &mut self.found);
            let column = self.column % ABREAST;
            if maps.tiers().is_empty() {
                continue;
            }
            let around = maps.around(&mut self.nearby[self.pass], point, footprint);
            let disks = maps.disks(around, point, normal, footprint);
            for ((tier, photons), near) in maps.tiers().iter().zip(packed).zip(&around.photons) {
                if near.is_empty() {
                    continue;
                }
                let disk = tier.disk(&disks);
                let flux = tier.find(near, [point.position, normal], disk, most, found);
                let factor = f * reading.row.invisible;
                let over_whole = disk.over_whole * factor;
                let row = reading.orders;
                let (value, inner) = if row == Orders::default() {
                    // Most rows; light keeps its place.
                    kept.add_photons(column, photons, found, over_whole);
                    (over_whole * flux.whole.light().invisible, flux.inner.light().invisible)
                } else {
                    let mut value = Vec3::ZERO;
                    for i in found.places() {
                        let photon = &photons.photons[*i as usize];
                        let place = places.behind(row, photon.place());
                        let seen = over_whole * photon.0.truncate();
                        kept.add(column, place, seen);
                        value += places.weight(place) * seen;
                    }
                    // Row and photons are weighed apart, which forgets that orders beyond the last stored count as the last:
                    // it serves the bias alone.
                    let row = places.weight(places.of(row, Orders::default()));
                    (value, row * flux.inner.light().invisible)
                };
                *pixel.parts[0].of(tier.class) += value;
                pixel.bias += 2.0 * (value - disk.over_half * factor * inner);
            }
        }
    }

    fn connect(&mut self, reading: Reading, term: &Term, here: &Here<'_>, parts: &mut Parts, rng: &mut Rng) {
        let Here { point, wo, .. } = *here;
        let Self { plan, connections, places, between, .. } = self;
        let (kept, column) = (&mut self.kept[self.column / ABREAST], self.column % ABREAST);
        let mut visit = |connection: Connection| {
            let f = term.lobe.eval(&point.normals, wo, connection.wi)
                * connection.wi.dot(point.normals.shading).abs();
            if f == Vec3::ZERO || reading.row * connection.light == Vec3::ZERO {
                return;
            }
            let (through, crossed) = straight_along(plan, &connection.segment, between);
            let light: Light = f * (through * connection.light);
            let place = places.of(reading.orders, crossed);
            let seen = reading.row * light;
            kept.add(column, place, seen);
            parts.direct += places.weight(place) * seen;
        };
        connections.to_all(&plan.scene, point, &mut visit);
        connections.to_one(&plan.scene, point, rng.f32x3()).into_iter().for_each(visit);
    }

    /// The row goes on through delta lobes.
    fn pass_on(&mut self, here: &Here<'_>, line: &Line, rng: &mut Rng) {
        let Here { reading, material, point, wo, travelled, .. } = *here;
        if !material.bsdf.has_delta_lobe() {
            return;
        }
        let delta_chain = line.parent.delta_chain;
        let survival = endurance(delta_chain, CERTAIN_DELTA_CHAIN);
        if survival < 1.0 && rng.f32() >= survival {
            return;
        }
        let Self { plan, growth, stack, places, .. } = self;
        let surface = Surface { rows: [reading.row], bsdf: &material.bsdf, point, wo };
        branches(&plan.rays, &surface, &line.parent, *growth, rng, |branch| {
            let orders = reading.before(material, branch.term).orders;
            if places.leaves_out(orders) {
                return;
            }
            stack.push(Line {
                origin: point.origin_towards(branch.sample.to),
                direction: branch.sample.to,
                parent: Parent {
                    rows: branch.rows.map(|row| row * (1.0 / survival)),
                    delta_chain: delta_chain + 1,
                    share: branch.share,
                },
                orders,
                travelled,
            });
        });
    }
}

/// What light that travels a connection is multiplied by, and the crossings that it counts.
fn straight_along(plan: &Plan, segment: &Segment, hits: &mut Vec<Hit>) -> (Matrix, Orders) {
    plan.rays.crossings(segment, hits);
    let (mut through, mut orders) = (Matrix::IDENTITY, Orders::default());
    for hit in hits.iter() {
        let material = &plan.scene.materials[plan.material_index(hit.triangle)];
        through = through * material.bsdf.straight;
        orders = orders.crossed(material);
    }
    (through, orders)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Invisible;
    use crate::photon_map::{Neighbourhood, PhotonMap};

    fn places() -> Places {
        Places::new(MostOrders { n: 2, m: 1, cut: true }, (0.5, 0.25))
    }

    #[test]
    fn places_are_those_of_orders() {
        let places = places();
        let place = |n, m| places.of(Orders::default(), Orders { n, m });
        assert_eq!([place(0, 0), place(0, 1), place(0, 9), place(2, 0), place(2, 1)], [0, 1, 1, 4, 5]);
        assert_eq!([place(3, 0), place(255, 1)], [6, 7], "left out");
        assert_eq!(places.weight(place(2, 1)), 0.25 * 0.25);
        assert_eq!(places.weight(place(3, 0)), 0.0);
        let row = Orders { n: 1, m: 1 };
        assert_eq!(places.behind(row, place(1, 0)), place(2, 1));
        assert_eq!(places.behind(row, place(2, 0)), place(3, 1));
        assert!(!places.leaves_out(row) && places.leaves_out(Orders { n: 3, m: 0 }));
    }

    #[test]
    fn many_numbers_are_summed_without_loss() {
        let mut kept = ByPlace::new(&places());
        let numbers = 3_000_000;
        // Twice: what was there is gone.
        for _ in 0..2 {
            kept.add(2, 1, Vec3::splat(7.0));
            for _ in 0..numbers {
                kept.add(5, 3, Vec3::new(0.1, 1.0, 3e-9));
            }
            kept.end(|light| {
                assert_eq!(light.len(), 4);
                let sum = light[3][5].truncate() / numbers as f32;
                let off = (sum / Vec3::new(0.1, 1.0, 3e-9) - 1.0).abs().max_element();
                let naive = (0..numbers).fold(0.0_f32, |sum, _| sum + 0.1) / (0.1 * numbers as f32);
                assert!(off < 1e-5 && (naive - 1.0).abs() > 1e-3, "{off}, and {naive} where f32 alone adds");
                assert_eq!(light[1][2].truncate(), Vec3::splat(7.0));
                let lit = light.iter().flatten().filter(|light| light.truncate() != Vec3::ZERO);
                assert_eq!(lit.count(), 2);
            });
        }
    }

    #[test]
    fn photons_are_added_where_they_belong() {
        let powers: Vec<Vec3> = (0..5000).map(|i| Vec3::new(1.0, (i % 7) as f32, (i % 3) as f32)).collect();
        let photons = powers.iter().enumerate().map(|(i, power)| PackedPhoton::new(*power, i as u16 % 6));
        let packed = Packed { photons: photons.collect(), end: 6 };
        let map = PhotonMap::build(
            powers.iter().map(|power| Photon::new(Vec3::ZERO, Vec3::Y, Invisible(*power), 1)).collect(),
        );
        let (mut near, mut found) = (Neighbourhood::default(), Found::default());
        map.neighbourhood(Vec3::ZERO, 1.0, &mut near);
        map.find(&near, [Vec3::ZERO, Vec3::Y], 0.5, u16::MAX, &mut found);
        let (mut together, mut one_by_one) = (ByPlace::new(&places()), ByPlace::new(&places()));
        let factor = Vec3::new(0.5, 2.0, 1.0);
        together.add_photons(3, &packed, &found, factor);
        for (i, power) in powers.iter().enumerate() {
            one_by_one.add(3, i as u16 % 6, factor * *power);
        }
        together.end(|a| {
            one_by_one.end(|b| {
                assert!(a.len() == 6 && b.len() == 6);
                for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
                    assert!((*a - *b).truncate().abs().max_element() < 1e-3, "{a} {b}");
                }
                assert!(b[5][3].truncate().min_element() > 400.0);
            });
        });
    }
}
