use super::*;
use crate::sampling::{Rng, Stream};
use crate::scene::{Camera, Material, Projection, Shape};
use glam::DVec3;

/// Triangles in the plane y = 0 with their fronts up, all in one diffuse surface.
fn scene(triangles: &[[[f32; 2]; 3]]) -> Scene {
    let positions = triangles.iter().flatten().map(|&[x, z]| Vec3::new(x, 0.0, -z));
    let indices: Vec<_> = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let projection = Projection::Perspective { yfov: 1.0 };
    let camera = Camera::look_at(Vec3::Y, Vec3::ZERO, Vec3::Z, projection);
    let mut scene = Scene::builder("rims").camera(camera).origin(DVec3::ZERO);
    let floor = scene.material(Material::diffuse("floor", Vec3::ONE));
    scene.shape(Shape::new("floor", floor, positions, indices));
    scene.build().unwrap()
}

fn rims(triangles: &[[[f32; 2]; 3]]) -> Rims {
    Rims::of(&scene(triangles), &[true])
}

/// The unit square as two triangles.
const SQUARE: [[[f32; 2]; 3]; 2] = [[[0., 0.], [1., 0.], [1., 1.]], [[0., 0.], [1., 1.], [0., 1.]]];

fn area(rims: &Rims, x: f32, z: f32, r: f32) -> f32 {
    rims.area(Vec3::new(x, 0.0, -z), Vec3::Y, r)
}

#[test]
fn a_square_has_four_rims_and_its_diagonal_is_none() {
    assert_eq!(rims(&SQUARE).len(), 4);
}

#[test]
fn disks_are_cut_at_edges_and_corners() {
    let rims = rims(&SQUARE);
    let r = 0.1_f32;
    let whole = PI * r * r;
    assert!((area(&rims, 0.5, 0.5, r) / whole - 1.0).abs() < 1e-6);
    assert!((area(&rims, 1e-6, 0.5, r) / whole - 0.5).abs() < 1e-4);
    let corner = area(&rims, 1e-6, 1e-6, r) / whole;
    assert!((corner - 0.25).abs() < 1e-4, "{corner}");
    // One radius of distance h < r: the segment r² acos(h/r) − h √(r² − h²) is missing.
    let h = 0.06_f32;
    let missing = r * r * (h / r).acos() - h * (r * r - h * h).sqrt();
    assert!((area(&rims, 0.3, h, r) / (whole - missing) - 1.0).abs() < 1e-4);
    // A disk that holds the whole square.
    assert!((area(&rims, 0.4, 0.6, 5.0) - 1.0).abs() < 1e-4);
}

#[test]
fn pieces_that_abut_without_sharing_vertices_are_one() {
    // The right-hand neighbour is cut in two at z = 0.5: T-junctions along x = 1.
    let more = [
        [[1., 0.], [2., 0.], [2., 0.5]],
        [[1., 0.], [2., 0.5], [1., 0.5]],
        [[1., 0.5], [2., 0.5], [2., 1.]],
        [[1., 0.5], [2., 1.], [1., 1.]],
    ];
    let rims = rims(&[&SQUARE[..], &more[..]].concat());
    let r = 0.2_f32;
    assert!((area(&rims, 0.95, 0.45, r) / (PI * r * r) - 1.0).abs() < 1e-4);
    assert!((area(&rims, 0.95, 0.0001, r) / (PI * r * r) - 0.5).abs() < 1e-2);
}

#[test]
fn areas_are_what_random_points_find() {
    // An L: concave at (1, 1).
    let l = [
        SQUARE[0],
        SQUARE[1],
        [[1., 0.], [2., 0.], [2., 1.]],
        [[1., 0.], [2., 1.], [1., 1.]],
        [[0., 1.], [1., 1.], [1., 2.]],
        [[0., 1.], [1., 2.], [0., 2.]],
    ];
    let rims = rims(&l);
    let mut rng = Rng::new(3, Stream::Test, 0, 0);
    let inside = |x: f32, z: f32| (0.0..2.0).contains(&x) && (0.0..2.0).contains(&z) && !(x > 1.0 && z > 1.0);
    for _ in 0..40 {
        let (x, z) = loop {
            let [x, z] = rng.f32x2().map(|u| 2.0 * u);
            if inside(x, z) {
                break (x, z);
            }
        };
        let r = 0.1 + 0.8 * rng.f32();
        let n = 20_000;
        let found = (0..n)
            .filter(|_| {
                let [dx, dz] = crate::sampling::warp::disk(rng.f32x2()).map(|d| r * d);
                inside(x + dx, z + dz)
            })
            .count();
        let (p, exact) = (found as f32 / n as f32, area(&rims, x, z, r) / (PI * r * r));
        assert!((p - exact).abs() < 4.0 * (0.25 / n as f32).sqrt(), "{p} against {exact} at {x}, {z}, r {r}");
    }
}

#[test]
fn fans_about_one_stem_have_one_box_there() {
    let n = 1000;
    let mut leaves = scene(&vec![SQUARE[0]; n]);
    for i in 0..n {
        let (sin, cos) = (i as f32).sin_cos();
        let corners = [Vec3::ZERO, Vec3::Y, Vec3::new(cos, 0.3, sin)];
        leaves.mesh.positions[3 * i..3 * i + 3].copy_from_slice(&corners);
    }
    let rims = Rims::of(&leaves, &[true]);
    let mut near = Vec::new();
    rims.near(Vec3::new(0.0, 0.5, 0.0), 1e-3, &mut near);
    // The stem, and the edges that start at its tip.
    assert_eq!((rims.len(), near.len()), (3 * n, 2 * n));
    assert!(rims.starts.len() < 2 * n + 10, "{} boxes", rims.starts.len());
}

#[test]
fn piles_of_equal_triangles_build_at_once() {
    let pile = vec![SQUARE[0]; 20_000];
    assert_eq!(rims(&pile).len(), 3);
}
