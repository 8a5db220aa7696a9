//! Solids of glass in, on and across one another: what lies between which media, from both ends of the path.

use crate::agreement::mixed;
use crate::support::{Build, Measured, diffuse, glow, look, measure, small};
use glam::{Quat, Vec3};
use halflight::film::{Film, Layer};
use halflight::light::{Invisible, Light};
use halflight::measure::{Estimate, agreement};
use halflight::optics::{Dielectric, Lobe};
use halflight::plan::{Method, Omittable, Plan, Settings};
use halflight::render::Render;
use halflight::render::learn;
use halflight::scene::{Camera, Illumination, Luminaire, Projection, Scene, Shape, SpotCone};
use halflight::shoot::shoot;

fn glass(ior: f32) -> Lobe {
    Lobe::Dielectric(Dielectric { ior, tint: Vec3::ONE })
}

/// Fresnel at normal incidence between two indices.
fn r(a: f64, b: f64) -> f64 {
    ((a - b) / (a + b)).powi(2)
}

/// Transmittance of media one behind the other, with all reflections between.
fn through(indices: &[f64]) -> f64 {
    let loss = |pair: &[f64]| r(pair[0], pair[1]) / (1.0 - r(pair[0], pair[1]));
    1.0 / (1.0 + indices.windows(2).map(loss).sum::<f64>())
}

/// The same medium in a place that many faces must agree about.
fn bend() -> Quat {
    Quat::from_axis_angle(Vec3::new(0.3, 0.7, -0.4).normalize(), 1.1)
}

/// A closed box with faces of `cells` × `cells` quadrilaterals; the lower half of its height is at `low`.
fn brick(build: &mut Build, low: f32, high: f32, half: f32, cells: u32, material: u32) {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    let (min, max) = (Vec3::new(-half, low, -half), Vec3::new(half, high, half));
    let d = max - min;
    let (x, y, z) = (d * Vec3::X, d * Vec3::Y, d * Vec3::Z);
    for (corner, a, b) in [(min, z, y), (min, x, z), (min, y, x), (max, -y, -z), (max, -z, -x), (max, -x, -y)]
    {
        for i in 0..cells {
            for j in 0..cells {
                let at = corner + i as f32 / cells as f32 * a + j as f32 / cells as f32 * b;
                let first = positions.len() as u32;
                let (a, b) = (a / cells as f32, b / cells as f32);
                positions.extend([at, at + a, at + a + b, at + b]);
                triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
            }
        }
    }
    // Corners of neighbours are the same but for rounding.
    build.0.shape(Shape { closed: Some(true), ..Shape::new("brick", material, positions, triangles) });
}

/// Turns the last shape inside out.
fn turn_last(build: &mut Build) {
    let shape = build.0.shapes.pop().expect("a shape");
    build.0.shape(shape.inside_out());
}

/// Makes the last two shapes one.
fn join(build: &mut Build) {
    let inner = build.0.shapes.pop().expect("two shapes");
    let outer = build.0.shapes.last_mut().expect("two shapes");
    let first = outer.positions.len() as u32;
    outer.positions.extend(inner.positions);
    outer.triangles.extend(inner.triangles.iter().map(|triangle| triangle.map(|vertex| first + vertex)));
}

/// Turns all that is there.
fn turned(mut scene: Scene) -> Scene {
    scene.mesh.positions.iter_mut().for_each(|p| *p = bend() * *p);
    scene.mesh.normals.iter_mut().for_each(|n| *n = bend() * *n);
    for luminaire in &mut scene.luminaires {
        if let Luminaire::Spot { position, direction, .. } = luminaire {
            (*position, *direction) = (bend() * *position, (bend() * *direction).normalize());
        }
    }
    scene
}

