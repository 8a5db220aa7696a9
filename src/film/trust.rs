//! Whether an error bar can be trusted: tests of its tail.
//!
//! A spread over passes says nothing of a rare bright path before it has come a few times. After the statistical checks of MCNP (X-5
//! Monte Carlo Team, MCNP5 vol. I, 2003, §2.VI: the variance of the variance, and what would be if the largest score came once more),
//! here over the pixels of a picture, of which each keeps its brightest pass. Lamps that are looked at, whose edges a pixel may show in one
//! pass of many, are left aside: there is nothing hidden about them.

use super::sums::{Channel, DARK, Film};
use rayon::prelude::*;

/// How far the error of a picture rests upon few events.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Doubt {
    /// Relative variance of the squared noise, from above: as if all of one tile of the picture came of the same paths.
    pub variance_of_variance: f64,
    /// The share of the picture's light that pixels got in a single pass each, beyond what they get in the others. As much is to be
    /// expected of such paths in the places where none has come yet (Good 1953, *Biometrika* 40, eq. 9; the estimate is Turing's).
    /// Zero below eight passes, in which chance alone makes one stand out.
    pub single: f64,
    /// The relative noise of the picture if pixels that owe most of their spread to a single pass are as bright as their other passes
    /// say. Relative to what they show, a pixel is never off by more than once its own brightness.
    pub noise: f64,
}

/// The most of [`variance_of_variance`](Doubt::variance_of_variance) that is trusted: MCNP's.
const MOST_VARIANCE: f64 = 0.1;
/// By what factor the noise may be larger than it is told.
const MOST_HIDDEN: f64 = 1.5;
/// Passes from which single ones are told from the others.
const FEWEST: u32 = 8;
/// Tiles along the longer side: wider than most gather disks, whose pixels share their photons.
const TILES: u32 = 8;

impl Doubt {
    /// Why a relative error of `told` cannot be trusted. Empty: it can.
    pub fn reasons(self, told: f64) -> Vec<String> {
        let Self { variance_of_variance: variance, single, noise } = self;
        let variance = (variance > MOST_VARIANCE)
            .then(|| format!("its variance has a relative variance of {variance:.2}, for {MOST_VARIANCE}"));
        let single = (single > told).then(|| {
            format!("{:.1} % of the light came in single passes, and as much may be missing", 100.0 * single)
        });
        let noise = (noise > MOST_HIDDEN * told)
            .then(|| format!("if these are as rare as it seems, it is {:.1} %", 100.0 * noise));
        variance.into_iter().chain(single).chain(noise).collect()
    }
}

/// Sums over the pixels of a tile, or of a row of it.
#[derive(Clone, Copy, Default)]
struct Tile {
    /// Squared relative noise, over pixels and channels.
    told: f64,
    /// The same where pixels are as bright as passes say that do not stand out, without the photon more; times passes · (passes − 1).
    error: f64,
    /// That, times the root of the share of it that the brightest pass brought.
    shared: f64,
    /// Brightness.
    light: f64,
    single: f64,
}

impl Tile {
    fn plus(self, other: Self) -> Self {
        Self {
            told: self.told + other.told,
            error: self.error + other.error,
            shared: self.shared + other.shared,
            light: self.light + other.light,
            single: self.single + other.single,
        }
    }
}

impl Film {
    /// How far its error rests upon few events. None below two passes.
    pub fn doubt(&self) -> Option<Doubt> {
        self.noise_and_doubt().map(|(_, doubt)| doubt)
    }

    /// [`relative_error`](Self::relative_error) and [`doubt`](Self::doubt), which look at the same numbers.
    pub fn noise_and_doubt(&self) -> Option<(f64, Doubt)> {
        if self.passes() < 2 {
            return None;
        }
        let side = self.width().max(self.height()).div_ceil(TILES).max(1) as usize;
        let rows: Vec<Vec<Tile>> = (0..self.height() as usize)
            .into_par_iter()
            .map(|y| {
                let pixels: Vec<Tile> = (0..self.width() as usize).map(|x| self.pixel(y, x)).collect();
                pixels.chunks(side).map(sum).collect()
            })
            .collect();
        let tiles: Vec<Tile> = rows
            .chunks(side)
            .flat_map(|rows| {
                (0..rows[0].len()).map(|i| rows.iter().map(|row| row[i]).fold(Tile::default(), Tile::plus))
            })
            .collect();
        let whole = sum(&tiles);
        let squared: f64 = tiles.iter().map(|tile| tile.shared * tile.shared).sum();
        let of = |part: f64, whole: f64| if part > 0.0 { part / whole } else { 0.0 };
        let numbers = 3.0 * f64::from(self.width()) * f64::from(self.height());
        let doubt = Doubt {
            noise: (whole.error * self.variance_scale() / numbers).sqrt(),
            variance_of_variance: of(squared, whole.error * whole.error),
            single: of(whole.single, whole.light),
        };
        Some(((whole.told / numbers).sqrt(), doubt))
    }

