use super::*;
use crate::sampling::warp;

/// Scales, and how far from the scene's zero.
const PLACES: [(f32, f32); 6] = [(1.0, 0.0), (1.0, 1e3), (1e-3, 1.0), (1e-6, 0.0), (1e6, 0.0), (1e4, 1e4)];

#[test]
fn a_ray_that_leaves_a_plane_does_not_meet_it_again() {
    let mut rng = rng(11);
    for (number, (scale, far)) in PLACES.into_iter().cycle().take(60).enumerate() {
        // A plane in general position, its triangles as coplanar as f32 lets them be; or one in which they are
        // exactly coplanar: z = constant, z = -x.
        let mut offset = far * in_cube(&mut rng);
        let (x, y) = match number % 4 {
            0 => (Vec3::X, Vec3::Y),
            1 => {
                offset.z = -offset.x;
                (Vec3::X - Vec3::Z, Vec3::Y)
            }
            _ => direction(&mut rng).any_orthonormal_pair(),
        };
        let sheet = grid(6, 6, |i, j| offset + scale * (0.3 * i as f32 * x + 0.4 * j as f32 * y));
        let scene = scene(&sheet, |_| 0, &[Matrix::IDENTITY]);
        let rays = Rays::build(&scene);
        for _ in 0..4000 {
            let triangle = rng.u32() % sheet.len() as u32;
            let [u, v] = warp::triangle(rng.f32x2());
            let point = scene.mesh.point(triangle, u, v, false);
            let n = point.normals.geometric;
            // From steep to grazing, on both sides.
            let height = 10f32.powf(-7.0 * rng.f32()) * if rng.u32().is_multiple_of(2) { 1.0 } else { -1.0 };
            let along = warp::to_world(n, warp::about_z(0.0, rng.f32()));
            let d = (along + height * n).normalize();
            let ray = half_line(point.origin_towards(d), d);
            let hits = all(&rays, &ray);
            assert!(hits.iter().all(|hit| hit.triangle != triangle), "{number}: {height} {hits:?}");
            if number % 4 < 2 {
                assert!(hits.is_empty(), "{number}: {height} {hits:?}");
            }
        }
    }
}

#[test]
fn a_parallel_sheet_extremely_close_by_is_met() {
    let mut rng = rng(12);
    for (scale, far) in PLACES {
        let offset = far * in_cube(&mut rng);
        // 1e-6 of the largest coordinate, which is 16 steps of f32.
        let gap = 1e-6 * (2.4 * scale + far);
        let sheet = |z: f32| {
            grid(6, 6, move |i, j| offset + Vec3::new(0.4 * scale * i as f32, 0.4 * scale * j as f32, z))
        };
        let lower = sheet(0.0);
        let mut both = lower.clone();
        both.extend(sheet(gap));
        let scene = scene(&both, |_| 0, &[Matrix::ZERO]);
        let rays = Rays::build(&scene);
        let height = both[lower.len()][0].z - both[0][0].z;
        for _ in 0..2000 {
            let triangle = rng.u32() % lower.len() as u32;
            let [u, v] = warp::triangle(rng.f32x2());
            let point = scene.mesh.point(triangle, u, v, false);
            let d = warp::cosine_hemisphere(rng.f32x2());
            let ray = half_line(point.origin_towards(d), d);
            assert!(ray.origin.z < both[lower.len()][0].z, "the offset alone must not pass the gap");
            let run = height / d.z * d.truncate();
            let target = (point.position - offset).truncate() + run;
            if target.min_element() < 0.01 * scale || target.max_element() > 2.39 * scale {
                continue;
            }
            let hit = rays.closest(&ray).expect("the upper sheet is there");
            assert!(hit.triangle >= lower.len() as u32, "{hit:?}");
        }
    }
}