/// Power of a beam down the axis that arrives on the floor.
fn transmitted(add: impl Fn(&mut Build), turn: bool) -> Measured {
    let mut build = Build::new(Illumination::GLOBAL, look(Vec3::new(0.0, 4.0, 4.0), Vec3::ZERO));
    let floor = build.material("Floor", diffuse(1e-6));
    build.quad(Vec3::new(-9.0, -2.0, -9.0), Vec3::Z * 18.0, Vec3::X * 18.0, floor);
    add(&mut build);
    let cone = SpotCone::of_cosines(0.999_999, 0.999_999);
    let intensity = Light::both(Vec3::splat(1.0 / cone.solid_angle()));
    // Off the edges that boxes have in common.
    let position = Vec3::new(0.137, 2.0, 0.059);
    build.0.luminaires.push(Luminaire::Spot { position, direction: -Vec3::Y, intensity, cone });
    let scene = if turn { turned(build.finish()) } else { build.finish() };
    let plan = Plan::new(scene, small(8, 8, 5000));
    assert!(plan.rays.has_media() && plan.omissions.iter().all(|omission| omission.name != "media"));
    let frame = learn(&plan);
    assert!(frame.photons.is_some(), "glass feeds photons");
    let passes: Vec<f64> = (0..24)
        .map(|pass| {
            let arrived = shoot::<Invisible>(&plan, &frame, pass).by_class;
            arrived[1].iter().map(|photon| f64::from(photon.power.0.x)).sum()
        })
        .collect();
    Measured::of(&passes)
}

#[test]
fn boxes_that_touch_are_one_stack_whatever_their_meshes_and_place() {
    // Faces that coincide are made of other triangles, and turned so that no plane is exact in f32.
    for (cells, turn) in [(1, false), (3, false), (1, true), (3, true), (7, true)] {
        let stack = |build: &mut Build| {
            let (a, b) = (build.material("A", glass(1.5)), build.material("B", glass(2.0)));
            brick(build, -1.0, 0.0, 3.0, 2, a);
            brick(build, 0.0, 1.0, 3.0, cells, b);
        };
        transmitted(stack, turn).must_be(through(&[1.0, 2.0, 1.5, 1.0]), 2e-4);
    }
}

#[test]
fn boxes_across_each_other_show_the_smaller() {
    let across = |build: &mut Build| {
        let (a, b) = (build.material("A", glass(1.5)), build.material("B", glass(2.5)));
        brick(build, -1.0, 0.5, 3.0, 2, a);
        brick(build, 0.2, 1.0, 2.0, 3, b);
    };
    transmitted(across, true).must_be(through(&[1.0, 2.5, 1.5, 1.0]), 2e-4);
}

#[test]
fn equal_glass_fuses_and_bubbles_are_air() {
    let one = through(&[1.0, 1.5, 1.0]);
    let fused = |build: &mut Build| {
        let a = build.material("A", glass(1.5));
        brick(build, -1.0, 0.3, 3.0, 2, a);
        brick(build, 0.0, 1.0, 2.0, 1, a);
        brick(build, -0.5, -0.2, 1.0, 3, a);
    };
    transmitted(fused, true).must_be(one, 2e-4);
    for own in [true, false] {
        let hollow = |build: &mut Build| {
            let a = build.material("A", glass(1.5));
            let b = if own { a } else { build.material("B", glass(1.2)) };
            brick(build, -1.0, 1.0, 3.0, 2, a);
            brick(build, -0.5, 0.5, 1.0, 3, b);
            turn_last(build);
        };
        transmitted(hollow, true).must_be(through(&[1.0, 1.5, 1.0, 1.5, 1.0]), 2e-4);
    }
}

/// A camera among balls of glass in a room that glows alike everywhere.
fn furnace(position: Vec3, at: Vec3, yfov: f32) -> Build {
    let projection = Projection::Perspective { yfov };
    let camera = Camera::look_at(position, at, Vec3::new(0.6, 0.0, 0.8), projection);
    let mut build = Build::new(Illumination::GLOBAL, camera);
    let wall = build.material("Wall", diffuse(0.0));
    build.0.materials[wall as usize].emission = glow(1.0);
    build.sphere(Vec3::ZERO, 9.0, (32, 16), true, wall);
    build.flatten();
    build
}

/// Nested, touching, across one another and twice in the same place.
fn crowd(build: &mut Build) {
    let (a, b, c) =
        (build.material("A", glass(1.5)), build.material("B", glass(1.33)), build.material("C", glass(2.0)));
    build.sphere(Vec3::ZERO, 1.0, (48, 24), false, a);
    build.sphere(Vec3::new(0.1, 0.0, 0.0), 0.7, (31, 17), false, b);
    build.sphere(Vec3::new(0.1, 0.2, 0.0), 0.3, (20, 10), false, c);
    build.sphere(Vec3::new(0.0, 0.9, 0.2), 0.6, (40, 20), false, b);
    build.sphere(Vec3::new(-1.5, 0.0, 0.0), 0.5, (24, 12), false, c);
    build.sphere(Vec3::new(-1.5, 0.0, 0.0), 0.5, (24, 12), false, a);
    build.flatten();
}

