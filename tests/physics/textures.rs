//! Matter that is not the same everywhere: closed forms at points of it.

use crate::support::{Build, Measured, diffuse, glow, look, measure, small};
use glam::{Vec2, Vec3, Vec4};
use halflight::film::{Film, Layer};
use halflight::light::Light;
use halflight::optics::{Lobe, Mirror, Translucent};
use halflight::plan::{Method, Settings};
use halflight::render::Render;
use halflight::scene::texture::{Encoding, Image, Sampler, Texture};
use halflight::scene::{
    Camera, Emission, Factor, Illumination, Luminaire, Material, NormalMap, Pbr, Projection, Scene, Shape,
    VertexColours,
};
use std::f32::consts::PI;
use std::sync::Arc;

/// A square texture of one channel in squares of one colour each.
pub fn squares(side: u32, encoding: Encoding, texel: impl Fn(u32, u32) -> u8) -> Texture {
    let texels = (0..side * side).map(|i| texel(i % side, i / side)).collect();
    let image = Image::new("squares", [side; 2], texels, encoding).expect("a texel each");
    let sampler = Sampler { linear: false, ..Sampler::default() };
    Texture { sampler, ..Texture::new(Arc::new(image)) }
}

/// White with holes: every second square of eight in a row is one.
pub fn holes() -> Texture {
    let (side, mut texels) = (8_u32, Vec::new());
    for i in 0..side * side {
        texels.extend([255, 255, 255, if (i % side + i / side).is_multiple_of(2) { 255 } else { 0 }]);
    }
    let image = Image::new("holes", [side; 2], texels, Encoding::Colour).expect("four channels");
    let sampler = Sampler { linear: false, ..Sampler::default() };
    Texture { sampler, ..Texture::new(Arc::new(image)) }
}

/// Hills and valleys; slopes up to `steep`, no two alike in their neighbourhood.
pub fn hills(side: u32, steep: f32) -> NormalMap {
    let texel = |i: u32| {
        let (x, y) = ((i % side) as f32 + 0.5, (i / side) as f32 + 0.5);
        let wave = |k: f32, phase: f32| (2.0 * PI * k * (x + 0.3 * y) / side as f32 + phase).sin();
        let slopes = steep * Vec2::new(wave(1.0, 0.3), wave(2.0, 1.1) * (2.0 * PI * y / side as f32).cos());
        let normal = slopes.extend(1.0).normalize();
        (0.5 * (normal + 1.0) * 255.0).round().to_array().map(|x| x as u8)
    };
    let texels = (0..side * side).flat_map(texel).collect();
    let image = Image::new("hills", [side; 2], texels, Encoding::Data).expect("three channels");
    NormalMap { texture: Texture::new(Arc::new(image)), scale: 1.0 }
}

/// A body that is neither metal nor glass, and mirrors nothing.
pub fn body(base: Factor<Vec3>) -> Pbr {
    Pbr { base, metallic: 0.0, specular: Factor::new(0.0), ..Pbr::default() }
}

fn textured(texture: Texture) -> Factor<Vec3> {
    Factor { factor: Vec3::ONE, texture: Some(texture) }
}

pub const CORNERS: [Vec2; 4] = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];

/// A floor of 2 m about zero with a point light of 3 W/sr 1.5 m above its middle; u along x, v along z.
fn floor(material: Material, camera: Camera) -> Build {
    let mut build = Build::new(Illumination::LOCAL, camera);
    let floor = build.0.material(material);
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
    let quad = Shape::new("floor", floor, corners, [[0, 2, 1], [0, 3, 2]]).with_uvs(CORNERS.to_vec());
    build.0.shape(quad);
    let intensity = Light::both(Vec3::splat(3.0));
    build.0.luminaires.push(Luminaire::Point { position: 1.5 * Vec3::Y, intensity });
    build
}

fn rendered(scene: Scene, settings: Settings, passes: u32) -> Film {
    let mut render = Render::new(scene, settings, &[Layer::Visible]).expect("a render");
    (0..passes).for_each(|_| render.pass());
    render.film().clone()
}

/// What a camera sees at a place of the floor, a hundredth of a texel wide.
fn seen_at(material: &Material, place: Vec3, method: Method) -> Vec3 {
    let mut build = floor(material.clone(), look(place + Vec3::new(0.3, 1.0, 0.2), place));
    build.yfov(0.001);
    let film = rendered(build.finish(), Settings { method, samples: 1, ..small(2, 2, 16) }, 2);
    film.mean(Layer::Visible)[0]
}

