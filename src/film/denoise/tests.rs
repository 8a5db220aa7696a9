use super::*;
use crate::sampling::{Rng, Stream};

const SIDE: u32 = 96;
const PIXELS: usize = (SIDE * SIDE) as usize;
const PASSES: u32 = 16;

/// A picture of passes, of one wall.
struct Wall {
    picture: Vec<Vec3>,
    error: Vec<Vec3>,
    albedo: Vec<Vec3>,
    normal: Vec<Vec3>,
}

impl Wall {
    /// `sample` makes one pass.
    fn of(sample: impl Fn(&mut Rng, u32) -> Vec<f32>) -> Self {
        let (mut sums, mut squares) = (vec![0.0_f64; PIXELS], vec![0.0_f64; PIXELS]);
        for pass in 0..PASSES {
            let mut rng = Rng::new(7, Stream::Test, pass, 0);
            for (i, x) in sample(&mut rng, pass).into_iter().map(f64::from).enumerate() {
                sums[i] += x;
                squares[i] += x * x;
            }
        }
        let n = f64::from(PASSES);
        let mean = |i: usize| sums[i] / n;
        let error = |i: usize| ((squares[i] / n - mean(i) * mean(i)).max(0.0) / (n - 1.0)).sqrt();
        let plane = |of: &dyn Fn(usize) -> f64| (0..PIXELS).map(|i| Vec3::splat(of(i) as f32)).collect();
        Self {
            picture: plane(&mean),
            error: plane(&error),
            albedo: vec![Vec3::splat(0.5); PIXELS],
            normal: vec![Vec3::Z; PIXELS],
        }
    }

    fn noisy(&self) -> Noisy<'_> {
        let Self { picture, error, albedo, normal } = self;
        Noisy { width: SIDE, height: SIDE, picture, error, albedo, normal }
    }

    fn denoised(&self) -> Vec<Vec3> {
        denoise(&self.noisy())
    }
}

/// With a mean of zero and a variance of one.
fn bell(rng: &mut Rng) -> f32 {
    (0..12).map(|_| rng.f32()).sum::<f32>() - 6.0
}

fn independent(size: f32, truth: impl Fn(usize) -> f32) -> Wall {
    Wall::of(|rng, _| (0..PIXELS).map(|i| truth(i) * (1.0 + size * bell(rng))).collect())
}

/// The root of the mean square of what a picture is off.
fn off(picture: &[Vec3], truth: impl Fn(usize) -> f32) -> f64 {
    let square = |(i, x): (usize, &Vec3)| f64::from(x.x - truth(i)).powi(2);
    (picture.iter().enumerate().map(square).sum::<f64>() / picture.len() as f64).sqrt()
}

fn mean(picture: &[Vec3]) -> f64 {
    picture.iter().map(|x| f64::from(x.x)).sum::<f64>() / picture.len() as f64
}

fn column(i: usize) -> usize {
    i % SIDE as usize
}

#[test]
fn noise_on_an_even_wall_falls_and_its_light_stays() {
    let wall = independent(0.4, |_| 1.0);
    let denoised = wall.denoised();
    let (before, after) = (off(&wall.picture, |_| 1.0), off(&denoised, |_| 1.0));
    assert!(after < 0.2 * before, "{before} became {after}");
    // The error of the mean over all pixels is a thousandth.
    assert!((mean(&denoised) - 1.0).abs() < 3.5 * before / f64::from(SIDE), "{}", mean(&denoised));
    assert!(0.02 > 3.5 * before / f64::from(SIDE), "2 % would not be seen");
}

#[test]
fn rare_photons_are_spread_and_none_is_lost() {
    // One in three passes, which brings three times the mean.
    let wall =
        Wall::of(|rng, _| (0..PIXELS).map(|_| if rng.f32() < 1.0 / 3.0 { 3.0 } else { 0.0 }).collect());
    let denoised = wall.denoised();
    let error = off(&wall.picture, |_| 1.0) / f64::from(SIDE);
    assert!(off(&denoised, |_| 1.0) < 0.2 * off(&wall.picture, |_| 1.0));
    let off = (mean(&denoised) - 1.0).abs();
    assert!(off < 3.5 * error && 3.5 * error < 0.02, "{off} with an error of {error}");
}

#[test]
fn an_edge_that_is_more_than_noise_stays() {
    let truth = |i: usize| if column(i) < 40 { 1.0 } else { 2.0 };
    let wall = independent(0.2, truth);
    let (before, denoised) = (off(&wall.picture, truth), wall.denoised());
    assert!(off(&denoised, truth) < 0.3 * before);
    let beside: Vec<f64> = (0..PIXELS)
        .filter(|i| (39..41).contains(&column(*i)))
        .map(|i| f64::from(denoised[i].x / truth(i) - 1.0))
        .collect();
    let worst = beside.iter().fold(0.0_f64, |worst, off| worst.max(off.abs()));
    assert!(worst < 0.2, "a pixel beside the edge is off by {worst}");
}

