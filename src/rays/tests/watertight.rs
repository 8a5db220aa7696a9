use super::*;

/// Corners, edge midpoints, random edge points of the triangles.
fn aims<'a>(triangles: &'a [[Vec3; 3]], rng: &'a mut Rng) -> impl Iterator<Item = Vec3> + 'a {
    triangles.iter().flat_map(move |corners| {
        let i = rng.u32() as usize % 3;
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        [a, 0.5 * (a + b), a.lerp(b, rng.f32())]
    })
}

fn closed_meshes() -> Vec<(Vec<[Vec3; 3]>, f32, Vec3)> {
    let mut meshes = Vec::new();
    for scale in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
        for offset in [Vec3::ZERO, Vec3::new(0.3, -7.1, 2.9), Vec3::new(100.0, 1000.0, -300.0)] {
            let offset = scale * offset;
            meshes.push((cube(1, scale, offset), scale, offset));
            meshes.push((cube(8, scale, offset), scale, offset));
            meshes.push((uv_sphere(48, 24, scale, offset), scale, offset));
        }
    }
    meshes
}

#[test]
fn from_inside_a_convex_mesh_every_line_crosses_once() {
    let mut count = 0;
    for (number, (triangles, scale, offset)) in closed_meshes().into_iter().enumerate() {
        let (transparent, solid) = (clear(&triangles), opaque(&triangles));
        let mut rng = rng(number as u64);
        let mut origins = vec![offset];
        origins.extend((0..4).map(|_| offset + 0.5 * scale * in_cube(&mut rng)));
        for origin in origins {
            for aim in aims(&triangles, &mut rng) {
                let ray = half_line(origin, (aim - origin).normalize());
                let hits = all(&transparent, &ray);
                assert_eq!(hits.len(), 1, "mesh {number}: {ray:?} {hits:?}");
                assert_eq!(solid.closest(&ray), Some(hits[0]));
                assert!(solid.occluded(&ray) && transparent.occluded(&ray));
                let error = (origin + hits[0].t * ray.direction - aim).length();
                assert!(error < 1e-5 * (scale + offset.length()), "{error}");
                count += 1;
            }
        }
    }
    assert!(count > 100_000);
}

#[test]
fn from_outside_a_closed_mesh_lines_cross_evenly() {
    for (number, (triangles, scale, offset)) in closed_meshes().into_iter().enumerate() {
        let rays = clear(&triangles);
        let mut rng = rng(number as u64);
        for _ in 0..3 {
            let origin = offset + 5.0 * scale * direction(&mut rng);
            for aim in aims(&triangles, &mut rng) {
                let hits = all(&rays, &half_line(origin, (aim - origin).normalize()));
                assert!(hits.is_empty() || hits.len() == 2, "mesh {number}: {hits:?}");
            }
        }
    }
}

#[test]
fn axis_parallel_lines_through_grid_points_cross_each_sheet_once() {
    for scale in [1e-6, 1.0 / 3.0, 1.0, 1e6] {
        for axis in 0..3 {
            let floor = grid(16, 16, |x, y| {
                let mut p = Vec3::ZERO;
                p[(axis + 1) % 3] = scale * (x as f32 - 8.0);
                p[(axis + 2) % 3] = scale * (y as f32 - 8.0);
                p
            });
            let rays = clear(&floor);
            for triangle in &floor {
                for corner in triangle {
                    let on_rim = (0..3).any(|i| i != axis && corner[i].abs() == 8.0 * scale);
                    for sign in [-1.0, 1.0] {
                        for zero in [0.0, -0.0] {
                            let mut d = Vec3::splat(zero);
                            d[axis] = sign;
                            let mut o = *corner;
                            o[axis] = -3.0 * sign * scale;
                            let hits = all(&rays, &half_line(o, d));
                            assert!(hits.len() == 1 || on_rim && hits.is_empty(), "{o} {d} {hits:?}");
                            assert!(hits.iter().all(|hit| hit.t == 3.0 * scale));
                            // Within the sheet itself nothing is crossed.
                            d[axis] = zero;
                            d[(axis + 1) % 3] = sign;
                            o[axis] = 0.0;
                            assert!(all(&rays, &half_line(o, d)).is_empty());
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn lines_within_a_face_of_a_box_end_at_its_walls() {
    let rays = clear(&cube(4, 1.0, Vec3::ZERO));
    for zero in [0.0, -0.0] {
        for y in [-1.0, -0.5, 0.0, 0.3, 1.0] {
            // A line in the face x = ±1 is symbolically just inside or just outside.
            for x in [-1.0, 1.0] {
                let hits = all(&rays, &half_line(Vec3::new(x, y, 0.0), Vec3::new(zero, zero, 1.0)));
                assert!(hits.len() <= 1, "{hits:?}");
            }
            let y = 0.99 * y;
            let hits = all(&rays, &half_line(Vec3::new(0.5, y, 0.0), Vec3::new(zero, zero, -1.0)));
            assert_eq!(hits.len(), 1);
        }
    }
}

#[test]
fn flat_directions_do_not_lose_hits() {
    let rays = clear(&cube(8, 1.0, Vec3::ZERO));
    for exponent in 6..45 {
        let tiny = 10f32.powi(-exponent);
        for (dy, dz) in [(tiny, 0.0), (-tiny, tiny), (0.0, -tiny), (tiny, 1e-7)] {
            for y in [0.0, 0.25, -0.75] {
                let origin = Vec3::new(-0.5, y, y);
                let hits = all(&rays, &half_line(origin, Vec3::new(1.0, dy, dz)));
                assert_eq!(hits.len(), 1, "{tiny} {hits:?}");
                assert_eq!(hits[0].t, 1.5);
            }
        }
    }
}

#[test]
fn scaling_by_powers_of_two_changes_nothing_but_t() {
    let soup: Vec<[Vec3; 3]> = {
        let mut rng = rng(7);
        let mut near = |p: Vec3| p + 0.2 * in_cube(&mut rng);
        let centres = uv_sphere(12, 12, 1.0, Vec3::ZERO);
        centres.into_iter().map(|corners| corners.map(&mut near)).collect()
    };
    let plain = clear(&soup);
    for exponent in [-20, -7, 1, 20] {
        let scale = 2f32.powi(exponent);
        let scaled = clear(&soup.iter().map(|corners| corners.map(|p| scale * p)).collect::<Vec<_>>());
        let mut rng = rng(8);
        for _ in 0..2000 {
            let (origin, direction) = (in_cube(&mut rng), direction(&mut rng));
            let mut expected = all(&plain, &half_line(origin, direction));
            expected.iter_mut().for_each(|hit| hit.t *= scale);
            assert_eq!(all(&scaled, &half_line(scale * origin, direction)), expected);
        }
    }
}

#[test]
fn cameras_far_outside_see_closed_meshes_without_holes() {
    let triangles = uv_sphere(64, 32, 1.0, Vec3::ZERO);
    let rays = clear(&triangles);
    let mut rng = rng(9);
    for distance in [1e1, 1e3, 1e5, 1e6] {
        let origin = distance * direction(&mut rng);
        for aim in aims(&triangles, &mut rng) {
            let ray = half_line(origin, (0.9 * aim - origin).normalize());
            assert_eq!(all(&rays, &ray).len() % 2, 0);
        }
        // f32 directions are 6e-8 coarse: where that is less than the sphere, its middle is always hit.
        let hits = all(&rays, &half_line(origin, -(origin / distance)));
        assert_eq!(hits.len(), 2, "{distance}");
    }
}
