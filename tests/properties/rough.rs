//! Rough lobes, from nearly smooth to the roughest: samples against densities, reciprocity, weights, and energy.

use glam::{DVec3, Vec3};
use halflight::optics::{
    Clear, Diffuse, Film, Glossy, Layers, Lobe, Normals, RoughDielectric, RoughThin, Sheen, Translucent,
    Transport, Velvet, refract,
};
use halflight::sampling::{Rng, Stream, warp};
use std::f64::consts::{PI, TAU};

const ROUGHNESSES: [f32; 7] = [1e-3, 0.01, 0.05, 0.1, 0.3, 0.6, 1.0];

fn glossy(alpha: [f32; 2]) -> Glossy {
    Glossy::new(Vec3::new(0.9, 0.6, 0.3), Vec3::ONE, alpha, Vec3::new(0.8, 0.6, 0.3), true)
}

/// Lobes of one roughness, and the index behind each.
fn lobes(roughness: f32) -> Vec<(Lobe, f32)> {
    let alpha = roughness * roughness;
    let (tint, both) = (Vec3::new(1.0, 0.8, 0.5), [alpha; 2]);
    let coat = Layers::NONE.with_coat(Clear { f0: 0.04, f90: 1.0, alpha });
    let film = Film { ior: 1.4, thickness: 300.0, factor: 0.7 };
    let velvet = Layers::NONE.with_sheen(Velvet { weight: 0.8, alpha: alpha.max(0.01) });
    // What refraction makes of facets is narrower than they are; below this, unit vectors in single precision do not tell.
    let glass = |ior| RoughDielectric { ior, alpha: alpha.max(1e-5), tint };
    vec![
        (Lobe::Glossy(glossy(both)), 1.0),
        (Lobe::Glossy(glossy([alpha, 0.25 * alpha.max(4e-6)])), 1.0),
        (Lobe::Glossy(Glossy { under: Some(coat), film: Some(film), ..glossy(both) }), 1.0),
        (Lobe::RoughDielectric(glass(1.5)), 1.5),
        (Lobe::RoughDielectric(glass(0.7)), 0.7),
        (Lobe::RoughThin(RoughThin { ior: 1.5, alpha, tint }), 1.0),
        (Lobe::Sheen(Sheen { colour: tint, alpha, two_sided: true }), 1.0),
        (Lobe::Diffuse(Diffuse { albedo: tint, two_sided: true, under: Some(coat) }), 1.0),
        (Lobe::Translucent(Translucent { colour: tint, under: Some(velvet) }), 1.0),
    ]
}

/// Directions from near the normal to grazing, on both sides.
fn directions() -> Vec<Vec3> {
    [(0.97, 0.3), (0.6, 2.0), (0.15, 4.4), (-0.5, 1.0)]
        .map(|(z, azimuth): (f32, f32)| warp::about_z(z, azimuth / std::f32::consts::TAU))
        .to_vec()
}

/// Rings about where a smooth lobe would send light, on both sides of the surface, narrow ones where it is sharp.
struct Rings {
    axes: [DVec3; 2],
    edges: Vec<f64>,
}

const SECTORS: usize = 6;

impl Rings {
    fn new(from: Vec3, ior: f32, roughness: f32) -> Self {
        let up = Vec3::Z * from.z.signum();
        let eta = if from.z > 0.0 { ior } else { 1.0 / ior };
        let through = refract(from, up, eta).unwrap_or(-from);
        let first = f64::from(0.5 * roughness * roughness);
        let n = 10;
        let edges = (0..=n).map(|i| {
            if i == 0 { 0.0 } else { first * (PI / first).powf(f64::from(i - 1) / f64::from(n - 1)) }
        });
        Self {
            axes: [(2.0 * from.dot(up) * up - from).as_dvec3(), through.as_dvec3()],
            edges: edges.collect(),
        }
    }

    fn frame(&self, side: usize) -> [DVec3; 3] {
        let z = self.axes[side].normalize();
        let x = z.any_orthonormal_vector();
        [x, z.cross(x), z]
    }

    /// The cell that a direction on that side falls into.
    fn cell(&self, side: usize, to: Vec3) -> usize {
        let [x, y, z] = self.frame(side).map(|axis| axis.dot(to.as_dvec3()));
        let angle = x.hypot(y).atan2(z);
        let ring = self.edges.iter().skip(1).position(|edge| angle < *edge).unwrap_or(self.edges.len() - 2);
        let sector = (y.atan2(x) / TAU).rem_euclid(1.0) * SECTORS as f64;
        (side * (self.edges.len() - 1) + ring) * SECTORS + (sector as usize).min(SECTORS - 1)
    }

