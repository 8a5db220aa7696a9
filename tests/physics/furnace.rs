//! Closed rooms whose walls glow uniformly: L = E / (1 − ρ) everywhere; and the empty convex room.

use crate::support::{Build, Measured, diffuse, glow, measure, small};
use glam::Vec3;
use halflight::film::Layer;
use halflight::optics::{Dielectric, Diffuse, Lobe, Mirror, ThinDielectric};
use halflight::plan::{Method, Settings};
use halflight::render::Render;
use halflight::scene::{Camera, Illumination, Projection, Scene};

/// A ball seen from within whose wall glows.
pub fn furnace(albedo: f32, illumination: Illumination) -> Scene {
    let camera =
        Camera::look_at(Vec3::new(0.2, 0.1, 0.3), Vec3::X, Vec3::Y, Projection::Perspective { yfov: 1.0 });
    let mut build = Build::new(illumination, camera);
    let wall = build.material("Wall", diffuse(albedo));
    build.0.materials[wall as usize].emission = glow(1.0);
    build.sphere(Vec3::ZERO, 1.0, (64, 32), true, wall);
    // Flat: interpolated normals do not conserve energy.
    build.flatten();
    build.finish()
}

#[test]
fn a_furnace_glows_as_its_albedo_says() {
    for albedo in [0.5, 0.9] {
        let settings = Settings { caustic_radius: 3.0, indirect_radius: 3.0, ..small(24, 24, 20_000) };
        let measured = measure(furnace(albedo, Illumination::GLOBAL), settings, 40);
        measured.must_be(1.0 / (1.0 - f64::from(albedo)), 0.003);
    }
}

#[test]
fn in_an_empty_convex_room_shadowless_is_global() {
    let room = |illumination| {
        let camera = Camera::look_at(
            Vec3::new(0.9, 0.0, 0.9),
            -Vec3::ONE,
            Vec3::Y,
            Projection::Perspective { yfov: 0.9 },
        );
        let mut build = Build::new(illumination, camera);
        let wall = build.material("Wall", diffuse(0.7));
        let lamp = build.material("Lamp", diffuse(0.7));
        build.0.materials[lamp as usize].emission = glow(4.0);
        for (axis, next, last) in
            [(Vec3::X, Vec3::Y, Vec3::Z), (Vec3::Y, Vec3::Z, Vec3::X), (Vec3::Z, Vec3::X, Vec3::Y)]
        {
            let top = if axis == Vec3::Y { lamp } else { wall };
            build.quad(axis - next - last, 2.0 * last, 2.0 * next, top);
            build.quad(-axis - next - last, 2.0 * next, 2.0 * last, wall);
        }
        build.finish()
    };
    let passes = |illumination, seed| -> Measured {
        let settings = Settings { seed, ..small(24, 24, 20_000) };
        let mut render = Render::new(room(illumination), settings, &[Layer::Visible]).expect("a render");
        for _ in 0..32 {
            render.pass();
        }
        let (mean, error) =
            (render.film().mean_colour().x, render.film().mean_colour_error().expect("passes").x);
        Measured { mean, error }
    };
    let (global, shadowless) = (passes(Illumination::GLOBAL, 1), passes(Illumination::SHADOWLESS, 2));
    let error = global.error.hypot(shadowless.error);
    Measured { mean: shadowless.mean, error }.must_be(global.mean, 0.0);
}

#[test]
fn balls_of_few_facets_lose_nothing_however_they_are_shaded() {
    // A room that glows alike and reflects nothing, and in it a ball of few facets whose normals are those of a sphere.
    let room = |lobe| {
        let camera = Camera::look_at(
            Vec3::new(0.3, 0.5, 3.0),
            Vec3::ZERO,
            Vec3::Y,
            Projection::Perspective { yfov: 0.7 },
        );
        let mut build = Build::new(Illumination::GLOBAL, camera);
        let wall = build.material("Wall", diffuse(0.0));
        build.0.materials[wall as usize].emission = glow(1.0);
        build.sphere(Vec3::ZERO, 9.0, (16, 8), true, wall);
        build.flatten();
        let ball = build.material("Ball", lobe);
        build.sphere(Vec3::ZERO, 1.0, (10, 6), false, ball);
        build.finish()
    };
    let tint = Vec3::ONE;
    for (name, lobe) in [
        ("glass", Lobe::Dielectric(Dielectric { ior: 1.5, tint })),
        ("pane", Lobe::ThinDielectric(ThinDielectric { ior: 1.5, tint })),
        ("mirror", Lobe::Mirror(Mirror::plain(tint, false))),
        ("white", Lobe::Diffuse(Diffuse { albedo: tint, two_sided: false, under: None })),
    ] {
        for method in [Method::Photon, Method::Path] {
            let settings = Settings { method, samples: 4, ..small(40, 40, 1000) };
            let mut render = Render::new(room(lobe), settings, &[Layer::Visible]).expect("a render");
            (0..100).for_each(|_| render.pass());
            let film = render.film();
            let (mean, error) = (film.mean_colour().x, film.mean_colour_error().expect("passes").x);
            Measured { mean, error }.must_be(1.0, 1e-3);
            if !lobe.is_delta() {
                continue; // lit by chance
            }
            // Nor anywhere: rims are no darker than the middle.
            let least = film.mean(Layer::Visible).iter().map(|rgb| rgb.x).fold(f32::INFINITY, f32::min);
            assert!(least > 0.97, "{name} by {method:?}: a pixel of {least}");
        }
    }
}
