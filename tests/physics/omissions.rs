//! What the plan leaves out changes nothing: with and without it the picture is the same. Each scene also trips the
//! omission that would be wrong there: forced, it shows.

use crate::agreement::{cornell, mixed};
use crate::support::{Build, diffuse, glow, look};
use crate::textures::{CORNERS, body, hills, squares};
use glam::Vec3;
use halflight::connect::{Connections, Lobes};
use halflight::film::{Film, Layer};
use halflight::light::{Light, Matrix};
use halflight::measure::{Estimate, agreement};
use halflight::optics::{Lobe, Mirror, ThinDielectric};
use halflight::plan::{Frame, Omittable, Plan, Settings, Visibility};
use halflight::render::{learn, render_pass};
use halflight::scene::texture::Encoding;
use halflight::scene::{Emission, Factor, Illumination, Luminaire, Material, Matter, Pbr, Scene};

const SIDE: u32 = 16;
const LAYERS: [Layer; 6] =
    [Layer::Visible, Layer::Invisible, Layer::Emitted, Layer::Depth, Layer::Normal, Layer::Albedo];

fn settings() -> Settings {
    Settings { width: SIDE, height: SIDE, paths: Some(4_000), ..Settings::default() }
}

fn keeping(keep: &[Omittable]) -> Settings {
    Settings { keep: keep.to_vec(), ..settings() }
}

fn film(plan: &Plan, passes: u32) -> Film {
    framed(plan, &learn(plan), passes)
}

fn framed(plan: &Plan, frame: &Frame, passes: u32) -> Film {
    let layers: &[Layer] =
        if plan.settings.invisible { &LAYERS } else { &[Layer::Visible, Layer::Emitted, Layer::Depth] };
    let mut film = Film::new(SIDE, SIDE, layers);
    let planes: Vec<Layer> = film.accumulated().chain([Layer::Bias]).collect();
    (0..passes).for_each(|pass| film.add(&render_pass(plan, frame, pass, &planes).0));
    film
}

fn omits(plan: &Plan, what: Omittable) -> bool {
    plan.omissions.iter().any(|omission| omission.name == what.name())
}

/// All layers are the same, bit for bit.
#[track_caller]
fn same_bits(name: &str, a: &Film, b: &Film) {
    for layer in a.layers().iter().filter(|layer| **layer != Layer::Error) {
        let bits = |film: &Film| -> Vec<[u32; 3]> {
            film.mean(*layer).iter().map(|rgb| rgb.to_array().map(f32::to_bits)).collect()
        };
        assert!(bits(a) == bits(b), "{name}: {layer} differs");
    }
    let light = a.mean(Layer::Visible);
    assert!(light.iter().any(|rgb| rgb.max_element() > 0.0), "{name}: a black picture proves nothing");
}

/// The pictures differ by noise alone, and 2 % would be seen.
#[track_caller]
fn same_within_noise(name: &str, a: &Film, b: &Film) {
    let (a, b) = (Estimate::from_film(a).expect("passes"), Estimate::from_film(b).expect("passes"));
    let verdict = agreement(&a, &b, None);
    assert!(verdict.accepted(), "{name}: {verdict:?}");
    for factor in [0.98, 1.02] {
        let verdict = agreement(&scaled(&a, factor), &b, None);
        assert!(!verdict.accepted(), "{name}: cannot tell {factor}: {verdict:?}");
    }
}

fn scaled(estimate: &Estimate, factor: f32) -> Estimate {
    let colour = estimate.colour.map(|(mean, error)| (f64::from(factor) * mean, error));
    Estimate { mean: estimate.mean.iter().map(|rgb| factor * *rgb).collect(), colour, ..estimate.clone() }
}

/// The pictures differ by more than noise.
#[track_caller]
fn different(name: &str, a: &Film, b: &Film) {
    let (a, b) = (Estimate::from_film(a).expect("passes"), Estimate::from_film(b).expect("passes"));
    let verdict = agreement(&a, &b, None);
    assert!(!verdict.accepted(), "{name}: {verdict:?}");
}

