//! The one place where a hit becomes matter.

use super::texture::Texture;
use super::{Emission, Inputs, Material, NormalMap, Part, Pbr, Scene, Surface, SurfacePoint};
use crate::light::Light;
use crate::optics::{Bsdf, Normals};
use glam::Vec3;
use std::borrow::Cow;
use std::sync::Arc;

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
    /// What it radiates there.
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

    /// What lights other things from a point of a triangle: of a luminaire that is `part` of it and has `mean` emission. None: all of
    /// it, which shines alike.
    #[inline]
    pub(crate) fn radiance_at(&self, point: &SurfacePoint, part: Option<Part>, mean: Emission) -> Light {
        match (part, &self.material_of(point.triangle).pattern) {
            (Some(_), Some(pattern)) => mean.with(pattern.radiance(&self.mesh.inputs(point, 0.0))).radiance,
            _ => mean.radiance,
        }
    }

    /// What is radiated at the point itself, where [`MatterAt::seen`] is the mean over a footprint.
    pub(crate) fn emission_at(&self, point: &SurfacePoint) -> Option<Emission> {
        let material = self.material_of(point.triangle);
        let uneven = material.pattern.as_ref().filter(|pattern| pattern.shines_unevenly());
        let emission = material.emission?;
        let there = uneven.map(|pattern| emission.with(pattern.radiance(&self.mesh.inputs(point, 0.0))));
        Some(there.unwrap_or(emission))
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
        if let Some(map) = &pattern.normal {
            point.normals = self.mapped(map, &point, &inputs);
        }
        let seen = match material.emission {
            Some(emission) if pattern.shines_unevenly() => Some(emission.with(pattern.radiance(&inputs))),
            alike => alike,
        };
        MatterAt { surface, material, point, bsdf: material.at(&inputs), seen }
    }

    /// Normals at a point whose own are those of the mesh.
    fn mapped(&self, map: &NormalMap, point: &SurfacePoint, inputs: &Inputs) -> Normals {
        match self.mesh.tangent(point, Some(&map.texture)) {
            Some((tangent, up)) => map.at(&point.normals, tangent, up, inputs),
            None => point.normals,
        }
    }

    /// How the shading normal changes with a small `step` (m) in the plane of the triangle at a point of it; zero where it is
    /// the same all over. m⁻¹ times m. That of a normal map from one texel to the next.
    pub(crate) fn bend(&self, met: &MatterAt<'_>, step: Vec3) -> Vec3 {
        let (point, smooth) = (&met.point, met.surface.smooth);
        let SurfacePoint { triangle, u, v, .. } = *point;
        let map = met.material.pattern.as_ref().and_then(|pattern| pattern.normal.as_ref());
        let Some(map) = map else {
            return if smooth { self.mesh.bend(triangle, u, v, step) } else { Vec3::ZERO };
        };
        let texel = map.texture.texel_width() / self.mesh.stretch(triangle, usize::from(map.texture.set & 1));
        let length = step.length();
        if length == 0.0 || !texel.is_finite() {
            return Vec3::ZERO;
        }
        let [du, dv] = self.mesh.barycentric_step(triangle, step * (0.5 * texel / length));
        let at = |sign: f32| {
            let there = self.mesh.point(triangle, u + sign * du, v + sign * dv, smooth);
            self.mapped(map, &there, &self.mesh.inputs(&there, 0.0)).shading
        };
        (at(1.0) - at(-1.0)) * (length / texel)
    }
}

impl MatterAt<'_> {
    /// True where the shading normal is not that of the triangle.
    pub(crate) fn has_own_normals(&self) -> bool {
        let mapped = |pattern: &Arc<Pbr>| pattern.normal.is_some();
        self.surface.smooth || self.material.pattern.as_ref().is_some_and(mapped)
    }
}
