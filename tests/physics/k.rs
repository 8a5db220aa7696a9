//! The multiplication factor against closed forms.

use crate::support::{Build, Measured, diffuse, glow, look, small};
use glam::Vec3;
use halflight::error::Error;
use halflight::existence::{Existence, Multiplication};
use halflight::film::Layer;
use halflight::light::Invisible;
use halflight::optics::{Diffuse, Lobe, Mirror};
use halflight::plan::{Direct, Frame, Method, PhotonPlan, Plan, Settings};
use halflight::render::Render;
use halflight::render::learn;
use halflight::scene::{Camera, Illumination, Luminaire, Projection, Scene};
use halflight::shoot::shoot;

const RATIO: f64 = 0.5;

fn concentric(albedo: f64, two_sided: bool) -> Scene {
    let name = format!("builtin:concentric?albedo={albedo}&ratio={RATIO}&two_sided={two_sided}");
    Scene::load(name).expect("built in")
}

/// k / (s ρ) of reflectors that shine from their fronts. Light leaves the room's wall for the wall again, past the ball
/// or through both its sides, or for the ball; what leaves the ball reaches the wall:
/// [[1 − a + a t², 1], [a, 0]] with a = (r/R)².
fn one_sided(t: f64) -> f64 {
    let a = RATIO * RATIO;
    let c = 1.0 - a + a * t * t;
    0.5 * (c + (c * c + 4.0 * a).sqrt())
}

/// k / ρ of reflectors that shine from both sides, t = 1: the largest root of μ (μ − 1)² = a (2μ − 1).
fn two_sided() -> f64 {
    let a = RATIO * RATIO;
    let f = |mu: f64| mu * (mu - 1.0).powi(2) - a * (2.0 * mu - 1.0);
    let (mut low, mut high) = (1.0, 3.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if f(middle) < 0.0 { low = middle } else { high = middle }
    }
    low
}

fn measured(scene: Scene) -> Multiplication {
    match Plan::new(scene, Settings { keep_everything: true, ..small(8, 8, 1) }).existence {
        Existence::Measured(m) => m,
        certain @ Existence::Certain { .. } => panic!("{certain:?}"),
    }
}

#[track_caller]
fn must_be(m: &Multiplication, expected: f64) {
    eprintln!("k {:.5} ± {:.5} against {expected:.5}, {} lines", m.k, m.error, m.lines);
    assert!((m.k / expected - 1.0).abs() < 0.01, "{m:?} against {expected}");
    // Inscribed spheres of 256 sides are smaller than true ones by (π/256)² / 2 = 8e-5.
    Measured { mean: m.k, error: m.error }.must_be(expected, 2e-4);
}

#[test]
fn concentric_spheres_have_their_closed_forms() {
    for (two_sided, mu) in [(false, one_sided(1.0)), (true, two_sided())] {
        for k in [0.5, 0.8, 0.95] {
            must_be(&measured(concentric(k / mu, two_sided)), k);
        }
    }
}

#[test]
fn k_follows_s_and_t() {
    for (s, t) in [(1.0, 0.0), (1.0, 0.5), (0.5, 1.0), (0.3, 0.8)] {
        let mut scene = concentric(0.6, false);
        let point = Illumination::Square { s: s as f32, t: t as f32 };
        scene.illuminate(Some(point), &[]).expect("no names");
        must_be(&measured(scene), 0.6 * s * one_sided(t));
    }
}

#[test]
fn near_one_it_tells_the_sides_apart() {
    let verdict = |k: f64| {
        let plan = Plan::new(concentric(k / two_sided(), true), small(8, 8, 100));
        eprintln!("{}", plan.existence.describe());
        (plan.existence.is_refuted(), plan.existence.warning().is_some())
    };
    assert_eq!(verdict(0.97), (false, false));
    assert_eq!(verdict(0.99), (false, true));
    assert_eq!(verdict(1.01), (true, false));
}

/// A closed box of the given albedos; the last is the ceiling's.
fn furnace(wall: Lobe) -> Scene {
    let eye = Vec3::new(0.2, 0.1, 0.3);
    let camera = Camera::look_at(eye, Vec3::X, Vec3::Y, Projection::Perspective { yfov: 1.0 });
    let mut build = Build::new(Illumination::GLOBAL, camera);
    let wall = build.material("Wall", wall);
    build.0.materials[wall as usize].emission = glow(1.0);
    build.sphere(Vec3::ZERO, 1.0, (32, 16), true, wall);
    build.flatten();
    build.finish()
}

