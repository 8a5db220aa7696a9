//! The multiplication factor k: how much power is reflected next for each watt that is reflected now, in the long run.
//!
//! It is the dominant eigenvalue of the reflection operator, as k_eff of a reactor is of fission (Lux, Koblinger 1991,
//! §5): the series of reflections converges iff k < 1. Measured by generations of photons. A generation is all light
//! that was just reflected; every photon of it follows its straight line through all surfaces, what each of them
//! reflects is the next generation, and that is resampled to a fixed number of photons.
//!
//! k is the geometric mean of the ratios of power over the active generations: where light goes to and fro between two
//! surfaces, single ratios alternate for ever and only their product settles. The photon number N biases k by
//! O(1/N). Half of the first generation comes from luminaires, half from all places that reflect, so that modes
//! which luminaires hardly feed are found; what a mode below the largest leaves behind falls as (k₂/k)ⁿ, so after the
//! inactive generations and half of the active ones k is low by no more than its share × 1 / (e n).

use super::chain::Chain;
use crate::light::Light;
use crate::optics::{Lobe, Transport};
use crate::rays::{Hit, Ray, Rays};
use crate::sampling::{Rng, Stream, choose, warp};
use crate::scene::{Scene, SurfacePoint};
use crate::shoot::{EMISSION_DIMENSIONS, Emitters};
use glam::Vec3;
use rayon::prelude::*;

/// A measured multiplication factor.
#[derive(Clone, Debug, PartialEq)]
pub struct Multiplication {
    /// Of the colour channel where it is largest.
    pub k: f64,
    /// Its standard error, from independent batches.
    pub error: f64,
    /// That channel: 0 red, 1 green, 2 blue.
    pub channel: usize,
    /// By material: its share of the reflected power in the active generations.
    pub shares: Vec<f64>,
    /// Share of the reflected power that finite lobes reflected; zero where light is caught between mirrors or in glass.
    pub finite: f64,
    /// Straight lines followed.
    pub lines: u64,
}

/// Generations that are discarded, and as many that count at first.
const GENERATIONS: u32 = 32;
/// Independent batches: enough for an error bar of their mean that is itself known to a fifth.
const BATCHES: u32 = 16;
/// Lines and crossings that the first look may cost in one channel: about half a second on two cores.
const FIRST_LOOK: f64 = 1.5e6;
/// Photons of a batch: from where the bias O(1/N) is below the error to where more would only cost.
const POPULATION: [f64; 2] = [256.0, 2048.0];
/// Near one, generations that count and photons are doubled in turn, up to so many times in all, to tell k from one.
/// Generations first: those that are discarded are not paid for again.
const MOST_DOUBLINGS: u32 = 4;
/// By so many standard errors.
const TOLD_APART: f64 = 6.0;

/// Measures k; `chain` says which halves go on. Equal arguments give equal bits for any number of threads.
pub(super) fn measure(scene: &Scene, rays: &Rays, chain: &Chain, seed: u64) -> Multiplication {
    let first =
        Population { scene, rays, chain, seed, channel: 0, photons: POPULATION[0] as u32, doublings: 0 };
    let cost = first.cost();
    let per_photon = f64::from(BATCHES * 2 * GENERATIONS) * cost;
    let photons = (FIRST_LOOK / per_photon).clamp(POPULATION[0], POPULATION[1]) as u32;
    let look = |channel: usize, doublings: u32| {
        Population { channel, photons: photons << (doublings / 2), doublings, ..first }.run()
    };
    let channels = channels_that_matter(scene);
    let looks = channels.into_iter().map(|channel| look(channel, 0));
    let mut best = looks.reduce(|a, b| if b.k > a.k { b } else { a }).expect("some channel matters");
    // The error falls as the square root of the photons and of the generations.
    let needed = (TOLD_APART * best.error / (best.k - 1.0).abs()).powi(2);
    if needed > 1.0 {
        // One more, since how far k is from one is not well known either.
        let doublings = (needed.log2().ceil() as u32 + 1).min(MOST_DOUBLINGS);
        let lines = best.lines;
        best = look(best.channel, doublings);
        best.lines += lines;
    }
    best
}

