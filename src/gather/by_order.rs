//! The final pass once more, with what each pixel shows kept apart by its powers of s and t: the kernel of the atlas.
//!
//! It runs over a scene at (s, t) = (1, 1), where every matrix that follows the scene's point has factor one, and
//! counts instead. A row reads one half of light only (what would mix them is refused before), so that each
//! contribution has one pair of orders (n, m) and its weight anywhere else in the square is sⁿ tᵐ.

use super::branches::{Parent, Surface, branches};
use super::connect::Connection;
use super::{
    CERTAIN_DELTA_CHAIN, Connections, DELTA_CHAIN_SURVIVAL, Gathered, Maps, Nearby, Parts, Pixel, TILE,
    TILE_WIDTH, describe,
};
use crate::light::{Light, Matrix, Power, Row};
use crate::optics::{Lobe, Term};
use crate::photon_map::{LANES, PhotonMap};
use crate::plan::{Direct, Plan};
use crate::rays::{Hit, Ray};
use crate::sampling::{Rng, Stream};
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

/// Powers n of s and m of t, and the radiance that has them; linear RGB.
pub type Ordered = (u8, u8, Vec3);

/// What one pixel shows, by powers of s and t; linear RGB radiance.
struct ByOrder {
    /// Where n stands among the places, for n up to twice 255; light that is left out has a place behind all others.
    row: [u16; 512],
    /// The same for m; the two add up.
    column: [u16; 512],
    /// (n, m) of each place, and what the film's point of the square makes of it.
    orders: Vec<(u8, u8)>,
    weights: Vec<f32>,
    /// In f64: many small numbers are added.
    values: Vec<DVec4>,
    /// A bit for each place in `values` that is not zero.
    touched: [u64; MOST_WORDS],
    /// Photon power (W) of the query under way by the photons' own place, and a bit for each place that has some.
    power: Vec<Vec4>,
    met: [u64; MOST_WORDS],
}

/// Places of all orders that are ever kept apart, by 64.
const MOST_WORDS: usize = 256;

/// What adding up asks of a block of photons: power (W; the fourth number is spare: one addition of four is faster than
/// three), and their place.
struct PackedBlock {
    powers: [Vec4; LANES],
    places: [u16; LANES],
}

/// So many photons, or fewer, are summed in f32 before the sum is added to others in f64.
const RUN: u32 = 1024;

impl ByOrder {
    /// For pixels that are also read at the point (s, t).
    fn new(most: MostOrders, (s, t): (f32, f32)) -> Self {
        let across = u16::from(most.m) + 1;
        let orders: Vec<_> = (0..=most.n).flat_map(|n| (0..=most.m).map(move |m| (n, m))).collect();
        let mut weights: Vec<f32> =
            orders.iter().map(|&(n, m)| s.powi(n.into()) * t.powi(m.into())).collect();
        let places = orders.len();
        assert!(
            places + usize::from(across) <= 64 * MOST_WORDS,
            "{most:?}: more pictures than an atlas holds"
        );
        let row = |n: u16| {
            if most.cut && n > most.n.into() { places as u16 } else { n.min(most.n.into()) * across }
        };
        // Places of light that is left out, one for each m.
        weights.resize(places + usize::from(across), 0.0);
        Self {
            row: std::array::from_fn(|n| row(n as u16)),
            column: std::array::from_fn(|m| (m as u16).min(most.m.into())),
            orders,
            values: vec![DVec4::ZERO; weights.len()],
            power: vec![Vec4::ZERO; weights.len()],
            met: [0; MOST_WORDS],
            weights,
            touched: [0; MOST_WORDS],
        }
    }

    /// The place of light of orders `light`, read by a row that already has `row`.
    #[inline]
    fn place(&self, row: Orders, light: Orders) -> u16 {
        self.row[usize::from(row.n) + usize::from(light.n)]
            + self.column[usize::from(row.m) + usize::from(light.m)]
    }

    /// True where all light that a row of these orders reads is left out.
    fn leaves_out(&self, row: Orders) -> bool {
        usize::from(self.row[usize::from(row.n)]) >= self.orders.len()
    }

    /// Adds radiance and returns its share at the film's point.
    fn add(&mut self, place: u16, value: Vec3) -> Vec3 {
        let i = usize::from(place);
        self.values[i] += value.extend(0.0).as_dvec4();
        self.touched[i / 64 % MOST_WORDS] |= 1 << (i % 64);
        self.weights[i] * value
    }

    fn packed<P: Power>(&self, map: &PhotonMap<P>) -> Vec<PackedBlock> {
        let pack = |photons: &[Photon<P>]| {
            let each = |lane: usize| photons.get(lane);
            let power = |photon: &Photon<P>| photon.power.light().invisible.extend(0.0);
            let place = |photon: &Photon<P>| self.place(Orders::default(), photon.orders);
            PackedBlock {
                powers: std::array::from_fn(|lane| each(lane).map_or(Vec4::ZERO, power)),
                places: std::array::from_fn(|lane| each(lane).map_or(0, place)),
            }
        };
        map.blocks().map(pack).collect()
    }

