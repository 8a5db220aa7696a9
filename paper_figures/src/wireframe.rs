//! The mesh as the camera sees it.

use glam::Vec3;
use halflight::rays::{Ray, Rays};
use halflight::scene::Scene;
use rayon::prelude::*;

/// Triangles that are seen within columns and rows `[x, y, width, height]` of a film of the given size, drawn `by` times as large;
/// and how many.
pub fn wireframe(
    scene: &Scene,
    size: (u32, u32),
    [x, y, width, height]: [u32; 4],
    by: u32,
) -> (String, usize) {
    let rays = Rays::build(scene);
    let (film_width, film_height) = (size.0 as f32, size.1 as f32);
    let aspect = film_width / film_height;
    let place = |p: Vec3| {
        let [u, v] = scene.camera.film(p, aspect)?;
        let scale = by as f32;
        Some([scale * (u * film_width - x as f32), scale * (v * film_height - y as f32)])
    };
    let (w, h) = ((by * width) as f32, (by * height) as f32);
    let drawn: Vec<String> = (0..scene.mesh.triangles.len() as u32)
        .into_par_iter()
        .filter_map(|triangle| {
            let corners = scene.mesh.corners(triangle);
            let places = [place(corners[0])?, place(corners[1])?, place(corners[2])?];
            let inside = |[x, y]: [f32; 2]| (0.0..=w).contains(&x) && (0.0..=h).contains(&y);
            if !places.into_iter().any(inside) {
                return None;
            }
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            let [u, v] = scene.camera.film(middle, aspect)?;
            let (origin, direction) = scene.camera.ray(u, v, aspect);
            let hit = rays.closest(&Ray { origin, direction, t_max: f32::INFINITY })?;
            let [a, b, c] = places;
            (hit.triangle == triangle)
                .then(|| format!("M{:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}z", a[0], a[1], b[0], b[1], c[0], c[1]))
        })
        .collect();
    let svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#000\"/>\n\
         <path d=\"{}\" fill=\"none\" stroke=\"#9cc4ff\" stroke-width=\"0.7\"/>\n</svg>\n",
        drawn.concat()
    );
    (svg, drawn.len())
}
