//! Light of one colour that leaves as another. Rooms against Neumann's series are among the rows of `halflight check`.

use crate::agreement::{cornell, hide_lamps, mixed, must_agree_in};
use crate::support::{Build, Measured, diffuse, look, small};
use glam::Vec3;
use halflight::film::{Film, Layer};
use halflight::light::Light;
use halflight::measure::{Estimate, agreement};
use halflight::optics::{Lobe, Mirror};
use halflight::plan::{Direct, Method, Omittable, Plan, Settings};
use halflight::render::Render;
use halflight::scene::{Emission, Fluorescence, Illumination, Luminaire, Material, Scene};

/// Blue light leaves as green and red.
fn dye() -> Fluorescence {
    Fluorescence::dye([0.0, 0.0, 0.8], [0.25, 1.0, 0.0], 0.9)
}

fn is_lamp(material: &Material) -> bool {
    material.emission.is_some()
}

/// The scene under light of this colour, what reflects there having less of a base colour and a dye.
fn dyed(mut scene: Scene, illumination: Illumination, light: Vec3, fluorescence: Fluorescence) -> Scene {
    for material in &mut scene.materials {
        if let Some(emission) = &mut material.emission {
            emission.radiance = light * emission.radiance;
        }
        if !is_lamp(material) && matches!(material.lobes[..], [(_, Lobe::Diffuse(_))]) {
            if let Lobe::Diffuse(lobe) = &mut material.lobes[0].1 {
                lobe.albedo *= 0.25;
            }
            material.fluorescence = Some(fluorescence);
        }
    }
    for luminaire in &mut scene.luminaires {
        if let Luminaire::Triangle { emission, .. } = luminaire {
            emission.radiance = light * emission.radiance;
        }
    }
    scene.illuminate(Some(illumination), &[]).expect("no names");
    scene
}

const GLOBAL: Illumination = Illumination::GLOBAL;
const VIOLET: Vec3 = Vec3::new(0.3, 0.2, 1.0);

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn shooting_and_gathering_agree() {
    let scene = dyed(cornell(GLOBAL), GLOBAL, VIOLET, dye());
    must_agree_in(1200, "dyed", &scene, Direct::Connection);
    // Each colour becomes each other one, and the halves mix.
    let matrix = std::array::from_fn(|i| std::array::from_fn(|j| 0.02 * (1 + (5 * i + 7 * j) % 8) as f32));
    let scene = dyed(cornell(GLOBAL), GLOBAL, VIOLET, Fluorescence::full(matrix));
    must_agree_in(1200, "matrix of eq. 17", &scene, Direct::Connection);
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn inside_the_square_through_glass_and_with_photons_for_direct_light() {
    let square = Illumination::Square { s: 0.6, t: 0.4 };
    must_agree_in(1200, "dyed inside", &dyed(cornell(square), square, VIOLET, dye()), Direct::Connection);
    let mut scene = dyed(mixed(true, true).finish(), GLOBAL, VIOLET, dye());
    hide_lamps(&mut scene);
    must_agree_in(1200, "caustics of the glow", &scene, Direct::Connection);
    must_agree_in(1200, "direct photons", &dyed(cornell(square), square, VIOLET, dye()), Direct::Photons);
}

fn film(scene: Scene, settings: Settings, layers: &[Layer], passes: u32) -> Film {
    let mut render = Render::new(scene, settings, layers).expect("a render");
    (0..passes).for_each(|_| render.pass());
    render.film().clone()
}

#[test]
fn under_blue_light_all_red_and_green_was_re_radiated() {
    let scene = dyed(cornell(GLOBAL), GLOBAL, Vec3::Z, dye());
    // Behind the balls some passes bring no photon of its own colour.
    let film = film(scene, small(24, 24, 20_000), &[Layer::Visible, Layer::Fluorescent], 32);
    let (seen, glow) = (film.mean(Layer::Visible), film.mean(Layer::Fluorescent));
    for (seen, glow) in seen.iter().zip(&glow) {
        let rounding = 1e-4 * seen.max_element();
        assert!((seen.truncate() - glow.truncate()).abs().max_element() <= rounding, "{seen} {glow}");
        assert!(glow.z == 0.0, "{glow}: nothing leaves as blue");
    }
    assert!(glow.iter().all(|rgb| rgb.y > 0.0 && rgb.x > 0.0) && seen.iter().all(|rgb| rgb.z > 0.0));
}

/// A floor with a dye under a point light of one colour.
fn floor(light: Vec3) -> Build {
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(0.0, 1.5, 2.0), Vec3::ZERO));
    let floor = build.material("Floor", diffuse(0.1));
    build.0.materials[floor as usize].fluorescence = Some(dye());
    build.quad(Vec3::new(-3.0, 0.0, -3.0), 6.0 * Vec3::Z, 6.0 * Vec3::X, floor);
    build.0.luminaire(Luminaire::Point { position: Vec3::Y, intensity: Light::both(light) });
    build
}

