//! Glass: power through a slab, where a prism sends its spot, total reflection, and what refraction does to radiance.

use crate::support::{Build, Measured, diffuse, glow, look, measure, small};
use glam::Vec3;
use halflight::light::{Invisible, Light};
use halflight::optics::{Dielectric, Lobe, ThinDielectric};
use halflight::photon::Photon;
use halflight::plan::Plan;
use halflight::render::learn;
use halflight::scene::{Camera, Illumination, Luminaire, Material, Projection, Scene, SpotCone};
use halflight::shoot::shoot;

const IOR: f32 = 1.5;

/// A narrow beam of 1 W from `position` along `direction`.
fn beam(build: &mut Build, position: Vec3, direction: Vec3) {
    let cone = SpotCone::of_cosines(0.99999, 0.99999);
    let intensity = Light::both(Vec3::splat(1.0 / cone.solid_angle()));
    build.0.luminaires.push(Luminaire::Spot { position, direction: direction.normalize(), intensity, cone });
}

/// Photons of `passes` passes that arrive on the floor through glass, pass by pass.
fn caustic(scene: Scene, passes: u32) -> Vec<Vec<Photon<Invisible>>> {
    let plan = Plan::new(scene, small(8, 8, 20_000));
    let frame = learn(&plan);
    assert!(frame.photons.is_some(), "glass feeds photons");
    (0..passes).map(|pass| shoot::<Invisible>(&plan, &frame, pass).by_class[1].clone()).collect()
}

fn powers(passes: &[Vec<Photon<Invisible>>]) -> Vec<f64> {
    passes.iter().map(|photons| photons.iter().map(|photon| f64::from(photon.power.0.x)).sum()).collect()
}

fn fresnel(cos: f64, eta: f64) -> f64 {
    let cos_t = (1.0 - (1.0 - cos * cos) / (eta * eta)).sqrt();
    let (p, s) = ((eta * cos - cos_t) / (eta * cos + cos_t), (cos - eta * cos_t) / (cos + eta * cos_t));
    0.5 * (p * p + s * s)
}

fn slab_scene(lobe: Lobe, thick: bool) -> Build {
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(0.0, 4.0, 4.0), Vec3::ZERO));
    let floor = build.material("Floor", diffuse(0.0001));
    let glass = build.material("Glass", lobe);
    build.quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, floor);
    build.quad(Vec3::new(-4.0, 1.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, glass);
    if thick {
        build.quad(Vec3::new(-4.0, 0.8, -4.0), Vec3::X * 8.0, Vec3::Z * 8.0, glass);
    }
    build
}

#[test]
fn a_slab_transmits_what_fresnel_says() {
    // Both faces and every reflection between them: T = (1 − R) / (1 + R).
    let tilt: f64 = 0.9;
    let r = fresnel(tilt.cos(), f64::from(IOR));
    let direction = Vec3::new(tilt.sin() as f32, -tilt.cos() as f32, 0.0);
    let solid = Lobe::Dielectric(Dielectric { ior: IOR, tint: Vec3::ONE });
    let thin = Lobe::ThinDielectric(ThinDielectric { ior: IOR, tint: Vec3::ONE });
    for (lobe, thick) in [(solid, true), (thin, false)] {
        let mut build = slab_scene(lobe, thick);
        beam(&mut build, Vec3::new(-1.5, 2.0, 0.0), direction);
        Measured::of(&powers(&caustic(build.finish(), 24))).must_be((1.0 - r) / (1.0 + r), 0.001);
    }
}

#[test]
fn a_prism_sends_its_spot_where_snell_says() {
    // The beam enters the prism's level top straight and meets the slanted base at 25°.
    let slant = 25.0_f64.to_radians();
    let refracted = (f64::from(IOR) * slant.sin()).asin() - slant; // deviation from the vertical
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(0.0, 4.0, 4.0), Vec3::ZERO));
    let floor = build.material("Floor", diffuse(0.5));
    let glass = build.material("Glass", Lobe::Dielectric(Dielectric { ior: IOR, tint: Vec3::ONE }));
    build.quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, floor);
    build.quad(Vec3::new(-1.0, 2.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, glass);
    // A plane through (0, 1, 0) that falls towards +x; its front looks down.
    let fall = slant.tan() as f32;
    build.quad(Vec3::new(-1.0, 1.0 + fall, -1.0), Vec3::new(2.0, -2.0 * fall, 0.0), Vec3::Z * 2.0, glass);
    beam(&mut build, Vec3::new(0.0, 3.0, 0.0), -Vec3::Y);
    let passes = caustic(build.finish(), 24);
    let (r1, r2) = (fresnel(1.0, f64::from(IOR)), fresnel_inside(slant));
    // The spot below; what was reflected inside lands elsewhere.
    let place = refracted.tan();
    let in_spot = |photon: &&Photon<Invisible>| (f64::from(photon.position.x) - place).abs() < 0.05;
    let power: Vec<f64> = passes
        .iter()
        .map(|photons| photons.iter().filter(in_spot).map(|photon| f64::from(photon.power.0.x)).sum())
        .collect();
    Measured::of(&power).must_be((1.0 - r1) * (1.0 - r2), 0.001);
    let places: Vec<f64> = passes
        .iter()
        .map(|photons| {
            let spot: Vec<f64> =
                photons.iter().filter(in_spot).map(|photon| f64::from(photon.position.x)).collect();
            spot.iter().sum::<f64>() / spot.len() as f64
        })
        .collect();
    Measured::of(&places).must_be(place, 0.003);
}