    fn cells(&self) -> usize {
        2 * (self.edges.len() - 1) * SECTORS
    }

    /// Integrals of `f` over each cell, on the side of the surface that the cell is for.
    fn integrate<const N: usize>(
        &self,
        from: Vec3,
        fine: usize,
        f: impl Fn(Vec3) -> [f64; N],
    ) -> Vec<[f64; N]> {
        let mut sums = vec![[0.0; N]; self.cells()];
        for side in 0..2 {
            let [x, y, z] = self.frame(side);
            for ring in 0..self.edges.len() - 1 {
                let (inner, outer) = (self.edges[ring], self.edges[ring + 1]);
                for i in 0..fine * fine * SECTORS {
                    let [a, b] = [i / (fine * SECTORS), i % (fine * SECTORS)].map(|k| k as f64 + 0.5);
                    let angle = inner + (outer - inner) * a / fine as f64;
                    let (sin, cos) = (TAU * b / (fine * SECTORS) as f64).sin_cos();
                    let to = (angle.sin() * (cos * x + sin * y) + angle.cos() * z).as_vec3();
                    if (to.z * from.z > 0.0) != (side == 0) {
                        continue;
                    }
                    let area = angle.sin() * (outer - inner) / fine as f64 * TAU / (fine * SECTORS) as f64;
                    let sector = (b / fine as f64) as usize;
                    let sum = &mut sums[(side * (self.edges.len() - 1) + ring) * SECTORS + sector];
                    for (sum, value) in sum.iter_mut().zip(f(to)) {
                        *sum += area * value;
                    }
                }
            }
        }
        sums
    }
}

/// χ² of counts against expectations, absorbed samples included, in standard deviations from its mean.
fn chi2_z(counts: &[f64], expected: &[f64]) -> f64 {
    let (mut chi2, mut freedom) = (0.0, 0.0);
    let (mut few, mut expected_few) = (0.0, 0.0);
    for (count, expected) in counts.iter().zip(expected) {
        if *expected < 20.0 {
            few += count;
            expected_few += expected;
        } else {
            chi2 += (count - expected).powi(2) / expected;
            freedom += 1.0;
        }
    }
    if expected_few > 20.0 {
        chi2 += (few - expected_few).powi(2) / expected_few;
        freedom += 1.0;
    }
    (chi2 - freedom) / (2.0_f64 * freedom).sqrt()
}

/// Samples follow the density; their weights are value × cosine / density; and their mean is ∫ f cos, by quadrature.
#[test]
fn samples_follow_densities_and_carry_what_values_say() {
    let normals = Normals::flat(Vec3::Z);
    let n = 200_000;
    for roughness in ROUGHNESSES {
        for (k, (lobe, ior)) in lobes(roughness).into_iter().enumerate() {
            for from in directions() {
                let sharp = lobe.roughness().filter(|_| !matches!(lobe, Lobe::Sheen(_))).unwrap_or(1.0);
                let rings = Rings::new(from, ior, sharp);
                let mut rng = Rng::new(k as u64, Stream::Test, 0, 0);
                let (mut counts, mut sum, mut squares) = (vec![0.0; rings.cells()], 0.0, 0.0);
                for i in 0..n {
                    let u = rng.f32x3();
                    let Some(sample) = lobe.sample(&normals, from, Transport::Gathering, u) else { continue };
                    let side = usize::from(sample.to.z * from.z < 0.0);
                    counts[rings.cell(side, sample.to)] += 1.0;
                    let weight = f64::from(sample.weight.y);
                    sum += weight;
                    squares += weight * weight;
                    if i % 50 == 0 {
                        let pdf = lobe.pdf(&normals, from, sample.to);
                        assert!((pdf / sample.pdf.value() - 1.0).abs() < 1e-4, "{lobe:?} from {from}");
                        let expected = lobe.eval(&normals, from, sample.to) * sample.to.z.abs() / pdf;
                        assert!(
                            (expected - sample.weight).abs().max_element()
                                < 1e-4 * (1.0 + expected.max_element()),
                            "{lobe:?} from {from}: {sample:?}, {expected}"
                        );
                    }
                }
                let integrals = rings.integrate(from, 24, |to| {
                    let value = lobe.eval(&normals, from, to).y * to.z.abs();
                    [f64::from(lobe.pdf(&normals, from, to)), f64::from(value)]
                });
                let expected = |scale: f64| -> Vec<f64> {
                    integrals.iter().map(|[pdf, _]| scale * pdf * f64::from(n)).collect()
                };
                let z = chi2_z(&counts, &expected(1.0));
                let off = [0.98, 1.02].map(|scale| chi2_z(&counts, &expected(scale)));
                let mean = sum / f64::from(n);
                let error = ((squares / f64::from(n) - mean * mean).max(0.0) / f64::from(n)).sqrt();
                let whole: f64 = integrals.iter().map(|[_, value]| value).sum();
                let near = (mean - whole).abs() < 4.0 * error + 2e-3;
                let what = format!(
                    "{lobe:?} from {from}: χ² {z}, {off:?} where it is off; {mean} ± {error} for {whole}"
                );
                assert!(z < 5.0 && near, "{what}");
                assert!(off.iter().all(|off| *off > 3.0), "{what}");
            }
        }
    }
}