/// Colours of the middle of the picture.
fn seen(scene: Scene, method: Method) -> Vec3 {
    let settings = Settings { method, samples: 1, ..small(9, 9, 500) };
    film(scene, settings, &[Layer::Visible], 2).mean(Layer::Visible)[40]
}

#[test]
fn it_is_not_reciprocal() {
    for method in [Method::Photon, Method::Path] {
        let (blue, green) = (seen(floor(Vec3::Z).finish(), method), seen(floor(Vec3::Y).finish(), method));
        assert!(blue.y > blue.z && blue.z > 0.0, "{method:?}: {blue}");
        assert!(green.y > 0.0 && green.z == 0.0, "{method:?}: {green}");
        // 0.9 · 0.8 · (1 / 1.25) of what comes, beside 0.1.
        assert!((blue.y / blue.z - 5.76).abs() < 1e-4, "{method:?}: {blue}");
    }
}

#[test]
fn one_connection_serves_all_colours_of_a_place() {
    // A lamp that shines blue alone, half of it hidden from parts of the floor.
    let look = look(Vec3::new(0.1, 1.8, 2.6), Vec3::new(0.1, 0.0, 0.0));
    let mut build = Build::new(Illumination::ONE_BOUNCE, look);
    let floor = build.material("Floor", diffuse(0.1));
    build.0.materials[floor as usize].fluorescence = Some(dye());
    build.quad(Vec3::new(-3.0, 0.0, -3.0), 6.0 * Vec3::Z, 6.0 * Vec3::X, floor);
    let black = build.material("Board", diffuse(0.0));
    build.quad(Vec3::new(-0.4, 0.8, -0.3), 0.7 * Vec3::Z, 0.9 * Vec3::X, black);
    let lamp = build.material("Lamp", diffuse(0.0));
    build.0.materials[lamp as usize].emission = Some(Emission::front(20.0 * Vec3::Z));
    build.quad(Vec3::new(-0.5, 2.2, -0.5), Vec3::X, Vec3::Z, lamp);
    let film = film(build.finish(), small(32, 32, 500), &[Layer::Visible, Layer::Fluorescent], 3);
    let (seen, error) = (film.mean(Layer::Visible), film.standard_error());
    // 0.9 · 0.8 · (1 / 1.25) of what comes leaves as green, beside 0.1 as blue; what chance found of the shadow is the same in both.
    let ratios = |expected: f32| {
        let lit = seen.iter().zip(&error).filter(|(seen, error)| error.z > 0.05 * seen.z && seen.z > 0.01);
        let fits = |(seen, _): (&Vec3, &Vec3)| (seen.y / seen.z / expected - 1.0).abs() < 1e-3;
        lit.map(fits).collect::<Vec<_>>()
    };
    let shared = ratios(5.76);
    assert!(shared.len() > 20, "only {} pixels lie in half shadow", shared.len());
    assert!(shared.iter().all(|fits| *fits));
    assert!(ratios(1.02 * 5.76).iter().all(|fits| !*fits));
}

#[test]
fn light_is_kept_of_which_no_colour_is_seen() {
    // A lamp that shines blue alone, seen in a mirror that shows green alone.
    let mut build = floor(Vec3::Z);
    let mirror = build.material("Mirror", Lobe::Mirror(Mirror::plain(Vec3::Y, true)));
    build.quad(Vec3::new(-3.0, 0.5, -1.0), 6.0 * Vec3::X, 3.0 * Vec3::Y, mirror);
    build.0.camera = Some(look(Vec3::new(0.0, 2.0, 2.0), Vec3::new(0.0, 1.0, -1.0)));
    let scene = build.finish();
    let kept = Settings { keep_everything: true, ..small(9, 9, 500) };
    let (lean, whole) = (seen(scene.clone(), Method::Photon), film(scene, kept, &[Layer::Visible], 2));
    let whole = whole.mean(Layer::Visible)[40];
    assert!(lean.y > 0.0 && lean.x == 0.0 && lean.z == 0.0, "{lean}");
    assert!((lean.y / whole.y - 1.0).abs() < 1e-4, "{lean} {whole}");
}

