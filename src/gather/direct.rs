//! Direct light at a camera hit: what is known of it, and how many connections find out the rest.
//!
//! Where nothing hides a luminaire its irradiance has a closed form ([`Connections::unhidden`]), and connections need only
//! find what is hidden. A pixel shows α C + mean(V − α U), where C is the closed form, and V and U are what a connection
//! brings with and without what is in its way. Any α is right in the mean. Where the pixels around agree about the share of
//! the luminaire that is seen, α is that share, which leaves no noise in full light, in full shadow and behind matter that
//! lets a fixed part of all light through. In a penumbra α is zero, so that nothing is subtracted that might not be there. A
//! pixel of one pass may still fall below zero: at the outer edge of a penumbra, where all pixels around see the whole lamp
//! but this one does not, α C − α U has no sign. The mean needs it.
//!
//! In a penumbra a single connection is all or nothing. So a tile is gathered in two steps. First every hit makes one
//! connection. Then those of the *other* pixels around it determine α and how many connections its pixel deserves. As
//! neither depends on the pixel's own connections, the mean of all of them is unbiased, whatever the rule.

use super::again::{Sequence, paths};
use super::plain::Plain;
use super::reflected;
use super::shared::Arriving;
use super::{Density, Pixel};
use crate::connect::Connection;
#[cfg(doc)]
use crate::connect::Connections;
use crate::light::{Light, Row};
use crate::optics::Term;
use crate::photon::PathClass;
use crate::plan::Plan;
use crate::scene::SurfacePoint;
use glam::Vec3;
use std::num::NonZeroU32;

/// Most connections of a hit.
const MOST: u32 = 16;
/// The relative variance of a pixel for which one connection is enough; four deserve two, as cost and variance balance where the
/// number goes with the standard deviation.
const ENOUGH: f32 = 0.003;
/// The pixels around see the same share of what shines on them if what they bring differs from that by no more than f32's rounding:
/// this part of its square.
const ALIKE: f64 = 1e-10;
/// Pixels on each side that are asked.
const REACH: usize = 2;

/// A hit that is connected to luminaires.
pub(super) struct Open<const R: usize> {
    /// In its tile.
    pub pixel: usize,
    pub rows: [Row; R],
    pub term: Term,
    pub point: SurfacePoint,
    pub wo: Vec3,
    /// What absorbs light on the side of `wo` and behind, m⁻¹.
    pub absorption: [Vec3; 2],
    /// Its connections are by these.
    pub numbers: Sequence,
    /// The number of the place, whose terms share their connections. None: this one shares them with no other.
    pub place: Option<NonZeroU32>,
}

impl<const R: usize> Open<R> {
    /// What is read there is re-radiated on its way to the camera: by all rows or none.
    fn is_reradiated(&self) -> bool {
        self.rows[0].turn.is_reradiated()
    }

    /// What absorbs light on the side of the unit vector `wi`, m⁻¹.
    pub fn absorption_towards(&self, wi: Vec3) -> Vec3 {
        let behind = self.point.normals.is_front(self.wo) != self.point.normals.is_front(wi);
        self.absorption[usize::from(behind)]
    }
}

/// A hit whose first connection is made.
pub(super) struct Begun<const R: usize> {
    pub open: Open<R>,
    /// What would be seen if nothing hid the luminaires; zero where that is not known.
    whole: [Vec3; R],
    /// What the first connection brought.
    first: [Sampled; R],
}

/// What a connection brings.
#[derive(Clone, Copy, Default)]
struct Sampled {
    /// Through all that is in its way.
    seen: Vec3,
    /// If nothing were in its way; zero where that is of no use.
    unhidden: Vec3,
}

impl Sampled {
    /// What it tells beyond the closed form.
    fn less(self, alpha: f32) -> Vec3 {
        self.seen - alpha * self.unhidden
    }
}

