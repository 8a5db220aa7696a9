//! A panorama as a luminaire: what shines from where, and directions in proportion to it.

use super::Panorama;
use super::distribution::{Distribution, integral};
use crate::light::Light;
use crate::sampling::warp;
use crate::scene::Fnv;
use glam::{Mat3, Vec3};
use rayon::prelude::*;
use std::f32::consts::{FRAC_1_PI, TAU};
use std::sync::Arc;

/// The light of the sky that is seen, where it is not that which lights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Background {
    /// The same that lights: both halves are alike.
    #[default]
    Same,
    /// None: its visible half is zero.
    Black,
    /// Of one colour: the visible half, W m⁻² sr⁻¹.
    Colour(Vec3),
}

/// Light from infinitely far away, from all directions: a [`Panorama`], turned and scaled, and what is seen of it.
#[derive(Clone)]
pub struct Environment {
    panorama: Arc<Panorama>,
    /// What directions are chosen by. None where all are alike: it is constant, or black.
    distribution: Option<Arc<Distribution>>,
    /// Of the invisible half, per unit of the panorama.
    strength: f32,
    /// From the panorama's own space to the scene's.
    turn: Mat3,
    background: Background,
    /// Share of directions that are chosen uniformly over the sphere.
    uniform: f32,
    /// ∫ L dω, W m⁻².
    fluence: Light,
    /// Of the panorama's texels, which may be millions.
    digest: u64,
    /// Where the panorama is from, in words.
    name: String,
}

/// The turn of an environment about +y: counter-clockwise as seen from above, in degrees.
pub fn upright(rotation: f32) -> Mat3 {
    Mat3::from_rotation_y(rotation.rem_euclid(360.0).to_radians())
}

/// Rows of a panorama below which rows are divided: directions within a texel are chosen alike, and it should hardly differ there.
const FINE: u32 = 256;

impl Environment {
    /// `name` is for messages; `strength` ≥ 0 scales what lights; `turn` is a rotation, as [`upright`] makes them.
    pub fn new(name: &str, panorama: Panorama, strength: f32, turn: Mat3, background: Background) -> Self {
        let constant = (panorama.width(), panorama.height()) == (1, 1);
        let panorama = if constant { panorama } else { finer(panorama) };
        let distribution = if constant { None } else { Distribution::new(&panorama).map(Arc::new) };
        let whole = strength * integral(&panorama);
        let visible = match background {
            Background::Same => whole,
            Background::Black => Vec3::ZERO,
            Background::Colour(colour) => 2.0 * TAU * colour,
        };
        Self {
            uniform: if distribution.is_some() { 0.0 } else { 1.0 },
            digest: digest(&panorama),
            panorama: Arc::new(panorama),
            distribution,
            strength,
            turn,
            background,
            fluence: Light::new(whole, visible),
            name: name.into(),
        }
    }

    /// Of one colour, W m⁻² sr⁻¹.
    pub fn constant(radiance: Vec3) -> Self {
        let panorama = Panorama::constant(radiance);
        Self::new("constant", panorama, 1.0, Mat3::IDENTITY, Background::Same)
    }

    /// ∫ L dω over all directions, W m⁻².
    pub fn fluence(&self) -> Light {
        self.fluence
    }

    /// What it is, in words.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its radiance, where that is the same from everywhere.
    pub fn as_constant(&self) -> Option<Light> {
        self.distribution.is_none().then(|| self.radiance(Vec3::Y))
    }

    /// What shines from the unit vector `to`, W m⁻² sr⁻¹.
    pub fn radiance(&self, to: Vec3) -> Light {
        let lights = self.strength * self.panorama.seen(self.place(to));
        let visible = match self.background {
            Background::Same => lights,
            Background::Black => Vec3::ZERO,
            Background::Colour(colour) => colour,
        };
        Light::new(lights, visible)
    }

    /// A direction to where light comes from, and its density (sr⁻¹), from numbers in [0, 1).
    pub fn sample(&self, [a, b]: [f32; 2]) -> (Vec3, f32) {
        let to = match &self.distribution {
            Some(distribution) if a >= self.uniform => {
                let a = ((a - self.uniform) / (1.0 - self.uniform)).min(1.0 - f32::EPSILON);
                (self.turn * distribution.sample(&self.panorama, [a, b])).normalize()
            }
            _ => warp::sphere([b, (a / self.uniform).min(1.0 - f32::EPSILON)]),
        };
        (to, self.density(to))
    }

    /// Density (sr⁻¹) with which [`sample`](Self::sample) chooses a direction.
    pub fn density(&self, to: Vec3) -> f32 {
        let even = self.uniform * 0.25 * FRAC_1_PI;
        let Some(distribution) = &self.distribution else { return even };
        even + (1.0 - self.uniform) * distribution.density(&self.panorama, self.turn.transpose() * to)
    }