/// The plan, changed by force.
fn forced(mut plan: Plan, change: impl FnOnce(&mut Plan)) -> Plan {
    change(&mut plan);
    plan
}

/// How much alike the pictures with and without an omission are.
#[derive(Clone, Copy, PartialEq)]
enum Alike {
    Bits,
    Noise(u32),
}

/// The plan leaves `what` out of `scene`, and the picture is the same with it.
#[track_caller]
fn exact(name: &str, scene: &Scene, what: Omittable, alike: Alike, settings: &Settings) {
    let lean = Plan::new(scene.clone(), settings.clone());
    let full = Plan::new(scene.clone(), Settings { keep: vec![what], ..settings.clone() });
    assert!(omits(&lean, what), "{name}: {} is not left out", what.name());
    assert!(!omits(&full, what), "{name}: {} is left out all the same", what.name());
    match alike {
        Alike::Bits => same_bits(name, &film(&lean, 2), &film(&full, 2)),
        Alike::Noise(passes) => {
            let mut other = full;
            other.settings.seed = 7;
            same_within_noise(name, &film(&lean, passes), &film(&other, passes));
        }
    }
}

const LOCAL: Illumination = Illumination::LOCAL;
const GLOBAL: Illumination = Illumination::GLOBAL;
const ONE_BOUNCE: Illumination = Illumination::ONE_BOUNCE;

fn own(opaque: [[f32; 2]; 2], straight: Matrix) -> Option<Illumination> {
    Some(Illumination::Own(Matter { opaque: Matrix::new(opaque), straight }))
}

