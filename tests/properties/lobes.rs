//! Lobes: reciprocity, energy, densities, and a χ² test of the sampler.

use glam::Vec3;
use halflight::optics::{
    Dielectric, Diffuse, Glossy, Lobe, Mirror, Normals, RoughDielectric, RoughThin, ThinDielectric,
    Translucent, Transport, fresnel_dielectric, refract,
};
use halflight::sampling::{Rng, Stream, warp};
use proptest::prelude::*;
use std::f64::consts::TAU;

fn unit() -> impl Strategy<Value = Vec3> {
    [0.0_f32..1.0, 0.0..1.0].prop_map(warp::sphere)
}

fn lobe() -> impl Strategy<Value = Lobe> {
    let tint = || (0.0_f32..=1.0).prop_map(Vec3::splat);
    prop_oneof![
        (tint(), any::<bool>()).prop_map(|(albedo, two_sided)| Lobe::Diffuse(Diffuse {
            albedo,
            two_sided,
            under: None
        })),
        (tint(), any::<bool>()).prop_map(|(tint, two_sided)| Lobe::Mirror(Mirror::plain(tint, two_sided))),
        (tint(), any::<bool>()).prop_map(|(base, two_sided)| Lobe::Mirror(Mirror::metal(base, two_sided))),
        (tint(), 0.25_f32..4.0).prop_map(|(tint, ior)| Lobe::Dielectric(Dielectric { ior, tint })),
        (tint(), 0.25_f32..4.0).prop_map(|(tint, ior)| Lobe::ThinDielectric(ThinDielectric { ior, tint })),
    ]
}

fn numbers() -> impl Strategy<Value = [f32; 3]> {
    [0.0_f32..1.0, 0.0..1.0, 0.0..1.0]
}

proptest! {
    #[test]
    fn values_are_reciprocal(lobe in lobe(), n in unit(), a in unit(), b in unit()) {
        let normals = Normals::flat(n);
        // A one-sided lobe looks at the side alone, and both directions are on it or the value is zero.
        prop_assert_eq!(lobe.eval(&normals, a, b), lobe.eval(&normals, b, a));
    }

    #[test]
    fn no_sample_carries_more_than_arrived(lobe in lobe(), n in unit(), from in unit(), u in numbers()) {
        // Of one branch of several: the weight is what that branch is expected to carry over its probability.
        let sample = lobe.sample(&Normals::flat(n), from, Transport::Shooting, u);
        if let Some(sample) = sample {
            prop_assert!(sample.weight.min_element() >= 0.0 && sample.weight.max_element() <= 1.0 + 1e-6);
            prop_assert!((sample.to.length() - 1.0).abs() < 1e-5);
            prop_assert!(lobe.responds(&Normals::flat(n), from));
            prop_assert!(sample.weight.cmple(lobe.bound() + 1e-6).all());
        }
    }

    #[test]
    fn the_density_of_a_sample_is_the_one_that_is_stated(n in unit(), from in unit(), u in numbers()) {
        let lobe = Lobe::Diffuse(Diffuse { albedo: Vec3::splat(0.7), two_sided: true, under: None });
        let normals = Normals::flat(n);
        if let Some(sample) = lobe.sample(&normals, from, Transport::Gathering, u) {
            let pdf = lobe.pdf(&normals, from, sample.to);
            prop_assert!((pdf - sample.pdf.value()).abs() <= 1e-5 * pdf + 1e-7);
            let weight = lobe.eval(&normals, from, sample.to) * sample.to.dot(n).abs() / pdf;
            prop_assert!((weight - sample.weight).abs().max_element() < 1e-4);
        }
    }

    #[test]
    fn refraction_can_be_reversed(n in unit(), from in unit(), ior in 0.25_f32..4.0) {
        let n = if n.dot(from) < 0.0 { -n } else { n };
        prop_assume!(n.dot(from) > 0.05);
        if let Some(to) = refract(from, n, ior) {
            prop_assume!(to.dot(-n) > 0.05);
            let back = refract(to, -n, 1.0 / ior).expect("no total reflection on the way back");
            prop_assert!((back - from).length() < 1e-3, "{back} {from}");
            let (there, and_back) = (fresnel_dielectric(from.dot(n), ior), fresnel_dielectric(to.dot(-n), 1.0 / ior));
            prop_assert!((there - and_back).abs() < 1e-3);
            prop_assert!((0.0..=1.0).contains(&there));
        }
    }
}

