//! Scenes and rays that the tests of this module share.

mod offsets;
mod queries;
mod reference;
mod traps;
mod watertight;

use super::{Hit, Ray, Rays};
use crate::light::Matrix;
use crate::optics::{Diffuse, Lobe};
use crate::sampling::{Rng, Stream, warp};
use crate::scene::{Camera, Material, Mesh, Projection, Scene, Surface};
use glam::{DVec3, Vec3};

/// Triangles of one material each, all of them: those without area, too.
fn scene(triangles: &[[Vec3; 3]], material: impl Fn(usize) -> u32, straight: &[Matrix]) -> Scene {
    let camera = Camera::look_at(Vec3::ZERO, Vec3::X, Vec3::Z, Projection::Perspective { yfov: 1.0 });
    let mut scene = Scene::builder("test").camera(camera);
    let lobe = Lobe::Diffuse(Diffuse { albedo: Vec3::ONE, two_sided: true, under: None });
    scene.materials =
        straight.iter().map(|straight| Material::new("test", lobe).with_straight(*straight)).collect();
    let mut scene = scene.build().expect("a scene of nothing");
    let surface = |material| Surface { name: String::new(), material, smooth: false, closed: false };
    scene.surfaces = (0..straight.len() as u32).map(surface).collect();
    scene.mesh = Mesh {
        positions: triangles.concat(),
        normals: vec![Vec3::Z; 3 * triangles.len()],
        triangles: (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        surface: (0..triangles.len()).map(material).collect(),
        ..Mesh::default()
    };
    scene
}

/// Triangles that all light passes: every crossing counts.
fn clear(triangles: &[[Vec3; 3]]) -> Rays {
    Rays::build(&scene(triangles, |_| 0, &[Matrix::IDENTITY]))
}

/// Triangles that nothing passes.
fn opaque(triangles: &[[Vec3; 3]]) -> Rays {
    Rays::build(&scene(triangles, |_| 0, &[Matrix::ZERO]))
}

fn half_line(origin: Vec3, direction: Vec3) -> Ray {
    Ray { origin, direction, t_max: f32::INFINITY }
}

fn all(rays: &Rays, ray: &Ray) -> Vec<Hit> {
    let mut hits = Vec::new();
    rays.crossings(ray, &mut hits);
    hits
}

fn rng(path: u64) -> Rng {
    Rng::new(1, Stream::Test, 0, path)
}

/// Uniform in [-1, 1]³.
fn in_cube(rng: &mut Rng) -> Vec3 {
    2.0 * Vec3::from(rng.f32x3()) - Vec3::ONE
}

fn direction(rng: &mut Rng) -> Vec3 {
    warp::sphere(rng.f32x2())
}

/// Two triangles per cell of an nx × ny grid; `place` maps grid points to space.
fn grid(nx: usize, ny: usize, place: impl Fn(usize, usize) -> Vec3) -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    for x in 0..nx {
        for y in 0..ny {
            let [a, b, c, d] = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)].map(|(x, y)| place(x, y));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles
}

/// The surface of [-1, 1]³, n × n cells a side, seen as `scale * p + offset`.
fn cube(n: usize, scale: f32, offset: Vec3) -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let at = |i: usize| -1.0 + 2.0 * i as f32 / n as f32;
            triangles.extend(grid(n, n, |x, y| {
                let mut p = Vec3::ZERO;
                p[axis] = side;
                p[(axis + 1) % 3] = at(x);
                p[(axis + 2) % 3] = at(y);
                scale * p + offset
            }));
        }
    }
    triangles
}

/// The unit sphere, scaled and moved.
fn uv_sphere(around: usize, down: usize, scale: f32, offset: Vec3) -> Vec<[Vec3; 3]> {
    use std::f32::consts::{PI, TAU};
    let place = |x: usize, y: usize| {
        // The seam and the poles must be one point each, bit by bit.
        let (phi, theta) = (TAU * (x % around) as f32 / around as f32, PI * y as f32 / down as f32);
        let sine = if y == 0 || y == down { 0.0 } else { theta.sin() };
        scale * Vec3::new(sine * phi.cos(), sine * phi.sin(), theta.cos()) + offset
    };
    grid(around, down, place)
}
