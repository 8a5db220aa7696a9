//! The multiplication factor k: how much power is reflected next for each watt that is reflected now, in the long run.
//!
//! It is the dominant eigenvalue of the reflection operator, as k_eff of a reactor is that of fission (Lux, Koblinger 1991,
//! §5): the series of reflections converges if k < 1. It is measured by generations of photons. A generation is all light
//! that was just reflected. Each of its photons follows its straight line through all surfaces; what they reflect is the
//! next generation, which is resampled to a fixed number of photons.
//!
//! k is the geometric mean of the ratios of power over the active generations: where light goes back and forth between two
//! surfaces, single ratios alternate for ever, and only their product settles. The number of photons N biases k by O(1/N).
//! It is the k of light that luminaires send: a closed room that no light gets into does not count. Half of the first
//! generation leaves luminaires, half leaves places where light was seen to arrive, chosen alike however dark they are, so
//! that modes which luminaires hardly feed are found. What a mode below the largest leaves behind falls as (k₂/k)ⁿ. So
//! after the inactive generations and half of the active ones, k is low by no more than that mode's share × 1 / (e n).

use super::arrivals::{LOOK_AROUND, Places};
use super::chain::Chain;
use super::colours::{Colours, colours_that_matter};
use crate::optics::{Term, Transport};
use crate::rays::{Hit, Ray, Rays};
use crate::sampling::{Rng, Stream, choose};
use crate::scene::{MatterAt, Scene, SurfacePoint};
use glam::Vec3;
use rayon::prelude::*;

/// A measured multiplication factor.
#[derive(Clone, Debug, PartialEq)]
pub struct Multiplication {
    /// Of the colour channel where it is largest.
    pub k: f64,
    /// Its standard error, from independent batches.
    pub error: f64,
    /// That channel: 0 red, 1 green, 2 blue. Where re-radiation couples colours in a circle: the one with most of the power.
    pub channel: usize,
    /// By material: its share of the reflected power in the active generations.
    pub shares: Vec<f64>,
    /// Share of the reflected power that finite lobes reflected; zero where light is caught between mirrors or in glass.
    pub finite: f64,
    /// Straight lines followed.
    pub lines: u64,
}

/// Generations that are discarded, and as many that count at first: the fewest, where lines cross a great many surfaces,
/// and the most.
const GENERATIONS: [f64; 2] = [8.0, 32.0];
/// Independent batches: enough for an error bar of their mean that is itself known to a fifth.
pub(super) const BATCHES: u32 = 16;
/// Lines and crossings that the first look may cost in one channel: about a quarter of a second on two cores.
const FIRST_LOOK: f64 = 7e5;
/// What it costs at the most, as far as that many photons and generations can be done without.
const MOST: f64 = 32.0 * FIRST_LOOK;
/// Photons of a batch: the fewest, from where the bias O(1/N) is below the error, and to where more would only cost.
const POPULATION: [f64; 3] = [64.0, 256.0, 2048.0];
/// Near one, generations that count and photons are doubled in turn, up to so many times in all, to tell k from one.
/// Generations first: those that are discarded are not paid for again.
const MOST_DOUBLINGS: u32 = 5;
/// By so many standard errors.
const TOLD_APART: f64 = 6.0;
/// Measures k; `chain` says which halves go on. Equal arguments give equal bits for any number of threads.
pub(super) fn measure(scene: &Scene, rays: &Rays, chain: &Chain, seed: u64) -> Multiplication {
    let [fewest, enough, most] = POPULATION;
    let [shortest, longest] = GENERATIONS;
    let places = Places::new();
    let first = Population {
        scene,
        rays,
        chain,
        places: &places,
        seed,
        colours: Colours::ALL,
        photons: enough as u32,
        generations: longest as u32,
        doublings: 0,
    };
    let sets = colours_that_matter(scene);
    let cost = sets.iter().map(|&colours| Population { colours, ..first }.cost()).fold(1.0, f64::max);
    let per_generation = f64::from(BATCHES * 2) * cost;
    let photons = (FIRST_LOOK / (longest * per_generation)).clamp(enough, most);
    let photons = photons.min((MOST / (longest * per_generation)).max(fewest));
    let generations = (MOST / (photons * per_generation)).clamp(shortest, longest);
    let (photons, generations) = (photons as u32, generations as u32);
    let affordable = (MOST / (f64::from(photons * generations) * per_generation)).max(1.0);
    let most_doublings = MOST_DOUBLINGS.min(affordable.log2() as u32);

    let look = |colours: Colours, places: &Places, doublings: u32| {
        let photons = photons << (doublings / 2);
        Population { places, colours, photons, generations, doublings, ..first }.run()
    };
    let looks = sets.into_iter().map(|colours| {
        let places = Population { colours, photons, ..first }.places();
        (look(colours, &places, 0), places, colours)
    });
    let Some((mut best, places, colours)) = looks.reduce(|a, b| if b.0.k > a.0.k { b } else { a }) else {
        return Multiplication::none(scene);
    };
    // The error falls as the square root of the photons and of the generations.
    let needed = (TOLD_APART * best.error / (best.k - 1.0).abs()).powi(2);
    if needed > 1.0 && most_doublings > 0 {
        // One more, since how far k is from one is not well known either.
        let doublings = (needed.log2().ceil() as u32 + 1).min(most_doublings);
        let lines = best.lines;
        best = look(colours, &places, doublings);
        best.lines += lines;
    }
    best
}