/// Counts of samples in cells of equal probability: azimuth and squared sine for Lambert's law.
fn cells(sample: impl Fn([f32; 3]) -> Vec3, bins: [usize; 2], n: u32) -> Vec<f64> {
    let mut counts = vec![0.0; bins[0] * bins[1]];
    let mut rng = Rng::new(3, Stream::Test, 0, 0);
    for _ in 0..n {
        let to = sample(rng.f32x3()).as_dvec3();
        let turn = (to.y.atan2(to.x) / TAU).rem_euclid(1.0);
        let sine2 = to.x * to.x + to.y * to.y;
        let cell = |x: f64, bins: usize| ((x * bins as f64) as usize).min(bins - 1);
        counts[cell(sine2, bins[1]) * bins[0] + cell(turn, bins[0])] += 1.0;
    }
    counts
}

/// χ² against equal probability, in standard deviations from its mean.
fn chi2_z(counts: &[f64]) -> f64 {
    let expected = counts.iter().sum::<f64>() / counts.len() as f64;
    let chi2: f64 = counts.iter().map(|count| (count - expected).powi(2) / expected).sum();
    let freedom = counts.len() as f64 - 1.0;
    (chi2 - freedom) / (2.0 * freedom).sqrt()
}

#[test]
fn lamberts_samples_follow_the_cosine() {
    let lobe = Lobe::Diffuse(Diffuse { albedo: Vec3::ONE, two_sided: true, under: None });
    for front in [1.0, -1.0] {
        let from = Vec3::new(0.6, 0.0, 0.8 * front);
        let draw = |u| {
            let sample = lobe.sample(&Normals::flat(Vec3::Z), from, Transport::Shooting, u);
            sample.expect("both sides reflect").to
        };
        let z = chi2_z(&cells(draw, [16, 16], 400_000));
        assert!(z < 4.0, "{z}");
    }
    // It can fail: a sphere's upper half is not cosine-distributed.
    let uniform = |[a, b, _]: [f32; 3]| warp::about_z(1.0 - a, b);
    assert!(chi2_z(&cells(uniform, [16, 16], 400_000)) > 100.0);
    // And by little: 2 % more on one side.
    let tilted = |[a, b, c]: [f32; 3]| {
        let to = warp::cosine_hemisphere([a, b]);
        if to.x < 0.0 && c < 0.02 { Vec3::new(-to.x, to.y, to.z) } else { to }
    };
    assert!(chi2_z(&cells(tilted, [16, 16], 400_000)) > 4.0);
}

#[test]
fn branches_are_chosen_as_often_as_fresnel_says() {
    let (ior, n) = (1.5_f32, 200_000);
    let from = Vec3::new(0.8, 0.0, 0.6);
    let mut rng = Rng::new(4, Stream::Test, 0, 0);
    for (lobe, expected) in [
        (Lobe::Dielectric(Dielectric { ior, tint: Vec3::ONE }), fresnel_dielectric(0.6, ior)),
        (
            Lobe::ThinDielectric(ThinDielectric { ior, tint: Vec3::ONE }),
            ThinDielectric { ior, tint: Vec3::ONE }.reflectance(0.6),
        ),
    ] {
        let reflected = (0..n)
            .filter(|_| {
                let sample = lobe.sample(&Normals::flat(Vec3::Z), from, Transport::Shooting, rng.f32x3());
                sample.is_some_and(|sample| sample.to.z > 0.0)
            })
            .count();
        let p = f64::from(expected);
        let z = |p: f64| (reflected as f64 / f64::from(n) - p) / (p * (1.0 - p) / f64::from(n)).sqrt();
        assert!(z(p).abs() < 3.5, "{}", z(p));
        assert!(z(1.05 * p).abs() > 3.5 && z(0.95 * p).abs() > 3.5);
    }
}

#[test]
fn the_density_of_lambert_integrates_to_one() {
    let lobe = Lobe::Diffuse(Diffuse { albedo: Vec3::ONE, two_sided: true, under: None });
    let (rings, turns) = (400, 16);
    let mut sum = 0.0;
    for i in 0..rings {
        let z = 2.0 * (f64::from(i) + 0.5) / f64::from(rings) - 1.0;
        for j in 0..turns {
            let to = warp::about_z(z as f32, (j as f32 + 0.5) / turns as f32);
            let pdf = lobe.pdf(&Normals::flat(Vec3::Z), Vec3::new(0.6, 0.0, 0.8), to);
            sum += f64::from(pdf) * 2.0 * TAU / f64::from(rings * turns);
        }
    }
    assert!((sum - 1.0).abs() < 1e-4, "{sum}");
}