#[test]
fn a_prism_spreads_colours() {
    // The same prism of a glass whose index is 1.5 in green and a tenth of .5 less in red, more in blue.
    let (slant, dispersion) = (25.0_f64.to_radians(), 4.0);
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(0.0, 4.0, 4.0), Vec3::ZERO));
    let floor = build.material("Floor", diffuse(0.5));
    let glass = build.0.material(Material::glass("Glass", IOR).with_dispersion(dispersion));
    build.quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, floor);
    build.quad(Vec3::new(-1.0, 2.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, glass);
    let fall = slant.tan() as f32;
    build.quad(Vec3::new(-1.0, 1.0 + fall, -1.0), Vec3::new(2.0, -2.0 * fall, 0.0), Vec3::Z * 2.0, glass);
    beam(&mut build, Vec3::new(0.0, 3.0, 0.0), -Vec3::Y);
    let passes = caustic(build.finish(), 48);
    for (colour, ior) in [1.45, 1.5, 1.55].into_iter().enumerate() {
        let place = ((ior * slant.sin()).asin() - slant).tan();
        let spot = |photons: &Vec<Photon<Invisible>>| {
            let near = |photon: &&Photon<Invisible>| (f64::from(photon.position.x) - 0.26).abs() < 0.15;
            let of_colour = photons.iter().filter(|photon| photon.power.0[colour] > 0.0);
            let all = of_colour.filter(near).map(|p| (f64::from(p.power.0[colour]), f64::from(p.position.x)));
            all.fold((0.0, 0.0), |(power, places), (p, x)| (power + p, places + p * x))
        };
        let spots: Vec<(f64, f64)> = passes.iter().map(spot).collect();
        let power: Vec<f64> = spots.iter().map(|(power, _)| *power).collect();
        let (r1, r2) = (fresnel(1.0, ior), fresnel(slant.cos(), 1.0 / ior));
        Measured::of(&power).must_be((1.0 - r1) * (1.0 - r2), 0.002);
        let places: Vec<f64> = spots.iter().map(|(power, sum)| sum / power).collect();
        Measured::of(&places).must_be(place, 0.003);
    }
}

/// Reflectance from inside the glass at angle `slant`.
fn fresnel_inside(slant: f64) -> f64 {
    fresnel(slant.cos(), 1.0 / f64::from(IOR))
}

#[test]
fn beyond_the_critical_angle_nothing_leaves() {
    // A beam that starts inside the slab at 45° and can only leave through edges that are not there.
    let mut build = slab_scene(Lobe::Dielectric(Dielectric { ior: IOR, tint: Vec3::ONE }), true);
    beam(&mut build, Vec3::new(0.0, 0.9, 0.0), Vec3::new(1.0, -1.0, 0.0));
    let through: f64 = powers(&caustic(build.finish(), 4)).iter().sum();
    assert_eq!(through, 0.0);
}

#[test]
fn radiance_seen_from_inside_glass_is_scaled_by_eta_squared() {
    // A camera inside glass looks out at a glowing wall: L inside = η² (1 − R) L outside.
    let inside = |lobe| {
        let mut camera = look(Vec3::ZERO, Vec3::Z);
        camera = Camera { projection: Projection::Perspective { yfov: 0.02 }, ..camera };
        let mut build = Build::new(Illumination::GLOBAL, camera);
        let wall = build.material("Wall", diffuse(0.0));
        let glass = build.material("Glass", lobe);
        build.0.materials[wall as usize].emission = glow(2.0);
        build.quad(Vec3::new(-1.0, -1.0, 1.0), Vec3::X * 2.0, Vec3::Y * 2.0, glass);
        build.quad(Vec3::new(-3.0, -3.0, 2.0), Vec3::Y * 6.0, Vec3::X * 6.0, wall);
        build.finish()
    };
    let solid = Lobe::Dielectric(Dielectric { ior: IOR, tint: Vec3::ONE });
    let eta = f64::from(IOR);
    measure(inside(solid), small(32, 32, 1), 16).must_be(2.0 * eta * eta * (1.0 - fresnel(1.0, eta)), 0.001);
}