impl Multiplication {
    /// Of a scene without light.
    fn none(scene: &Scene) -> Self {
        let shares = vec![0.0; scene.materials.len()];
        Self { k: 0.0, error: 0.0, channel: 0, shares, finite: 0.0, lines: 0 }
    }
}

/// Light on its way; all photons of a generation carry the same total.
#[derive(Clone, Copy)]
pub(super) struct Photon {
    pub(super) origin: Vec3,
    pub(super) direction: Vec3,
    /// Invisible and visible half of the one channel.
    pub(super) power: [f32; 2],
    pub(super) channel: u8,
    /// Twice the triangle that it left; one more where it left its back.
    pub(super) place: u32,
    pub(super) finite: bool,
    /// What absorbs light where it begins, in the channel, m⁻¹.
    pub(super) absorption: f32,
}

/// What all batches of one measurement have in common.
#[derive(Clone, Copy)]
pub(super) struct Population<'a> {
    pub(super) scene: &'a Scene,
    pub(super) rays: &'a Rays,
    pub(super) chain: &'a Chain,
    pub(super) places: &'a Places,
    pub(super) seed: u64,
    /// Those that are followed; what becomes another is lost.
    pub(super) colours: Colours,
    pub(super) photons: u32,
    pub(super) generations: u32,
    pub(super) doublings: u32,
}

/// What one batch found.
struct Batch {
    k: f64,
    shares: Vec<f64>,
    channels: [f64; 3],
    finite: f64,
    lines: u64,
}

