//! Two spheres of 250 000 triangles in a box, and rays in it: the scene on which kernels are measured.

use glam::{DVec3, Vec3};
use halflight::light::Matrix;
use halflight::optics::{Diffuse, Lobe};
use halflight::rays::{Ray, Rays};
use halflight::sampling::{Rng, Stream, warp};
use halflight::scene::{Camera, Material, Projection, Scene, Shape};
use std::f32::consts::{PI, TAU};

/// Rays per set.
pub const COUNT: usize = 1 << 16;

/// Two spheres of 250 000 triangles in a box of 12.
pub fn scene(straight_of_spheres: Matrix) -> Scene {
    let camera = Camera::look_at(
        Vec3::new(0.0, -1.95, 1.2),
        Vec3::new(0.0, 0.0, 0.8),
        Vec3::Z,
        Projection::Perspective { yfov: 1.2 },
    );
    let mut scene = Scene::builder("two spheres in a box").camera(camera).origin(DVec3::ZERO);
    let both = Lobe::Diffuse(Diffuse { albedo: Vec3::ONE, two_sided: true, under: None });
    let walls = scene.material(Material::new("walls", both).with_straight(Matrix::ZERO));
    let spheres = scene.material(Material::new("spheres", both).with_straight(straight_of_spheres));
    let soup = |material: u32, corners: &[[Vec3; 4]]| {
        let triangles: Vec<_> = (0..corners.len() as u32)
            .flat_map(|i| [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|k| 4 * i + k)))
            .collect();
        let shape = Shape::new("", material, corners.concat(), triangles);
        Shape { closed: Some(false), ..shape }
    };
    let mut quads = Vec::new();
    for (centre, radius) in [(Vec3::new(-0.8, 0.3, 0.7), 0.7), (Vec3::new(0.7, -0.4, 0.9), 0.9)] {
        let point = |i: usize, j: usize| {
            let (phi, theta) = (TAU * i as f32 / 500.0, PI * j as f32 / 250.0);
            centre + radius * Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
        };
        let cells = (0..500).flat_map(|i| (0..250).map(move |j| (i, j)));
        quads
            .extend(cells.map(|(i, j)| [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)]));
    }
    scene.shape(soup(spheres, &quads));
    quads.clear();
    for (axis, side) in (0..3).flat_map(|axis| [-2.0, 2.0].map(|side| (axis, side))) {
        let corner = |[x, y]: [f32; 2]| {
            let mut p = Vec3::ZERO;
            p[axis] = side;
            p[(axis + 1) % 3] = x;
            p[(axis + 2) % 3] = y;
            p + Vec3::Z
        };
        quads.push([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]].map(corner));
    }
    scene.shape(soup(walls, &quads));
    scene.build().expect("a good scene")
}

/// Coherent camera rays; diffuse bounces from where they land; segments from there to a small luminaire.
pub struct Sets {
    pub primary: Vec<Ray>,
    pub diffuse: Vec<Ray>,
    pub shadow: Vec<Ray>,
}

pub fn sets(scene: &Scene, rays: &Rays) -> Sets {
    let side = 256;
    let mut rng = Rng::new(1, Stream::Test, 0, 0);
    let mut sets = Sets { primary: Vec::new(), diffuse: Vec::new(), shadow: Vec::new() };
    for i in 0..COUNT {
        let (x, y) = ((i % side) as f32 + rng.f32(), (i / side) as f32 + rng.f32());
        let (origin, direction) = scene.camera.ray(x / side as f32, y / side as f32, 1.0);
        let ray = Ray { origin, direction, t_max: f32::INFINITY };
        sets.primary.push(ray);
        let hit = rays.closest(&ray).expect("the box is closed");
        let point = scene.mesh.point(hit.triangle, hit.u, hit.v, false);
        let n = point.normals.geometric;
        let n = if n.dot(direction) > 0.0 { -n } else { n };
        let direction = warp::to_world(n, warp::cosine_hemisphere(rng.f32x2()));
        sets.diffuse.push(Ray { origin: point.origin_towards(direction), direction, t_max: f32::INFINITY });
        let lamp = Vec3::new(0.3 * rng.f32(), 0.3 * rng.f32(), 2.9);
        let origin = point.origin_towards(lamp - point.position);
        let t_max = origin.distance(lamp);
        sets.shadow.push(Ray { origin, direction: (lamp - origin) / t_max, t_max });
    }
    sets
}
