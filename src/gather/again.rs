//! Pixels that deserve more than one camera path a pass.
//!
//! A pixel that an edge crosses shows one side in one pass and the other in the next: that is most of the noise that a picture of
//! direct light has, and a third of it with inter-reflection. More photons do not help there; more camera paths do, spread evenly over
//! the pixel. So a tile is looked at twice, as its direct light is. The pixels *around* one say, by how much they differ, how many
//! paths it deserves; if more than one, these replace the path that it had. As that does not depend on the pixel's own path,
//! the mean is unbiased, whatever the rule. Photons are shared by neighbours, so that their noise hardly shows in such differences.

use super::plain::Plain;
use super::{Density, Pixel, Walk};
use crate::sampling::{Rng, Sobol, Stream, hash};

/// Most paths of a pixel.
const MOST: u32 = 8;
/// The relative variance around a pixel that one path is enough for; four times as much deserves two, as cost and variance
/// balance where the number goes with the standard deviation.
const ENOUGH: f32 = 0.03;

/// The numbers of the connections of a hit: every `step`th point of a net, from point `first` on.
#[derive(Clone, Copy)]
pub(super) struct Sequence {
    sobol: Sobol<3>,
    first: u32,
    step: u32,
}

impl Sequence {
    /// All points of a net of its own.
    pub fn alone(rng: &mut Rng) -> Self {
        Self { sobol: Sobol::of_dimensions(rng.u64()), first: 0, step: 1 }
    }

    /// Three numbers in [0, 1), of connection `i`.
    pub fn point(&self, i: u32) -> [f32; 3] {
        self.sobol.point(self.first + self.step * i, 0)
    }
}

/// One of several paths through a pixel. The first hits of all of them take turns with the points of one net for
/// their connections, and so do the second ones.
pub(super) struct Again {
    key: u64,
    path: u32,
    paths: u32,
    /// Hits of this path that are connected.
    connected: u64,
}

impl Again {
    /// For the next hit.
    pub fn next(&mut self) -> Sequence {
        self.connected += 1;
        let sobol = Sobol::of_dimensions(hash(self.key ^ hash(self.connected)));
        Sequence { sobol, first: self.path, step: self.paths }
    }
}

impl<D: Density, const R: usize> Walk<'_, Plain<'_, D, R>, R> {
    /// The second look at a tile of `width` pixels a row, the first of which is at column `left` and row `top`.
    pub(super) fn look_again(
        &mut self,
        pixels: &mut [Pixel<R>],
        [left, top]: [usize; 2],
        width: usize,
        pass: u32,
    ) {
        let paths = |walk: &Self, i: usize| walk.tally.advice[i].paths;
        if (0..pixels.len()).all(|i| paths(self, i) == 1) {
            return;
        }
        let (advice, seed) = (&self.tally.advice, self.plan.settings.seed);
        self.tally.open.retain(|begun| advice[begun.open.pixel].paths == 1);
        for (i, pixel) in pixels.iter_mut().enumerate() {
            let n = paths(self, i);
            if n == 1 {
                continue;
            }
            let place = [left + i % width, top + i / width];
            let number = place[1] as u64 * u64::from(self.film[0]) + place[0] as u64;
            // Numbers of its own for each path: that one asks for more of them changes no other.
            let rng = |path: u32| {
                Rng::new(seed, Stream::Again, pass, number * u64::from(MOST + 1) + u64::from(path))
            };
            let mut shared = rng(MOST);
            let strata = Sobol::<2>::of_dimensions(shared.u64());
            let key = shared.u64();
            *pixel = Pixel::EMPTY;
            self.tally.begin(i);
            for path in 0..n {
                self.tally.again = Some(Again { key, path, paths: n, connected: 0 });
                self.path((place, strata.point(path, 0)), 1.0 / n as f32, pixel, &mut rng(path));
            }
            self.tally.again = None;
        }
    }
}

/// How many camera paths pixel `i` deserves by what is seen in the others around it: a power of two.
pub(super) fn paths(seen: &[f32], i: usize, width: usize) -> u32 {
    let (x, y, height) = (i % width, i / width, seen.len() / width);
    let (mut n, mut sum, mut squares) = (0.0_f32, 0.0_f32, 0.0_f32);
    for y in y.saturating_sub(1)..(y + 2).min(height) {
        for x in x.saturating_sub(1)..(x + 2).min(width) {
            let other = y * width + x;
            if other != i {
                n += 1.0;
                sum += seen[other];
                squares += seen[other] * seen[other];
            }
        }
    }
    let variance = (n * squares - sum * sum) / (sum * sum);
    // False also where nothing is seen.
    if variance > ENOUGH {
        ((variance / ENOUGH).sqrt().min(MOST as f32) as u32).next_power_of_two()
    } else {
        1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_even_or_dark_deserves_one_path_and_edges_deserve_several() {
        let even = [0.3; 25];
        let dark = [0.0; 25];
        let edge: Vec<f32> = (0..25).map(|i| if i % 5 < 2 { 1.0 } else { 0.02 }).collect();
        for i in 0..25 {
            assert_eq!((paths(&even, i, 5), paths(&dark, i, 5)), (1, 1));
            let (expected, x) = (paths(&edge, i, 5), i % 5);
            assert_eq!(expected > 1, (1..=2).contains(&x), "column {x}: {expected}");
            assert!(expected.is_power_of_two() && expected <= MOST);
        }
    }

    #[test]
    fn a_pixel_has_no_say_in_how_many_paths_it_deserves() {
        let mut seen: Vec<f32> = (0..25).map(|i| 1.0 + 0.1 * (i % 7) as f32).collect();
        let expected = paths(&seen, 12, 5);
        for own in [0.0, 7.0, 1e30] {
            seen[12] = own;
            assert_eq!(paths(&seen, 12, 5), expected);
        }
    }
}