#[test]
fn in_a_room_that_glows_alike_glass_is_not_seen() {
    // Lossless glass changes no radiance but by the square of the index where the eye is. No ray may be lost on the way.
    let eyes = [
        (Vec3::new(0.3, 0.4, 3.0), Vec3::ZERO, 1.2, 1.0),
        (Vec3::new(0.1, -0.4, 0.0), Vec3::new(0.1, -1.0, 0.0), 0.2, 1.33),
        (Vec3::new(0.1, 0.25, 0.02), Vec3::new(0.1, 1.0, 0.05), 0.2, 2.0),
        (Vec3::new(-1.5, 0.0, 0.1), Vec3::new(-1.5, 0.0, 1.0), 0.2, 2.0),
    ];
    for (position, at, yfov, index) in eyes {
        for method in [Method::Photon, Method::Path] {
            let mut build = furnace(position, at, yfov);
            crowd(&mut build);
            let settings = Settings { method, samples: 4, ..small(32, 32, 1) };
            let seen = measure(build.finish(), settings, 16);
            seen.must_be(index * index, 1e-3);
        }
    }
}

/// Pictures of a room with glass in it, by photons and by paths.
fn pictures(add: impl Fn(&mut Build), seed: u64) -> [Film; 2] {
    let mut build = mixed(false, false);
    add(&mut build);
    let scene = build.finish();
    [Method::Photon, Method::Path].map(|method| {
        let radius = Settings { caustic_radius: 2.0, indirect_radius: 2.0, ..small(24, 24, 20_000) };
        let settings = Settings { method, seed, samples: 8, ..radius };
        let mut render = Render::new(scene.clone(), settings, &[Layer::Visible]).expect("a render");
        (0..60).for_each(|_| render.pass());
        render.film().clone()
    })
}

/// On average over the film: single pixels are smoothed over the gather radius, on purpose.
fn must_be_alike(a: &Film, b: &Film) {
    let error = |film: &Film| film.mean_colour_error().expect("several passes").x;
    Measured { mean: a.mean_colour().x, error: error(a).hypot(error(b)) }.must_be(b.mean_colour().x, 1e-3);
}

#[test]
fn shooting_and_gathering_agree_about_nested_glass() {
    let tumbler = |build: &mut Build| {
        let lobe = |ior, tint| Lobe::Dielectric(Dielectric { ior, tint });
        let glass = build.material("Glass", lobe(1.5, Vec3::new(0.9, 1.0, 0.95)));
        let water = build.material("Water", lobe(1.33, Vec3::new(0.8, 0.9, 1.0)));
        build.sphere(Vec3::new(0.0, -0.1, 0.0), 0.65, (48, 24), false, glass);
        build.sphere(Vec3::new(0.0, -0.1, 0.0), 0.5, (48, 24), false, water);
        build.sphere(Vec3::new(0.5, -0.3, 0.3), 0.45, (48, 24), false, water);
    };
    let [shot, traced] = pictures(tumbler, 1);
    must_be_alike(&shot, &traced);
}

#[test]
fn an_index_matched_ball_in_a_ball_is_not_seen() {
    let ball = |inner: Option<f32>| {
        move |build: &mut Build| {
            let outer = build.material("Outer", glass(1.5));
            build.sphere(Vec3::new(0.0, -0.1, 0.0), 0.65, (48, 24), false, outer);
            if let Some(ior) = inner {
                let inner = build.material("Inner", glass(ior));
                build.sphere(Vec3::new(0.1, -0.1, 0.1), 0.45, (48, 24), false, inner);
            }
        }
    };
    let [alone_shot, alone] = pictures(ball(None), 1);
    let [matched_shot, matched] = pictures(ball(Some(1.5)), 2);
    must_be_alike(&matched_shot, &alone_shot);
    // Paths smooth nothing: pixel by pixel. Another index is seen.
    let estimate = |film: &Film| Estimate::from_film(film).expect("several passes");
    let accepted = |film: &Film| agreement(&estimate(film), &estimate(&alone), None).accepted();
    assert!(accepted(&matched));
    assert!(!accepted(&pictures(ball(Some(1.33)), 3)[1]));
}

