//! Matter that is there in part: alpha.

use crate::moved::somewhere;
use crate::support::{Build, diffuse, glow, look, measure, small};
use crate::textures::{CORNERS, holes};
use glam::Vec3;
use halflight::light::Light;
use halflight::plan::{Direct, Method, Settings};
use halflight::scene::{Alpha, Factor, Illumination, Luminaire, Material, Pbr, Scene, SpotCone};
use std::f64::consts::PI;

/// Black matter of which this share is there.
fn veil(alpha: f32) -> Pbr {
    Pbr {
        base: Factor::new(Vec3::ZERO),
        metallic: 0.0,
        specular: Factor::new(0.0),
        coverage: Alpha::Blend,
        alpha,
        two_sided: true,
        ..Pbr::default()
    }
}

/// `panes` one above the other between a floor and a lamp straight above its middle, which is looked at from below them.
fn beneath(panes: &[Pbr], illumination: Illumination) -> Scene {
    let mut build = Build::new(illumination, look(Vec3::new(0.0, 0.9, 0.4), Vec3::ZERO));
    let floor = build.material("Floor", diffuse(0.5));
    build.quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, floor);
    for (i, pane) in panes.iter().enumerate() {
        let pane = build.0.material(Material::pbr("Pane", pane.clone()));
        build.quad(Vec3::new(-4.0, 1.0 + 0.1 * i as f32, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, pane);
        build.0.shapes.last_mut().expect("the pane").uvs[0] = Some(CORNERS.to_vec());
    }
    let (intensity, cone) = (Light::both(Vec3::splat(3.0)), SpotCone::of_cosines(0.99, 0.99));
    let (position, direction) = (2.0 * Vec3::Y, Vec3::NEG_Y);
    build.0.luminaires.push(Luminaire::Spot { position, direction, intensity, cone });
    build.yfov(0.01);
    build.finish()
}

#[test]
fn panes_in_a_row_let_through_what_is_not_there() {
    let panes = [veil(0.3), veil(0.5), veil(0.2)];
    // A quarter of 3 W/sr arrives 2 m below the lamp; half of that is reflected, over π.
    let bare = 0.5 / PI * 3.0 / 4.0;
    for (illumination, through) in [
        (Illumination::GLOBAL, 0.7 * 0.5 * 0.8),
        // What is there casts no shadow.
        (Illumination::LOCAL, 1.0),
    ] {
        for (method, direct) in [
            (Method::Photon, Direct::Connection),
            (Method::Photon, Direct::Photons),
            (Method::Path, Direct::Auto),
        ] {
            let settings = Settings { method, direct, samples: 4, ..small(8, 8, 40_000) };
            let scene = somewhere(&beneath(&panes, illumination), 3 + method as u64);
            let measured = measure(scene, settings, 48);
            measured.must_be(through * bare, 4e-3);
            // Connections through panes have no noise.
            assert!(direct == Direct::Photons || measured.error < 1e-4 * bare, "{measured:?}");
        }
    }
}

#[test]
fn light_comes_through_holes_and_they_are_seen_through() {
    // A sheet of which half is holes, looked through at a wall that glows with 2.
    let sieve = Pbr {
        base: Factor { factor: Vec3::ZERO, texture: Some(holes()) },
        coverage: Alpha::Mask(0.5),
        alpha: 1.0,
        ..veil(1.0)
    };
    let mut build = Build::new(Illumination::GLOBAL, look(5.0 * Vec3::Z, Vec3::ZERO));
    let wall = build.material("Wall", diffuse(0.0));
    build.0.materials[wall as usize].emission = glow(2.0);
    build.quad(Vec3::new(-9.0, -9.0, -1.0), Vec3::X * 18.0, Vec3::Y * 18.0, wall);
    let sieve = build.0.material(Material::pbr("Sieve", sieve));
    build.quad(Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0, sieve);
    build.0.shapes.last_mut().expect("the sheet").uvs[0] = Some(CORNERS.to_vec());
    // Four squares of its eight on each side fill the view.
    build.yfov(2.0 * (0.5_f32 / 5.0).atan());
    let scene = build.finish();
    for method in [Method::Photon, Method::Path, Method::PathPlain] {
        let settings = Settings { method, samples: 16, ..small(8, 8, 100) };
        measure(somewhere(&scene, 11 + method as u64), settings, 64).must_be(1.0, 3e-3);
    }
}