/// Channels whose k may be the largest: those that no other one filters less in every lobe.
fn channels_that_matter(scene: &Scene) -> Vec<usize> {
    let filters = |channel: usize| -> Vec<f32> {
        let terms = scene.materials.iter().flat_map(|material| &material.bsdf.terms);
        terms
            .map(|term| match term.lobe {
                Lobe::Diffuse(lobe) => lobe.albedo[channel],
                Lobe::Mirror(lobe) => lobe.tint[channel],
                Lobe::Dielectric(lobe) => lobe.tint[channel],
                Lobe::ThinDielectric(lobe) => lobe.tint[channel],
            })
            .collect()
    };
    let filters = [filters(0), filters(1), filters(2)];
    let below = |a: usize, b: usize| {
        let nowhere_above = filters[a].iter().zip(&filters[b]).all(|(x, y)| x <= y);
        nowhere_above && (filters[a] != filters[b] || b < a)
    };
    (0..3).filter(|a| !(0..3).any(|b| b != *a && below(*a, b))).collect()
}

/// Light on its way; all photons of a generation carry the same total.
#[derive(Clone, Copy)]
struct Photon {
    origin: Vec3,
    direction: Vec3,
    /// Invisible and visible half of the one channel.
    power: [f32; 2],
    material: u32,
    finite: bool,
}

/// What all batches of one measurement have in common.
#[derive(Clone, Copy)]
struct Population<'a> {
    scene: &'a Scene,
    rays: &'a Rays,
    chain: &'a Chain,
    seed: u64,
    channel: usize,
    photons: u32,
    doublings: u32,
}

/// What one batch found.
struct Batch {
    k: f64,
    shares: Vec<f64>,
    finite: f64,
    lines: u64,
}