/// Reflectance or transmittance for light from everywhere, by samples, and its standard error.
fn passed_on(lobe: &Lobe, normals: &Normals, from: Vec3, n: u32) -> (f64, f64) {
    passed(lobe, normals, from, Transport::Gathering, n)
}

fn passed(lobe: &Lobe, normals: &Normals, from: Vec3, transport: Transport, n: u32) -> (f64, f64) {
    let mut rng = Rng::new(21, Stream::Test, 0, 0);
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..n {
        let sample = lobe.sample(normals, from, transport, rng.f32x3());
        let weight = sample.map_or(0.0, |sample| f64::from(sample.weight.x));
        sum += weight;
        squares += weight * weight;
    }
    let mean = sum / f64::from(n);
    (mean, ((squares / f64::from(n) - mean * mean).max(0.0) / f64::from(n)).sqrt())
}

#[test]
fn values_are_the_same_both_ways() {
    let normals = Normals::flat(Vec3::Z);
    let mut rng = Rng::new(8, Stream::Test, 0, 0);
    for roughness in ROUGHNESSES {
        for (lobe, ior) in lobes(roughness) {
            let mut finite = 0;
            for _ in 0..2000 {
                let from = warp::sphere(rng.f32x2());
                // Where the lobe is, and anywhere.
                let to = match lobe.sample(&normals, from, Transport::Gathering, rng.f32x3()) {
                    Some(sample) if rng.f32() < 0.5 => sample.to,
                    _ => warp::sphere(rng.f32x2()),
                };
                let (there, back) = (lobe.eval(&normals, from, to), lobe.eval(&normals, to, from));
                // Radiance over the square of the index is what is the same: Walter et al. 2007, §5.
                let scale = |w: Vec3| if w.z > 0.0 { 1.0 } else { ior * ior };
                let (there, back) = (there / scale(from), back / scale(to));
                let (off, size) = ((there - back).abs().max_element(), there.max_element());
                assert!(there.is_finite() && back.is_finite(), "{lobe:?}: {from} {to}");
                assert!(off <= 2e-3 * size + 1e-6, "{lobe:?}: {from} {to}: {there} and {back}");
                finite += i32::from(size > 0.0);
            }
            assert!(finite > 300, "{lobe:?}: {finite}");
        }
    }
}

#[test]
fn a_white_rough_mirror_is_as_white_as_the_room() {
    let normals = Normals::flat(Vec3::Z);
    for roughness in ROUGHNESSES {
        let alpha = roughness * roughness;
        for z in [1.0, 0.8, 0.4, 0.15, 0.05, 0.01] {
            let from = warp::about_z(z, 0.3);
            let white = Lobe::Glossy(Glossy { f0: Vec3::ONE, ..glossy([alpha; 2]) });
            let (seen, error) = passed_on(&white, &normals, from, 40_000);
            assert!((seen - 1.0).abs() < 2e-3 + 3.5 * error && error < 4e-3, "{alpha} {z}: {seen} ± {error}");
            for across in [0.5, 0.1] {
                let alpha = [alpha, (alpha * across).max(1e-6)];
                let brushed = Lobe::Glossy(Glossy { f0: Vec3::ONE, ..glossy(alpha) });
                let (seen, error) = passed_on(&brushed, &normals, from, 40_000);
                assert!(
                    (seen - 1.0).abs() < 0.01 + 3.5 * error && error < 4e-3,
                    "{alpha:?} {z}: {seen} ± {error}"
                );
            }
            let pane = Lobe::RoughThin(RoughThin { ior: 1.5, alpha, tint: Vec3::ONE });
            let (seen, error) = passed_on(&pane, &normals, from, 40_000);
            assert!((seen - 1.0).abs() < 2e-3 + 3.5 * error && error < 4e-3, "{alpha} {z}: {seen} ± {error}");
        }
    }
}