#[test]
fn mottles_that_neighbours_share_fall_too() {
    // Each pass a picture of noise over squares of 5 pixels, as wide as the disks of such a picture are after 16 passes.
    let blurred = |rng: &mut Rng| {
        let (side, reach) = (SIDE as usize, 2);
        let wide = side + 2 * reach;
        let noise: Vec<f32> = (0..wide * wide).map(|_| bell(rng)).collect();
        let sum = |i: usize| -> f32 {
            let (x, y) = (i % side, i / side);
            (y..y + 5).map(|y| noise[y * wide + x..y * wide + x + 5].iter().sum::<f32>()).sum()
        };
        (0..PIXELS).map(|i| 1.0 + 0.4 * sum(i) / 5.0).collect::<Vec<_>>()
    };
    let wall = Wall::of(|rng, _| blurred(rng));
    let (before, after) = (off(&wall.picture, |_| 1.0), off(&wall.denoised(), |_| 1.0));
    assert!(after < 0.7 * before, "{before} became {after}");
}

#[test]
fn what_has_no_error_stays_bit_for_bit() {
    let mut wall = independent(0.4, |i| 1.0 + 0.1 * (i as f32).sin());
    wall.error.fill(Vec3::ZERO);
    assert_eq!(wall.denoised(), wall.picture);
    // And what has little stays nearly so.
    wall.error.fill(Vec3::splat(1e-4));
    assert!(wall.denoised().iter().zip(&wall.picture).all(|(a, b)| (a - b).abs().max_element() < 1e-3));
}

#[test]
fn textures_stay_as_sharp_as_their_albedo() {
    let albedo =
        |i: usize| if (column(i) / 2 + i / (2 * SIDE as usize)).is_multiple_of(2) { 0.2 } else { 0.26 };
    let mut wall = independent(0.4, albedo);
    wall.albedo = (0..PIXELS).map(|i| Vec3::splat(albedo(i))).collect();
    let (before, with) = (off(&wall.picture, albedo), off(&wall.denoised(), albedo));
    assert!(with < 0.25 * before, "{before} became {with}");
    wall.albedo.fill(Vec3::ONE);
    let without = off(&wall.denoised(), albedo);
    assert!(without > 1.5 * with, "{with} with the albedo, {without} without");
}

#[test]
fn walls_of_other_directions_and_colours_have_nothing_to_do_with_each_other() {
    let mut wall = independent(0.4, |_| 1.0);
    for i in (0..PIXELS).filter(|i| column(*i) >= 40) {
        wall.normal[i] = Vec3::X;
        wall.picture[i] += 0.1;
    }
    let denoised = wall.denoised();
    let side = |at: usize| {
        let all: Vec<Vec3> = (0..PIXELS).filter(|i| column(*i) == at).map(|i| denoised[i]).collect();
        mean(&all)
    };
    assert!((side(40) - side(39) - 0.1).abs() < 0.02, "{} {}", side(39), side(40));
}

#[test]
fn what_is_no_number_stays_alone() {
    let mut wall = independent(0.4, |_| 1.0);
    let lost = 50 * SIDE as usize + 50;
    (wall.picture[lost], wall.error[lost + 7]) = (Vec3::NAN, Vec3::INFINITY);
    let denoised = wall.denoised();
    assert!(denoised[lost].is_nan() && denoised[lost + 7] == wall.picture[lost + 7]);
    assert!(denoised.iter().enumerate().all(|(i, x)| i == lost || x.is_finite()));
}

#[test]
fn the_unit_of_light_does_not_matter() {
    let wall = independent(0.4, |i| 1.0 + 0.01 * column(i) as f32);
    let usual = wall.denoised();
    for unit in [2.0_f32.powi(-70), 2.0_f32.powi(60)] {
        let by = |plane: &[Vec3]| -> Vec<Vec3> { plane.iter().map(|x| *x * unit).collect() };
        let (picture, error) = (by(&wall.picture), by(&wall.error));
        let noisy = Noisy { picture: &picture, error: &error, ..wall.noisy() };
        assert_eq!(denoise(&noisy), by(&usual));
    }
}

#[test]
fn threads_make_no_difference() {
    let wall = independent(0.4, |_| 1.0);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| wall.denoised())
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn pictures_of_any_shape_are_taken() {
    for (width, height) in [(1, 1), (1, 9), (40, 1), (2, 2), (17, 33)] {
        let pixels = (width * height) as usize;
        let picture: Vec<Vec3> = (0..pixels).map(|i| Vec3::splat(1.0 + i as f32)).collect();
        let (flat, none) = (vec![Vec3::Z; pixels], vec![Vec3::ZERO; pixels]);
        let noisy = Noisy { width, height, picture: &picture, error: &none, albedo: &flat, normal: &flat };
        assert_eq!(denoise(&noisy), picture);
    }
}