#[test]
fn local_and_one_bounce_need_no_photons() {
    for illumination in [LOCAL, ONE_BOUNCE] {
        let scene = cornell(illumination);
        let name = illumination.describe();
        for what in [Omittable::Photons, Omittable::AllHits, Omittable::Existence, Omittable::Lobes] {
            exact(&name, &scene, what, Alike::Bits, &settings());
        }
        // The visible half of lamps is not sampled for: here all have the same share of it.
        let plan = Plan::new(scene.clone(), settings());
        assert!(plan.photons.is_none() && plan.rims.is_empty());
        let everything = Plan::new(scene.clone(), Settings { keep_everything: true, ..settings() });
        assert!(everything.photons.is_some() && everything.omissions.is_empty());
        // Of what is left out only the sampling of luminaires draws random numbers.
        let sampled = Plan::new(scene, keeping(&[Omittable::LightSamples]));
        same_bits(&name, &film(&sampled, 2), &film(&everything, 2));
    }
    exact("local", &cornell(LOCAL), Omittable::Visibility, Alike::Bits, &settings());
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn luminaires_with_a_closed_form_are_not_sampled_for() {
    for illumination in [LOCAL, ONE_BOUNCE, GLOBAL, Illumination::Square { s: 0.3, t: 0.6 }] {
        let name = illumination.describe();
        exact(&name, &cornell(illumination), Omittable::LightSamples, Alike::Noise(300), &settings());
    }
    exact("glass", &mixed(true, true).finish(), Omittable::LightSamples, Alike::Noise(300), &settings());
    // In local matter nothing is left to chance but where in the pixel the ray goes.
    let noise = |keep: &[Omittable]| {
        let (mut build, _) = floor(LOCAL);
        let lamp = build.material("Lamp", diffuse(0.0));
        build.0.materials[lamp as usize].emission = glow(5.0);
        build.quad(Vec3::new(-0.5, 1.0, -0.5), Vec3::X, Vec3::Z, lamp);
        build.0.camera = Some(look(Vec3::new(0.0, 0.4, 2.0), Vec3::ZERO));
        build.yfov(0.01);
        film(&Plan::new(build.finish(), keeping(keep)), 20).relative_error().expect("several passes")
    };
    let (sampled, known) = (noise(&[Omittable::LightSamples]), noise(&[]));
    assert!(known < 0.1 * sampled, "{known} {sampled}");
    // Where things cast shadows it would be wrong to take it for all.
    let right = Plan::new(cornell(ONE_BOUNCE), settings());
    assert!(right.connections.has_closed_form());
    let blind =
        forced(Plan::new(cornell(ONE_BOUNCE), settings()), |plan| plan.visibility = Visibility::Everywhere);
    different("no shadows", &film(&right, 60), &film(&blind, 60));
    // Many lamps, and lamps without extent, have none.
    let mut many = cornell(LOCAL);
    let lamp = many.luminaires[0];
    many.luminaires.extend([lamp; 8]);
    assert!(!omits(&Plan::new(many, settings()), Omittable::LightSamples));
}

#[test]
fn light_that_changes_halves_on_its_way_is_connected() {
    // The floor reads visible light alone, the lamp sends invisible light alone, and the pane between them turns one
    // into the other.
    let (mut build, floor) = floor(LOCAL);
    build.0.materials[floor as usize].illumination = own([[0.0, 0.0], [0.0, 1.0]], Matrix::ZERO);
    let pane = build.material("Pane", diffuse(0.0));
    build.0.materials[pane as usize].illumination = own([[0.0; 2]; 2], Matrix::new([[0.0, 0.0], [1.0, 0.0]]));
    build.quad(Vec3::new(-3.0, 0.5, -3.0), Vec3::Z * 6.0, Vec3::X * 6.0, pane);
    lamp(&mut build, Vec3::Y * 1.5, Light::new(Vec3::splat(3.0), Vec3::ZERO));
    build.0.camera = Some(look(Vec3::new(0.0, 0.4, 2.0), Vec3::ZERO));
    build.yfov(0.1);
    let film = film(&Plan::new(build.finish(), settings()), 2);
    let seen = film.mean(Layer::Visible)[(SIDE * SIDE / 2 + SIDE / 2) as usize];
    // ρ / π times intensity over the square of the distance, at the middle of the floor.
    let expected = 0.6 / std::f32::consts::PI * 3.0 / 2.25;
    assert!((seen.x / expected - 1.0).abs() < 0.01, "{seen} for {expected}");
}

#[test]
fn global_scenes_leave_out_what_they_do_not_need() {
    let cornell = cornell(GLOBAL);
    for what in [Omittable::CausticPhotons, Omittable::AllHits, Omittable::Lobes, Omittable::Existence] {
        exact("cornell", &cornell, what, Alike::Bits, &settings());
    }
    // What is stored on black lamps changes the order of sums in the map.
    exact("cornell", &cornell, Omittable::Deposits, Alike::Noise(120), &settings());
    exact("cornell", &cornell, Omittable::VisibleHalf, Alike::Noise(120), &settings());
    let glass = mixed(true, true).finish();
    exact("mirror and glass", &glass, Omittable::Deposits, Alike::Noise(300), &settings());
}

#[test]
fn layers_of_both_halves_are_the_same_too() {
    let point = Illumination::Square { s: 0.6, t: 0.5 };
    let mut scene = cornell(point);
    scene.materials[0].straight = Some(Matrix::ZERO);
    scene.illuminate(Some(point), &[]).expect("no names");
    let settings = Settings { invisible: true, ..settings() };
    exact("invisible layer", &scene, Omittable::CausticPhotons, Alike::Bits, &settings);
    // Camera lines of the invisible half go on where those of the visible one end.
    exact("invisible layer", &scene, Omittable::AllHits, Alike::Bits, &settings);
}

/// A floor under a lamp, seen from above.
fn floor(illumination: Illumination) -> (Build, u32) {
    let mut build = Build::new(illumination, look(Vec3::new(0.0, 3.0, 3.0), Vec3::ZERO));
    build.yfov(0.4);
    let floor = build.material("Floor", diffuse(0.6));
    build.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, floor);
    (build, floor)
}