/// Irradiance at a place of the floor.
fn irradiance(place: Vec3) -> f32 {
    let to = 1.5 * Vec3::Y - place;
    3.0 * to.normalize().y / to.length_squared()
}

const METHODS: [Method; 2] = [Method::Photon, Method::Path];

#[test]
fn a_checker_under_a_lamp_is_what_each_square_reflects() {
    // Of sRGB 250 and 100 the light is 0.9560 and 0.1274.
    let texture = squares(4, Encoding::Colour, |x, y| if (x + y).is_multiple_of(2) { 250 } else { 100 });
    let material = Material::pbr("Checker", body(textured(texture)));
    for (x, z) in [(0, 0), (1, 0), (2, 3), (3, 3), (3, 0), (0, 1)] {
        let albedo = if (x + z) % 2 == 0 { 0.955_973 } else { 0.127_438 };
        let place = Vec3::new(-0.75 + 0.5 * x as f32, 0.0, -0.75 + 0.5 * z as f32);
        for method in METHODS {
            let (seen, expected) = (seen_at(&material, place, method).x, albedo / PI * irradiance(place));
            assert!((seen / expected - 1.0).abs() < 2e-3, "{x} {z} {method:?}: {seen} for {expected}");
        }
    }
}

#[test]
fn colours_of_vertices_are_interpolated() {
    let colours = [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::ONE, Vec4::new(0.0, 0.0, 1.0, 1.0), Vec4::ZERO];
    let pbr = Pbr {
        vertex_colours: Some(VertexColours { most: Vec3::ONE, mean: Vec3::splat(0.5) }),
        ..body(Factor::new(Vec3::splat(0.5)))
    };
    // Corners are (−1, −1), (1, −1), (1, 1), (−1, 1) of x and z; the diagonal runs from the first to the third.
    for (place, expected) in [
        (Vec3::new(0.5, 0.0, -0.5), 0.25 * (colours[0] + 2.0 * colours[1] + colours[2])),
        (Vec3::ZERO, 0.5 * (colours[0] + colours[2])),
        (Vec3::new(-0.5, 0.0, 0.5), 0.25 * (colours[0] + colours[2]) + 0.5 * colours[3]),
    ] {
        for method in METHODS {
            let mut build =
                floor(Material::pbr("Coloured", pbr.clone()), look(place + Vec3::new(0.3, 1.0, 0.2), place));
            build.0.shapes[0].colours = Some(colours.to_vec());
            build.yfov(0.001);
            let film = rendered(build.finish(), Settings { method, samples: 1, ..small(2, 2, 16) }, 2);
            let seen = film.mean(Layer::Visible)[0];
            let expected = 0.5 * expected.truncate() / PI * irradiance(place);
            assert!(
                (seen - expected).abs().max_element() < 2e-3 * expected.max_element(),
                "{seen} {expected}"
            );
        }
    }
}

#[test]
fn normals_of_a_map_tilt_the_floor() {
    // Everywhere 30° towards +u, which is +x, or towards the image's up, which is −v and so −z.
    for (slopes, towards) in [(Vec2::X, Vec3::X), (Vec2::Y, Vec3::NEG_Z)] {
        let tilt = (slopes * 30_f32.to_radians().sin()).extend(30_f32.to_radians().cos());
        let texel = (0.5 * (tilt + 1.0) * 255.0).round().to_array().map(|x| x as u8);
        let image = Image::new("tilt", [2, 2], texel.repeat(4), Encoding::Data).expect("three channels");
        let normal = Some(NormalMap { texture: Texture::new(Arc::new(image)), scale: 1.0 });
        let material = Material::pbr("Tilted", Pbr { normal, ..body(Factor::new(Vec3::splat(0.8))) });
        // The texel is rounded to 8 bits.
        let rounded = Vec3::from_array(texel.map(|x| 2.0 * f32::from(x) / 255.0 - 1.0)).normalize();
        let (sin, cos) = (rounded.truncate().dot(slopes), rounded.z);
        for place in [Vec3::new(-0.4, 0.0, 0.3), Vec3::new(0.2, 0.0, -0.6)] {
            let to = 1.5 * Vec3::Y - place;
            let cosine = to.normalize().dot(cos * Vec3::Y + sin * towards);
            for method in METHODS {
                let seen = seen_at(&material, place, method).x;
                // A lobe about a tilted normal is cut off at the floor; what is left is scaled to keep its albedo.
                let above = 0.5 + 0.5 * cos;
                let expected = 0.8 / PI / above * 3.0 * cosine / to.length_squared();
                assert!((seen / expected - 1.0).abs() < 5e-3, "{towards} {method:?}: {seen} for {expected}");
            }
        }
    }
}

