//! What mirrors and glass send of small lamps to glossy surfaces, against lamps behind the mirror.

use crate::agreement::{mixed, rough};
use crate::support::{Build, Measured, look, small};
use glam::Vec3;
use halflight::film::{Film, Layer};
use halflight::light::Light;
use halflight::optics::{Lobe, Mirror};
use halflight::plan::{Method, Plan, Settings};
use halflight::render::Render;
use halflight::scene::{Emission, Illumination, Luminaire, Material, Pbr, Scene, SpotCone};

/// What lies on the floor.
fn floors() -> [(&'static str, Material); 3] {
    let body = |roughness: f32| Pbr { roughness, metallic: 0.0, two_sided: false, ..Pbr::default() };
    [
        ("metal", Material::new("Floor", rough(0.5, Vec3::new(0.9, 0.7, 0.4)))),
        ("body", Material::pbr("Floor", body(0.6))),
        ("dark metal", Material::new("Floor", rough(0.35, Vec3::splat(0.2)))),
    ]
}

/// A lamp, as it is and as it stands behind the mirror at x = 1.
fn lamp(build: &mut Build, kind: &str, mirrored: bool) {
    let at = |x: f32, y: f32, z: f32| Vec3::new(if mirrored { 2.0 - x } else { x }, y, z);
    match kind {
        "spot" => {
            let intensity = Light::both(Vec3::new(2.0, 1.0, 3.0));
            let direction = Vec3::new(if mirrored { -2.1 } else { 2.1 }, -1.2, -0.1).normalize();
            let (position, cone) = (at(-0.2, 1.2, 0.1), SpotCone::of_cosines(0.98, 0.96));
            build.0.luminaire(Luminaire::Spot { position, direction, intensity, cone });
        }
        "sun" => {
            let direction = Vec3::new(if mirrored { -1.0 } else { 1.0 }, -1.5, 0.2).normalize();
            build.0.luminaire(Luminaire::sun(direction, Light::both(Vec3::ONE), 0.01));
        }
        _ => {
            let glow =
                Material::diffuse("Lamp", Vec3::ZERO).with_emission(Emission::front(Vec3::splat(80.0)));
            let glow = build.0.material(glow);
            let (corner, side) =
                (at(-0.1, 1.2, -0.1), Vec3::new(if mirrored { -0.2 } else { 0.2 }, 0.0, 0.0));
            let (a, b) = if mirrored { (0.2 * Vec3::Z, side) } else { (side, 0.2 * Vec3::Z) };
            build.quad(corner, a, b, glow);
        }
    }
}

/// A floor beside a mirror, or with the lamp's image in its place.
fn scene(kind: &str, floor: Material, with_mirror: bool) -> Scene {
    let mut build =
        Build::new(Illumination::GLOBAL, look(Vec3::new(-1.5, 1.2, 0.4), Vec3::new(0.1, 0.0, 0.0)));
    build.yfov(0.15);
    let floor = build.0.material(floor);
    build.quad(Vec3::new(-2.0, 0.0, -2.0), 4.0 * Vec3::Z, 3.0 * Vec3::X, floor);
    lamp(&mut build, kind, false);
    if with_mirror {
        let mirror = build.material("Mirror", Lobe::Mirror(Mirror::plain(Vec3::ONE, false)));
        build.quad(Vec3::new(1.0, 0.0, -2.0), 4.0 * Vec3::Z, 4.0 * Vec3::Y, mirror);
    } else {
        lamp(&mut build, kind, true);
    }
    build.finish()
}

fn film(scene: Scene, settings: Settings, passes: u32) -> Film {
    let mut render = Render::new(scene, settings, &[Layer::Visible]).expect("a render");
    (0..passes).for_each(|_| render.pass());
    render.film().clone()
}

fn mean(film: &Film) -> Measured {
    let (mean, error) = (film.mean_colour(), film.mean_colour_error().expect("several passes"));
    Measured { mean: mean.x, error: error.x }
}

#[test]
fn a_glossy_floor_shows_the_lamp_in_a_mirror_as_one_behind_it() {
    for (name, floor) in floors() {
        let kinds: &[&str] = if name == "dark metal" { &["spot"] } else { &["spot", "sun", "square"] };
        for kind in kinds {
            let gathered = Settings { method: Method::Path, samples: 64, ..small(12, 12, 1) };
            let expected = mean(&film(scene(kind, floor.clone(), false), gathered, 16));
            // The bias of a disk goes with the square of its radius over the width of the highlight.
            let caustic_radius = if name == "dark metal" { 1.5 } else { 3.0 };
            let shooting = Settings { caustic_radius, ..small(12, 12, 60_000) };
            let shot = mean(&film(scene(kind, floor.clone(), true), shooting, 24));
            eprintln!("{name}, {kind}: {shot:?} against {expected:?}");
            let error = shot.error.hypot(expected.error);
            Measured { error, ..shot }.must_be(expected.mean, 0.003);
        }
    }
}

#[test]
fn photons_tell_it_of_small_lamps_alone() {
    let plan = |kind: &str, settings: Settings| Plan::new(scene(kind, floors()[0].1.clone(), true), settings);
    let has = |plan: &Plan| plan.photons.as_ref().is_some_and(|photons| photons.glints.is_some());
    assert!(has(&plan("spot", small(8, 8, 100))) && has(&plan("square", small(8, 8, 100))));
    assert!(!has(&plan("spot", Settings { atlas: true, ..small(8, 8, 100) })));
    let wide = mixed(true, true).finish();
    assert!(!has(&Plan::new(wide, small(8, 8, 100))), "its ceiling is a lamp");
}
