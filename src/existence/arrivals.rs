//! Where generations of light start: at luminaires, and where their light arrives.

use super::multiplication::{BATCHES, Photon, Population, resample, total};
use crate::emission::{EMISSION_DIMENSIONS, Emitters};
use crate::light::Light;
use crate::sampling::{Rng, Stream, choose};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Generations in which emitted light is followed to see where it arrives.
const ARRIVALS: u32 = 8;

/// The random numbers of emitted light, beside those of the generations.
const EMITTED: u32 = 0xff;
/// Those of the first look around: no batch has this number.
pub(super) const LOOK_AROUND: u32 = 0x1000;

/// Light that was reflected, by the side of the triangle that it left and its colour: the first there was of each.
pub(super) type Places = BTreeMap<(u32, u8), Photon>;

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
        let stream = LOOK_AROUND + self.colours.first() as u32 * BATCHES + part;
        let mut photons = self.emitted(stream, self.photons);
        let mut places = Places::new();
        for generation in 0..ARRIVALS {
            // What is re-radiated may come to take part later.
            let open = generation == 0 || self.scene.fluoresces();
            let kept = if open { self.open() } else { self.closed() };
            let reflected = self.next(&photons, kept, stream << 8 | generation, &mut |_| ());
            let offset = Rng::new(self.seed, Stream::Measure, stream << 8 | generation, u64::MAX).f32();
            photons = resample(&reflected, total(&reflected), self.photons, f64::from(offset));
            let takes_part = |photon: &&Photon| self.colours.contain(usize::from(photon.channel));
            let those = photons.iter().filter(takes_part).filter_map(|photon| photon.kept(self.chain.live));
            for photon in those {
                places.entry((photon.place, photon.channel)).or_insert(photon);
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

    /// Light that leaves luminaires: in this channel, or where matter re-radiates in any.
    pub(super) fn emitted(&self, stream: u32, n: u32) -> Vec<Photon> {
        let Some(emitters) = Emitters::<Light>::new(self.scene) else { return Vec::new() };
        let fluoresces = self.scene.fluoresces();
        let photon = |i: u32| {
            let mut rng = Rng::new(self.seed, Stream::Measure, stream << 8 | EMITTED, u64::from(i));
            let u: [f32; EMISSION_DIMENSIONS] = std::array::from_fn(|_| rng.f32());
            let emitted = emitters.emit(1, u);
            let channel = match fluoresces {
                true => choose(3, |c| emitted.power.colours()[c], rng.f32())?.0,
                false => self.colours.first(),
            };
            let power = [emitted.power.invisible, emitted.power.visible].map(|half| half[channel]);
            let (origin, direction) = (emitted.origin, emitted.direction);
            let (place, finite, absorption) = (0, false, 0.0);
            Photon { origin, direction, power, channel: channel as u8, place, finite, absorption }
                .kept([true; 2])
        };
        (0..n).filter_map(photon).collect()
    }
}

/// One of `n`, by `u` in [0, 1).
fn pick(u: f32, n: usize) -> usize {
    ((f64::from(u) * n as f64) as usize).min(n - 1)
}
