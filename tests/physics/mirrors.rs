//! Chains of mirrors, seen by the camera and followed by photons.

use crate::support::{Build, Measured, diffuse, glow, look, measure, small};
use glam::Vec3;
use halflight::light::{Invisible, Light};
use halflight::optics::{Lobe, Mirror};
use halflight::plan::Plan;
use halflight::render::learn;
use halflight::scene::{Camera, Illumination, Luminaire, Projection, Scene, SpotCone};
use halflight::shoot::shoot;

fn mirror(tint: f32) -> Lobe {
    Lobe::Mirror(Mirror::plain(Vec3::splat(tint), false))
}

/// Two mirrors at 45° make a periscope: light that comes down at x = 0 goes along +x and down again at x = 2.
fn periscope(illumination: Illumination) -> Build {
    let mut build = Build::new(illumination, look(Vec3::new(0.0, 3.0, 0.0), Vec3::ZERO));
    let (upper, lower) = (build.material("First", mirror(0.8)), build.material("Second", mirror(0.5)));
    // Fronts: the first looks to (+x, +y), the second to (−x, −y).
    build.quad(Vec3::new(-0.5, 0.5, -0.5), Vec3::Z, Vec3::new(1.0, -1.0, 0.0), upper);
    build.quad(Vec3::new(1.5, 0.5, -0.5), Vec3::new(1.0, -1.0, 0.0), Vec3::Z, lower);
    build
}

#[test]
fn the_camera_sees_a_luminaire_through_two_mirrors() {
    let mut build = periscope(Illumination::GLOBAL);
    let lamp = build.material("Lamp", diffuse(0.0));
    build.0.materials[lamp as usize].emission = glow(7.0);
    build.quad(Vec3::new(1.0, -2.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, lamp);
    measure(build.finish(), small(8, 8, 1000), 4).must_be(7.0 * 0.8 * 0.5, 1e-4);
}

#[test]
fn photons_go_through_two_mirrors() {
    let mut build = periscope(Illumination::GLOBAL);
    let floor = build.material("Floor", diffuse(0.5));
    build.quad(Vec3::new(1.0, -2.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, floor);
    let cone = SpotCone::of_cosines(0.9999, 0.999);
    let intensity = Light::both(Vec3::splat(3.0 / cone.solid_angle()));
    build.0.luminaires.push(Luminaire::Spot {
        position: Vec3::Y * 3.0,
        direction: -Vec3::Y,
        intensity,
        cone,
    });
    let plan = Plan::new(build.finish(), small(8, 8, 20_000));
    let frame = learn(&plan);
    assert!(frame.photons.is_some(), "mirrors feed photons");
    let power: Vec<f64> = (0..24)
        .map(|pass| {
            shoot::<Invisible>(&plan, &frame, pass).by_class[1].iter().map(|p| f64::from(p.power.0.x)).sum()
        })
        .collect();
    Measured::of(&power).must_be(3.0 * 0.8 * 0.5, 0.001);
}

/// A mirror that looks straight down on a floor lit by a point light.
fn mirrored_floor(surroundings: Illumination, own: Option<Illumination>) -> Scene {
    let mut build = Build::new(surroundings, look(Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 2.0, 0.0)));
    let glass = build.material("Mirror", mirror(0.9));
    build.0.materials[glass as usize].illumination = own;
    let floor = build.material("Floor", diffuse(0.5));
    build.quad(Vec3::new(-0.1, 2.0, -0.1), Vec3::X * 0.2, Vec3::Z * 0.2, glass);
    build.quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0, floor);
    let intensity = Light::both(Vec3::splat(4.0));
    build.0.luminaires.push(Luminaire::Point { position: Vec3::new(0.0, 1.5, 0.0), intensity });
    build.yfov(0.002);
    build.finish()
}

#[test]
fn a_local_surface_in_a_mirror_shows_nothing() {
    // The mirror's row reads the invisible half, where local surfaces do not reflect: docs/architecture.md.
    let scene = mirrored_floor(Illumination::LOCAL, None);
    assert_eq!(measure(scene, small(8, 8, 1000), 4).mean, 0.0);
}

#[test]
fn a_whitted_mirror_shows_it() {
    let scene = mirrored_floor(Illumination::LOCAL, Some(Illumination::Whitted));
    // Irradiance I / d² = 4 / 1.5², radiance ρ E / π, times the tint.
    let expected = 0.9 * 0.5 / std::f64::consts::PI * 4.0 / 2.25;
    measure(scene, small(8, 8, 1000), 4).must_be(expected, 0.001);
}

/// A lamp that reflects nothing in a closed room of perfect mirrors: both are boxes, given by half their side.
fn hall_of_mirrors(room: f32, lamp: f32) -> Scene {
    let projection = Projection::Perspective { yfov: 1.0 };
    let camera = Camera::look_at(Vec3::new(0.1, -0.2, 1.5), Vec3::ZERO, Vec3::Y, projection);
    let mut build = Build::new(Illumination::GLOBAL, camera);
    let (wall, glowing) = (build.material("Wall", mirror(1.0)), build.material("Lamp", diffuse(0.0)));
    build.0.materials[glowing as usize].emission = glow(1.0);
    let faces = [(Vec3::X, Vec3::Y, Vec3::Z), (Vec3::Y, Vec3::Z, Vec3::X), (Vec3::Z, Vec3::X, Vec3::Y)];
    for (centre, half, material, outward) in
        [(Vec3::ZERO, room, wall, false), (Vec3::new(0.2, 0.1, 0.15), lamp, glowing, true)]
    {
        for ((axis, next, last), up) in faces.into_iter().flat_map(|face| [(face, true), (face, false)]) {
            let (a, b) = if up == outward { (next, last) } else { (last, next) };
            let side = if up { axis } else { -axis };
            build.quad(centre + half * (side - a - b), 2.0 * half * a, 2.0 * half * b, material);
        }
    }
    build.finish()
}

#[test]
fn in_a_hall_of_perfect_mirrors_all_is_as_bright_as_the_lamp() {
    // Every line ends at the lamp, one in n of them after more than n mirrors.
    measure(hall_of_mirrors(2.0, 0.3), small(32, 32, 1000), 300).must_be(1.0, 0.0);
}
