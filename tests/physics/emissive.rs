//! Luminaires shine where they are bright: power against integrals of their textures, and where light starts.

use crate::agreement::{left_to_the_long_run, must_agree};
use crate::support::{Build, diffuse, look};
use crate::textures::{CORNERS, body, holes, squares};
use glam::{Vec2, Vec3};
use halflight::emission::Emitters;
use halflight::light::{Invisible, Light, Power};
use halflight::path_trace::{PathSettings, Rows, Strength, trace_pass};
use halflight::plan::Direct;
use halflight::rays::Rays;
use halflight::sampling::Sobol;
use halflight::scene::texture::{Encoding, Image, Texture};
use halflight::scene::{
    Alpha, Camera, Factor, Illumination, Luminaire, Material, Pbr, Projection, Scene, Shape,
};
use std::f32::consts::PI;
use std::sync::Arc;
use std::time::Instant;

/// A lamp of 2 m × 2 m that looks down, u along x, v along z, in `repeats` of its image a side.
fn lamp(pbr: Pbr, repeats: f32, twosided: bool) -> Scene {
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(0.3, -3.0, 0.2), Vec3::ZERO));
    let material = build.0.material(Material::pbr("Lamp", Pbr { two_sided: twosided, ..pbr }));
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
    let quad = Shape::new("lamp", material, corners, [[0, 1, 2], [0, 2, 3]]);
    build.0.shape(quad.with_uvs(CORNERS.map(|uv| repeats * uv).to_vec()));
    build.finish()
}

fn glowing(texture: Texture, factor: Vec3) -> Pbr {
    Pbr { emissive: Factor { factor, texture: Some(texture) }, ..body(Factor::new(Vec3::splat(0.5))) }
}

/// An image of grey levels that are no sRGB, between whose texels there is something between them.
fn smooth(side: u32, texel: impl Fn(u32, u32) -> u8) -> Texture {
    let texels = (0..side * side).map(|i| texel(i % side, i / side)).collect();
    Texture::new(Arc::new(Image::new("smooth", [side; 2], texels, Encoding::Data).expect("a texel each")))
}

fn power(scene: &Scene) -> Light {
    scene.luminaires.iter().map(|luminaire| luminaire.power(1.0)).fold(Light::ZERO, |sum, one| sum + one)
}

/// Power (W) of the lamp for a mean texel.
fn expected(mean: f32, factor: Vec3) -> Vec3 {
    4.0 * PI * mean * factor
}

#[track_caller]
fn must_shine(name: &str, scene: &Scene, expected: Vec3) {
    let found = power(scene).invisible;
    println!("{name}: {} luminaires, {found} W for {expected}", scene.luminaires.len());
    let off = |found: Vec3| (found - expected).abs().max_element() / expected.max_element();
    assert!(off(found) < 0.01, "{name}: {found} for {expected}");
    assert!(off(1.02 * found) > 0.01);
    // What photons carry, too.
    let emitters = Emitters::<Invisible>::new(scene).expect("it shines");
    let (paths, sobol) = (1 << 16, Sobol::new(7));
    let shot: Vec3 = (0..paths).map(|path| emitters.emit(paths, sobol.point(path, 0)).power.0).sum();
    assert!(off(shot) < 0.01, "{name}: {shot} shot for {expected}");
}

/// Every so many texels of 255 one that glows, spread without order.
fn stars(one_in: u32) -> impl Fn(u32, u32) -> u8 {
    move |x, y| {
        let mixed =
            (x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77)).wrapping_mul(0xc2b2_ae3d) >> 7;
        if mixed.is_multiple_of(one_in) { 255 } else { 0 }
    }
}

fn mean(side: u32, texel: impl Fn(u32, u32) -> u8) -> f32 {
    let sum: u64 = (0..side * side).map(|i| u64::from(texel(i % side, i / side))).sum();
    (sum as f64 / 255.0 / f64::from(side * side)) as f32
}