#[test]
fn what_no_light_excites_is_left_out() {
    let omitted = |light: Vec3, keep: &[Omittable]| {
        let plan = Plan::new(floor(light).finish(), Settings { keep: keep.to_vec(), ..small(9, 9, 500) });
        let named = plan.omissions.iter().any(|omission| omission.name == "fluorescence");
        (named, plan.scene.fluoresces())
    };
    assert_eq!(omitted(Vec3::X, &[]), (true, false));
    assert_eq!(omitted(Vec3::X, &[Omittable::Fluorescence]), (false, true));
    assert_eq!(omitted(Vec3::Z, &[]), (false, true));
    let picture = |keep: &[Omittable]| {
        let settings = Settings { keep: keep.to_vec(), ..small(9, 9, 500) };
        film(floor(Vec3::X).finish(), settings, &[Layer::Visible], 2).mean(Layer::Visible)
    };
    assert_eq!(picture(&[]), picture(&[Omittable::Fluorescence]));
}

#[test]
fn an_atlas_counts_re_radiation_as_a_reflection() {
    // Nothing stands in the box: where things touch, an atlas reads the smallest disk, and others do not.
    let scene = dyed(mixed(false, false).finish(), GLOBAL, VIOLET, dye());
    let settings = |seed| Settings { seed, ..small(12, 12, 10_000) };
    let mut mixed = Render::new(scene.clone(), Settings { atlas: true, ..settings(1) }, &[Layer::Visible])
        .expect("a render");
    (0..240).for_each(|_| mixed.pass());
    let atlas = mixed.atlas().expect("asked for");
    for (i, (s, t)) in [(1.0, 0.0), (0.5, 0.25)].into_iter().enumerate() {
        let direct = film(scene.at(s, t), settings(2 + i as u64), &[Layer::Visible], 240);
        let mixed = atlas.mix(s.into(), t.into()).expect("a picture");
        let (mixed, direct) =
            (atlas.estimate(mixed).expect("passes"), Estimate::from_film(&direct).expect("passes"));
        let verdict = agreement(&mixed, &direct, None);
        assert!(verdict.accepted(), "{s},{t}: {verdict:?}");
        let brighter = Estimate { mean: mixed.mean.iter().map(|rgb| 1.02 * *rgb).collect(), ..mixed };
        let colour = brighter.colour.map(|(mean, error)| (1.02 * mean, error));
        let verdict = agreement(&Estimate { colour, ..brighter }, &direct, None);
        assert!(!verdict.accepted(), "{s},{t}: too noisy to tell 2 %: {verdict:?}");
    }
}

#[test]
fn of_a_glowing_ball_a_glass_ball_throws_an_image() {
    // All that is green came through the dye. Where the axis of the two balls meets the floor it is brighter for the glass.
    let green = |ior: f32| {
        let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(1.8, 0.6, 0.0), Vec3::ZERO));
        build.yfov(0.05);
        let floor = build.material("Floor", diffuse(0.8));
        let ball = build.0.material(Material::diffuse("Ball", Vec3::ZERO).with_fluorescence(dye()));
        let glass = build.0.material(Material::glass("Glass", ior));
        build.quad(Vec3::new(-2.0, 0.0, -2.0), 4.0 * Vec3::Z, 4.0 * Vec3::X, floor);
        build.sphere(1.8 * Vec3::Y, 0.1, (48, 24), false, ball);
        build.sphere(0.6 * Vec3::Y, 0.4, (64, 32), false, glass);
        let lamp =
            Material::diffuse("Lamp", Vec3::ZERO).with_emission(Emission::front(Vec3::new(0.0, 0.0, 50.0)));
        let lamp = build.0.material(lamp);
        build.quad(Vec3::new(1.0, 1.5, -0.3), 0.6 * Vec3::Z, 0.6 * Vec3::Y, lamp);
        let film = film(build.finish(), small(8, 8, 100_000), &[Layer::Visible], 12);
        let (mean, error) = (film.mean_colour(), film.mean_colour_error().expect("passes"));
        Measured { mean: mean.y, error: error.y }
    };
    let (with, without) = (green(1.5), green(1.0));
    assert!(with.mean > 2.0 * without.mean + 5.0 * with.error && without.mean > 0.0, "{with:?} {without:?}");
}