#[test]
fn solids_that_air_surrounds_ask_nothing() {
    let scene = |gap: f32| {
        let mut build = furnace(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 1.0);
        let a = build.material("A", glass(1.5));
        build.sphere(Vec3::ZERO, 1.0, (16, 8), false, a);
        build.sphere(Vec3::new(2.0 + gap, 0.0, 0.0), 1.0, (16, 8), false, a);
        build.finish()
    };
    let plan = |gap: f32| Plan::new(scene(gap), small(8, 8, 1));
    let left_out = |plan: &Plan| plan.omissions.iter().any(|omission| omission.name == "media");
    assert!(left_out(&plan(0.01)) && !left_out(&plan(-0.01)));
    // Leaving it out changes nothing.
    let picture = |keep: Vec<Omittable>| {
        let settings = Settings { keep, ..small(16, 16, 1000) };
        let mut render = Render::new(scene(0.01), settings, &[Layer::Visible]).expect("a render");
        render.pass();
        render.film().mean(Layer::Visible)
    };
    assert_eq!(picture(Vec::new()), picture(vec![Omittable::Media]));
}

fn tinted(ior: f32, tint: Vec3) -> Lobe {
    Lobe::Dielectric(Dielectric { ior, tint })
}

#[test]
fn a_liquid_has_its_colour_however_it_lies_in_its_glass() {
    // Index-matched, so that only the outer faces reflect: T = (1 − R)² g² τ / (1 − R² τ²), with τ of one way inside.
    let (g, w, r) = (0.95, 0.8, r(1.0, 1.5));
    let within = g * w * w * g;
    let expected = (1.0 - r).powi(2) * g * g * within / (1.0 - (r * within).powi(2));
    // Of a tumbler with thick walls its liquid is the smaller, of one with thin walls the wall.
    for (wall, hollow) in [(1.0, 0.6), (1.0, 0.98)] {
        for into in [0.0, 0.015, -0.015] {
            for own_mesh in [true, false] {
                let tumbler = |build: &mut Build| {
                    let glass = build.material("Glass", tinted(1.5, Vec3::splat(g as f32)));
                    let wine = build.material("Wine", tinted(1.5, Vec3::splat(w as f32)));
                    brick(build, -wall, wall, 1.5, 2, glass);
                    brick(build, -hollow, hollow, 1.3, if own_mesh { 3 } else { 2 }, glass);
                    // The inner wall belongs to the same solid and looks into the hollow.
                    turn_last(build);
                    join(build);
                    let (half, high) = (1.3 + into, hollow + into);
                    brick(build, -high, high, half, if own_mesh { 5 } else { 2 }, wine);
                };
                if into < 0.0 {
                    // A gap of air: four faces more reflect, and colour all the same.
                    let air = transmitted(tumbler, true).mean;
                    let clear = (1.0 - r).powi(6) * (g * g * w * g * g * w);
                    assert!(air > clear && air < 1.2 * clear, "{air} for {clear}");
                } else {
                    transmitted(tumbler, true).must_be(expected, 2e-4);
                }
            }
        }
    }
}