impl Population<'_> {
    /// Lines and crossings per photon and generation.
    fn cost(&self) -> f64 {
        let mut crossings = 0;
        let photons = self.start(u32::MAX);
        self.next(&photons, u32::MAX, &mut |hits| crossings += hits.len());
        1.0 + crossings as f64 / photons.len().max(1) as f64
    }

    fn run(&self) -> Multiplication {
        let batches: Vec<Batch> = (0..BATCHES).into_par_iter().map(|batch| self.batch(batch)).collect();
        let n = f64::from(BATCHES);
        let k = batches.iter().map(|batch| batch.k).sum::<f64>() / n;
        let variance = batches.iter().map(|batch| (batch.k - k).powi(2)).sum::<f64>() / (n - 1.0);
        let mut shares = vec![0.0; self.scene.materials.len()];
        for batch in &batches {
            shares.iter_mut().zip(&batch.shares).for_each(|(sum, share)| *sum += share / n);
        }
        Multiplication {
            k,
            error: (variance / n).sqrt(),
            channel: self.channel,
            shares,
            finite: batches.iter().map(|batch| batch.finite).sum::<f64>() / n,
            lines: batches.iter().map(|batch| batch.lines).sum(),
        }
    }

    fn batch(&self, batch: u32) -> Batch {
        // Measurements that were doubled share no numbers with those before.
        let stream = (self.doublings * 3 + self.channel as u32) * BATCHES + batch;
        let mut photons = self.start(stream);
        let mut found =
            Batch { k: 0.0, shares: vec![0.0; self.scene.materials.len()], finite: 0.0, lines: 0 };
        let mut growth = 0.0;
        let active = GENERATIONS << self.doublings.div_ceil(2);
        for generation in 0..GENERATIONS + active {
            found.lines += photons.len() as u64;
            let now = total(&photons);
            let reflected = self.next(&photons, stream << 8 | generation, &mut |_| ());
            let next = total(&reflected);
            if next == 0.0 {
                return Batch { k: 0.0, ..found }; // this light is not reflected on
            }
            if generation >= GENERATIONS {
                growth += (next / now).ln();
                let share = 1.0 / (next * f64::from(active));
                for photon in &reflected {
                    let power = f64::from(photon.total()) * share;
                    found.shares[photon.material as usize] += power;
                    found.finite += if photon.finite { power } else { 0.0 };
                }
            }
            let offset = Rng::new(self.seed, Stream::Measure, stream << 8 | generation, u64::MAX).f32();
            photons = resample(&reflected, next, self.photons, f64::from(offset));
        }
        found.k = (growth / f64::from(active)).exp();
        found
    }

    /// The first generation: half from luminaires, a quarter each from reflecting area and from reflecting surfaces.
    fn start(&self, stream: u32) -> Vec<Photon> {
        let places = Places::of(self.scene);
        let emitters = Emitters::<Light>::new(self.scene);
        let power = self.chain.live.map(|live| if live { 1.0 } else { 0.0 });
        let mut photons = Vec::with_capacity(self.photons as usize);
        for i in 0..self.photons {
            let mut rng = Rng::new(self.seed, Stream::Measure, stream << 8 | 0xff, u64::from(i));
            let from_luminaire = i % 2 == 0 || places.is_none();
            let start = if from_luminaire { emitters.as_ref() } else { None };
            let (origin, direction) = match (start, &places) {
                (Some(emitters), _) => {
                    let u: [f32; EMISSION_DIMENSIONS] = std::array::from_fn(|_| rng.f32());
                    let emitted = emitters.emit(1, u);
                    (emitted.origin, emitted.direction)
                }
                (None, Some(places)) => places.start(self.scene, i % 4 < 2, &mut rng),
                (None, None) => break,
            };
            photons.push(Photon { origin, direction, power, material: 0, finite: false });
        }
        photons
    }

    /// All light that `photons` become when they are reflected next.
    fn next(&self, photons: &[Photon], stream: u32, seen: &mut impl FnMut(&[Hit])) -> Vec<Photon> {
        let mut reflected = Vec::with_capacity(2 * photons.len());
        let mut hits = Vec::new();
        for (i, photon) in photons.iter().enumerate() {
            let mut rng = Rng::new(self.seed, Stream::Measure, stream, i as u64);
            let ray = Ray { origin: photon.origin, direction: photon.direction, t_max: f32::INFINITY };
            self.rays.crossings(&ray, &mut hits);
            seen(&hits);
            let mut power = photon.power;
            for hit in &hits {
                let surface = &self.scene.surfaces[self.scene.mesh.surface[hit.triangle as usize] as usize];
                let point = self.scene.mesh.point(hit.triangle, hit.u, hit.v, surface.smooth);
                reflected.extend(self.reflect(power, -photon.direction, &point, surface.material, &mut rng));
                power =
                    self.chain.crossed(self.scene.materials[surface.material as usize].bsdf.straight, power);
                if power == [0.0; 2] {
                    break;
                }
            }
        }
        reflected
    }

    /// What one surface reflects, by one of its lobes; None where nothing.
    fn reflect(
        &self,
        power: [f32; 2],
        from: Vec3,
        point: &SurfacePoint,
        material: u32,
        rng: &mut Rng,
    ) -> Option<Photon> {
        let terms = &self.scene.materials[material as usize].bsdf.terms;
        let strength = |index: usize| {
            let term = &terms[index];
            if term.lobe.responds(&point.normals, from) {
                let [invisible, visible] = self.chain.reflected(term.coefficient, power);
                (invisible + visible) * term.lobe.albedo()[self.channel]
            } else {
                0.0
            }
        };
        let (index, probability) = choose(terms.len(), strength, rng.f32())?;
        let term = &terms[index];
        let lobe = self.rays.lobe_at(term.lobe, point);
        let sample = lobe.sample(&point.normals, from, Transport::Shooting, rng.f32x3())?;
        let factor = sample.weight[self.channel] / probability;
        let power = self.chain.crossed(term.coefficient, power).map(|half| half * factor);
        let photon = Photon {
            origin: point.origin_towards(sample.to),
            direction: sample.to,
            power,
            material,
            finite: !term.lobe.is_delta(),
        };
        (photon.total() > 0.0).then_some(photon)
    }
}

