use super::*;
use crate::optics::{Diffuse, Lobe, Normals};
use crate::scene::{Camera, Material, Projection, SceneBuilder, Shape};
use glam::DVec3;
use std::f32::consts::{PI, TAU};

fn builder() -> SceneBuilder {
    let projection = Projection::Perspective { yfov: 1.0 };
    let camera = Camera::look_at(Vec3::Y, Vec3::ZERO, Vec3::Z, projection);
    let mut builder = Scene::builder("clearance").camera(camera).origin(DVec3::ZERO);
    let lobe = |two_sided| Lobe::Diffuse(Diffuse { albedo: Vec3::ONE, two_sided, under: None });
    builder.material(Material::new("one-sided", lobe(false)));
    builder.material(Material::new("two-sided", lobe(true)));
    builder
}

const ONE_SIDED: u32 = 0;
const TWO_SIDED: u32 = 1;

/// A parallelogram; its front is where `a × b` points.
fn quad(builder: &mut SceneBuilder, corner: Vec3, a: Vec3, b: Vec3, material: u32) {
    builder.shape(Shape::quad("thing", material, [corner, corner + a, corner + a + b, corner + b]));
}

/// The floor y = 0, |x|, |z| ≤ 1, seen from above.
fn floor(builder: &mut SceneBuilder) {
    quad(builder, Vec3::new(-1.0, 0.0, -1.0), 2.0 * Vec3::Z, 2.0 * Vec3::X, ONE_SIDED);
}

/// How much of a disk of `radius` about the first surface below a place may be used.
fn below(builder: SceneBuilder, [x, y, z]: [f32; 3], radius: f32) -> Reach {
    let scene = builder.build().expect("a good scene");
    let mut rims = Rims::of(&scene, &vec![true; scene.materials.len()]);
    let clearance = Clearance::of(&scene, rims.take_sheets());
    let ray = crate::rays::Ray { origin: Vec3::new(x, y, z), direction: -Vec3::Y, t_max: f32::INFINITY };
    let hit = crate::rays::Rays::build(&scene).closest(&ray).expect("a surface");
    let point = scene.mesh.point(hit.triangle, hit.u, hit.v, false);
    let normal = Normals::flat(point.normals.geometric).geometric;
    let normal = if normal.y < 0.0 { -normal } else { normal };
    let mut near = Vec::new();
    rims.near(point.position, radius, &mut near);
    let reach = clearance.reach(&scene, (&rims, &near), (&point, normal), radius, false);
    let even = clearance.even(&scene, (&point, normal), 1.5 * radius, radius);
    if clearance.is_even(&even, &point, normal) {
        assert_eq!(reach, Reach::Simple(1.0), "what is said of all disks around holds for this one");
    }
    reach
}

#[test]
fn an_open_floor_is_simple_up_to_its_rim() {
    for x in [0.0, 0.95, 0.999] {
        let mut builder = builder();
        floor(&mut builder);
        assert_eq!(below(builder, [x, 1.0, 0.2], 0.2), Reach::Simple(1.0), "{x}");
    }
}

#[test]
fn a_wall_on_the_floor_cuts_disks_and_one_at_its_rim_does_not() {
    for (edge, expected) in [(0.5, Reach::Simple(0.5)), (0.61, Reach::Simple(1.0)), (1.0, Reach::Simple(1.0))]
    {
        let mut builder = builder();
        floor(&mut builder);
        quad(&mut builder, Vec3::new(edge, 0.0, -1.0), Vec3::Y, 2.0 * Vec3::Z, ONE_SIDED);
        let from = if edge == 1.0 { 0.95 } else { 0.4 };
        assert_eq!(below(builder, [from, 0.5, 0.0], 0.2), expected, "{edge}");
    }
    let mut builder = builder();
    floor(&mut builder);
    quad(&mut builder, Vec3::new(0.41, 0.0, -1.0), Vec3::Y, 2.0 * Vec3::Z, ONE_SIDED);
    assert_eq!(below(builder, [0.4, 0.5, 0.0], 0.2), Reach::Crowded);
}