#[test]
fn a_checker_that_is_far_away_is_grey_in_each_pixel() {
    let texture = squares(256, Encoding::Colour, |x, y| if (x + y).is_multiple_of(2) { 255 } else { 0 });
    let material = Material::pbr("Checker", body(textured(texture)));
    for method in METHODS {
        let mut build = floor(material.clone(), look(Vec3::new(0.1, 40.0, 0.2), Vec3::ZERO));
        build.yfov(0.02); // 0.8 m, 100 squares, in 16 pixels
        let film = rendered(build.finish(), Settings { method, samples: 1, ..small(16, 16, 16) }, 1);
        let pixels = film.mean(Layer::Visible);
        let middle = pixels[16 * 8 + 8].x / (0.5 / PI * irradiance(Vec3::ZERO));
        assert!((middle - 1.0).abs() < 0.02, "{method:?}: {middle}");
        for (a, b) in pixels.iter().zip(&pixels[1..]).enumerate().filter(|(i, _)| i % 16 < 15).map(|(_, p)| p)
        {
            // What is left is how irradiance falls across a pixel; of single squares one in two would be black.
            assert!((a.x / b.x - 1.0).abs() < 0.08, "{method:?}: {a} beside {b}");
        }
    }
}

#[test]
fn what_is_unlit_is_seen_as_its_picture_and_lights_nothing() {
    let texture = squares(2, Encoding::Data, |x, y| [51, 102, 153, 204][(x + 2 * y) as usize]);
    let pbr = Pbr { unlit: true, emission: [0.0, 1.0], ..body(textured(texture)) };
    let material = Material::pbr("Picture", pbr);
    assert_eq!(
        material.emission,
        Some(Emission { radiance: Light::new(Vec3::ZERO, Vec3::splat(0.5)), two_sided: false })
    );
    for (x, z, expected) in [(-0.5, -0.5, 0.2), (0.5, -0.5, 0.4), (-0.5, 0.5, 0.6), (0.5, 0.5, 0.8)] {
        for method in METHODS {
            let seen = seen_at(&material, Vec3::new(x, 0.0, z), method);
            assert!((seen - expected).abs().max_element() < 1e-5, "{x} {z} {method:?}: {seen}");
        }
    }
}

#[test]
fn a_white_floor_of_hills_loses_nothing() {
    // A room that glows alike and reflects nothing, and in it a white sheet whose normals are those of hills.
    let pbr = |metallic: f32, normal| Pbr {
        metallic,
        roughness: if metallic > 0.0 { 0.0 } else { 1.0 },
        normal: Some(normal),
        ..body(Factor::new(Vec3::ONE))
    };
    for (name, metallic) in [("white", 0.0), ("mirror", 1.0)] {
        for method in METHODS {
            let camera = Camera::look_at(
                Vec3::new(0.3, 1.5, 1.0),
                Vec3::ZERO,
                Vec3::Y,
                Projection::Perspective { yfov: 0.5 },
            );
            let mut build = Build::new(Illumination::GLOBAL, camera);
            let wall = build.material("Wall", diffuse(0.0));
            build.0.materials[wall as usize].emission = glow(1.0);
            build.sphere(Vec3::ZERO, 9.0, (16, 8), true, wall);
            build.flatten();
            let sheet = build.0.material(Material::pbr("Sheet", pbr(metallic, hills(32, 0.9))));
            let corners = [[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]];
            let corners = corners.map(|[x, z]| Vec3::new(x, 0.0, z));
            build.0.shape(
                Shape::new("sheet", sheet, corners, [[0, 2, 1], [0, 3, 2]]).with_uvs(CORNERS.to_vec()),
            );
            let settings = Settings { method, samples: 4, ..small(40, 40, 1000) };
            let mut render = Render::new(build.finish(), settings, &[Layer::Visible]).expect("a render");
            (0..60).for_each(|_| render.pass());
            let (mean, error) =
                (render.film().mean_colour().x, render.film().mean_colour_error().expect("passes").x);
            println!("{name} by {method:?}: {mean} ± {error}");
            Measured { mean, error }.must_be(1.0, 1e-3);
        }
    }
}