#[test]
fn bubbles_and_nested_solids_are_tinted_by_what_is_passed() {
    let (g, w, r) = (0.95, 0.8, r(1.0, 1.5));
    let slab = |within: f64| (1.0 - r).powi(2) * g * g * within / (1.0 - (r * within).powi(2));
    // A ball of liquid that displaces its glass: glass ends where it begins.
    let nested = |build: &mut Build| {
        let glass = build.material("Glass", tinted(1.5, Vec3::splat(g as f32)));
        let wine = build.material("Wine", tinted(1.5, Vec3::splat(w as f32)));
        brick(build, -1.0, 1.0, 3.0, 2, glass);
        brick(build, -0.4, 0.3, 2.0, 3, wine);
    };
    transmitted(nested, true).must_be(slab(g * w * w * g), 2e-4);
    // A hollow of its own glass colours as the wall of a shell does: once at each face.
    let shell = |bubble: bool| {
        move |build: &mut Build| {
            let glass = build.material("Glass", tinted(1.5, Vec3::splat(g as f32)));
            brick(build, -1.0, 1.0, 3.0, 2, glass);
            brick(build, -0.5, 0.5, 2.0, 3, glass);
            turn_last(build);
            if !bubble {
                join(build);
                // Something else that touches, so that media are asked for.
                brick(build, 5.0, 6.0, 1.0, 1, glass);
                brick(build, 5.5, 7.0, 1.0, 1, glass);
            }
        }
    };
    // Faces of an amplitude each: R and g at all four, both ways.
    let stack = |layers: u32| {
        (0..layers).fold((1.0_f64, 0.0_f64), |(through, back), _| {
            // Adding one face behind what is there: T = t T′ / (1 − R R′).
            let t = (1.0 - r) * g;
            let loop_ = 1.0 / (1.0 - back * r);
            (through * t * loop_, r + t * t * back * loop_)
        })
    };
    let (expected, _) = stack(4);
    transmitted(shell(true), true).must_be(expected, 2e-4);
}

/// A closed lathe of so many segments about y.
fn lathe(build: &mut Build, profile: &[[f32; 2]], segments: u32, material: u32) {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    let at = |[r, y]: [f32; 2], i: u32| {
        let (sin, cos) = (std::f32::consts::TAU * (i % segments) as f32 / segments as f32).sin_cos();
        Vec3::new(r * cos, y, r * sin)
    };
    for ends in profile.windows(2) {
        for i in 0..segments {
            let corners = [at(ends[0], i), at(ends[0], i + 1), at(ends[1], i + 1), at(ends[1], i)];
            for triangle in [[0, 2, 1], [0, 3, 2]] {
                let corners = triangle.map(|k: usize| corners[k]);
                if corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0] {
                    continue;
                }
                let first = positions.len() as u32;
                positions.extend(corners);
                triangles.push([first, first + 1, first + 2]);
            }
        }
    }
    build.0.shape(Shape { closed: Some(true), ..Shape::new("lathe", material, positions, triangles) });
}

#[test]
fn wine_is_red_in_glasses_of_any_number_of_segments() {
    let tint = Vec3::new(0.5, 0.02, 0.05);
    // Index-matched: the room that glows alike is seen by R + (1 − R)² τ (1 + R τ + …), each colour for itself.
    let r = r(1.0, 1.5);
    let seen = |tint: f64| {
        let within = tint * tint;
        r + (1.0 - r).powi(2) * within * (1.0 + r * within) / (1.0 - (r * within).powi(2))
    };
    for segments in [24, 32, 48, 100, 256] {
        for (wine_segments, into) in [(segments, 0.0), (segments, 5e-4), (segments / 2 + 6, 2e-3)] {
            // Into the middle of a facet, across the axis.
            let turn = std::f32::consts::PI / segments as f32;
            let eye = Vec3::new(0.6 * turn.cos(), 0.03, 0.6 * turn.sin());
            let mut build = furnace(eye, 0.03 * Vec3::Y, 0.002);
            let glass = build.material("Glass", glass(1.5));
            let wine = build.material("Wine", tinted(1.5, tint));
            let tumbler = [[0.0, 0.0], [0.04, 0.0], [0.04, 0.1], [0.036, 0.1], [0.036, 0.005], [0.0, 0.005]];
            lathe(&mut build, &tumbler, segments, glass);
            let liquid =
                [[0.0, 0.005 - into], [0.036 + into, 0.005 - into], [0.036 + into, 0.06], [0.0, 0.06]];
            lathe(&mut build, &liquid, wine_segments, wine);
            let mut render =
                Render::new(build.finish(), small(8, 8, 1), &[Layer::Visible]).expect("a render");
            (0..24).for_each(|_| render.pass());
            let (mean, error) =
                (render.film().mean_colour(), render.film().mean_colour_error().expect("passes"));
            for axis in 0..3 {
                let measured = Measured { mean: mean[axis], error: error[axis] };
                measured.must_be(seen(f64::from(tint[axis])), 2e-3);
            }
        }
    }
}
