//! Light that bodies absorb on its way through them: Beer's and Lambert's law.

use crate::moved::somewhere;
use crate::support::{Build, diffuse, glow, look, measure, small};
use glam::Vec3;
use halflight::light::Light;
use halflight::plan::{Method, Settings};
use halflight::scene::{Illumination, Luminaire, Material, Scene, SpotCone};

/// m⁻¹.
const ABSORPTION: f32 = 1.3;
/// m.
const THICK: f32 = 0.6;

/// A slab of glass, looked through at right angles at a wall that glows with 2.
fn slab(ior: f32) -> Scene {
    let mut build = Build::new(Illumination::GLOBAL, look(5.0 * Vec3::Z, Vec3::ZERO));
    let glass = Material::glass("Glass", ior).with_absorption(Vec3::new(ABSORPTION, 0.0, 0.1));
    let glass = build.0.material(glass);
    let wall = build.material("Wall", diffuse(0.0));
    build.0.materials[wall as usize].emission = glow(2.0);
    let (side, half) = (20.0, 10.0);
    build.quad(Vec3::new(-half, -half, -3.0), Vec3::X * side, Vec3::Y * side, wall);
    build.quad(Vec3::new(-half, -half, 0.0), Vec3::X * side, Vec3::Y * side, glass);
    build.quad(Vec3::new(-half, -half, -THICK), Vec3::Y * side, Vec3::X * side, glass);
    build.finish()
}

/// Of all light that comes straight at a slab, the share that comes out behind: every reflection within counted.
fn through(ior: f32) -> f64 {
    let r = (f64::from(ior) - 1.0).powi(2) / (f64::from(ior) + 1.0).powi(2);
    let a = f64::from(-ABSORPTION * THICK).exp();
    (1.0 - r).powi(2) * a / (1.0 - r * r * a * a)
}

#[test]
fn a_slab_absorbs_what_beer_says() {
    for ior in [1.0, 1.5] {
        for method in [Method::Photon, Method::Path, Method::PathPlain] {
            let settings = Settings { method, samples: 64, ..small(8, 8, 1000) };
            let scene = somewhere(&slab(ior), method as u64);
            measure(scene, settings, 64).must_be(2.0 * through(ior), 2e-3);
        }
    }
}

/// A floor in the body of a tank under a lamp in it: connections and photons are absorbed on their way.
#[test]
fn connections_within_a_body_are_absorbed() {
    let tank = |height: f32| {
        let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(0.0, 6.0, 0.01), Vec3::ZERO));
        let water = Material::glass("Water", 1.0).with_absorption(Vec3::splat(ABSORPTION));
        let water = build.0.material(water);
        let floor = build.material("Floor", diffuse(0.5));
        let (side, half) = (20.0, 10.0);
        build.quad(Vec3::new(-half, 0.0, -half), Vec3::Z * side, Vec3::X * side, floor);
        // The surface of the water is above the lamp, or below it.
        build.quad(Vec3::new(-half, height, -half), Vec3::Z * side, Vec3::X * side, water);
        let intensity = Light::both(Vec3::ONE);
        let position = Vec3::new(0.3, 1.0, 0.0);
        let (direction, cone) = (-position.normalize(), SpotCone::of_cosines(0.95, 0.95));
        build.0.luminaires.push(Luminaire::Spot { position, direction, intensity, cone });
        build.yfov(0.01);
        build.finish()
    };
    // Irradiance at the origin, reflected by half, and absorbed again on its way up to the surface.
    let r = 1.0_f64 + 0.09;
    let irradiance = 1.0 / (r * r.sqrt());
    let left = |way: f64| (-f64::from(ABSORPTION) * way).exp();
    for (height, way) in [(1.5, r.sqrt() + 1.5), (0.4, 0.4 * r.sqrt() + 0.4)] {
        let expected = 0.5 / std::f64::consts::PI * irradiance * left(way);
        for method in [Method::Photon, Method::Path] {
            // A path tracer connects through no glass.
            if height < 1.0 && method == Method::Path {
                continue;
            }
            let settings = Settings { method, samples: 16, ..small(8, 8, 20_000) };
            measure(tank(height), settings, 64).must_be(expected, 4e-3);
        }
    }
}