#[test]
fn a_furnace_with_walls_of_hills_glows_as_its_albedo_says() {
    let camera =
        Camera::look_at(Vec3::new(0.2, 0.1, 0.3), Vec3::X, Vec3::Y, Projection::Perspective { yfov: 1.0 });
    for method in METHODS {
        let mut build = Build::new(Illumination::GLOBAL, camera);
        let pbr = Pbr { normal: Some(hills(16, 0.6)), ..body(Factor::new(Vec3::splat(0.5))) };
        let wall = build.0.material(Material::pbr("Wall", pbr).with_emission(Emission::front(Vec3::ONE)));
        build.sphere(Vec3::ZERO, 1.0, (64, 32), true, wall);
        build.flatten();
        // Laid out by longitude and height, many times.
        let uvs = build.0.shapes[0]
            .positions
            .iter()
            .map(|p| Vec2::new(5.0 * (p.z.atan2(p.x)) as f32, 3.0 * p.y as f32));
        build.0.shapes[0].uvs[0] = Some(uvs.collect());
        let settings = Settings {
            method,
            samples: 4,
            caustic_radius: 3.0,
            indirect_radius: 3.0,
            ..small(24, 24, 20_000)
        };
        let measured = measure(build.finish(), settings, 40);
        println!("{method:?}: {measured:?}");
        measured.must_be(2.0, 0.004);
    }
}

#[test]
fn plans_look_at_the_most_of_each_lobe_that_occurs() {
    // A leaf that here sends all on this side, there all on the other.
    let texels = [[0, 0, 0, 0], [0, 0, 0, 255]].concat();
    let image = Image::new("leaf", [2, 1], texels, Encoding::Data).expect("four channels");
    let translucence = Factor { factor: 1.0, texture: Some(Texture::new(Arc::new(image))) };
    let leaf = Pbr { translucence, ..body(Factor::new(Vec3::splat(0.6))) };
    let lobes = Material::pbr("Leaf", leaf.clone()).lobes;
    let through = Lobe::Translucent(Translucent { colour: Vec3::ONE, under: None });
    assert!(lobes.contains(&(1.0, diffuse(0.6))) && lobes.contains(&(1.0, through)), "{lobes:?}");
    // What it sends on is white where it is most, whichever way.
    assert!((leaf.most_reflected() - 1.0).abs().max_element() < 0.01, "{}", leaf.most_reflected());
    let brown = Pbr { translucent_colour: Factor::new(Vec3::splat(0.1)), ..leaf };
    assert!((brown.most_reflected() - 0.6).abs().max_element() < 0.01, "{}", brown.most_reflected());
}

#[test]
fn where_metal_is_smooth_it_mirrors_and_elsewhere_it_does_not() {
    // The left half of the floor is a mirror, the right half diffuse: one shows a lamp, the other is lit by it.
    let texels = [[0, 0, 255], [0, 0, 0]].concat();
    let image = Image::new("metal", [2, 1], texels, Encoding::Data).expect("three channels");
    let sampler = Sampler { linear: false, ..Sampler::default() };
    let metallic_roughness = Some(Texture { sampler, ..Texture::new(Arc::new(image)) });
    let pbr = Pbr { metallic_roughness, metallic: 1.0, ..body(Factor::new(Vec3::splat(0.6))) };
    let material = Material::pbr("Half", pbr);
    assert_eq!(material.lobes.len(), 3, "either kind occurs, and from afar what is half metal");
    let mirror = Lobe::Mirror(Mirror::metal(Vec3::splat(0.6), false));
    assert!(material.lobes.contains(&(1.0, mirror)) && material.lobes.contains(&(1.0, diffuse(0.6))));
    // Of the hemisphere over the floor, by cosine.
    let (cos, square) = (1.0 / 1.13_f32.sqrt(), 9.0 * 1.13);
    let share = 0.01 * cos * cos / (PI * square);
    for method in METHODS {
        for (x, expected) in [(-0.5, 0.6 * 2.0), (0.5, 0.6 * 2.0 * share)] {
            let place = Vec3::new(x, 0.0, 0.0);
            let mut build = floor(material.clone(), look(place + Vec3::new(0.3, 1.0, 0.2), place));
            build.yfov(0.001);
            build.0.illumination = Some(Illumination::Whitted);
            let ceiling = build.material("Lamp", diffuse(0.0));
            let seen_only = Emission { radiance: Light::new(Vec3::ZERO, Vec3::splat(2.0)), two_sided: true };
            build.0.materials[ceiling as usize].emission = Some(seen_only);
            let middle = place + 3.0 * Vec3::new(-0.3, 1.0, -0.2);
            build.quad(middle - 0.05 * (Vec3::X + Vec3::Z), 0.1 * Vec3::X, 0.1 * Vec3::Z, ceiling);
            build.0.luminaires.clear();
            let film = rendered(build.finish(), Settings { method, samples: 1, ..small(2, 2, 16) }, 2);
            let seen = film.mean(Layer::Visible)[0].x;
            assert!((seen / expected - 1.0).abs() < 0.02, "{x} {method:?}: {seen} for {expected}");
        }
    }
}