    /// Adds the photons of the block that have a bit in `bits` to the query under way.
    #[inline(always)]
    fn meet(&mut self, block: &PackedBlock, mut bits: u64) {
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize % LANES;
            bits &= bits - 1;
            let place = usize::from(block.places[lane]);
            self.power[place] += block.powers[lane];
            self.met[place / 64 % MOST_WORDS] |= 1 << (place % 64);
        }
    }

    /// The place of light that has the given place, read by a row that already has `row`.
    fn behind(&self, row: Orders, place: usize) -> usize {
        self.orders.get(place).map_or(place, |&(n, m)| usize::from(self.place(row, Orders { n, m })))
    }

    /// Ends the query under way: its power times `factor` (m⁻² sr⁻¹) is radiance, read by a row that already has `row`.
    /// Returns its share at the film's point.
    fn add_met(&mut self, row: Orders, factor: Vec3) -> Vec3 {
        let factor = factor.extend(0.0);
        let mut seen = Vec4::ZERO;
        for word in 0..self.weights.len().div_ceil(64) {
            let mut bits = std::mem::take(&mut self.met[word]);
            let mut each = |places: &mut Self, to: usize, power: usize| {
                let value = factor * std::mem::take(&mut places.power[power]);
                places.values[to] += value.as_dvec4();
                seen += places.weights[to] * value;
            };
            if row == Orders::default() {
                // Most rows; light keeps its place.
                self.touched[word] |= bits;
                while bits != 0 {
                    let place = 64 * word + bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    each(self, place, place);
                }
            }
            while bits != 0 {
                let place = 64 * word + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let to = self.behind(row, place);
                self.touched[to / 64 % MOST_WORDS] |= 1 << (to % 64);
                each(self, to, place);
            }
        }
        seen.truncate()
    }

    /// Takes out (n, m) and light, in rising order.
    #[inline(always)]
    fn drain(&mut self) -> impl Iterator<Item = Ordered> {
        let Self { values, touched, orders, weights, .. } = self;
        let mut words = touched[..weights.len().div_ceil(64)].iter_mut().enumerate();
        let (mut bits, mut first) = (0, 0);
        std::iter::from_fn(move || {
            while bits == 0 {
                let (word, touched) = words.next()?;
                (bits, first) = (std::mem::take(touched), 64 * word);
            }
            let place = first + bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let value = std::mem::take(&mut values[place]).truncate().as_vec3();
            // What is left out has a place behind those of all orders.
            Some(orders.get(place).map(|&(n, m)| (n, m, value)))
        })
        .flatten()
    }
}

