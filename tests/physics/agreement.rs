//! Shooting and gathering share no estimator; where they agree pixel by pixel, both are right.
//!
//! What they do share is how luminaires are connected. The plain path tracer makes no connections: it finds light by chance
//! and must agree as well. Each method looks at a scene that stands somewhere else, turned and of another size.
//!
//! The bias of the finite gather radius is given no slack: it is linear in the first radius to leading order (at the rims of
//! surfaces; elsewhere quadratic), whatever the schedule, so that 2 L(r/2) − L(r) is free of it.
//!
//! A few scenes are always tested; `HALFLIGHT_LONG=1 cargo test --release --test physics agreement -- --include-ignored`
//! tests all of them.

use crate::moved::somewhere;
use crate::support::{Build, diffuse, glow, skipped};
use crate::textures::{CORNERS, body, hills, holes, squares};
use glam::Vec3;
use halflight::film::{Film, Layer};
use halflight::light::{Light, Matrix};
use halflight::measure::{Estimate, agreement};
use halflight::optics::{Dielectric, Glossy, Lobe, Mirror};
use halflight::plan::{Direct, Method, Settings};
use halflight::render::Render;
use halflight::scene::texture::Encoding;
use halflight::scene::{
    Alpha, Camera, Factor, Illumination, Luminaire, Material, Matter, Pbr, Projection, Scene,
};

const SIDE: u32 = 20;

/// Passes of each photon render; so many that 2 % can be told from nothing.
const PASSES: u32 = 1200;

/// True for scenes that are left to the long run, which is said.
pub fn left_to_the_long_run(name: &str) -> bool {
    let short = std::env::var_os("HALFLIGHT_LONG").is_none();
    if short {
        skipped(format_args!("{name}; HALFLIGHT_LONG=1 runs it"));
    }
    short
}

pub fn film(scene: &Scene, settings: Settings, passes: u32) -> Film {
    let mut render = Render::new(scene.clone(), settings, &[Layer::Visible]).expect("a render");
    (0..passes).for_each(|_| render.pass());
    render.film().clone()
}

pub fn settings(seed: u64) -> Settings {
    Settings { width: SIDE, height: SIDE, seed, ..Settings::default() }
}

/// Photons, from a first radius in pixels extrapolated to zero.
fn shot(scene: &Scene, direct: Direct, passes: u32, radius: f32) -> Estimate {
    let at = |radius: f32, seed| {
        let settings = Settings {
            paths: Some(24_000),
            direct,
            caustic_radius: radius,
            indirect_radius: radius,
            ..settings(seed)
        };
        Estimate::from_film(&film(scene, settings, passes)).expect("several passes")
    };
    extrapolated(&at(radius, 1), &at(0.5 * radius, 2))
}

/// Free of a bias that is linear in the radius, from pictures with a radius and with half of it.
pub fn extrapolated(whole: &Estimate, half: &Estimate) -> Estimate {
    let error = |half: Vec3, whole: Vec3| (4.0 * half * half + whole * whole).map(f32::sqrt);
    let ((whole_colour, whole_error), (half_colour, half_error)) =
        (whole.colour.expect("from a film"), half.colour.expect("from a film"));
    Estimate {
        mean: half.mean.iter().zip(&whole.mean).map(|(half, whole)| 2.0 * half - whole).collect(),
        standard_error: half
            .standard_error
            .iter()
            .zip(&whole.standard_error)
            .map(|(h, w)| error(*h, *w))
            .collect(),
        passes: half.passes,
        colour: Some((
            2.0 * half_colour - whole_colour,
            (4.0 * half_error * half_error + whole_error * whole_error).map(f64::sqrt),
        )),
    }
}

pub fn traced(scene: &Scene, method: Method, passes: u32) -> Estimate {
    let settings = Settings { method, samples: 32, ..settings(3) };
    Estimate::from_film(&film(scene, settings, passes)).expect("several passes")
}

/// Pixels on each side of a block.
const BLOCK: usize = 4;