#[test]
fn lamps_have_the_power_of_their_texels() {
    let factor = Vec3::new(3.0, 2.0, 1.0);
    let checker = |x: u32, y: u32| if (x + y).is_multiple_of(2) { 204 } else { 51 };
    let ramp = |x: u32, _: u32| x as u8;
    let one = |x: u32, y: u32| if (x, y) == (2, 1) { 255 } else { 0 };
    for repeats in [1.0, 7.0] {
        let lamp = |texture| lamp(glowing(texture, factor), repeats, false);
        must_shine("checker", &lamp(squares(8, Encoding::Data, checker)), expected(0.5, factor));
        must_shine("smooth checker", &lamp(smooth(8, checker)), expected(0.5, factor));
        must_shine("fine checker", &lamp(squares(512, Encoding::Data, checker)), expected(0.5, factor));
        must_shine("ramp", &lamp(smooth(256, ramp)), expected(mean(256, ramp), factor));
        must_shine("one texel", &lamp(squares(4, Encoding::Data, one)), expected(1.0 / 16.0, factor));
        must_shine("one smooth texel", &lamp(smooth(4, one)), expected(1.0 / 16.0, factor));
        let stars = stars(37);
        must_shine("stars", &lamp(smooth(256, &stars)), expected(mean(256, &stars), factor));
    }
    // Half of it is holes, which do not shine.
    let base = Factor { factor: Vec3::ONE, texture: Some(holes()) };
    for coverage in [Alpha::Mask(0.7), Alpha::Blend] {
        let pbr = Pbr {
            base: base.clone(),
            coverage,
            emissive: Factor::new(factor),
            ..body(Factor::new(Vec3::ONE))
        };
        must_shine("holes", &lamp(pbr, 1.0, false), expected(0.5, factor));
    }
    // Both sides of what shines on both.
    let both = lamp(glowing(smooth(8, checker), factor), 1.0, true);
    must_shine("both sides", &both, 2.0 * expected(0.5, factor));
}

#[test]
fn no_light_starts_where_it_is_dark() {
    let bright = |x: u32, y: u32| (x, y) == (1, 2) || (x, y) == (5, 6);
    let texture = squares(8, Encoding::Data, |x, y| if bright(x, y) { 255 } else { 0 });
    let scene = lamp(glowing(texture, Vec3::ONE), 1.0, false);
    let emitters = Emitters::<Invisible>::new(&scene).expect("it shines");
    let sobol = Sobol::new(1);
    let (mut dark, paths) = (0, 20_000);
    for path in 0..paths {
        let emitted = emitters.emit(paths, sobol.point(path, 0));
        let [x, y] = [emitted.origin.x, emitted.origin.z].map(|place| (4.0 * (place + 1.0)) as u32);
        if bright(x, y) {
            assert!(emitted.power.total() > 0.0);
        } else {
            assert_eq!(emitted.power.total(), 0.0, "{}", emitted.origin);
            dark += 1;
        }
    }
    println!("{dark} of {paths} paths are of no use; {} luminaires", scene.luminaires.len());
    assert!(dark < paths / 20, "{dark} of {paths} paths are of no use");
    let all_black = lamp(glowing(squares(4, Encoding::Data, |_, _| 0), Vec3::ONE), 1.0, false);
    assert!(all_black.luminaires.is_empty());
    // What is the same all over is one luminaire a triangle, as without a texture.
    let alike = lamp(glowing(squares(4, Encoding::Data, |_, _| 102), Vec3::ONE), 1.0, false);
    assert!(
        alike.luminaires.iter().all(|luminaire| matches!(luminaire, Luminaire::Triangle { part: None, .. }))
    );
    assert!((power(&alike).visible - expected(0.4, Vec3::ONE)).abs().max_element() < 1e-5);
}

#[test]
fn lamps_are_seen_as_their_texture_is() {
    let texture = squares(4, Encoding::Data, |x, y| (17 * (x + 4 * y)) as u8);
    let scene = lamp(glowing(texture, Vec3::ONE), 1.0, false);
    for strength in [Strength::Plain, Strength::NextEvent] {
        for i in 0..16 {
            let place = Vec3::new(-0.75 + 0.5 * (i % 4) as f32, 0.0, -0.75 + 0.5 * (i / 4) as f32);
            let mut scene = scene.clone();
            let projection = Projection::Perspective { yfov: 0.01 };
            scene.camera = Camera::look_at(place - Vec3::Y, place, Vec3::Z, projection);
            let settings = PathSettings {
                width: 2,
                height: 2,
                samples_per_pixel: 1,
                seed: 1,
                strength,
                rows: Rows::Visible,
                max_reflections: None,
            };
            let seen = trace_pass(&scene, &Rays::build(&scene), &settings, 0).visible[0].x;
            assert!((seen - i as f32 / 15.0).abs() < 1e-4, "{i}: {seen}");
        }
    }
}