fn lamp(build: &mut Build, position: Vec3, intensity: Light) {
    build.0.luminaires.push(Luminaire::Point { position, intensity });
}

const WHITE: Light = Light::both(Vec3::splat(3.0));

#[test]
fn a_material_that_no_triangle_has() {
    let (mut build, floor) = floor(GLOBAL);
    lamp(&mut build, Vec3::new(0.5, 1.5, 0.0), WHITE);
    // It would carry both halves, split lines, and cast no shadow.
    let unused = build.material("Unused", Lobe::Mirror(Mirror::plain(Vec3::ONE, true)));
    build.0.materials[unused as usize].illumination = own([[0.5, 0.5], [0.5, 0.5]], Matrix::IDENTITY);
    let wall = build.material("Wall", diffuse(0.5));
    build.quad(Vec3::new(-1.0, 0.0, -1.0), Vec3::X * 2.0, Vec3::Y * 2.0, wall);
    assert!(floor < unused && unused < wall);
    let scene = build.finish();
    let lean = Plan::new(scene.clone(), settings());
    assert!([Omittable::CausticPhotons, Omittable::VisibleHalf].into_iter().all(|what| omits(&lean, what)));
    assert_eq!(lean.scene.materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), ["Floor", "Wall"]);
    exact("unused", &scene, Omittable::Materials, Alike::Noise(200), &settings());
    // Streams are the same where it decides nothing.
    let mut plain = scene;
    plain.materials[unused as usize].illumination = Some(GLOBAL);
    plain.materials[unused as usize].lobes[0].1 = diffuse(0.9);
    plain.illuminate(None, &[]).expect("no names");
    exact("unused and plain", &plain, Omittable::Materials, Alike::Bits, &settings());
}

#[test]
fn matter_that_does_nothing_is_not_there() {
    let (mut build, _) = floor(GLOBAL);
    lamp(&mut build, Vec3::new(0.5, 1.5, 0.0), WHITE);
    let clear = build.material("Clear", diffuse(0.5));
    build.0.materials[clear as usize].illumination = own([[0.0; 2]; 2], Matrix::IDENTITY);
    build.sphere(Vec3::Y * 0.6, 0.5, (24, 12), false, clear);
    let grey = build.material("Grey", diffuse(0.5));
    build.sphere(Vec3::new(0.4, 0.3, 0.4), 0.3, (24, 12), false, grey);
    let scene = build.finish();
    exact("clear", &scene, Omittable::Matter, Alike::Noise(150), &settings());
    // Without photons the random numbers are the same, too.
    let mut without = scene.clone();
    without.illumination = Some(ONE_BOUNCE);
    without.illuminate(None, &[]).expect("no names");
    exact("clear, one bounce", &without, Omittable::Matter, Alike::Bits, &settings());
    // A veil of the same shape that dims by a tenth is no such matter.
    let mut veiled = scene.clone();
    let dims = Matrix::new([[0.9, 0.0], [0.0, 0.9]]);
    veiled.materials[clear as usize].illumination = own([[0.0; 2]; 2], dims);
    veiled.illuminate(None, &[]).expect("no names");
    let veiled = Plan::new(veiled, settings());
    assert!(!omits(&veiled, Omittable::Matter));
    different("veil", &film(&veiled, 40), &film(&Plan::new(scene, settings()), 40));
}

#[test]
fn normals_that_nothing_interpolates() {
    let (mut build, _) = floor(GLOBAL);
    lamp(&mut build, Vec3::new(0.5, 1.5, 0.0), WHITE);
    let grey = build.material("Grey", diffuse(0.5));
    build.sphere(Vec3::Y * 0.5, 0.5, (8, 4), false, grey);
    let mut scene = build.finish();
    let smooth = Plan::new(scene.clone(), settings());
    assert!(!omits(&smooth, Omittable::Normals));
    scene.surfaces.iter_mut().for_each(|surface| surface.smooth = false);
    exact("flat", &scene, Omittable::Normals, Alike::Bits, &settings());
    different("smooth", &film(&smooth, 40), &film(&Plan::new(scene, settings()), 40));
}