/// What the pixels around one say about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Advice {
    /// Connections of the pixel's hits.
    connections: u32,
    /// Camera paths through it.
    pub paths: u32,
    /// The share of the closed form that is taken.
    alpha: f32,
}

impl<D: Density, const R: usize> Plain<'_, D, R> {
    /// Direct light at a hit by all luminaires that are summed, and the first connection to those that are chosen from.
    pub(super) fn connect(&mut self, open: Open<R>, pixel: &mut Pixel<R>) {
        let (plan, reradiated) = (self.plan, open.is_reradiated());
        let connections = &plan.connections;
        self.connect_all(&open, |sampled| {
            for (parts, sampled) in pixel.parts.iter_mut().zip(sampled) {
                parts.add(PathClass::Direct, sampled.seen, reradiated);
            }
        });
        let whole = if connections.has_closed_form() && open.term.lobe.is_lambert() {
            let Some(whole) = self.unhidden(&open) else {
                return; // all of them are below the horizon
            };
            whole
        } else {
            [Vec3::ZERO; R]
        };
        if connections.are_sampled() && !(connections.are_known() && open.term.lobe.is_lambert()) {
            let first = self.connection(&open, 0);
            self.open.push(Begun { open, whole, first });
        } else {
            for (parts, whole) in pixel.parts.iter_mut().zip(whole) {
                parts.add(PathClass::Direct, whole, reradiated);
            }
        }
    }

    /// Direct light at a hit of a path that was scattered before: chance adds up over its directions, one connection is enough.
    pub(super) fn connect_once(&mut self, open: &Open<R>, pixel: &mut Pixel<R>) {
        let plan = self.plan;
        let connections = &plan.connections;
        let mut add = |seen: [Vec3; R]| {
            for (parts, seen) in pixel.parts.iter_mut().zip(seen) {
                parts.add(PathClass::Indirect, seen, open.is_reradiated());
            }
        };
        self.connect_all(open, |sampled| add(sampled.map(|sampled| sampled.seen)));
        if connections.are_known() && open.term.lobe.is_lambert() {
            add(self.unhidden(open).unwrap_or([Vec3::ZERO; R]));
        } else if connections.are_sampled() {
            add(self.connection(open, 0).map(|sampled| sampled.seen));
        }
    }

    /// What a hit shows by all luminaires of closed form if nothing hides them. None: they are below its horizon, or there is no form.
    fn unhidden(&mut self, open: &Open<R>) -> Option<[Vec3; R]> {
        let diffuse = open.term.lobe.as_diffuse()?;
        let irradiance = match open.place {
            Some(place) => self.shared.unhidden(self.plan, open, place),
            None => self.plan.connections.unhidden(&open.point, open.wo),
        };
        let light = diffuse.towards(&open.point.normals, open.wo) * irradiance;
        (!light.is_zero()).then(|| open.rows.map(|row| row * light))
    }

    /// After the first look at a tile of `width` pixels a row: what the pixels around each one say about it.
    pub(super) fn look_around(&mut self, pixels: &[Pixel<R>], width: usize) {
        let sampled = &mut self.sampled;
        sampled.clear();
        sampled.resize(pixels.len(), [0.0; 3]);
        let mut seen: Vec<f32> = pixels.iter().map(|pixel| pixel.parts[0].total().element_sum()).collect();
        let mut total = seen.clone();
        for Begun { open, whole, first } in &self.open {
            let connected = first[0].seen.element_sum();
            let [seen_of_known, unhidden, unknown] = &mut sampled[open.pixel];
            *(if open.term.lobe.is_lambert() { seen_of_known } else { unknown }) += connected;
            *unhidden += first[0].unhidden.element_sum();
            total[open.pixel] += connected;
            // What is hidden is found out by connections, which cost less than paths.
            let whole = whole[0].element_sum();
            seen[open.pixel] += if whole > 0.0 { whole } else { connected };
        }
        self.advice = advice(sampled, &total, width);
        if !self.plan.settings.one_path {
            for (i, advice) in self.advice.iter_mut().enumerate() {
                advice.paths = paths(&seen, i, width);
            }
        }
    }

    /// The second go over a tile.
    pub(super) fn connect_more(&mut self, pixels: &mut [Pixel<R>]) {
        let mut open = std::mem::take(&mut self.open);
        for Begun { open, whole, first } in &open {
            let Advice { connections, paths, alpha } = self.advice[open.pixel];
            let n = (connections / paths).max(1);
            let mut sums = first.map(|first| first.less(alpha));
            for i in 1..n {
                for (sum, sampled) in sums.iter_mut().zip(self.connection(open, i)) {
                    *sum += sampled.less(alpha);
                }
            }
            for ((parts, sum), whole) in pixels[open.pixel].parts.iter_mut().zip(sums).zip(whole) {
                let seen = alpha * *whole + sum / n as f32;
                parts.add(PathClass::Direct, seen, open.is_reradiated());
            }
        }
        open.clear();
        self.open = open;
    }

    /// Shows `add` what a hit has of each luminaire that is connected at all of them.
    fn connect_all(&mut self, open: &Open<R>, mut add: impl FnMut([Sampled; R])) {
        let plan = self.plan;
        match open.place {
            Some(place) => {
                let arriving = self.shared.every(plan, open, place);
                arriving.iter().for_each(|arriving| add(reflect(plan, open, arriving)));
            }
            None => plan.connections.to_all(&plan.scene, &open.point, |connection| {
                add(self.look_through(open, &connection));
            }),
        }
    }

    /// What connection `i` of a hit brings to each picture.
    fn connection(&mut self, open: &Open<R>, i: u32) -> [Sampled; R] {
        if let Some(place) = open.place {
            let arriving = self.shared.one((self.plan, self.frame), open, place, i);
            return arriving.map_or([Sampled::default(); R], |arriving| reflect(self.plan, open, &arriving));
        }
        let Plan { connections, scene, .. } = self.plan;
        let sights = self.frame.sights.as_deref();
        let connection = connections.to_one(scene, sights, &open.point, open.numbers.point(i));
        connection.map_or([Sampled::default(); R], |connection| self.look_through(open, &connection))
    }

    /// The light of a connection that is reflected towards the camera.
    fn look_through(&self, open: &Open<R>, connection: &Connection) -> [Sampled; R] {
        let f = reflected(&open.term.lobe, &open.point, open.wo, connection);
        if f == Vec3::ZERO {
            return [Sampled::default(); R];
        }
        let absorption = open.absorption_towards(connection.wi);
        let (through, left) = self.plan.visibility_along(&connection.segment, absorption);
        sampled(self.plan, open, f, &Arriving { connection: *connection, through, left })
    }
}

