//! Against tests of every triangle, in arithmetic of their own.

use super::*;

/// Every triangle, by signed volumes in f64. None where the answer hangs on rounding.
fn every_triangle(triangles: &[[Vec3; 3]], ray: &Ray) -> Option<Vec<(f64, u32)>> {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let mut hits = Vec::new();
    for (index, corners) in triangles.iter().enumerate() {
        let [a, b, c] = corners.map(|p| p.as_dvec3() - o);
        let volumes = [b.cross(c).dot(d), c.cross(a).dot(d), a.cross(b).dot(d)];
        let normal = (b - a).cross(c - a);
        if normal == DVec3::ZERO {
            continue;
        }
        let size = a.length().max(b.length()).max(c.length());
        let unsure = 1e-12 * size * size;
        if volumes.iter().any(|volume| volume.abs() < unsure)
            && (volumes.iter().all(|v| *v > -unsure) || volumes.iter().all(|v| *v < unsure))
        {
            return None;
        }
        if volumes.iter().all(|v| *v > 0.0) || volumes.iter().all(|v| *v < 0.0) {
            let t = normal.dot(a) / normal.dot(d);
            if t.abs() < 1e-12 || (t / f64::from(ray.t_max) - 1.0).abs() < 1e-12 {
                return None;
            }
            if t > 0.0 && t < f64::from(ray.t_max) {
                hits.push((t, index as u32, normal.dot(d) > 0.0));
            }
        }
    }
    hits.sort_by(|a, b| (a.0 as f32, a.2, a.1).partial_cmp(&(b.0 as f32, b.2, b.1)).unwrap());
    Some(hits.into_iter().map(|(t, index, _)| (t, index)).collect())
}

#[test]
fn random_soups_agree_with_brute_force() {
    let mut compared = 0;
    for number in 0..40 {
        let mut rng = rng(100 + number);
        let count = [0, 1, 2, 3, 9, 30, 200, 1000][number as usize % 8];
        let size = [1.0, 0.3, 0.03][number as usize % 3];
        let mut soup: Vec<[Vec3; 3]> = Vec::new();
        for i in 0..count {
            let middle = in_cube(&mut rng);
            let mut corners = [(); 3].map(|()| middle + size * in_cube(&mut rng));
            match i % 7 {
                // Degenerate: a point, a doubled corner.
                0 => corners = [corners[0]; 3],
                1 => corners[2] = corners[0],
                // Coincident, wound the other way.
                2 if i > 2 => corners = [soup[i - 2][1], soup[i - 2][0], soup[i - 2][2]],
                // In an axis plane.
                3 => corners = corners.map(|p| p.with_y(middle.y)),
                // Shares an edge.
                4 => corners = [soup[i - 1][0], soup[i - 1][2], corners[2]],
                _ => {}
            }
            soup.push(corners);
        }
        let (transparent, solid) = (clear(&soup), opaque(&soup));
        for i in 0..500 {
            let t_max = if i % 3 == 0 { 2.0 * rng.f32() } else { f32::INFINITY };
            let ray = Ray { t_max, ..half_line(1.5 * in_cube(&mut rng), direction(&mut rng)) };
            let Some(expected) = every_triangle(&soup, &ray) else { continue };
            let hits = all(&transparent, &ray);
            let ids = |hits: &[Hit]| hits.iter().map(|hit| hit.triangle).collect::<Vec<_>>();
            assert_eq!(ids(&hits), expected.iter().map(|hit| hit.1).collect::<Vec<_>>(), "{ray:?}");
            for (hit, (t, _)) in hits.iter().zip(&expected) {
                assert!((f64::from(hit.t) - t).abs() <= 1e-7 * t, "{} {t}", hit.t);
                let [a, b, c] = soup[hit.triangle as usize].map(DVec3::from);
                let at = ray.origin.as_dvec3() + t * ray.direction.as_dvec3();
                let (u, v) = (f64::from(hit.u), f64::from(hit.v));
                assert!((a + u * (b - a) + v * (c - a) - at).length() < 1e-6);
            }
            assert_eq!(solid.closest(&ray), hits.first().copied());
            assert_eq!(all(&solid, &ray), Vec::from_iter(hits.first().copied()));
            assert_eq!(solid.occluded(&ray), !hits.is_empty());
            compared += 1;
        }
    }
    assert!(compared > 19_000, "{compared}");
}

/// −1: the line misses the triangle; 1: it meets its inside in front; 0: it meets its rim or starts on it.
fn exactly(corners: [[i64; 3]; 3], o: [i64; 3], d: [i64; 3]) -> i32 {
    let minus = |a: [i64; 3], b: [i64; 3]| [0, 1, 2].map(|i| a[i] - b[i]);
    let cross = |a: [i64; 3], b: [i64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let dot = |a: [i64; 3], b: [i64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let [a, b, c] = corners.map(|p| minus(p, o));
    let volumes = [dot(cross(b, c), d), dot(cross(c, a), d), dot(cross(a, b), d)];
    let normal = cross(minus(b, a), minus(c, a));
    let (slope, height) = (dot(normal, d), dot(normal, a));
    if slope == 0 {
        // Within the plane: the line is not quite itself once its slopes are rounded.
        return if height == 0 { 0 } else { -1 };
    }
    if height.signum() * slope.signum() < 0 {
        return -1;
    }
    let sides = volumes.map(|volume| volume.signum() * slope.signum());
    if sides.contains(&-1) {
        -1
    } else if sides.contains(&0) || height == 0 {
        0
    } else {
        1
    }
}

#[test]
fn small_integers_agree_with_exact_arithmetic() {
    let mut rng = rng(2);
    let mut rims = 0;
    for _ in 0..60 {
        let mut point = || [(); 3].map(|()| i64::from(rng.u32() % 7) - 3);
        let soup: Vec<[[i64; 3]; 3]> = (0..40).map(|_| [point(), point(), point()]).collect();
        let float = |p: [i64; 3]| Vec3::from(p.map(|x| x as f32));
        let rays = clear(&soup.iter().map(|corners| corners.map(float)).collect::<Vec<_>>());
        for _ in 0..300 {
            let (o, d) = (point(), point());
            if d == [0; 3] {
                continue;
            }
            // Not of unit length, so that the line is exactly the integer one.
            let hits = all(&rays, &half_line(float(o), float(d)));
            for (index, corners) in soup.iter().enumerate() {
                let hit = hits.iter().filter(|hit| hit.triangle == index as u32).count();
                match exactly(*corners, o, d) {
                    1 => assert_eq!(hit, 1),
                    0 => rims += 1,
                    _ => assert_eq!(hit, 0, "{corners:?} {o:?} {d:?}"),
                }
                assert!(hit <= 1);
            }
        }
    }
    assert!(rims > 1000, "{rims}");
}