#[test]
fn textures_of_what_reflects_nothing() {
    // Of a floor that lets no light of its own come back nothing is read but its normals; a wall's roughness changes nothing.
    let (mut build, floor) = floor(GLOBAL);
    lamp(&mut build, Vec3::new(0.5, 1.5, 0.0), WHITE);
    let checker = |encoding| squares(8, encoding, |x, y| if (x + y).is_multiple_of(2) { 230 } else { 90 });
    let base = || Factor { factor: Vec3::ONE, texture: Some(checker(Encoding::Colour)) };
    let pbr = Pbr { normal: Some(hills(8, 0.3)), ..body(base()) };
    let dark = Material::pbr("Floor", pbr).with_opaque(Matrix::ZERO);
    build.0.materials[floor as usize] = dark;
    let rough = Pbr { metallic_roughness: Some(checker(Encoding::Data)), ..body(base()) };
    let wall = build.0.material(Material::pbr("Wall", rough));
    build.quad(Vec3::new(-1.0, 0.0, -1.0), Vec3::X * 2.0, Vec3::Y * 2.0, wall);
    build.0.shapes.iter_mut().for_each(|shape| shape.uvs[0] = Some(CORNERS.to_vec()));
    let scene = build.finish();
    let images = |plan: &Plan| plan.scene.images().len();
    let (lean, full) =
        (Plan::new(scene.clone(), settings()), Plan::new(scene.clone(), keeping(&[Omittable::Textures])));
    assert_eq!((images(&lean), images(&full)), (2, 4));
    let settings = Settings { invisible: true, ..settings() };
    exact("dark floor", &scene, Omittable::Textures, Alike::Bits, &settings);
    // The checker of the wall is read.
    let mut plain = scene.clone();
    plain.materials[wall as usize].pattern = None;
    different("no checker", &film(&lean, 40), &film(&Plan::new(plain, self::settings()), 40));
    // Nor is one that is not there laid out.
    let mut bare = scene;
    bare.materials.iter_mut().for_each(|material| material.pattern = None);
    let lean = Plan::new(bare.clone(), self::settings());
    assert!(lean.scene.mesh.uvs[0].is_empty() && omits(&lean, Omittable::Textures));
    exact("laid out in vain", &bare, Omittable::Textures, Alike::Bits, &self::settings());
}

#[test]
fn a_mirror_that_sees_a_local_surface() {
    // The camera sees nothing but a whitted mirror, in it a local floor, and on that what a global ball sends down.
    let mut build = Build::new(LOCAL, look(Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 2.0, 0.1)));
    build.yfov(0.5);
    let mirror = build.material("Mirror", Lobe::Mirror(Mirror::plain(Vec3::splat(0.9), false)));
    build.0.materials[mirror as usize].illumination = Some(Illumination::Whitted);
    build.quad(Vec3::new(-1.0, 2.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0, mirror);
    let floor = build.material("Floor", diffuse(0.5));
    build.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, floor);
    let wall = build.material("Wall", diffuse(0.9));
    build.0.materials[wall as usize].illumination = Some(GLOBAL);
    build.quad(Vec3::new(-1.0, 0.0, -1.0), Vec3::X * 2.0, Vec3::Y * 1.5, wall);
    lamp(&mut build, Vec3::new(0.0, 0.5, -0.6), Light::new(Vec3::splat(3.0), Vec3::ZERO));
    let scene = build.finish();
    let lean = Plan::new(scene.clone(), settings());
    let frame = learn(&lean);
    let photons = frame.photons.clone().expect("the wall feeds the floor");
    assert!(photons.deposits[floor as usize] && omits(&lean, Omittable::CausticPhotons));
    let everything = Settings { keep_everything: true, seed: 7, ..settings() };
    let right = film(&lean, 300);
    same_within_noise("mirrored", &right, &film(&Plan::new(scene, everything), 300));
    let mut dark = photons;
    dark.deposits[floor as usize] = false;
    different("no deposits", &right, &framed(&lean, &Frame { photons: Some(dark), ..frame }, 300));
}