#[test]
fn in_a_closed_furnace_k_is_the_albedo() {
    for albedo in [0.3, 0.9, 0.999_999] {
        let m = measured(furnace(diffuse(albedo)));
        assert!((m.k / f64::from(albedo) - 1.0).abs() < 1e-6, "{m:?}");
    }
    // Of the channels the largest decides.
    let albedo = Vec3::new(0.2, 0.3, 0.7);
    let m = measured(furnace(Lobe::Diffuse(Diffuse { albedo, two_sided: false, under: None })));
    assert!((m.k / 0.7 - 1.0).abs() < 1e-6 && m.channel == 2, "{m:?}");
}

#[test]
fn light_that_goes_to_and_fro_has_the_geometric_mean() {
    // Two facing plates, of which each reflects to the other alone: single generations alternate for ever.
    let camera = look(Vec3::new(0.0, 0.5, 3.0), Vec3::ZERO);
    let mut build = Build::new(Illumination::GLOBAL, camera);
    let lower = build.material("Lower", Lobe::Mirror(Mirror::plain(Vec3::splat(0.9), false)));
    let upper = build.material("Upper", Lobe::Mirror(Mirror::plain(Vec3::splat(0.1), false)));
    build.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, lower);
    build.quad(Vec3::new(-2.0, 1.0, -2.0), Vec3::X * 4.0, Vec3::Z * 4.0, upper);
    let irradiance = halflight::light::Light::both(Vec3::ONE);
    build.0.luminaires.push(Luminaire::Spot {
        position: Vec3::Y * 0.5,
        direction: Vec3::Y,
        intensity: irradiance,
        cone: halflight::scene::SpotCone::of_cosines(0.999_999_9, 0.999_999_9),
    });
    let m = measured(build.finish());
    Measured { mean: m.k, error: m.error }.must_be(0.3, 1e-4);
}

#[test]
fn a_furnace_that_loses_nothing_has_no_image() {
    let error = Render::new(furnace(diffuse(1.0)), small(8, 8, 100), &[Layer::Visible]).err();
    let message = error.expect("no image").to_string();
    assert!(message.starts_with("no image exists: multiplication factor 1.0"), "{message}");
}

/// A two-sided white box, of which `sides` sides are there, on a grey floor under a lamp: outside it, or inside.
fn white_box(albedo: f32, sides: usize, lamp_inside: bool) -> Scene {
    let white =
        |albedo: f32| Lobe::Diffuse(Diffuse { albedo: Vec3::splat(albedo), two_sided: true, under: None });
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(3.0, 2.0, 4.0), Vec3::ZERO));
    let (grey, white) = (build.material("Grey", diffuse(0.5)), build.material("White", white(albedo)));
    build.quad(Vec3::new(-2.0, -0.6, -2.0), 4.0 * Vec3::Z, 4.0 * Vec3::X, grey);
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    let walls =
        (0..3).flat_map(|i| [-0.5, 0.5].map(|at| (at * axes[i], axes[(i + 1) % 3], axes[(i + 2) % 3])));
    for (middle, right, up) in walls.take(sides) {
        build.quad(middle - 0.5 * (right + up), right, up, white);
    }
    let position = if lamp_inside { Vec3::splat(0.1) } else { Vec3::new(1.0, 1.5, 1.2) };
    let intensity = halflight::light::Light::both(Vec3::ONE);
    build.0.luminaires.push(Luminaire::Point { position, intensity });
    build.finish()
}

#[test]
fn what_no_light_reaches_has_no_say() {
    // The inside of the shut box keeps all light, and gets none. From outside a convex box lights the floor, and the floor
    // the box: k² is no more than the floor's albedo times the shares of light that find the way.
    for seed in 0..4 {
        let settings = Settings { seed, ..small(16, 16, 2000) };
        let scene = white_box(1.0, 6, false);
        let render = Render::new(scene, settings, &[Layer::Visible]).expect("an image");
        let Existence::Measured(m) = &render.plan().existence else { panic!("albedo one is measured") };
        assert!(m.k > 0.02 && m.k < 0.5_f64.sqrt(), "{m:?}");
        // Nor does a lamp count that is shut out of a box that would keep its light.
        let dark = Plan::new(white_box(0.99, 6, false), small(8, 8, 1)).existence;
        assert!(dark.growth() == 1.0 || matches!(dark, Existence::Certain { .. }), "{dark:?}");
    }
}

