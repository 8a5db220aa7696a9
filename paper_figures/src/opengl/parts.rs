//! A scene as the fixed-function pipeline takes it: corners that are lit one by one.

use super::calls::Part;
use glam::{Mat4, Vec3, Vec4};
use halflight::optics::Lobe;
use halflight::scene::{Camera, Mesh, Projection, Scene};

/// One part for each surface of the scene. Flat triangles, which have no corners to be lit in between, are divided until no
/// edge is longer than `edge` (m); the surface stays the same.
pub(super) fn parts(scene: &Scene, edge: f32) -> Vec<Part> {
    let mut parts: Vec<Part> = scene
        .surfaces
        .iter()
        .map(|surface| Part { albedo: albedo(scene, surface.material), ..Part::default() })
        .collect();
    for (index, surface) in scene.surfaces.iter().enumerate() {
        let mine = |triangle: &u32| scene.mesh.surface[*triangle as usize] as usize == index;
        let triangles = (0..scene.mesh.triangles.len() as u32).filter(mine);
        if surface.smooth {
            share_corners(&mut parts[index], &scene.mesh, triangles);
        } else {
            triangles.for_each(|triangle| divide(&mut parts[index], &scene.mesh, triangle, edge));
        }
    }
    parts.retain(|part| !part.indices.is_empty());
    parts
}

/// Diffuse reflectance of all lobes together; OpenGL knows no others.
fn albedo(scene: &Scene, material: u32) -> Vec3 {
    let lobes = scene.materials[material as usize].lobes.iter();
    lobes
        .map(|(share, lobe)| match lobe {
            Lobe::Diffuse(diffuse) => *share * diffuse.albedo,
            _ => Vec3::ZERO,
        })
        .sum()
}

fn share_corners(part: &mut Part, mesh: &Mesh, triangles: impl Iterator<Item = u32>) {
    let mut place = vec![u32::MAX; mesh.positions.len()];
    for triangle in triangles {
        for corner in mesh.triangles[triangle as usize] {
            let place = &mut place[corner as usize];
            if *place == u32::MAX {
                *place = part.positions.len() as u32;
                part.positions.push(mesh.positions[corner as usize]);
                part.normals.push(mesh.normals[corner as usize]);
            }
            part.indices.push(*place);
        }
    }
}

fn divide(part: &mut Part, mesh: &Mesh, triangle: u32, edge: f32) {
    let [a, b, c] = mesh.corners(triangle);
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let n = (longest / edge).ceil().max(1.0) as u32;
    let normal = mesh.normal(triangle);
    let first = part.positions.len() as u32;
    // Row i has n − i + 1 corners, so that row i begins after the sum of those before it.
    let at = |i: u32, j: u32| first + i * (n + 1) - i * i.saturating_sub(1) / 2 + j;
    for i in 0..=n {
        for j in 0..=n - i {
            let (u, v) = (i as f32 / n as f32, j as f32 / n as f32);
            part.positions.push((1.0 - u - v) * a + u * b + v * c);
            part.normals.push(normal);
        }
    }
    for i in 0..n {
        for j in 0..n - i {
            part.indices.extend([at(i, j), at(i + 1, j), at(i, j + 1)]);
            if j + 1 < n - i {
                part.indices.extend([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
}

/// From scene space to the eye's: it looks along −z.
pub(super) fn view(camera: &Camera) -> Mat4 {
    let rotation = Mat4::from_cols(
        camera.right.extend(0.0),
        camera.up.extend(0.0),
        (-camera.forward).extend(0.0),
        Vec4::W,
    );
    rotation.transpose() * Mat4::from_translation(-camera.position)
}

/// From the eye's space to the canvas, so that pixel centres see what `camera` sees at `[x, y]` of each pixel, in [0, 1]²
/// from its top left.
pub(super) fn projection(
    camera: &Camera,
    (width, height): (u32, u32),
    [x, y]: [f32; 2],
    (near, far): (f32, f32),
) -> Mat4 {
    let aspect = width as f32 / height as f32;
    let shift = Vec3::new((1.0 - 2.0 * x) / width as f32, (2.0 * y - 1.0) / height as f32, 0.0);
    let depth = far - near;
    let centred = match camera.projection {
        Projection::Perspective { yfov } => {
            let h = (0.5 * yfov).tan();
            Mat4::from_cols(
                Vec4::new(1.0 / (h * aspect), 0.0, 0.0, 0.0),
                Vec4::new(0.0, 1.0 / h, 0.0, 0.0),
                Vec4::new(0.0, 0.0, -(far + near) / depth, -1.0),
                Vec4::new(0.0, 0.0, -2.0 * far * near / depth, 0.0),
            )
        }
        Projection::Orthographic { half_height: h } => Mat4::from_cols(
            Vec4::new(1.0 / (h * aspect), 0.0, 0.0, 0.0),
            Vec4::new(0.0, 1.0 / h, 0.0, 0.0),
            Vec4::new(0.0, 0.0, -2.0 / depth, 0.0),
            Vec4::new(0.0, 0.0, -(far + near) / depth, 1.0),
        ),
    };
    Mat4::from_translation(shift) * centred
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_divided_triangle_is_the_same_surface() {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X * 2.0, Vec3::Z * -1.0],
            normals: vec![],
            triangles: vec![[0, 1, 2]],
            surface: vec![0],
            ..Mesh::default()
        };
        let mut part = Part::default();
        divide(&mut part, &mesh, 0, 0.3);
        assert_eq!(part.indices.len(), 3 * 8 * 8);
        let mut area = 0.0;
        for corners in part.indices.chunks(3) {
            let [a, b, c] = [0, 1, 2].map(|k| part.positions[corners[k] as usize]);
            let cross = (b - a).cross(c - a);
            assert!(cross.normalize().distance(mesh.normal(0)) < 1e-5, "turned over");
            assert!(a.distance(b).max(b.distance(c)).max(c.distance(a)) < 0.3);
            area += 0.5 * cross.length();
        }
        assert!((area - mesh.area(0)).abs() < 1e-5, "{area}");
    }

    #[test]
    fn the_canvas_is_the_cameras_film() {
        let eye = Vec3::new(0.3, 1.6, 5.2);
        let projection_of = Projection::Perspective { yfov: 0.6 };
        let camera = Camera::look_at(eye, Vec3::new(0.1, 0.6, 0.0), Vec3::Y, projection_of);
        let (size, sample) = ((40, 30), [0.2, 0.9]);
        let matrix = projection(&camera, size, sample, (0.1, 10.0)) * view(&camera);
        for (column, row) in [(0.0, 0.0), (17.0, 4.0), (39.0, 29.0)] {
            let (x, y) = ((column + sample[0]) / 40.0, (row + sample[1]) / 30.0);
            let (origin, direction) = camera.ray(x, y, 4.0 / 3.0);
            let point = matrix * (origin + 3.0 * direction).extend(1.0);
            // Centre of pixel (column, row) in normalised device coordinates.
            let expected = (2.0 * (column + 0.5) / 40.0 - 1.0, 1.0 - 2.0 * (row + 0.5) / 30.0);
            let got = (point.x / point.w, point.y / point.w);
            assert!(
                (got.0 - expected.0).abs() < 1e-5 && (got.1 - expected.1).abs() < 1e-5,
                "{got:?} {expected:?}"
            );
        }
    }
}