/// A direction and one that a lobe sends to, with the probability of that branch.
fn branch(lobe: &Lobe, from: Vec3, reflected: bool) -> Option<(Vec3, f32, Vec3)> {
    let u = if reflected { 0.0 } else { 1.0 - f32::EPSILON };
    let sample = lobe.sample(&Normals::flat(Vec3::Z), from, Transport::Gathering, [0.0, 0.0, u])?;
    ((sample.to.z * from.z > 0.0) == reflected).then_some((sample.to, sample.pdf.value(), sample.weight))
}

proptest! {
    #[test]
    fn delta_lobes_are_reciprocal(from in unit(), ior in 0.4_f32..2.5, tint in 0.1_f32..=1.0, reflected in any::<bool>()) {
        prop_assume!(from.z.abs() > 0.05);
        let tint = Vec3::splat(tint);
        for (lobe, eta) in [
            (Lobe::Mirror(Mirror::plain(tint, true)), 1.0),
            (Lobe::Mirror(Mirror::metal(tint, true)), 1.0),
            (Lobe::Dielectric(Dielectric { ior, tint }), ior),
            (Lobe::ThinDielectric(ThinDielectric { ior, tint }), 1.0),
        ] {
            let Some((to, there, weight)) = branch(&lobe, from, reflected) else { continue };
            prop_assume!(to.z.abs() > 0.05);
            let (back, and_back, weight_back) = branch(&lobe, to, reflected).expect("what goes one way goes the other");
            prop_assert!((back - from).length() < 2e-3);
            // Gathered light that crosses is scaled by η² of the side it comes from over that of the side it goes to:
            // without that, f |cos| is the same both ways. Veach 1997, eq. 5.14.
            let crossed = to.z * from.z < 0.0;
            let scale = if !crossed { 1.0 } else if from.z > 0.0 { eta * eta } else { 1.0 / (eta * eta) };
            let ratio = (there * weight * scale) / (and_back * weight_back / scale);
            prop_assert!((ratio - 1.0).abs().max_element() < 0.01, "{ratio}");
            prop_assert!((there - and_back).abs() < 2e-3, "{there} {and_back}");
        }
    }

    #[test]
    fn branches_of_clear_lobes_keep_all_power(from in unit(), ior in 0.25_f32..4.0) {
        prop_assume!(from.z.abs() > 1e-3);
        let tint = Vec3::ONE;
        for lobe in [Lobe::Dielectric(Dielectric { ior, tint }), Lobe::ThinDielectric(ThinDielectric { ior, tint })] {
            let sum: f32 = [true, false].iter().filter_map(|way| branch(&lobe, from, *way)).map(|(_, p, _)| p).sum();
            prop_assert!((sum - 1.0).abs() < 1e-6, "{sum}");
        }
    }
}

/// Normals of a facet whose shading normal is up to a right angle off.
fn askew() -> impl Strategy<Value = Normals> {
    (unit(), unit()).prop_map(|(geometric, shading)| {
        let shading = if geometric.dot(shading) < 0.0 { -shading } else { shading };
        Normals::new(geometric, shading)
    })
}

#[test]
fn metal_reflects_by_schlick_and_has_no_cliff_to_what_is_nearly_smooth() {
    let gold = Vec3::new(1.0, 0.71, 0.29);
    let smooth = Lobe::Mirror(Mirror::metal(gold, true));
    let rough = Lobe::Glossy(Glossy::new(gold, Vec3::ONE, [1e-6; 2], Vec3::X, true));
    let normals = Normals::flat(Vec3::Z);
    let (n, mut average) = (2000, Vec3::ZERO);
    for i in 0..n {
        let cos = ((i as f32 + 0.5) / n as f32).sqrt();
        for side in [1.0, -1.0] {
            let from = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, side * cos);
            let [shot, gathered] = [Transport::Shooting, Transport::Gathering]
                .map(|way| smooth.sample(&normals, from, way, [0.5; 3]).expect("reflected").weight);
            let expected = gold + (1.0 - gold) * (1.0 - cos).powi(5);
            assert!((shot - expected).abs().max_element() < 1e-6 && shot == gathered, "{cos}: {shot}");
            assert!((smooth.share(&normals, from) - shot).abs().max_element() < 1e-6);
            // The facet in the middle of all, and what is lost between facets.
            let nearly = rough.sample(&normals, from, Transport::Gathering, [0.5, 0.0, 0.9]);
            let nearly = nearly.expect("reflected").weight;
            assert!((nearly - shot).abs().max_element() < 2e-3, "{cos}: {nearly} for {shot}");
            average += shot / (2 * n) as f32;
        }
    }
    assert!((average - smooth.albedo()).abs().max_element() < 1e-4, "{average}");
    assert!((0.98 * average - smooth.albedo()).abs().max_element() > 1e-4);
    assert!(smooth.bound() == Vec3::ONE && Lobe::Mirror(Mirror::plain(gold, true)).albedo() == gold);
}