#[test]
fn a_lamp_behind_glass() {
    // A pane hides the lamp from all connections: what arrives came through it as a caustic.
    let (mut build, floor) = floor(ONE_BOUNCE);
    lamp(&mut build, Vec3::new(0.0, 1.5, 0.0), WHITE);
    let pane = build.material("Pane", Lobe::ThinDielectric(ThinDielectric { ior: 1.5, tint: Vec3::ONE }));
    build.0.materials[pane as usize].illumination = Some(GLOBAL);
    build.quad(Vec3::new(-4.0, 1.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, pane);
    build.0.camera = Some(look(Vec3::new(0.0, 0.9, 2.0), Vec3::ZERO));
    build.yfov(0.4);
    let scene = build.finish();
    let lean = Plan::new(scene.clone(), settings());
    let photons = lean.photons.clone().expect("caustics");
    assert!(photons.classes.caustic && !photons.classes.indirect && photons.deposits[floor as usize]);
    exact("pane", &scene, Omittable::IndirectPhotons, Alike::Bits, &settings());
    exact("pane", &scene, Omittable::VisibleHalf, Alike::Noise(200), &settings());
    let right = film(&lean, 60);
    different("no photons", &right, &framed(&lean, &Frame { photons: None, ..learn(&lean) }, 60));
    let blind = forced(Plan::new(scene, settings()), |plan| plan.visibility = Visibility::Everywhere);
    different("no visibility", &right, &film(&blind, 60));
}

/// Light that is born invisible, turned visible by one mirror and back by another, and only then read.
fn two_mirrors() -> Scene {
    let mut build = Build::new(ONE_BOUNCE, look(Vec3::new(2.0, 0.5, 3.0), Vec3::new(2.0, -2.0, 0.0)));
    build.yfov(0.5);
    let mirror = |tint| Lobe::Mirror(Mirror::plain(Vec3::splat(tint), false));
    let (first, second) = (build.material("First", mirror(0.8)), build.material("Second", mirror(0.5)));
    build.0.materials[first as usize].illumination = own([[0.0, 0.0], [1.0, 0.0]], Matrix::ZERO);
    build.0.materials[second as usize].illumination = own([[0.0, 1.0], [0.0, 0.0]], Matrix::ZERO);
    build.quad(Vec3::new(-0.5, 0.5, -0.5), Vec3::Z, Vec3::new(1.0, -1.0, 0.0), first);
    build.quad(Vec3::new(1.5, 0.5, -0.5), Vec3::new(1.0, -1.0, 0.0), Vec3::Z, second);
    let floor = build.material("Floor", diffuse(0.5));
    build.quad(Vec3::new(1.0, -2.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, floor);
    build.0.luminaires.push(Luminaire::Directional {
        direction: -Vec3::Y,
        irradiance: Light::new(Vec3::splat(3.0), Vec3::ZERO),
    });
    build.finish()
}

#[test]
fn a_second_column_that_matters_through_two_mirrors_alone() {
    let settings = Settings { paths: Some(20_000), ..settings() };
    let lean = Plan::new(two_mirrors(), settings.clone());
    let frame = learn(&lean);
    let photons = frame.photons.clone().expect("mirrors feed photons");
    assert!(photons.both_halves && !omits(&lean, Omittable::VisibleHalf));
    let right = film(&lean, 40);
    let everything = Settings { keep_everything: true, seed: 7, ..settings };
    same_within_noise("two mirrors", &right, &film(&Plan::new(two_mirrors(), everything), 40));
    let half = halflight::plan::PhotonPlan { both_halves: false, ..photons };
    different("one half", &right, &framed(&lean, &Frame { photons: Some(half), ..frame }, 40));
}

#[test]
fn a_lamp_that_lights_what_is_out_of_sight_and_lights_what_is_in_sight() {
    // The lamp is visible light alone, which the floor does not read; out of sight a wall turns it into the half that
    // the floor does read. A second lamp shines in that half.
    let (mut build, _) = floor(ONE_BOUNCE);
    let wall = build.material("Wall", diffuse(0.8));
    build.0.materials[wall as usize].illumination = own([[0.0, 1.0], [0.0, 0.0]], Matrix::ZERO);
    build.quad(Vec3::new(-2.0, 0.0, -1.9), Vec3::X * 4.0, Vec3::Y * 2.0, wall);
    lamp(&mut build, Vec3::new(0.0, 0.8, -1.0), Light::new(Vec3::ZERO, Vec3::splat(20.0)));
    lamp(&mut build, Vec3::new(1.5, 1.5, 0.5), Light::new(Vec3::splat(0.5), Vec3::ZERO));
    let scene = build.finish();
    let settings = Settings { paths: Some(40_000), ..settings() };
    let lean = Plan::new(scene.clone(), settings.clone());
    assert!(lean.scene.luminaires.len() == 2 && !omits(&lean, Omittable::Luminaires));
    let right = film(&lean, 200);
    let everything = Settings { keep_everything: true, seed: 7, ..settings.clone() };
    same_within_noise("converted", &right, &film(&Plan::new(scene.clone(), everything), 200));
    let mut dark = Plan::new(scene, settings);
    dark.scene.luminaires.remove(0);
    dark.connections = Connections::new(&dark.scene, &[], false, Lobes::Lambert);
    different("without the lamp", &right, &film(&dark, 200));
}

#[test]
fn lamps_that_light_nothing() {
    // Of two kinds of lamps one shines in the visible half alone: it is seen, but lights nothing, though its power is
    // a hundred times that of the other and every connection would go to it.
    let (mut build, _) = floor(ONE_BOUNCE);
    let bright = build.material("Seen", diffuse(0.0));
    let radiance = Light::new(Vec3::ZERO, Vec3::splat(100.0));
    build.0.materials[bright as usize].emission = Some(Emission { radiance, two_sided: false });
    build.quad(Vec3::new(-0.6, 0.1, -0.6), Vec3::Z * 0.3, Vec3::X * 0.3, bright);
    let real = build.material("Real", diffuse(0.0));
    build.0.materials[real as usize].emission = glow(5.0);
    build.quad(Vec3::new(-0.5, 2.0, -0.5), Vec3::X, Vec3::Z, real);
    let scene = build.finish();
    let lean = Plan::new(scene.clone(), settings());
    assert_eq!((scene.luminaires.len(), lean.scene.luminaires.len()), (4, 2));
    exact("seen lamp", &scene, Omittable::Luminaires, Alike::Noise(400), &settings());
    // It is seen all the same, bit for bit, and noise is far lower. (Other noise around a pixel may give it other paths.)
    let keeping = |what: &[Omittable]| Settings { one_path: true, ..keeping(what) };
    let lean = Plan::new(scene.clone(), keeping(&[Omittable::LightSamples]));
    let full = Plan::new(scene, keeping(&[Omittable::LightSamples, Omittable::Luminaires]));
    let (lean, full) = (film(&lean, 20), film(&full, 20));
    assert_eq!(lean.mean(Layer::Emitted), full.mean(Layer::Emitted));
    let variance = |film: &Film| {
        let emitted = film.mean(Layer::Emitted);
        let lit =
            film.standard_error().into_iter().zip(emitted).filter(|(_, emitted)| *emitted == Vec3::ZERO);
        lit.map(|(error, _)| error.length_squared()).sum::<f32>()
    };
    assert!(4.0 * variance(&lean) < variance(&full), "{} {}", variance(&lean), variance(&full));
}

#[test]
fn things_that_cast_no_shadow_among_things_that_do() {
    let mut build = mixed(false, false);
    let (local, half) = (build.material("Local", diffuse(0.5)), build.material("Veil", diffuse(0.5)));
    build.0.materials[local as usize].illumination = Some(LOCAL);
    build.0.materials[half as usize].illumination = Some(Illumination::Square { s: 1.0, t: 0.5 });
    build.sphere(Vec3::new(-0.4, -0.3, 0.0), 0.4, (24, 12), false, local);
    build.sphere(Vec3::new(0.4, -0.3, 0.0), 0.3, (12, 6), false, half);
    let scene = build.finish();
    exact("casters", &scene, Omittable::Casters, Alike::Bits, &settings());
    let right = Plan::new(scene.clone(), settings());
    let blind = forced(Plan::new(scene, settings()), |plan| plan.visibility = Visibility::Everywhere);
    different("no shadows", &film(&right, 60), &film(&blind, 60));
}

#[test]
fn sheets_that_do_not_commute_cast_different_shadows() {
    // Casters are told by what is read behind them: what a sheet passes on may come from the half that local matter stops.
    let (mut build, _) = floor(LOCAL);
    let (sheet, local) = (build.material("Sheet", diffuse(0.5)), build.material("Local", diffuse(0.5)));
    let mixes = Matrix::new([[0.5, 0.5], [0.0, 0.0]]);
    build.0.materials[sheet as usize].illumination = own([[0.0; 2]; 2], mixes);
    build.quad(Vec3::new(-3.0, 0.5, -3.0), Vec3::Z * 6.0, Vec3::X * 6.0, sheet);
    build.quad(Vec3::new(-3.0, 0.8, -3.0), Vec3::Z * 6.0, Vec3::X * 6.0, local);
    lamp(&mut build, Vec3::Y * 1.5, Light::new(Vec3::splat(1.0), Vec3::splat(4.0)));
    build.0.camera = Some(look(Vec3::new(0.0, 0.4, 2.0), Vec3::ZERO));
    build.yfov(0.1);
    let scene = build.finish();
    let lean = Plan::new(scene.clone(), settings());
    assert!(!omits(&lean, Omittable::Casters) && !omits(&lean, Omittable::Visibility));
    same_bits("sheets", &film(&lean, 2), &film(&Plan::new(scene, keeping(&[Omittable::Casters])), 2));
}

#[test]
fn glass_that_sends_on_a_colour_that_nothing_reads() {
    // A red mirror above a floor that is blue: photons through it would be kept for nothing.
    let (mut build, floor) = floor(LOCAL);
    build.0.materials[floor as usize].lobes[0].1 = Lobe::Diffuse(halflight::optics::Diffuse {
        albedo: Vec3::new(0.0, 0.0, 0.6),
        two_sided: false,
        under: None,
    });
    let red = build.material("Red", Lobe::Mirror(Mirror::plain(Vec3::new(0.9, 0.0, 0.0), false)));
    build.0.materials[red as usize].illumination = Some(GLOBAL);
    build.quad(Vec3::new(-1.0, 0.0, -1.0), Vec3::X * 2.0, Vec3::Y * 2.0, red);
    lamp(&mut build, Vec3::new(0.0, 1.0, 0.0), WHITE);
    let mut scene = build.finish();
    exact("red mirror", &scene, Omittable::Photons, Alike::Bits, &settings());
    let purple = Lobe::Mirror(Mirror::plain(Vec3::new(0.9, 0.0, 0.9), false));
    scene.materials[red as usize].lobes[0].1 = purple;
    scene.illuminate(None, &[]).expect("no names");
    assert!(Plan::new(scene, settings()).photons.is_some_and(|photons| photons.classes.caustic));
}

#[test]
fn glass_leaves_room_for_no_wrong_omission() {
    let scene = mixed(true, true).finish();
    let lean = Plan::new(scene.clone(), settings());
    let everything = Settings { keep_everything: true, seed: 7, ..settings() };
    same_within_noise("all at once", &film(&lean, 300), &film(&Plan::new(scene, everything), 300));
}
