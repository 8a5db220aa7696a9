//! Pixels that deserve more than one camera path a pass.
//!
//! A pixel that an edge crosses shows one side in one pass and the other in the next: that is most of the noise that a picture of
//! direct light has, and a third of it with inter-reflection. More photons do not help there; more camera paths do, spread evenly over
//! the pixel. So a tile is looked at twice, as its direct light is. The pixels *around* one say, by how much they differ, how many
//! paths it deserves; if more than one, these replace the path that it had. As that does not depend on the pixel's own path,
//! the mean is unbiased, whatever the rule. Photons are shared by neighbours, so that their noise hardly shows in such differences.

use super::plain::Plain;
use super::{Density, Pixel, Walk};
use crate::sampling::{Rng, Sobol, Stream};

/// Most paths of a pixel.
const MOST: u32 = 8;
/// The relative variance around a pixel that one path is enough for; four times as much deserves two, as cost and variance
/// balance where the number goes with the standard deviation.
const ENOUGH: f32 = 0.03;

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
        let advice = &self.tally.advice;
        self.tally.open.retain(|begun| advice[begun.open.pixel].paths == 1);
        for (i, pixel) in pixels.iter_mut().enumerate() {
            let n = paths(self, i);
            if n == 1 {
                continue;
            }
            let place = [left + i % width, top + i / width];
            let number = place[1] as u64 * u64::from(self.film[0]) + place[0] as u64;
            let mut rng = Rng::new(self.plan.settings.seed, Stream::Again, pass, number);
            let strata = Sobol::<2>::of_dimensions(u64::from(rng.u32()) << 32 | u64::from(rng.u32()));
            *pixel = Pixel::EMPTY;
            self.tally.begin(i);
            for path in 0..n {
                self.path((place, strata.point(path, 0)), 1.0 / n as f32, pixel, &mut rng);
            }
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
