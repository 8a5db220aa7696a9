//! The one place where a hit becomes matter.

use super::texture::Texture;
use super::{Emission, Material, Pbr, Scene, Surface, SurfacePoint};
use crate::optics::Bsdf;
use glam::Vec3;
use std::borrow::Cow;

/// What a line meets at a point.
#[derive(Clone, Debug)]
pub struct MatterAt<'a> {
    /// What the triangle belongs to.
    pub surface: &'a Surface,
    /// What that is made of.
    pub material: &'a Material,
    /// Where it is; a normal map has turned its shading normal.
    pub point: SurfacePoint,
    /// The matrix BSDF there.
    pub bsdf: Cow<'a, Bsdf>,
    /// What whoever looks there, by way of mirrors and glass alone, sees it radiate. What lights other things is the
    /// material's own emission.
    pub seen: Option<Emission>,
}

impl Scene {
    /// Matter at the point of `triangle` with barycentric weights (1 − u − v, u, v), as it is on average over `footprint`: the side
    /// (m) of what looks, on a surface that faces it; 0: a point.
    #[inline]
    pub fn matter_at(&self, triangle: u32, u: f32, v: f32, footprint: f32) -> MatterAt<'_> {
        let surface = self.surface_of(triangle);
        let material = &self.materials[surface.material as usize];
        let point = self.mesh.point(triangle, u, v, surface.smooth);
        match &material.pattern {
            None => {
                let (bsdf, seen) = (Cow::Borrowed(&material.bsdf), material.emission);
                MatterAt { surface, material, point, bsdf, seen }
            }
            Some(pattern) => self.patterned(pattern, surface, material, point, footprint),
        }
    }

    /// Right and up of a grain that is laid out as `texture`, or as the first set of texture coordinates.
    fn grain(&self, point: &SurfacePoint, texture: Option<&Texture>) -> Option<(Vec3, Vec3)> {
        let (tangent, up) = self.mesh.tangent(point, texture)?;
        let out = point.normals.shading;
        let right = (tangent - tangent.dot(out) * out).try_normalize()?;
        Some((right, up * out.cross(right)))
    }

    #[inline(never)]
    fn patterned<'a>(
        &'a self,
        pattern: &Pbr,
        surface: &'a Surface,
        material: &'a Material,
        mut point: SurfacePoint,
        footprint: f32,
    ) -> MatterAt<'a> {
        let mut inputs = self.mesh.inputs(&point, footprint);
        if let Some(grain) = &pattern.anisotropy {
            inputs.tangent = self.grain(&point, grain.texture.as_ref().or(pattern.base.texture.as_ref()));
        }
        if let Some(map) = &pattern.normal
            && let Some((tangent, up)) = self.mesh.tangent(&point, Some(&map.texture))
        {
            point.normals = map.at(&point.normals, tangent, up, &inputs);
        }
        let seen = match material.emission {
            Some(emission) if pattern.shows_picture() => {
                Some(Emission { radiance: pattern.radiance(&inputs), ..emission })
            }
            mean => mean,
        };
        MatterAt { surface, material, point, bsdf: material.at(&inputs), seen }
    }
}