    /// The numbers that [`sample`](Self::sample) makes a direction of: its inverse, where
    /// it [has one](Self::is_invertible).
    pub fn numbers(&self, to: Vec3) -> [f32; 2] {
        match &self.distribution {
            None => [(to.y.atan2(to.x) / TAU).rem_euclid(1.0), 0.5 - 0.5 * to.z],
            Some(distribution) => {
                let [a, b] = distribution.numbers(&self.panorama, self.turn.transpose() * to);
                [self.uniform + a * (1.0 - self.uniform), b]
            }
        }
    }

    /// True where each direction has but one pair of [`numbers`](Self::numbers).
    pub fn is_invertible(&self) -> bool {
        self.uniform == 0.0 || self.distribution.is_none()
    }

    /// Chooses directions also by what is seen alone, where matter makes light of that.
    pub(crate) fn visible_lights(&mut self, lights: bool) {
        let apart = matches!(self.background, Background::Colour(_));
        if let (Some(_), true) = (&self.distribution, apart) {
            self.uniform = if lights { 0.5 } else { 0.0 };
        }
    }

    /// What its picture alone takes in memory.
    pub fn picture_bytes(&self) -> usize {
        self.panorama.bytes()
    }

    /// What it takes in memory.
    pub fn bytes(&self) -> usize {
        self.panorama.bytes() + self.distribution.as_ref().map_or(0, |distribution| distribution.bytes())
    }

    /// The place of the panorama that is seen towards `to`.
    fn place(&self, to: Vec3) -> [f32; 2] {
        Panorama::place(self.turn.transpose() * to)
    }

    /// The same, turned with a scene that is turned.
    #[must_use]
    pub fn turned(&self, by: Mat3) -> Self {
        Self { turn: by * self.turn, ..self.clone() }
    }

    /// Everything that decides what shines: for a hash.
    pub(crate) fn parts(&self) -> (u64, f32, Mat3, Background) {
        (self.digest, self.strength, self.turn, self.background)
    }
}

impl std::fmt::Debug for Environment {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { name, strength, background, .. } = self;
        write!(f, "Environment({name}, strength {strength}, {background:?})")
    }
}

impl Panorama {
    /// The four texels around a place, and their shares: the seam is no edge, a pole is one.
    pub(super) fn around(&self, [u, v]: [f32; 2]) -> [(u32, u32, f32); 4] {
        let (width, height) = (self.width(), self.height());
        let (x, y) = (f64::from(u) * f64::from(width) - 0.5, f64::from(v) * f64::from(height) - 0.5);
        let (left, above) = (x.floor(), y.floor());
        let (right, down) = ((x - left) as f32, (y - above) as f32);
        let column = |x: f64| (x as i64).rem_euclid(i64::from(width)) as u32;
        let row = |y: f64| (y as i64).clamp(0, i64::from(height) - 1) as u32;
        let (columns, rows) = ([column(left), column(left + 1.0)], [row(above), row(above + 1.0)]);
        [
            (columns[0], rows[0], (1.0 - right) * (1.0 - down)),
            (columns[1], rows[0], right * (1.0 - down)),
            (columns[0], rows[1], (1.0 - right) * down),
            (columns[1], rows[1], right * down),
        ]
    }

    /// Radiance at a place, bilinear between the middles of texels.
    pub fn seen(&self, place: [f32; 2]) -> Vec3 {
        self.around(place).into_iter().map(|(x, y, share)| share * self.at(x, y)).sum()
    }
}

/// A hash of its size and of all its texels.
fn digest(panorama: &Panorama) -> u64 {
    let (width, height) = (panorama.width(), panorama.height());
    let of_row = |y: u32| {
        let mut fnv = Fnv::EMPTY;
        for texel in (0..width).map(|x| panorama.at(x, y)) {
            texel.to_array().into_iter().for_each(|x| fnv.word(u64::from(x.to_bits())));
        }
        fnv.0
    };
    let rows: Vec<u64> = (0..height).into_par_iter().map(of_row).collect();
    let mut fnv = Fnv::EMPTY;
    [width, height].into_iter().map(u64::from).chain(rows).for_each(|word| fnv.word(word));
    fnv.0
}