/// The same picture by blocks of pixels. In a single pixel light that is found by chance comes from so few hits that its mean is
/// not yet distributed normally, which the test takes it to be; in a block it is. Errors of pixels add up as if they were all the
/// same error where photons are shared, and as independent ones where nothing is.
pub fn in_blocks(estimate: &Estimate, shared: bool) -> Estimate {
    let (side, blocks) = (SIDE as usize, SIDE as usize / BLOCK);
    let count = (BLOCK * BLOCK) as f32;
    let pixels = |block: usize| {
        let corner = block / blocks * BLOCK * side + block % blocks * BLOCK;
        (0..BLOCK * BLOCK).map(move |i| corner + i / BLOCK * side + i % BLOCK)
    };
    let error = |block: usize| {
        let errors = pixels(block).map(|pixel| estimate.standard_error[pixel]);
        if shared {
            errors.sum::<Vec3>() / count
        } else {
            errors.map(|e| e * e).sum::<Vec3>().map(f32::sqrt) / count
        }
    };
    Estimate {
        mean: (0..blocks * blocks)
            .map(|block| pixels(block).map(|pixel| estimate.mean[pixel]).sum::<Vec3>() / count)
            .collect(),
        standard_error: (0..blocks * blocks).map(error).collect(),
        ..estimate.clone()
    }
}

/// True where light can be found by chance: no luminaire is without extent.
fn can_be_found(scene: &Scene) -> bool {
    !scene.luminaires.iter().any(Luminaire::is_delta)
}

fn scaled(estimate: &Estimate, factor: f32) -> Estimate {
    let colour = estimate.colour.map(|(mean, error)| (f64::from(factor) * mean, error));
    Estimate { mean: estimate.mean.iter().map(|rgb| factor * *rgb).collect(), colour, ..estimate.clone() }
}

/// All methods agree on `scene`, and their noise is so low that they disagree when one is off by 2 %.
#[track_caller]
pub fn must_agree(name: &str, scene: &Scene, direct: Direct) {
    must_agree_in(PASSES, name, scene, direct);
}

/// The same in so many passes.
#[track_caller]
pub fn must_agree_in(passes: u32, name: &str, scene: &Scene, direct: Direct) {
    must_agree_from(0.5, passes, name, scene, direct);
}

/// The same from a first gather radius in pixels.
#[track_caller]
pub fn must_agree_from(radius: f32, passes: u32, name: &str, scene: &Scene, direct: Direct) {
    let number = name.bytes().fold(0, |number: u64, byte| 31 * number + u64::from(byte));
    let shot = shot(&somewhere(scene, number), direct, passes, radius);
    let traced_by = |method, number| (method, traced(&somewhere(scene, number), method, passes));
    let plain = can_be_found(scene).then(|| traced_by(Method::PathPlain, number + 1));
    for (method, traced) in std::iter::once(traced_by(Method::Path, number + 2)).chain(plain) {
        let (shot, traced) = match method {
            Method::PathPlain => (in_blocks(&shot, true), in_blocks(&traced, false)),
            _ => (shot.clone(), traced),
        };
        must_be_alike(&format!("{name} against {}", method.name()), &shot, &traced);
    }
}

/// Two pictures agree, and would not if one were off by 2 %.
#[track_caller]
pub fn must_be_alike(name: &str, shot: &Estimate, traced: &Estimate) {
    let verdict = agreement(shot, traced, None);
    assert!(verdict.accepted(), "{name}: {verdict:?}");
    let lit = traced.mean.iter().any(|rgb| rgb.max_element() > 0.0);
    assert!(lit, "{name}: a black picture proves nothing");
    for factor in [0.98, 1.02] {
        let wrong = agreement(&scaled(shot, factor), traced, None);
        assert!(!wrong.accepted(), "{name}: too noisy to tell {factor}: {wrong:?}");
    }
}

pub fn cornell(illumination: Illumination) -> Scene {
    let mut scene = Scene::load("builtin:cornell-spheres").expect("built in");
    scene.illuminate(Some(illumination), &[]).expect("no names");
    hide_lamps(&mut scene);
    scene
}

