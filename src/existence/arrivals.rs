//! Where generations of light start: at luminaires, and where their light arrives.

use super::multiplication::{BATCHES, Photon, Population, resample, total};
use crate::emission::{EMISSION_DIMENSIONS, Emitters};
use crate::light::Light;
use crate::sampling::{Rng, Stream};
use crate::scene::{Luminaire, Scene};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Generations in which emitted light is followed to see where it arrives.
const ARRIVALS: u32 = 8;

/// The random numbers of emitted light, beside those of the generations.
const EMITTED: u32 = 0xff;
/// Those of the first look around: no batch has this number.
pub(super) const LOOK_AROUND: u32 = 0x1000;

/// Light that was reflected, by the side of the triangle that it left: the first there was of each.
pub(super) type Places = BTreeMap<u32, Photon>;

/// Channels whose k may be the largest: those in which something shines, and that no other one filters less in every
/// lobe while all that shines in them shines in it too.
pub(super) fn channels_that_matter(scene: &Scene) -> Vec<usize> {
    let filters = |channel: usize| -> Vec<f32> {
        let terms = scene.materials.iter().flat_map(|material| &material.bsdf.terms);
        terms.map(|term| term.lobe.bound()[channel]).collect()
    };
    let filters = [filters(0), filters(1), filters(2)];
    let emits = |luminaire: &Luminaire, channel: usize| {
        let light = luminaire.power(1.0);
        light.invisible[channel] > 0.0 || light.visible[channel] > 0.0
    };
    let shines = |channel: usize| scene.luminaires.iter().any(|l| emits(l, channel));
    let below = |a: usize, b: usize| {
        let nowhere_above = filters[a].iter().zip(&filters[b]).all(|(x, y)| x <= y);
        let lit_as_well = scene.luminaires.iter().all(|l| emits(l, b) || !emits(l, a));
        let alike = filters[a] == filters[b] && scene.luminaires.iter().all(|l| emits(l, a) == emits(l, b));
        nowhere_above && lit_as_well && (!alike || b < a)
    };
    (0..3).filter(|a| shines(*a) && !(0..3).any(|b| b != *a && below(*a, b))).collect()
}

impl Population<'_> {
    /// Follows emitted light to see where it arrives.
    pub(super) fn places(&self) -> Places {
        let parts: Vec<Places> = (0..BATCHES).into_par_iter().map(|part| self.some_places(part)).collect();
        let mut places = Places::new();
        for (place, photon) in parts.into_iter().flatten() {
            places.entry(place).or_insert(photon);
        }
        places
    }

    fn some_places(&self, part: u32) -> Places {
        let stream = LOOK_AROUND + self.channel as u32 * BATCHES + part;
        let mut photons = self.emitted(stream, self.photons);
        let mut places = Places::new();
        for generation in 0..ARRIVALS {
            let chain = if generation == 0 { self.chain.open() } else { *self.chain };
            let reflected = self.next(&photons, chain, stream << 8 | generation, &mut |_| ());
            let offset = Rng::new(self.seed, Stream::Measure, stream << 8 | generation, u64::MAX).f32();
            photons = resample(&reflected, total(&reflected), self.photons, f64::from(offset));
            for photon in photons.iter().filter_map(|photon| photon.kept(self.chain.live)) {
                places.entry(photon.place).or_insert(photon);
            }
        }
        places
    }

    /// The first generation: half from luminaires, half from the places where their light arrives.
    pub(super) fn start(&self, stream: u32) -> Vec<Photon> {
        let places: Vec<&Photon> = self.places.values().collect();
        let mut photons =
            self.emitted(stream, if places.is_empty() { self.photons } else { self.photons / 2 });
        if !places.is_empty() {
            for i in self.photons / 2..self.photons {
                let mut rng = Rng::new(self.seed, Stream::Measure, stream << 8 | EMITTED, u64::from(i));
                photons.push(*places[pick(rng.f32(), places.len())]);
            }
        }
        photons
    }

    /// Light that leaves luminaires in this channel.
    pub(super) fn emitted(&self, stream: u32, n: u32) -> Vec<Photon> {
        let Some(emitters) = Emitters::<Light>::new(self.scene) else { return Vec::new() };
        let photon = |i: u32| {
            let mut rng = Rng::new(self.seed, Stream::Measure, stream << 8 | EMITTED, u64::from(i));
            let u: [f32; EMISSION_DIMENSIONS] = std::array::from_fn(|_| rng.f32());
            let emitted = emitters.emit(1, u);
            let power = [emitted.power.invisible, emitted.power.visible].map(|half| half[self.channel]);
            let (origin, direction) = (emitted.origin, emitted.direction);
            Photon { origin, direction, power, place: 0, finite: false, absorption: 0.0 }.kept([true; 2])
        };
        (0..n).filter_map(photon).collect()
    }
}

/// One of `n`, by `u` in [0, 1).
fn pick(u: f32, n: usize) -> usize {
    ((f64::from(u) * n as f64) as usize).min(n - 1)
}