    fn pixel(&self, y: usize, x: usize) -> Tile {
        let n = f64::from(self.passes());
        let channels = self.channels(y, x);
        let deviations = over(&channels, |channel| channel.deviations);
        let mean = over(&channels, |channel| channel.mean * channel.mean).sqrt();
        let beyond = (self.sums.peaks[y].scattered(x) - mean).max(0.0);
        let share = if deviations > 0.0 { (beyond * beyond / deviations).min(1.0) } else { 0.0 };
        let stands_out = share > 0.5 && self.passes() >= FEWEST;
        // By so much the mean of the others is lower than that of all.
        let single = if stands_out { beyond / (n - 1.0) } else { 0.0 };
        let others = if single > 0.0 { (1.0 - single / mean).max(0.0) } else { 1.0 };
        let error = over(&channels, |channel| channel.deviations / ((others * channel.mean).powi(2) + DARK));
        let told = over(&channels, |channel| channel.variance / (channel.mean * channel.mean + DARK));
        Tile { told, error, shared: error * share.sqrt(), light: mean, single }
    }
}

fn over(channels: &[Channel; 3], sum: impl Fn(&Channel) -> f64) -> f64 {
    channels.iter().map(sum).sum()
}

fn sum(tiles: &[Tile]) -> Tile {
    tiles.iter().copied().fold(Tile::default(), Tile::plus)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Asides, Layer, PassImage};
    use crate::sampling::{Rng, Stream};
    use glam::Vec3;

    const SIDE: u32 = 64;

    /// Passes of pixels that are uniform on 0.5 to 1.5, and with a small chance brighter by `bright`.
    fn film(seed: u64, passes: std::ops::Range<u32>, chance: f32, bright: f32) -> Film {
        let mut film = Film::new(SIDE, SIDE, &[]);
        for pass in passes {
            let pixel = |i: u32| {
                let mut rng = Rng::new(seed, Stream::Gather, pass, u64::from(i));
                let spike = if rng.f32() < chance { bright } else { 0.0 };
                Vec3::splat(0.5 + rng.f32() + spike)
            };
            let plane = (0..SIDE * SIDE).map(pixel).collect();
            film.add_pass(
                pass,
                &PassImage {
                    width: SIDE,
                    height: SIDE,
                    planes: vec![(Layer::Visible, plane)],
                    asides: Asides::default(),
                },
            );
        }
        film
    }

    #[test]
    fn plain_noise_is_trusted_after_any_number_of_passes() {
        for passes in [2, 4, 8, 9, 30] {
            let film = film(1, 0..passes, 0.0, 0.0);
            let doubt = film.doubt().expect("passes");
            assert!(doubt.reasons(film.relative_error().expect("passes")).is_empty(), "{passes}: {doubt:?}");
        }
        assert_eq!(film(1, 0..1, 0.0, 0.0).doubt(), None);
    }

    #[test]
    fn a_path_that_came_twice_is_not() {
        // Of 4096 pixels in 16 passes; told is an error of a few percent, while one spike more or less is half of it.
        let film = film(3, 0..16, 3e-5, 100.0);
        let (doubt, noise) = (film.doubt().expect("passes"), film.relative_error().expect("passes"));
        assert!(noise < 0.1 && doubt.variance_of_variance > MOST_VARIANCE, "{noise} {doubt:?}");
    }

    #[test]
    fn what_came_once_is_as_much_as_what_did_not_come() {
        // Each pixel has one spike in ten on an average: most of their light is not seen, in most pixels.
        let (passes, chance, bright) = (16, 0.1 / 16.0, 1000.0);
        let (mut told, mut real) = (Vec::new(), Vec::new());
        for seed in 0..16 {
            let film = film(seed, 0..passes, chance, bright);
            let light: f64 = film.mean(Layer::Visible).iter().map(|pixel| f64::from(pixel.x)).sum();
            let without = film.mean(Layer::Visible).iter().filter(|pixel| pixel.x < 10.0).count();
            told.push(film.doubt().expect("passes").single);
            real.push(without as f64 * f64::from(chance) * f64::from(bright) / light);
        }
        let (told, real) = (told.iter().sum::<f64>() / 16.0, real.iter().sum::<f64>() / 16.0);
        // Some 400 spikes in each of 16 films: 1.3 % of statistical error, each way.
        assert!((told / real - 1.0).abs() < 0.06, "{told} told, {real} missing");
        assert!(!Doubt { variance_of_variance: 0.0, single: told, noise: 0.3 }.reasons(0.3).is_empty());
    }

    #[test]
    fn it_does_not_matter_how_passes_came_together() {
        let whole = film(5, 0..20, 1e-3, 50.0);
        let mut parts = film(5, 13..20, 1e-3, 50.0);
        parts.merge(&film(5, 0..13, 1e-3, 50.0)).expect("other passes");
        assert_eq!(parts.doubt(), whole.doubt());
        assert_eq!(parts, whole);
    }
}