impl Population<'_> {
    /// Lines and crossings per photon and generation.
    fn cost(&self) -> f64 {
        let mut crossings = 0;
        let photons = self.emitted(LOOK_AROUND - 1, self.photons);
        let mut seen = |hits: &[Hit]| crossings += hits.len();
        let reflected = self.next(&photons, self.open(), (LOOK_AROUND - 1) << 8, &mut seen);
        self.next(&reflected, self.closed(), (LOOK_AROUND - 1) << 8 | 1, &mut seen);
        1.0 + crossings as f64 / (photons.len() + reflected.len()).max(1) as f64
    }

    /// All light matters: that which luminaires send may come to take part.
    pub(super) fn open(&self) -> Kept {
        Kept { chain: self.chain.open(), colours: Colours::ALL }
    }

    /// Light matters that may become itself again.
    pub(super) fn closed(&self) -> Kept {
        Kept { chain: *self.chain, colours: self.colours }
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
            channel: (0..3).fold(self.colours.first(), |best, channel| {
                let power = |channel: usize| batches.iter().map(|batch| batch.channels[channel]).sum::<f64>();
                if power(channel) > power(best) { channel } else { best }
            }),
            shares,
            finite: batches.iter().map(|batch| batch.finite).sum::<f64>() / n,
            lines: batches.iter().map(|batch| batch.lines).sum(),
        }
    }

    fn batch(&self, batch: u32) -> Batch {
        // Measurements that were doubled share no numbers with those before.
        let stream = (self.doublings * 3 + self.colours.first() as u32) * BATCHES + batch;
        let mut photons = self.start(stream);
        let generations = self.generations;
        let shares = vec![0.0; self.scene.materials.len()];
        let mut found = Batch { k: 0.0, shares, channels: [0.0; 3], finite: 0.0, lines: 0 };
        let mut growth = 0.0;
        let active = generations << self.doublings.div_ceil(2);
        for generation in 0..generations + active {
            found.lines += photons.len() as u64;
            let now = total(&photons);
            let kept = if generation == 0 { self.open() } else { self.closed() };
            let reflected = self.next(&photons, kept, stream << 8 | generation, &mut |_| ());
            let next = total(&reflected);
            if next == 0.0 {
                return Batch { k: 0.0, ..found }; // this light is not reflected on
            }
            if generation >= generations {
                growth += (next / now).ln();
                let share = 1.0 / (next * f64::from(active));
                for photon in &reflected {
                    let power = f64::from(photon.total()) * share;
                    found.shares[self.material(photon.place / 2) as usize] += power;
                    found.channels[usize::from(photon.channel)] += power;
                    found.finite += if photon.finite { power } else { 0.0 };
                }
            }
            let offset = Rng::new(self.seed, Stream::Measure, stream << 8 | generation, u64::MAX).f32();
            photons = resample(&reflected, next, self.photons, f64::from(offset));
        }
        found.k = (growth / f64::from(active)).exp();
        found
    }

    /// The material of a triangle, as an index.
    fn material(&self, triangle: u32) -> u32 {
        self.scene.surface_of(triangle).material
    }

    /// All light that `photons` become when they are reflected next.
    pub(super) fn next(
        &self,
        photons: &[Photon],
        kept: Kept,
        stream: u32,
        seen: &mut impl FnMut(&[Hit]),
    ) -> Vec<Photon> {
        let mut reflected = Vec::with_capacity(2 * photons.len());
        let mut hits = Vec::new();
        for (i, photon) in photons.iter().enumerate() {
            let mut rng = Rng::new(self.seed, Stream::Measure, stream, i as u64);
            let ray = Ray { origin: photon.origin, direction: photon.direction, t_max: f32::INFINITY };
            self.rays.crossings(&ray, &mut hits);
            seen(&hits);
            let mut power = photon.power;
            let (mut absorption, mut before) = (photon.absorption, 0.0);
            for hit in &hits {
                if absorption != 0.0 {
                    let left = (-absorption * (hit.t - before)).exp();
                    power = power.map(|half| left * half);
                }
                before = hit.t;
                let MatterAt { material, point, bsdf, .. } =
                    self.scene.matter_at(hit.triangle, hit.u, hit.v, 0.0);
                let (from, channel) = (-photon.direction, usize::from(photon.channel));
                let arriving = Arriving { power, channel, from, triangle: hit.triangle, absorption };
                reflected.extend(self.reflect(&arriving, kept, &point, &bsdf.terms, &mut rng));
                let beyond = self.rays.absorption_towards(material, &point, photon.direction);
                absorption = beyond.map_or(absorption, |all| all[channel]);
                power = kept.chain.crossed(bsdf.straight, power);
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
        arriving: &Arriving,
        Kept { chain, colours }: Kept,
        point: &SurfacePoint,
        terms: &[Term],
        rng: &mut Rng,
    ) -> Option<Photon> {
        let Arriving { power, channel, from, triangle, absorption } = *arriving;
        let material = self.scene.material_of(triangle);
        let strength = |index: usize| {
            let term = &terms[index];
            if term.lobe.responds(&point.normals, from) && colours.contain(channel_after(term, channel)) {
                let [invisible, visible] = chain.reflected(term.coefficient, power);
                (invisible + visible) * term.lobe.share(&point.normals, from)[channel]
            } else {
                0.0
            }
        };
        let (index, probability) = choose(terms.len(), strength, rng.f32())?;
        let term = &terms[index];
        let lobe = self.rays.lobe_of_colour(term.lobe, material, point, channel);
        let sample = lobe.sample(&point.normals, from, Transport::Shooting, rng.f32x3())?;
        let factor = sample.weight[channel] / probability;
        let channel = channel_after(term, channel);
        let power = chain.crossed(term.coefficient, power).map(|half| half * factor);
        let photon = Photon {
            origin: point.origin_towards(sample.to),
            direction: sample.to,
            power,
            channel: channel as u8,
            place: 2 * triangle + u32::from(!point.normals.is_front(sample.to)),
            finite: !term.lobe.is_delta(),
            absorption: self
                .rays
                .absorption_towards(material, point, sample.to)
                .map_or(absorption, |all| all[channel]),
        };
        (photon.total() > 0.0).then_some(photon)
    }
}

/// The channel that light of one has after a term.
fn channel_after(term: &Term, channel: usize) -> usize {
    (channel + term.turn.colours()) % 3
}

/// The light that matters.
#[derive(Clone, Copy)]
pub(super) struct Kept {
    chain: Chain,
    colours: Colours,
}

/// Light that meets a surface.
struct Arriving {
    power: [f32; 2],
    channel: usize,
    /// Unit, back along its way.
    from: Vec3,
    triangle: u32,
    /// In the channel, on the side of `from`, m⁻¹.
    absorption: f32,
}

impl Photon {
    fn total(&self) -> f32 {
        self.power[0] + self.power[1]
    }

    /// A watt of it in these halves. None where it has nothing in them.
    pub(super) fn kept(&self, halves: [bool; 2]) -> Option<Self> {
        let power = [0, 1].map(|half| if halves[half] { self.power[half] } else { 0.0 });
        let scale = 1.0 / (power[0] + power[1]);
        scale.is_finite().then(|| Self { power: power.map(|half| half * scale), ..*self })
    }
}

pub(super) fn total(photons: &[Photon]) -> f64 {
    photons.iter().map(|photon| f64::from(photon.total())).sum()
}

/// `n` photons of power one each, by systematic resampling: each photon as often as its power says, rounded up or down.
pub(super) fn resample(photons: &[Photon], total: f64, n: u32, offset: f64) -> Vec<Photon> {
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