#[test]
fn white_walls_have_an_image_where_light_can_leave_and_none_where_it_cannot() {
    for seed in 0..4 {
        let settings = Settings { seed, ..small(8, 8, 2000) };
        let open = Render::new(white_box(1.0, 5, true), settings.clone(), &[Layer::Visible]);
        let open = open.expect("light leaves by the open side");
        let Existence::Measured(m) = &open.plan().existence else { panic!("albedo one is measured") };
        assert!(m.k > 0.7 && m.k < 0.95, "{m:?}");
        let shut = Render::new(white_box(1.0, 6, true), settings.clone(), &[Layer::Visible]).err();
        let shut = shut.expect("no image");
        assert!(shut.exit_code() == 3, "{shut}");
        assert!(shut.to_string().contains("some light is shut in and lost nowhere"), "{shut}");
        assert!(shut.to_string().contains("White, albedo 1.00, two-sided"), "{shut}");
        // Of a shut box that loses a little there is an image again, however bright.
        Render::new(white_box(0.999, 6, true), settings, &[Layer::Visible]).expect("an image");
    }
}

#[test]
fn k_of_light_of_one_colour_is_that_of_its_own_walls() {
    // The walls keep blue best, and the lamp is red.
    let albedo = Vec3::new(0.4, 0.5, 0.97);
    let mut scene = furnace(Lobe::Diffuse(Diffuse { albedo, two_sided: false, under: None }));
    let red = halflight::light::Light::both(Vec3::X);
    for luminaire in &mut scene.luminaires {
        if let Luminaire::Triangle { emission, .. } = luminaire {
            emission.radiance = red;
        }
    }
    let m = measured(scene);
    assert!((m.k / 0.4 - 1.0).abs() < 1e-6 && m.channel == 0, "{m:?}");
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn paths_that_multiply_against_all_expectation_end_and_stay_unbiased() {
    // Light multiplies by 1.2 from one reflection to the next, and roulette is told that it does not.
    let planned = |most: u32| {
        let mut scene = concentric(1.2 / one_sided(1.0), false);
        scene.illuminate(Some(Illumination::SHADOWLESS), &[]).expect("no names");
        let settings = Settings { direct: Direct::Photons, max_reflections: Some(most), ..small(8, 8, 64) };
        Plan::new(scene, settings)
    };
    let shot = |plan: &Plan, crowd: u32, pass: u32| {
        let frame = learn(plan);
        let photons = frame.photons.map(|photons| PhotonPlan { growth: 1.0, keep: 1.0, crowd, ..photons });
        shoot::<Invisible>(plan, &Frame { photons, ..frame }, pass)
    };
    // They would be 1.2⁴⁰⁰, more than anything has room for.
    let endless = shot(&planned(400), 1000, 0);
    assert!(endless.ledger.lines < 64 * 20_000, "{:?}", endless.ledger);
    // Cut series are short enough to be followed either way: the same power arrives.
    let plan = planned(14);
    let total = |crowd: u32| {
        let passes: Vec<f64> = (0..1024)
            .map(|pass| {
                let photons = shot(&plan, crowd, pass);
                photons.by_class.iter().flatten().map(|photon| f64::from(photon.power.0.x)).sum()
            })
            .collect();
        Measured::of(&passes)
    };
    let (whole, thinned) = (total(u32::MAX), total(40));
    let z = |of: f64| (of * whole.mean - thinned.mean) / whole.error.hypot(thinned.error);
    eprintln!("{whole:?} {thinned:?} z {:.2}", z(1.0));
    assert!(thinned.error > whole.error, "nothing was thinned: {whole:?} {thinned:?}");
    assert!(z(1.0).abs() < 3.5, "{whole:?} {thinned:?}");
    assert!(z(0.98) < -3.5 || z(1.02) > 3.5, "it could not tell 2 %: {whole:?} {thinned:?}");
}

/// The paper's box as Blender would export it: two-sided, albedo 0.9.
fn supercritical() -> Scene {
    let mut scene = Scene::load("builtin:cornell-spheres").expect("built in");
    for material in &mut scene.materials {
        if material.emission.is_none() {
            material.lobes = vec![(
                1.0,
                Lobe::Diffuse(Diffuse { albedo: Vec3::splat(0.9), two_sided: true, under: None }),
            )];
        }
    }
    scene.illuminate(Some(Illumination::SHADOWLESS), &[]).expect("no names");
    scene
}

#[test]
fn a_supercritical_box_is_refused_by_every_method_and_served_truncated() {
    for method in [Method::Photon, Method::Path] {
        let settings = Settings { method, ..small(16, 16, 2000) };
        let error =
            Render::new(supercritical(), settings.clone(), &[Layer::Visible]).err().expect("no image");
        assert!(matches!(error, Error::NoImage { k, .. } if k >= 1.0) && error.exit_code() == 3);
        let message = error.to_string();
        eprintln!("{message}");
        assert!(
            message.contains("≥ 1 (shadowless Ball, White, Red, Green, albedo 0.90, two-sided). "),
            "{message}"
        );
        assert!(
            message.contains("Lower s to below 0.") && message.contains("--max-reflections"),
            "{message}"
        );
        let truncated = Settings { max_reflections: Some(12), ..settings };
        let mut render = Render::new(supercritical(), truncated, &[Layer::Visible]).expect("a render");
        render.pass();
        assert!(render.film().mean_colour().x > 0.0 && render.film().mean_colour().is_finite());
        let header = render.header();
        let fact = |name: &str| header.get(name).and_then(halflight::film::Value::as_real).expect("a fact");
        assert!(fact("k") > 1.1 && fact("k_error") < 0.02 && fact("max_reflections") == 12.0);
    }
}

#[test]
fn a_truncated_series_is_unbiased_where_the_whole_one_has_no_sum() {
    // Albedo one, k = 1.207: power on the fronts of room and ball after each reflection, from the closed form above.
    let mut scene = concentric(1.0, false);
    scene.illuminate(Some(Illumination::SHADOWLESS), &[]).expect("no names");
    let most = 12;
    let settings = Settings { max_reflections: Some(most), direct: Direct::Photons, ..small(8, 8, 20_000) };
    let plan = Plan::new(scene, settings);
    let frame = learn(&plan);
    let photons = frame.photons.as_ref().expect("photons");
    assert!(photons.growth > 1.19 && photons.growth < 1.22, "{}", photons.growth);
    let a = RATIO * RATIO;
    // The point light sits midway between the spheres; the ball is seen from it under this part of the sphere.
    let seen = 0.5 * (1.0 - (1.0 - (RATIO / 0.75_f64).powi(2)).sqrt());
    let (mut room, mut ball) = (1.0, seen);
    let mut expected = 0.0;
    for _ in 0..most {
        expected += 4.0 * std::f64::consts::PI * (room + ball);
        (room, ball) = (room + ball, a * room);
    }
    let passes: Vec<f64> = (0..16)
        .map(|pass| {
            let shot = shoot::<Invisible>(&plan, &frame, pass);
            let fronts = shot.by_class.iter().flatten().filter(|photon| {
                let on_ball = photon.position.length() < 0.75;
                (photon.cos_to(photon.position) > 0.0) == on_ball
            });
            fronts.map(|photon| f64::from(photon.power.0.x)).sum()
        })
        .collect();
    Measured::of(&passes).must_be(expected, 0.002);
}

#[test]
fn k_is_left_out_only_where_it_cannot_matter() {
    let plan = |name: &str, illumination| {
        let mut scene = Scene::load(name).expect("built in");
        scene.illuminate(Some(illumination), &[("*".into(), illumination)]).expect("no names");
        Plan::new(scene, small(8, 8, 100))
    };
    let left_out = |plan: &Plan| plan.omissions.iter().any(|omission| omission.name == "existence");
    for illumination in [Illumination::LOCAL, Illumination::ONE_BOUNCE, Illumination::GLOBAL] {
        assert!(left_out(&plan("builtin:cornell-spheres", illumination)));
        // Metal is white at grazing angles: that light is lost in its box is not certain beforehand.
        let certain = illumination != Illumination::GLOBAL;
        assert_eq!(left_out(&plan("builtin:caustic-box", illumination)), certain);
    }
    assert!(!left_out(&plan("builtin:cornell-spheres", Illumination::SHADOWLESS)));
}

#[test]
fn equal_arguments_give_equal_bits_whatever_the_threads() {
    let k = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| measured(concentric(0.5, true)))
    };
    assert_eq!(k(1), k(3));
}