fn smooth_lobe() -> impl Strategy<Value = Lobe> {
    let tint = Vec3::ONE;
    prop_oneof![
        Just(Lobe::Mirror(Mirror::plain(tint, true))),
        (0.25_f32..4.0).prop_map(move |ior| Lobe::Dielectric(Dielectric { ior, tint })),
        (0.25_f32..4.0).prop_map(move |ior| Lobe::ThinDielectric(ThinDielectric { ior, tint })),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn what_is_not_absorbed_goes_on_whatever_the_normals(lobe in smooth_lobe(), normals in askew(), from in unit()) {
        prop_assume!(normals.geometric.dot(from).abs() > 1e-3);
        let branches = lobe.branches(&normals, from, Transport::Gathering);
        let whole: f32 = branches.iter().flatten().map(|branch| branch.pdf.value()).sum();
        prop_assert!((whole - 1.0).abs() < 1e-5, "{whole}");
        for branch in branches.into_iter().flatten() {
            // Radiance is compressed where light goes to the other side by the geometric normal, and only there.
            let crosses = normals.is_front(from) != normals.is_front(branch.to);
            let scale = match lobe {
                Lobe::Dielectric(Dielectric { ior, .. }) if crosses => if normals.is_front(from) { ior * ior } else { 1.0 / (ior * ior) },
                _ => 1.0,
            };
            prop_assert!((branch.weight * scale - 1.0).abs().max_element() < 1e-5, "{branch:?}");
            prop_assert!((branch.to.length() - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn white_matter_scatters_all_that_can_be_seen_of_it(normals in askew(), from in unit(), u in numbers()) {
        prop_assume!(normals.geometric.dot(from).abs() > 1e-3);
        let lobe = Lobe::Diffuse(Diffuse { albedo: Vec3::ONE, two_sided: true, under: None });
        if let Some(sample) = lobe.sample(&normals, from, Transport::Gathering, u) {
            prop_assert!(normals.counts(from, sample.to) && sample.weight == Vec3::ONE);
            let pdf = lobe.pdf(&normals, from, sample.to);
            let weight = lobe.eval(&normals, from, sample.to) * sample.to.dot(normals.shading).abs() / pdf;
            prop_assert!((weight - 1.0).abs().max_element() < 1e-4, "{weight}");
        }
    }
}

/// Facets whose shading normals are off by so many degrees.
fn facets() -> Vec<Normals> {
    [0.0_f32, 8.0, 30.0, 55.0, 70.0]
        .map(|degrees| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            Normals::new(Vec3::Z, Vec3::new(sin * 0.8, sin * 0.6, cos))
        })
        .to_vec()
}

/// Mean and standard error.
fn mean(values: impl ExactSizeIterator<Item = f64>) -> (f64, f64) {
    let n = values.len() as f64;
    let (sum, squares) = values.fold((0.0, 0.0), |(sum, squares), x| (sum + x, squares + x * x));
    let mean = sum / n;
    (mean, ((squares / n - mean * mean) / (n - 1.0)).sqrt())
}

#[test]
fn white_facets_are_as_bright_as_the_room_from_wherever_they_are_seen() {
    let lobe = Lobe::Diffuse(Diffuse { albedo: Vec3::ONE, two_sided: true, under: None });
    for normals in facets() {
        for from in [Vec3::new(-0.9, -0.3, 0.05), Vec3::new(0.5, 0.5, 0.6), Vec3::new(-0.9, -0.3, -0.1)] {
            let from = from.normalize();
            let mut rng = Rng::new(6, Stream::Test, 0, 0);
            let seen = (0..300_000).map(|_| {
                let to = warp::sphere(rng.f32x2());
                let f = lobe.eval(&normals, from, to).x * to.dot(normals.shading).abs();
                f64::from(f) * 2.0 * TAU
            });
            let (seen, error) = mean(seen);
            assert!(
                (seen - 1.0).abs() < 3.5 * error && 3.5 * error < 0.02,
                "{normals:?} from {from}: {seen} ± {error}"
            );
            // And samples come from where the light does: the mean of a direction's coordinates.
            let mut rng = Rng::new(7, Stream::Test, 0, 0);
            let axes = [Vec3::X, Vec3::new(0.3, -0.8, 0.5), normals.shading];
            for axis in axes {
                let by_density = (0..300_000).map(|_| {
                    let to = warp::sphere(rng.f32x2());
                    f64::from(lobe.pdf(&normals, from, to) * (1.0 + to.dot(axis)).powi(3)) * 2.0 * TAU
                });
                let (expected, error) = mean(by_density);
                let sampled = (0..300_000).map(|_| {
                    let sample = lobe.sample(&normals, from, Transport::Gathering, rng.f32x3());
                    sample.map_or(0.0, |sample| f64::from((1.0 + sample.to.dot(axis)).powi(3)))
                });
                let (found, other) = mean(sampled);
                let z = |found: f64| (found - expected).abs() / error.hypot(other);
                assert!(z(found) < 4.0, "{normals:?} from {from}: {found} for {expected}");
                assert!(z(1.02 * found) > 4.0 || z(0.98 * found) > 4.0);
            }
        }
    }
}

/// ∫∫ g(wo) K(wo, wi) h(wi): power that an eye of sensitivity g reads of light h, walked from the eye and from the light.
fn read_from_both_ends(
    lobe: &Lobe,
    normals: &Normals,
    [eye, light]: [Vec3; 2],
    seed: u64,
) -> [(f64, f64); 2] {
    let mut rng = Rng::new(seed, Stream::Test, 0, 0);
    let bump = |about: Vec3, w: Vec3| (1.05 + about.dot(w)).powi(2);
    [(eye, light, Transport::Gathering), (light, eye, Transport::Shooting)].map(|(start, end, transport)| {
        mean((0..if lobe.is_delta() { 400_000 } else { 1_500_000 }).map(|_| {
            let from = warp::sphere(rng.f32x2());
            let u = rng.f32x3();
            let carried = bump(start, from) * normals.geometric.dot(from).abs();
            let read = |sample: halflight::optics::Sample| sample.weight.x * bump(end, sample.to);
            let read: f32 = if lobe.is_delta() {
                let branches = lobe.branches(normals, from, transport);
                branches.into_iter().flatten().map(|branch| branch.pdf.value() * read(branch)).sum()
            } else {
                lobe.sample(normals, from, transport, u).map_or(0.0, read)
            };
            f64::from(carried * read)
        }))
    })
}

#[test]
fn what_is_shot_is_what_is_gathered_whatever_the_normals() {
    let tint = Vec3::splat(0.8);
    let lobes = [
        Lobe::Diffuse(Diffuse { albedo: tint, two_sided: true, under: None }),
        Lobe::Diffuse(Diffuse { albedo: tint, two_sided: false, under: None }),
        Lobe::Mirror(Mirror::plain(tint, true)),
        Lobe::Mirror(Mirror::plain(tint, false)),
        Lobe::Mirror(Mirror::metal(0.2 * tint, true)),
        Lobe::Dielectric(Dielectric { ior: 1.5, tint }),
        Lobe::Dielectric(Dielectric { ior: 0.6, tint }),
        Lobe::ThinDielectric(ThinDielectric { ior: 1.5, tint }),
        Lobe::Glossy(Glossy::new(tint, Vec3::ONE, [0.3, 0.1], Vec3::X, true)),
        Lobe::Glossy(Glossy::new(tint, Vec3::ONE, [0.02; 2], Vec3::X, false)),
        Lobe::RoughDielectric(RoughDielectric { ior: 1.5, alpha: 0.1, tint }),
        Lobe::RoughThin(RoughThin { ior: 1.5, alpha: 0.1, tint }),
        Lobe::Translucent(Translucent { colour: tint, under: None }),
    ];
    let ends = [[-Vec3::X, Vec3::X], [Vec3::X, -Vec3::Z], [Vec3::Z, Vec3::new(-0.8, -0.6, 0.0)]];
    for (k, lobe) in lobes.iter().enumerate() {
        // Rough lobes take their time.
        let few = lobe.roughness().is_some();
        for normals in if few { facets()[1..3].to_vec() } else { facets() } {
            for (i, ends) in ends.iter().enumerate().take(if few { 2 } else { 3 }) {
                let [(gathered, a), (shot, b)] =
                    read_from_both_ends(lobe, &normals, *ends, (10 * k + i) as u64);
                let z = |shot: f64| (shot - gathered).abs() / a.hypot(b);
                assert!(
                    z(shot) < 4.0,
                    "{lobe:?} {normals:?} {ends:?}: {gathered} ± {a} gathered, {shot} ± {b} shot"
                );
                assert!(
                    z(0.98 * shot) > 4.0 || z(1.02 * shot) > 4.0,
                    "{lobe:?} {normals:?}: too noisy, {a} {b} of {shot}"
                );
            }
        }
    }
}