/// What a hit reflects towards the camera of light whose way is known.
fn reflect<const R: usize>(plan: &Plan, open: &Open<R>, arriving: &Arriving) -> [Sampled; R] {
    let f = reflected(&open.term.lobe, &open.point, open.wo, &arriving.connection);
    sampled(plan, open, f, arriving)
}

/// The same, where the lobe has the value `f`, cosine included.
#[inline(always)]
fn sampled<const R: usize>(plan: &Plan, open: &Open<R>, f: Vec3, arriving: &Arriving) -> [Sampled; R] {
    let Arriving { connection, through, left } = arriving;
    let unhidden: Light = f * connection.light;
    let seen: Light = (f * *left) * (*through * connection.light);
    let known = plan.connections.has_closed_form() && open.term.lobe.is_lambert();
    open.rows
        .map(|row| Sampled { seen: row * seen, unhidden: if known { row * unhidden } else { Vec3::ZERO } })
}

/// What is summed over pixels.
const SUMS: usize = 9;

/// For each pixel of a tile, from what the first connections of the pixels around it brought with and without what is in
/// their way, and to lobes for which only the first is known (`sampled`): α is the share that is seen; connections go by the variance of what α leaves, relative to the
/// square of the mean of `total` there.
fn advice(sampled: &[[f32; 3]], total: &[f32], width: usize) -> Vec<Advice> {
    // Number, seen, unhidden, their squares and product, total, unknown, its square. In f64: each pixel is taken off its own sum again.
    let sums: Vec<[f64; SUMS]> = sampled
        .iter()
        .zip(total)
        .map(|(sampled, total)| {
            let ([v, u, w], total) = (sampled.map(f64::from), f64::from(*total));
            [1.0, v, u, v * v, v * u, u * u, total, w, w * w]
        })
        .collect();
    let around = around(&around(&sums, 1, width), width, sampled.len() / width);
    around
        .iter()
        .zip(&sums)
        .map(|(around, own)| {
            let [n, seen, unhidden, seen_seen, seen_unhidden, unhidden_unhidden, total, unknown, squared] =
                std::array::from_fn(|i| around[i] - own[i]);
            // In half shadow a difference would gain little and might fall below zero: there is none.
            let share = if unhidden > 0.0 { seen / unhidden } else { 0.0 };
            let squares = seen_seen - 2.0 * share * seen_unhidden + share * share * unhidden_unhidden;
            let alike = squares <= ALIKE * seen_seen;
            let (alpha, squares) = if alike { (share, squares) } else { (0.0, seen_seen) };
            let left = seen - alpha * unhidden;
            let sum = (n * squares - left * left) + (n * squared - unknown * unknown);
            let variance = (sum / (total * total)) as f32;
            // False also where nothing shines.
            let connections = if variance > ENOUGH {
                let n = (variance / ENOUGH).sqrt().min(MOST as f32);
                (n as u32).next_power_of_two()
            } else {
                1
            };
            Advice { connections, paths: 1, alpha: alpha as f32 }
        })
        .collect()
}