#[test]
fn clear_rough_glass_is_invisible_in_a_white_room() {
    let normals = Normals::flat(Vec3::Z);
    for roughness in ROUGHNESSES {
        for ior in [1.5, 1.1, 2.4, 0.7] {
            let alpha = (roughness * roughness).max(1e-5);
            let glass = Lobe::RoughDielectric(RoughDielectric { ior, alpha, tint: Vec3::ONE });
            for z in [1.0_f32, 0.8, 0.6, 0.4, 0.15, 0.05] {
                for side in [1.0, -1.0] {
                    let from = warp::about_z(side * z, 0.3);
                    let (seen, error) = went_on(&glass, &normals, from, 40_000);
                    assert!(
                        (seen - 1.0).abs() < 0.01 + 3.5 * error && error < 4e-3,
                        "{glass:?} {from}: {seen} ± {error}"
                    );
                }
            }
        }
    }
}

/// What goes on of a watt that is shot, by samples, and its standard error.
fn went_on(lobe: &Lobe, normals: &Normals, from: Vec3, n: u32) -> (f64, f64) {
    passed(lobe, normals, from, Transport::Shooting, n)
}

#[test]
fn what_layers_do_not_reflect_reaches_what_is_below_and_leaves_again() {
    let normals = Normals::flat(Vec3::Z);
    for roughness in ROUGHNESSES {
        let alpha = roughness * roughness;
        let velvet = Velvet { weight: 0.8, alpha: alpha.max(0.01) };
        let clear = Clear { f0: 0.04, f90: 1.0, alpha };
        let varnish = Layers::NONE.with_sheen(velvet);
        let white = |under| Lobe::Diffuse(Diffuse { albedo: Vec3::ONE, two_sided: true, under: Some(under) });
        let glaze = Glossy { f0: Vec3::splat(0.04), ..glossy([alpha; 2]) };
        let fibres =
            Lobe::Sheen(Sheen { colour: Vec3::splat(velvet.weight), alpha: velvet.alpha, two_sided: true });
        for z in [1.0, 0.5, 0.15, 0.05] {
            let from = warp::about_z(z, 0.3);
            let sum = |lobes: &[Lobe]| -> (f64, f64) {
                let all = lobes.iter().map(|lobe| passed_on(lobe, &normals, from, 100_000));
                all.fold((0.0, 0.0), |(sum, error), (more, other)| (sum + more, other.hypot(error)))
            };
            let china = [Lobe::Glossy(glaze), white(Layers::NONE.with_clear(clear))];
            let (seen, error) = sum(&china);
            assert!((seen - 1.0).abs() < 3e-3 + 3.5 * error && error < 4e-3, "{alpha} {z}: {seen} ± {error}");
            // Under fibres, the glaze too is seen through them; a rough one loses a little by the smaller of both ways.
            let cloth = [
                fibres,
                Lobe::Glossy(Glossy { under: Some(varnish), ..glaze }),
                white(Layers::NONE.with_clear(clear).with_sheen(velvet)),
            ];
            let (seen, error) = sum(&cloth);
            assert!(seen < 1.003 + 3.5 * error && seen > 0.96, "{alpha} {z}: {seen} ± {error}");
        }
    }
}

#[test]
fn shares_are_what_is_passed_on() {
    let normals = Normals::flat(Vec3::Z);
    for roughness in ROUGHNESSES {
        let (alpha, colour) = (roughness * roughness, Vec3::splat(0.7));
        for lobe in [
            Lobe::Glossy(Glossy { f0: Vec3::splat(0.2), ..glossy([alpha; 2]) }),
            Lobe::Glossy(Glossy {
                f0: Vec3::splat(0.8),
                f90: Vec3::splat(0.8),
                ..glossy([alpha, 0.2 * alpha.max(5e-6)])
            }),
            Lobe::Sheen(Sheen { colour, alpha: alpha.max(0.05), two_sided: true }),
            Lobe::Translucent(Translucent { colour, under: None }),
        ] {
            for z in [0.9, 0.3, 0.08] {
                let from = warp::about_z(z, 0.3);
                let share = f64::from(lobe.share(&normals, from).x);
                let (seen, error) = passed_on(&lobe, &normals, from, 40_000);
                assert!((share - seen).abs() < 8e-3 + 3.5 * error, "{lobe:?} {z}: {share}, {seen} ± {error}");
                assert!(seen < f64::from(lobe.bound().x) + 2e-3 + 3.5 * error, "{lobe:?} {z}: {seen}");
            }
        }
    }
}
