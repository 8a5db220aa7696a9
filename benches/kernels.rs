//! Kernels, one core: criterion's Melem/s are Mrays/s. `cargo bench --bench kernels -- <filter>`

mod ray_scene;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{Vec3, Vec3A};
use halflight::light::Matrix;
use halflight::rays::{Ray, Rays};
use halflight::scene::Mesh;
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use ray_scene::{COUNT, scene, sets};
use std::hint::black_box;
use std::time::Duration;

criterion_main!(benches);
criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10).measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(500));
    targets = rays
}

fn rays(criterion: &mut Criterion) {
    let blocked = scene(Matrix::ZERO);
    let clear = scene(0.5 * Matrix::IDENTITY);
    let mixing = scene(Matrix::new([[0.5, 0.1], [0.2, 0.5]]));
    let ours = Rays::build(&blocked);
    let through = Rays::build(&clear);
    let ordered = Rays::build(&mixing);
    let sets = sets(&blocked, &ours);
    let theirs = Theirs::new(&blocked.mesh);
    // The three agree but for rounding.
    let count = |occluded: &dyn Fn(&Ray) -> bool| sets.shadow.iter().filter(|ray| occluded(ray)).count();
    let expected = count(&|ray| ours.occluded(ray));
    for found in [count(&|ray| theirs.occluded(ray)), count(&|ray| theirs.occluded_woop(ray))] {
        assert!(found.abs_diff(expected) <= COUNT / 1000, "{found} shadowed for {expected}");
    }

    let mut group = criterion.benchmark_group("rays");
    group.bench_function("build", |b| b.iter(|| Rays::build(&blocked)));
    group.throughput(Throughput::Elements(COUNT as u64));
    for (name, set) in [("primary", &sets.primary), ("diffuse", &sets.diffuse)] {
        group.bench_function(format!("closest/{name}"), |b| {
            b.iter(|| set.iter().filter_map(|ray| ours.closest(ray)).map(|hit| hit.t).sum::<f32>());
        });
        group.bench_function(format!("closest/{name}/obvhs RtTriangle"), |b| {
            b.iter(|| set.iter().filter_map(|ray| theirs.closest(ray, RtTriangle::intersect)).sum::<f32>());
        });
        group.bench_function(format!("closest/{name}/obvhs Woop"), |b| {
            b.iter(|| set.iter().filter_map(|ray| theirs.closest_woop(ray)).sum::<f32>());
        });
    }
    group.bench_function("occluded/shadow", |b| {
        b.iter(|| sets.shadow.iter().filter(|ray| ours.occluded(*ray)).count());
    });
    group.bench_function("occluded/shadow/obvhs RtTriangle", |b| {
        b.iter(|| sets.shadow.iter().filter(|ray| theirs.occluded(ray)).count());
    });
    group.bench_function("occluded/shadow/obvhs Woop", |b| {
        b.iter(|| sets.shadow.iter().filter(|ray| theirs.occluded_woop(ray)).count());
    });
    group.bench_function("transmittance/shadow", |b| {
        b.iter(|| sets.shadow.iter().map(|ray| through.transmittance(ray).inv_inv).sum::<f32>());
    });
    group.bench_function("transmittance/shadow/ordered", |b| {
        b.iter(|| sets.shadow.iter().map(|ray| ordered.transmittance(ray).inv_inv).sum::<f32>());
    });
    // A blocker behind one or two clear spheres: 2.2 crossings in the mean.
    let mut hits = Vec::new();
    for (name, set) in [("primary", &sets.primary), ("diffuse", &sets.diffuse)] {
        let mut count = 0;
        set.iter().for_each(|ray| {
            through.crossings(ray, &mut hits);
            count += hits.len();
        });
        println!("{name}: {} crossings per ray", count as f64 / COUNT as f64);
        group.bench_function(format!("crossings/{name}"), |b| {
            b.iter(|| {
                for ray in set {
                    through.crossings(ray, &mut hits);
                    black_box(&hits);
                }
            });
        });
    }
}

/// obvhs' own tree, walk and triangles.
struct Theirs {
    bvh: Bvh2,
    /// In the order of the tree.
    triangles: Vec<RtTriangle>,
    corners: Vec<[Vec3A; 3]>,
}

impl Theirs {
    fn new(mesh: &Mesh) -> Self {
        let triangles: Vec<_> = (0..mesh.triangles.len() as u32)
            .map(|triangle| {
                let [v0, v1, v2] = mesh.corners(triangle).map(Vec3A::from);
                Triangle { v0, v1, v2 }
            })
            .collect();
        let bvh = build_bvh2_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
        let order = || bvh.primitive_indices.iter().map(|&i| &triangles[i as usize]);
        let (rt, corners) =
            (order().map(RtTriangle::from).collect(), order().map(|t| [t.v0, t.v1, t.v2]).collect());
        Self { bvh, triangles: rt, corners }
    }

    fn ray(ray: &Ray) -> ObvhsRay {
        ObvhsRay::new(ray.origin.into(), ray.direction.into(), 0.0, ray.t_max)
    }

    fn closest(&self, ray: &Ray, test: impl Fn(&RtTriangle, &ObvhsRay) -> f32) -> Option<f32> {
        let mut hit = RayHit::none();
        let met =
            self.bvh.ray_traverse(Self::ray(ray), &mut hit, |ray, slot| test(&self.triangles[slot], ray));
        met.then_some(hit.t)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        !self.bvh.ray_traverse_miss(Self::ray(ray), |ray, slot| self.triangles[slot].intersect(ray))
    }

    fn closest_woop(&self, ray: &Ray) -> Option<f32> {
        let woop = Woop::new(ray);
        let mut hit = RayHit::none();
        let met = self.bvh.ray_traverse(Self::ray(ray), &mut hit, |_, slot| woop.t(self.corners[slot]));
        met.then_some(hit.t)
    }

    fn occluded_woop(&self, ray: &Ray) -> bool {
        let woop = Woop::new(ray);
        // The walk asks for a distance and takes any that the ray reaches.
        !self.bvh.ray_traverse_miss(Self::ray(ray), |_, slot| woop.t(self.corners[slot]))
    }
}

/// A watertight triangle test of the plain kind: Woop, Benthin, Wald 2013, in f32, one triangle at a time.
struct Woop {
    origin: Vec3A,
    axes: [usize; 3],
    shear: [f32; 3],
}

impl Woop {
    fn new(ray: &Ray) -> Self {
        let d = ray.direction;
        let z = d.abs().max_position();
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        Self { origin: ray.origin.into(), axes: [x, y, z], shear: [d[x] / d[z], d[y] / d[z], 1.0 / d[z]] }
    }

    /// Where the ray meets the triangle; infinity where it does not.
    fn t(&self, corners: [Vec3A; 3]) -> f32 {
        let ([x, y, z], shear) = (self.axes, self.shear);
        let [a, b, c] = corners.map(|p| {
            let p = p - self.origin;
            Vec3::new(p[x] - shear[0] * p[z], p[y] - shear[1] * p[z], shear[2] * p[z])
        });
        let (u, v, w) = (c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x);
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return f32::INFINITY;
        }
        let t = (u * a.z + v * b.z + w * c.z) / (u + v + w);
        if t > 0.0 { t } else { f32::INFINITY }
    }
}
