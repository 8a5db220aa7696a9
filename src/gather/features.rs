//! What denoisers are to know of a pixel: the surfaces that are seen in mirrors and through glass, and not the mirrors and the glass.
//!
//! Open Image Denoise and the filters of its kind ask for this of perfectly specular surfaces: the albedo and the normal of what their
//! delta lobes show, blended by Fresnel's share.

use crate::light::Row;
use crate::optics::Bsdf;
use crate::rays::Rays;
use crate::scene::SurfacePoint;
use glam::Vec3;

/// Sums over the first surfaces with a finite lobe along each line of a camera path.
#[derive(Clone, Copy, Debug)]
pub struct Features {
    /// Their reflectance, re-radiation aside, as the pixel reads it: each times what mirrors, glass and holes before it let through.
    pub albedo: Vec3,
    normals: Vec3,
    weight: f32,
}

impl Features {
    /// Nothing is seen.
    pub(super) const EMPTY: Self = Self { albedo: Vec3::ZERO, normals: Vec3::ZERO, weight: 0.0 };

    /// The mean of their shading normals, each towards where the line came from, by what the pixel reads of them; no longer than 1, and
    /// zero where nothing is seen.
    pub fn normal(&self) -> Vec3 {
        if self.weight > 0.0 { self.normals / self.weight } else { Vec3::ZERO }
    }

    /// Adds a surface that `row` reads. One that sends nothing on, as lamps do, counts by its normal.
    pub(super) fn add(&mut self, rays: &Rays, row: Row, point: &SurfacePoint, wo: Vec3, bsdf: &Bsdf) {
        let grey = |row: Row| row.colours().element_sum() / 3.0;
        let mut weight: f32 = if bsdf.terms.is_empty() { grey(row) } else { 0.0 };
        for term in &bsdf.terms {
            let lobe = rays.lobe_at(term.lobe, point);
            if term.turn.is_reradiated() || lobe.is_delta() || !lobe.responds(&point.normals, wo) {
                continue;
            }
            let read = row * term.coefficient;
            self.albedo += read.turn.outgoing(read.colours() * lobe.albedo());
            // Lobes of one surface share its normal.
            weight = weight.max(grey(read));
        }
        self.normals += weight * point.normals.facing(wo);
        self.weight += weight;
    }
}