/// Sums over the pixels up to [`REACH`] away along an axis of `count` pixels, neighbours of which are `along` apart.
fn around(values: &[[f64; SUMS]], along: usize, count: usize) -> Vec<[f64; SUMS]> {
    let place = |i: usize| i / along % count;
    (0..values.len())
        .map(|i| {
            let (before, behind) = (REACH.min(place(i)), REACH.min(count - 1 - place(i)));
            let mut sum = [0.0; SUMS];
            for k in 0..=before + behind {
                let value = &values[i + k * along - before * along];
                sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += value);
            }
            sum
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn advice_does_not_ask_the_pixel_itself() {
        // Full light on the left, full shadow on the right, and between them pixels by chance.
        let (width, height) = (12, 6);
        let sample = |x: usize, y: usize| {
            let u = 1.0 + 0.1 * ((x * 7 + y * 5) % 4) as f32;
            let seen = x < 4 || (x < 8 && (x * 13 + y * 11).is_multiple_of(3));
            [if seen { u } else { 0.0 }, u, 0.0]
        };
        let pixels: Vec<[f32; 3]> = (0..height).flat_map(|y| (0..width).map(move |x| sample(x, y))).collect();
        let total = vec![1.0; pixels.len()];
        let given = advice(&pixels, &total, width);
        assert!((given[0].alpha - 1.0).abs() < 1e-6 && given[0].connections == 1);
        assert!(given[width - 1].alpha.abs() < 1e-6 && given[width - 1].connections == 1);
        assert!(given[5].alpha == 0.0 && given[5].connections > 2, "{:?}", given[5]);
        for i in [width + 1, 5, 2 * width + 6, 5 * width + 7] {
            let mut other = pixels.clone();
            other[i] = [1e3, 3e3, 0.0];
            let other = advice(&other, &total, width);
            assert_eq!(other[i].connections, given[i].connections);
            // In full light its neighbours take note.
            assert!(i != width + 1 || (given[i - 1].alpha == 1.0 && other[i - 1].alpha == 0.0));
            assert!((other[i].alpha - given[i].alpha).abs() < 1e-6);
        }
    }
}