/// The same picture on more texels: an odd number for each, so that the old middles are among the new.
fn finer(panorama: Panorama) -> Panorama {
    let (width, height) = (panorama.width(), panorama.height());
    let times = FINE.div_ceil(height) | 1;
    if height >= FINE {
        return panorama;
    }
    let [w, h] = [width, height].map(|side| side * times);
    let place = |i: u32, side: u32| (i as f32 + 0.5) / side as f32;
    let texels = (0..h).flat_map(|y| (0..w).map(move |x| [place(x, w), place(y, h)]));
    Panorama::of_texels(w, h, texels.map(|place| panorama.seen(place)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sobol;
    use glam::Vec2;
    use std::f32::consts::PI;

    /// A sky with a small sun, dim elsewhere, and something at both poles.
    fn sky(width: u32, height: u32) -> Environment {
        let texel = |i: u32| {
            let (x, y) = (i % width, i / width);
            let sun = if (x, y) == (width / 3, height / 4) { 1e3 } else { 0.0 };
            Vec3::new(0.2, 0.1 + (x % 3) as f32, 0.3 + 0.1 * y as f32) + sun
        };
        let panorama = Panorama::of_texels(width, height, (0..width * height).map(texel).collect());
        Environment::new("test", panorama, 0.7, upright(33.0), Background::Same)
    }

    #[test]
    fn numbers_and_directions_are_one() {
        for (width, height) in [(1, 1), (7, 5), (64, 32), (40, 300)] {
            let sky = if width == 1 { Environment::constant(Vec3::ONE) } else { sky(width, height) };
            for i in 0..2000 {
                let numbers = Sobol::new(4).point::<2>(i, 0);
                let (to, _) = sky.sample(numbers);
                let (again, _) = sky.sample(sky.numbers(to));
                assert!(again.distance(to) < 2e-3, "{width}x{height}: {numbers:?}, {to}, {again}");
                let off = (Vec2::from(sky.numbers(to)) - Vec2::from(numbers)).abs();
                assert!(off.max_element() < 2e-3 || to.y.abs() > 0.999, "{numbers:?}, {:?}", sky.numbers(to));
            }
        }
    }

    #[test]
    fn directions_follow_the_density_that_is_told_and_nothing_is_missed() {
        for (width, height) in [(2, 1), (7, 5), (64, 32), (40, 300)] {
            let sky = sky(width, height);
            let n = 1 << 16;
            let sobol = Sobol::new(5);
            let (mut sphere, mut light, mut up) = (0.0, glam::DVec3::ZERO, 0.0);
            for i in 0..n {
                let (to, density) = sky.sample(sobol.point::<2>(i, 0));
                assert!(to.is_normalized() && density > 0.0);
                let weight = f64::from(1.0 / density);
                sphere += weight;
                light += weight * sky.radiance(to).invisible.as_dvec3();
                up += weight * f64::from(to.y * to.y);
            }
            let n = f64::from(n);
            let fits = |found: f64, expected: f64| (found / expected - 1.0).abs() < 5e-3;
            let whole = sky.fluence().invisible.as_dvec3();
            let pairs = [(light.x, whole.x), (light.y, whole.y), (light.z, whole.z)];
            for (found, expected) in pairs {
                assert!(fits(found / n, expected), "{width}x{height}: {} for {expected}", found / n);
                assert!(!fits(1.02 * found / n, expected));
            }
            // Where it is dim few directions go: these are noisier.
            let bounds =
                [(sphere / n, 4.0 * std::f64::consts::PI), (up / n, 4.0 / 3.0 * std::f64::consts::PI)];
            for (found, expected) in bounds {
                assert!((found / expected - 1.0).abs() < 0.05, "{width}x{height}: {found} for {expected}");
            }
        }
    }

    #[test]
    fn the_fluence_is_that_of_what_is_seen() {
        let sky = sky(7, 5);
        let (rows, columns) = (2000, 700);
        let mut sum = glam::DVec3::ZERO;
        for y in 0..rows {
            let (a, b) = (f64::from(y) / f64::from(rows), f64::from(y + 1) / f64::from(rows));
            let share = (a * std::f64::consts::PI).cos() - (b * std::f64::consts::PI).cos();
            for x in 0..columns {
                let place = [(x as f32 + 0.5) / columns as f32, (y as f32 + 0.5) / rows as f32];
                let to = sky.turn * Panorama::direction(place);
                sum += share * sky.radiance(to).invisible.as_dvec3();
            }
        }
        let found =
            sky.fluence().invisible.as_dvec3() / (sum * 2.0 * std::f64::consts::PI / f64::from(columns));
        assert!((found - 1.0).abs().max_element() < 1e-3, "{found}");
    }

    #[test]
    fn turning_by_a_whole_turn_changes_nothing_and_by_a_quarter_moves_x_to_minus_z() {
        let panorama = || Panorama::of_texels(8, 4, (0..32).map(|i| Vec3::splat(i as f32)).collect());
        let at =
            |rotation: f32| Environment::new("test", panorama(), 1.0, upright(rotation), Background::Same);
        for to in [Vec3::X, Vec3::new(0.6, 0.0, -0.8), Vec3::new(0.0, 0.8, 0.6)] {
            assert_eq!(at(0.0).radiance(to), at(360.0).radiance(to));
            assert_eq!(at(0.0).radiance(to), at(-720.0).radiance(to));
        }
        let off = at(90.0).radiance(-Vec3::Z).visible - at(0.0).radiance(Vec3::X).visible;
        assert!(off.abs().max_element() < 1e-4, "{off}");
    }

    #[test]
    fn what_is_seen_may_differ_from_what_lights() {
        let lit = |background| {
            let sky =
                Environment::new("test", Panorama::constant(Vec3::ONE), 2.0, Mat3::IDENTITY, background);
            (sky.radiance(Vec3::X), sky.fluence().visible.x / (4.0 * PI))
        };
        let two = Vec3::splat(2.0);
        assert_eq!(lit(Background::Black), (Light::new(two, Vec3::ZERO), 0.0));
        let (light, mean) = lit(Background::Colour(Vec3::splat(0.5)));
        assert_eq!(light, Light::new(two, Vec3::splat(0.5)));
        assert!((mean - 0.5).abs() < 1e-6);
    }
}