#[test]
fn a_lamp_of_many_texels_and_one_of_many_triangles_take_seconds() {
    if left_to_the_long_run("lamps of 4096 x 4096 texels and of half a million triangles") {
        return;
    }
    let side = 4096;
    let stars = stars(100);
    let panels =
        |x: u32, y: u32| if (x / 300 + y / 500).is_multiple_of(3) { 255 - (x % 50) as u8 } else { 0 };
    for (name, texel) in [("stars", &stars as &dyn Fn(u32, u32) -> u8), ("panels", &panels)] {
        let texture = smooth(side, texel);
        let start = Instant::now();
        let scene = lamp(glowing(texture, Vec3::ONE), 1.0, false);
        println!("{name}: {side}² texels in {:?}", start.elapsed());
        let (found, expected) = (power(&scene).invisible.x, expected(mean(side, texel), Vec3::ONE).x);
        println!("{} luminaires, {found} W for {expected}", scene.luminaires.len());
        assert!((found / expected - 1.0).abs() < 0.01);
    }
    // 2 × 500² triangles of 64² texels.
    let n = 500_u32;
    let texture = smooth(64, |x, y| (3 * x + y / 2) as u8);
    let material = Material::pbr("Lamp", glowing(texture, Vec3::ONE));
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(0.3, -3.0, 0.2), Vec3::ZERO));
    let material = build.0.material(material);
    let place = |i: u32| Vec2::new((i % (n + 1)) as f32, (i / (n + 1)) as f32) / n as f32;
    let corners = (0..(n + 1) * (n + 1)).map(|i| 2.0 * Vec3::new(place(i).x, 0.5, place(i).y) - 1.0);
    let triangles: Vec<[u32; 3]> = (0..n * n)
        .flat_map(|i| {
            let a = i / n * (n + 1) + i % n;
            [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]
        })
        .collect();
    let uvs = (0..(n + 1) * (n + 1)).map(place).collect();
    build.0.shape(Shape::new("lamp", material, corners, triangles).with_uvs(uvs));
    let start = Instant::now();
    let scene = build.finish();
    println!("{} triangles in {:?}", 2 * n * n, start.elapsed());
    must_shine("triangles", &scene, expected(mean(64, |x, y| (3 * x + y / 2) as u8), Vec3::ONE));
}

/// A box with a rough mirror ball under a lamp that is a texture; it is not seen itself.
fn lit_by(pbr: Pbr) -> Scene {
    let mut build = crate::agreement::mixed(true, false);
    let ball = crate::agreement::rough(0.35, Vec3::new(0.9, 0.8, 0.7));
    let ball = build.material("Rough", ball);
    build.sphere(Vec3::new(0.45, -0.45, 0.2), 0.35, (48, 24), false, ball);
    build.0.materials[0] = Material::new("White", diffuse(0.6));
    build.0.materials[1] = Material::pbr("Lamp", pbr);
    for shape in &mut build.0.shapes {
        if shape.positions.len() == 4 {
            shape.uvs[0] = Some(CORNERS.to_vec());
        }
    }
    build.finish()
}

#[test]
#[ignore = "long physics: cargo test --release --workspace -- --ignored"]
fn methods_agree_under_lamps_that_are_pictures() {
    if left_to_the_long_run("lamps that are pictures") {
        return;
    }
    let factor = Vec3::new(5.0, 4.0, 3.0);
    let lamp = |texture| Pbr { emission: [1.0, 0.0], ..glowing(texture, factor) };
    let checker = |x: u32, y: u32| if (x + y).is_multiple_of(2) && x < 5 { 255 } else { 20 };
    let scene = lit_by(lamp(squares(8, Encoding::Data, checker)));
    must_agree("a checker that shines", &scene, Direct::Connection);
    must_agree("photons of a checker", &scene, Direct::Photons);
    let ramp = lit_by(lamp(smooth(32, |x, y| (x * x / 4) as u8 / if y < 9 { 5 } else { 1 })));
    must_agree("a ramp that shines", &ramp, Direct::Connection);
    let base = Factor { factor: Vec3::splat(0.4), texture: Some(holes()) };
    let holes = Pbr { base, coverage: Alpha::Blend, ..lamp(smooth(8, |x, y| (30 * x + 4 * y) as u8)) };
    must_agree("a lamp with holes", &lit_by(holes), Direct::Connection);
}