#[test]
fn what_hangs_over_a_floor_counts_and_what_lies_far_below_does_not() {
    let over = |height: f32, from: f32| {
        let mut builder = builder();
        floor(&mut builder);
        quad(&mut builder, Vec3::new(-0.5, height, -0.5), Vec3::Z, Vec3::X, TWO_SIDED);
        below(builder, [0.0, from, 0.0], 0.2)
    };
    assert_eq!(over(0.01, 0.005), Reach::Crowded, "the floor under a sheet");
    assert_eq!(over(0.5, 0.2), Reach::Simple(1.0), "a floor under a ceiling");
    assert_eq!(over(0.01, 1.0), Reach::Crowded, "a sheet so near that photons of the floor count on it");
    assert_eq!(over(0.1, 1.0), Reach::Simple(1.0), "a table");
}

#[test]
fn what_is_there_twice_is_never_simple() {
    let mut builder = builder();
    floor(&mut builder);
    floor(&mut builder);
    assert_eq!(below(builder, [0.1, 1.0, 0.2], 0.1), Reach::Crowded);
}

#[test]
fn pieces_that_abut_are_one() {
    let mut builder = builder();
    quad(&mut builder, Vec3::new(-1.0, 0.0, -1.0), 2.0 * Vec3::Z, Vec3::X, ONE_SIDED);
    quad(&mut builder, Vec3::new(0.0, 0.0, -1.0), Vec3::Z, Vec3::X, ONE_SIDED);
    quad(&mut builder, Vec3::new(0.0, 0.0, 0.0), Vec3::Z, Vec3::X, ONE_SIDED);
    assert_eq!(below(builder, [0.01, 1.0, 0.1], 0.2), Reach::Simple(1.0));
}

/// A ball whose top is at y = 1.
fn ball(radius: f32, around: u32, down: u32) -> SceneBuilder {
    let mut builder = builder();
    let place = |i: u32, j: u32| {
        let (theta, phi) = (PI * j as f32 / down as f32, TAU * (i % around) as f32 / around as f32);
        let up = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        Vec3::new(0.0, 1.0 - radius, 0.0)
            + radius
                * if j == 0 {
                    Vec3::Y
                } else if j == down {
                    -Vec3::Y
                } else {
                    up
                }
    };
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for (j, i) in (0..down).flat_map(|j| (0..around).map(move |i| (j, i))) {
        let corners = [place(i, j), place(i + 1, j), place(i + 1, j + 1), place(i, j + 1)];
        let first = positions.len() as u32;
        positions.extend(corners);
        if j > 0 {
            triangles.push([first, first + 1, first + 2]);
        }
        if j + 1 < down {
            triangles.push([first, first + 2, first + 3]);
        }
    }
    builder.shape(Shape::new("ball", ONE_SIDED, positions, triangles));
    builder
}

#[test]
fn balls_are_simple_within_a_third_of_their_radius() {
    // Heights of a sphere within r are r² / 2 R, a share of 0.15 of r where r = 0.3 R.
    for (radius, expected) in [
        (0.2, Reach::Simple(1.0)),
        (0.35, Reach::Simple(0.7)),
        (0.8, Reach::Simple(0.35)),
        (2.0, Reach::Crowded),
    ] {
        assert_eq!(below(ball(1.0, 128, 64), [0.02, 3.0, 0.01], radius), expected, "{radius}");
    }
}

#[test]
fn near_an_edge_between_facets_disks_are_small() {
    let gable = |x: f32| {
        let mut builder = builder();
        let (ridge, along) = (Vec3::new(0.0, 0.0, -1.0), 2.0 * Vec3::Z);
        let positions = vec![
            ridge,
            ridge + along,
            Vec3::new(1.0, -0.4, -1.0),
            Vec3::new(1.0, -0.4, 1.0),
            Vec3::new(-1.0, -0.4, -1.0),
            Vec3::new(-1.0, -0.4, 1.0),
        ];
        let triangles = vec![[0, 1, 3], [0, 3, 2], [1, 0, 4], [1, 4, 5]];
        builder.shape(Shape::new("gable", ONE_SIDED, positions, triangles));
        below(builder, [x, 1.0, 0.0], 0.2)
    };
    assert_eq!(gable(0.01), Reach::Crowded);
    assert_eq!(gable(0.3), Reach::Simple(1.0));
}

#[test]
fn wires_bend_away() {
    // A ball so small that all of it lies within the slab of the disk.
    assert_eq!(below(ball(0.01, 16, 8), [0.001, 3.0, 0.002], 0.2), Reach::Crowded);
}