/// A lamp seen by a few pixels would be all of their noise: lamps light the scene but are not seen.
pub fn hide_lamps(scene: &mut Scene) {
    for material in &mut scene.materials {
        if let Some(emission) = &mut material.emission {
            emission.radiance.visible = Vec3::ZERO;
        }
    }
    for luminaire in &mut scene.luminaires {
        if let Luminaire::Triangle { emission, .. } = luminaire {
            emission.radiance.visible = Vec3::ZERO;
        }
    }
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn at_the_corners_of_the_square() {
    for illumination in
        [Illumination::GLOBAL, Illumination::SHADOWLESS, Illumination::ONE_BOUNCE, Illumination::LOCAL]
    {
        if illumination != Illumination::SHADOWLESS || !left_to_the_long_run("shadowless") {
            must_agree(&illumination.describe(), &cornell(illumination), Direct::Connection);
        }
    }
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn inside_the_square() {
    for (s, t) in [(0.5, 0.25), (0.8, 0.6)] {
        if s > 0.7 && left_to_the_long_run("0.8,0.6") {
            continue;
        }
        let illumination = Illumination::Square { s, t };
        must_agree(&illumination.describe(), &cornell(illumination), Direct::Connection);
    }
}

#[test]
fn when_photons_serve_direct_light_too() {
    if left_to_the_long_run("direct photons") {
        return;
    }
    must_agree("direct photons", &cornell(Illumination::Square { s: 0.7, t: 0.3 }), Direct::Photons);
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn with_matrices_of_the_users_own() {
    // Every entry is used: light changes halves to and fro.
    let matter = Matter {
        opaque: Matrix::new([[0.5, 0.2], [0.9, 0.4]]),
        straight: Matrix::new([[0.3, 0.1], [0.05, 0.2]]),
    };
    must_agree("own matrices", &cornell(Illumination::Own(matter)), Direct::Connection);
}

/// A box with a mirror ball and a glass ball under a lamp so large that a path tracer finds it through glass.
pub fn mixed(mirror: bool, glass: bool) -> Build {
    let camera =
        Camera::look_at(Vec3::new(0.0, 0.0, 3.4), Vec3::ZERO, Vec3::Y, Projection::Perspective { yfov: 0.6 });
    let mut build = Build::new(Illumination::GLOBAL, camera);
    let white = build.material("White", diffuse(0.6));
    let lamp = build.material("Lamp", diffuse(0.3));
    build.0.materials[lamp as usize].emission = glow(2.0);
    for (axis, next, last) in
        [(Vec3::X, Vec3::Y, Vec3::Z), (Vec3::Y, Vec3::Z, Vec3::X), (Vec3::Z, Vec3::X, Vec3::Y)]
    {
        let top = if axis == Vec3::Y { lamp } else { white };
        if axis != Vec3::Z {
            build.quad(axis - next - last, 2.0 * last, 2.0 * next, top);
        }
        build.quad(-axis - next - last, 2.0 * next, 2.0 * last, white);
    }
    if mirror {
        let lobe = Lobe::Mirror(Mirror::plain(Vec3::new(0.9, 0.8, 0.7), false));
        let ball = build.material("Mirror", lobe);
        build.sphere(Vec3::new(-0.45, -0.5, 0.0), 0.4, (48, 24), false, ball);
    }
    if glass {
        let ball = build
            .material("Glass", Lobe::Dielectric(Dielectric { ior: 1.5, tint: Vec3::new(0.9, 1.0, 0.95) }));
        build.sphere(Vec3::new(0.45, -0.45, 0.2), 0.4, (48, 24), false, ball);
    }
    build
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn with_mirrors_and_glass() {
    must_agree("mirror and glass", &mixed(true, true).finish(), Direct::Connection);
    if !left_to_the_long_run("mirror alone, glass alone") {
        must_agree("mirror", &mixed(true, false).finish(), Direct::Connection);
        must_agree("glass", &mixed(false, true).finish(), Direct::Connection);
    }
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn with_facets_that_are_shaded_smooth() {
    // Balls of so few facets that much of what is seen of them is seen askew.
    let mut build = mixed(false, false);
    let lobes = [
        (Vec3::new(-0.5, -0.5, 0.0), Lobe::Mirror(Mirror::plain(Vec3::new(0.9, 0.8, 0.7), false))),
        (
            Vec3::new(0.5, -0.45, 0.2),
            Lobe::Dielectric(Dielectric { ior: 1.5, tint: Vec3::new(0.9, 1.0, 0.95) }),
        ),
        (Vec3::new(0.1, 0.45, -0.3), diffuse(0.8)),
    ];
    for (centre, lobe) in lobes {
        let ball = build.material("Ball", lobe);
        build.sphere(centre, 0.4, (10, 6), false, ball);
    }
    must_agree("facets", &build.finish(), Direct::Connection);
}

/// Balls in the corners of the mixed box.
pub fn four_balls(build: &mut Build, materials: [Material; 4]) {
    let centres = [[-0.5, -0.5, 0.1], [0.5, -0.5, 0.1], [-0.5, 0.4, -0.2], [0.5, 0.4, -0.2]];
    for (material, centre) in materials.into_iter().zip(centres) {
        let ball = build.0.material(material);
        build.sphere(Vec3::from_array(centre), 0.38, (48, 24), false, ball);
    }
}

/// A rough mirror of this roughness, seen from outside.
pub fn rough(roughness: f32, tint: Vec3) -> Lobe {
    let alpha = roughness * roughness;
    Lobe::Glossy(Glossy::new(tint, Vec3::ONE, [alpha; 2], Vec3::X, false))
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn with_rough_metal() {
    if left_to_the_long_run("rough metal") {
        return;
    }
    let mut build = mixed(false, false);
    let metal = |roughness| Material::new("Ball", rough(roughness, Vec3::new(0.9, 0.8, 0.7)));
    four_balls(&mut build, [0.02, 0.1, 0.3, 0.8].map(metal));
    must_agree("rough metal", &build.finish(), Direct::Connection);
    // All walls are.
    let mut build = mixed(true, false);
    build.0.materials[0].lobes = vec![(1.0, rough(0.4, Vec3::splat(0.6)))];
    must_agree("rough metal, direct photons", &build.finish(), Direct::Photons);
}

/// A body of glTF's parameters, the same all over.
fn pbr(base: Vec3, roughness: f32) -> Pbr {
    Pbr { base: Factor::new(base), metallic: 0.0, roughness, ..Pbr::default() }
}

/// One scene with some of each: what the others below test apart.
#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn with_matter_of_all_kinds() {
    let mut build = mixed(false, false);
    let squares = squares(8, Encoding::Colour, |x, y| if (x + y).is_multiple_of(2) { 230 } else { 150 });
    let base = Factor { factor: Vec3::new(0.8, 0.6, 0.5), texture: Some(squares) };
    build.0.materials[0] = Material::pbr("White", Pbr { base, ..pbr(Vec3::ONE, 0.5) });
    build.0.shapes.iter_mut().for_each(|shape| shape.uvs[0] = Some(CORNERS.to_vec()));
    let red = Vec3::new(0.8, 0.3, 0.2);
    let metal = Pbr { metallic: 1.0, ..pbr(Vec3::new(0.9, 0.8, 0.7), 0.15) };
    let coated = Pbr { coat: Factor::new(1.0), coat_roughness: Factor::new(0.1), ..pbr(red, 0.6) };
    let frosted = Pbr { transmission: Factor::new(0.9), solid: true, two_sided: true, ..pbr(Vec3::ONE, 0.3) };
    let leaf = Pbr {
        translucence: Factor::new(0.6),
        two_sided: true,
        coverage: Alpha::Blend,
        alpha: 0.6,
        ..pbr(red, 0.4)
    };
    let frosted = Material::pbr("Frosted", frosted).with_absorption(Vec3::new(0.2, 0.9, 1.5));
    let [metal, coated, leaf] = [metal, coated, leaf].map(|pbr| Material::pbr("Ball", pbr));
    four_balls(&mut build, [metal, frosted, coated, leaf]);
    // Half of them suffice to tell 2 %.
    must_agree_in(PASSES / 2, "all kinds", &build.finish(), Direct::Connection);
}

/// There is no cliff where a mirror or glass becomes rough: photons and paths agree at each roughness, and pictures of next to
/// no roughness are those of none.
#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn from_smooth_to_rough() {
    let scene = |roughness: f32| {
        let mut build = mixed(false, false);
        let metal =
            Pbr { base: Factor::new(Vec3::new(0.9, 0.8, 0.7)), metallic: 1.0, roughness, ..Pbr::default() };
        let glass =
            Pbr { transmission: Factor::new(1.0), solid: true, two_sided: true, ..pbr(Vec3::ONE, roughness) };
        for (pbr, centre) in [(metal, Vec3::new(-0.45, -0.5, 0.0)), (glass, Vec3::new(0.45, -0.45, 0.2))] {
            let ball = build.0.material(Material::pbr("Ball", pbr));
            build.sphere(centre, 0.4, (48, 24), false, ball);
        }
        build.finish()
    };
    let steps = [0.0, 0.002, 0.01, 0.05, 0.1, 0.3];
    for roughness in steps {
        if left_to_the_long_run("from smooth to rough") {
            return;
        }
        must_agree(&format!("roughness {roughness}"), &scene(roughness), Direct::Connection);
    }
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn with_layers_over_bodies() {
    if left_to_the_long_run("layers") {
        return;
    }
    let mut build = mixed(false, false);
    build.0.materials[0] = Material::pbr("White", pbr(Vec3::splat(0.6), 0.5));
    let red = Vec3::new(0.8, 0.3, 0.2);
    let coated = Pbr { coat: Factor::new(1.0), coat_roughness: Factor::new(0.1), ..pbr(red, 0.6) };
    let velvet = Pbr {
        sheen: Factor::new(Vec3::new(0.2, 0.4, 0.9)),
        sheen_roughness: Factor::new(0.4),
        ..pbr(red, 0.8)
    };
    let leaf = Pbr {
        translucence: Factor::new(0.6),
        translucent_colour: Factor::new(Vec3::new(0.3, 0.9, 0.4)),
        two_sided: true,
        ..pbr(red, 0.4)
    };
    let frosted = Pbr {
        transmission: Factor::new(0.9),
        solid: true,
        two_sided: true,
        ..pbr(Vec3::new(0.9, 1.0, 0.95), 0.4)
    };
    four_balls(&mut build, [coated, velvet, leaf, frosted].map(|pbr| Material::pbr("Ball", pbr)));
    must_agree("layers", &build.finish(), Direct::Connection);
}

/// Panes that are there in part, and one with holes, hang between lamp and floor.
fn panes(illumination: Illumination) -> Scene {
    let mut build = mixed(true, false);
    build.0.illumination = Some(illumination);
    let thin =
        Pbr { coverage: Alpha::Blend, alpha: 0.4, two_sided: true, ..pbr(Vec3::new(0.9, 0.2, 0.1), 0.5) };
    let thin = build.0.material(Material::pbr("Veil", thin));
    build.quad(Vec3::new(-0.8, 0.3, -0.8), 1.2 * Vec3::Z, 0.9 * Vec3::X, thin);
    let holes = Pbr {
        base: Factor { factor: Vec3::splat(0.7), texture: Some(holes()) },
        coverage: Alpha::Mask(0.5),
        two_sided: true,
        ..pbr(Vec3::ONE, 0.5)
    };
    let holes = build.0.material(Material::pbr("Sieve", holes));
    build.quad(Vec3::new(-0.1, 0.1, -0.8), 1.4 * Vec3::Z, 0.9 * Vec3::X, holes);
    build.0.shapes.last_mut().expect("the pane").uvs[0] = Some(CORNERS.to_vec());
    build.finish()
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn with_matter_that_is_there_in_part() {
    if left_to_the_long_run("panes") {
        return;
    }
    must_agree("panes", &panes(Illumination::GLOBAL), Direct::Connection);
    must_agree("half panes", &panes(Illumination::Square { s: 0.6, t: 0.4 }), Direct::Connection);
    must_agree("panes by photons", &panes(Illumination::GLOBAL), Direct::Photons);
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn with_glass_that_absorbs_and_spreads_colours() {
    if left_to_the_long_run("colours in glass") {
        return;
    }
    let mut build = mixed(false, false);
    let glass = Material::glass("Glass", 1.5).with_absorption(Vec3::new(0.3, 1.2, 2.0)).with_dispersion(8.0);
    let glass = build.0.material(glass);
    build.sphere(Vec3::new(0.45, -0.45, 0.2), 0.4, (48, 24), false, glass);
    let inner = Material::glass("Core", 1.2).with_absorption(Vec3::new(2.0, 0.5, 0.0));
    let inner = build.0.material(inner);
    build.sphere(Vec3::new(0.45, -0.45, 0.2), 0.2, (48, 24), false, inner);
    must_agree("colours in glass", &build.finish(), Direct::Connection);
}

/// The mixed box, its walls a checker of red and white with hills in it, and its ball a mirror of hills.
pub fn patterned() -> Scene {
    let mut build = mixed(true, false);
    let squares = squares(8, Encoding::Colour, |x, y| if (x + y).is_multiple_of(2) { 230 } else { 150 });
    let base = Factor { factor: Vec3::new(0.9, 0.6, 0.5), texture: Some(squares) };
    let walls = Pbr { normal: Some(hills(32, 0.4)), ..body(base) };
    build.0.materials[0] = Material::pbr("White", walls);
    let normal = Some(hills(32, 0.15));
    let ball = Pbr { roughness: 0.0, base: Factor::new(Vec3::splat(0.8)), normal, ..Pbr::default() };
    build.0.materials[2] = Material::pbr("Mirror", ball);
    for shape in &mut build.0.shapes {
        let uv = |p: &glam::DVec3| glam::Vec2::new(3.0 * p.x as f32, 3.0 * (p.y - p.z) as f32);
        shape.uvs[0] = Some(match shape.positions.len() {
            4 => CORNERS.to_vec(),
            _ => shape.positions.iter().map(uv).collect(),
        });
    }
    build.finish()
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn with_textures_and_normal_maps() {
    if left_to_the_long_run("textures") {
        return;
    }
    must_agree("textures", &patterned(), Direct::Connection);
}

#[test]
fn with_mirrors_and_glass_between_the_corners() {
    if left_to_the_long_run("whitted mirror") {
        return;
    }
    let mut scene = mixed(true, true).finish();
    let inside = Illumination::Square { s: 0.5, t: 0.3 };
    let set = [("Glass".to_owned(), Illumination::GLOBAL), ("Mirror".to_owned(), Illumination::Whitted)];
    scene.illuminate(Some(inside), &set).expect("names of the scene");
    // Visible light goes on in the whitted mirror: both halves are carried.
    must_agree("whitted mirror", &scene, Direct::Connection);
}

#[test]
fn with_many_lamps_of_every_kind() {
    if left_to_the_long_run("many lamps") {
        return;
    }
    let mut build = mixed(false, false);
    let white = |power: f32| Light::both(Vec3::splat(power));
    build.0.materials[1].emission = glow(0.2);
    for i in 0..24_u8 {
        let angle = f32::from(i) * 0.7;
        let position = Vec3::new(0.4 * angle.cos(), 0.4 - 0.035 * f32::from(i), 0.4 * angle.sin());
        build.0.luminaires.push(match i % 3 {
            0 => Luminaire::Point { position, intensity: white(0.05) },
            1 => Luminaire::Spot {
                position,
                direction: -Vec3::Y,
                intensity: white(0.2),
                cone: halflight::scene::SpotCone::of_cosines(0.9, 0.7),
            },
            _ => Luminaire::Warn {
                position,
                direction: Vec3::new(0.6, -0.8, 0.0),
                intensity: white(0.02),
                exponent: 1.5,
                attenuation: [0.3, 0.2, 0.5],
            },
        });
    }
    build.0.luminaires.push(Luminaire::Directional {
        direction: Vec3::new(0.1, -0.3, -1.0).normalize(),
        irradiance: white(0.3),
    });
    let mut scene = build.finish();
    hide_lamps(&mut scene);
    must_agree("many lamps", &scene, Direct::Connection);
}