/// Gathers passes of `plan`, whose scene stands at (1, 1), one with each of `maps`. What each pixel's light by order is in all of
/// them together is given to `add` with the pixel's own record, one of equal parts of `records`, and a total of its
/// band of pixels. Returns each pass as it looks at the point `at`, and the totals, topmost first.
pub fn gather_by_order<P: Power, T: Default + Send>(
    plan: &Plan,
    connections: &Connections,
    mut maps: Vec<Maps<'_, P>>,
    first_pass: u32,
    (most, at): (MostOrders, (f32, f32)),
    records: &mut [f32],
    add: impl Fn(&mut [f32], &[Ordered], &mut T) + Sync,
) -> (Vec<Gathered<1>>, Vec<T>) {
    let view = plan.scene.camera.view(plan.settings.width as f32 / plan.settings.height as f32);
    let (width, height) = (plan.settings.width as usize, plan.settings.height as usize);
    let stride = records.len() / (width * height);
    maps.iter_mut().for_each(|maps| maps.weigh(at));
    let counting = ByOrder::new(most, at);
    let of_pass =
        |maps: &Maps<'_, P>| maps.tiers().iter().map(|tier| counting.packed(&tier.map)).collect::<Vec<_>>();
    let packed: Vec<_> = maps.iter().map(of_pass).collect();
    let mut pictures = vec![vec![Pixel::<1>::EMPTY; width * height]; maps.len()];
    // Tiles, so that the photons that pixels share stay near.
    let mut bands: Vec<_> = pictures.iter_mut().map(|pixels| pixels.chunks_mut(width * TILE)).collect();
    let bands = records.chunks_mut(width * TILE * stride).map(|records| {
        let bands = bands.iter_mut().map(|band| band.next().expect("as many as of records"));
        (records, bands.collect::<Vec<_>>())
    });
    let totals = bands
        .collect::<Vec<_>>()
        .into_par_iter()
        .enumerate()
        .map(|(band, (records, mut pixels))| {
            let by_order = ByOrder::new(most, at);
            let mut walk = Walk {
                plan,
                view,
                connections,
                maps: &maps,
                packed: &packed,
                pass: 0,
                nearby: maps.iter().map(|_| Nearby::default()).collect(),
                by_order,
                growth: plan.existence.growth().max(1.0),
                stack: Vec::new(),
                hits: Vec::new(),
                between: Vec::new(),
            };
            let mut total = T::default();
            let (mut light, mut ends): (Vec<Ordered>, Vec<usize>) = (Vec::new(), Vec::new());
            for left in (0..width).step_by(TILE_WIDTH) {
                for row in 0..records.len() / (width * stride) {
                    for x in left..(left + TILE_WIDTH).min(width) {
                        let (y, index) = (band * TILE + row, row * width + x);
                        for (i, pixels) in pixels.iter_mut().enumerate() {
                            let pass = first_pass + i as u32;
                            let seed = plan.settings.seed;
                            let rng = Rng::new(seed, Stream::Gather, pass, (y * width + x) as u64);
                            walk.pass = i;
                            pixels[index] = walk.pixel(x as u32, y as u32, rng);
                        }
                        light.extend(walk.by_order.drain());
                        ends.push(light.len());
                    }
                    // Many pixels at a time: what adding needs does not stay near while others are gathered.
                    let mut begin = 0;
                    let records = records[(row * width + left) * stride..].chunks_exact_mut(stride);
                    for (record, end) in records.zip(ends.drain(..)) {
                        add(record, &light[begin..end], &mut total);
                        begin = end;
                    }
                    light.clear();
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
    packed: &'a [Vec<Vec<PackedBlock>>],
    nearby: Vec<Nearby>,
    /// Which of the passes it is, from the first.
    pass: usize,
    by_order: ByOrder,
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
            if pixel.depth == f32::INFINITY && delta_chain == 0 {
                describe(pixel, hit, &point, wo, &material.bsdf);
            }
            if let Some(emission) = material.emission
                && delta_chain <= most
                && (emission.two_sided || point.normals.is_front(wo))
            {
                let place = self.by_order.place(reading.orders, Orders::default());
                pixel.parts[0].emitted += self.by_order.add(place, reading.row * emission.radiance);
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
            let f = diffuse.eval(&point.normals, wo, wo); // Lambert: the same for every wi on this side
            let most = u16::try_from(here.most_reflections).unwrap_or(u16::MAX);
            let by_order = &mut self.by_order;
            let (maps, packed) = (&self.maps[self.pass], &self.packed[self.pass]);
            if maps.tiers().is_empty() {
                continue;
            }
            let around = maps.around(&mut self.nearby[self.pass], point, footprint);
            let disks = maps.disks(around, point, normal, footprint);
            for ((tier, blocks), near) in maps.tiers().iter().zip(packed).zip(&around.photons) {
                let (mut value, mut length) = (Vec3::ZERO, 0_u32);
                let disk = tier.disk(&disks);
                let factor = f * reading.row.invisible;
                let over_whole = disk.over_whole * factor;
                let inner = tier.each(near, [point.position, normal], disk, most, |block, bits| {
                    by_order.meet(&blocks[block], bits);
                    length += LANES as u32;
                    if length >= RUN {
                        value += by_order.add_met(reading.orders, over_whole);
                        length = 0;
                    }
                });
                value += by_order.add_met(reading.orders, over_whole);
                // Row and photons are weighed apart, which forgets that orders beyond the last stored count as the last:
                // it serves the bias alone.
                let row = by_order.weights[usize::from(by_order.place(reading.orders, Orders::default()))];
                let inner = row * inner.light().invisible;
                *pixel.parts[0].of(tier.class) += value;
                pixel.bias += 2.0 * (value - disk.over_half * factor * inner);
            }
        }
    }

    fn connect(&mut self, reading: Reading, term: &Term, here: &Here<'_>, parts: &mut Parts, rng: &mut Rng) {
        let Here { point, wo, .. } = *here;
        let Self { plan, connections, by_order, between, .. } = self;
        let mut visit = |connection: Connection| {
            let f = term.lobe.eval(&point.normals, wo, connection.wi)
                * connection.wi.dot(point.normals.shading).abs();
            if f == Vec3::ZERO || reading.row * connection.light == Vec3::ZERO {
                return;
            }
            let (through, crossed) = straight_along(plan, &connection.segment, between);
            let light: Light = f * (through * connection.light);
            let place = by_order.place(reading.orders, crossed);
            parts.direct += by_order.add(place, reading.row * light);
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
        let survival = if delta_chain >= CERTAIN_DELTA_CHAIN { DELTA_CHAIN_SURVIVAL } else { 1.0 };
        if survival < 1.0 && rng.f32() >= survival {
            return;
        }
        let Self { plan, growth, stack, by_order, .. } = self;
        let surface = Surface { rows: [reading.row], bsdf: &material.bsdf, point, wo };
        branches(&plan.rays, &surface, &line.parent, *growth, rng, |branch| {
            let orders = reading.before(material, branch.term).orders;
            if by_order.leaves_out(orders) {
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
fn straight_along(plan: &Plan, segment: &Ray, hits: &mut Vec<Hit>) -> (Matrix, Orders) {
    plan.rays.crossings(segment, hits);
    let (mut through, mut orders) = (Matrix::IDENTITY, Orders::default());
    for hit in hits.iter() {
        let material = &plan.scene.materials[plan.material_index(hit.triangle)];
        through = through * material.bsdf.straight;
        orders = orders.crossed(material);
    }
    (through, orders)
}