impl Photon {
    fn total(&self) -> f32 {
        self.power[0] + self.power[1]
    }
}

fn total(photons: &[Photon]) -> f64 {
    photons.iter().map(|photon| f64::from(photon.total())).sum()
}

/// `n` photons of power one each, by systematic resampling: each photon as often as its power says, rounded up or down.
fn resample(photons: &[Photon], total: f64, n: u32, offset: f64) -> Vec<Photon> {
    let step = total / f64::from(n);
    let mut chosen = Vec::with_capacity(n as usize);
    let mut sum = 0.0;
    for photon in photons {
        sum += f64::from(photon.total());
        while chosen.len() < n as usize && (chosen.len() as f64 + offset) * step < sum {
            let scale = 1.0 / photon.total();
            chosen.push(Photon { power: photon.power.map(|half| half * scale), ..*photon });
        }
    }
    chosen
}

/// Triangles with a finite lobe, by area and by surface. Delta lobes are left out: light that is born on them may be
/// caught inside glass where no light from outside ever gets.
struct Places {
    triangles: Vec<u32>,
    /// Cumulative area, m².
    area: Vec<f64>,
    /// For each surface the range of its triangles in the list.
    surfaces: Vec<std::ops::Range<usize>>,
}

impl Places {
    fn of(scene: &Scene) -> Option<Self> {
        let mut places = Self { triangles: Vec::new(), area: Vec::new(), surfaces: Vec::new() };
        let mut sum = 0.0;
        let mut last = None;
        for (triangle, &surface) in (0..).zip(&scene.mesh.surface) {
            if !scene.material_of(triangle).bsdf.has_finite_lobe() {
                continue;
            }
            sum += f64::from(scene.mesh.area(triangle));
            places.triangles.push(triangle);
            places.area.push(sum);
            let end = places.triangles.len();
            match places.surfaces.last_mut().filter(|_| last == Some(surface)) {
                Some(range) => range.end = end,
                None => places.surfaces.push(end - 1..end),
            }
            last = Some(surface);
        }
        (sum > 0.0).then_some(places)
    }

    /// A start on a surface, cosine-distributed on one of its sides.
    fn start(&self, scene: &Scene, by_area: bool, rng: &mut Rng) -> (Vec3, Vec3) {
        let range = if by_area {
            0..self.area.len()
        } else {
            self.surfaces[pick(rng.f32(), self.surfaces.len())].clone()
        };
        let below = if range.start == 0 { 0.0 } else { self.area[range.start - 1] };
        let wanted = below + f64::from(rng.f32()) * (self.area[range.end - 1] - below);
        let index = range.start + self.area[range.clone()].partition_point(|sum| *sum <= wanted);
        let triangle = self.triangles[index.min(range.end - 1)];
        let [b1, b2] = warp::triangle(rng.f32x2());
        let point = scene.mesh.point(triangle, b1, b2, false);
        let front = point.normals.geometric;
        let terms = &scene.material_of(triangle).bsdf.terms;
        let backs = terms.iter().any(|term| term.lobe.responds(&point.normals, -front));
        let up = if backs && rng.f32() < 0.5 { -front } else { front };
        let direction = warp::to_world(up, warp::cosine_hemisphere(rng.f32x2()));
        (point.origin_towards(direction), direction)
    }
}

/// One of `n`, by `u` in [0, 1).
fn pick(u: f32, n: usize) -> usize {
    ((f64::from(u) * n as f64) as usize).min(n - 1)
}
